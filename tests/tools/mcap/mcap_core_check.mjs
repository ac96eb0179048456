// node mcap_core_check.mjs FILE.mcap CSV_FOLDER: reads the file with @mcap/core and the messages with
// @foxglove/rosmsg and @foxglove/rosmsg2-serialization. Every number of CSV_FOLDER/CHANNEL.csv (from
// `rcs log csv`) must be in the file, and every message of every topic must be readable by its
// schema. Exit status 0: equal; 1: not.
import fs from "node:fs";
import path from "node:path";
import { createRequire } from "node:module";

// The packages are in RCS_NODE_MODULES, outside of the source tree.
const require = createRequire(path.join(process.env.RCS_NODE_MODULES ?? ".", "x.js"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const fzstd = require("fzstd");

const [file, folder] = process.argv.slice(2);
const bytes = fs.readFileSync(file);
const decompressHandlers = {
  zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))),
};
const failures = [];
const fail = (text) => failures.push(text);

/** The columns of `rcs log csv`: arrays of fixed length one per entry, no sequences. */
function columns(prefix, value, type, types, out) {
  for (const field of type.definitions) {
    if (field.isConstant === true) continue;
    const name = prefix + field.name;
    const v = value[field.name];
    if (field.isComplex === true) {
      if (field.isArray !== true) columns(name + "_", v, types.get(field.type), types, out);
    } else if (field.isArray !== true) {
      out.set(name, v);
    } else if (field.arrayLength !== undefined) {
      v.forEach((entry, i) => out.set(`${name}_${i}`, entry));
    }
  }
}

function csvRows(channel) {
  const text = fs.readFileSync(path.join(folder, channel + ".csv"), "utf8");
  const rows = [[""]];
  let quoted = false;
  for (let i = 0; i < text.length; ++i) {
    const row = rows[rows.length - 1];
    const c = text[i];
    if (quoted) {
      if (c === '"' && text[i + 1] === '"') (row[row.length - 1] += '"'), ++i;
      else if (c === '"') quoted = false;
      else row[row.length - 1] += c;
    } else if (c === '"') quoted = true;
    else if (c === ",") row.push("");
    else if (c === "\n") rows.push([""]);
    else row[row.length - 1] += c;
  }
  rows.pop();
  return { names: rows[0], rows: rows.slice(1) };
}

function same(text, value) {
  if (typeof value === "bigint") return BigInt(text) === value;
  if (typeof value === "string") return text === value;
  if (/^-?nan$/.test(text)) return Number.isNaN(value);
  if (/^-?inf$/.test(text)) return value === (text[0] === "-" ? -Infinity : Infinity);
  const number = Number(text);
  return Object.is(number, value) || Object.is(Math.fround(number), value);
}

const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
if (reader.header.profile !== "ros2") fail(`profile ${reader.header.profile}`);
const decoders = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  if (channel.messageEncoding !== "cdr" || schema.encoding !== "ros2msg") {
    fail(`${channel.topic}: ${channel.messageEncoding}, ${schema.encoding}`);
  }
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  const types = new Map(definitions.map((d) => [d.name, d]));
  const top = definitions.find((d) => d.name === undefined) ?? definitions[0];
  decoders.set(channel.id, { reader: new MessageReader(definitions), types, top });
}

// Two-dimensional arrays are flat in ROS 2 and have one column per row and column in the CSV.
const flat = (name) => name.replace(/_([0-5])_([0-5])$/, (_, i, j) => `_#${i}#${j}`);

const rowsOf = new Map();
let numbers = 0;
let messages = 0;
for await (const message of reader.readMessages()) {
  ++messages;
  const { reader: decoder, types, top } = decoders.get(message.channelId);
  const topic = reader.channelsById.get(message.channelId).topic;
  let value;
  try {
    value = decoder.readMessage(message.data);
  } catch (error) {
    fail(`${topic}: ${error.message}`);
    continue;
  }
  if (!topic.startsWith("/rcs/")) continue;
  const channel = topic.slice(5);
  if (!rowsOf.has(channel)) rowsOf.set(channel, { ...csvRows(channel), next: 0 });
  const csv = rowsOf.get(channel);
  const row = csv.rows[csv.next++];
  if (row === undefined) {
    fail(`${topic}: more messages than rows`);
    continue;
  }
  if (BigInt(row[0]) * 1000n !== message.logTime) fail(`${topic}: log time ${message.logTime}`);
  const got = new Map();
  columns("", value, top, types, got);
  // Names of matrices: width 6 or 3.
  for (let k = 1; k < row.length; ++k) {
    const name = csv.names[k];
    let v = got.get(name);
    const matrix = flat(name).match(/^(.*)_#(\d)#(\d)$/);
    if (v === undefined && matrix !== null) {
      const length = [...got.keys()].filter((n) => n.startsWith(matrix[1] + "_") && /^\d+$/.test(n.slice(matrix[1].length + 1))).length;
      v = got.get(`${matrix[1]}_${Math.sqrt(length) * Number(matrix[2]) + Number(matrix[3])}`);
    }
    ++numbers;
    if (v === undefined || !same(row[k], v)) fail(`${topic} ${name}: ${row[k]} and ${v}`);
  }
}
for (const [channel, csv] of rowsOf) {
  if (csv.next !== csv.rows.length) fail(`${channel}: ${csv.next} of ${csv.rows.length} rows`);
}

// Front to back, with all checksums, as a stream.
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(bytes);
let streamed = 0;
for (let record; (record = stream.nextRecord()) !== undefined; ) {
  streamed += record.type === "Message" ? 1 : 0;
}
if (!stream.done()) fail("the stream does not end with the footer");
if (streamed !== messages) fail(`${streamed} messages in the stream, ${messages} by the index`);
if (BigInt(messages) !== reader.statistics.messageCount) fail("the count of the statistics");

for (const text of failures.slice(0, 20)) console.error("FAILED: " + text);
console.log(`${decoders.size} topics, ${messages} messages, ${numbers} numbers, ${failures.length} failures`);
process.exit(failures.length > 0 || numbers === 0 ? 1 : 0);
