// Values under the pointer, and zoom, for the plots of a page. A plot states its axes in data
// attributes (svg_plot.cpp), and its values are those of its paths (series_path.h). Positions are
// pixels of the drawing as it was written, or, named "screen", as it is magnified now.
"use strict";
(() => {
  const MAX_ZOOM = 100, SNAP_PX = 40, NEAR_PX = 12, HINT = "Plots: point at one for its values. " +
    "Drag, Ctrl + wheel or + to zoom; double click, Escape or 0 to reset. Keys of a focused plot: " +
    "arrows move the cursor, Shift + arrows the view; + - 0.";
  const clamp = (v, low, high) => Math.min(high, Math.max(low, v));
  const drawn = (tag, attributes, text = "") => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    return element;
  };

  // The same values as round_ticks() and log_ticks() of svg_style.cpp.
  const roundTicks = (low, high, count) => {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough)), ticks = [];
    const step = power * ([1, 2, 2.5, 5].find((f) => f * power >= rough * (1 - 1e-9)) ?? 10);
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; ++k) ticks.push(k * step);
    return ticks;
  };
  const logTicks = (low, high, count) => {
    const of = (factors, decades) => {
      const ticks = [];
      for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e) {
        if (e % decades === 0) ticks.push(...factors.map((f) => f * 10 ** e));
      }
      return ticks.filter((v) => v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9));
    };
    let ticks = of([1, 2, 5], 1);
    if (ticks.length < 2) return roundTicks(low, high, count);
    for (let decades = 1; ticks.length > count; ++decades) ticks = of([1], decades);
    return ticks;
  };

  /** "time [s] (log scale)": name and unit. */
  const words = (label) => {
    const [, name, unit] = label.match(/^([^[(]*)(?:\[([^\]]*)\])?/);
    return { name: name.trim(), unit: unit ? ` ${unit}` : "" };
  };

  /** An axis from position `from` to `to`; `low` and `high` are decades if it is logarithmic. */
  class Axis {
    constructor(from, to, range, log, label) {
      const [low, high] = range.split(" ").map(Number);
      Object.assign(this, { from, to, low, high, log, ...words(label), begin: 0, share: 1 });
    }
    /** Shows a share of the whole axis. */
    show(begin, share) {
      this.share = clamp(share, 1 / MAX_ZOOM, 1);
      this.begin = clamp(begin, 0, 1 - this.share);
    }
    part(position) { return (position - this.from) / (this.to - this.from); }
    screen(position) { return this.from + ((this.part(position) - this.begin) / this.share) * (this.to - this.from); }
    position(screen) { return this.from + (this.begin + this.part(screen) * this.share) * (this.to - this.from); }
    value(position) {
      const v = this.low + this.part(position) * (this.high - this.low);
      return this.log ? 10 ** v : v;
    }
    at(value) { return this.from + (((this.log ? Math.log10(value) : value) - this.low) / (this.high - this.low)) * (this.to - this.from); }
    /** As many digits as the paths have. */
    text(position) {
      const v = this.value(position), pixel = Math.abs((this.high - this.low) / (this.to - this.from));
      if (this.log) return String(Number(v.toPrecision(3)));
      return v.toFixed(clamp(Math.ceil(-Math.log10(0.05 * pixel)), 0, 9)).replace(/^-(0\.?0*)$/, "$1");
    }
    ticks() {
      const ends = [this.begin, this.begin + this.share].map((part) => this.value(this.from + part * (this.to - this.from)));
      const length = Math.abs(this.to - this.from), wide = this.to > this.from;
      return this.log ? logTicks(...ends, Math.max(2, Math.floor(length / (wide ? 60 : 20))))
        : roundTicks(...ends, Math.max(2, Math.floor(length / (wide ? 90 : 45))));
    }
  }

  /** The corners of a path; runs are without gaps. */
  function seriesOf(path) {
    const is = (name) => path.classList.contains(name), d = path.getAttribute("d") ?? "";
    let runs = d.replace(/h0|Z/g, "").split("M").slice(1).map((run) => is("bars")
      ? (([x, , y, w]) => [[x, y], [x + w, y]])(run.split(/[ Vh]/).map(Number))
      : run.split("L").map((corner) => corner.split(" ").map(Number)));
    let lower = null;
    if (is("band")) {
      lower = runs.map((run) => run.slice(run.length / 2).reverse());
      runs = runs.map((run) => run.slice(0, run.length / 2));
    }
    return { label: path.dataset.label, color: [...path.classList].find((c) => c.startsWith("c-")), runs, lower, bars: is("bars") };
  }
  /** The y of the runs at x; null where they have none. */
  function yAt(runs, x) {
    for (const run of runs) {
      if (run.length === 1 && Math.abs(run[0][0] - x) < 0.5) return run[0][1];
      for (let i = 1; i < run.length; ++i) {
        const [[x0, y0], [x1, y1]] = [run[i - 1], run[i]];
        if (Math.min(x0, x1) <= x && x <= Math.max(x0, x1)) return x0 === x1 ? y1 : y0 + ((x - x0) / (x1 - x0)) * (y1 - y0);
      }
    }
    return null;
  }

  class Plot {
    constructor(svg) {
      const d = svg.dataset, [left, top, right, bottom] = d.frame.split(" ").map(Number);
      [this.svg, this.cursor] = [svg, null];
      this.x = new Axis(left, right, d.x, "logX" in d, d.xLabel);
      this.y = new Axis(bottom, top, d.y, "logY" in d, d.yLabel);
      [this.fromAbove, this.lanes] = ["equal" in d, "lanes" in d];
      [this.left, this.top, this.right, this.bottom] = [left, top, right, bottom];
      this.overlay = svg.appendChild(drawn("g", { "pointer-events": "none" }));
      this.box = svg.parentElement.appendChild(document.createElement("div"));
      this.box.className = "plot values";
      this.box.hidden = true;
      svg.setAttribute("tabindex", "0");
      this.written = ["x", "y"].map((a) => [...svg.querySelector(`.${a}-ticks`).childNodes]);
    }
    get series() { return this.parsed ??= [...this.svg.querySelectorAll(".data > path")].map(seriesOf); }
    get zoomed() { return this.x.share < 1; }

    /** Magnifies about a part (0 to 1) of the whole axes. */
    zoom(factor, x, y) {
      for (const [axis, center] of this.fromAbove ? [[this.x, x], [this.y, y]] : [[this.x, x]]) {
        const share = clamp(axis.share / factor, 1 / MAX_ZOOM, 1);
        axis.show(center - ((center - axis.begin) * share) / axis.share, share);
      }
      this.redraw();
    }
    /** Shows the rectangle between two positions on the screen; from above with equal scales. */
    zoomTo([x0, y0], [x1, y1]) {
      const part = (axis, a, b) => [a, b].map((s) => axis.part(axis.position(s))).sort((p, q) => p - q);
      const [a, b] = part(this.x, x0, x1), [c, e] = part(this.y, y0, y1);
      const share = this.fromAbove ? Math.max(b - a, e - c) : b - a;
      this.x.show((a + b - share) / 2, share);
      if (this.fromAbove) this.y.show((c + e - share) / 2, share);
      this.redraw();
    }
    reset() {
      for (const axis of [this.x, this.y]) axis.show(0, 1);
      this.redraw();
    }
    redraw() {
      const { svg, x, y } = this;
      svg.classList.toggle("zoomed", this.zoomed);
      svg.querySelector(".data").setAttribute("transform", `matrix(${1 / x.share} 0 0 ${1 / y.share} ${x.screen(0)} ${y.screen(0)})`);
      const ticks = (axis, written, d, text) => axis.share === 1 ? written : axis.ticks().flatMap((v) => {
        const at = axis.screen(axis.at(v));
        return [drawn("path", { class: "grid", d: d(at) }), drawn("text", text(at), String(Number(v.toPrecision(6))))];
      });
      svg.querySelector(".x-ticks").replaceChildren(...ticks(x, this.written[0], (at) => `M${at} ${this.top}V${this.bottom}`,
        (at) => ({ class: "tick mid", x: at, y: this.bottom + 16 })));
      svg.querySelector(".y-ticks").replaceChildren(...ticks(y, this.written[1], (at) => `M${this.left} ${at}H${this.right}`,
        (at) => ({ class: "tick end", x: this.left - 6, y: at + 4 })));
      for (const shade of svg.querySelectorAll("rect.shade")) {
        const whole = shade.whole ??= [Number(shade.getAttribute("x")), Number(shade.getAttribute("x")) + Number(shade.getAttribute("width"))];
        const [from, to] = whole.map((p) => clamp(x.screen(p), this.left, this.right)), text = shade.nextElementSibling;
        shade.setAttribute("x", from);
        shade.setAttribute("width", to - from);
        if (text?.tagName !== "text") continue;
        text.setAttribute("x", from + 5);
        text.setAttribute("visibility", text.getComputedTextLength() + 10 < to - from ? "visible" : "hidden");
      }
      for (const place of svg.querySelectorAll(".place")) {
        const [px, py] = place.whole ??= place.getAttribute("transform").match(/-?[\d.]+/g).map(Number);
        const [sx, sy] = [x.screen(px), y.screen(py)];
        place.setAttribute("transform", `translate(${sx} ${sy})`);
        place.setAttribute("display", sx < this.left || sx > this.right || sy < this.top || sy > this.bottom ? "none" : "inline");
      }
      this.hide();
    }

    hide() {
      this.cursor = null;
      this.box.hidden = true;
      this.overlay.replaceChildren();
    }
    /** The nearest corner of a line, if one is near; y null: in x alone. */
    nearest(x, y) {
      let best = { distance: y === null ? SNAP_PX : NEAR_PX };
      for (const s of this.lanes ? [] : this.series) {
        for (const [cx, cy] of s.bars ? [] : s.runs.flat()) {
          const distance = Math.hypot((cx - x) / this.x.share, y === null ? 0 : (cy - y) / this.y.share);
          if (distance < best.distance) best = { distance, x: cx, y: cy, s };
        }
      }
      return best.s ? best : null;
    }
    /** Cursor and values at x; of a plot with lanes, the intervals that contain it. */
    showAt(x) {
      const rows = [], several = this.series.some((s) => s.label), marks = [], { unit } = this.y;
      for (const s of this.lanes ? [] : this.series) {
        const y = s.label || !several ? yAt(s.runs, x) : null, low = y !== null && s.lower ? yAt(s.lower, x) : null;
        if (y === null) continue;
        rows.push([s.color, s.label || this.y.name, `${low === null ? "" : `${this.y.text(low)} to `}${this.y.text(y)}${unit}`]);
        if (!s.lower && !s.bars) marks.push(drawn("circle", { class: `at ${s.color}`, cx: this.x.screen(x), cy: y, r: 3 }));
      }
      const names = this.lanes ? [...this.svg.querySelectorAll(".y-ticks text")].map((t) => t.textContent) : [];
      for (let lane = names.length - 1; lane >= 0; --lane) {
        for (const s of this.series) {
          for (const run of s.runs.filter((r) => Math.round(this.y.value(r[0][1])) === lane)) {
            const [from, to] = [run[0][0], run[run.length - 1][0]], near = 3 * this.x.share;
            if (x < from - near || x > to + near || (from < to && (x < from || x > to))) continue;
            rows.push([s.color, [names[lane], s.label].filter(Boolean).join(": "), [...new Set([from, to].map((p) => this.x.text(p)))].join(" to ") + this.x.unit]);
          }
        }
      }
      const at = this.x.screen(x);
      this.overlay.replaceChildren(drawn("path", { class: "cursor", d: `M${at} ${this.top}V${this.bottom}` }), ...marks);
      this.fill(at, this.top, `${this.x.name} ${this.x.text(x)}${this.x.unit}`, rows.slice(0, 14));
      this.cursor = x;
    }
    /** Position from above: of the nearest corner or of the pointer. */
    showPlace(x, y, cell) {
      const near = this.nearest(x, y);
      if (near) ({ x, y } = near);
      const [sx, sy] = [this.x.screen(x), this.y.screen(y)], rows = near ? [[near.s.color, near.s.label || "line", ""]] : [];
      const { name, unit } = words(this.svg.dataset.mapLabel ?? "");
      if (cell) rows.push([null, name, cell + unit]);
      this.overlay.replaceChildren(drawn("path", { class: "cursor", d: `M${sx} ${this.top}V${this.bottom}M${this.left} ${sy}H${this.right}` }));
      this.fill(sx, sy, `${this.x.name} ${this.x.text(x)}${this.x.unit}, ${this.y.name} ${this.y.text(y)}${this.y.unit}`, rows);
    }
    fill(sx, sy, title, rows) {
      const line = (color, text) => {
        const div = document.createElement("div");
        if (color) div.appendChild(document.createElement("i")).className = color;
        div.append(text);
        return div;
      };
      this.box.replaceChildren(line(null, title.trim()), ...rows.map(([color, name, value]) => line(color, `${name} ${value}`.trim())));
      this.box.hidden = false;
      const svg = this.svg.getBoundingClientRect(), frame = this.svg.parentElement.getBoundingClientRect(), scale = svg.width / this.svg.viewBox.baseVal.width;
      const at = svg.left - frame.left + sx * scale, left = sx < (this.left + this.right) / 2;
      Object.assign(this.box.style, { left: left ? `${at + 12}px` : "auto", right: left ? "auto" : `${frame.width - at + 12}px`, top: `${svg.top - frame.top + sy * scale + 8}px` });
    }
  }

  const plots = [...document.querySelectorAll("svg.plot[data-frame]")].map((svg) => new Plot(svg));
  const linked = (plot) => plots.filter((p) => p === plot || (/^time\b/.test(p.x.name) && p.svg.dataset.xLabel === plot.svg.dataset.xLabel && !p.fromAbove && !plot.fromAbove));
  /** The cursor of all plots on the screen with the same axis of time. */
  function show(plot, x) {
    const value = plot.x.value(x);
    for (const p of linked(plot)) {
      const { top, bottom } = p.svg.getBoundingClientRect(), at = p.x.at(value), s = p.x.screen(at);
      if (p === plot || (bottom > 0 && top < innerHeight && s >= p.left && s <= p.right)) p.showAt(at);
      else p.hide();
    }
  }
  const hide = (plot) => linked(plot).forEach((p) => p.hide());

  for (const plot of plots) {
    const { svg } = plot;
    let drag = null;
    const screenOf = (event) => {
      const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [x, y];
    };
    const inside = ([x, y]) => x >= plot.left && x <= plot.right && y >= plot.top && y <= plot.bottom;
    const select = ([x, y]) => {
      const y0 = plot.fromAbove ? drag.from[1] : plot.top;
      drag.to = [clamp(x, plot.left, plot.right), plot.fromAbove ? clamp(y, plot.top, plot.bottom) : plot.bottom];
      const [left, right] = [drag.from[0], drag.to[0]].sort((a, b) => a - b), [top, bottom] = [y0, drag.to[1]].sort((a, b) => a - b);
      plot.overlay.replaceChildren(drawn("rect", { class: "selection", x: left, y: top, width: right - left, height: bottom - top }));
    };
    const move = (event) => {
      const at = screenOf(event), [x, y] = [plot.x.position(at[0]), plot.y.position(at[1])];
      if (drag) return select(at);
      if (!inside(at)) return hide(plot);
      if (!plot.fromAbove) return show(plot, plot.nearest(x, null)?.x ?? x);
      const cell = document.elementsFromPoint(event.clientX, event.clientY).find((e) => e.dataset?.value && svg.contains(e));
      plot.showPlace(x, y, cell?.dataset.value);
    };
    svg.addEventListener("pointermove", move);
    svg.addEventListener("pointerleave", () => { if (!drag) hide(plot); });
    svg.addEventListener("pointerdown", (event) => {
      const at = screenOf(event);
      if (event.pointerType === "touch") return move(event); // a finger scrolls the page
      if (event.button !== 0 || !inside(at)) return;
      drag = { from: at, to: at };
      svg.setPointerCapture(event.pointerId);
      hide(plot);
    });
    svg.addEventListener("pointerup", () => {
      const done = drag;
      drag = null;
      if (!done) return;
      plot.overlay.replaceChildren();
      if (Math.hypot(done.to[0] - done.from[0], plot.fromAbove ? done.to[1] - done.from[1] : 0) > 5) plot.zoomTo(done.from, done.to);
    });
    svg.addEventListener("pointercancel", () => { drag = null; plot.hide(); });
    svg.addEventListener("dblclick", () => plot.reset());
    svg.addEventListener("wheel", (event) => {
      const at = screenOf(event), out = event.deltaY > 0;
      // The page scrolls unless the plot was clicked, or Ctrl is held.
      if (!(event.ctrlKey || document.activeElement === svg) || !inside(at) || (out && !plot.zoomed && !event.ctrlKey)) return;
      event.preventDefault();
      plot.zoom(out ? 1 / 1.25 : 1.25, plot.x.part(plot.x.position(at[0])), plot.y.part(plot.y.position(at[1])));
    }, { passive: false });
    svg.addEventListener("blur", () => hide(plot));
    svg.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { x, y, cursor } = plot, step = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 }[event.key];
      const axis = event.key === "ArrowUp" || event.key === "ArrowDown" ? y : x;
      const factor = { "+": 1.5, "=": 1.5, "-": 1 / 1.5 }[event.key], now = cursor ?? x.position((plot.left + plot.right) / 2);
      if (factor) {
        plot.zoom(factor, x.part(now), y.begin + y.share / 2);
        if (cursor !== null) show(plot, cursor);
      } else if (event.key === "0" || event.key === "Escape") plot.reset();
      else if (!step || (axis === y && !(plot.fromAbove && plot.zoomed))) return;
      else if (plot.fromAbove || event.shiftKey) {
        axis.show(axis.begin + 0.1 * step * axis.share, axis.share);
        plot.redraw();
      } else {
        const to = clamp(now + 4 * step * x.share, plot.left, plot.right);
        if (x.screen(to) < plot.left || x.screen(to) > plot.right) {
          x.show(x.part(to) - x.share / 2, x.share);
          plot.redraw();
        }
        show(plot, to);
      }
      event.preventDefault();
    });
  }
  const hint = document.createElement("p");
  [hint.className, hint.textContent] = ["origin", HINT];
  if (plots.length > 0) document.querySelector(".origin")?.after(hint);
})();
