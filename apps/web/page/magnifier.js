// SPDX-License-Identifier: Apache-2.0
// One landmark, enlarged in both views: pixels as squares, and what was measured to fractions of a pixel.
import { button, degrees, el, exists, facts, fixed, millimetres, noValue, quantity } from './kit.js';
import { keyedChildren, paint, setText, svg, verdictChip, verdictOf } from './kit.js';
import { ellipseOf, ellipsePoints } from './plan.js';
import { landmarksInView, mirrorViews, pixelPath } from './mirrors.js';

const magnifierWidths = [160, 80, 40, 20, 10];  // pixels of the image across the enlarged part
export const sigmasOf95 = Math.sqrt(-2 * Math.log(0.05));  // half axes of the ellipse that holds 95 % in the plane

/** The factor (1, 2 or 5 times a power of ten) by which an ellipse must be drawn larger to be at least `least` wide. */
export function ellipseFactor(halfAxis, least) {
  if (!(halfAxis > 0) || !(least > halfAxis)) return 1;
  const power = 10 ** Math.min(Math.floor(Math.log10(least / halfAxis)), 6);
  return power * ([1, 2, 5].find((step) => step * power * halfAxis >= least) ?? 10);
}

/** A value and its standard deviation, with digits that show two of the latter's: "12.34 mm ± 0.56 mm". */
export function plusMinus(value, sigma, show = millimetres, unit = 1000) {
  const digits = exists(sigma) && sigma > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(unit * sigma)), 1), 4) : 1;
  return exists(sigma) ? `${show(value, digits)} \u00b1 ${show(sigma, digits)}` : show(value, digits);
}

export class Magnifier {
  constructor(run, select) {
    Object.assign(this, { run, zoom: 2 });
    this.choice = el('select', { 'aria-label': 'Landmark', onchange: () => select(this.choice.value) },
      run.map.landmarks.map(({ name }) => el('option', { value: name }, name)));
    this.size = el('span', { class: 'soft', role: 'status' });
    this.views = mirrorViews.map((view) => {
      const canvas = el('canvas', { role: 'img', 'aria-label': `Enlarged part of the ${view} image` });
      const lines = svg('svg', { 'aria-hidden': 'true' }), note = el('p', { class: 'absent' });
      const box = el('div', { class: 'magnified' }, canvas, lines, note, el('span', { class: 'view-name' }, view));
      return { view, canvas, lines, note, box };
    });
    this.answer = el('p');
    this.values = Object.fromEntries(['range', 'error', 'bearing', 'disparity', 'near point', 'edge noise']
      .map((name) => [name, el('span')]));
    this.legend = el('p', { class: 'soft' });
    const zoomBy = (step) => () => {
      this.zoom = Math.min(Math.max(this.zoom + step, 0), magnifierWidths.length - 1);
      this.redraw?.();
    };
    this.node = el('div', { class: 'card magnifier' }, el('h3', {}, 'Landmark, enlarged'),
      el('div', { class: 'filter' }, this.choice, button('\u2212', zoomBy(-1), { 'aria-label': 'Less enlarged' }),
        button('+', zoomBy(1), { 'aria-label': 'More enlarged' }), this.size),
      el('div', { class: 'mirrors' }, this.views.map(({ box }) => box)),
      el('div', { class: 'magnifier-numbers' }, this.answer, facts(Object.entries(this.values)), this.legend));
  }

  /** @param canvasOf gives the canvas that holds a view's image */
  draw(frame, canvasOf, selected) {
    this.redraw = () => this.draw(frame, canvasOf, selected);
    if (this.choice.value !== selected) this.choice.value = selected;
    const width = magnifierWidths[this.zoom], factors = this.views.map((each) => {
      const settings = this.run.views?.[each.view];
      const marks = settings ? landmarksInView(frame, each.view, settings.unroll) : [];
      return this.drawView(each, marks.find(({ name }) => name === selected), canvasOf(each.view), width, settings);
    });
    setText(this.size, `${width} \u00d7 ${width * 0.75} pixels`);
    this.drawNumbers(frame, selected, Math.max(...factors));
  }

  /** Returns how many times larger than it is the ellipse was drawn. */
  drawView({ view, canvas, lines, note, box }, mark, image, width, settings) {
    box.classList.toggle('empty', !mark?.anchor);
    setText(note, mark?.anchor ? '' : `Its place in the ${view} view is not known.`);
    if (!mark?.anchor) return 1;
    const scale = image.width / settings.width_px;  // a stored page holds smaller copies of the images
    const across = Math.max(Math.round(width * scale), 4), down = Math.round(across * 0.75);
    const [left, top] = [across, down].map((size, k) => Math.round((mark.anchor[k] + 0.5) * scale - size / 2));
    Object.assign(canvas, { width: across, height: down });
    canvas.getContext('2d').drawImage(image, left, top, across, down, 0, 0, across, down);
    lines.setAttribute('viewBox', [left / scale - 0.5, top / scale - 0.5, across / scale, down / scale].join(' '));
    return this.drawFit(lines, mark, across / scale);
  }

  drawFit(lines, { outline = [], sighting, verdict }, width) {
    const { column_px: x, row_px: y, var_column_px2, cov_px2, var_row_px2 } = sighting ?? {};
    const ellipse = ellipseOf({ var_x_m2: var_column_px2, cov_xy_m2: cov_px2, var_y_m2: var_row_px2 });
    const factor = ellipseFactor(ellipse?.a * sigmasOf95, width / 40), r = width / 160;
    const round = ellipse ? pixelPath(ellipsePoints([x, y], ellipse, sigmasOf95 * factor)) : '';
    const dot = ([u, v]) => `M${u - r},${v}a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 ${-2 * r},0`;
    const path = outline.length ? pixelPath(outline) : '';
    const paths = { under: path, over: path, dots: outline.map(dot).join(''), 'ellipse under': round, ellipse: round,
      cross: sighting ? `M${x - 2 * r},${y}h${4 * r}m${-2 * r},${-2 * r}v${4 * r}` : '' };
    keyedChildren(paint(lines, verdictOf(verdict).colour), Object.keys(paths), (name) => svg('path', { class: name }))
      .forEach((node) => node.setAttribute('d', paths[node.getAttribute('class')]));
    return factor;
  }

  drawNumbers(frame, selected, factor) {
    const { method } = this.run, range = frame.ranges?.find(({ landmark }) => landmark === selected);
    const sightings = (frame.sightings ?? []).filter(({ landmark }) => landmark === selected);
    const ofViews = (show) => sightings.map((each) => `${each.view} ${show(each)}`).join('; ') || noValue;
    const { verdict, range_m, sigma_range_m, true_range_m, bearing_rad, sigma_bearing_rad, disparity_px } = range ?? {};
    const shown = {
      range: plusMinus(range_m, sigma_range_m), error: millimetres((range_m ?? NaN) - (true_range_m ?? NaN), 2),
      bearing: plusMinus(bearing_rad, sigma_bearing_rad, degrees, 180 / Math.PI),
      disparity: quantity(disparity_px, 'px'),
      'near point': ofViews(({ column_px, row_px }) => `${fixed(column_px, 2)}, ${fixed(row_px, 2)} px`),
      'edge noise': ofViews(({ edge_noise_px }) => quantity(edge_noise_px, 'px', 3)),
    };
    for (const [name, text] of Object.entries(shown)) setText(this.values[name], text);
    keyedChildren(this.answer, [verdict], () =>
      el('span', {}, verdict ? [verdictChip(verdict, method), ` ${verdictOf(verdict, method).meaning}`] : noValue));
    setText(this.legend, 'Line: outline at the measured range and bearing. Cross: near point of the top, with '
      + `its 95 % ellipse${factor > 1 ? `, drawn ${factor.toLocaleString('en')} times as large` : ''}.`);
  }
}
