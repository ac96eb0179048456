// Lines on the ground: the track with and without GPS, the true track, and the grid.

import { palette, rgba } from "./colors.js";

const STEP_M = 8; // between two points of a track: a step of frame world, not a motion
const PALE = 0.28; // of what comes later in the log

export function updateTrack(view) {
  if (!view.trackDirty || !view.timeline) return;
  view.trackDirty = false;
  view.trackTime = view.time;
  const colors = palette(view.dark);
  const { track, truth } = view.timeline;
  const alpha = (p) => (p[0] <= view.time ? 1 : PALE);
  /** Segments between the points for which `wanted` holds. */
  const lines = (points, wanted, tint) => {
    const out = [];
    for (let i = 1; i < points.length; ++i) {
      const [a, p] = [points[i - 1], points[i]];
      if (!wanted(p) || Math.hypot(p[1] - a[1], p[2] - a[2]) > STEP_M) continue;
      out.push([a.slice(1, 4), p.slice(1, 4), tint(p)]);
    }
    return out;
  };
  for (const set of [view.trackSet, view.outageSet, view.truthSet]) view.renderer.free(set);
  view.trackSet = view.renderer.makeLines(lines(track, (p) => p[4], (p) => rgba(colors.track, alpha(p))));
  view.outageSet = view.renderer.makeLines(lines(track, (p) => !p[4], (p) => rgba(colors.outage, alpha(p))));
  view.truthSet = view.renderer.makeLines(lines(truth, () => true, (p) => [...colors.truth, 0.85 * alpha(p)]));
}

/** Around the center of the view, in steps of 10 m or 50 m. */
export function updateGrid(view) {
  const step = view.camera.view.flat && view.camera.distance > 200 ? 50 : 10;
  const c = view.camera.center;
  const [cx, cy] = [Math.round(c[0] / step) * step, Math.round(c[1] / step) * step];
  const z = Math.round(((view.T_world_vehicle?.p[2] ?? 0) - 0.75) * 4) / 4;
  const key = [cx, cy, z, step, view.dark].join();
  if (key === view.gridKey) return;
  view.gridKey = key;
  const tint = [...palette(view.dark).grid, 0.75];
  const half = 12 * step;
  const segments = [];
  for (let d = -half; d <= half; d += step) {
    segments.push([[cx + d, cy - half, z], [cx + d, cy + half, z], tint]);
    segments.push([[cx - half, cy + d, z], [cx + half, cy + d, z], tint]);
  }
  view.gridStep = step;
  view.renderer.free(view.gridSet);
  view.gridSet = view.renderer.makeLines(segments);
}
