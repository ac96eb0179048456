// The 3D view: the newest scan and those before it, terrain, path, routes, vehicle, uncertainty, track
// and fixes, in frame world (east, north, up).

import { palette, rgba, RAMPS, rampColor } from "./colors.js";
import { Renderer } from "./gl.js";
import { Camera } from "./camera.js";
import { cloudPoints, stampKey, stampSeconds, thinned } from "./cdr.js";
import {
  apply, compose, eigenSymmetric3, identityPose, inverse, maxOf, poseMatrix, rotation, yawOf,
} from "./math.js";
import { updateGrid, updateTrack } from "./ground_lines.js";
import { updateRoutes } from "./routes.js";
import { circle, cylinderMesh, sphereMesh, terrainMesh, vehicleMesh } from "./shapes.js";

// Points take most of the time of a software renderer: 16 scans before the newest are kept.
const MAX_RECENT = 16;
const RECENT_STEP_S = 0.36; // between two scans that are kept
const MAX_RECENT_POINTS = 900; // of a scan, when it is no longer the newest
const RECENT_S = 6;
const JUMP_MS = 600;
const HEIGHT_RANGE = [-2, 3]; // of points against the vehicle [m]
const ROWS = 32; // of a LADAR, while there is no scan
const DASH_PX = 8; // dashes are not shorter on the screen

const poseOf = (q, p) => ({ q: [...q], p: [...p] });
const rosPose = ({ position: p, orientation: o }) =>
  ({ q: [o.w, o.x, o.y, o.z], p: [p.x, p.y, p.z] });

export class WorldView {
  /** @param panel {canvas, onChange}; @throws Error without WebGL 2 */
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.renderer = new Renderer(canvas);
    this.camera = new Camera(canvas, onChange);
    this.dark = false;
    this.show = {
      scan: true, recent: true, terrain: true, path: true, routes: true, track: true, truth: true, fixes: true,
      sigma: true, level: true, grid: true, vehicle: true,
    };
    this.cloud = "sp";
    this.colorBy = "height";
    this.terrainBy = "class";
    this.magnify = 1;
    this.time = 0;
    this.T_vehicle_ladar = null;
    this.clear();
    const r = this.renderer;
    this.vehicle = r.makeMesh(...vehicleMesh());
    this.sphere = r.makeMesh(...sphereMesh());
    this.cylinder = r.makeMesh(...cylinderMesh());
    this.scanSet = r.makePoints(new Float32Array(0));
    this.recentSet = r.makePoints(new Float32Array(0));
    this.timeline = null;
    this.firstPicture_ms = null;
  }
  /** The moment jumps: what does not come again within a moment is not of the new one. */
  jump() {
    this.poses.clear();
    this.clouds.clear();
    const before = ["nav", "integrity", "plan", "routes", "patch", "scan"].map((name) => [name, this[name]]);
    clearTimeout(this.jumpTimer);
    this.jumpTimer = setTimeout(() => {
      for (const [name, value] of before) if (this[name] === value) this[name] = null;
      if (!this.nav) this.T_world_vehicle = null;
      this.patchDirty = this.pathDirty = this.routesDirty = true;
      this.onChange();
    }, JUMP_MS);
  }
  clear() {
    this.recent = []; // {stamp, data}: x, y, z of each point, drawn by one call
    this.recentDirty = true;
    this.scan = null;
    this.poses = new Map();
    this.clouds = new Map();
    this.nav = null;
    this.T_world_vehicle = null;
    this.integrity = null;
    this.plan = null;
    this.routes = null;
    this.patch = null;
    this.patchDirty = true;
    this.pathDirty = true;
    this.routesDirty = true;
    this.scanCount = 0;
  }

  // ---- messages ---------------------------------------------------------------------------
  onNav(m) {
    this.nav = m;
    if (m.pose_valid) {
      this.T_world_vehicle = poseOf(m.q_world_vehicle, m.p_world_vehicle_m);
      this.T_world_local = compose(this.T_world_vehicle,
        inverse(poseOf(m.q_local_vehicle, m.p_local_vehicle_m)));
      this.camera.follow(this.T_world_vehicle.p, yawOf(this.T_world_vehicle.q));
    }
    this.onChange();
  }
  onIntegrity(m) { this.integrity = m; this.onChange(); }
  onPlan(m) { this.plan = m; this.pathDirty = true; this.onChange(); }
  onRoutes(m) { this.routes = m; this.routesDirty = true; this.onChange(); }
  onPatch(m) { this.patch = m; this.patchDirty = true; this.onChange(); }
  onTf(m) {
    const mount = m.transforms.find((t) => t.child_frame_id === "ladar");
    if (!mount) return;
    const { translation: p, rotation: o } = mount.transform;
    this.T_vehicle_ladar = { q: [o.w, o.x, o.y, o.z], p: [p.x, p.y, p.z] };
  }
  /** @param kind "sp" or "ladar" */
  onCloud(kind, cloud) {
    this.clouds.set(kind, cloud);
    this.place(kind);
  }
  onScanPose(m) {
    this.poses.set(stampKey(m.header.stamp), rosPose(m.pose));
    if (this.poses.size > 20) this.poses.delete(this.poses.keys().next().value);
    for (const kind of this.clouds.keys()) this.place(kind);
  }
  /** Once the cloud and the pose at its stamp are here. */
  place(kind) {
    const cloud = this.clouds.get(kind);
    const key = stampKey(cloud.header.stamp);
    const T = this.poses.get(key);
    if (!T || kind !== this.cloud) return;
    if (kind === "ladar" && !this.T_vehicle_ladar) return;
    this.clouds.delete(kind);
    if (this.scan && this.scan.key === key && this.scan.kind === kind) return;
    // After a jump back the former scan is not a recent one.
    const stamp = stampSeconds(cloud.header.stamp);
    if (this.scan && stamp > this.scan.stamp && stamp - this.scan.stamp < RECENT_S) this.keepRecent();
    const points = cloudPoints(cloud);
    const T_vehicle_cloud = kind === "ladar" ? this.T_vehicle_ladar : identityPose();
    this.scan = {
      key, kind, stamp: stampSeconds(cloud.header.stamp), ...points,
      last_row: points.ring ? maxOf(points.ring, 1) : ROWS - 1,
      T_world_vehicle: T, T_world_cloud: compose(T, T_vehicle_cloud), time: this.time,
    };
    this.scanCount += 1;
    this.scanDirty = true;
    this.onChange();
  }
  /** The newest scan becomes one of the recent ones, with fewer points. */
  keepRecent() {
    const { n, stamp } = this.scan;
    if (this.recent.length && stamp - this.recent[this.recent.length - 1].stamp < RECENT_STEP_S) return;
    this.recent.push({ stamp, data: thinned(this.scan.world ?? this.worldPoints(this.scan), n, MAX_RECENT_POINTS) });
    while (this.recent.length > MAX_RECENT) this.recent.shift();
    this.recentDirty = true;
  }
  /** Scans before the newest one, from the server after a jump. @param parts [{stamp, xyz}] */
  setRecent(parts) {
    let last = -Infinity;
    this.recent = parts.filter((part) => {
      const wanted = (!this.scan || part.stamp < this.scan.stamp - 1e-4) && part.stamp - last >= RECENT_STEP_S;
      if (wanted) last = part.stamp;
      return wanted;
    }).map((part) => ({ stamp: part.stamp, data: thinned(part.xyz, part.xyz.length / 3, MAX_RECENT_POINTS) }));
    this.recentDirty = true;
    this.onChange();
  }
  worldPoints(scan) {
    const R = rotation(scan.T_world_cloud.q);
    const [tx, ty, tz] = scan.T_world_cloud.p;
    const { xyz, n } = scan;
    const out = new Float32Array(3 * n);
    for (let i = 0; i < 3 * n; i += 3) {
      const [x, y, z] = [xyz[i], xyz[i + 1], xyz[i + 2]];
      out[i] = R[0][0] * x + R[0][1] * y + R[0][2] * z + tx;
      out[i + 1] = R[1][0] * x + R[1][1] * y + R[1][2] * z + ty;
      out[i + 2] = R[2][0] * x + R[2][1] * y + R[2][2] * z + tz;
    }
    return out;
  }
  setTimeline(timeline) {
    this.timeline = timeline;
    this.trackDirty = true;
    const points = timeline.track.length ? timeline.track : timeline.truth;
    if (points.length) {
      const min = [Infinity, Infinity, Infinity];
      const max = [-Infinity, -Infinity, -Infinity];
      for (const [, x, y, z] of points) {
        [x, y, z].forEach((v, k) => {
          min[k] = Math.min(min[k], v);
          max[k] = Math.max(max[k], v);
        });
      }
      this.camera.setExtent({ min, max });
    }
    this.onChange();
  }
  setTime(t) {
    this.time = t;
    if (Math.abs(t - (this.trackTime ?? -1e9)) > 0.4) this.trackDirty = true;
    this.onChange();
  }
  setDark(dark) {
    this.dark = dark;
    this.gridKey = this.levelKey = null;
    this.trackDirty = this.pathDirty = true;
    this.onChange();
  }

  // ---- derived ----------------------------------------------------------------------------
  /** The covariance of the position in world axes; null: not georeferenced or not finite. */
  positionCovariance() {
    if (!this.nav || !this.T_world_vehicle) return null;
    const R = rotation(this.T_world_vehicle.q);
    const c = this.nav.cov_world_pose;
    const body = [0, 1, 2].map((i) => [c[6 * i], c[6 * i + 1], c[6 * i + 2]]);
    if (!body.flat().every(Number.isFinite)) return null;
    const half = body.map((_, i) => [0, 1, 2].map((j) =>
      R[i][0] * body[0][j] + R[i][1] * body[1][j] + R[i][2] * body[2][j]));
    return half.map((row) => [0, 1, 2].map((j) =>
      row[0] * R[j][0] + row[1] * R[j][1] + row[2] * R[j][2]));
  }
  levels() {
    const i = this.integrity;
    if (!i || i.validity !== 2 || !(i.protection_horizontal_m < 1e4)) return null;
    return [i.protection_horizontal_m, i.protection_vertical_m];
  }
  pointRange() {
    if (this.colorBy === "ring") return [0, this.scan?.last_row ?? ROWS - 1];
    if (this.colorBy === "range") return [0, 60];
    if (this.colorBy === "age") return [RECENT_S, 0];
    const z = this.T_world_vehicle?.p[2] ?? 0;
    return [z + HEIGHT_RANGE[0], z + HEIGHT_RANGE[1]];
  }
  /** What the color bar shows: {title, unit, from, to, ramp}. */
  colorScale() {
    if (this.show.scan || this.show.recent) {
      const titles = {
        height: ["height above the vehicle", "m", ...HEIGHT_RANGE],
        age: ["age of the scan", "s", RECENT_S, 0],
        ring: ["row of the LADAR", "", 0, this.pointRange()[1]],
        range: ["range", "m", 0, 60],
      };
      const [title, unit, from, to] = titles[this.colorBy];
      return { title, unit, from, to, ramp: RAMPS.viridis };
    }
    if (this.show.terrain && this.terrainBy === "height" && this.terrain) {
      return { title: "height of the ground", unit: "m", from: this.terrain.low, to: this.terrain.high, ramp: RAMPS.cividis };
    }
    return null;
  }

  // ---- drawing ----------------------------------------------------------------------------
  updateScan() {
    if (!this.scanDirty || !this.scan) return;
    this.scanDirty = false;
    const { n, xyz, ring } = this.scan;
    const world = (this.scan.world = this.worldPoints(this.scan));
    const data = new Float32Array(4 * n);
    for (let i = 0; i < n; ++i) {
      let value = world[3 * i + 2];
      if (this.colorBy === "ring") value = ring ? ring[i] : 0;
      if (this.colorBy === "range") value = Math.hypot(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
      if (this.colorBy === "age") value = 0;
      data[4 * i] = world[3 * i];
      data[4 * i + 1] = world[3 * i + 1];
      data[4 * i + 2] = world[3 * i + 2];
      data[4 * i + 3] = value;
    }
    this.renderer.updatePoints(this.scanSet, data);
  }
  updateRecent() {
    const now = this.scan?.stamp ?? 0;
    const key = [now, this.colorBy].join();
    if (!this.recentDirty && key === this.recentKey) return;
    this.recentDirty = false;
    this.recentKey = key;
    const shown = this.recent.filter((s) => now - s.stamp <= RECENT_S && now - s.stamp > -0.01);
    const data = new Float32Array(shown.reduce((n, s) => n + (4 * s.data.length) / 3, 0));
    let k = 0;
    for (const s of shown) {
      const age = s.stamp - now;
      for (let i = 0; i < s.data.length; i += 3, k += 4) {
        data[k] = s.data[i];
        data[k + 1] = s.data[i + 1];
        data[k + 2] = s.data[i + 2];
        data[k + 3] = this.colorBy === "age" ? age : s.data[i + 2];
      }
    }
    this.renderer.updatePoints(this.recentSet, data);
  }
  updateTerrain() {
    if (!this.patchDirty) return;
    this.patchDirty = false;
    this.renderer.free(this.terrainSet);
    this.terrainSet = null;
    if (!this.patch) return;
    this.terrain = terrainMesh(this.patch);
    this.terrainSet = this.renderer.makeMesh(this.terrain.vertices, this.terrain.indices);
  }
  updatePath() {
    if (!this.pathDirty || !this.T_world_local) return;
    this.pathDirty = false;
    this.renderer.free(this.pathSet);
    this.pathSet = null;
    if (!this.plan || this.plan.point.length < 2) return;
    const tint = rgba(palette(this.dark).path);
    const at = this.plan.point.map((p) => {
      const w = apply(this.T_world_local, [...p.p_m]);
      return [w[0], w[1], w[2] + 0.05];
    });
    this.pathSet = this.renderer.makeLines(at.slice(1).map((p, i) => [at[i], p, tint]));
  }
  draw(ratio) {
    const r = this.renderer;
    const colors = palette(this.dark);
    r.resize(ratio);
    this.updateScan();
    this.updateRecent();
    this.updateTerrain();
    this.updatePath();
    updateRoutes(this);
    updateTrack(this);
    updateGrid(this);
    const view = this.camera.compute();
    this.lastView = view;
    r.begin(view, colors.background);
    if (this.show.grid) r.drawLines(this.gridSet, { width: ratio });
    if (this.show.terrain && this.terrainSet && this.T_world_local) {
      r.drawMesh(this.terrainSet, {
        model: poseMatrix(this.T_world_local), ramp: RAMPS.cividis,
        byRamp: this.terrainBy === "height", range: [this.terrain.low, this.terrain.high],
        alpha: 1,
      });
    }
    const dash = (length_m) => Math.max(length_m, DASH_PX * view.metersPerPixel);
    if (this.show.truth) r.drawLines(this.truthSet, { width: 2 * ratio, dash_m: dash(2) });
    if (this.show.track) {
      r.drawLines(this.trackSet, { width: 2.5 * ratio });
      r.drawLines(this.outageSet, { width: 3.5 * ratio, dash_m: dash(1.2) });
    }
    this.drawClouds(ratio);
    if (this.show.routes) {
      r.drawLines(this.rejectedSet, { width: 2 * ratio, dash_m: 1.5 * dash(2), over: true });
      r.drawLines(this.chosenSet, { width: 3 * ratio, over: true });
    }
    if (this.show.path) r.drawLines(this.pathSet, { width: 4 * ratio, over: true });
    if (this.T_world_vehicle) this.drawVehicle(ratio, colors);
    if (this.scan && this.firstPicture_ms === null) this.firstPicture_ms = performance.now();
  }
  drawClouds(ratio) {
    const r = this.renderer;
    const range = this.pointRange();
    const ramp = RAMPS.viridis;
    const flat = this.camera.view.flat;
    const size = flat ? Math.min(6, Math.max(1.6, 90 / this.camera.distance)) : 2.6;
    if (this.show.recent) {
      const now = this.scan?.stamp ?? 0;
      const byAge = this.colorBy === "age";
      const fixed = byAge || this.colorBy === "height" ? [0, 0, 0, 0] : [0.5, 0.5, 0.5, 1];
      r.drawPoints(this.recentSet, {
        ramp, range: byAge ? [-RECENT_S, 0] : range, size: 0.75 * size * ratio, alpha: 0.5, color: fixed,
      });
    }
    if (this.show.scan && this.scan) {
      const fixed = this.colorBy === "age" ? [...rampColor(ramp, 1).map((c) => c / 255), 1] : [0, 0, 0, 0];
      r.drawPoints(this.scanSet, { ramp, range, size: size * ratio, color: fixed });
    }
  }
  drawVehicle(ratio, colors) {
    const r = this.renderer;
    const T = this.T_world_vehicle;
    if (this.show.vehicle) r.drawMesh(this.vehicle, { model: poseMatrix(T), color: null, alpha: 1 });
    const levels = this.levels();
    if (this.show.level && levels) {
      const [h, v] = levels;
      const at = { q: [1, 0, 0, 0], p: T.p };
      // From inside, the cylinder would tint the whole view.
      const inside = !this.camera.view.flat && h > 0.6 * this.camera.distance;
      if (!inside) r.drawMesh(this.cylinder, { model: poseMatrix(at, [h, h, v]), color: rgba(colors.level), alpha: 0.16 });
      const key = [h.toFixed(3), this.dark].join();
      if (key !== this.levelKey) {
        this.levelKey = key;
        r.free(this.levelSet);
        this.levelSet = r.makeLines(circle(h, 0, rgba(colors.level)));
      }
      r.drawLines(this.levelSet, { width: 2.5 * ratio, model: poseMatrix(at), over: true });
    }
    const cov = this.show.sigma ? this.positionCovariance() : null;
    if (cov) {
      const { values, vectors } = eigenSymmetric3(cov);
      const s = values.map((l) => 3 * this.magnify * Math.sqrt(Math.max(0, l)) + 1e-4);
      const m = [];
      vectors.forEach((e, k) => m.push(e[0] * s[k], e[1] * s[k], e[2] * s[k], 0));
      m.push(...T.p, 1);
      r.drawMesh(this.sphere, { model: m, color: rgba(colors.sigma), alpha: this.opaqueSigma ? 1 : 0.32, over: true });
      if (!this.opaqueSigma) this.drawOutline(cov, ratio, colors);
    }
  }

  /** The horizontal ellipse of 3 sigma: the silhouette of the ellipsoid from above. */
  drawOutline(cov, ratio, colors) {
    const key = colors.sigma;
    if (this.outlineKey !== key) {
      this.outlineKey = key;
      this.renderer.free(this.outline);
      this.outline = this.renderer.makeLines(circle(1, 0, rgba(colors.sigma)));
    }
    // A square root of the covariance maps the unit circle to the ellipse.
    const a = Math.sqrt(Math.max(1e-12, cov[0][0]));
    const b = cov[0][1] / a;
    const c = Math.sqrt(Math.max(0, cov[1][1] - b * b));
    const k = 3 * this.magnify;
    const model = [k * a, k * b, 0, 0, 0, k * c, 0, 0, 0, 0, 1, 0, ...this.T_world_vehicle.p, 1];
    this.renderer.drawLines(this.outline, { width: 2 * ratio, model, over: true });
  }
}
