// SPDX-License-Identifier: Apache-2.0
// A point cloud, seen from any side.
import { el, figure, fixed, setText, watchWidth } from './kit.js';

const cloudTall_px = 420;
const cloudColours = 64;
const mostSigma_m = 0.1;
const startView = { turn_rad: -0.6, tilt_rad: 0.7, zoom: 1 };

/**
 * Reads a binary PLY file of little-endian floats, as "twocone scan --clouds" writes it.
 * @returns { count, x, y, z, sigma, frame }: in metres; frame: world or body
 */
export function readCloud(buffer) {
  const head = new TextDecoder('latin1').decode(buffer.slice(0, 1000)), end = head.indexOf('end_header\n') + 11;
  const count = Number(head.match(/element vertex (\d+)/)?.[1] ?? NaN);
  const names = [...head.matchAll(/property float (\w+)/g)].map(([, name]) => name);
  if (end < 11 || !head.startsWith('ply\nformat binary_little_endian') || !(count >= 0)
    || buffer.byteLength < end + 4 * count * names.length) throw new Error('this is no point cloud of twocone');
  const view = new DataView(buffer, end), columns = names.map(() => new Float32Array(count));
  for (let i = 0; i < count; ++i) {
    columns.forEach((column, k) => column[i] = view.getFloat32(4 * (i * names.length + k), true));
  }
  const of = (name) => columns[names.indexOf(name)];
  return { count, x: of('x'), y: of('y'), z: of('z'), sigma: of('range_sigma'), frame: head.match(/(\w+) frame/)?.[1] };
}

/**
 * Returns what turns places into pixels: a parallel view from above and behind, that is turned about the upright axis
 * through `centre` and tilted towards the horizon. The third number grows towards the eye.
 */
export function cloudProjection({ turn_rad, tilt_rad, zoom }, centre, pixels_perM, width, height) {
  const [c, s] = [Math.cos(turn_rad), Math.sin(turn_rad)], [ct, st] = [Math.cos(tilt_rad), Math.sin(tilt_rad)];
  const scale = zoom * pixels_perM;
  return (x, y, z) => {
    const [dx, dy, dz] = [x - centre[0], y - centre[1], z - centre[2]], u = c * dx - s * dy, v = s * dx + c * dy;
    return [width / 2 + scale * u, height / 2 - scale * (v * st + dz * ct), dz * st - v * ct];
  };
}

/** The newest cloud up to the frame that is shown. */
export class CloudView {
  /** @param frames those with a cloud, in rising order; @param load returns a promise of a cloud's ArrayBuffer */
  constructor(frames, load) {
    Object.assign(this, { frames, load, view: { ...startView } });
    this.canvas = el('canvas', { class: 'cloud', tabindex: 0, role: 'application',
      'aria-label': 'Point cloud. Arrow keys turn it, plus and minus zoom, 0 shows it as at first.' });
    this.note = el('span');
    this.node = figure({ title: 'Point cloud' }, this.canvas);
    this.node.querySelector('.save').remove();
    this.node.querySelector('figcaption').append(' ', this.note);
    this.listen();
    watchWidth(this.node, (width) => {
      this.width = width;
      this.draw();
    });
  }

  async show(frame) {
    const wanted = this.frames.filter((each) => each <= frame).at(-1) ?? this.frames[0];
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    try {
      const cloud = readCloud(await this.load(wanted));
      if (wanted !== this.wanted) return;
      this.cloud = cloud;
      this.certain = Uint32Array.from(d3.range(cloud.count).filter((i) => cloud.sigma[i] <= mostSigma_m));
      // Most of what is shown, because a single range that is wrong is far away.
      const most = (values) => {
        const sorted = Float32Array.from(this.certain, (i) => values[i]).sort();
        return [0.02, 0.98].map((share) => sorted[Math.floor(share * (sorted.length - 1))] ?? share);
      };
      Object.assign(this, { across: [most(cloud.x), most(cloud.y)], heights: most(cloud.z) });
      setText(this.note, `Frame ${wanted}, ${cloud.frame} frame, ${this.certain.length} of ${cloud.count} points: `
        + `those with a sigma of ${mostSigma_m} m or less. Colours from ${fixed(this.heights[0], 2)} m (dark) to `
        + `${fixed(this.heights[1], 2)} m over the floor.`);
      this.draw();
    } catch ({ message }) {
      setText(this.note, `The cloud of frame ${wanted} could not be shown: ${message}.`);
    }
  }

  draw() {
    const { canvas, cloud, width, view, heights, across: [x, y] = [] } = this;
    if (!cloud || !width) return;
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [width, cloudTall_px].map((px) => Math.round(px * ratio));
    Object.assign(canvas, { width: w, height: h });
    const context = canvas.getContext('2d'), image = context.createImageData(w, h);
    const wide = Math.max(x[1] - x[0], y[1] - y[0], 1), centre = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2, 0];
    const project = cloudProjection(view, centre, Math.min(w, 1.6 * h) / (1.3 * wide), w, h);
    const pixels = new Uint32Array(image.data.buffer), depths = new Float32Array(w * h).fill(-Infinity);
    const colours = Uint32Array.from({ length: cloudColours }, (_, i) => {
      const { r, g, b } = d3.rgb(d3.interpolateViridis(i / (cloudColours - 1)));
      return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    });
    const size = Math.max(1, Math.round(1.5 * ratio));
    for (const i of this.certain) {
      const [u, v, depth] = project(cloud.x[i], cloud.y[i], cloud.z[i]), left = Math.round(u), top = Math.round(v);
      if (left < 0 || top < 0 || left + size > w || top + size > h) continue;
      const share = (cloud.z[i] - heights[0]) / Math.max(heights[1] - heights[0], 1e-6);
      const colour = colours[Math.min(Math.max(Math.floor(share * cloudColours), 0), cloudColours - 1)];
      for (let row = top; row < top + size; ++row) {
        for (let at = row * w + left; at < row * w + left + size; ++at) {
          if (depths[at] < depth) [pixels[at], depths[at]] = [colour, depth];
        }
      }
    }
    context.putImageData(image, 0, 0);
  }

  turn(turn_rad, tilt_rad) {
    this.view.turn_rad += turn_rad;
    this.view.tilt_rad = Math.min(Math.max(this.view.tilt_rad + tilt_rad, 0.05), Math.PI / 2);
    this.draw();
  }

  zoomBy(factor) {
    this.view.zoom = Math.min(Math.max(this.view.zoom * factor, 0.3), 20);
    this.draw();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener('pointermove', ({ buttons, movementX, movementY }) => {
      if (buttons) this.turn(movementX / 150, movementY / 150);
    });
    // The wheel scrolls the page until the cloud has the focus.
    canvas.addEventListener('wheel', (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY / 400));
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => {
      const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      const factor = { '+': 1.25, '=': 1.25, '-': 0.8 }[event.key];
      if (turn) this.turn(...turn);
      else if (factor) this.zoomBy(factor);
      else if (event.key === '0') Object.assign(this.view, startView), this.draw();
      else return;
      event.preventDefault();
    });
  }
}
