// SPDX-License-Identifier: Apache-2.0
// Charts.
import { button, el, svg, svgPath, svgText, setAttributes, watchWidth } from './kit.js';
import { exists, keyedChildren, significant, noValue, paint } from './kit.js';

// ---- logic without DOM

/**
 * Returns the end of an axis on which errors can be read: the largest value, or 1.5 times the 98th percentile if a few
 * values exceed 3 times that percentile. What lies beyond is marked at the edge.
 */
export function readableLimit(values) {
  const sizes = values.filter(exists).map(Math.abs).sort((a, b) => a - b);
  if (sizes.length === 0) return 0;
  const most = sizes[Math.floor((sizes.length * 98 + 99) / 100) - 1];
  return most > 0 && sizes.at(-1) > 3 * most ? 1.5 * most : sizes.at(-1);
}

/**
 * Returns [low, high] of an axis: `min` and `max` where it has them, else around the values, from zero if `zero`.
 * @param values numbers; others are ignored
 */
export function axisDomain(values, { min, max, scale, zero, pad = 0.05 } = {}) {
  const log = scale === 'log';
  let [low, high] = d3.extent(values.filter((value) => exists(value) && !(log && value <= 0)));
  if (low === undefined) return log ? [min ?? 0.1, max ?? (min ?? 0.1) * 100] : [min ?? 0, max ?? (min ?? 0) + 1];
  if (log) {
    const factor = Math.max((high / low) ** pad, low === high ? 2 : 1);
    return [min ?? low / factor, max ?? high * factor];
  }
  if (zero) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  const room = low === high ? Math.abs(low) * 0.1 || 0.5 : pad * (high - low);
  return [min ?? (zero && low === 0 ? 0 : low - room), max ?? (zero && high === 0 ? 0 : high + room)];
}

/** Returns a histogram as a series of bars: x the middles, y the density. Values outside count in its denominator. */
export function histogram(values, { from, to, bins = 40 }) {
  const width = (to - from) / bins, counts = new Array(bins).fill(0);
  for (const value of values) if (value >= from && value < to) ++counts[Math.floor((value - from) / width)];
  return { width, x: counts.map((_, i) => from + (i + 0.5) * width),
    y: counts.map((count) => count / (width * Math.max(values.length, 1))) };
}

/** Returns the runs [first, last] of ascending numbers that differ by at most `step`. */
export function runsOf(numbers, step = 1) {
  const runs = [];
  for (const number of numbers) {
    if (runs.length > 0 && number - runs.at(-1)[1] <= step * (1 + 1e-9)) runs.at(-1)[1] = number;
    else runs.push([number, number]);
  }
  return runs;
}

/** Returns the index in ascending numbers that is nearest to x; -1 without any. */
export function nearestIndex(numbers, x) {
  const i = d3.bisectLeft(numbers, x);
  if (i === 0 || i === numbers.length) return Math.min(i, numbers.length - 1);
  return x - numbers[i - 1] <= numbers[i] - x ? i - 1 : i;
}

const tenth = (value) => Math.round(value * 10) / 10;

/**
 * Returns an SVG path through points in pixels, broken where a coordinate is missing. A point that would cover the
 * same pixel as the one before is left out.
 */
export function linePath(xs, ys, steps = false) {
  let path = '', pen = 'M', before_x = 0, before_y = 0;
  for (let i = 0; i < xs.length; ++i) {
    if (!exists(xs[i]) || !exists(ys[i])) {
      pen = 'M';
      continue;
    }
    const x = tenth(xs[i]), y = tenth(ys[i]);
    if (pen === 'L' && Math.abs(x - before_x) < 0.5 && Math.abs(y - before_y) < 0.5) continue;
    path += pen === 'L' && steps ? `H${x}V${y}` : `${pen}${x},${y}`;
    [pen, before_x, before_y] = ['L', x, y];
  }
  return path;
}

const markerOutlines = {
  circle: (r) => `m-${r},0a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 -${2 * r},0`,
  square: (r) => `m-${r},-${r}h${2 * r}v${2 * r}h-${2 * r}z`,
  diamond: (r) => `m0,-${1.3 * r}l${r},${1.3 * r} -${r},${1.3 * r} -${r},-${1.3 * r}z`,
  triangle: (r) => `m0,-${r}l${r},${1.8 * r}h-${2 * r}z`,
  cross: (r) => `m-${r},-${r}l${2 * r},${2 * r}m0,-${2 * r}l-${2 * r},${2 * r}`,
  plus: (r) => `m-${r},0h${2 * r}m-${r},-${r}v${2 * r}`,
  down: (r) => `m0,${r}l${r},-${1.8 * r}h-${2 * r}z`,
};
export const markerShapes = Object.keys(markerOutlines);
const isStroke = (shape) => shape === 'cross' || shape === 'plus';

/** Returns the path of a marker around a place. @param r its half width, in pixels */
export function markerPath(shape, x, y, r) {
  return `M${tenth(x)},${tenth(y)}${markerOutlines[shape](r)}`;
}

/** Returns the path of markers at places in pixels. Of markers that would cover each other, only the first is kept. */
export function markersPath(shape, xs, ys, r) {
  const taken = new Set();
  let path = '';
  for (let i = 0; i < xs.length; ++i) {
    const place = Math.round(xs[i]) * 8192 + Math.round(ys[i]);
    if (!exists(place) || taken.has(place)) continue;
    taken.add(place);
    path += markerPath(shape, xs[i], ys[i], r);
  }
  return path;
}

/** The class of a series' markers. */
export function markerClass({ shape, open }) {
  return open ? 'hollow' : isStroke(shape) ? 'thin' : 'area';
}

// ---- the legend

const markerR = 2.6;

function keyOf({ kind, dash, shape = 'circle', open, key, sign }) {
  const marker = (of, x, r) => svgPath(markerClass({ shape: of, open }), markerPath(of, x, 8, r));
  const rect = (style, y, height) => svg('rect', { class: style, x: 1, y, width: 18, height });
  if (key === 'any shape') return ['circle', 'square'].map((of, i) => marker(of, 5 + 10 * i, 4));
  if (kind === 'points') return marker(shape, 10, key === 'small' ? markerR : 4.5);
  if (kind === 'ellipse') return svgPath('thin', 'M1,8a9,5 0 1,0 18,0a9,5 0 1,0 -18,0z');
  if (kind === 'ray') return [svgPath('thin', 'M0,8h20'), svgPath('area', markerPath('diamond', 15, 8, 3.5))];
  if (kind === 'lane') return [rect('hollow', 1, 14), svgText(10, 12, sign, 'middle')];
  if (kind === 'bars' || kind === 'between') return rect(open ? 'hollow' : kind, 3, 10);
  return svgPath('line', 'M0,8h20', dash);
}

/**
 * Fills a node with the entries of a legend, which are buttons that hide and show what has their name.
 * @param series { name, colour, kind, dash, shape, open, sign, legend: false for no entry }, and in key: what its sign
 *   stands for, 'any shape' or 'small' markers; @param hidden a Set of names
 * @param changed is called after a change of `hidden`
 */
export function fillLegend(node, series, hidden, changed) {
  const entries = series.filter(({ name, legend }, i) => name && legend !== false
    && series.findIndex((each) => each.name === name) === i);
  const keys = entries.map(({ name, colour, dash, shape }) => JSON.stringify([name, colour, dash, shape]));
  keyedChildren(node, keys, (key) => {
    const entry = entries[keys.indexOf(key)];
    const picture = svg('svg', { class: 'drawing key', viewBox: '0 0 20 16', 'aria-hidden': 'true' }, keyOf(entry));
    return paint(button([picture, entry.name], () => {
      if (!hidden.delete(entry.name)) hidden.add(entry.name);
      changed();
    }, { title: 'Hide or show' }), entry.colour);
  }).forEach((each, i) => each.setAttribute('aria-pressed', !hidden.has(entries[i].name)));
}

// ---- the chart

const laneHeight = 12;

/**
 * A chart. Options:
 *   x, y: { label, unit, scale: 'linear', 'log' or 'band', min, max, zero, values, show }; `values` are the categories
 *     of a band, `show` makes the text of a value. y.max 'readable': readableLimit() of the series; y.both: both ways
 *   label: says what it shows, for screen readers; height: of the plotting area, pixels
 *   left: least room for the texts at the y axis, pixels, so that charts below each other begin at one place
 *   mode: 'x' (default; the read-out and the zoom follow x, which ascends in each series) or 'xy' (points in a plane)
 *   onSpan(span): after a zoom by the user; onPick(x, series, index): after a click or Enter; onHover({ each, i }): the
 *     point of a series that is read, or undefined;  labels(plot): nodes over the series, in pixels
 *
 * Series: { name, kind, colour, x: [], y: [] } and what its kind needs. Missing values (undefined, null, NaN) break
 * lines.
 *   colour: the name of a variable of style.css ('c1', 'truth', 'v-ok', ...) or [r, g, b]
 *   kind 'line': dash;  'steps': the same, y holds until the next x
 *        'points': shape, r, open, low, high, xLow, xHigh (ends of error bars); beside: name of the bars whose part of
 *          a band they share
 *        'bars': width (in x; on a band axis they share the band), from zero; open: only their outline
 *        'rule': only x or only y, a number: a line across; text: written at it, in line `row`
 *        'lane': only x, ascending: marks below the axis, each such series in a row of its own, which begins with the
 *          character `sign`; step: of neighbours
 *   tags: names in the legend, any of which hides the series, default its own
 *   show(i): text of a point in the read-out;  legend: false;  hover: false;  thin: true (a thin line)
 */
export class Plot {
  constructor(options) {
    this.options = { height: 220, mode: 'x', series: [], ...options };
    this.series = this.options.series;
    this.hidden = new Set();
    this.span = this.ySpan = null;
    this.legend = el('div', { class: 'legend', role: 'group', 'aria-label': 'Series' });
    this.axes = svg('g');
    this.inner = svg('svg');
    this.edges = svg('g');
    [this.cursor, this.hover] = ['cursor', 'hover'].map((name) => svg('path', { class: name, 'data-transient': '' }));
    this.selection = svg('rect', { class: 'selection', 'data-transient': '' });
    const zooms = [options.x, options.y].some(({ scale }) => scale === 'band') ? ''
      : ', plus and minus zoom, Escape shows everything';
    this.surface = svg('rect', { class: 'surface', tabindex: 0, role: 'application', 'data-transient': '',
      'aria-label': `${options.label ?? 'Chart'}. Arrow keys read values${zooms}.` });
    this.labels = svg('g');
    this.root = svg('svg', { class: 'drawing' }, this.axes, this.inner, this.edges, this.labels, this.cursor,
      this.selection, this.hover, this.surface);
    this.readout = el('div', { class: 'readout', role: 'status', hidden: true });
    this.node = el('div', { class: 'plot' }, this.legend, el('div', { class: 'stage' }, this.root, this.readout));
    this.listen();
    watchWidth(this.node, (width) => this.render(width));
  }

  /** Shows other series, or the same ones with other data. */
  update(series) {
    this.series = series;
    this.render();
  }

  /** Marks a place on the x axis; undefined: none. */
  setCursor(x) {
    this.cursorX = x;
    if (this.sx) this.drawCursor();
  }

  /** Shows a part of the x axis; null: everything. */
  setSpan(span) {
    this.span = span;
    this.render();
  }

  get shown() {
    return this.series.filter(({ name, tags = [name] }) => tags.every((tag) => !this.hidden.has(tag)));
  }

  get valueAxis() {
    return this.options.y.scale === 'band' ? 'x' : 'y';
  }

  // ---- scales

  wholeDomain(axis) {
    const options = this.options[axis], { mode } = this.options;
    if (options.scale === 'band') return options.values;
    const values = [], keys = axis === 'x' ? ['x', 'xLow', 'xHigh'] : ['y', 'low', 'high'];
    let zero = options.zero;
    for (const each of this.shown) {
      const { kind, width, x } = each;
      if (kind === 'bars' && axis === this.valueAxis) zero = true;
      if (kind === 'bars' && width && axis === 'x') values.push(x[0] - width / 2, x.at(-1) + width / 2);
      const part = axis === 'y' && mode === 'x' && Array.isArray(x) ? this.span : null;
      const inside = (i) => !part || (x[i] >= part[0] && x[i] <= part[1]);
      for (const column of keys.map((key) => each[key])) {
        if (Array.isArray(column)) column.forEach((value, i) => inside(i) && values.push(value));
        else values.push(column);
      }
    }
    const limit = options.max === 'readable' && (readableLimit(values) || 1) * 1.08;
    if (limit) return [options.both ? -limit : options.min ?? 0, limit];
    const pad = axis === 'x' && mode === 'x' && this.valueAxis === 'y' ? 0 : 0.06;
    return axisDomain(values, { ...options, zero, pad });
  }

  scale(axis, domain, range) {
    const { scale } = this.options[axis];
    if (scale === 'band') return d3.scaleBand().domain(domain).range(range).padding(0.25);
    return (scale === 'log' ? d3.scaleLog() : d3.scaleLinear()).domain(domain).range(range);
  }

  text(axis, value) {
    const { show, unit } = this.options[axis];
    if (show) return show(value);
    return typeof value === 'string' ? value : `${significant(value, 4)}${unit ? `\u00a0${unit}` : ''}`;
  }

  tickText(axis) {
    const { scale, show = (value) => typeof value === 'string' ? value : significant(value, 6) } = this.options[axis];
    const most = scale === 'band' && axis === 'y' ? Math.floor(this.width * 0.42 / 6.7) : Infinity;
    return (value) => show(value).length > most ? `${show(value).slice(0, most - 1)}\u2026` : show(value);
  }

  /** The pixel of a value; on a band axis, where bars share a band, that of the series `of`. */
  place(axis, value, of) {
    const scale = axis === 'x' ? this.sx : this.sy;
    if (value === undefined || value === null) return NaN;
    if (!scale.bandwidth) return scale(value);
    const bars = this.shown.filter(({ kind }) => kind === 'bars').map(({ name }) => name);
    const k = bars.indexOf(of?.beside ?? of?.name);
    return scale(value) + scale.bandwidth() * (k < 0 ? 0.5 : (k + 0.5) / bars.length);
  }

  // ---- drawing

  render(width = this.width) {
    if (!width) return;
    this.width = width;
    const { x, y, height, mode } = this.options;
    fillLegend(this.legend, this.series, this.hidden, () => this.render());
    const lanes = this.series.filter(({ kind }) => kind === 'lane');
    this.lanes = lanes.map(({ name }) => name);
    const top = y.label ? 24 : 8, right = this.width - 12, bottom = top + height;
    const laneTop = bottom - this.lanes.length * laneHeight;
    const yRange = y.scale === 'band' ? [top, laneTop] : [laneTop - (this.lanes.length > 0 ? 8 : 0), top];
    const yCount = Math.max(height / (y.scale === 'log' ? 28 : 36), 3), yText = this.tickText('y');
    this.fullY = this.scale('y', this.wholeDomain('y'), yRange);
    this.sy = this.ySpan ? this.scale('y', this.ySpan, yRange) : this.fullY;
    const yTicks = this.sy.bandwidth ? this.sy.domain() : this.sy.ticks(yCount);
    const longest = Math.max(...yTicks.map((tick) => yText(tick).length), 1);
    const left = Math.max(Math.ceil(6.7 * longest) + 12, this.options.left ?? 0);
    this.fullX = this.scale('x', this.wholeDomain('x'), [left, right]);
    this.sx = this.span ? this.scale('x', this.span, [left, right]) : this.fullX;
    Object.assign(this, { left, right, top, bottom, laneTop });
    const whole = bottom + (x.label ? 40 : 22);
    setAttributes(this.root, { width: this.width, height: whole, viewBox: `0 0 ${this.width} ${whole}` });
    const frame = { x: left - 1, y: top - 1, width: right - left + 2, height: bottom - top + 2 };
    setAttributes(this.inner, { ...frame, viewBox: Object.values(frame).join(' ') });
    setAttributes(this.surface, frame);
    this.drawAxes(Math.max((right - left) / 75, 2), yCount);
    this.drawSeries();
    this.labels.replaceChildren(...lanes.map(({ sign }, i) =>
      svgText(left - 8, laneTop + (i + 1) * laneHeight - 2, sign, 'middle')), ...this.options.labels?.(this) ?? []);
    this.drawCursor();
    const [read] = this.points ?? [];  // stays under the pointer while data come in
    this.drawHover(read ? this.pointsAt(read.x, read.y) : null);
    const corners = [[left, top], [right, bottom]];
    this.zoom.extent(corners).translateExtent(corners);
    this.surface.__zoom = this.transformOf(this.span, mode === 'xy' ? this.ySpan : null);
  }

  drawAxes(xCount, yCount) {
    const { x, y } = this.options, { left, right, top, bottom } = this;
    const axis = (make, name, scale, count, size) => {
      const drawn = make(scale).tickSize(scale.bandwidth ? 0 : -size).tickPadding(7), text = this.tickText(name);
      return scale.base ? drawn.ticks(count, text) : drawn.ticks(count).tickFormat(text);
    };
    const label = ({ label: words, unit }) => unit ? `${words} / ${unit}` : words;
    const groups = [[axis(d3.axisBottom, 'x', this.sx, xCount, bottom - top), `translate(0,${bottom})`],
      [axis(d3.axisLeft, 'y', this.sy, yCount, right - left), `translate(${left},0)`]].map(([drawn, transform]) => {
      const group = svg('g', { transform });
      d3.select(group).call(drawn.tickSizeOuter(0));
      return group;
    });
    this.axes.replaceChildren(...groups,
      x.label ? svgText((left + right) / 2, bottom + 34, label(x), 'middle') : '',
      y.label ? svgText(8, 13, label(y)) : '');
  }

  drawSeries() {
    const { shown } = this, edges = [];
    const groups = keyedChildren(this.inner, shown.map(({ name }) => name), () => svg('g'));
    const [low, high] = this.sy.domain(), beyond = { above: 0, below: 0 };
    for (const [k, each] of shown.entries()) {
      const parts = this.partsOf(each).filter(([, d]) => d);
      paint(groups[k], each.colour);
      keyedChildren(groups[k], d3.keys(parts), () => svg('path')).forEach((path, i) => {
        const [style, d, dash] = parts[i];
        setAttributes(path, { class: style, d, 'stroke-dasharray': dash });
      });
      if (each.text) edges.push(this.ruleText(each));
      const above = this.beyond(each, (value) => value > high), below = this.beyond(each, (value) => value < low);
      beyond.above += above.length;
      beyond.below += below.length;
      const path = above.map((x) => markerPath('triangle', x, this.top + 4, 4))
        .concat(below.map((x) => markerPath('down', x, this.sy.range()[0] - 4, 4))).join('');
      if (path) edges.push(paint(svgPath('area', path), each.colour));
    }
    const words = [beyond.above && `\u25b2 ${beyond.above} above`, beyond.below && `\u25bc ${beyond.below} below`]
      .filter(Boolean).join(', ');
    if (words) edges.push(svgText(this.right, 13, `${words} the axis`, 'end', 'soft'));
    this.edges.replaceChildren(...edges);
  }

  /** The places along the x axis of values beyond an end of the y axis. */
  beyond({ kind, x, y }, isBeyond) {
    if (!['points', 'line'].includes(kind) || this.sy.bandwidth) return [];
    return x.filter((_, i) => exists(y[i]) && isBeyond(y[i])).map((value) => this.place('x', value))
      .filter((at) => at >= this.left && at <= this.right);
  }

  ruleText({ x, text, row = 0 }) {
    const at = exists(x) ? this.sx(x) : this.right, y = this.top + 13 + 15 * row;
    if (at > (this.left + this.right) / 2) return svgText(at - 6, y, text, 'end', 'soft outlined');
    const fits = at + 6 + 6.4 * text.length < this.right;
    return svgText(fits ? at + 6 : this.right, y, text, fits ? 'start' : 'end', 'soft outlined');
  }

  /** The parts of a series: [class, path, dash]. */
  partsOf(each) {
    const { kind, shape, dash, r = markerR, step = 1, open } = each, { left, right, top, bottom } = this;
    if (kind === 'rule') {
      const d = exists(each.x) ? `M${this.sx(each.x)},${top}V${bottom}` : `M${left},${this.sy(each.y)}H${right}`;
      return [['thin', d, dash]];
    }
    if (kind === 'lane') {
      const at = this.laneTop + this.lanes.indexOf(each.name) * laneHeight;
      return [['area', runsOf(each.x, step).map(([first, last]) => {
        const from = tenth(this.sx(first - step / 2)), to = tenth(this.sx(last + step / 2));
        return `M${from},${at}h${Math.max(tenth(to - from), 1)}v${laneHeight - 2}H${from}z`;
      }).join('')]];
    }
    if (kind === 'bars') return [[open ? 'hollow' : 'bars', this.barsPath(each)]];
    const pixels = (axis, values) => values.map((value) => this.place(axis, value, each));
    const xs = pixels('x', each.x);
    const ys = pixels('y', each.y);
    const ends = (at, axis, low, high, path) => low && ['thin', d3.zip(at, pixels(axis, low), pixels(axis, high))
      .filter((row) => row.every(exists)).map((row) => path(...row.map(tenth))).join('')];
    return [kind !== 'points' && [each.thin ? 'thin' : 'line', linePath(xs, ys, kind === 'steps'), dash],
      ends(xs, 'y', each.low, each.high, (x, from, to) => `M${x},${from}V${to}`),
      ends(ys, 'x', each.xLow, each.xHigh, (y, from, to) => `M${from},${y}H${to}`),
      kind === 'points' && [markerClass(each), markersPath(shape ?? 'circle', xs, ys, r)]].filter(Boolean);
  }

  barsPath(each) {
    const flat = this.valueAxis === 'x', { sx, sy } = this;
    const [across, along, places, values] = flat ? [sy, sx, each.y, each.x] : [sx, sy, each.x, each.y];
    const zero = along(along.base ? along.domain()[0] : 0);
    const share = across.bandwidth?.() / this.shown.filter(({ kind }) => kind === 'bars').length;
    return places.map((place, i) => {
      if (!exists(values[i])) return '';
      const middle = this.place(flat ? 'y' : 'x', place, each), end = tenth(along(values[i]));
      const half = share ? 0.46 * share : Math.abs(across(place + each.width / 2) - middle);
      const [from, to] = [tenth(middle - half), tenth(middle + half)];
      return flat ? `M${zero},${from}H${end}V${to}H${zero}z` : `M${from},${zero}V${end}H${to}V${zero}z`;
    }).join('');
  }

  drawCursor() {
    const x = exists(this.cursorX) ? this.sx(this.cursorX) : NaN;
    this.cursor.setAttribute('d', x >= this.left && x <= this.right ? `M${tenth(x)},${this.top}V${this.bottom}` : '');
  }

  // ---- the read-out

  /** Whether the read-out shows all series at one x, or else one point. */
  get readsColumn() {
    return this.options.mode === 'x' && !this.sx.bandwidth && !this.sy.bandwidth;
  }

  /** The point of a series, in pixels. */
  point(each, i) {
    const y = each.kind === 'lane' ? this.laneTop + laneHeight * (this.lanes.indexOf(each.name) + 0.5)
      : this.place('y', each.y[i], each);
    return { each, i, x: this.place('x', each.x[i], each), y };
  }

  get readable() {
    return this.shown.filter(({ x, kind, hover }) => kind !== 'rule' && hover !== false && x.length > 0);
  }

  /** The points that the read-out shows for a place in pixels. */
  pointsAt(px, py) {
    if (this.readsColumn) {
      const points = this.readable.map((each) => this.point(each, nearestIndex(each.x, this.sx.invert(px))));
      const least = Math.min(...points.map(({ x }) => Math.abs(x - px)));
      return points.filter(({ x, each }) => Math.abs(x - px) <= least + (each.kind === 'lane' ? 0.5 : 6));
    }
    const all = this.readable.flatMap((each) => each.x.map((_, i) => this.point(each, i)));
    const distance = ({ x, y }) => Math.hypot(this.sy.bandwidth ? (x - px) / 100 : x - px, y - py);  // bars are long
    const near = all.filter((point) => distance(point) < 40).sort((a, b) => distance(a) - distance(b));
    return near.slice(0, 1);
  }

  valueText({ each, i }) {
    if (each.show) return each.show(i);
    if (each.kind === 'lane') return '';
    const value = each[this.valueAxis][i];
    return exists(value) ? this.text(this.valueAxis, value) : noValue;
  }

  drawHover(points) {
    this.points = points;
    const [at] = points ?? [];
    this.options.onHover?.(at);
    this.readout.hidden = !at;
    const inside = (points ?? []).filter(({ y }) => y >= this.top - 1 && y <= this.bottom);
    this.hover.setAttribute('d', (at && this.readsColumn ? `M${at.x},${this.top}V${this.bottom}` : '')
      + inside.map(({ x, y }) => markerPath('circle', x, y, 5)).join(''));
    if (!at) return;
    const { x, y } = this.options, { each, i } = at;
    this.readout.replaceChildren(
      el('strong', {}, this.valueAxis === 'x' ? each.y[i] : `${x.label ?? 'x'} ${this.text('x', each.x[i])}`),
      ...points.map((point) =>
        el('div', {}, paint(el('i'), point.each.colour), `${point.each.name} ${this.valueText(point)}`.trim())),
      this.options.mode === 'xy' ? el('div', {}, `${y.label} ${this.text('y', each.y[i])}`) : '');
    const { offsetWidth: wide, offsetHeight: tall } = this.readout;
    const left = at.x + 14 + wide > this.width ? Math.max(at.x - 14 - wide, 0) : at.x + 14;
    const top = Math.max(Math.min((exists(at.y) ? at.y : this.top) - tall / 2, this.bottom - tall), 0);
    Object.assign(this.readout.style, { left: `${left}px`, top: `${top}px` });
  }

  /** Rings a place { x, y } in the units of the axes; undefined: none. */
  ring(at) {
    if (this.width) this.hover.setAttribute('d', at ? markerPath('circle', this.sx(at.x), this.sy(at.y), 8) : '');
  }

  /** Moves the read-out by points, from left to right (of bars from above to below). */
  move(step) {
    const seen = new Set(), down = this.sy.bandwidth;
    const all = this.readable.flatMap((each) => each.x.map((_, i) => this.point(each, i)))
      .filter(({ x }) => x >= this.left - 1 && x <= this.right + 1 && !(this.readsColumn && seen.has(x)) && seen.add(x))
      .sort((a, b) => down ? a.y - b.y || a.x - b.x : a.x - b.x || a.y - b.y);
    if (all.length === 0) return;
    const now = this.points?.[0];
    const isNow = ({ x, y }) => x === now.x && (this.readsColumn || y === now.y);
    const index = now ? all.findIndex(isNow) : step > 0 ? -1 : all.length;
    const next = all[Math.min(Math.max(index + step, 0), all.length - 1)];
    this.drawHover(this.readsColumn ? this.pointsAt(next.x, next.y) : [next]);
  }

  // ---- pointer and keys

  /** The transform of the whole chart after which a part of it fills the frame. */
  transformOf(span, ySpan) {
    if (!span || this.fullX.bandwidth) return d3.zoomIdentity;
    const [a, b] = span.map(this.fullX), k = (this.right - this.left) / (b - a);
    return d3.zoomIdentity.translate(this.left - k * a, ySpan ? this.top - k * this.fullY(ySpan[1]) : 0).scale(k);
  }

  zoomTo(transform) {
    if (this.fullX.bandwidth || this.fullY.bandwidth) return;
    const whole = transform.k < 1.001;
    this.span = whole ? null : transform.rescaleX(this.fullX).domain();
    if (this.options.mode === 'xy') this.ySpan = whole ? null : transform.rescaleY(this.fullY).domain();
    this.render();
    this.options.onSpan?.(this.span);
  }

  listen() {
    const surface = d3.select(this.surface);
    this.zoom = d3.zoom().scaleExtent([1, 1e6])
      .filter(() => d3.event.type === 'wheel' ? d3.event.ctrlKey : d3.event.touches?.length > 1)
      .on('zoom', () => this.zoomTo(d3.event.transform));
    surface.call(this.zoom).on('dblclick.zoom', null);
    let from = null;
    const pointer = (event) => d3.clientPoint(this.root, event);
    const boxTo = (to) => [[0, this.left, this.right], [1, this.top, this.laneTop]].map(([k, low, high]) =>
      [from[k], to[k]].map((value) => Math.min(Math.max(value, low), high)).sort((a, b) => a - b));
    const on = (names, listener) => names.split(' ').forEach((name) => this.surface.addEventListener(name, listener));
    on('pointerdown', (event) => {
      if (event.button !== 0) return;
      if (event.pointerType !== 'touch') this.surface.setPointerCapture(event.pointerId);
      from = event.pointerType === 'touch' || this.sx.bandwidth || this.sy.bandwidth ? null : pointer(event);
      this.drawHover(this.pointsAt(...pointer(event)));
    });
    on('pointermove', (event) => {
      const at = pointer(event);
      if (!from || Math.abs(at[0] - from[0]) < 4) {
        this.drawHover(this.pointsAt(...at));
        return;
      }
      const [x, y] = boxTo(at), [low, high] = this.options.mode === 'xy' ? y : [this.top, this.bottom];
      setAttributes(this.selection, { x: x[0], width: x[1] - x[0], y: low, height: high - low });
    });
    on('pointerup', (event) => {
      const at = pointer(event);
      if (from && Math.abs(at[0] - from[0]) >= 4) {
        const [x, y] = boxTo(at), { left, right, top, laneTop } = this;
        // In a plane the part keeps the frame's proportions, so that nothing of the selection is lost.
        const yScale = this.options.mode === 'xy' ? (laneTop - top) / Math.max(y[1] - y[0], 4) : Infinity;
        const k = Math.min((right - left) / (x[1] - x[0]), yScale);
        const select = d3.zoomIdentity.translate((left + right) / 2, (top + laneTop) / 2).scale(k)
          .translate(-(x[0] + x[1]) / 2, -(y[0] + y[1]) / 2);
        const old = d3.zoomTransform(this.surface);
        this.zoomTo(d3.zoomIdentity.translate(select.applyX(old.x), select.applyY(old.y)).scale(old.k * k));
      } else if (this.points?.[0]) {
        this.pick();
      }
    });
    on('pointerup pointercancel', () => {
      from = null;
      setAttributes(this.selection, { width: 0, height: 0 });
    });
    on('pointerleave blur', () => this.drawHover(null));
    on('dblclick', () => this.zoomTo(d3.zoomIdentity));
    on('keydown', (event) => this.key(event));
  }

  key(event) {
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageDown: 20, PageUp: -20, Home: -1e9,
      End: 1e9 }[event.key];
    const factor = { '+': 1.6, '=': 1.6, '-': 1 / 1.6 }[event.key], [point] = this.points ?? [];
    if (step) this.move(step);
    else if (factor) d3.select(this.surface).call(this.zoom.scaleBy, factor, point && [point.x, point.y]);
    else if (event.key === 'Escape' || event.key === '0') this.zoomTo(d3.zoomIdentity);
    else if (event.key === 'Enter') this.pick();
    else return;
    event.preventDefault();
  }

  pick() {
    const [point] = this.points ?? [];
    if (point) this.options.onPick?.(point.each.x[point.i], point.each, point.i);
  }
}

/** Makes charts share the part of the x axis that they show. */
export function linkPlots(plots) {
  for (const plot of plots) {
    plot.options.onSpan = (span) => plots.forEach((other) => other !== plot && other.setSpan(span));
  }
}
