// SPDX-License-Identifier: Apache-2.0
// A room from above, to scale.
import { button, el, svg, svgPath, svgText, setAttributes, watchWidth } from './kit.js';
import { exists, fixed, significant, paint } from './kit.js';
import { fillLegend, linePath, markerClass, markerPath, markersPath } from './plot.js';

/**
 * Returns the 1 sigma ellipse of a covariance: half axes `a` >= `b`, and the angle of `a` from the x axis. Undefined
 * where a number is missing or the matrix is no covariance.
 */
export function ellipseOf({ var_x_m2: xx, cov_xy_m2: xy, var_y_m2: yy }) {
  const middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
  if (!exists(middle) || !exists(half) || !(xx >= 0) || middle - half < -1e-9 * middle) return undefined;
  return { a: Math.sqrt(middle + half), b: Math.sqrt(Math.max(middle - half, 0)),
    angle_rad: Math.atan2(2 * xy, xx - yy) / 2 };
}

/** Returns points of an ellipse around a place, scaled to `sigmas`. */
export function ellipsePoints(centre, { a, b, angle_rad }, sigmas = 1, count = 48) {
  const [c, s] = [Math.cos(angle_rad), Math.sin(angle_rad)];
  return Array.from({ length: count + 1 }, (_, i) => {
    const t = 2 * Math.PI * i / count, u = sigmas * a * Math.cos(t), v = sigmas * b * Math.sin(t);
    return [centre[0] + c * u - s * v, centre[1] + s * u + c * v];
  });
}

/** Returns the step of a grid: 1, 2 or 5 times a power of ten, with at least `least` pixels between its lines. */
export function gridStep(pixels_perM, least) {
  const step = 10 ** Math.floor(Math.log10(least / pixels_perM));
  return [1, 2, 5, 10].map((factor) => factor * step).find((each) => each * pixels_perM >= least * (1 - 1e-9));
}

/** Returns the smallest bounds around points [x, y], with a margin; undefined without any. */
export function boundsOf(points, margin_m = 0.1) {
  const held = points.filter(([x, y]) => exists(x) && exists(y));
  if (held.length === 0) return undefined;
  const [[x0, x1], [y0, y1]] = [0, 1].map((k) => d3.extent(held, (point) => point[k]));
  return [x0 - margin_m, y0 - margin_m, x1 + margin_m, y1 + margin_m];
}

const legendKinds = { areas: 'between', paths: 'line', points: 'points', ellipses: 'ellipse', rays: 'ray',
  poses: 'points' };

/**
 * A plan. Options:
 *   map: as in the `run` line of the telemetry;  bounds_m: [min x, min y, max x, max y] shown first, default the map's
 *   underlay: address of an image that covers the map's bounds;  label: for screen readers;  tallest: pixels
 *   floor: false: the bounds are no room;  xLabel, yLabel: of the axes
 *
 * Layers, which update() takes by name. Each is a list; places are in metres, angles in radians in the world:
 *   areas:    { name, colour, points: [[x, y], ...], solid }
 *   paths:    { name, colour, points: [[x, y], ...], dash, halo, show(i) }; a missing point breaks the line
 *   points:   { name, colour, points: [[x, y], ...], shape, r, open, show(i) }
 *   ellipses: { name, colour, x_m, y_m, var_x_m2, cov_xy_m2, var_y_m2, sigmas: 1 }
 *   rays:     { name, colour, from: [x, y], bearing_rad, range_m, sigma_m, dash }; without range_m, to the edge
 *   poses:    { name, colour, x_m, y_m, heading_rad, radius_m, dash }
 *   landmarks: { name, x_m, y_m, radius_m, rgb or bands }: in addition to those of the map
 *   labels:   { text, at: [x, y], above, end }: above the place, or ending at it
 * The legend hides and shows all that has the same name; entries without a name have no place in it.
 */
export class Plan {
  constructor(options) {
    this.options = { tallest: 560, xLabel: 'x / m', yLabel: 'y / m', label: 'The room from above', ...options };
    const names = ['areas', 'paths', 'rays', 'ellipses', 'landmarks', 'points', 'poses', 'labels'];
    this.layers = Object.fromEntries(names.map((name) => [name, []]));
    this.groups = Object.fromEntries(['ground', ...names].map((name) => [name, svg('g')]));
    this.hidden = new Set();
    this.transform = d3.zoomIdentity;
    this.inner = svg('svg', {}, Object.values(this.groups));
    this.frame = svg('g');
    this.hover = svg('path', { class: 'hover', 'data-transient': '' });
    const label = `${this.options.label}. Plus and minus zoom, arrow keys move, 0 shows everything.`;
    this.root = svg('svg', { class: 'drawing', role: 'application', tabindex: 0, 'aria-label': label }, this.inner,
      this.frame, this.hover);
    this.legend = el('div', { class: 'legend', role: 'group', 'aria-label': 'Layers' });
    this.readout = el('div', { class: 'readout', hidden: true });
    const buttons = [['+', 'Zoom in', () => this.scaleBy(1.5)], ['\u2212', 'Zoom out', () => this.scaleBy(1 / 1.5)],
      ['All', 'Show the whole plan', () => this.reset()]].map(([sign, meaning, act]) =>
      button(sign, act, { 'aria-label': meaning }));
    this.node = el('div', { class: 'plan' }, el('div', { class: 'plan-head' }, this.legend,
      el('div', { class: 'plan-buttons' }, buttons)), el('div', { class: 'stage' }, this.root, this.readout));
    this.listen();
    watchWidth(this.node, (width) => this.render(width));
  }

  /** Shows other layers; those that are not given stay. */
  update(layers) {
    Object.assign(this.layers, layers);
    if (!this.width) return;
    this.drawLegend();
    this.drawLayers(Object.keys(layers));
  }

  get whole() {
    const bounds = this.options.bounds_m ?? this.options.map?.bounds_m;
    return bounds?.every(exists) && bounds[2] > bounds[0] && bounds[3] > bounds[1] ? bounds : [-0.5, -0.5, 0.5, 0.5];
  }

  render(width = this.width) {
    if (!width) return;
    this.width = width;
    const [x0, y0, x1, y1] = this.whole, { tallest } = this.options;
    const [left, top] = [44, 20], wide = this.width - left - 8;
    const tall = Math.max(Math.min(Math.round(wide * (y1 - y0) / (x1 - x0)), tallest), 120);
    Object.assign(this, { left, top, wide, tall, fit: Math.min(wide / (x1 - x0), tall / (y1 - y0)) });
    const whole = top + tall + 38;
    setAttributes(this.root, { width: this.width, height: whole, viewBox: `0 0 ${this.width} ${whole}` });
    setAttributes(this.inner, { x: left, y: top, width: wide, height: tall });
    this.drawLegend();
    this.drawAll();
  }

  drawAll() {
    this.pixels_perM = this.fit * this.transform.k;
    this.drawGround();
    this.drawLayers(Object.keys(this.layers));
    this.drawHover(null);
  }

  /** The pixel of a place in the inner drawing. */
  px([x, y]) {
    const [x0, y0, x1, y1] = this.whole;
    return this.transform.apply([(x - (x0 + x1) / 2) * this.fit + this.wide / 2,
      ((y0 + y1) / 2 - y) * this.fit + this.tall / 2]);
  }

  world(pixel) {
    const [x0, y0, x1, y1] = this.whole, [px, py] = this.transform.invert(pixel);
    return [(px - this.wide / 2) / this.fit + (x0 + x1) / 2, (y0 + y1) / 2 - (py - this.tall / 2) / this.fit];
  }

  path(points) {
    const pixels = points.map((point) => point && exists(point[0]) && exists(point[1]) ? this.px(point) : [NaN, NaN]);
    return [pixels.map(([x]) => x), pixels.map(([, y]) => y)];
  }

  drawLegend() {
    fillLegend(this.legend, Object.entries(legendKinds).flatMap(([layer, kind]) =>
      this.layers[layer].map((each) => ({ ...each, kind, points: null }))), this.hidden, () => this.render());
  }

  drawGround() {
    const { map, underlay, floor, xLabel, yLabel } = this.options, { left, top, wide, tall } = this;
    const box = map?.bounds_m ?? this.whole;
    const [x, y] = this.px([box[0], box[3]]), [right, bottom] = this.px([box[2], box[1]]);
    const frame = { x, y, width: right - x, height: bottom - y };
    const step = gridStep(this.pixels_perM, 55), digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    const [from, to] = [this.world([0, tall]), this.world([wide, 0])];
    const steps = (k) => d3.range(Math.ceil(from[k] / step), Math.floor(to[k] / step) + 1).map((i) => i * step);
    const columns = steps(0).map((value) => [value, this.px([value, 0])[0]]);
    const rows = steps(1).map((value) => [value, this.px([0, value])[1]]);
    const grid = columns.map(([, at]) => `M${at},0V${tall}`).concat(rows.map(([, at]) => `M0,${at}H${wide}`)).join('');
    const obstacle = ({ outline_m: outline, x_m, y_m, radius_m }) => outline
      ? svgPath('wall', `${linePath(...this.path(outline))}z`) : this.disc([x_m, y_m], radius_m, { class: 'wall' });
    this.groups.ground.replaceChildren(...[floor !== false && svg('rect', { class: 'floor', ...frame }), ...underlay
      ? [svg('image', { href: underlay, ...frame, preserveAspectRatio: 'none' })]  // it shows the obstacles, too
      : [svgPath('grid', grid), ...(map?.obstacles ?? []).map(obstacle)]].filter(Boolean));
    const bar = step * this.pixels_perM, barX = left + wide - bar - 10, barY = top + tall - 10;
    this.frame.replaceChildren(
      ...columns.map(([value, at]) => svgText(left + at, top + tall + 15, fixed(value, digits), 'middle', 'soft')),
      ...rows.map(([value, at]) => svgText(left - 5, top + at + 4, fixed(value, digits), 'end', 'soft')),
      svgText(8, 12, yLabel), svgText(left + wide / 2, top + tall + 31, xLabel, 'middle'),
      svg('rect', { class: 'edge', x: left, y: top, width: wide, height: tall }),
      svgPath('halo', `M${barX},${barY}h${bar}`),
      paint(svgPath('line', `M${barX},${barY - 4}v8m0,-4h${bar}m0,-4v8`), 'ink'),
      svgText(barX + bar / 2, barY - 6, step < 1 ? `${significant(step * 100)} cm` : `${significant(step)} m`, 'middle',
        'outlined'));
  }

  disc(place, radius_m, attributes, least = 0) {
    const [cx, cy] = this.px(place);
    return svg('circle', { cx, cy, r: Math.max((radius_m ?? 0) * this.pixels_perM, least), ...attributes });
  }

  drawLayers(names) {
    for (const name of names) {
      const shown = this.layers[name].filter((each) => !this.hidden.has(each.name));
      const items = name === 'landmarks' ? [...(this.options.map?.landmarks ?? []), ...shown] : shown;
      this.groups[name].replaceChildren(...items.flatMap((each) => this[name](each)).filter(Boolean));
    }
  }

  // ---- what each layer draws

  areas({ colour, points, solid }) {
    return paint(svgPath(solid ? 'area' : 'between', `${linePath(...this.path(points))}z`), colour);
  }

  labels({ text, at, above, end }) {
    const [x, y] = this.px(at);
    return svgText(end ? x - 8 : x + 8, above ? y - 8 : y + 16, text, end ? 'end' : 'start', 'outlined');
  }

  paths({ colour, points, dash, halo }) {
    const d = linePath(...this.path(points));
    return [halo && svgPath('halo', d), paint(svgPath('line', d, dash), colour)];
  }

  points({ colour, points, shape = 'circle', r = 2.6, open }) {
    return paint(svgPath(markerClass({ shape, open }), markersPath(shape, ...this.path(points), r)), colour);
  }

  ellipses({ colour, x_m, y_m, sigmas = 1, ...covariance }) {
    const ellipse = ellipseOf(covariance);
    // One of less than two pixels would be a dot.
    if (!ellipse || !exists(x_m) || !exists(y_m) || sigmas * ellipse.a * this.pixels_perM < 1) return null;
    const d = linePath(...this.path(ellipsePoints([x_m, y_m], ellipse, sigmas)));
    return paint(svgPath('thin', `${d}z`), colour);
  }

  rays({ colour, from, bearing_rad, range_m, sigma_m, dash }) {
    if (!exists(bearing_rad) || !exists(from[0]) || !exists(from[1])) return null;
    const [x0, y0, x1, y1] = this.whole, known = exists(range_m);
    const at = (range) => [from[0] + range * Math.cos(bearing_rad), from[1] + range * Math.sin(bearing_rad)];
    const line = (style, points, dashes) => paint(svgPath(style, linePath(...this.path(points)), dashes), colour);
    return [line('thin', [from, at(known ? range_m : Math.hypot(x1 - x0, y1 - y0))], known ? dash : '2 5'),
      known && paint(svgPath('area', markerPath('diamond', ...this.px(at(range_m)), 3.5)), colour),
      known && exists(sigma_m) && line('line', [at(range_m - sigma_m), at(range_m + sigma_m)])];
  }

  poses({ colour, x_m, y_m, heading_rad, radius_m, dash }) {
    if (!exists(x_m) || !exists(y_m)) return null;
    const [x, y] = this.px([x_m, y_m]), r = 1.5 * Math.max((radius_m ?? 0) * this.pixels_perM, 6);
    return [paint(this.disc([x_m, y_m], radius_m, { class: 'robot', 'stroke-dasharray': dash }, 6), colour),
      exists(heading_rad)
        && paint(svgPath('line', `M${x},${y}l${r * Math.cos(heading_rad)},${-r * Math.sin(heading_rad)}`), colour)];
  }

  landmarks({ name, x_m, y_m, radius_m, rgb, bands }) {
    const place = [x_m, y_m], [x, y] = this.px(place), r = Math.max((radius_m ?? 0) * this.pixels_perM, 4);
    const number = bands !== undefined && `no. ${bands}`, fill = rgb ? `rgb(${rgb.map(Number)})` : 'var(--card)';
    const words = [number, name].filter(Boolean).join(' ');
    const seen = x > -r && x < this.wide + r && y > -r && y < this.tall + r, right = x < this.wide - 60;
    return [this.disc(place, radius_m, { class: 'landmark', style: `fill:${fill}` }, 4),
      number && this.disc(place, radius_m / 2, { class: 'landmark', style: 'fill:none' }, 2),
      seen && words && svgText(right ? x + r + 4 : x - r - 4, Math.min(Math.max(y + 4, 12), this.tall - 4), words,
        right ? 'start' : 'end', 'outlined')];
  }

  // ---- the read-out

  drawHover(place) {
    let best = null, least = 15;
    const { points, paths } = this.layers;
    for (const each of place ? [...points, ...paths].filter(({ name, show }) => show && !this.hidden.has(name)) : []) {
      const [xs, ys] = this.path(each.points);
      xs.forEach((x, i) => {
        const distance = Math.hypot(x - place[0], ys[i] - place[1]);
        if (distance < least) [best, least] = [{ each, i, x: x + this.left, y: ys[i] + this.top }, distance];
      });
    }
    this.readout.hidden = best === null;
    this.hover.setAttribute('d', best ? markerPath('circle', best.x, best.y, 6) : '');
    if (!best) return;
    const { each, i, x, y } = best;
    const words = [each.name, each.show(i)].filter(Boolean).join(': ');
    this.readout.replaceChildren(el('div', {}, paint(el('i'), each.colour), words));
    const wide = this.readout.offsetWidth, left = x + 12 + wide > this.width ? Math.max(x - 12 - wide, 0) : x + 12;
    Object.assign(this.readout.style, { left: `${left}px`, top: `${y + 8}px` });
  }

  // ---- pointer and keys

  scaleBy(factor) {
    d3.select(this.inner).call(this.zoom.scaleBy, factor);
  }

  reset() {
    d3.select(this.inner).call(this.zoom.transform, d3.zoomIdentity);
    this.render();
  }

  listen() {
    // One finger and the wheel scroll the page, the wheel until the plan has the focus.
    this.zoom = d3.zoom().scaleExtent([0.5, 5000]).extent(() => [[0, 0], [this.wide ?? 1, this.tall ?? 1]])
      .filter(() => {
        const { type, ctrlKey, button: pressed, touches } = d3.event;
        if (type === 'wheel') return ctrlKey || document.activeElement === this.root;
        return touches ? touches.length > 1 || this.transform.k > 1 : !pressed;
      })
      .on('zoom', () => {
        this.transform = d3.event.transform;
        if (this.width) this.drawAll();
      });
    d3.select(this.inner).call(this.zoom);
    this.root.addEventListener('pointerdown', () => this.root.focus({ preventScroll: true }));
    this.root.addEventListener('pointermove', (event) => {
      const [x, y] = d3.clientPoint(this.root, event);
      if (!event.buttons) this.drawHover([x - this.left, y - this.top]);
    });
    this.root.addEventListener('pointerleave', () => this.drawHover(null));
    this.root.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] }[event.key];
      const factor = { '+': 1.4, '=': 1.4, '-': 1 / 1.4 }[event.key];
      if (step) d3.select(this.inner).call(this.zoom.translateBy, ...step.map((way) => way / this.transform.k));
      else if (factor) this.scaleBy(factor);
      else if (event.key === '0' || event.key === 'Escape') this.reset();
      else return;
      event.preventDefault();
    });
  }
}
