// The two WebSockets: data as every client of foxglove.websocket.v1 receives it, and the control of
// a log. Both connect again after a loss.

import { readerOf } from "./cdr.js";

const RETRY_MS = 1000;
const url = () => `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;

/** Calls handlers[topic](message, time in seconds); only topics that the server offers. */
export class DataConnection {
  constructor(handlers, onStatus) {
    this.handlers = handlers;
    this.onStatus = onStatus;
    this.topics = new Map(); // name -> channel
    this.bytes = 0;
    this.connect();
  }
  connect() {
    const socket = new WebSocket(url(), "foxglove.websocket.v1");
    socket.binaryType = "arraybuffer";
    this.readers = new Map(); // subscription -> {read, handler}
    socket.onmessage = (event) => {
      if (typeof event.data === "string") this.onText(socket, JSON.parse(event.data));
      else this.onData(event.data);
    };
    socket.onclose = () => {
      this.onStatus("connection lost; connecting again");
      setTimeout(() => this.connect(), RETRY_MS);
    };
    socket.onopen = () => this.onStatus("");
  }
  onText(socket, message) {
    if (message.op === "status") this.onStatus(message.message, false);
    if (message.op !== "advertise") return;
    const subscriptions = [];
    for (const channel of message.channels) {
      this.topics.set(channel.topic, channel);
      const handler = this.handlers[channel.topic];
      if (!handler) continue;
      this.readers.set(channel.id, { read: readerOf(channel.schema), handler });
      subscriptions.push({ id: channel.id, channelId: channel.id });
    }
    socket.send(JSON.stringify({ op: "subscribe", subscriptions }));
  }
  onData(buffer) {
    this.bytes += buffer.byteLength;
    const view = new DataView(buffer);
    if (view.getUint8(0) !== 1) return;
    const entry = this.readers.get(view.getUint32(1, true));
    if (!entry) return;
    const time = Number(view.getBigUint64(5, true) / 1000n) * 1e-6;
    entry.handler(entry.read(buffer, 13), time);
  }
}

export class ControlConnection {
  constructor(onMessage, onStatus) {
    this.onMessage = onMessage;
    this.onStatus = onStatus;
    this.waiting = [];
    this.connect();
  }
  connect() {
    this.socket = new WebSocket(url(), "rcs.view.v1");
    this.socket.onmessage = (event) => this.onMessage(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.onStatus("connection lost; connecting again");
      setTimeout(() => this.connect(), RETRY_MS);
    };
    this.socket.onopen = () => {
      this.onStatus("");
      for (const text of this.waiting.splice(0)) this.socket.send(text);
    };
  }
  send(message) {
    const text = JSON.stringify(message);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(text);
    else this.waiting.push(text);
  }
}
