// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { keepLeft, normalisedPositions, normalisedRanges, pathErrors, reportHeadline, reportVerdict, sideView } from
  '../../apps/web/page/report.js';

const paper = { position_mean_mm: 29.97, position_within_mm: 130 };
const summary = (frames, frames_with_fix, position_error) => ({ frames, fix: { frames_with_fix, position_error } });

test('the headline says the result, also when there is none', () => {
  assert.equal(reportHeadline({ summary: summary(0, 0), paper }), 'This run has no frames.');
  assert.equal(reportHeadline({ summary: summary(1, 0), paper }), 'None of 1 frame has a position.');
  assert.match(reportHeadline({ summary: summary(9, 8, null), paper }), /^8 of 9 .* without ground truth/);
  assert.match(reportHeadline({ summary: summary(9, 8, { mean_m: 0.0123 }), paper }), /off by 12\u00a0mm .* 29\.97 mm/);
});

test('the verdict is that of the rule: mean and largest error, and not met without any fix', () => {
  const met = (mean_m, max_m) => reportVerdict({ summary: summary(9, 8, { mean_m, max_m }), paper, has_truth: true }).met;
  assert.equal(met(0.02997, 0.13), true);
  assert.equal(met(0.02998, 0.13), false);
  assert.equal(met(0.02997, 0.1301), false);
  assert.equal(reportVerdict({ summary: summary(9, 0, null), paper, has_truth: true }).met, false);
  const unknown = reportVerdict({ summary: summary(9, 8, null), paper, has_truth: false });
  assert.equal(unknown.met, undefined);
  assert.match(unknown.text, /1 of 9 frames have no position/);
});

test('errors of a path, where both paths have a pose', () => {
  const truth = { x_m: [0, 1, 2, null], y_m: [0, 1, 2, 3] }, path = { x_m: [3, 1, null, 1], y_m: [4, 3, 2, 1] };
  assert.deepEqual(pathErrors(path, truth), [5, 2, undefined, undefined]);
  assert.equal(pathErrors(path, undefined), undefined);
});

test('normalised errors: those of one answer with its own sigmas', () => {
  assert.deepEqual(normalisedRanges([{ range_m: [2.5, 2, null, 1], true_range_m: [2, 2.5, 1, null], sigma_range_m: [0.25, 0.5, 1, 1] },
    { range_m: [1], true_range_m: [2], sigma_range_m: [0] }]), [2, -1]);
  const one = { verdict: 'ok', x_m: 3, y_m: 1, true_x_m: 1, true_y_m: 0, var_x_m2: 4, cov_xy_m2: 1, var_y_m2: 1 };
  const columns = (rows) => Object.fromEntries(Object.keys(one).map((key) => [key, rows.map((row) => row[key])]));
  // The inverse of (4 1; 1 1) is (1 -1; -1 4) / 3, so (2, 1) has (4 - 4 + 4) / 3.
  assert.deepEqual(normalisedPositions(columns([one, { ...one, verdict: 'weak' }, { ...one, x_m: null },
    { ...one, cov_xy_m2: 3 }, { ...one, verdict: 'out_of_bounds' }])), [4 / 3]);
});

test('the side view of a 90 degree cone, and what two half-planes leave', () => {
  const { tip, rim, viewpoint } = sideView({ lens_height_m: 0.25, lens_to_tip_m: 0.12, mirror_radius_m: 0.06, apex_rad: Math.PI / 2 });
  for (const [found, wanted] of [[tip, [0, 0.37]], [rim, [0.06, 0.43]], [viewpoint, [-0.12, 0.37]]]) {
    assert.ok(Math.hypot(found[0] - wanted[0], found[1] - wanted[1]) < 1e-12, `${found}`);
  }
  const square = [[0, 0], [2, 0], [2, 2], [0, 2]];
  assert.deepEqual(keepLeft(square, [0, 1], [2, 1]), [[2, 1], [2, 2], [0, 2], [0, 1]]);
  assert.deepEqual(keepLeft(square, [0, 3], [2, 3]), []);
  assert.deepEqual(keepLeft(square, [0, -1], [2, -1]), square);
});
