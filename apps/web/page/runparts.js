// SPDX-License-Identifier: Apache-2.0
// Parts of the view of a run: room, figures over time, strip of verdicts, tables and gauges, drawn anew for each frame.
import { degrees, el, exists, figure, fixed, millimetres, noValue, quantity, swatch } from './kit.js';
import { keyedChildren, setText, verdictChip, verdictOf, watchWidth } from './kit.js';
import { Plot } from './plot.js';
import { Plan } from './plan.js';
import { distanceBetween, positionSigma } from './player.js';
import { ellipseFactor, plusMinus, sigmasOf95 } from './magnifier.js';

const stripRow_px = 16;
const trackStates = new Map([['tracking', 'v-ok'], ['lost', 'v-contradictory']]);
const partialVerdicts = ['one_view', 'gap', 'weak', 'occluded', 'ambiguous', 'beyond_limit', 'out_of_bounds'];

/** The name of a row of verdicts: 'fix', 'track', or that of the landmark of 'range:NAME'. */
export function nameOfVerdicts(who) {
  return who.replace(/^range:/, '');
}

/** How much an answer says, as a share of a bar's height, so that the strip is read without its colours. */
function answerShare(verdict) {
  return verdict === 'ok' || verdict === 'tracking' ? 1 : partialVerdicts.includes(verdict) ? 0.65 : 0.3;
}

/** About `most` positions from `begin` to `end`, the last included, and the same ones as time passes. */
export function thinned(begin, end, most) {
  const stride = 2 ** Math.max(Math.ceil(Math.log2((end - begin + 1) / most)), 0);
  const kept = [];
  for (let at = Math.ceil(begin / stride) * stride; at < end; at += stride) kept.push(at);
  return [...kept, end];
}

/** The layers of a plan for a scan: what is free around the robot, and where things begin. */
export function scanLayers(scan, pose) {
  if (!scan || !exists(pose?.x_m) || !exists(pose.heading_rad)) return { areas: [], points: [] };
  const { ranges_m: ranges, states } = scan, step = 2 * Math.PI / ranges.length;
  const ends = ranges.map((range, k) => {
    const bearing_rad = pose.heading_rad - Math.PI + step * (k + 0.5);
    return [pose.x_m + (range ?? 0) * Math.cos(bearing_rad), pose.y_m + (range ?? 0) * Math.sin(bearing_rad)];
  });
  return { areas: [{ name: 'scan: free', colour: 'c6', points: ends }],
    points: [{ name: 'scan: things', colour: 'c8', r: 1.8, points: ends.filter((_, k) => states[k] === 'o') }] };
}

/** The room from above at one frame, with the trail up to it. */
export class RoomView {
  constructor(run) {
    Object.assign(this, { run, found: [] });  // found: the landmarks of a run that finds them on the way
    this.plan = new Plan({ map: run.map, tallest: 430 });
    this.note = el('span');
    this.node = figure({ title: 'Room from above', wide: false }, this.plan.node);
    this.node.querySelector('figcaption').append(' ', this.note);
  }

  draw(store, position, selected) {
    const { track, truth, odometry, fixes = [], ranges = [] } = store.at(position);
    const { body_radius_m: radius_m } = this.run.robot ?? {};
    const placed = fixes.filter(({ x_m }) => exists(x_m));
    const poses = Object.entries({ track, fix: placed[0], odometry });
    const [name, pose] = poses.find(([, row]) => exists(row?.x_m)) ?? [];
    const factor = ellipseFactor(sigmasOf95 * positionSigma(placed[0]), 9 / (this.plan.pixels_perM || 80));
    const trail = thinned(store.begin, position, 500).map((at) => store.digests.get(at));
    const path = (key, dash) => trail.some((entry) => entry?.[key])
      ? [{ name: key, colour: key, points: trail.map((entry) => entry?.[key]), dash }] : [];
    const ray = ({ landmark, verdict, bearing_rad, range_m, sigma_range_m: sigma_m }) => ({
      name: 'ranges and bearings', colour: verdictOf(verdict).colour, from: [pose.x_m, pose.y_m], range_m, sigma_m,
      bearing_rad: bearing_rad + (pose.heading_rad ?? 0),
      dash: landmark === selected ? undefined : verdict === 'ok' ? '8 4' : '3 4' });
    const fix = { name: 'fix, 95 % ellipse', colour: 'fix' }, found = { name: 'found landmarks, 95 %', colour: 'c3' };
    const scanned = scanLayers(store.at(position).scan, pose);
    this.find(store, position);
    this.plan.update({
      areas: scanned.areas,
      paths: [...path('truth'), ...path('odometry', '2 4'), ...path('track', '7 3')],
      rays: pose ? ranges.filter(({ bearing_rad }) => exists(bearing_rad)).map(ray) : [],
      points: [...scanned.points, ...placed.map(({ x_m, y_m }) => (
        { ...fix, points: [[x_m, y_m]], shape: 'plus', r: 6 }))],
      ellipses: [...placed.map((row) => ({ ...row, ...fix, sigmas: sigmasOf95 * factor })),
        ...this.found.map((row) => ({ ...row, ...found, sigmas: sigmasOf95 }))],
      poses: [...(truth ? [{ ...truth, name: 'truth', colour: 'truth', radius_m, dash: '4 3' }] : []),
        ...(pose ? [{ ...pose, name, colour: name, radius_m }] : [])],
      landmarks: this.found,
    });
    const times = factor > 1 ? `The ellipse is drawn ${factor.toLocaleString('en')} times as large.` : '';
    setText(this.note, pose ? times : 'No pose is known in this frame.');
  }

  /** Looks back for the last frame that lists the landmarks found so far: every 15th does. */
  find(store, position) {
    let at = position;
    while (at > Math.max(position - 15, store.begin) && !store.at(at)?.landmarks) --at;
    const rows = store.at(at)?.landmarks ?? (at === store.begin ? [] : undefined);
    if (rows) this.found = rows.map((row) => ({ ...row, name: row.landmark }));
  }
}

/** Errors and sigmas over time on one axis, and below it one row of verdicts for each landmark and for the fix. */
export class TimeView {
  constructor(run, store, seek) {
    Object.assign(this, { run, store, seek, held: [] });
    this.plot = new Plot({ label: 'Errors and sigmas of the position over time', height: 170,
      onPick: (t_s) => seek(t_s), onSpan: () => this.drawStrip(), x: { label: 'time', unit: 's' },
      y: { label: 'position: error and sigma', unit: 'mm', scale: 'log', show: (value) => this.tickText(value) } });
    this.canvas = el('canvas', { role: 'img', 'aria-label': 'Verdicts over time' });
    this.labels = el('div', { class: 'strip-labels', 'aria-hidden': 'true' });
    this.cursor = el('div', { class: 'strip-cursor', hidden: true });
    this.readout = el('div', { class: 'readout', hidden: true });
    this.strip = el('div', { class: 'strip' }, this.canvas, this.labels, this.cursor, this.readout);
    this.legend = el('div', { class: 'strip-legend' });
    this.node = figure({ title: 'Position and verdicts over time', caption: 'A click shows the frame. A full bar is a '
      + 'whole answer, a lower one a part, a line at the bottom none.' }, this.plot.node, this.strip, this.legend);
    this.listen();
    document.addEventListener('schemechange', () => this.drawStrip());
    watchWidth(this.plot.node, () => this.drawStrip());
  }

  get rows() {
    const whole = ['fix', 'track', ...(this.run.map?.landmarks ?? []).map(({ name }) => `range:${name}`)];
    return whole.filter((who) => this.store.counts.has(who) && (who !== 'fix' || this.run.sensors?.fixes !== false));
  }

  /** The texts at the axis are made as wide as the names of the strip's rows, so that both axes begin at one place. */
  tickText(value) {
    const longest = Math.max(8, ...this.rows.map((who) => nameOfVerdicts(who).length));
    return `${Number(value.toPrecision(3))}`.padStart(Math.min(longest, 14), '\u2007');
  }

  /** Draws the data of the store as they are now. */
  update(chosen) {
    const { digests, begin, end, counts } = this.store;
    const held = [];
    for (let at = begin; at < end; ++at) if (digests.has(at)) held.push(digests.get(at));
    Object.assign(this, { chosen, held });
    const x = held.map(({ t_s }) => t_s);
    const line = (name, key, colour, dash) => held.some((entry) => exists(entry[key]))
      ? [{ name, colour, dash, thin: true, x, y: held.map((entry) => 1000 * (entry[key] ?? NaN)),
        show: (i) => millimetres(held[i][key], 3) }] : [];
    this.plot.update([
      ...line('error of the fix', 'fixError', 'fix'), ...line('sigma of the fix', 'fixSigma', 'fix', '2 3'),
      ...line('error of the track', 'trackError', 'track', '9 3'),
      ...line('sigma of the track', 'trackSigma', 'track', '9 3 2 3')]);
    this.drawStrip();
    const verdicts = [...new Set(this.rows.flatMap((who) => [...counts.get(who).keys()]))];
    keyedChildren(this.legend, verdicts.filter((verdict) => !trackStates.has(verdict)),
      (verdict) => verdictChip(verdict, this.run.method));
  }

  drawStrip() {
    const { plot, rows, held, strip, canvas } = this, { width } = plot;
    if (!plot.sx || held.length === 0) return;
    const ratio = window.devicePixelRatio || 1, height = rows.length * stripRow_px;
    Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
    const context = canvas.getContext('2d');
    context.scale(ratio, ratio);
    const [left, right] = plot.sx.range(), style = getComputedStyle(strip), colours = {};
    const colour = (verdict) => colours[verdict] ??=
      style.getPropertyValue(`--${trackStates.get(verdict) ?? verdictOf(verdict).colour}`);
    const ends = [...held.map(({ t_s }) => t_s), 2 * held.at(-1).t_s - (held.at(-2)?.t_s ?? -1)]
      .map((t_s) => Math.min(Math.max(plot.sx(t_s), left), right));
    rows.forEach((who, row) => {
      for (let first = 0, i = 1; i <= held.length; ++i) {
        const verdict = held[first].verdicts[who];
        if (i < held.length && held[i].verdicts[who] === verdict) continue;
        const tall = answerShare(verdict) * (stripRow_px - 4), from = ends[first];
        if (verdict && ends[i] > left) {
          context.globalAlpha = this.chosen?.who === who && this.chosen.verdict !== verdict ? 0.2 : 1;
          context.fillStyle = colour(verdict);
          context.fillRect(from, (row + 1) * stripRow_px - 2 - tall, Math.max(ends[i] - from, 1), tall);
        }
        first = i;
      }
    });
    strip.style.setProperty('--left', `${left - 8}px`);
    keyedChildren(this.labels, rows, (who) => el('span', {}, nameOfVerdicts(who)));
    this.moveCursor(this.t_s);
  }

  moveCursor(t_s) {
    this.t_s = t_s;
    this.plot.setCursor(t_s);
    if (!this.plot.sx || !exists(t_s)) return;
    const [left, right] = this.plot.sx.range(), x = this.plot.sx(t_s);
    this.cursor.hidden = x < left - 1 || x > right + 1;
    this.cursor.style.translate = `${x.toFixed(1)}px 0`;
  }

  listen() {
    const { canvas, readout, store } = this;
    const timeAt = (event) => this.plot.sx?.invert(event.offsetX);
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.seek(timeAt(event));
    });
    canvas.addEventListener('pointermove', (event) => {
      if (event.buttons) this.seek(timeAt(event));
      const who = this.rows[Math.floor(event.offsetY / stripRow_px)];
      const entry = store.digests.get(store.positionAt(timeAt(event)));
      readout.hidden = !entry || !who;
      if (readout.hidden) return;
      setText(readout, `${quantity(entry.t_s, 's', 2)}: ${nameOfVerdicts(who)} ${entry.verdicts[who] ?? noValue}`);
      readout.style.left = `min(${event.offsetX}px, 100% - 14rem)`;
    });
    canvas.addEventListener('pointerleave', () => readout.hidden = true);
  }
}

/** A table whose rows are kept from frame to frame. @param heads of the columns; the first is that of the rows */
class FrameTable {
  constructor(caption, heads) {
    this.body = el('tbody');
    this.columns = heads.length;
    const head = el('tr', {}, heads.map((text) => el('th', { scope: 'col' }, text)));
    this.node = el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption },
      el('table', {}, el('caption', {}, caption), el('thead', {}, head), this.body));
  }

  /** @param rows [key, ...cells], as the heads; a cell is a text, or [text, function that makes a node of it] */
  fill(rows) {
    const cellOf = (_, j) => el(j ? 'td' : 'th', { scope: j === 0 && 'row' });
    const make = () => el('tr', {}, Array.from({ length: this.columns }, cellOf));
    const nodes = keyedChildren(this.body, rows.map(([key]) => key), make);
    rows.forEach(([, ...cells], i) => cells.forEach((cell, j) => {
      const [text, show] = [cell].flat(), node = nodes[i].children[j];
      if (node.shown === text) return;
      node.replaceChildren(show ? show(text) : text);
      node.shown = text;
    }));
    return nodes;
  }
}

/** The ranges of a frame; of a run that finds its landmarks on the way, those landmarks. */
export class RangeTable extends FrameTable {
  constructor(run, select) {
    const landmarks = run.map?.landmarks ?? [], truth = run.sensors?.truth ? ['error'] : [];
    super(...landmarks.length ? ['Ranges of this frame', ['landmark', 'verdict', 'range', ...truth, 'bearing']]
      : ['Landmarks found so far', ['landmark', 'x / m', 'y / m', 'sigma', 'top / m', 'radius', 'frames']]);
    Object.assign(this, { run, select, colours: new Map(landmarks.map(({ name, rgb }) => [name, rgb])) });
  }

  update(ranges, found, selected) {
    const { colours, run } = this;
    if (colours.size === 0) {
      this.fill(found.map((row) => [row.name, row.name, fixed(row.x_m, 3), fixed(row.y_m, 3),
        millimetres(positionSigma(row)), fixed(row.top_m, 3), millimetres(row.radius_m, 0), fixed(row.sightings, 0)]));
      return;
    }
    const rows = ranges.map(({ landmark, verdict, range_m, sigma_range_m, true_range_m, bearing_rad }) => [landmark,
      [landmark, (name) => el('span', {}, swatch(colours.get(name)), name)],
      [verdict, (name) => verdictChip(name, run.method)], plusMinus(range_m, sigma_range_m),
      ...(run.sensors?.truth ? [millimetres((range_m ?? NaN) - (true_range_m ?? NaN), 2)] : []),
      degrees(bearing_rad, 2)]);
    this.fill(rows).forEach((node, i) => {
      node.classList.toggle('selected', rows[i][0] === selected);
      node.onpointerenter = () => this.select(rows[i][0]);
    });
  }
}

/** Fix, track, odometry and truth of a frame as numbers. */
export class PoseTable extends FrameTable {
  constructor(run) {
    const truth = run.sensors?.truth ? ['error'] : [];
    super('Poses of this frame', ['pose', 'x / m', 'y / m', 'heading', 'sigma', ...truth, 'state']);
    this.run = run;
  }

  update({ fixes = [], track, odometry, truth }) {
    const { sensors = {}, method } = this.run;
    const error = (pose) => sensors.truth ? [millimetres(distanceBetween(pose, truth), 2)] : [];
    const row = (name, pose, state) => [name, name, fixed(pose.x_m, 4), fixed(pose.y_m, 4),
      degrees(pose.heading_rad, 2), millimetres(positionSigma(pose), 2), ...error(pose), state];
    const chip = (verdict) => verdict ? [verdict, (name) => verdictChip(name, method)] : noValue;
    const states = [track?.state, track?.use].filter(Boolean).join(', ');
    this.fill([
      ...(sensors.fixes === false ? [] : fixes).map((fix, i) => row(i ? 'other fix' : 'fix', fix, chip(fix.verdict))),
      ...(track ? [row('track', track, states || noValue)] : []), ...(odometry ? [row('odometry', odometry, '')] : []),
      ...(truth ? [row('truth', truth, '')] : [])]);
  }
}

/** The frames a second over the last `frames` frames before a position; NaN where they are not known. */
export function frameRate({ digests, begin }, position, frames = 15) {
  const last = digests.get(position), first = digests.get(Math.max(position - frames, begin));
  return last && first ? (last.frame - first.frame) / (last.t_s - first.t_s) : NaN;
}

/** The images that were lost up to a position; "at least", where frames before it are not here. */
export function lostImages({ digests, begin }, position) {
  let sum = 0, frames = 0;
  for (let at = begin; at <= position; ++at) {
    sum += digests.get(at)?.lost ?? 0;
    frames += digests.has(at);
  }
  return digests.get(position)?.frame >= frames ? `at least ${sum}` : String(sum);
}

/** Numbers about the machine. A gauge is there if the robot has the sensor, and the frame a value. */
export class Gauges {
  constructor(run) {
    this.run = run;
    this.node = el('div', { class: 'tiles gauges' });
  }

  update(store, position) {
    const { sensors = {}, robot = {} } = this.run, { skew_s, age_s, timing, late_frames, drive } = store.at(position);
    const { left_command_radps: left, right_command_radps: right } = drive ?? {};
    const ms = (time_s, digits) => exists(time_s) && quantity(1000 * time_s, 'ms', digits);
    const rate = frameRate(store, position);
    const gauges = Object.entries({
      'frames a second': exists(rate) && `${fixed(rate, 1)} of ${fixed(robot.rate_hz, 0)}`,
      'skew of the two images': sensors.skew && ms(skew_s, 1), 'age of the answer': ms(age_s, 0),
      'time for the answer': ms(timing?.wall_s, 1), 'late frames': exists(late_frames) && String(late_frames),
      'lost images': sensors.images && lostImages(store, position),
      'speed, as commanded': exists(left) && quantity((left + right) / 2 * robot.wheel_radius_m, 'm/s', 2),
    }).filter(([, text]) => text);
    const tile = (name) => el('div', { class: 'tile' }, el('b'), el('span', {}, name));
    keyedChildren(this.node, gauges.map(([name]) => name), tile)
      .forEach((node, i) => setText(node.firstChild, gauges[i][1]));
  }
}
