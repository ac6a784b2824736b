// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { chanceText, compareHeadline, otherSources, plainNumber, residualSeries, shareText, shortName, sourcesByShare, toPrecisionOf, withSigma }
  from '../../apps/web/page/compare.js';

const noise = { name: 'upper noise', kind: 'noise', where: 'upper', verdict: 'differs', shares: [{ of: 'range', share: 0.12 }],
  components: [{ name: 'upper.noise_grey', unit: 'grey', difference: 3.5, sigma: 0.05 }] };
const rim = { name: 'lower focal length', kind: 'focal length', where: 'lower', verdict: 'differs',
  shares: [{ of: 'odometry', share: -0.02 }, { of: 'range', share: 0.71 }],
  components: [{ name: 'lower.rim_radius_px', unit: 'px', difference: 2, sigma: 0.1 }] };
const agrees = { name: 'slip', verdict: 'agrees', shares: [], components: [] };
const unknown = { name: 'tilt', verdict: 'cannot tell', shares: [], components: [] };

test('numbers are rounded to the sigma', () => {
  assert.equal(withSigma(-0.01234, 0.00056), '\u22120.0123\u00a0\u00b1\u00a00.0006');
  assert.equal(withSigma(1234.5, 56), '+1235\u00a0\u00b1\u00a056');
  assert.equal(withSigma(2, 0.1), '+2.00\u00a0\u00b1\u00a00.10', 'one digit of 0.1 would be coarse');
  assert.equal(withSigma(2, 0), '+2', 'no sigma is stated');
  assert.equal(withSigma(null, 1), '\u2013');
  assert.equal(toPrecisionOf(null, 3.14159), '3.142');
  assert.equal(plainNumber(123456.7), '123457');
  assert.equal(plainNumber(null), '\u2013');
});

test('shares and p-values', () => {
  assert.equal(shareText(-0.034), '\u22123\u00a0%');
  assert.equal(shareText(0.004), '<\u00a01\u00a0%');
  assert.equal(shareText(null), '\u2013');
  assert.equal(chanceText(0), '<\u00a01e\u221299');
  assert.equal(chanceText(0.0041), '0.0041');
});

test('short names leave out units and the words of the source', () => {
  const centre = { kind: 'centre', where: 'upper' };
  assert.equal(shortName(centre, { name: 'upper.centre_px.column', unit: 'px' }), 'column');
  assert.equal(shortName(centre, { name: 'upper.centre_pixels', unit: 'px' }), 'pixels');
  assert.equal(shortName(rim, rim.components[0]), 'rim radius');
});

test('the headline names the differences, the largest share first, with number, sigma and unit', () => {
  const sources = [noise, agrees, rim, unknown];
  assert.deepEqual(sourcesByShare(sources), [rim, noise]);
  assert.equal(compareHeadline({ sources }), 'Differs: lower focal length (rim radius +2.00\u00a0\u00b1\u00a00.10\u00a0px), '
    + 'upper noise (+3.50\u00a0\u00b1\u00a00.05\u00a0grey).');
  assert.equal(otherSources({ sources }), '1 other source tested without a difference; 1 cannot be determined from these data.');
  assert.equal(compareHeadline({ sources: [agrees] }), 'No difference found.');
  assert.equal(otherSources({ sources: [agrees, agrees] }), '2 sources tested.');
  assert.equal(compareHeadline({ sources: [unknown] }), 'No source of a difference could be tested.', 'no test is not the same as no difference');
  assert.equal(otherSources({ sources: [] }), '');
});

test('residuals: a series for each landmark, without missing numbers', () => {
  const points = { landmark: [1, 0, 1, 77], t_s: [0, 0, 1, 1], range_m: [1, null, 2, 3], before_m: [0.001, 0.002, null, 0.004] };
  const landmarks = [{ name: 'a', rgb: [1, 2, 3] }, { name: 'b', bands: 2 }];
  const series = residualSeries(points, landmarks, 't_s', 'before_m');
  assert.deepEqual(series.map(({ name, x, y }) => [name, x, y]), [['a', [0], [2]], ['b', [0], [1]], ['landmark 77', [1], [4]]]);
  assert.notEqual(series[0].shape, series[1].shape, 'colour is not the only sign');
  assert.deepEqual(residualSeries(points, landmarks, 'range_m', 'before_m').map(({ name }) => name), ['b', 'landmark 77']);
});
