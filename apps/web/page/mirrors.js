// SPDX-License-Identifier: Apache-2.0
// The images of both mirrors with what was found in them, and both panoramas on one axis of bearings.
import { button, degrees, el, keyedChildren, paint, setText, svg, verdictOf, watchWidth } from './kit.js';
import { bearingShare, unrollImage, unrollPlace, unrollTable } from './unroll.js';

export const mirrorViews = ['upper', 'lower'];  // as they stand on the mast
const panoramaSize = { width: 720, height: 112 };

export function pixelPath(points_px) {
  return `M${points_px.map(([column, row]) => `${column.toFixed(2)},${row.toFixed(2)}`).join('L')}`;
}

/**
 * What a view shows of each landmark of a frame: { name, verdict, outline, sighting, ray, anchor }; `anchor` is the
 * pixel that its name stands beside. Landmarks of which no place in the view is known have no anchor.
 */
export function landmarksInView(frame, view, grid) {
  const of = (rows, name) => rows?.find((row) => row.landmark === name && row.view === view);
  return (frame?.ranges ?? []).map(({ landmark: name, verdict, bearing_rad }) => {
    const outline = of(frame.outlines, name)?.points_px, sighting = of(frame.sightings, name);
    const hasRay = !outline && !sighting && bearing_rad !== undefined;
    const ray = hasRay ? unrollPlace(grid, bearingShare(bearing_rad), 0.02) : null;
    const anchor = sighting ? [sighting.column_px, sighting.row_px] : outline?.[outline.length >> 1] ?? ray;
    return { name, verdict, outline, sighting, ray, anchor };
  });
}

/** A landmark's sign and name in the colour of its verdict; the verdict in words where it is not `ok`. */
function setLabel(node, { name, verdict }, selected, method) {
  node.classList.toggle('selected', selected === name);
  if (node.dataset.verdict === verdict) return;
  node.dataset.verdict = verdict;
  const { colour, sign } = verdictOf(verdict, method);
  paint(node, colour).replaceChildren(el('i', {}, sign), name, verdict === 'ok' ? '' : el('small', {}, ` ${verdict}`));
}

/** Moves a label to a place in CSS pixels, by a transform because that costs no layout; back by shares of its size. */
function placeLabel(node, x, y, across, down) {
  node.style.transform = `translate(${x.toFixed(1)}px,${y.toFixed(1)}px) translate(${-100 * across}%,${-100 * down}%)`;
}

/** One mirror: its image on a canvas, and over it, in the image's pixels, the outlines and names. */
class MirrorImage {
  constructor(view, run, select, resized) {
    Object.assign(this, { view, run, settings: run.views?.[view], marks: [] });
    const { width_px: width = 640, height_px: height = 480 } = this.settings ?? {};
    this.canvas = el('canvas', { width, height, role: 'img', 'aria-label': `Image of the ${view} mirror` });
    this.context = this.canvas.getContext('2d', { willReadFrequently: true });
    this.lines = svg('svg', { viewBox: `-0.5 -0.5 ${width} ${height}`, 'aria-hidden': 'true' });
    this.names = el('div', { class: 'names' });
    this.absent = el('p', { class: 'absent' });
    this.unplaced = el('p', { class: 'unplaced' });
    const pick = ({ clientX, clientY, currentTarget }) => {
      const { left, top, width: wide } = currentTarget.getBoundingClientRect();
      select(this.nearest((clientX - left) / wide * width, (clientY - top) / wide * width, width / 16));
    };
    const attributes = { class: 'mirror-box', style: `aspect-ratio:${width}/${height}` };
    const box = el('div', { ...attributes, onpointermove: pick, onpointerdown: pick }, this.canvas, this.lines,
      this.names, this.absent);
    this.node = el('div', { class: 'mirror' }, el('h3', {}, `${view} mirror`), box, this.unplaced);
    watchWidth(box, (now) => resized(this.width = now));
  }

  nearest(column, row, most) {
    let found, least = most;
    for (const { name, outline, anchor } of this.marks) {
      for (const [x, y] of outline ?? [anchor]) {
        const distance = Math.hypot(x - column, y - row);
        if (distance < least) [found, least] = [name, distance];
      }
    }
    return found;
  }

  /** @param image what drawImage() takes; undefined: there is none */
  draw(frame, image, selected) {
    if (image) {
      const width = image.naturalWidth ?? image.width, height = image.naturalHeight ?? image.height;
      if (this.canvas.width !== width) Object.assign(this.canvas, { width, height });
      this.context.drawImage(image, 0, 0);
    } else {
      this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    }
    setText(this.absent, image ? '' : 'No image of this frame is here.');
    const marks = this.settings ? landmarksInView(frame, this.view, this.settings.unroll) : [];
    this.marks = marks.filter(({ anchor }) => anchor);
    const others = marks.filter(({ anchor }) => !anchor).map(({ name, verdict }) => `${name} (${verdict})`);
    setText(this.unplaced, others.length ? `Not placed here: ${others.join(', ')}` : '');
    this.drawLines(selected);
    this.drawNames(selected);
  }

  drawLines(selected) {
    const nodes = keyedChildren(this.lines, this.marks.map(({ name }) => name), () =>
      svg('g', {}, ['under', 'over', 'under', 'over'].map((name) => svg('path', { class: name }))));
    this.marks.forEach(({ name, verdict, outline, sighting, ray }, i) => {
      paint(nodes[i], verdictOf(verdict).colour);
      nodes[i].setAttribute('class', `${name === selected ? 'selected' : ''} ${ray ? 'ray' : ''}`);
      const path = outline ? pixelPath(outline) : ray ? pixelPath([this.settings.centre_px, ray]) : '';
      const cross = sighting ? `M${sighting.column_px - 6},${sighting.row_px}h12m-6,-6v12` : '';
      [path, path, cross, cross].forEach((d, j) => nodes[i].children[j].setAttribute('d', d));
    });
  }

  /** Places the names outside of the landmarks' tops, and farther out where another name is in the way. */
  drawNames(selected) {
    const nodes = keyedChildren(this.names, this.marks.map(({ name }) => name), () => el('span', { class: 'name' }));
    if (!this.settings || !this.width) return;
    const { width_px: width, height_px: height, centre_px: [column, row] } = this.settings;
    const pixel = width / this.width, taken = [];
    const clip = (value, whole) => Math.min(Math.max(value, 0.03 * whole), 0.97 * whole);
    this.marks.forEach((mark, i) => {
      const [dx, dy] = [mark.anchor[0] - column, mark.anchor[1] - row];
      let x, y, tries = 0;
      do {
        const part = 1 + (16 + 14 * tries) * pixel / (Math.hypot(dx, dy) || 1);
        [x, y] = [clip(column + dx * part, width), clip(row + dy * part, height)];
      } while (++tries < 6 && taken.some(([u, v]) => Math.abs(u - x) < 64 * pixel && Math.abs(v - y) < 17 * pixel));
      taken.push([x, y]);
      setLabel(nodes[i], mark, selected, this.run.method);
      const share = x / width;  // a name stands beside its place, but at the image's edges inside of it
      const before = share > 0.7 || (share > 0.3 && dx < 0) ? Math.max(share, 0.8) : Math.min(share, 0.2);
      placeLabel(nodes[i], x / pixel, y / pixel, before, 0.5);
    });
  }
}

/** Rows for labels that are `width` wide around places, both in shares of the axis, so that none covers another. */
export function staggeredRows(places, width, most) {
  const ends = new Array(most).fill(-Infinity), rows = [];
  for (const i of places.map((_, j) => j).sort((a, b) => places[a] - places[b])) {
    const free = ends.findIndex((end) => end <= places[i] - width / 2);
    rows[i] = free >= 0 ? free : ends.indexOf(Math.min(...ends));
    ends[rows[i]] = places[i] + width / 2;
  }
  return rows;
}

/** Both panoramas: upper above lower, the names at the measured bearings, one axis for both. */
class Panoramas {
  constructor(run, select, resized) {
    const { width, height } = panoramaSize;
    Object.assign(this, { run, select, tables: {}, pixels: {}, canvases: {} });
    this.marks = el('div', { class: 'pano-marks' });
    for (const view of mirrorViews) {
      this.pixels[view] = new ImageData(width, height);
      const label = `Panorama of the ${view} mirror`;
      this.canvases[view] = el('canvas', { width, height, role: 'img', 'aria-label': label });
    }
    watchWidth(this.marks, (now) => resized(this.width = now));
    const ticks = Object.entries({ 180: 'behind', 135: '', 90: 'left', 45: '', 0: 'ahead', '-45': '', '-90': 'right',
      '-135': '', '-180': 'behind' });
    const axis = ticks.sort(([a], [b]) => b - a).map(([tick, word]) => el('span', { class: word || 'minor',
      style: `left:${50 - tick / 3.6}%` }, degrees(tick * Math.PI / 180, 0), word && el('b', {}, word)));
    const hasNames = run.map?.landmarks?.length > 0;
    this.node = el('div', { class: `panoramas ${hasNames ? 'with-names' : ''}` }, mirrorViews.map((view) =>
      el('div', { class: 'pano' }, this.canvases[view], el('span', { class: 'view-name' }, view))), this.marks,
    el('div', { class: 'pano-axis', 'aria-hidden': 'true' }, axis));
  }

  /** @param mirror a MirrorImage that has drawn its image */
  drawView({ view, settings, canvas, context }) {
    const { width, height } = panoramaSize;
    if (this.tables[view]?.stride !== canvas.width) this.tables[view] = unrollTable(settings, canvas, width, height);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height), { data: to } = this.pixels[view];
    unrollImage(this.tables[view], new Uint32Array(data.buffer), new Uint32Array(to.buffer));
    this.canvases[view].getContext('2d').putImageData(this.pixels[view], 0, 0);
  }

  drawMarks(frame, selected) {
    const known = (frame.ranges ?? []).filter(({ bearing_rad }) => bearing_rad !== undefined);
    const nodes = keyedChildren(this.marks, known.map(({ landmark }) => landmark), (name) =>
      el('span', { class: 'pano-mark', onpointerenter: () => this.select(name) }, el('span', { class: 'name' })));
    const places = known.map(({ bearing_rad }) => bearingShare(bearing_rad));
    const rows = staggeredRows(places, 100 / (this.width || 700), 3);
    known.forEach(({ landmark: name, verdict }, i) => {
      setLabel(nodes[i].firstChild, { name, verdict }, selected, this.run.method);
      paint(nodes[i], verdictOf(verdict).colour).classList.toggle('selected', name === selected);
      nodes[i].style.setProperty('--row', rows[i]);
      placeLabel(nodes[i], places[i] * (this.width || 0), 0, 0, 0);
      placeLabel(nodes[i].firstChild, 0, 0, Number(places[i].toFixed(2)), 0);
    });
  }
}

/** Both mirrors and both panoramas. @param select is called with the landmark under the pointer; resized: draw again */
export class MirrorPanel {
  constructor(run, select, resized) {
    this.mirrors = mirrorViews.map((view) => new MirrorImage(view, run, select, resized));
    this.panoramas = run.views ? new Panoramas(run, select, resized) : undefined;
    const toggle = { class: 'overlays screen-only', 'aria-pressed': 'true' };
    this.toggle = button('Outlines', () => this.toggleOverlays(), toggle);
    this.node = el('div', { class: 'card mirror-card' }, this.toggle,
      el('div', { class: 'mirrors' }, this.mirrors.map(({ node }) => node)), this.panoramas?.node);
  }

  canvasOf(view) { return this.mirrors[mirrorViews.indexOf(view)].canvas; }

  /** Shows or hides all that is drawn over the images. */
  toggleOverlays() { this.toggle.setAttribute('aria-pressed', !this.node.classList.toggle('bare')); }

  draw(frame, images, selected) {
    for (const mirror of this.mirrors) {
      mirror.draw(frame, images[mirror.view], selected);
      this.panoramas?.drawView(mirror);
    }
    this.panoramas?.drawMarks(frame, selected);
  }
}
