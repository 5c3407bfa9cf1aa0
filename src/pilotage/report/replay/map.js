// Draws the scene's fixed layers and tracks on a canvas; world metres, y up.
class ReplayMap {
  constructor(canvas, scene, colours) {
    this.canvas = canvas;
    this.scene = scene;
    this.colours = colours;
    this.hidden = new Set();
    this.exaggeration = "auto";
    this.breaks = new Set(scene.breaks);
    this.chi = Math.sqrt(5.991);  // 95 % of a chi-square of two degrees of freedom
    this.sightStart = scene.sights.map((track) => {
      const starts = new Uint32Array(track.counts.length + 1);
      for (let k = 0; k < track.counts.length; k++) starts[k + 1] = starts[k] + track.counts[k];
      return starts;
    });
    this.ways = scene.poses.map((track) => (track.trail ? this.way(track) : null));
    this.axes = scene.poses.map((track) => this.axesOf(track));
    this.rasters = scene.rasters.map((raster) => this.startRaster(raster));
  }

  colour(name) { return this.colours[name] || name; }
  shows(layer) { return !this.hidden.has(layer.name); }

  // The whole way as one path; a carried robot's way is broken.
  way(track) {
    const path = new Path2D();
    let pen = false;
    for (let i = 0; i < track.x_m.length; i++) {
      const x = track.x_m[i], y = track.y_m[i];
      if (!(x === x && y === y)) { pen = false; continue; }
      if (pen && !this.breaks.has(i)) path.lineTo(x, y); else path.moveTo(x, y);
      pen = true;
    }
    return path;
  }

  // A typical long half axis, and one that few exceed.
  axesOf(track) {
    if (!track.cov_m2) return [0, 0];
    const axes = [];
    const stride = Math.max(1, Math.floor(track.x_m.length / 500));
    for (let i = 0; i < track.x_m.length; i += stride) {
      const axis = this.ellipse(track, i);
      if (axis) axes.push(axis.a);
    }
    axes.sort((p, q) => p - q);
    return axes.length ? [axes[axes.length >> 1], axes[Math.floor(0.95 * (axes.length - 1))]] : [0, 0];
  }

  // Half axes and direction of the 95 % ellipse, from the eigenvalues of the position's covariance.
  ellipse(track, i) {
    const xx = track.cov_m2[3 * i], xy = track.cov_m2[3 * i + 1], yy = track.cov_m2[3 * i + 2];
    if (!(xx + xy + yy === xx + xy + yy) || track.x_m[i] !== track.x_m[i]) return null;
    const middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
    return {
      a: this.chi * Math.sqrt(Math.max(middle + half, 0)),
      b: this.chi * Math.sqrt(Math.max(middle - half, 0)),
      angle: 0.5 * Math.atan2(2 * xy, xx - yy),
    };
  }

  // How many times too large ellipses are drawn: chosen so that a typical one can be seen at this zoom.
  factor() {
    if (this.exaggeration !== "auto") return Number(this.exaggeration);
    const axis = Math.max(0, ...this.axes.map((pair) => pair[0])), large = Math.max(0, ...this.axes.map((pair) => pair[1]));
    if (!(axis > 0)) return 1;
    // The large ones stay within a quarter of the view, end to end.
    const wanted = Math.min(13 / axis, 0.125 * Math.min(this.width, this.height) / large) / this.scale;
    for (const step of [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]) if (wanted <= step * 1.3) return step;
    return 1000;
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const box = this.canvas.getBoundingClientRect();
    this.width = Math.max(box.width, 1);
    this.height = Math.max(box.height, 1);
    this.ratio = ratio;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
  }

  fit() {
    const [x0, y0, x1, y1] = this.scene.bounds_m;
    const words = 46;  // what is said of the moment stands above the map and its labels, not on them
    this.scale = 0.94 * Math.min(this.width / (x1 - x0), (this.height - words) / (y1 - y0));
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2 + words / 2 / this.scale;
  }

  zoom(by, px = this.width / 2, py = this.height / 2) {
    const [x0, y0, x1, y1] = this.scene.bounds_m;
    const least = 0.3 * Math.min(this.width / (x1 - x0), this.height / (y1 - y0));
    const scale = Math.min(Math.max(this.scale * by, least), least * 2000);
    const wx = this.x + (px - this.width / 2) / this.scale, wy = this.y - (py - this.height / 2) / this.scale;
    this.x = wx - (px - this.width / 2) / scale;
    this.y = wy + (py - this.height / 2) / scale;
    this.scale = scale;
  }

  pan(dx, dy) { this.x -= dx / this.scale; this.y += dy / this.scale; }

  px(x) { return this.width / 2 + (x - this.x) * this.scale; }
  py(y) { return this.height / 2 - (y - this.y) * this.scale; }

  startRaster(raster) {
    const image = document.createElement("canvas");
    image.width = raster.columns;
    image.height = raster.rows;
    const pen = image.getContext("2d", { willReadFrequently: true });
    pen.canvas.width = 1;
    const palette = raster.palette.map((name) => {
      pen.clearRect(0, 0, 1, 1);
      pen.fillStyle = this.colour(name);
      pen.fillRect(0, 0, 1, 1);
      return pen.getImageData(0, 0, 1, 1).data.slice();
    });
    image.width = raster.columns;
    const state = { image, pen, palette, pixels: pen.createImageData(raster.columns, raster.rows), shown: -1 };
    for (let k = 0; k < raster.cells.length; k++) this.paintCell(raster, state, k, raster.cells[k]);
    state.dirty = true;
    return state;
  }

  paintCell(raster, state, cell, value) {
    const row = raster.rows - 1 - Math.floor(cell / raster.columns);
    state.pixels.data.set(state.palette[value] || [0, 0, 0, 0], 4 * (row * raster.columns + (cell % raster.columns)));
  }

  drawRaster(pen, raster, state, t) {
    const upTo = lastBefore(raster.change_t_s, t);
    if (upTo < state.shown) {  // back in time: from the start again
      for (let k = 0; k < raster.cells.length; k++) this.paintCell(raster, state, k, raster.cells[k]);
      state.shown = -1;
      state.dirty = true;
    }
    while (state.shown < upTo) {
      state.shown++;
      this.paintCell(raster, state, raster.change_cell[state.shown], raster.change_value[state.shown]);
      state.dirty = true;
    }
    if (state.dirty) state.pen.putImageData(state.pixels, 0, 0);
    state.dirty = false;
    const [x0, y0, x1, y1] = raster.bounds_m;
    pen.imageSmoothingEnabled = raster.smooth;
    pen.drawImage(state.image, this.px(x0), this.py(y1), (x1 - x0) * this.scale, (y1 - y0) * this.scale);
  }

  // Strokes a path made in metres with a width in pixels.
  inMetres(pen, draw) {
    pen.save();
    pen.translate(this.px(0), this.py(0));
    pen.scale(this.scale, -this.scale);
    draw(1 / this.scale);
    pen.restore();
  }

  polyline(points) {
    const path = new Path2D();
    for (let k = 0; k + 1 < points.length; k += 2) {
      if (k) path.lineTo(points[k], points[k + 1]); else path.moveTo(points[k], points[k + 1]);
    }
    return path;
  }

  pose(track, i, share) {
    const x = track.x_m, y = track.y_m, th = track.theta_rad;
    if (share > 0 && i + 1 < x.length && !this.breaks.has(i + 1) && x[i + 1] === x[i + 1] && x[i] === x[i]) {
      const turn = Math.atan2(Math.sin(th[i + 1] - th[i]), Math.cos(th[i + 1] - th[i]));
      return [x[i] + share * (x[i + 1] - x[i]), y[i] + share * (y[i + 1] - y[i]), th[i] + share * turn];
    }
    return [x[i], y[i], th[i]];
  }

  draw(t, i, share) {
    const pen = this.canvas.getContext("2d"), scene = this.scene;
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.fillStyle = this.colour("paper");
    pen.fillRect(0, 0, this.width, this.height);
    pen.lineJoin = pen.lineCap = "round";
    const poses = scene.poses.map((track) => this.pose(track, i, share));
    scene.rasters.forEach((raster, k) => this.shows(raster) && this.drawRaster(pen, raster, this.rasters[k], t));
    this.drawFixed(pen);
    this.drawPaths(pen, t);
    this.drawWays(pen, i, poses);
    this.drawSights(pen, i, poses);
    this.drawScans(pen, t);
    this.drawMarks(pen);
    this.drawDiscs(pen, i, share);
    scene.poses.forEach((track, k) => this.shows(track) && this.drawPose(pen, track, poses[k], i));
    this.drawRuler(pen);
  }

  drawFixed(pen) {
    this.inMetres(pen, (pixel) => {
      for (const layer of this.scene.lines) {
        if (!this.shows(layer)) continue;
        pen.strokeStyle = pen.fillStyle = this.colour(layer.colour);
        pen.lineWidth = layer.width_px * pixel;
        pen.setLineDash(layer.dash ? [6 * pixel, 4 * pixel] : []);
        layer.paths = layer.paths || layer.lines_m.map((line) => {
          const path = this.polyline(line);
          if (layer.fill) path.closePath();
          return path;
        });
        for (const path of layer.paths) {
          if (layer.fill) { pen.globalAlpha = 0.3; pen.fill(path); pen.globalAlpha = 1; }
          pen.stroke(path);
        }
      }
      pen.setLineDash([]);
      for (const layer of this.scene.circles) {
        if (!this.shows(layer)) continue;
        pen.strokeStyle = pen.fillStyle = this.colour(layer.colour);
        pen.lineWidth = 1.5 * pixel;
        for (let k = 0; k + 2 < layer.circles_m.length; k += 3) {
          pen.beginPath();
          pen.arc(layer.circles_m[k], layer.circles_m[k + 1], layer.circles_m[k + 2], 0, 2 * Math.PI);
          if (layer.fill) { pen.globalAlpha = 0.3; pen.fill(); pen.globalAlpha = 1; }
          pen.stroke();
        }
      }
    });
  }

  // People between two frames; who comes or goes is where the frame has him.
  drawDiscs(pen, i, share) {
    this.inMetres(pen, (pixel) => {
      for (const track of this.scene.discs) {
        if (!this.shows(track)) continue;
        const count = track.radius_m.length, places = track.places_m;
        pen.strokeStyle = pen.fillStyle = this.colour(track.colour);
        pen.lineWidth = 1.5 * pixel;
        for (let k = 0; k < count; k++) {
          const at = 2 * (i * count + k), next = at + 2 * count;
          let x = places[at], y = places[at + 1];
          if (!(x === x && y === y)) continue;
          const dx = places[next] - x, dy = places[next + 1] - y;
          if (dx * dx + dy * dy < 4) { x += share * dx; y += share * dy; }
          pen.beginPath();
          pen.arc(x, y, track.radius_m[k], 0, 2 * Math.PI);
          pen.globalAlpha = 0.45; pen.fill(); pen.globalAlpha = 1;
          pen.stroke();
        }
      }
    });
  }

  drawPaths(pen, t) {
    this.inMetres(pen, (pixel) => {
      for (const track of this.scene.paths) {
        const k = lastBefore(track.t_s, t);
        if (k < 0 || !this.shows(track)) continue;
        track.drawn = track.drawn || [];
        track.drawn[k] = track.drawn[k] || this.polyline(track.paths_m[k]);
        pen.strokeStyle = this.colour(track.colour);
        pen.lineWidth = 2 * pixel;
        pen.setLineDash([7 * pixel, 5 * pixel]);
        pen.stroke(track.drawn[k]);
        pen.setLineDash([]);
      }
    });
  }

  drawWays(pen, i, poses) {
    // The first way lies on top: where an estimate is right it is hidden.
    [...this.scene.poses.keys()].reverse().forEach((k) => {
      const track = this.scene.poses[k];
      if (!track.trail || !this.shows(track)) return;
      this.inMetres(pen, (pixel) => {
        pen.strokeStyle = this.colour(track.colour);
        pen.lineWidth = 1.2 * pixel;
        pen.globalAlpha = 0.18;
        pen.stroke(this.ways[k]);
        pen.globalAlpha = 0.9;
        pen.lineWidth = 2.2 * pixel;
        pen.stroke(this.wayUpTo(track, i));
        pen.globalAlpha = 1;
        pen.beginPath();
        if (track.x_m[i] === track.x_m[i]) { pen.moveTo(track.x_m[i], track.y_m[i]); pen.lineTo(poses[k][0], poses[k][1]); }
        pen.stroke();
      });
    });
  }

  // The way so far grows with the play; going back begins anew. Steps below a pixel are left out.
  wayUpTo(track, i) {
    const far = 0.7 / this.scale;
    let grown = track.grown;
    if (!grown || grown.upTo > i || grown.far > 2 * far || grown.far < far / 4) {
      grown = track.grown = { path: new Path2D(), upTo: -1, x: NaN, y: NaN, far };
    }
    for (let k = grown.upTo + 1; k <= i; k++) {
      const x = track.x_m[k], y = track.y_m[k];
      if (!(x === x && y === y)) { grown.x = NaN; continue; }
      if (grown.x !== grown.x || this.breaks.has(k)) grown.path.moveTo(x, y);
      else if (Math.abs(x - grown.x) + Math.abs(y - grown.y) < far && k < i) continue;
      else grown.path.lineTo(x, y);
      grown.x = x;
      grown.y = y;
    }
    grown.upTo = i;
    return grown.path;
  }

  drawSights(pen, i, poses) {
    this.scene.sights.forEach((track, n) => {
      const from = poses[track.seen_from];
      if (!this.shows(track) || !from || from[0] !== from[0]) return;
      pen.strokeStyle = this.colour(track.colour);
      pen.lineWidth = 1.2;
      pen.globalAlpha = 0.55;
      pen.beginPath();
      for (let k = this.sightStart[n][i]; k < this.sightStart[n][i + 1]; k++) {
        pen.moveTo(this.px(from[0]), this.py(from[1]));
        pen.lineTo(this.px(track.points_m[2 * k]), this.py(track.points_m[2 * k + 1]));
      }
      pen.stroke();
      pen.globalAlpha = 1;
    });
  }

  // A scan stays where it was taken until the next one.
  drawScans(pen, t) {
    for (const track of this.scene.scans) {
      const k = lastBefore(track.t_s, t + 1e-6);
      if (k < 0 || !this.shows(track)) continue;
      const [x, y, th] = track.poses.slice(3 * k, 3 * k + 3), beams = track.angles_rad.length;
      if (!(x === x && y === y && th === th)) continue;
      pen.fillStyle = this.colour(track.colour);
      for (let b = 0; b < beams; b++) {
        const level = track.ranges[k * beams + b];
        if (level === 65535) continue;
        const angle = th + track.angles_rad[b], r = level * track.step_m;
        pen.fillRect(this.px(x + r * Math.cos(angle)) - 2, this.py(y + r * Math.sin(angle)) - 2, 4, 4);
      }
    }
  }

  drawMarks(pen) {
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    // Labels without a corner that is free are left out; zooming in brings them back.
    const [, ruler_px] = this.ruler(), taken = [[12, this.height - 30, 12 + ruler_px, this.height - 10]];
    const cut = (box) => box[0] < 0 || box[1] < 0 || box[2] > this.width || box[3] > this.height;
    for (const layer of this.scene.marks) {
      if (!this.shows(layer)) continue;
      pen.fillStyle = pen.strokeStyle = this.colour(layer.colour);
      pen.lineWidth = 1.8;
      if (layer.look === "dot") {
        const size = Math.min(Math.max(this.scale * 30, 1.6), 5);
        for (let k = 0; k + 1 < layer.points_m.length; k += 2) {
          pen.beginPath();
          pen.arc(this.px(layer.points_m[k]), this.py(layer.points_m[k + 1]), size, 0, 2 * Math.PI);
          pen.fill();
        }
        continue;
      }
      layer.labels.forEach((label, k) => {
        const x = this.px(layer.points_m[2 * k]), y = this.py(layer.points_m[2 * k + 1]);
        pen.beginPath();
        if (layer.look === "ring") pen.arc(x, y, 6, 0, 2 * Math.PI);
        else if (layer.look === "cross") { pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5); pen.moveTo(x + 5, y - 5); pen.lineTo(x - 5, y + 5); }
        else { pen.moveTo(x, y - 5); pen.lineTo(x + 5, y); pen.lineTo(x, y + 5); pen.lineTo(x - 5, y); pen.fill(); }
        if (layer.look === "ring" || layer.look === "cross") pen.stroke();
        const width = 2 + pen.measureText(label).width;
        const spots = [[x + 8, y - 7], [x + 8, y + 7], [x - 8 - width, y - 7], [x - 8 - width, y + 7]];
        for (const [left, middle] of spots) {
          const box = [left, middle - 6, left + width, middle + 6];
          if (cut(box) || taken.some((o) => o[0] < box[2] && box[0] < o[2] && o[1] < box[3] && box[1] < o[3])) continue;
          taken.push(box);
          pen.fillText(label, left, middle);
          break;
        }
      });
    }
  }

  drawPose(pen, track, [x, y, theta], i) {
    if (!(x === x && y === y)) return;
    const cx = this.px(x), cy = this.py(y), radius = Math.max(track.radius_m * this.scale, 5);
    pen.strokeStyle = pen.fillStyle = this.colour(track.colour);
    const axis = track.cov_m2 ? this.ellipse(track, i) : null;
    if (axis) {
      const factor = this.factor() * this.scale;
      pen.beginPath();
      pen.ellipse(cx, cy, Math.min(axis.a * factor, 1e5), Math.min(axis.b * factor, 1e5), -axis.angle, 0, 2 * Math.PI);
      pen.globalAlpha = 0.22;
      pen.fill();
      pen.globalAlpha = 1;
      pen.lineWidth = 1.6;
      pen.stroke();
    }
    pen.beginPath();
    if (track.look === "point") {
      pen.arc(cx, cy, 3.5, 0, 2 * Math.PI);
      pen.fill();
      return;
    }
    // A body of a few pixels is a disc, as its corners could not be told.
    const polygon = track.body_m.length && theta === theta && track.radius_m * this.scale > 5;
    if (polygon) {
      const c = Math.cos(theta), s = Math.sin(theta);
      for (let k = 0; k + 1 < track.body_m.length; k += 2) {
        const bx = x + c * track.body_m[k] - s * track.body_m[k + 1], by = y + s * track.body_m[k] + c * track.body_m[k + 1];
        if (k) pen.lineTo(this.px(bx), this.py(by)); else pen.moveTo(this.px(bx), this.py(by));
      }
      pen.closePath();
    } else pen.arc(cx, cy, radius, 0, 2 * Math.PI);
    if (track.look === "robot") {
      pen.fillStyle = this.stateColour || this.colour(track.colour);
      pen.globalAlpha = 0.5;
      pen.fill();
      pen.globalAlpha = 1;
    }
    if (theta === theta) {
      pen.moveTo(cx, cy);
      pen.lineTo(cx + 1.7 * radius * Math.cos(theta), cy - 1.7 * radius * Math.sin(theta));
    }
    pen.lineWidth = 2;
    pen.stroke();
  }

  // A round length and its width on the screen.
  ruler() {
    const wanted = 90 / this.scale, power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * [1, 2, 5].filter((step) => step * power <= wanted).pop();
    return [length, length * this.scale];
  }

  drawRuler(pen) {
    const [length, w] = this.ruler(), x = 12, y = this.height - 12;
    pen.strokeStyle = pen.fillStyle = this.colour("muted");
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, y - 5); pen.lineTo(x, y); pen.lineTo(x + w, y); pen.lineTo(x + w, y - 5);
    pen.stroke();
    pen.textBaseline = "bottom";
    const said = length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${+(length * 100).toPrecision(3)} cm`;
    pen.fillText(said, x + 4, y - 4);
  }
}
