// SPDX-License-Identifier: Apache-2.0
// WebSockets without a browser, and a proxy that looks into them.
import { randomBytes } from 'node:crypto';
import { connect, createServer } from 'node:net';
import { wall_ms } from './kit.mjs';

/** Splits bytes into frames of WebSocket; calls frame(opcode, payload) for each, and returns the rest. */
function readFrames(bytes, frame) {
  for (;;) {
    if (bytes.length < 2) return bytes;
    const short = bytes[1] & 127, masked = bytes[1] >> 7;
    const at = 2 + (short === 126 ? 2 : short === 127 ? 8 : 0);
    if (bytes.length < at + 4 * masked) return bytes;
    const size = short === 126 ? bytes.readUInt16BE(2) : short === 127 ? Number(bytes.readBigUInt64BE(2)) : short;
    const begin = at + 4 * masked;
    if (bytes.length < begin + size) return bytes;
    const payload = Buffer.from(bytes.subarray(begin, begin + size));
    if (masked) payload.forEach((byte, i) => payload[i] = byte ^ bytes[at + i % 4]);
    frame(bytes[0] & 15, payload);
    bytes = bytes.subarray(begin + size);
  }
}

export function maskedFrame(opcode, text) {
  const payload = Buffer.from(text), mask = randomBytes(4);
  payload.forEach((byte, i) => payload[i] = byte ^ mask[i % 4]);
  const long = payload.length > 125;
  const head = Buffer.from([0x80 | opcode, 0x80 | (long ? 126 : payload.length), ...(long ? [payload.length >> 8, payload.length & 255] : [])]);
  return Buffer.concat([head, mask, payload]);
}

/** A client of a WebSocket. Calls text(message) and binary(bytes); { send(object), socket, opened: a promise }. */
export function openStream(url, { text = () => {}, binary = () => {} } = {}) {
  const { hostname, port, pathname, search } = new URL(url);
  const socket = connect(Number(port), hostname);
  socket.on('error', () => {});
  socket.write(`GET ${pathname}${search} HTTP/1.1\r\nHost: ${hostname}:${port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n`
    + `Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\n\r\n`);
  let rest = Buffer.alloc(0), isOpen = false, open;
  const opened = new Promise((resolve) => open = resolve);
  socket.on('data', (bytes) => {
    rest = Buffer.concat([rest, bytes]);
    if (!isOpen) {
      const end = rest.indexOf('\r\n\r\n');
      if (end < 0) return;
      if (!rest.toString('latin1', 0, end).includes(' 101 ')) throw new Error(rest.toString('latin1', 0, end));
      rest = rest.subarray(end + 4);
      isOpen = true;
      open();
    }
    rest = readFrames(rest, (opcode, payload) => {
      if (opcode === 1) text(JSON.parse(payload));
      else if (opcode === 2) binary(payload);
      else if (opcode === 9) socket.write(maskedFrame(10, ''));
    });
  });
  return { socket, opened, send: (object) => socket.write(maskedFrame(1, JSON.stringify(object))) };
}

/** Forwards connections to a port until it is cut. Then they stay open, and nothing passes any more. */
export async function startProxy(port) {
  const proxy = { isCut: false, lastDrive_ms: 0 };
  const server = createServer((near) => {
    const far = connect(port, '127.0.0.1');
    let rest;
    const forward = (from, to, look) => {
      from.on('data', (bytes) => {
        if (proxy.isCut) return;
        to.write(bytes);
        look(bytes);
      });
      from.on('close', () => proxy.isCut || to.destroy());
      from.on('error', () => {});
    };
    forward(near, far, (bytes) => {
      const text = bytes.toString('latin1');
      if (text.startsWith('GET ')) rest = text.includes('/stream?') ? Buffer.alloc(0) : undefined;
      else if (rest) {
        rest = readFrames(Buffer.concat([rest, bytes]), (opcode, payload) => {
          if (payload.includes('"drive"')) proxy.lastDrive_ms = wall_ms();
        });
      }
    });
    forward(far, near, () => {});
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  process.on('exit', () => server.close());
  return Object.assign(proxy, { port: server.address().port, server });
}
