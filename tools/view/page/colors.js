// Colors of data. Ramps are even in lightness (viridis, by Smith and van der Walt, public domain, and
// cividis by Nunez et al.), and categories are of Okabe and Ito and of Tol, some of them darker: both
// are readable with any color vision. Meaning never depends on color alone: lines differ in dash or
// width, marks in shape, lanes have texts, and their failures are hatched.

const VIRIDIS = [
  [68, 1, 84], [72, 40, 120], [62, 73, 137], [49, 104, 142], [38, 130, 142],
  [31, 158, 137], [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37],
];
const CIVIDIS = [
  [0, 34, 78], [23, 55, 109], [61, 76, 107], [88, 97, 110], [112, 119, 117],
  [137, 141, 120], [164, 163, 117], [194, 187, 104], [225, 211, 82], [254, 232, 56],
];

export const RAMPS = { viridis: VIRIDIS, cividis: CIVIDIS };

/** @returns [r, g, b] in 0..255 at x in [0, 1] */
export function rampColor(ramp, x) {
  const t = Math.min(1, Math.max(0, x)) * (ramp.length - 1);
  const i = Math.min(ramp.length - 2, Math.floor(t));
  return ramp[i].map((c, k) => c + (t - i) * (ramp[i + 1][k] - c));
}

export function rampTexture(ramp) {
  const data = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; ++i) {
    const [r, g, b] = rampColor(ramp, i / 255);
    data.set([r, g, b, 255], 4 * i);
  }
  return data;
}

export function rampCss(ramp) {
  const stops = ramp.map((c, i) => `rgb(${c.join(",")}) ${(100 * i) / (ramp.length - 1)}%`);
  return `linear-gradient(to top, ${stops.join(", ")})`;
}

const LIGHT = {
  background: [0.955, 0.96, 0.967], grid: [0.78, 0.8, 0.83], text: "#1b1f24", faint: "#5b6470",
  line: "#d4d9df", panel: "#ffffff", truth: [0.35, 0.38, 0.42], error: "#1b1f24",
  vehicle: [0.25, 0.29, 0.34], sigma: "#0072b2", level: "#d98200", limit: "#8a8f96",
  track: "#0072b2", outage: "#cc5500", path: "#aa4499", route: "#117733", accepted: "#0072b2",
  rejected: "#cc3311", untested: "#7a828c",
};
const DARK = {
  background: [0.085, 0.1, 0.118], grid: [0.24, 0.27, 0.31], text: "#e7eaee", faint: "#a0a9b4",
  line: "#363d46", panel: "#1c2127", truth: [0.66, 0.69, 0.73], error: "#f2f4f6",
  vehicle: [0.82, 0.85, 0.89], sigma: "#56b4e9", level: "#f0a500", limit: "#8a929c",
  track: "#56b4e9", outage: "#ff8c42", path: "#e39bd0", route: "#5fd3a5", accepted: "#56b4e9",
  rejected: "#ff6a4d", untested: "#9aa3ad",
};

export function palette(dark) { return dark ? DARK : LIGHT; }

/** "#0072b2" -> [r, g, b, a] in 0..1 */
export function rgba(hex, alpha = 1) {
  if (Array.isArray(hex)) return [...hex.slice(0, 3), alpha];
  const n = parseInt(hex.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255, alpha];
}

// Modes of WM: from full support (blue) over GPS or LADAR alone to none (dark red).
export const MODE_COLORS = {
  ALIGN: "#999999", GPS_INS_LADAR: "#0072b2", GPS_INS: "#56b4e9", INS_LADAR: "#e69f00",
  GPS_LADAR: "#009e73", LADAR: "#f0e442", INS_DR: "#d55e00", LOST: "#7a0000",
};
export const STATUS_COLORS = {
  accepted: "#56b4e9", none: "#b8bec6", quarantine: "#7a0000", probation: "#e69f00",
  suspect: "#d55e00", readmitting: "#cc79a7",
};
export const FIX_COLORS = {
  NONE: "#b8bec6", SINGLE: "#e69f00", DIFFERENTIAL: "#f0e442", RTK_FLOAT: "#56b4e9",
  RTK_FIXED: "#0072b2",
};
/** States of BG and of the mission; the others stop the vehicle or report a failure. */
export const STATE_COLORS = {
  DRIVING: "#0072b2", DRIVING_NO_GPS: "#e69f00", RETURNING: "#cc79a7", LEAVING_ZONE: "#e69f00",
  BACKING_OUT: "#e69f00",
  PLANNING: "#56b4e9", INITIALIZING_HEADING: "#56b4e9", ARRIVED: "#009e73", RETURNED: "#009e73",
  IDLE: "#b8bec6", HALT: "#b8bec6", RELEASED: "#b8bec6", HOLDING: "#b8bec6",
};
export const FAILURE = "#d55e00";
export const SERIES_COLORS = {
  light: ["#0072b2", "#d98200", "#117733", "#aa4499", "#555e69", "#88651c"],
  dark: ["#56b4e9", "#f0a500", "#5fd3a5", "#e39bd0", "#b9c1ca", "#d9b46a"],
};

/** Black or white, whichever is readable on the color. */
export function textOn(hex) {
  const [r, g, b] = rgba(hex);
  return 0.3 * r + 0.59 * g + 0.11 * b > 0.55 ? "#101418" : "#ffffff";
}
