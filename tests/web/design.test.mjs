// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { designHeadline, scaleRange, viewLimits } from '../../apps/web/page/design.js';
import { sharedRegion } from '../../apps/web/page/report.js';

const view = (lens_height_m) => ({ apex_rad: 1.93, mirror_radius_m: 0.08, lens_to_tip_m: 0.08, lens_height_m,
  lowest_rad: -0.34, highest_rad: 0.12 });

test('what both mirrors show lies between the limits of both views', () => {
  const views = [view(0.2), view(0.5)].map((each) => viewLimits(each, 40)), region = sharedRegion(views, 40);
  assert.ok(region.length >= 3);
  for (const [x, y] of region) {
    assert.ok(y >= -1e-9, 'over the floor');
    for (const { viewpoint: [vx, vy] } of views) {
      const slope = (y - vy) / (x - vx);
      assert.ok(slope >= Math.tan(-0.34) - 1e-9 && slope <= Math.tan(0.12) + 1e-9);
    }
  }
  const far = views.map((each) => ({ ...each, lowest: each.highest, highest: each.lowest }));
  assert.equal(sharedRegion(far, 40).length, 0, 'limits that are exchanged leave nothing');
});

test('a scale leaves out the extremes, and has a width', () => {
  const [low, high] = scaleRange([...Array(100).keys(), null, undefined]);
  assert.ok(low >= 1 && low <= 3 && high >= 96 && high <= 98);
  assert.deepEqual(scaleRange([]), [0, 1]);
  const [from, to] = scaleRange([2, 2, 2]);
  assert.ok(from < 2 && to > 2);
});

test('the headline says where ranges begin, and what is not seen', () => {
  const distances = [{ distance_m: 3, least_sigma_m: 0.011, most_sigma_m: 0.0126 }];
  assert.match(designHeadline({ nearest_m: 0.48, floor_from_m: 1.76, distances }), /0\.48 m.*floor from 1\.76 m.*11\.0.*12\.6/);
  assert.match(designHeadline({ nearest_m: 0.9, floor_from_m: null, least_height_m: 0.7, distances: [] }), /nothing lower than 0\.70 m/);
  assert.match(designHeadline({ nearest_m: null, distances: [] }), /ranges nothing/);
});
