// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { cloudProjection, readCloud } from '../../apps/web/page/cloud.js';
import { scanLayers } from '../../apps/web/page/runparts.js';

function cloudOf(rows, frame = 'world') {
  const head = new TextEncoder().encode(`ply\nformat binary_little_endian 1.0\ncomment twocone, metres, ${frame} frame, `
    + `z up\nelement vertex ${rows.length}\nproperty float x\nproperty float y\nproperty float z\n`
    + 'property float range_sigma\nend_header\n');
  const bytes = new Uint8Array(head.length + 16 * rows.length), view = new DataView(bytes.buffer, head.length);
  bytes.set(head);
  rows.flat().forEach((value, i) => view.setFloat32(4 * i, value, true));
  return bytes.buffer;
}

test('a point cloud is read as "twocone scan" writes it', () => {
  const cloud = readCloud(cloudOf([[1, 2, 0.5, 0.25], [-3, 4, 0, 0.125]]));
  assert.equal(cloud.count, 2);
  assert.equal(cloud.frame, 'world');
  assert.deepEqual([cloud.x, cloud.y, cloud.z, cloud.sigma].map((values) => [...values]),
    [[1, -3], [2, 4], [0.5, 0], [0.25, 0.125]]);
  assert.equal(readCloud(cloudOf([], 'body')).frame, 'body');
  assert.throws(() => readCloud(cloudOf([[1, 2, 3, 4]]).slice(0, -1)), /no point cloud/);
  assert.throws(() => readCloud(new TextEncoder().encode('<html>').buffer), /no point cloud/);
});

test('a cloud is seen from above when it is tilted by a right angle, and nearer points have more depth', () => {
  const top = cloudProjection({ turn_rad: 0, tilt_rad: Math.PI / 2, zoom: 2 }, [1, 1, 0], 10, 200, 100);
  const near = (a, b) => a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) < 1e-9, `${a} is not ${b}`));
  near(top(1, 1, 0), [100, 50, 0]);
  near(top(2, 3, 0.5), [120, 10, 0.5]);
  const level = cloudProjection({ turn_rad: 0, tilt_rad: 0, zoom: 1 }, [0, 0, 0], 10, 200, 100);
  near(level(1, 5, 2), [110, 30, -5]);
  assert.ok(level(0, 1, 0)[2] > level(0, 2, 0)[2]);
});

test('a scan is drawn around the robot, as far as it is free', () => {
  const scan = { ranges_m: [2, null, 1, 3], states: 'ouof' };
  const { areas: [free], points: [things] } = scanLayers(scan, { x_m: 10, y_m: 20, heading_rad: 0 });
  const [c, s] = [Math.cos(Math.PI / 4), Math.sin(Math.PI / 4)];
  const wanted = [[10 - 2 * c, 20 - 2 * s], [10, 20], [10 + c, 20 + s], [10 - 3 * c, 20 + 3 * s]];
  free.points.flat().forEach((value, i) => assert.ok(Math.abs(value - wanted.flat()[i]) < 1e-9));
  assert.deepEqual(things.points, [free.points[0], free.points[2]]);
  assert.deepEqual(scanLayers(undefined, { x_m: 0, y_m: 0, heading_rad: 0 }), { areas: [], points: [] });
  assert.deepEqual(scanLayers(scan, { x_m: 0, y_m: 0 }).areas, [], 'its bearings need a heading');
});
