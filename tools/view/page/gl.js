// A small renderer on WebGL 2: points colored by a ramp, lines of any width, and shaded triangles.
// docs/adr/0090 has the reason why it is not three.js.

import { multiply, IDENTITY } from "./math.js";
import { rampTexture } from "./colors.js";

const POINT_VERTEX = `#version 300 es
uniform mat4 matrix; uniform float size; uniform vec2 range; uniform float reference;
in vec3 position; in float value; out float shade;
void main() {
  gl_Position = matrix * vec4(position, 1.0);
  shade = clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
  // Near points are larger, within limits that keep far ones visible.
  gl_PointSize = size * clamp(reference / gl_Position.w, 0.75, 2.2);
}`;
const POINT_FRAGMENT = `#version 300 es
precision mediump float;
uniform sampler2D ramp; uniform vec4 fixed_color; uniform float alpha;
in float shade; out vec4 color;
void main() {
  vec2 d = gl_PointCoord - 0.5;
  if (dot(d, d) > 0.3) discard;
  vec4 c = texture(ramp, vec2(shade * 255.0 / 256.0 + 0.5 / 256.0, 0.5));
  color = vec4(mix(c.rgb, fixed_color.rgb, fixed_color.a), alpha);
}`;

const LINE_VERTEX = `#version 300 es
uniform mat4 matrix; uniform vec2 viewport; uniform float width;
in vec3 a; in vec3 b; in vec4 tint; in float along;
out vec4 shade; out float dash; out float across_px;
void main() {
  float end = float(gl_VertexID & 1);
  float side = float(gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 p = matrix * vec4(a, 1.0);
  vec4 q = matrix * vec4(b, 1.0);
  // The part behind the camera is cut off before the division.
  const float near = 0.02;
  if (p.w < near && q.w < near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (p.w < near) p = mix(p, q, (near - p.w) / (q.w - p.w));
  if (q.w < near) q = mix(q, p, (near - q.w) / (p.w - q.w));
  vec2 d = (q.xy / q.w - p.xy / p.w) * viewport;
  float l = length(d);
  vec2 across = l > 1e-4 ? vec2(-d.y, d.x) / l : vec2(0.0, 1.0);
  vec4 here = end > 0.5 ? q : p;
  float half_px = 0.5 * width + 0.75;
  across_px = side * half_px;
  gl_Position = here + vec4(across * side * 2.0 * half_px / viewport * here.w, 0.0, 0.0);
  shade = tint;
  dash = along + (end > 0.5 ? distance(a, b) : 0.0);
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform float dash_m; uniform float width;
in vec4 shade; in float dash; in float across_px; out vec4 color;
void main() {
  if (dash_m > 0.0 && fract(dash / dash_m) > 0.55) discard;
  float edge = clamp(0.5 * width + 0.5 - abs(across_px), 0.0, 1.0);
  color = vec4(shade.rgb, shade.a * edge);
}`;

const MESH_VERTEX = `#version 300 es
uniform mat4 matrix; uniform mat4 model; uniform vec2 range;
uniform float by_ramp; uniform float alpha; uniform vec4 tint_all; uniform sampler2D ramp;
in vec3 position; in vec4 tint; in float value; in float lit;
out vec4 shade;
void main() {
  gl_Position = matrix * (model * vec4(position, 1.0));
  float at = clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
  vec3 by_height = texture(ramp, vec2(at * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
  vec3 c = mix(mix(tint.rgb, by_height, by_ramp), tint_all.rgb, tint_all.a);
  shade = vec4(c * lit, tint.a * alpha);
}`;
const MESH_FRAGMENT = `#version 300 es
precision mediump float;
in vec4 shade; out vec4 color;
void main() { color = shade; }`;

function program(gl, vertex, fragment) {
  const p = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(p, shader);
  }
  gl.linkProgram(p);
  if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p));
  const uniforms = new Proxy({}, {
    get(known, name) { return (known[name] ??= gl.getUniformLocation(p, name)); },
  });
  return { p, uniforms };
}

export class Renderer {
  constructor(canvas) {
    // The buffer is kept, so that tests and pictures can read it after the frame. Multisampling
    // would take most of the time of a software renderer: lines and points are smooth by themselves.
    const gl = canvas.getContext("webgl2",
      { antialias: false, alpha: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser offers no WebGL 2, which the 3D view needs");
    this.gl = gl;
    this.canvas = canvas;
    this.points = program(gl, POINT_VERTEX, POINT_FRAGMENT);
    this.lines = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.meshes = program(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.ramps = new Map();
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
  }
  ramp(colors) {
    const gl = this.gl;
    if (!this.ramps.has(colors)) {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE,
        rampTexture(colors));
      for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR],
        [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
        [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
        gl.texParameteri(gl.TEXTURE_2D, name, value);
      }
      this.ramps.set(colors, texture);
    }
    gl.bindTexture(gl.TEXTURE_2D, this.ramps.get(colors));
  }
  resize(ratio) {
    const w = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const h = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
  }
  /** @param view {matrix, reference} of the camera */
  begin(view, background) {
    const gl = this.gl;
    this.view = view;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...background, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }
  buffer(data, usage) {
    const gl = this.gl;
    const b = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, b);
    gl.bufferData(gl.ARRAY_BUFFER, data, usage ?? gl.DYNAMIC_DRAW);
    return b;
  }
  attribute(prog, name, buffer, size, stride, offset, divisor = 0) {
    const gl = this.gl;
    const at = gl.getAttribLocation(prog.p, name);
    if (at < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset);
    gl.vertexAttribDivisor(at, divisor);
  }

  /** @param data Float32Array of x, y, z, value for each point */
  makePoints(data) {
    const gl = this.gl;
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    const buffer = this.buffer(data);
    this.attribute(this.points, "position", buffer, 3, 16, 0);
    this.attribute(this.points, "value", buffer, 1, 16, 12);
    return { vao, buffers: [buffer], n: data.length / 4 };
  }
  updatePoints(set, data) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, set.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    set.n = data.length / 4;
  }
  /** @param o {ramp, range, size, alpha, color, model} */
  drawPoints(set, o) {
    if (!set || set.n === 0) return;
    const gl = this.gl;
    const { p, uniforms: u } = this.points;
    gl.useProgram(p);
    this.ramp(o.ramp);
    gl.uniformMatrix4fv(u.matrix, false,
      o.model ? multiply(this.view.matrix, o.model) : this.view.matrix);
    gl.uniform1f(u.size, o.size);
    gl.uniform1f(u.reference, this.view.reference);
    gl.uniform2f(u.range, ...o.range);
    gl.uniform1f(u.alpha, o.alpha ?? 1);
    gl.uniform4f(u.fixed_color, ...(o.color ?? [0, 0, 0, 0]));
    gl.bindVertexArray(set.vao);
    gl.drawArrays(gl.POINTS, 0, set.n);
  }

  /** @param segments list of [a, b, [r, g, b, a]]; `along` of dashes grows from one to the next */
  makeLines(segments) {
    const gl = this.gl;
    const data = new Float32Array(segments.length * 11);
    let along = 0;
    segments.forEach(([a, b, tint], i) => {
      data.set([...a, ...b, ...tint, along], 11 * i);
      along += Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    });
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    const buffer = this.buffer(data);
    this.attribute(this.lines, "a", buffer, 3, 44, 0, 1);
    this.attribute(this.lines, "b", buffer, 3, 44, 12, 1);
    this.attribute(this.lines, "tint", buffer, 4, 44, 24, 1);
    this.attribute(this.lines, "along", buffer, 1, 44, 40, 1);
    return { vao, buffers: [buffer], n: segments.length };
  }
  /** @param o {width, dash_m, model, over}: over: drawn over what is nearer */
  drawLines(set, o) {
    if (!set || set.n === 0) return;
    const gl = this.gl;
    const { p, uniforms: u } = this.lines;
    gl.useProgram(p);
    gl.uniformMatrix4fv(u.matrix, false,
      o.model ? multiply(this.view.matrix, o.model) : this.view.matrix);
    gl.uniform2f(u.viewport, this.canvas.width, this.canvas.height);
    gl.uniform1f(u.width, o.width);
    gl.uniform1f(u.dash_m, o.dash_m ?? 0);
    if (o.over) gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(set.vao);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, set.n);
    if (o.over) gl.enable(gl.DEPTH_TEST);
  }

  /** @param vertices Float32Array of x, y, z, r, g, b, a, value, light; @param indices Uint32Array */
  makeMesh(vertices, indices) {
    const gl = this.gl;
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    const buffer = this.buffer(vertices);
    this.attribute(this.meshes, "position", buffer, 3, 36, 0);
    this.attribute(this.meshes, "tint", buffer, 4, 36, 12);
    this.attribute(this.meshes, "value", buffer, 1, 36, 28);
    this.attribute(this.meshes, "lit", buffer, 1, 36, 32);
    const index = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    return { vao, buffers: [buffer, index], n: indices.length };
  }
  /** @param o {model, ramp, range, byRamp, alpha, color, over} */
  drawMesh(set, o) {
    if (!set || set.n === 0) return;
    const gl = this.gl;
    const { p, uniforms: u } = this.meshes;
    gl.useProgram(p);
    if (o.ramp) this.ramp(o.ramp);
    gl.uniformMatrix4fv(u.matrix, false, this.view.matrix);
    gl.uniformMatrix4fv(u.model, false, o.model ?? IDENTITY);
    gl.uniform2f(u.range, ...(o.range ?? [0, 1]));
    gl.uniform1f(u.by_ramp, o.byRamp ? 1 : 0);
    gl.uniform1f(u.alpha, o.alpha ?? 1);
    gl.uniform4f(u.tint_all, ...(o.color ? [...o.color.slice(0, 3), 1] : [0, 0, 0, 0]));
    const translucent = (o.alpha ?? 1) < 1;
    if (translucent) gl.depthMask(false);
    if (o.over) gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(set.vao);
    gl.drawElements(gl.TRIANGLES, set.n, gl.UNSIGNED_INT, 0);
    if (o.over) gl.enable(gl.DEPTH_TEST);
    if (translucent) gl.depthMask(true);
  }
  free(set) {
    if (!set) return;
    this.gl.deleteVertexArray(set.vao);
    for (const b of set.buffers) this.gl.deleteBuffer(b);
  }
}
