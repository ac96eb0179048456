// The camera: four views, and orbit, pan and zoom by the mouse or the keys.

import {
  add, cross, lookAt, multiply, orthographic, perspective, project, scale, sub, unit,
} from "./math.js";

const FOV = (50 * Math.PI) / 180;
export const VIEWS = {
  1: { name: "behind the vehicle", yaw: 0, pitch: 0.42, distance: 24, turns: true, follow: true },
  2: { name: "from above, north up", distance: 46, flat: true, follow: true },
  3: { name: "from the side", yaw: Math.PI / 2, pitch: 0.16, distance: 26, turns: true, follow: true },
  4: { name: "the whole run, north up", flat: true, follow: false },
};

export class Camera {
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.target = [0, 0, 0];
    this.offset = [0, 0, 0];
    this.heading = 0;
    this.extent = null;
    this.set(1);
    this.listen();
  }
  set(number) {
    this.number = number;
    const view = VIEWS[number];
    this.view = view;
    this.yaw = view.yaw ?? -Math.PI / 2;
    this.pitch = view.pitch ?? 0.4;
    this.offset = [0, 0, 0];
    this.distance = view.distance ?? 50;
    if (!view.follow) this.fit();
    this.onChange();
  }
  /** @param box {min, max} of the whole run */
  setExtent(box) {
    const first = !this.extent;
    this.extent = box;
    if (!this.view.follow && first) this.fit();
  }
  fit() {
    if (!this.extent) return;
    const { min, max } = this.extent;
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    this.fixed = scale(add(min, max), 0.5);
    this.distance = 1.15 * Math.max(max[1] - min[1], (max[0] - min[0]) / aspect, 20);
  }
  follow(position, heading) {
    this.target = position;
    this.heading = heading;
  }
  zoom(factor) {
    this.distance = Math.min(5000, Math.max(0.5, this.distance * factor));
    this.onChange();
  }
  /** As the mouse drags by so many pixels: turns; in the flat views, or if `pan`, moves. */
  drag(dx, dy, pan = false) {
    if (pan || this.view.flat) {
      const now = this.compute();
      const flatUp = this.view.flat ? now.up : unit([now.up[0], now.up[1], 0]);
      this.offset = add(this.offset, sub(scale(flatUp, dy * now.metersPerPixel),
        scale(now.right, dx * now.metersPerPixel)));
    } else {
      this.yaw -= dx * 0.006;
      this.pitch = Math.min(1.55, Math.max(-0.3, this.pitch + dy * 0.006));
    }
    this.onChange();
  }
  get center() { return add(this.view.follow ? this.target : (this.fixed ?? this.target), this.offset); }

  /** @returns {matrix, reference, metersPerPixel at the center, eye} */
  compute() {
    const w = Math.max(1, this.canvas.clientWidth);
    const h = Math.max(1, this.canvas.clientHeight);
    const center = this.center;
    if (this.view.flat) {
      const eye = add(center, [0, 0, 500]);
      const matrix = multiply(orthographic(this.distance / 2, w / h, 1, 2000),
        lookAt(eye, center, [0, 1, 0]));
      return { matrix, reference: 1, metersPerPixel: this.distance / h, eye, right: [1, 0, 0], up: [0, 1, 0] };
    }
    const yaw = this.yaw + (this.view.turns ? this.heading : 0);
    const back = [-Math.cos(yaw) * Math.cos(this.pitch), -Math.sin(yaw) * Math.cos(this.pitch),
      Math.sin(this.pitch)];
    const eye = add(center, scale(back, this.distance));
    const matrix = multiply(perspective(FOV, w / h, Math.max(0.05, this.distance / 200), 3000),
      lookAt(eye, center, [0, 0, 1]));
    const right = unit(cross([0, 0, 1], back));
    return {
      matrix, reference: this.distance, eye, right, up: cross(back, right),
      metersPerPixel: (2 * this.distance * Math.tan(FOV / 2)) / h,
    };
  }
  /** @returns [x, y] in CSS pixels, or null behind the camera */
  toScreen(matrix, point) {
    const [x, y, , w] = project(matrix, point);
    if (w <= 0) return null;
    return [(x * 0.5 + 0.5) * this.canvas.clientWidth, (0.5 - y * 0.5) * this.canvas.clientHeight];
  }

  listen() {
    const c = this.canvas;
    let drag = null;
    c.addEventListener("contextmenu", (e) => e.preventDefault());
    c.addEventListener("pointerdown", (e) => {
      drag = { x: e.clientX, y: e.clientY, pan: e.button !== 0 || e.shiftKey };
      c.setPointerCapture(e.pointerId);
    });
    c.addEventListener("pointerup", () => { drag = null; });
    c.addEventListener("pointermove", (e) => {
      if (!drag) return;
      this.drag(e.clientX - drag.x, e.clientY - drag.y, drag.pan);
      drag.x = e.clientX;
      drag.y = e.clientY;
    });
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(e.deltaY * 0.0012));
    }, { passive: false });
  }
}
