// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { bearingShare, unrollImage, unrollPlace, unrollTable } from '../../apps/web/page/unroll.js';

// A mirror whose bearing 0 points along the columns, as the telemetry writes its grid.
const bearings = 73, radii = 13, centre = [31.3, 22.7], rim = 21;
const pixelOf = (bearing, radius) => [centre[0] + radius * Math.cos(bearing), centre[1] + radius * Math.sin(bearing)];
const view = { width_px: 64, height_px: 48, unroll: { bearings, radii, pixels_px: [] } };
for (let i = 0; i < radii; ++i) {
  for (let j = 0; j < bearings; ++j) {
    view.unroll.pixels_px.push(pixelOf(Math.PI - 2 * Math.PI * j / (bearings - 1), rim * (1 - i / (radii - 1))));
  }
}
// Between the bearings of the grid a place lies on the chord in place of the arc.
const chord_px = rim * (1 - Math.cos(Math.PI / (bearings - 1)));

test('a bearing is found at its column: left is first, ahead in the middle', () => {
  assert.deepEqual([Math.PI, Math.PI / 2, 0, -Math.PI].map(bearingShare), [0, 0.25, 0.5, 1]);
});

test('places between the grid are those of the mirror', () => {
  for (const bearing of [3.1, 1.234, 0, -0.777, -3.1]) {
    for (const radius of [21, 13.3, 4.1, 0]) {
      const found = unrollPlace(view.unroll, bearingShare(bearing), 1 - radius / rim);
      const true_px = pixelOf(bearing, radius);
      assert.ok(Math.hypot(found[0] - true_px[0], found[1] - true_px[1]) <= chord_px + 1e-9, `${bearing} ${radius}`);
    }
  }
});

test('what the lens does not show is null, next to it too', () => {
  const pixels_px = view.unroll.pixels_px.slice();
  pixels_px[5] = null;
  const grid = { ...view.unroll, pixels_px };
  assert.equal(unrollPlace(grid, 5 / (bearings - 1), 0), null);
  assert.equal(unrollPlace(grid, 5.5 / (bearings - 1), 0.01), null);
  assert.notEqual(unrollPlace(grid, 6 / (bearings - 1), 0), null);
});

test('interpolation equals the slow formula in all four bytes, to their rounding', () => {
  const image = { width: 64, height: 48 };
  let seed = 12345;
  const next = () => (seed = (seed * 1103515245 + 12345) % 2147483648) % 256;
  const bytes = Uint8Array.from({ length: 64 * 48 * 4 }, next);
  const width = 90, height = 20;
  const table = unrollTable(view, image, width, height);
  const to = new Uint32Array(width * height);
  unrollImage(table, new Uint32Array(bytes.buffer), to);
  const out = new Uint8Array(to.buffer);
  for (let i = 0; i < width * height; ++i) {
    assert.ok(table.index[i] >= 0);
    const x = table.right[i] / 256, y = table.down[i] / 256;
    for (let byte = 0; byte < 4; ++byte) {
      const value = (dx, dy) => bytes[(table.index[i] + dx + dy * 64) * 4 + byte];
      const slow = (1 - y) * ((1 - x) * value(0, 0) + x * value(1, 0)) + y * ((1 - x) * value(0, 1) + x * value(1, 1));
      // Each of the two interpolations rounds down to a whole number.
      assert.ok(slow - out[i * 4 + byte] > -1e-9 && slow - out[i * 4 + byte] < 2, `${i} ${byte}`);
    }
  }
});

test('a smaller copy of the image gives the same places, in its own pixels', () => {
  const whole = unrollTable(view, { width: 64, height: 48 }, 30, 10);
  const half = unrollTable(view, { width: 32, height: 24 }, 30, 10);
  for (let i = 0; i < 300; ++i) {
    const x = whole.index[i] % 64 + whole.right[i] / 256, x_half = half.index[i] % 32 + half.right[i] / 256;
    // Both are rounded to 1/256 px; at the image's edge the place is moved into it.
    if (x_half > 0 && x_half < 31) assert.ok(Math.abs((x + 0.5) / 2 - 0.5 - x_half) < 0.01);
  }
});
