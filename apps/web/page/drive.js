// SPDX-License-Identifier: Apache-2.0
// Driving by hand: which speeds keys, pad and gamepad ask for, and when they are sent.
import { button, el, fixed, setText, slider } from './kit.js';

const driveKeys = { w: [1, 0], arrowup: [1, 0], s: [-1, 0], arrowdown: [-1, 0],
  a: [0, 1], arrowleft: [0, 1], d: [0, -1], arrowright: [0, -1] };
const stickDeadZone = 0.15;  // a released stick of a worn gamepad stays below this share of its way
export const driveBeat_ms = 100;

/** A pointer's place in a pad of radius 1, right and down positive, as shares of the greatest speed and turn rate. */
export function padCommand(right, down) {
  const most = 1 / Math.max(Math.hypot(right, down), 1);
  return { speed: 0 - down * most, turn: 0 - right * most };
}

/** The same of the axes of a stick, of which a zone in the middle counts as zero. */
export function stickCommand(right, down) {
  const length = Math.hypot(right, down);
  if (!(length > stickDeadZone)) return { speed: 0, turn: 0 };
  const part = Math.min((length - stickDeadZone) / (1 - stickDeadZone), 1) / length;
  return padCommand(right * part, down * part);
}

/** What one browser asks of the wheels. beat() must be called every 100 ms; `send` gets the objects of the stream. */
export class DriveControl {
  constructor(send) {
    Object.assign(this, { send, status: {}, connected: false, mode: false, share: 0.5, pad: null, stick: null });
    this.keys = new Set();
    this.driving = false;  // whether the last beat sent a command that no release has followed
  }

  /** Who drives: 'you', 'another' or 'nobody'. */
  get driver() {
    if (this.status.driver === undefined || this.status.driver === null) return 'nobody';
    return this.status.driver === this.status.you ? 'you' : 'another';
  }

  get allowed() {
    return this.connected && this.status.manual === true && !this.status.stopped && this.driver !== 'another';
  }

  /** Whether the hand is on the wheel: drive mode is on, or the pad or a key is held. */
  get engaged() { return this.mode || this.pad !== null || this.keys.size > 0; }

  get command() {
    let { speed, turn } = this.pad || (this.mode && this.stick) || { speed: 0, turn: 0 };
    for (const key of this.keys) {
      speed += driveKeys[key][0];
      turn += driveKeys[key][1];
    }
    const clip = (value) => Math.min(Math.max(value, -1), 1) * this.share;
    return { speed: clip(speed), turn: clip(turn) };
  }

  /** Returns whether the key drives. @param repeated by the keyboard: the key may have been held since before a stop */
  press(key, repeated = false) {
    const name = key.toLowerCase(), drives = Object.hasOwn(driveKeys, name);
    if (drives && this.allowed && !repeated) this.keys.add(name);
    return drives;
  }

  lift(key) { this.keys.delete(key.toLowerCase()); }

  beat() {
    if (!this.allowed) this.letGo();
    else if (!this.engaged) this.release();
    else this.send({ type: 'drive', ...this.command });
    this.driving = this.allowed && this.engaged;
  }

  release() {
    if (this.driving && this.connected) this.send({ type: 'release' });
    this.driving = false;
  }

  /** Takes the hand off at once: nothing that was held before counts until it is pressed again. */
  letGo() {
    this.keys.clear();
    this.pad = this.stick = null;
    this.mode = false;
    this.release();
  }

  stop() {
    this.letGo();
    this.status = { ...this.status, stopped: true };
    if (this.connected) this.send({ type: 'stop' });
  }

  go() { if (this.connected) this.send({ type: 'go' }); }
}

/** The panel of a page that drives by hand, and the buttons stop and go of every page: { panel, stop, update }. */
export function driveControls(control) {
  const text = el('p', { class: 'drive-state', role: 'status' }), command = el('p', { class: 'soft' });
  const knob = el('span', { class: 'knob' });
  const lift = () => {
    control.pad = null;
    beat();
  };
  const pad = el('div', { class: 'pad', tabindex: 0, role: 'application', onpointerup: lift, onpointercancel: lift,
    onlostpointercapture: lift, 'aria-label': 'Drive: W, A, S, D or the arrow keys; Escape or space stops' }, knob);
  const mode = button('Drive', () => {
    control.mode = !control.mode && control.allowed;
    if (control.mode) pad.focus();
    beat();
  }, { title: 'While this is on, keys and gamepad drive' });
  const share = slider({ label: 'Most speed', min: 10, max: 100, step: 10, value: 100 * control.share,
    show: (value) => `${value} %`, oninput: (value) => control.share = value / 100 });
  const hint = el('span', { class: 'soft words' }, ' W A S D, arrows, or left stick; Escape or space stops');
  const panel = el('div', { class: 'card drive screen-only', role: 'group', 'aria-label': 'Driving by hand' }, pad,
    el('div', {}, text, el('p', {}, mode, hint), share, command));
  const go = button('Go', () => control.go(), { title: 'Ends the stop' });
  const stop = el('div', { class: 'stop-buttons' }, go, button('STOP', () => {
    control.stop();
    update();
  }, { class: 'stop', title: 'Holds the wheels, whoever drives' }));
  const update = () => {
    const { allowed, engaged, status, driver, connected } = control;
    const who = { you: 'You drive.', another: 'Another browser drives.', nobody: 'Nobody drives.' }[driver];
    const state = status.stopped ? 'The wheels are held.' : who;
    setText(text, connected ? state : 'Not connected: the wheels stop by themselves.');
    go.hidden = !status.stopped;
    panel.hidden = !status.manual;
    mode.disabled = !allowed;
    mode.setAttribute('aria-pressed', control.mode);
    pad.setAttribute('aria-disabled', !allowed);
    const { speed, turn } = engaged && allowed ? control.command : { speed: 0, turn: 0 };
    knob.style.translate = `${-turn * 100}% ${-speed * 100}%`;
    setText(command, `speed ${fixed(100 * speed, 0)} %, turn ${fixed(100 * turn, 0)} %`);
  };
  const beat = () => {
    const [gamepad] = [...navigator.getGamepads?.() ?? []].filter(Boolean);
    control.stick = gamepad ? stickCommand(gamepad.axes[0], gamepad.axes[1]) : null;
    control.beat();
    update();
  };
  const hold = ({ clientX, clientY }) => {
    const { left, top, width } = pad.getBoundingClientRect();
    if (control.allowed) control.pad = padCommand((clientX - left) / width * 2 - 1, (clientY - top) / width * 2 - 1);
  };
  pad.addEventListener('pointerdown', (event) => {
    pad.setPointerCapture(event.pointerId);
    hold(event);
    beat();
  });
  pad.addEventListener('pointermove', (event) => control.pad && hold(event));
  document.addEventListener('keydown', (event) => {
    const { key, target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || panel.hidden) return;
    if (!(control.mode || panel.contains(target)) || (target.matches('input') && key.startsWith('Arrow'))) return;
    const stops = key === 'Escape' || (key === ' ' && (control.mode || target === pad));
    if (stops) control.stop();
    else if (!control.press(key, event.repeat)) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) beat();
  }, { capture: true });
  document.addEventListener('keyup', ({ key }) => {
    control.lift(key);
    beat();
  }, { capture: true });
  panel.addEventListener('focusout', ({ relatedTarget }) => !panel.contains(relatedTarget) && control.keys.clear());
  window.addEventListener('blur', () => control.letGo());
  window.addEventListener('pagehide', () => control.letGo());
  document.addEventListener('visibilitychange', () => document.hidden && control.letGo());
  setInterval(beat, driveBeat_ms);
  update();
  return { panel, stop, update };
}
