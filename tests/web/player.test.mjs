// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { ChunkedStore, FrameStore, Player, digest, positionSigma } from '../../apps/web/page/player.js';

const rate_hz = 15;
const frameAt = (i, more = {}) => ({ type: 'frame', frame: i, t_s: i / rate_hz, ...more });
const withVerdict = (i, verdict) => frameAt(i, { ranges: [{ landmark: 'red', verdict }] });
const filled = (count, make = frameAt) => {
  const store = new FrameStore({ rate_hz });
  for (let i = 0; i < count; ++i) store.append(make(i));
  return store;
};

test('a digest has what is known and leaves out the rest', () => {
  const whole = digest(frameAt(3, {
    truth: { x_m: 1, y_m: 2 }, track: { x_m: 1.003, y_m: 2.004, var_x_m2: 9e-6, var_y_m2: 16e-6, state: 'tracking' },
    fixes: [{ verdict: 'ok', x_m: 1, y_m: 2, error_m: 0.01 }], ranges: [{ landmark: 'fix', verdict: 'occluded' }],
  }));
  assert.ok(Math.abs(whole.trackError - 0.005) < 1e-12);
  assert.ok(Math.abs(whole.trackSigma - 0.005) < 1e-12);
  assert.equal(whole.fixError, 0.01);
  assert.equal(whole.fixSigma, undefined);
  assert.deepEqual(whole.track, [1.003, 2.004]);
  assert.deepEqual(whole.verdicts, { fix: 'ok', track: 'tracking', 'range:fix': 'occluded' });
  const bare = digest(frameAt(0));
  const { fixError, trackError, trackSigma, track } = bare;
  assert.deepEqual([fixError, trackError, trackSigma, track], [undefined, undefined, undefined, null]);
  assert.deepEqual(bare.verdicts, {});
  assert.equal(positionSigma(undefined), undefined);
});

test('a player of no frames and of one frame stays where it is', () => {
  for (const count of [0, 1]) {
    const player = new Player(filled(count));
    player.play();
    player.tick(5);
    player.step(1);
    player.step(-1);
    player.seekTime(99);
    assert.equal(player.position, 0);
    assert.equal(player.next(1), false);
    assert.equal(player.frame?.frame, count ? 0 : undefined);
  }
});

test('playing follows the frames\' times at every speed, and ends at the last frame', () => {
  for (const speed of [0.25, 1, 8]) {
    const player = new Player(filled(450));
    player.speed = speed;
    player.play();
    for (let i = 0; i < 60; ++i) player.tick(1 / 60);
    assert.ok(Math.abs(player.position - rate_hz * speed) <= 1, `${speed}: ${player.position}`);
    for (let i = 0; i < 200; ++i) player.tick(1);
    assert.equal(player.position, 449);
    assert.equal(player.playing, false);
  }
});

test('times may be uneven: a seek finds the last frame that had begun', () => {
  const times = [0, 0.07, 0.5, 0.51, 2];
  const store = filled(times.length, (i) => ({ ...frameAt(i), t_s: times[i] }));
  assert.deepEqual([-1, 0, 0.06, 0.07, 0.505, 1.9, 2, 9].map((t) => store.positionAt(t)), [0, 0, 0, 1, 2, 3, 4, 4]);
});

test('steps, seeks and speeds stay within their ends', () => {
  const player = new Player(filled(10));
  let changes = 0;
  player.listeners.push(() => ++changes);
  player.step(-3);
  assert.equal(player.position, 0);
  player.seek(1e9);
  assert.equal(player.position, 9);
  player.step(-1);
  assert.equal(player.position, 8);
  for (let i = 0; i < 9; ++i) player.faster(1);
  assert.equal(player.speed, 8);
  for (let i = 0; i < 9; ++i) player.faster(-1);
  assert.equal(player.speed, 0.25);
  assert.ok(changes >= 4);
  player.seek(9);
  player.play();
  assert.equal(player.position, 0, 'play at the end begins again');
});

test('frames are chosen by verdict', () => {
  const player = new Player(filled(20, (i) => withVerdict(i, i === 4 || i === 11 ? 'occluded' : 'ok')));
  assert.equal(player.next(1), false, 'nothing is chosen yet');
  player.choose({ who: 'range:red', verdict: 'occluded' });
  assert.deepEqual([player.next(1), player.position], [true, 4]);
  assert.deepEqual([player.next(1), player.position], [true, 11]);
  assert.deepEqual([player.next(1), player.position], [false, 11]);
  assert.deepEqual([player.next(-1), player.position], [true, 4]);
  assert.equal(player.store.counts.get('range:red').get('occluded'), 2);
});

test('a live store drops its oldest frames, and their verdicts with them', () => {
  const store = new FrameStore({ rate_hz, most: 100 });
  for (let i = 0; i < 250; ++i) store.append(withVerdict(i, i < 200 ? 'occluded' : 'ok'));
  assert.deepEqual([store.begin, store.end, store.frames.size, store.digests.size], [150, 250, 100, 100]);
  assert.deepEqual([...store.counts.get('range:red')], [['occluded', 50], ['ok', 50]]);
  assert.equal(store.at(149), undefined);
  assert.equal(store.positionAt(0), 150);
});

test('a paused live view stays while frames arrive, and "live" jumps back', () => {
  const store = new FrameStore({ rate_hz, most: 30 });
  const player = new Player(store, { live: true });
  const arrive = (i) => {
    store.append(frameAt(i));
    player.grown();
  };
  for (let i = 0; i < 20; ++i) arrive(i);
  assert.equal(player.frame.frame, 19);
  player.pause();
  for (let i = 20; i < 25; ++i) arrive(i);
  assert.equal(player.frame.frame, 19);
  for (let i = 25; i < 60; ++i) arrive(i);
  assert.equal(player.frame.frame, 30, 'its frame was dropped, so the oldest is shown');
  player.goLive();
  arrive(60);
  assert.equal(player.frame.frame, 60);
  player.seek(40);
  assert.equal(player.following, false);
  player.play();
  for (let i = 0; i < 100; ++i) player.tick(1 / 15);
  assert.equal(player.following, true, 'a view that plays up to the newest frame follows again');
});

test('chunks are loaded when they are needed, and only some are held', async () => {
  const asked = [];
  const load = async (from, count) => {
    asked.push(from);
    return Array.from({ length: Math.min(count, 95 - from) }, (_, i) => withVerdict(from + i, 'ok'));
  };
  const store = new ChunkedStore(load, { count: 95, rate_hz, chunk: 10, held: 3 });
  const player = new Player(store);
  const settled = () => new Promise((done) => setTimeout(done, 0));
  player.seek(52);
  assert.equal(player.frame, undefined);
  await settled();
  assert.equal(player.frame.frame, 52);
  assert.deepEqual(asked, [50]);
  player.seek(58);
  await settled();
  assert.deepEqual(asked, [50, 60], 'the next chunk is loaded before it is reached');
  await store.fetchDigests();
  assert.equal(store.digests.size, 95);
  assert.equal(store.frames.size, 20, 'only the chunks that were needed are held');
  assert.equal(player.frame.frame, 58);
  assert.equal(new Set(asked).size, asked.length);
  for (const position of [5, 15, 25, 35]) {
    player.seek(position);
    await settled();
  }
  assert.ok(store.frames.size <= 30);
  assert.equal(player.frame.frame, 35);
  assert.equal(store.counts.get('range:red').get('ok'), 95, 'a frame that is loaded again is not counted again');
});

test('a chunk that fails is asked for again when it is needed again', async () => {
  let fails = true;
  const load = async () => {
    if (fails) throw new Error('no answer');
    return [frameAt(0), frameAt(1)];
  };
  const player = new Player(new ChunkedStore(load, { count: 2, rate_hz }));
  player.seek(1);
  await new Promise((done) => setTimeout(done, 0));
  assert.equal(player.frame, undefined);
  fails = false;
  player.seek(1);
  await new Promise((done) => setTimeout(done, 0));
  assert.equal(player.frame.frame, 1);
});
