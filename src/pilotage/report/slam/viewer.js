// Lays the two stretches of any closure over each other, and says what was found out about it.
class ClosureViewer {
  constructor(root, book) {
    this.root = root;
    this.book = book;
    this.canvas = root.querySelector("canvas");
    this.number = root.querySelector("input[type=number]");
    this.said = root.querySelector("[data-said]");
    this.row = new Map([...book.numbers].map((number, k) => [number, k]));
    const style = getComputedStyle(document.documentElement);
    this.ink = style.getPropertyValue("--ink").trim() || "#222";
    this.number.max = String(Math.max(...book.numbers));
    this.number.addEventListener("input", () => this.show(Number(this.number.value)));
    root.querySelector("[data-before]").addEventListener("click", () => this.step(-1));
    root.querySelector("[data-after]").addEventListener("click", () => this.step(1));
    // A row of the table is marked in its first cell.
    this.marks = [...document.querySelectorAll("[data-closure]")].map((mark) => [mark.closest("tr"), Number(mark.dataset.closure)]);
    for (const [row, closure] of this.marks) {
      row.addEventListener("click", () => { this.show(closure); root.scrollIntoView({ block: "nearest" }); });
    }
    root.hidden = false;
    new ResizeObserver(() => this.show(this.shown)).observe(root);
    this.show(book.first);
  }

  step(by) {
    const k = this.row.get(this.shown) + by;
    if (k >= 0 && k < this.book.numbers.length) this.show(this.book.numbers[k]);
  }

  show(number) {
    const k = this.row.get(number);
    if (k === undefined) return;
    this.shown = number;
    if (document.activeElement !== this.number) this.number.value = String(number);
    this.said.textContent = this.book.said[k];
    for (const [row, closure] of this.marks) row.setAttribute("aria-selected", String(closure === number));
    const box = this.canvas.getBoundingClientRect(), ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    const pen = this.canvas.getContext("2d");
    const [x, y, turn] = this.book.relative.subarray(3 * k, 3 * k + 3);
    const pairs = [[this.book.earlier[k], 0, 0, 0, this.book.colours[0]], [this.book.later[k], x, y, turn, this.book.colours[1]]];
    const placed = pairs.map(([stretch, dx, dy, angle]) => this.points(stretch, dx, dy, angle));
    const all = placed.flat();
    const span = (values) => { const sorted = [...values].sort((a, b) => a - b); const at = (share) => sorted[Math.round(share * (sorted.length - 1))]; return [at(0.01), at(0.99)]; };
    if (!all.length) return;
    const [x0, x1] = span(all.map((p) => p[0])), [y0, y1] = span(all.map((p) => p[1]));
    const scale = 0.94 * Math.min(this.canvas.width / Math.max(x1 - x0, 1), this.canvas.height / Math.max(y1 - y0, 1));
    const px = (v) => this.canvas.width / 2 + (v - (x0 + x1) / 2) * scale, py = (v) => this.canvas.height / 2 - (v - (y0 + y1) / 2) * scale;
    const size = 1.6 * ratio;
    placed.forEach((points, n) => {
      pen.fillStyle = pairs[n][4];
      for (const [u, v] of points) pen.fillRect(px(u) - size / 2, py(v) - size / 2, size, size);
    });
    const metres = [1, 2, 5, 10, 20].findLast((m) => m * scale < this.canvas.width / 4) || 1;
    pen.strokeStyle = pen.fillStyle = this.ink;
    pen.font = `${11 * ratio}px system-ui, sans-serif`;
    pen.beginPath();
    pen.moveTo(10 * ratio, this.canvas.height - 10 * ratio);
    pen.lineTo(10 * ratio + metres * scale, this.canvas.height - 10 * ratio);
    pen.stroke();
    pen.fillText(`${metres} m`, 10 * ratio, this.canvas.height - 16 * ratio);
  }

  // Points of a stretch, in whole centimetres from 32768 on, moved into the earlier stretch's frame.
  points(stretch, x, y, turn) {
    const out = [], c = Math.cos(turn), s = Math.sin(turn), { starts, points } = this.book;
    for (let k = starts[stretch]; k < starts[stretch + 1]; k++) {
      const u = (points[2 * k] - 32768) / 100, v = (points[2 * k + 1] - 32768) / 100;
      out.push([x + c * u - s * v, y + s * u + c * v]);
    }
    return out;
  }
}

(async () => {
  const root = document.getElementById("closure-viewer"), book = document.getElementById("closure-book");
  if (root && book) root.viewer = new ClosureViewer(root, await unpackScene(book.textContent.trim()));
})();
