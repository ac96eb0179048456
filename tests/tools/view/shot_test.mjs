// shot_test.mjs FOLDER: the pictures that shot_test.sh made have the requested size and content.
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";
import assert from "node:assert/strict";

/// Pixels of a PNG with 8 bits per channel, not interlaced, as Chromium writes them.
function readPng(file) {
  const data = readFileSync(file);
  assert.equal(data.toString("latin1", 1, 4), "PNG", file);
  let head = null;
  const parts = [];
  for (let at = 8; at < data.length; ) {
    const length = data.readUInt32BE(at);
    const type = data.toString("latin1", at + 4, at + 8);
    const body = data.subarray(at + 8, at + 8 + length);
    if (type === "IHDR") head = body;
    if (type === "IDAT") parts.push(body);
    at += length + 12;
  }
  const [width, height] = [head.readUInt32BE(0), head.readUInt32BE(4)];
  const channels = { 2: 3, 6: 4 }[head[9]];
  assert.ok(head[8] === 8 && channels && head[12] === 0, `${file}: unexpected kind of PNG`);
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const pixels = Buffer.alloc(stride * height);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; ++x) {
      const left = x >= channels ? pixels[y * stride + x - channels] : 0;
      const up = y > 0 ? pixels[(y - 1) * stride + x] : 0;
      const corner = x >= channels && y > 0 ? pixels[(y - 1) * stride + x - channels] : 0;
      const p = left + up - corner;
      const [a, b, c] = [Math.abs(p - left), Math.abs(p - up), Math.abs(p - corner)];
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      const predicted = [0, left, up, (left + up) >> 1, paeth][filter];
      pixels[y * stride + x] = raw[y * (stride + 1) + 1 + x] + predicted;
    }
  }
  const colors = new Map();
  let sum = 0;
  for (let k = 0; k < pixels.length; k += channels) {
    const color = (pixels[k] << 16) | (pixels[k + 1] << 8) | pixels[k + 2];
    colors.set(color, (colors.get(color) ?? 0) + 1);
    sum += (pixels[k] + pixels[k + 1] + pixels[k + 2]) / 3;
  }
  return { width, height, colors, brightness: sum / (width * height), pixels };
}

const folder = process.argv[2];
const read = (name) => readPng(`${folder}/${name}.png`);
const panels = ["all", "3d", "timeline", "status", "pairs"];
const pictures = Object.fromEntries(panels.map((name) => [name, read(name)]));
for (const [name, picture] of Object.entries(pictures)) {
  assert.deepEqual([picture.width, picture.height], [900, 600], name);
  const background = Math.max(...picture.colors.values());
  assert.ok(picture.colors.size > 30, `${name}: ${picture.colors.size} colors`);
  assert.ok(background < 0.995 * 900 * 600, `${name}: almost empty`);
  for (const [other, second] of Object.entries(pictures)) {
    assert.ok(name === other || !picture.pixels.equals(second.pixels), `${name} is the picture of ${other}`);
  }
}
assert.ok(read("dark").brightness < 0.5 * pictures.all.brightness, "--dark is dark");
assert.ok(!read("earlier").pixels.equals(pictures["3d"].pixels), "another moment is another picture");
