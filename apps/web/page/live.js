// SPDX-License-Identifier: Apache-2.0
// The page of a robot that is driving: everything comes over one WebSocket.
import { addressOf, el, fixed, plural, schemeToggle, setText } from './kit.js';
import { FrameStore } from './player.js';
import { RunView, runWords } from './runview.js';
import { DriveControl, driveControls } from './drive.js';

const mostFrames = 9000;      // 10 minutes at 15 Hz
const mostImageBytes = 96e6;  // older frames keep their numbers only
const silentAfter_ms = 2000;
const longestRetry_ms = 8000;
const rateOver_ms = 2000;

/** The frame's number, the view, and the image's type and bytes of a binary message. */
export function imageMessage(buffer) {
  const head = new DataView(buffer);
  return { frame: Number(head.getBigUint64(0, true)), view: head.getUint8(8) === 0 ? 'lower' : 'upper',
    type: head.getUint8(9) === 0 ? 'image/jpeg' : 'image/png', bytes: new Uint8Array(buffer, 10) };
}

/** Images by frame number. The oldest are dropped, with the outlines that are drawn in them. */
export class ImageStore {
  constructor(mostBytes) { Object.assign(this, { mostBytes, bytes: 0, held: new Map() }); }

  put({ frame, view, type, bytes }) {
    if (!this.held.has(frame)) this.held.set(frame, { size: 0 });
    const entry = this.held.get(frame);
    entry[view] = { type, bytes };
    entry.size += bytes.length;
    this.bytes += bytes.length;
    for (const [number, oldest] of this.held) {
      if (this.bytes <= this.mostBytes || number === frame) break;
      this.bytes -= oldest.size;
      this.held.delete(number);
      delete oldest.frame?.outlines;
    }
  }

  /** The image as a Blob; undefined where it is not held. */
  blob(frame, view) {
    const image = this.held.get(frame)?.[view];
    return image && new Blob([image.bytes], { type: image.type });
  }

  /** Notes the frame's object, whose outlines are dropped with its images. */
  belongTo(frame) {
    const entry = this.held.get(frame.frame);
    if (entry) entry.frame = frame;
  }
}

/** A WebSocket that connects again by itself, after longer and longer waits, until the run has ended. */
export class Connection {
  constructor(handlers) {
    Object.assign(this, { handlers, retry_ms: 500 });
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(addressOf('stream').replace(/^http/, 'ws'));
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => {
      this.retry_ms = 500;
      this.handlers.changed(true);
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data !== 'string') {
        this.handlers.image(imageMessage(data));
        return;
      }
      const line = JSON.parse(data);
      this.ended ||= line.type === 'end';
      this.handlers.line(line);
    };
    this.socket.onclose = () => {
      this.handlers.changed(false);
      if (this.ended) return;
      setTimeout(() => this.connect(), this.retry_ms);
      this.retry_ms = Math.min(this.retry_ms * 2, longestRetry_ms);
    };
  }

  send(message) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message)); }
}

/** The stream's state as [good or bad, words]. @param silent_ms since the newest frame; undefined before the first */
export function streamState({ connected, end, silent_ms }) {
  if (end?.finished) return ['good', 'The run has ended.'];
  if (end) return ['bad', `The run was cut off: ${end.text ?? 'the reason is not known'}`];
  if (!connected) return ['bad', 'Disconnected; connecting again\u2026'];
  if (silent_ms === undefined) return ['bad', 'Connected; no frame yet.'];
  if (silent_ms > silentAfter_ms) return ['bad', `Connected; frames from ${fixed(silent_ms / 1000, 0)} s ago.`];
  return ['good', 'Connected.'];
}

/** The page `live`. */
export function livePage() {
  const container = el('div', {}, el('p', { class: 'soft' }, 'Waiting for the robot\u2026'));
  const title = el('h1', {}, 'twocone'), what = el('p', { class: 'soft' });
  const state = el('p', { class: 'state', role: 'status' }), rates = el('p', { class: 'soft rates' });
  const refused = el('p', { class: 'warning', role: 'alert', hidden: true });
  let view, store, images, line, end, last_ms, received = [], drawn = [];
  const control = new DriveControl((message) => connection.send(message));
  const controls = driveControls(control);
  const lines = {
    run: (run) => {
      if (JSON.stringify(run) === line) return;  // the connection was lost for a while
      line = JSON.stringify(run);
      document.title = `${run.name}, live`;
      setText(title, document.title);
      setText(what, runWords(run));
      store = new FrameStore({ rate_hz: run.robot?.rate_hz, most: mostFrames });
      images = new ImageStore(mostImageBytes);
      const next = el('div');
      container.replaceChildren(next);
      view = new RunView(next, { run }, { store, live: true, keyTarget: document, beside: controls.panel,
        imageOf: (frame, side) => images.blob(frame.frame, side),
        keys: [['W A S D, arrows', 'drive, in drive mode'], ['Escape, Space', 'stop, in drive mode']] });
      view.drawn = (cost_ms) => drawn.push([performance.now(), cost_ms]);
    },
    frame: (frame) => {
      if (frame.frame <= (store.digests.get(store.end - 1)?.frame ?? -1)) return;
      last_ms = performance.now();
      received.push([last_ms]);
      images.belongTo(frame);
      store.append(frame);
      view.player.grown();
    },
    event: (event) => view.addEvent(event),
    end: (message) => end = message,
    status: (status) => {
      control.status = status;
      controls.update();
    },
    refused: ({ text }) => {
      setText(refused, text);
      refused.hidden = false;
      setTimeout(() => refused.hidden = true, 5000);
    },
  };
  const connection = new Connection({
    changed: (connected) => {
      Object.assign(control, { connected, status: {} });
      control.beat();
      controls.update();
    },
    line: (message) => lines[message.type]?.(message),
    image: (image) => images?.put(image),
  });
  const tell = () => {
    const now_ms = performance.now(), recent = (times) => times.filter(([time_ms]) => time_ms > now_ms - rateOver_ms);
    [received, drawn] = [recent(received), recent(drawn)];
    const { connected, status: { watchers } } = control;
    const [kind, words] = streamState({ connected, end, silent_ms: last_ms && now_ms - last_ms });
    setText(state, words);
    state.dataset.state = kind;
    const cost_ms = drawn.map(([, ms]) => ms).sort((a, b) => a - b)[drawn.length >> 1];
    const rate = (times) => fixed(1000 * times.length / rateOver_ms, 0);
    setText(rates, `${rate(received)} frames a second received, ${rate(drawn)} drawn in ${fixed(cost_ms, 1)} ms each`
      + (watchers ? `; ${plural(watchers, 'watcher')}` : ''));
  };
  setInterval(tell, 500);
  tell();
  document.getElementById('main').replaceChildren(el('header', {}, title, schemeToggle()),
    el('div', { class: 'live-bar' }, el('div', {}, state, rates), controls.stop), refused, container, what);
}
