// Times as people say them: tenths of a second, or of long runs days, hours and minutes.
const LONG_S = 7200;
function saidTime(t, span) {
  if (span <= LONG_S) return `${t.toFixed(1)} s`;
  const minutes = Math.floor(t / 60 + 1e-6), two = (n) => String(n).padStart(2, "0");
  const hours = Math.floor(minutes / 60), clock = `${two(hours % 24)} h ${two(minutes % 60)} min`;
  return span < 86400 ? clock : `${Math.floor(hours / 24)} d ${clock}`;
}

// The player: clock, controls, keyboard, pointer and touch. It never starts by itself.
class ReplayPlayer {
  constructor(root, scene) {
    this.root = root;
    this.scene = scene;
    this.start = scene.t_s[0];
    this.end = scene.t_s[scene.t_s.length - 1];
    this.t = this.start;
    this.playing = false;
    this.span = this.end - this.start;
    this.long = this.span > LONG_S;
    this.follow = false;
    this.frames = 0;
    this.find = (name) => root.querySelector(`[data-replay-${name}]`);
    this.speed = Number(this.find("speed").value);
    const style = getComputedStyle(document.documentElement);
    const colours = { paper: getComputedStyle(document.body).backgroundColor };
    for (const name of ["ink", "muted", "line", "soft", "bad"]) colours[name] = style.getPropertyValue(`--${name}`).trim() || "#444";
    this.map = new ReplayMap(this.find("map"), scene, colours);
    this.series = new ReplaySeries(this.find("series"), scene, colours);
    if (!scene.series.length) this.find("series").remove();
    this.ellipses = this.map.axes.some((pair) => pair[0] > 0);
    if (!this.ellipses) this.find("exaggerate").parentElement.remove();
    this.fillLayers();
    this.fillEvents();
    this.listen();
    root.hidden = false;
    this.resize(true);
    new ResizeObserver(() => this.resize(false)).observe(root);
  }

  resize(first) {
    const width = this.map.width;
    this.map.resize();
    // Who has chosen a view keeps it.
    if (first || (Math.abs(width - this.map.width) > 1 && !this.chosen && !this.zoomed && !this.follow)) this.map.fit();
    if (this.scene.series.length) this.series.resize();
    this.draw();
  }

  seek(t) {
    this.t = Math.min(Math.max(t, this.start), this.end);
    this.draw();
  }

  play(on) {
    if (on && this.t >= this.end) this.t = this.start;
    this.playing = on;
    const button = this.find("play");
    button.textContent = on ? "❚❚ pause" : "▶ play";
    button.setAttribute("aria-pressed", String(on));
    this.last = undefined;
    if (on) requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    // A page in the background gets no frames: the clock then stands still and does not leap.
    if (this.last !== undefined) this.t += Math.min(now - this.last, 200) / 1000 * this.speed;
    this.last = now;
    this.frames++;
    if (this.t >= this.end) { this.t = this.end; this.play(false); }
    this.draw();
    if (this.playing) requestAnimationFrame((next) => this.tick(next));
  }

  draw() {
    const times = this.scene.t_s, i = Math.max(lastBefore(times, this.t + 1e-5), 0);
    const share = i + 1 < times.length ? Math.min(Math.max((this.t - times[i]) / (times[i + 1] - times[i]), 0), 1) : 0;
    this.frame = i;
    const states = this.scene.states, number = states ? states.numbers[i] : -1;
    const known = states && number >= 0 && number < states.names.length;
    this.map.stateColour = known ? states.colours[number] : null;
    if (this.follow) {
      const pose = this.scene.poses.map((track) => this.map.pose(track, i, share)).find(([x, y]) => x === x && y === y);
      if (pose) [this.map.x, this.map.y] = pose;
    }
    this.map.draw(this.t, i, share);
    if (this.scene.series.length) this.series.draw(this.t, i);
    this.say(i, known ? states.names[number] : "", known ? states.colours[number] : "");
  }

  say(i, state, colour) {
    const put = (name, text) => { const at = this.find(name); if (at.textContent !== text) at.textContent = text; };
    put("clock", this.long ? `${saidTime(this.t, this.span)} of ${saidTime(this.end, this.span)}` : `${this.t.toFixed(1)} / ${this.end.toFixed(1)} s`);
    const scrub = this.find("scrub");
    scrub.value = String(this.t);
    scrub.setAttribute("aria-valuetext", this.long ? `${saidTime(this.t, this.span)} of ${saidTime(this.end, this.span)}` : `${this.t.toFixed(1)} seconds of ${this.end.toFixed(1)}`);
    put("state", state);
    this.find("state").style.borderColor = colour || "transparent";
    const absent = this.scene.poses.filter((track) => track.absent && track.x_m[i] !== track.x_m[i]);
    put("absent", absent.map((track) => track.absent).join(", "));
    const factor = this.ellipses ? this.map.factor() : 1;
    put("factor", this.ellipses && !absent.length && factor !== 1 ? `ellipse × ${factor}` : "");
    const event = this.eventAt(this.t);
    put("event", event ? `${saidTime(event.t_s, this.span)} · ${event.kind}: ${event.text}` : "");
    this.find("event").style.borderColor = event ? event.colour : "transparent";
  }

  // The last event of the last few seconds (longer at high speed, so that it can be read).
  eventAt(t) {
    const k = lastBefore(this.eventTimes, t + 1e-6);
    return k >= 0 && t - this.eventTimes[k] <= Math.max(3, 1.5 * this.speed) ? this.events[k] : null;
  }

  fillLayers() {
    const list = this.find("layers"), s = this.scene, seen = new Map();
    for (const group of [s.rasters, s.lines, s.circles, s.marks, s.paths, s.sights, s.scans, s.discs, s.poses]) {
      for (const layer of group) {
        const size = layer.lines_m || layer.circles_m;
        if (size && !size.length) continue;
        const colour = layer.colour || (layer.palette || ["muted"]).at(-1);
        // What each robot of a team has in its own colour has none of its own.
        seen.set(layer.name, seen.has(layer.name) && seen.get(layer.name) !== colour ? "muted" : colour);
      }
    }
    for (const [name, colour] of seen) {
      const label = document.createElement("label"), box = document.createElement("input"), spot = document.createElement("i");
      box.type = "checkbox";
      box.checked = true;
      box.addEventListener("change", () => {
        if (box.checked) this.map.hidden.delete(name); else this.map.hidden.add(name);
        this.draw();
      });
      spot.style.background = this.map.colour(colour);
      label.append(box, spot, name);
      list.append(label);
    }
  }

  fillEvents() {
    this.events = [...this.scene.events].sort((a, b) => a.t_s - b.t_s);
    this.eventTimes = this.events.map((event) => event.t_s);
    const ticks = this.find("ticks"), span = this.end - this.start;
    for (const event of this.events.slice(0, 400)) {
      const tick = document.createElement("i");
      tick.style.left = `${100 * Math.min(Math.max((event.t_s - this.start) / span, 0), 1)}%`;
      tick.style.background = event.colour;
      tick.title = `${saidTime(event.t_s, this.span)} · ${event.kind}: ${event.text}`;
      ticks.append(tick);
    }
    const scrub = this.find("scrub");
    scrub.min = String(this.start);
    scrub.max = String(this.end);
    scrub.step = "any";
  }

  setSpeed(speed) {
    const select = this.find("speed"), steps = [...select.options].map((option) => Number(option.value));
    this.speed = steps.reduce((best, s) => (Math.abs(s - speed) < Math.abs(best - speed) ? s : best));
    select.value = String(this.speed);
  }

  nextSpeed(by) {
    const steps = [...this.find("speed").options].map((option) => Number(option.value));
    this.setSpeed(steps[Math.min(Math.max(steps.indexOf(this.speed) + by, 0), steps.length - 1)]);
  }

  setFollow(on) {
    this.follow = on;
    this.find("follow").checked = on;
    if (on && !this.zoomed) {
      const width = this.scene.follow_m;
      if (width > 0) this.map.zoom(this.map.width / (width * this.map.scale));
      else if (this.map.scale * 12 < this.map.width / 2) this.map.zoom(2.5);
    }
    this.draw();
  }

  listen() {
    this.find("play").addEventListener("click", () => this.play(!this.playing));
    this.find("scrub").addEventListener("input", (event) => this.seek(Number(event.target.value)));
    this.find("speed").addEventListener("change", (event) => { this.speed = Number(event.target.value); });
    if (this.ellipses) this.find("exaggerate").addEventListener("change", (event) => { this.map.exaggeration = event.target.value; this.draw(); });
    this.find("follow").addEventListener("change", (event) => this.setFollow(event.target.checked));
    this.find("fit").addEventListener("click", () => this.fit());
    this.find("in").addEventListener("click", () => this.zoom(1.5));
    this.find("out").addEventListener("click", () => this.zoom(1 / 1.5));
    this.root.addEventListener("keydown", (event) => this.key(event));
    this.listenMap(this.find("map"));
    if (this.scene.series.length) this.listenSeries(this.find("series"));
  }

  fit() { this.setFollow(false); this.zoomed = this.chosen = false; this.map.fit(); this.draw(); }

  zoom(by, x, y) {
    this.zoomed = true;
    this.map.zoom(by, this.follow ? undefined : x, this.follow ? undefined : y);
    this.draw();
  }

  key(event) {
    // Lists keep their own keys; a button or a box keeps space, which presses it.
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const pressable = event.target.tagName === "BUTTON" || event.target.type === "checkbox";
    const step = (event.shiftKey ? 10 : 1) * (this.long ? 600 : 1);
    const actions = {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => this.seek(this.t - step),
      ArrowRight: () => this.seek(this.t + step),
      ArrowUp: () => this.nextSpeed(1),
      ArrowDown: () => this.nextSpeed(-1),
      Home: () => this.seek(this.start),
      End: () => this.seek(this.end),
      "+": () => this.zoom(1.25),
      "=": () => this.zoom(1.25),
      "-": () => this.zoom(1 / 1.25),
      f: () => this.setFollow(!this.follow),
      0: () => this.fit(),
    };
    const action = actions[event.key];
    if (!action || (event.key === " " && pressable)) return;
    event.preventDefault();
    action();
  }

  listenMap(canvas) {
    const fingers = new Map();
    const at = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return { d: Math.hypot(a[0] - b[0], a[1] - b[1]), x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2 };
    };
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, at(event));
      if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return;
      const before = fingers.size === 2 ? spread() : null, old = fingers.get(event.pointerId), now = at(event);
      fingers.set(event.pointerId, now);
      if (before) {
        const after = spread();
        if (!this.follow) this.map.pan(after.x - before.x, after.y - before.y);
        this.zoom(after.d / Math.max(before.d, 1), after.x, after.y);
      } else if (fingers.size === 1) {
        if (this.follow) this.setFollow(false);
        this.chosen = true;
        this.map.pan(now[0] - old[0], now[1] - old[1]);
        this.draw();
      }
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
    // The wheel belongs to the page until the map is chosen (a click or a tab), or with Ctrl, as on maps elsewhere.
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...at(event));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.fit());
  }

  listenSeries(canvas) {
    const go = (event) => this.seek(this.series.time(event.clientX - canvas.getBoundingClientRect().left));
    canvas.addEventListener("pointerdown", (event) => {
      this.dragging = true;
      if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
      go(event);
    });
    canvas.addEventListener("pointermove", (event) => { if (this.dragging) go(event); });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { this.dragging = false; });
  }
}

(async () => {
  const root = document.getElementById("replay-player");
  if (!root) return;
  try {
    root.player = new ReplayPlayer(root, await unpackScene(document.getElementById("replay-scene").textContent.trim()));
  } catch (error) {
    root.hidden = true;
    const said = document.getElementById("replay-trouble");
    said.hidden = false;
    said.textContent = `This browser cannot show the replay (${error.message}); the figures below need no script.`;
  }
})();
