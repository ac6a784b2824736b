// SPDX-License-Identifier: Apache-2.0
// The view of one run, stored or live: everything about the frame that is shown, and the bar that plays it.
import { button, el, facts, list, quantity, setText } from './kit.js';
import { FrameStore, Player, playerSpeeds } from './player.js';
import { MirrorPanel, mirrorViews } from './mirrors.js';
import { Magnifier } from './magnifier.js';
import { CloudView } from './cloud.js';
import { Gauges, PoseTable, RangeTable, RoomView, TimeView, nameOfVerdicts } from './runparts.js';

const figuresEvery_ms = 1000;  // figures over time follow growing data this often
const mostEvents = 200;

const runKeys = [['Space', 'play or pause'], ['\u2190 \u2192', 'one frame back or on; with Shift ten'],
  ['Home, End', 'first or last frame'], ['[ and ]', 'previous or next of the chosen frames'],
  ['\u2212 and +', 'slower or faster'], ['L', 'next landmark, enlarged'], ['O', 'show or hide outlines and names'],
  ['?', 'this list']];

/** The keys of the view, and further ones, as a dialog. @param more [keys, meaning] */
function helpDialog(more = []) {
  const dialog = el('dialog', { class: 'help' }, el('h2', {}, 'Keys'), facts([...runKeys, ...more]),
    el('p', { class: 'soft' }, 'A landmark under the pointer is enlarged. Charts and the room have keys of their own '
      + 'while they have the focus: plus and minus zoom, arrows move, Escape shows everything.'),
    button('Close', () => dialog.close()));
  return dialog;
}

/** What was run, in one line. */
export function runWords({ robot, behaviour, method, seed, version }) {
  return [robot && `Robot ${robot.name}`, behaviour && `behaviour ${behaviour}`, method && `method ${method}`,
    seed !== undefined && `seed ${seed}`, version && `twocone ${version}`].filter(Boolean).join(', ');
}

/** Returns what drawImage() takes, of an address or of an image's bytes; undefined where it cannot be decoded. */
function decodedImage(source) {
  if (source instanceof Blob) return createImageBitmap(source).catch(() => undefined);
  const image = source && el('img', { src: source });
  return image?.decode().then(() => image, () => undefined);
}

/** The bar that plays a run: its buttons, its slider, and the choice of frames by verdict. */
class PlayerBar {
  constructor({ player, store, time, help }) {
    Object.assign(this, { player, store, time });
    const named = (label, name, action) => button(label, action, { 'aria-label': name });
    const select = (name, onchange, options = []) => el('select', { 'aria-label': name, onchange },
      options.map(([value, text]) => el('option', { value }, text)));
    this.play = button('Play', () => player.toggle(), { class: 'play' });
    this.live = player.live ? button('Live', () => player.goLive(), { title: 'Shows the newest frame' }) : undefined;
    this.speed = select('Speed', () => player.faster(this.speed.selectedIndex - playerSpeeds.indexOf(player.speed)),
      playerSpeeds.map((speed) => [speed, `\u00d7\u00a0${speed}`]));
    const seek = () => player.seek(Number(this.seek.value));
    this.seek = el('input', { type: 'range', 'aria-label': 'Frame', oninput: seek });
    this.shown = el('output', { class: 'time' });
    this.who = select('Frames chosen by the verdict of', () => this.choose(this.who.value));
    this.verdict = select('Verdict', () => this.choose(this.who.value, this.verdict.value));
    this.next = [named('\u2039', 'Previous chosen frame', () => player.next(-1)),
      named('\u203a', 'Next chosen frame', () => player.next(1))];
    this.node = el('div', { class: 'player screen-only', role: 'group', 'aria-label': 'Player' },
      el('div', { class: 'player-row' }, this.seek, this.shown), el('div', { class: 'player-row' },
        named('\u2039', 'One frame back', () => player.step(-1)), this.play,
        named('\u203a', 'One frame on', () => player.step(1)), this.live, this.speed, el('span', { class: 'gap' }),
        el('span', { class: 'soft words' }, 'frames where'), this.who, this.verdict, this.next,
        named('?', 'Keys', () => help.showModal())));
  }

  /** Of a landmark that was just named, the rarest verdict is chosen: it is what one looks for. */
  choose(who, verdict) {
    const rarest = [...this.store.counts.get(who) ?? []].sort(([, a], [, b]) => a - b)[0]?.[0];
    this.player.choose(who ? { who, verdict: verdict ?? rarest } : null);
  }

  update() {
    const { player, store: { begin, end, digests } } = this;
    setText(this.play, player.playing ? 'Pause' : 'Play');
    this.live?.setAttribute('aria-pressed', player.following);
    this.speed.value = player.speed;
    Object.assign(this.seek, { min: begin, max: Math.max(end - 1, begin), value: player.position });
    const number = player.frame?.frame ?? player.position, time = quantity(player.time_s, 's', 2);
    setText(this.shown, end > begin ? `${number} / ${digests.get(end - 1)?.frame ?? end - 1}  ${time}` : 'no frames');
    this.seek.setAttribute('aria-valuetext', `frame ${number}, ${time}`);
  }

  updateChoice() {
    const { counts } = this.store, { chosen } = this.player;
    const fill = (select, options, value) => {
      const key = JSON.stringify(options);
      if (select.held !== key && document.activeElement !== select) {  // a list that is open stays as it is
        select.replaceChildren(...options.map(([name, text]) => el('option', { value: name }, text)));
        select.held = key;
      }
      select.value = value;
    };
    const whose = this.time.rows.map((who) => [who, nameOfVerdicts(who)]);
    fill(this.who, [['', 'any verdict'], ...whose], chosen?.who ?? '');
    const of = new Map(chosen ? [[chosen.verdict, 0], ...counts.get(chosen.who) ?? []] : []);
    fill(this.verdict, chosen ? [...of].map(([name, count]) => [name, `${name} (${count})`]) : [['', 'is anything']],
      chosen?.verdict ?? '');
    for (const node of [this.verdict, ...this.next]) node.disabled = !chosen;
  }
}

/**
 * Fills a container with the view of a run.
 * @param telemetry { run, frames, images, every, events }: the run's line, its frames, the addresses of its images by
 *   frame number ({ lower, upper }), and 2 if only every second frame is there
 * @param options store: a FrameStore in place of telemetry.frames; imageOf(frame, view): an address or a Blob; live;
 *   cloudOf(frame): a promise of the bytes of a point cloud, for the frames that run.clouds lists;
 *   follow: the view has no player of its own; beside: a node beside the room; keyTarget: what listens to keys, default
 *   the container; keys: further [keys, meaning] of the help
 */
export class RunView {
  constructor(container, { run, every = 1, frames = [], images = {}, events = [] }, options = {}) {
    Object.assign(this, { run, container, store: options.store, images: {}, eventLines: [], figures_ms: -Infinity });
    this.store ??= new FrameStore({ rate_hz: (run.robot?.rate_hz ?? 15) / every });
    if (!options.store) frames.forEach((frame) => this.store.append(frame));
    this.imageOf = options.imageOf ?? ((frame, view) => images[frame.frame]?.[view]);
    this.player = new Player(this.store, options);
    this.selected = run.map?.landmarks?.[0]?.name;
    const select = (name) => this.select(name);
    this.mirrors = run.sensors?.images === false ? undefined : new MirrorPanel(run, select, () => this.request());
    this.magnifier = this.mirrors && this.selected !== undefined ? new Magnifier(run, select) : undefined;
    this.room = new RoomView(run);
    this.cloud = run.clouds && options.cloudOf ? new CloudView(run.clouds, options.cloudOf) : undefined;
    this.time = new TimeView(run, this.store, (t_s) => this.player.seekTime(t_s));
    this.ranges = new RangeTable(run, select);
    this.poses = new PoseTable(run);
    this.gauges = new Gauges(run);
    this.help = helpDialog(options.keys);
    this.bar = options.follow ? undefined : new PlayerBar(this);
    this.note = el('p', { class: 'soft run-note', role: 'status' },
      every > 1 ? `Every ${every}th frame is on this page; "twocone view" shows all of them.` : '');
    this.events = el('div', { class: 'run-events' });
    container.classList.add('run-view');
    const tables = [this.ranges.node, this.poses.node];
    container.replaceChildren(...[
      el('div', { class: this.mirrors && 'run-top' }, this.mirrors?.node, this.room.node, options.beside),
      this.gauges.node, this.cloud?.node, this.time.node,
      el('div', { class: 'run-low' }, this.magnifier ? [this.magnifier.node, el('div', {}, tables)] : tables),
      this.events, this.note, this.bar?.node, this.help].filter(Boolean));
    events.forEach((event) => this.addEvent(event));
    this.player.listeners.push(() => this.request());
    (options.keyTarget ?? container).addEventListener('keydown', (event) => this.key(event));
    this.player.grown();
  }

  select(name) {
    if (!name || name === this.selected) return;
    this.selected = name;
    this.request();
  }

  addEvent({ text, frame }) {
    this.eventLines = [frame === undefined ? text : `frame ${frame}: ${text}`, ...this.eventLines].slice(0, mostEvents);
    this.events.replaceChildren(el('h3', {}, 'Events'), list(this.eventLines));
  }

  /** Shows the newest state at the next repaint of the page; states in between are skipped. */
  request() {
    this.dirty = true;
    this.schedule();
  }

  schedule() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame((now_ms) => {
      this.scheduled = false;
      const moves = this.player.playing && !this.player.following;
      if (moves) this.player.tick(this.before_ms ? Math.min((now_ms - this.before_ms) / 1000, 0.5) : 0);
      this.before_ms = moves ? now_ms : 0;
      if (this.dirty && !this.busy) this.show();
      if (moves) this.schedule();
    });
  }

  /** Decodes the images of the current frame and then draws everything about it at once. */
  async show() {
    Object.assign(this, { busy: true, dirty: false });
    try {
      const { position, frame } = this.player;
      if (frame && frame !== this.frame && this.mirrors) {
        const images = await Promise.all(mirrorViews.map((view) => decodedImage(this.imageOf(frame, view))));
        Object.values(this.images).forEach((image) => image?.close?.());
        this.images = Object.fromEntries(mirrorViews.map((view, i) => [view, images[i]]));
      }
      this.frame = frame;
      const begin_ms = performance.now();
      this.draw(frame, position);
      this.drawn?.(performance.now() - begin_ms);
    } finally {
      this.busy = false;
      if (this.dirty) this.schedule();
    }
  }

  draw(frame, position) {
    const { store, player, selected } = this;
    this.drawFigures(store.version !== this.version, player.chosen !== this.time.chosen);
    this.bar?.update();
    this.container.classList.toggle('waiting', !frame && store.end > store.begin);
    if (!frame) return;
    this.mirrors?.draw(frame, this.images, selected);
    this.magnifier?.draw(frame, (view) => this.mirrors.canvasOf(view), selected);
    this.room.draw(store, position, selected);
    this.cloud?.show(frame.frame);
    this.time.moveCursor(frame.t_s);
    this.ranges.update(frame.ranges ?? [], this.room.found, selected);
    this.poses.update(frame);
    this.gauges.update(store, position);
  }

  drawFigures(grown, chosen) {
    const wait_ms = this.figures_ms + figuresEvery_ms - performance.now();
    if (chosen || (grown && wait_ms <= 0)) {
      Object.assign(this, { version: this.store.version, figures_ms: performance.now() });
      this.time.update(this.player.chosen);
      this.bar?.updateChoice();
    } else if (grown && !this.player.following) {
      setTimeout(() => this.request(), wait_ms);
    }
  }

  nextLandmark() {
    const names = (this.run.map?.landmarks ?? []).map(({ name }) => name);
    this.select(names[(names.indexOf(this.selected) + 1) % names.length]);
  }

  key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
    if (!this.bar || this.help.open || !this.container.isConnected) return;
    if (event.target.closest('input, select, textarea')) return;
    if (event.target.closest('button, a, summary') && [' ', 'Enter'].includes(event.key)) return;
    const { player, store } = this, far = event.shiftKey ? 10 : 1;
    const actions = { ' ': () => player.toggle(), ArrowLeft: () => player.step(-far),
      ArrowRight: () => player.step(far), Home: () => player.seek(store.begin), End: () => player.seek(store.end - 1),
      '[': () => player.next(-1), ']': () => player.next(1), '-': () => player.faster(-1), '+': () => player.faster(1),
      '=': () => player.faster(1), l: () => this.nextLandmark(), o: () => this.mirrors?.toggleOverlays(),
      '?': () => this.help.showModal() };
    const action = actions[event.key] ?? actions[event.key.toLowerCase()];
    if (!action) return;
    event.preventDefault();
    action();
  }
}
