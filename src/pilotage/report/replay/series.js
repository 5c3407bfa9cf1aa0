// The panels beside the map: drawn once, then only the cursor moves.
class ReplaySeries {
  constructor(canvas, scene, colours) {
    this.canvas = canvas;
    this.scene = scene;
    this.colours = colours;
    this.still = document.createElement("canvas");
  }

  resize() {
    const box = this.canvas.getBoundingClientRect();
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.width = Math.max(box.width, 1);
    this.height = Math.max(box.height, 1);
    for (const c of [this.canvas, this.still]) {
      c.width = Math.round(this.width * this.ratio);
      c.height = Math.round(this.height * this.ratio);
    }
    this.left = 46;
    this.right = 8;
    this.drawStill();
  }

  px(t) {
    const times = this.scene.t_s, start = times[0], end = times[times.length - 1];
    return this.left + ((t - start) / (end - start)) * (this.width - this.left - this.right);
  }

  time(px) {
    const times = this.scene.t_s, start = times[0], end = times[times.length - 1];
    return start + ((px - this.left) / (this.width - this.left - this.right)) * (end - start);
  }

  panel(k) {
    const n = this.scene.series.length, each = (this.height - 6) / n;
    return { top: k * each + 20, bottom: (k + 1) * each - 6 };
  }

  // Peak over the run; a band that starts far too large (the first moments) does not flatten the rest.
  top(series) {
    let peak = 0;
    for (const values of [series.values, series.other]) for (const v of values || []) if (v > peak) peak = v;
    if (series.band) {
      const sorted = Float32Array.from(series.band).filter((v) => v === v).sort();
      if (sorted.length) peak = Math.max(peak, 1.2 * sorted[Math.floor(0.98 * (sorted.length - 1))]);
    }
    return peak > 0 ? 1.08 * peak : 1;
  }

  low(series) {
    let low = 0;
    for (const values of [series.values, series.other]) for (const v of values || []) if (v < low) low = v;
    return 1.08 * low;
  }

  drawStill() {
    const pen = this.still.getContext("2d");
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.fillStyle = this.colours.paper;
    pen.fillRect(0, 0, this.width, this.height);
    this.scene.series.forEach((series, k) => {
      const { top, bottom } = this.panel(k), low = this.low(series), high = this.top(series);
      const y = (v) => bottom - ((v - low) / (high - low)) * (bottom - top);
      pen.font = "600 12px system-ui, sans-serif";
      pen.textAlign = "left";
      pen.textBaseline = "alphabetic";
      pen.fillStyle = this.colours.ink;
      pen.fillText(this.title(series), 4, top - 7);
      pen.strokeStyle = this.colours.line;
      pen.lineWidth = 1;
      pen.font = "11px system-ui, sans-serif";
      pen.fillStyle = this.colours.muted;
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      for (const tick of this.ticks(low, high)) {
        pen.beginPath(); pen.moveTo(this.left, y(tick)); pen.lineTo(this.width - this.right, y(tick)); pen.stroke();
        pen.fillText(String(+tick.toPrecision(3)), this.left - 5, y(tick));
      }
      pen.save();
      pen.beginPath(); pen.rect(this.left, top - 1, this.width - this.left - this.right, bottom - top + 2); pen.clip();
      if (series.band) this.band(pen, series.band, y);
      if (series.other) this.curve(pen, series.other, y, this.colours.muted, 1);
      this.curve(pen, series.values, y, this.colours[series.colour] || series.colour, 1.4);
      pen.restore();
    });
  }

  ticks(low, high) {
    const step0 = (high - low) / 3, power = 10 ** Math.floor(Math.log10(step0));
    const step = power * [1, 2, 5, 10].find((s) => s * power >= step0), ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
    return ticks;
  }

  // Least and greatest value a column of pixels: peaks are never thinned away.
  columns(values) {
    const columns = new Map();
    for (let i = 0; i < values.length; i++) {
      const v = values[i];
      if (v !== v) continue;
      const x = Math.round(this.px(this.scene.t_s[i]) * 2) / 2, seen = columns.get(x);
      if (seen) { seen[0] = Math.min(seen[0], v); seen[1] = Math.max(seen[1], v); seen[3] = i; }
      else columns.set(x, [v, v, i, i]);
    }
    return columns;
  }

  curve(pen, values, y, colour, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    let last = -2;
    for (const [x, [low, high, first, end]] of this.columns(values)) {
      if (first - last > 1) pen.moveTo(x, y(low)); else pen.lineTo(x, y(low));
      pen.lineTo(x, y(high));
      last = end;
    }
    pen.stroke();
  }

  band(pen, values, y) {
    pen.fillStyle = this.colours.muted;
    pen.globalAlpha = 0.28;
    const columns = [...this.columns(values)];
    columns.forEach(([x, [, high]], k) => {
      const next = k + 1 < columns.length && columns[k + 1][1][2] - columns[k][1][3] === 1 ? columns[k + 1][0] : x + 1;
      pen.fillRect(x, y(high), next - x, y(0) - y(high));
    });
    pen.globalAlpha = 1;
  }

  draw(t, i) {
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this.still, 0, 0);
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const x = this.px(t);
    pen.strokeStyle = this.colours.bad;
    pen.lineWidth = 1.5;
    pen.beginPath(); pen.moveTo(x, 0); pen.lineTo(x, this.height); pen.stroke();
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.textBaseline = "alphabetic";
    pen.fillStyle = this.colours.ink;
    this.scene.series.forEach((series, k) => {
      const value = series.values[i];
      const digits = this.digits(series);
      const said = [!series.unit && Number.isInteger(value) ? String(value) : this.number(value, digits)];
      if (series.band) said.push(`${series.band_name} ${this.number(series.band[i], digits)}`);
      if (series.other) said.push(`${series.other_name} ${this.number(series.other[i], digits)}`);
      // Beside the title there may be room for the value only.
      const title = pen.measureText(this.title(series)).width * 1.15 + 16;
      while (said.length > 1 && title + pen.measureText(said.join(" · ")).width > this.width - this.right) said.pop();
      pen.fillText(said.join(" · "), this.width - this.right, this.panel(k).top - 7);
    });
  }

  title(series) { return series.unit ? `${series.title} [${series.unit}]` : series.title; }

  // Decimals of small values: three digits of the panel's largest one, so that what is tiny all along is told.
  digits(series) {
    if (series.digits === undefined) {
      const size = Math.max(this.top(series), -this.low(series));
      series.digits = Math.min(Math.max(2 - Math.floor(Math.log10(size)), 4), 20);
    }
    return series.digits;
  }

  number(v, digits) { return v === v ? (v === 0 ? "0" : v.toFixed(Math.abs(v) < 0.1 ? digits : 2)) : "–"; }
}
