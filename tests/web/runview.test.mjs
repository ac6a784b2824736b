// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { ImageStore, imageMessage, streamState } from '../../apps/web/page/live.js';
import { ellipseFactor, plusMinus } from '../../apps/web/page/magnifier.js';
import { landmarksInView, staggeredRows } from '../../apps/web/page/mirrors.js';
import { FrameStore } from '../../apps/web/page/player.js';
import { frameRate, lostImages, thinned } from '../../apps/web/page/runparts.js';
import { hashOfState, stateOfHash } from '../../apps/web/page/view.js';

test('a binary message is read as the telemetry writes it', () => {
  const bytes = new Uint8Array(13);
  new DataView(bytes.buffer).setBigUint64(0, 70_000n, true);
  bytes.set([1, 0, 7, 8, 9], 8);
  const image = imageMessage(bytes.buffer);
  const wanted = { frame: 70_000, view: 'upper', type: 'image/jpeg', bytes: [7, 8, 9] };
  assert.deepEqual({ ...image, bytes: [...image.bytes] }, wanted);
});

test('the oldest images are dropped, with the outlines of their frames', () => {
  const images = new ImageStore(100);
  const frames = Array.from({ length: 5 }, (_, frame) => ({ frame, outlines: [] }));
  for (const frame of frames) {
    for (const view of ['lower', 'upper']) {
      images.put({ frame: frame.frame, view, type: 'image/png', bytes: new Uint8Array(20) });
    }
    images.belongTo(frame);
  }
  assert.equal(images.bytes, 80);
  assert.deepEqual(frames.map(({ outlines }) => outlines !== undefined), [false, false, false, true, true]);
  assert.equal(images.blob(2, 'lower'), undefined);
  assert.equal(images.blob(4, 'upper').size, 20);
  images.put({ frame: 5, view: 'lower', type: 'image/png', bytes: new Uint8Array(500) });
  assert.deepEqual([...images.held.keys()], [5], 'an image that is too large alone is still shown');
});

test('the state of the stream is said in words', () => {
  const words = (state) => streamState(state).join(' ');
  assert.match(words({ connected: true, silent_ms: 10 }), /^good Connected\.$/);
  assert.match(words({ connected: true, silent_ms: 4200 }), /^bad .*4 s ago/);
  assert.match(words({ connected: true }), /no frame yet/);
  assert.match(words({ connected: false, silent_ms: 10 }), /^bad Disconnected/);
  assert.match(words({ connected: false, end: { finished: true } }), /ended/);
  assert.match(words({ connected: true, end: { finished: false, text: 'no camera' } }), /cut off: no camera/);
});

test('an address holds the state of the page, and what is wrong in it is left out', () => {
  for (const state of [{ runs: [3], t_s: 0 }, { runs: [0, 12, 5], t_s: 12.345 }, { runs: [], t_s: 0 }]) {
    assert.deepEqual(stateOfHash(hashOfState(state)), state);
  }
  const frames = new FrameStore();
  for (let i = 0; i < 900; ++i) frames.append({ frame: i, t_s: i / 15 });
  for (const i of [1, 2, 100, 899]) {
    assert.equal(frames.positionAt(stateOfHash(hashOfState({ runs: [0], t_s: frames.timeAt(i) })).t_s), i);
  }
  assert.deepEqual(stateOfHash('#runs=1,x,-2,1,2,3,4,5&t=never'), { runs: [1, 2, 3, 4], t_s: 0 });
});

test('an ellipse is drawn larger by 1, 2 or 5 times a power of ten, and no more than needed', () => {
  assert.equal(ellipseFactor(5, 4), 1);
  assert.equal(ellipseFactor(undefined, 4), 1);
  assert.equal(ellipseFactor(NaN, 4), 1);
  for (const half of [3.9, 1.7, 0.8, 0.43, 0.0123]) {
    const factor = ellipseFactor(half, 4);
    assert.match(String(factor), /^[125]0*$/);
    assert.ok(half * factor >= 4 && half * factor < 4 * 2.5, `${half} ${factor}`);
  }
});

test('a sigma has two digits, and the value as many places', () => {
  assert.equal(plusMinus(1.23456, 0.00078), '1234.56\u00a0mm \u00b1 0.78\u00a0mm');
  assert.equal(plusMinus(1.23456, 0.0456), '1234.6\u00a0mm \u00b1 45.6\u00a0mm');
  assert.equal(plusMinus(1.5, undefined), '1500.0\u00a0mm');
  assert.equal(plusMinus(undefined, undefined), '\u2013');
});

test('labels that would cover each other stand in rows', () => {
  assert.deepEqual(staggeredRows([0.1, 0.15, 0.5, 0.12], 0.1, 3), [0, 2, 0, 1]);
  assert.deepEqual(staggeredRows([], 0.1, 3), []);
});

test('a landmark in a view is at its sighting, else at its outline, else at its bearing, else nowhere', () => {
  const grid = { bearings: 3, radii: 2, pixels_px: [[0, 5], [10, 5], [0, 5], [5, 5], [5, 5], [5, 5]] };
  const row = (landmark, more) => ({ landmark, verdict: 'ok', ...more });
  const frame = {
    ranges: [row('a', { bearing_rad: 0 }), row('b', { bearing_rad: 0 }), row('c', { bearing_rad: 0 }), row('d')],
    sightings: [{ landmark: 'a', view: 'lower', column_px: 1, row_px: 2 },
      { landmark: 'c', view: 'upper', column_px: 8, row_px: 8 }],
    outlines: [{ landmark: 'b', view: 'lower', points_px: [[3, 3], [4, 4], [5, 3]] }],
  };
  const found = landmarksInView(frame, 'lower', grid);
  assert.deepEqual(found.map(({ anchor }) => anchor), [[1, 2], [4, 4], [9.9, 5], null]);
  assert.deepEqual(found.map(({ ray }) => Boolean(ray)), [false, false, true, false]);
  assert.deepEqual(landmarksInView({}, 'lower', grid), []);
});

test('a trail keeps its points as it grows, and always its end', () => {
  assert.deepEqual(thinned(0, 0, 10), [0]);
  assert.deepEqual(thinned(0, 4, 10), [0, 1, 2, 3, 4]);
  const before = thinned(0, 1000, 100), after = thinned(0, 1001, 100);
  assert.deepEqual(after.slice(0, -1), before.slice(0, after.length - 1));
  assert.ok(after.length <= 101);
});

test('rates and lost images count what is here, and say if frames are not', () => {
  const store = new FrameStore();
  for (const lower_lost of [0, 0, 2, 0]) {
    store.append({ frame: store.end, t_s: store.end / 10, lower_lost, upper_lost: 0 });
  }
  assert.ok(Math.abs(frameRate(store, 3) - 10) < 1e-9);
  assert.ok(Number.isNaN(frameRate(store, 0)));
  assert.equal(lostImages(store, 1), '0');
  assert.equal(lostImages(store, 3), '2');
  store.append({ frame: 9, t_s: 0.9, lower_lost: 1, upper_lost: 0 });
  assert.equal(lostImages(store, 4), 'at least 3');
});
