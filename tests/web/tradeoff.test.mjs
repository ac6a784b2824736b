// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { axisValues, boundPoints, costPlanes, hasValues, lowestPoints, placeWords, planeMarks, planeRange, settingWords, shortNames, sweepAxes, sweepHeadline }
  from '../../apps/web/page/tradeoff.js';

const usual = { is: '640x480, fine', width_px: 640, height_px: 480, antialias: 1, effects: 'scene', estimator: 'fine', enough_m: null, landmarks: 6, bearings: 1,
  rate_hz: 15, frames: 1, frames_observed: 100, answered: 100, robot_p95_s: 2e-3, robot_p95_low_s: 1e-3, robot_p95_high_s: 3e-3,
  simulation_s: 0.2, simulation_low_s: 0.1, simulation_high_s: 0.3, position_mean_m: 1e-3, position_mean_low_m: 8e-4, position_mean_high_m: null,
  bound_m: 5e-4, robot_frontier: 1, simulation_frontier: 1 };
const fast = { ...usual, width_px: 320, height_px: 240, simulation_s: 0.05, robot_p95_s: 1e-3, position_mean_m: 4e-3, bound_m: 2e-3 };
const slow = { ...usual, estimator: 'adaptive', enough_m: 0.001, antialias: 2, frames: 4, simulation_s: 0.4, position_mean_m: 2e-3, bound_m: 6e-4, simulation_frontier: 0 };
const silent = { ...usual, answered: 0, position_mean_m: null, bound_m: null, robot_frontier: 0, simulation_frontier: 0 };
const data = { settings: [usual, slow, fast, silent], least_answered: 0.9 };

test('marks: by rising cost, in the units of the axes, without those that have no place on logarithmic axes', () => {
  const marks = planeMarks(data, costPlanes.robot);
  assert.deepEqual(marks.map(({ index, x, y }) => [index, x, y]), [[2, 1, 4], [0, 2, 1], [1, 2, 2]]);
  assert.deepEqual(marks[1].ys, [0.8, Infinity], 'an interval without a limit');
  assert.equal(planeMarks({ ...data, settings: [{ ...usual, robot_p95_s: 0 }] }, costPlanes.robot).length, 0);
  assert.deepEqual(planeMarks(data, costPlanes.simulation).map(({ onFrontier }) => onFrontier), [true, true, false]);
});

test('the frontier: of points that others undercut none is left', () => {
  assert.deepEqual(lowestPoints([[3, 1], [1, 5], [2, 5], [2, 3], [4, 2], [1, 6]]), [[1, 5], [2, 3], [3, 1]]);
  assert.deepEqual(boundPoints(data, costPlanes.simulation), [[0.05, 2], [0.2, 0.5]]);
  assert.deepEqual(lowestPoints([]), []);
});

test('axes: every value is inside, also of a single one', () => {
  for (const values of [[0.004, 2, 500], [7]]) {
    const [low, high] = planeRange(values);
    for (const value of values) assert.ok(low < value && value < high);
  }
});

test('filters: all wanted values, and only axes on which settings differ', () => {
  assert.ok(hasValues(usual, {}));
  assert.ok(hasValues(usual, { size: '640 \u00d7 480', rays: '' }), 'an axis without a value allows all');
  assert.ok(!hasValues(usual, { size: '640 \u00d7 480', frames: '4' }));
  assert.deepEqual(axisValues(data.settings), [['size', ['320 \u00d7 240', '640 \u00d7 480']], ['rays', ['\u2013', '+R2']],
    ['estimator', ['adaptive to 1 mm', 'fine']], ['frames', ['1', '4']], ['frontier', ['on a frontier', 'on none']]]);
  for (const [axis, values] of axisValues(data.settings)) {
    for (const value of values) assert.ok(data.settings.some((setting) => sweepAxes[axis](setting) === value));
  }
});

test('a short name has only unusual values', () => {
  const name = shortNames([usual, usual, usual]);
  assert.equal(name({ ...usual, width_px: 320, height_px: 240, antialias: 2, frames: 4 }), '320x240 +R2 fine x4');
  assert.equal(name({ ...usual, effects: 'flat', estimator: 'adaptive', enough_m: 0.0005, landmarks: 4, bearings: 0, rate_hz: 5 }),
    '640x480 flat adaptive 0.5mm 4lm ranges 5Hz');
});

test('words', () => {
  assert.equal(sweepHeadline(data), '4.0 mm take 0.050 s of processor time per frame in simulation, 1.0 mm take 0.20 s: 4 settings, 2 of them on the frontier.');
  assert.equal(sweepHeadline({ settings: [silent] }), 'No setting answers often enough to be on a frontier.');
  const words = settingWords(slow, 0.9);
  assert.equal(words[0], '640x480, fine');
  assert.ok(words.includes('answered: 100 of 100 frames'));
  assert.ok(words.some((line) => line.startsWith('robot: 2.00 (1.00 to 3.00) ms')));
  assert.equal(words.at(-1), 'on the frontier of robot time');
  assert.equal(settingWords(silent, 0.9).at(-1), 'does not answer often enough for a frontier');
  assert.equal(settingWords({ ...usual, robot_frontier: 0, simulation_frontier: 0 }, 0.9).at(-1), 'dominated');
});

test('words find free places and do not cover each other', () => {
  const keep = [[94, 94, 106, 106, 3]], frame = [0, 0, 200, 200];
  const found = Array.from({ length: 5 }, () => placeWords(keep, frame, [100, 100], 30, 13));
  assert.ok(found[0][0] + 30 <= 94, 'the first is left of the mark');
  found.forEach(([left, top], i) => {
    assert.ok(left >= 0 && top >= 0 && left + 30 <= 200 && top + 13 <= 200);
    for (const [l, t] of found.slice(0, i)) assert.ok(Math.abs(l - left) >= 30 || Math.abs(t - top) >= 13);
  });
});
