// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { test } from 'node:test';
import { axisDomain, histogram, linePath, markersPath, nearestIndex, readableLimit, runsOf } from '../../apps/web/page/plot.js';
import { boundsOf, ellipseOf, ellipsePoints, gridStep } from '../../apps/web/page/plan.js';

globalThis.d3 = createRequire(import.meta.url)('/usr/share/nodejs/d3/dist/d3.min.js');

test('the readable limit leaves out a few values that are far off', () => {
  const values = Array.from({ length: 199 }, (_, i) => i / 10);
  assert.equal(readableLimit([...values, 1000]), 1.5 * 19.5);  // 196th of 200 values
  assert.equal(readableLimit([...values, 40]), 40);
  assert.equal(readableLimit([-7, 3, NaN, undefined]), 7);
  assert.equal(readableLimit([]), 0);
});

test('axes surround their values', () => {
  assert.deepEqual(axisDomain([2, 4, undefined, NaN], { pad: 0.1 }), [1.8, 4.2]);
  assert.deepEqual(axisDomain([2, 4], { zero: true, pad: 0.25 }), [0, 5]);
  assert.deepEqual(axisDomain([2, 4], { min: 1, max: 9 }), [1, 9]);
  assert.deepEqual(axisDomain([], {}), [0, 1]);
  const [low, high] = axisDomain([3, 3], {});
  assert.ok(low < 3 && high > 3);
  const log = axisDomain([0, -1, 1, 100], { scale: 'log', pad: 0 });
  assert.deepEqual(log, [1, 100]);
  assert.ok(axisDomain([], { scale: 'log' })[0] > 0);
});

test('a histogram is a density; values outside count in it', () => {
  assert.deepEqual(histogram([-3, -1, -0.99, 0, 0.5, 0.999, 1, 7], { from: -1, to: 1, bins: 4 }),
    { width: 0.5, x: [-0.75, -0.25, 0.25, 0.75], y: [0.5, 0, 0.25, 0.5] });
  const { y, width } = histogram([0.1, 0.2, 0.7], { from: 0, to: 1, bins: 7 });
  assert.ok(Math.abs(y.reduce((a, b) => a + b) * width - 1) < 1e-12);
  assert.deepEqual(histogram([], { from: 0, to: 1, bins: 2 }).y, [0, 0]);
});

test('runs and nearest numbers', () => {
  assert.deepEqual(runsOf([1, 2, 3, 7, 9, 10]), [[1, 3], [7, 7], [9, 10]]);
  assert.deepEqual(runsOf([0, 2, 4, 9], 2), [[0, 4], [9, 9]]);
  assert.deepEqual(runsOf([]), []);
  assert.equal(nearestIndex([1, 4, 9], 6), 1);
  assert.equal(nearestIndex([1, 4, 9], 7), 2);
  assert.equal(nearestIndex([1, 4, 9], -5), 0);
  assert.equal(nearestIndex([], 1), -1);
});

test('a line breaks at missing values, and leaves out points that would cover a pixel again', () => {
  assert.equal(linePath([0, 1, 2, 3], [5, NaN, 7, 8]), 'M0,5M2,7L3,8');
  assert.equal(linePath([0, 10], [5, 7], true), 'M0,5H10V7');
  const many = Array.from({ length: 10_000 }, (_, i) => i / 100);
  const path = linePath(many, many.map((x) => x === 50 ? -99 : 0));
  assert.ok(path.includes('L50,-99'), 'an extreme value stays');
  assert.ok(path.split('L').length < 210);
});

test('markers that would cover each other are drawn once', () => {
  assert.equal(markersPath('plus', [1, 1.2, NaN, 9], [2, 2, 2, 2], 3).split('M').length - 1, 2);
});

test('the ellipse of a covariance', () => {
  // Half axes 0.3 and 0.1 m, the long one turned by 0.7 rad.
  const [a, b, t] = [0.3, 0.1, 0.7];
  const [c, s] = [Math.cos(t), Math.sin(t)];
  const ellipse = ellipseOf({ var_x_m2: (a * c) ** 2 + (b * s) ** 2, var_y_m2: (a * s) ** 2 + (b * c) ** 2, cov_xy_m2: (a * a - b * b) * c * s });
  for (const [found, wanted] of [[ellipse.a, a], [ellipse.b, b], [ellipse.angle_rad, t]]) assert.ok(Math.abs(found - wanted) < 1e-12);
  const [x, y] = ellipsePoints([5, 6], ellipse, 2)[0];
  assert.ok(Math.hypot(x - 5 - 2 * a * c, y - 6 - 2 * a * s) < 1e-12);
  assert.equal(ellipseOf({}), undefined);
  assert.equal(ellipseOf({ var_x_m2: 1, var_y_m2: 1, cov_xy_m2: 2 }), undefined);
  assert.equal(ellipseOf({ var_x_m2: -1, var_y_m2: -1, cov_xy_m2: 0 }), undefined);
});

test('grid and bounds of a plan', () => {
  assert.equal(gridStep(100, 55), 1);
  assert.equal(gridStep(300, 55), 0.2);
  assert.equal(gridStep(55, 55), 1);
  assert.deepEqual(boundsOf([[1, 2], [3, NaN], [0, 5]], 0), [0, 2, 1, 5]);
  assert.equal(boundsOf([[undefined, 1]]), undefined);
});
