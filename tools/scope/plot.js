// SPDX-License-Identifier: MIT
// Traces over time with uPlot: live or paused, cursor and difference, marks, gaps, export.
// Samples come as base64 of float32, row by row: seconds after t0, then a value for each trace.
const KEEP_S = 65, TRIM = 4000;
const ON_WHITE = ["#0072b2", "#d55e00", "#00805d", "#a8568a", "#9a6a00", "#2a7fb0", "#6a4a94", "#555"];
const ON_BLACK = ["#56b4e9", "#ff8a3c", "#2fd6a3", "#e8a0cb", "#f0c04a", "#9ad4f5", "#c0a8e0", "#bbb"];
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3]];

function floats(b64) {
  const text = atob(b64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new Float32Array(bytes.buffer);
}

function firstAtLeast(list, value) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

function isDark() { return document.body.classList.contains("body--dark"); }

export default {
  template: `<div><div ref="plot" tabindex="0" style="outline-offset:2px"
      :aria-label="title + ': arrows move the cursor, M sets a mark to measure from, space pauses'"
      @keydown="key"></div><div ref="readout" class="scope-readout" aria-live="off"></div></div>`,
  props: { title: String, traces: Array, height: Number, seconds: Number, period: Number },
  mounted() {
    this.clear();
    this.build();
    this.watcher = new ResizeObserver(() => this.size());
    this.watcher.observe(this.$refs.plot);
    this.theme = new MutationObserver(() => { if (this.dark !== isDark()) this.build(); });
    this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.$el.scope = this;
    this.$emit("ready");
  },
  unmounted() {
    this.watcher.disconnect();
    this.theme.disconnect();
    if (this.chart) this.chart.destroy();
  },
  methods: {
    clear() {
      Object.assign(this, {
        data: [[], ...this.traces.map(() => [])], gaps: [], marks: [], paused: false,
        span: this.seconds, limits: null, from: null, asked: false, shown: null, pushes: 0, keyed: null,
      });
    },
    build() {
      const shown = this.chart && this.chart.series.map((series) => series.show);
      if (this.chart) this.chart.destroy();
      const dark = this.dark = isDark();
      const ink = dark ? "#ddd" : "#222", lines = dark ? "#3a3a3a" : "#e2e2e2";
      const axis = { stroke: ink, grid: { stroke: lines, width: 1 }, ticks: { stroke: lines, width: 1 } };
      this.ink = ink;
      const colours = dark ? ON_BLACK : ON_WHITE;
      this.paper = dark ? "#121212" : "#ffffff";
      this.chart = new uPlot({
        width: Math.max(200, this.$refs.plot.clientWidth), height: this.height, title: this.title,
        cursor: { drag: { x: true, y: false }, bind: { dblclick: () => () => this.whole() } },
        scales: { x: { time: false }, y: { range: (u, low, high) => this.limits || this.round(low, high) } },
        axes: [{ ...axis, values: (u, v) => v.map((s) => s.toFixed(s % 1 ? 1 : 0) + " s") }, { ...axis, size: 60 }],
        series: [{ label: "time", value: (u, v) => (v == null ? "" : v.toFixed(3) + " s") },
          ...this.traces.map((t, i) => ({
            label: t.label, width: t.thin ? 1 : 1.6, stroke: colours[t.colour ?? i % colours.length],
            dash: DASHES[t.dash ?? i % DASHES.length], points: { show: false }, spanGaps: false,
            show: shown ? shown[i + 1] : t.show !== false, value: (u, v) => (v == null ? "" : v.toFixed(t.digits ?? 2) + " " + t.unit),
          }))],
        hooks: {
          drawClear: [(u) => this.drawGaps(u)], draw: [(u) => this.drawMarks(u)],
          setCursor: [(u) => this.tell(u)],
          setSelect: [(u) => { if (u.select.width > 4) this.setPaused(true); }],
        },
      }, this.data.map((column) => column.slice()), this.$refs.plot);
      this.chart.over.addEventListener("click", () => this.measure());
      this.chart.over.addEventListener("mouseenter", () => { this.keyed = null; });
      this.chart.over.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
      this.redraw(); // at once: until then all that is kept would be visible
    },
    round(low, high) {
      if (low == null) return [-1, 1];
      const pad = Math.max((high - low) * 0.08, 0.01);
      return [low - pad, high + pad];
    },
    size() {
      const width = this.$refs.plot.clientWidth;
      if (width > 50 && Math.abs(width - this.chart.width) > 1) this.chart.setSize({ width, height: this.height });
    },
    push(t0, b64, columns) {
      const rows = floats(b64), wide = columns + 1;
      for (let i = 0; i < rows.length; i += wide) {
        const t = t0 + rows[i];
        const had = this.data[0].length;
        if (had && t <= this.data[0][had - 1]) continue;
        if (Number.isNaN(rows[i + 1])) this.gaps.push(t);
        this.data[0].push(t);
        for (let k = 1; k < this.data.length; k++) {
          const value = k <= columns ? rows[i + k] : NaN;
          this.data[k].push(Number.isNaN(value) ? null : value);
        }
      }
      const t = this.data[0];
      if (t.length && t[0] < t[t.length - 1] - KEEP_S && t.length > TRIM) {
        const cut = firstAtLeast(t, t[t.length - 1] - KEEP_S);
        this.data.forEach((column) => column.splice(0, cut));
        this.gaps = this.gaps.filter((at) => at >= t[0]);
      }
      this.pushes++;
      if (!this.paused) this.draw();
    },
    overlay(first, t0, b64) { // values of trace `first` on, from t0, a row for each sample
      const rows = floats(b64), wide = this.traces.length - first;
      const begin = firstAtLeast(this.data[0], t0 - 1e-4);
      for (let k = 0; k < wide; k++) this.data[1 + first + k].fill(null);
      for (let i = 0; i * wide < rows.length && begin + i < this.data[0].length; i++)
        for (let k = 0; k < wide; k++) this.data[1 + first + k][begin + i] = rows[i * wide + k];
      this.draw();
    },
    draw() {
      if (this.asked) return;
      this.asked = true;
      requestAnimationFrame(() => { this.asked = false; this.redraw(); });
    },
    redraw() {
      if (!this.chart || !this.data[0].length) return;
      const t = this.data[0], end = t[t.length - 1];
      const range = this.paused && this.shown ? this.shown : [end - this.span, end];
      const low = Math.max(0, firstAtLeast(t, range[0]) - 1), high = firstAtLeast(t, range[1]) + 1;
      this.chart.batch(() => {
        this.chart.setData(this.data.map((column) => column.slice(low, high)), false);
        this.chart.setScale("x", { min: range[0], max: range[1] });
      });
      if (this.paused && this.keyed != null) this.chart.setCursor({ left: this.keyed, top: 10 });
    },
    setPaused(paused) {
      if (paused && !this.paused) this.shown = [this.chart.scales.x.min, this.chart.scales.x.max];
      if (paused && this.chart.select.width > 4) {
        const s = this.chart.select;
        this.shown = [this.chart.posToVal(s.left, "x"), this.chart.posToVal(s.left + s.width, "x")];
        this.chart.setSelect({ width: 0, height: 0, left: 0, top: 0 }, false);
      }
      if (!paused) this.shown = this.keyed = null;
      if (paused !== this.paused) this.$emit("paused", paused);
      this.paused = paused;
      this.draw();
    },
    whole() {
      const t = this.data[0];
      if (this.paused && t.length) this.shown = [t[0], t[t.length - 1]];
      this.draw();
    },
    setSpan(seconds) { this.span = seconds; this.draw(); },
    setFixed(fixed) {
      this.limits = fixed ? [this.chart.scales.y.min, this.chart.scales.y.max] : null;
      this.draw();
    },
    setShown(k, shown) { this.chart.setSeries(k + 1, { show: shown }); },
    setMarks(marks) { this.marks = marks; this.draw(); },
    wheel(e) {
      e.preventDefault();
      this.setPaused(true);
      const at = this.chart.posToVal(this.chart.cursor.left, "x"), by = e.deltaY < 0 ? 0.8 : 1.25;
      this.shown = this.shown.map((end) => at + (end - at) * by);
      this.draw();
    },
    key(e) {
      if (e.key === " ") this.setPaused(!this.paused);
      else if (e.key === "m" || e.key === "M") this.measure();
      else if (e.key === "Escape") { this.from = null; this.tell(this.chart); }
      else if (e.key === "ArrowLeft" || e.key === "ArrowRight") {
        this.setPaused(true);
        const wide = this.chart.over.clientWidth, step = (e.shiftKey ? 20 : 2) * (e.key === "ArrowLeft" ? -1 : 1);
        this.keyed = Math.min(wide - 1, Math.max(0, (this.keyed ?? wide / 2) + step));
        this.chart.setCursor({ left: this.keyed, top: 10 });
      } else return;
      e.preventDefault();
    },
    under() { // the sample under the cursor
      const left = this.keyed ?? this.chart.cursor.left;
      return left >= 0 && this.chart.data[0].length ? this.chart.posToIdx(left) : null;
    },
    measure() {
      const at = this.under();
      if (at != null) this.from = this.chart.data.map((column) => column[at]);
      this.tell(this.chart);
    },
    tell(u) {
      const at = this.under();
      if (at == null || !this.from || this.from[0] == null) {
        this.$refs.readout.textContent = this.from ? "" : "Click or M: measure from there. Drag: zoom; double click: all; space: pause.";
        return;
      }
      const parts = [`difference: ${(u.data[0][at] - this.from[0]).toFixed(3)} s`];
      this.traces.forEach((t, k) => {
        const a = this.from[k + 1], b = u.data[k + 1][at];
        if (a != null && b != null && u.series[k + 1].show) parts.push(`${t.label} ${(b - a).toFixed(t.digits ?? 2)} ${t.unit}`);
      });
      this.$refs.readout.textContent = parts.join("   ");
    },
    drawGaps(u) {
      const { left, top, width, height } = u.bbox;
      u.ctx.save();
      u.ctx.fillStyle = "rgba(128,128,128,0.35)";
      for (const t of this.gaps) {
        const at = firstAtLeast(this.data[0], t), last = this.data[0][at - 1] ?? t, next = this.data[0][at + 1] ?? t;
        const a = Math.max(left, u.valToPos(last, "x", true)), b = Math.min(left + width, u.valToPos(next, "x", true));
        if (b > left && a < left + width) u.ctx.fillRect(a, top, Math.max(1, b - a), height);
      }
      u.ctx.restore();
    },
    drawMarks(u) {
      const { left, top, width, height } = u.bbox, ctx = u.ctx;
      ctx.save();
      ctx.strokeStyle = ctx.fillStyle = this.ink;
      ctx.setLineDash([4, 4]);
      ctx.font = `${11 * devicePixelRatio}px sans-serif`;
      for (const mark of this.marks) {
        const x = u.valToPos(mark.t, "x", true);
        if (x < left || x > left + width) continue;
        ctx.beginPath(); ctx.moveTo(x, top); ctx.lineTo(x, top + height); ctx.stroke();
        ctx.fillText(mark.text, x + 3, top + 12 * devicePixelRatio);
      }
      ctx.restore();
    },
    visible() {
      const { min, max } = this.chart.scales.x, t = this.data[0];
      return [firstAtLeast(t, min), firstAtLeast(t, max)];
    },
    csv(name) {
      const [low, high] = this.visible(), shown = this.traces.map((t, k) => k).filter((k) => this.chart.series[k + 1].show);
      const lines = [["t [s]", ...shown.map((k) => `${this.traces[k].label} [${this.traces[k].unit}]`)].join(",")];
      for (let i = low; i < high; i++)
        lines.push([this.data[0][i].toFixed(6), ...shown.map((k) => this.data[k + 1][i] ?? "")].join(","));
      this.save(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }), this.file(name) + ".csv");
      return lines.length - 1;
    },
    png(name) {
      const from = this.chart.ctx.canvas, to = document.createElement("canvas");
      to.width = from.width; to.height = from.height;
      const ctx = to.getContext("2d");
      ctx.fillStyle = this.paper; ctx.fillRect(0, 0, to.width, to.height); ctx.drawImage(from, 0, 0);
      to.toBlob((blob) => this.save(blob, this.file(name) + ".png"));
    },
    file(name) { return name + "-" + this.title.toLowerCase().replace(/[^a-z]+/g, "-"); },
    save(blob, name) {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob); link.download = name; link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    },
  },
};
