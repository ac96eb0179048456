// Messages in CDR (XCDR1, little-endian), read by their schema `ros2msg`: the same bytes that every
// other client of the server receives.

const SIZES = {
  bool: 1, byte: 1, char: 1, int8: 1, uint8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4,
  int64: 8, uint64: 8, float32: 4, float64: 8,
};
const GET = {
  bool: (v, o) => v.getUint8(o) !== 0, byte: (v, o) => v.getUint8(o), char: (v, o) => v.getUint8(o),
  int8: (v, o) => v.getInt8(o), uint8: (v, o) => v.getUint8(o),
  int16: (v, o) => v.getInt16(o, true), uint16: (v, o) => v.getUint16(o, true),
  int32: (v, o) => v.getInt32(o, true), uint32: (v, o) => v.getUint32(o, true),
  // Times in microseconds and identifiers; those above 2^53 are not exact.
  int64: (v, o) => Number(v.getBigInt64(o, true)), uint64: (v, o) => Number(v.getBigUint64(o, true)),
  float32: (v, o) => v.getFloat32(o, true), float64: (v, o) => v.getFloat64(o, true),
};
const ARRAYS = {
  byte: Uint8Array, char: Uint8Array, int8: Int8Array, uint8: Uint8Array, int16: Int16Array,
  uint16: Uint16Array, int32: Int32Array, uint32: Uint32Array, float32: Float32Array,
  float64: Float64Array,
};

/** Reads values after the header of 4 bytes; positions are relative to its end. */
class Cursor {
  constructor(buffer, offset) {
    this.buffer = buffer;
    this.base = offset + 4;
    this.view = new DataView(buffer);
    this.at = 0;
  }
  align(size) { this.at = Math.ceil(this.at / size) * size; }
  primitive(type) {
    const size = SIZES[type];
    this.align(size);
    const value = GET[type](this.view, this.base + this.at);
    this.at += size;
    return value;
  }
  text() {
    const length = this.primitive("uint32");
    const bytes = new Uint8Array(this.buffer, this.base + this.at, Math.max(0, length - 1));
    this.at += length;
    return new TextDecoder().decode(bytes);
  }
  primitives(type, n) {
    if (n === 0) return ARRAYS[type] ? new ARRAYS[type](0) : [];
    const size = SIZES[type];
    this.align(size);
    const begin = this.base + this.at;
    this.at += n * size;
    // A copy: the bytes in the frame are not aligned.
    if (ARRAYS[type]) return new ARRAYS[type](this.buffer.slice(begin, begin + n * size));
    return Array.from({ length: n }, (_, i) => GET[type](this.view, begin + i * size));
  }
}

function parseTypes(schema) {
  const types = new Map();
  let fields = [];
  types.set("", fields);
  for (const raw of schema.split("\n")) {
    const line = raw.replace(/#.*/, "").trim();
    if (line === "" || line.startsWith("====")) continue;
    if (line.startsWith("MSG:")) {
      fields = [];
      types.set(line.slice(4).trim(), fields);
      continue;
    }
    const match = /^(\S+?)(\[(\d*)\])?\s+(\w+)\s*(=.*)?$/.exec(line);
    if (!match || match[5]) continue; // a constant
    fields.push({
      type: match[1], array: match[2] !== undefined, fixed: match[3] ? Number(match[3]) : 0,
      name: match[4],
    });
  }
  return types;
}

/** @returns a function (buffer, offset of the payload) -> object */
export function readerOf(schema) {
  const types = parseTypes(schema);
  const readers = new Map();
  const find = (name) => {
    if (types.has(name)) return name;
    const short = name.split("/").pop();
    for (const known of types.keys()) {
      if (known.split("/").pop() === short) return known;
    }
    throw new Error(`schema without type ${name}`);
  };
  const message = (name) => {
    const key = name === "" ? "" : find(name);
    if (!readers.has(key)) {
      const read = (cursor) => {
        const out = {};
        for (const step of steps) step(cursor, out);
        return out;
      };
      readers.set(key, read);
      const steps = types.get(key).map((field) => {
        const read_one = field.type === "string" ? (c) => c.text()
          : SIZES[field.type] ? (c) => c.primitive(field.type) : message(field.type);
        if (!field.array) return (c, out) => { out[field.name] = read_one(c); };
        const count = (c) => field.fixed || c.primitive("uint32");
        if (SIZES[field.type]) {
          return (c, out) => { out[field.name] = c.primitives(field.type, count(c)); };
        }
        return (c, out) => {
          const n = count(c);
          const list = [];
          for (let i = 0; i < n; ++i) list.push(read_one(c));
          out[field.name] = list;
        };
      });
    }
    return readers.get(key);
  };
  const read = message("");
  return (buffer, offset) => read(new Cursor(buffer, offset));
}

/** Seconds of a time of ROS 2, for comparison with other stamps: a text, exact to the nanosecond. */
export const stampKey = (time) => `${time.sec}.${time.nanosec}`;
export const stampSeconds = (time) => time.sec + time.nanosec * 1e-9;

/** x, y, z and the optional ring of a PointCloud2 with fields of this system. */
export function cloudPoints(cloud) {
  const n = cloud.width * cloud.height;
  const offsets = Object.fromEntries(cloud.fields.map((f) => [f.name, f.offset]));
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const xyz = new Float32Array(3 * n);
  const ring = offsets.ring === undefined ? null : new Float32Array(n);
  for (let i = 0; i < n; ++i) {
    const at = i * cloud.point_step;
    xyz[3 * i] = view.getFloat32(at + offsets.x, true);
    xyz[3 * i + 1] = view.getFloat32(at + offsets.y, true);
    xyz[3 * i + 2] = view.getFloat32(at + offsets.z, true);
    if (ring) ring[i] = view.getUint16(at + offsets.ring, true);
  }
  return { n, xyz, ring };
}

/** At most `most` of n points x, y, z. */
export function thinned(xyz, n, most) {
  const stride = Math.max(1, Math.ceil(n / most));
  const out = new Float32Array(3 * Math.ceil(n / stride));
  for (let i = 0, k = 0; i < n; i += stride, k += 3) out.set(xyz.subarray(3 * i, 3 * i + 3), k);
  return out;
}
