// Shapes of the scene: the vehicle, ellipsoids, cylinders, the terrain.

import { cross, dot, sub, unit } from "./math.js";

/** Floats of a vertex: position, color, value, light. */
export const FLOATS = 9;
const SUN = unit([0.35, -0.5, 0.8]);
const lightOf = (normal) => 0.62 + 0.38 * Math.abs(dot(unit(normal), SUN));

/** Collects triangles with one color. */
class MeshBuilder {
  constructor() { this.vertices = []; this.indices = []; }
  vertex(p, tint, light = 1) {
    this.vertices.push(...p, ...tint, 0, light);
    return this.vertices.length / FLOATS - 1;
  }
  /** Lit by its normal. */
  quad(a, b, c, d, tint) {
    const light = lightOf(cross(sub(b, a), sub(d, a)));
    const [i, j, k, l] = [a, b, c, d].map((p) => this.vertex(p, tint, light));
    this.indices.push(i, j, k, i, k, l);
  }
  box(min, max, tint) {
    const p = (x, y, z) => [x ? max[0] : min[0], y ? max[1] : min[1], z ? max[2] : min[2]];
    const faces = [[0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1], [1, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1],
      [0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1], [0, 1, 0, 1, 1, 0, 1, 1, 1, 0, 1, 1],
      [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], [0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1]];
    for (const f of faces) {
      this.quad(p(f[0], f[1], f[2]), p(f[3], f[4], f[5]), p(f[6], f[7], f[8]), p(f[9], f[10], f[11]),
        tint);
    }
  }
  wheel(x, y, radius, width, z, tint) {
    const n = 14;
    for (let i = 0; i < n; ++i) {
      const [s, t] = [(2 * Math.PI * i) / n, (2 * Math.PI * (i + 1)) / n];
      const at = (angle, dy) => [x + radius * Math.cos(angle), y + dy, z + radius * Math.sin(angle)];
      this.quad(at(s, -width / 2), at(t, -width / 2), at(t, width / 2), at(s, width / 2), tint);
      for (const dy of [-width / 2, width / 2]) this.quad([x, y + dy, z], at(s, dy), at(t, dy), at(t, dy), tint);
    }
  }
  data() { return [new Float32Array(this.vertices), new Uint32Array(this.indices)]; }
}

/** In frame vehicle: forward, left, up, at the INS. A vehicle of the size of a Demo III. */
export function vehicleMesh() {
  const m = new MeshBuilder();
  const body = [1, 1, 1, 1];
  const dark = [0.2, 0.2, 0.22, 1];
  m.box([-1.25, -0.62, -0.25], [0.95, 0.62, 0.28], body);
  m.box([-1.1, -0.5, 0.28], [0.1, 0.5, 0.62], [0.88, 0.88, 0.88, 1]);
  m.box([0.78, -0.16, 0.72], [1.02, 0.16, 1.02], [0.95, 0.75, 0.2, 1]); // the LADAR
  m.box([0.86, -0.05, 0.28], [0.94, 0.05, 0.72], dark);
  m.box([-0.53, -0.05, 0.62], [-0.47, 0.05, 1.1], dark); // the antenna
  for (const x of [-0.95, 0.65]) for (const y of [-0.75, 0.75]) m.wheel(x, y, 0.4, 0.28, -0.3, dark);
  return m.data();
}

/** The unit sphere. */
export function sphereMesh() {
  const m = new MeshBuilder();
  const [rows, columns] = [16, 32];
  for (let i = 0; i <= rows; ++i) {
    for (let j = 0; j <= columns; ++j) {
      const [a, b] = [(Math.PI * i) / rows, (2 * Math.PI * j) / columns];
      m.vertex([Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)], [1, 1, 1, 1]);
      if (i === rows || j === columns) continue;
      const k = i * (columns + 1) + j;
      m.indices.push(k, k + 1, k + columns + 2, k, k + columns + 2, k + columns + 1);
    }
  }
  return m.data();
}

/** The side of the cylinder with radius 1 and z from -1 to 1. */
export function cylinderMesh() {
  const m = new MeshBuilder();
  const n = 64;
  for (let i = 0; i < n; ++i) {
    const [s, t] = [(2 * Math.PI * i) / n, (2 * Math.PI * (i + 1)) / n];
    const at = (a, z) => [Math.cos(a), Math.sin(a), z];
    m.quad(at(s, -1), at(t, -1), at(t, 1), at(s, 1), [1, 1, 1, 1]);
  }
  return m.data();
}

/** @returns segments of a circle with radius r at height z */
export function circle(r, z, tint, n = 72) {
  const at = (i) => [r * Math.cos((2 * Math.PI * i) / n), r * Math.sin((2 * Math.PI * i) / n), z];
  return Array.from({ length: n }, (_, i) => [at(i), at(i + 1), tint]);
}

export const FLAG_UNKNOWN = 1;
export const FLAG_OBSTACLE = 2;
const UNKNOWN_HEIGHT = -32768;
// Classes of the ground differ in lightness as well as in color.
export const CLASSES = [
  { name: "level", color: [0.62, 0.78, 0.88, 1] },
  { name: "steep or rough", color: [0.95, 0.8, 0.42, 1] },
  { name: "obstacle", color: [0.62, 0.1, 0.12, 1] },
];
const STEEP_DEG = 12;
const ROUGH_CM = 12;

export function classOf(patch, k) {
  if (patch.flags[k] & FLAG_OBSTACLE) return 2;
  return patch.slope_deg[k] > STEEP_DEG || patch.roughness_cm[k] > ROUGH_CM ? 1 : 0;
}
export const knownCell = (patch, k) =>
  !(patch.flags[k] & FLAG_UNKNOWN) && patch.height_cm[k] !== UNKNOWN_HEIGHT;
export const cellHeight = (patch, k) => patch.base_m + 0.01 * patch.height_cm[k];

/** Difference of height to the neighbour in the direction, or from the opposite one; 0: unknown. */
function slopeAt(patch, i, j, di, dj) {
  const { width, height } = patch;
  const at = (x, y) => (x >= 0 && y >= 0 && x < width && y < height && knownCell(patch, y * width + x)
    ? cellHeight(patch, y * width + x) : null);
  const [here, next, before] = [at(i, j), at(i + di, j + dj), at(i - di, j - dj)];
  if (next !== null) return next - here;
  return before === null ? 0 : here - before;
}

/** The terrain of a MapPatch in frame local: a surface through the centers of the known cells. */
export function terrainMesh(patch) {
  const { width, height, cell_m: cell } = patch;
  const index = new Int32Array(width * height).fill(-1);
  const vertices = new Float32Array(FLOATS * width * height);
  let n = 0;
  let [low, high] = [Infinity, -Infinity];
  for (let j = 0, k = 0; j < height; ++j) {
    for (let i = 0; i < width; ++i, ++k) {
      if (!knownCell(patch, k)) continue;
      const z = cellHeight(patch, k);
      low = Math.min(low, z);
      high = Math.max(high, z);
      const tint = CLASSES[classOf(patch, k)].color;
      const light = lightOf([-slopeAt(patch, i, j, 1, 0) / cell, -slopeAt(patch, i, j, 0, 1) / cell, 1]);
      vertices.set([(patch.first_i + i + 0.5) * cell, (patch.first_j + j + 0.5) * cell, z, ...tint, z, light],
        FLOATS * n);
      index[k] = n++;
    }
  }
  const indices = [];
  for (let j = 0; j + 1 < height; ++j) {
    for (let i = 0; i + 1 < width; ++i) {
      const k = j * width + i;
      const [a, b, c, d] = [index[k], index[k + 1], index[k + width + 1], index[k + width]];
      if (a >= 0 && b >= 0 && c >= 0) indices.push(a, b, c);
      if (a >= 0 && c >= 0 && d >= 0) indices.push(a, c, d);
    }
  }
  return { vertices: vertices.subarray(0, FLOATS * n), indices: new Uint32Array(indices), low, high };
}
