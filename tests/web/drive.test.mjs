// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import { DriveControl, padCommand, stickCommand } from '../../apps/web/page/drive.js';

const ready = (status = {}) => {
  const sent = [];
  const control = new DriveControl((message) => sent.push(message));
  Object.assign(control, { connected: true, share: 1, status: { manual: true, you: 7, stopped: false, ...status } });
  return { control, sent };
};

test('keys add up, and cancel each other', () => {
  const { control } = ready();
  assert.ok(control.press('W'));
  assert.deepEqual(control.command, { speed: 1, turn: 0 });
  control.press('a');
  assert.deepEqual(control.command, { speed: 1, turn: 1 });
  control.press('ArrowDown');
  assert.deepEqual(control.command, { speed: 0, turn: 1 });
  control.lift('a');
  control.lift('w');
  assert.deepEqual(control.command, { speed: -1, turn: 0 });
  control.press('ArrowDown');
  control.press('s');
  assert.deepEqual(control.command, { speed: -1, turn: 0 }, 'two keys for one thing are no more than one');
  assert.equal(control.press('x'), false);
  control.share = 0.3;
  assert.deepEqual(control.command, { speed: -0.3, turn: 0 });
});

test('pad and stick: up is forward, left turns left, the edge is full speed', () => {
  assert.deepEqual(padCommand(0, -0.5), { speed: 0.5, turn: 0 });
  assert.deepEqual(padCommand(-1, 0), { speed: 0, turn: 1 });
  const far = padCommand(30, -40);
  assert.ok(Math.abs(far.speed - 0.8) < 1e-12 && Math.abs(far.turn + 0.6) < 1e-12);
  assert.deepEqual(stickCommand(0.1, -0.1), { speed: 0, turn: 0 });
  assert.deepEqual(stickCommand(NaN, 0), { speed: 0, turn: 0 });
  assert.ok(Math.abs(stickCommand(0, -1).speed - 1) < 1e-12);
  assert.ok(stickCommand(0, -0.2).speed < 0.1);
});

test('commands are sent while the hand is on the wheel, then one release', () => {
  const { control, sent } = ready();
  control.beat();
  assert.deepEqual(sent, []);
  control.press('w');
  control.beat();
  control.beat();
  control.lift('w');
  control.beat();
  control.beat();
  assert.deepEqual(sent.map((message) => message.type), ['drive', 'drive', 'release']);
});

test('drive mode holds the wheel at zero; the stick counts only in it', () => {
  const { control, sent } = ready();
  control.stick = { speed: 1, turn: 0 };
  control.beat();
  assert.deepEqual(sent, [], 'a gamepad that lies on the table drives nothing');
  control.mode = true;
  control.beat();
  control.stick = null;
  control.beat();
  assert.deepEqual(sent, [{ type: 'drive', speed: 1, turn: 0 }, { type: 'drive', speed: 0, turn: 0 }]);
});

test('nothing but manual is driven, and only by one', () => {
  for (const status of [{ manual: false }, { driver: 8 }, { stopped: true }]) {
    const { control, sent } = ready(status);
    control.press('w');
    control.mode = true;
    control.pad = padCommand(0, -1);
    control.beat();
    assert.deepEqual(sent, []);
    assert.equal(control.engaged, false, 'what was held is forgotten');
  }
  assert.equal(ready({ driver: 8 }).control.driver, 'another');
  assert.equal(ready({ driver: 7 }).control.driver, 'you');
  assert.equal(ready().control.driver, 'nobody');
});

test('when another browser takes over, held keys do not take it back', () => {
  const { control, sent } = ready();
  control.press('w');
  control.beat();
  control.status = { ...control.status, driver: 8 };
  control.beat();
  control.status = { ...control.status, driver: undefined };
  control.beat();
  assert.deepEqual(sent.map((message) => message.type), ['drive', 'release']);
});

test('letting go releases at once, and held keys are forgotten', () => {
  const { control, sent } = ready();
  control.press('w');
  control.mode = true;
  control.beat();
  control.letGo();
  control.beat();
  assert.deepEqual(sent.map((message) => message.type), ['drive', 'release']);
});

test('stop works for every watcher, and the wheels stay still after go', () => {
  const { control, sent } = ready({ driver: 8, manual: false });
  control.stop();
  control.go();
  assert.deepEqual(sent, [{ type: 'stop' }, { type: 'go' }]);
  const other = ready();
  other.control.press('w');
  other.control.beat();
  other.control.stop();
  other.control.go();
  other.control.beat();
  assert.deepEqual(other.sent.map((message) => message.type), ['drive', 'release', 'stop', 'go']);
});

test('nothing is sent without a connection', () => {
  const { control, sent } = ready();
  control.press('w');
  control.beat();
  control.connected = false;
  control.beat();
  control.stop();
  control.go();
  assert.deepEqual(sent.map((message) => message.type), ['drive']);
});

test('a key that is held through a stop does not drive after it', () => {
  const { control, sent } = ready();
  control.press('w');
  control.beat();
  control.stop();
  control.press('w', true);
  control.status = { ...control.status, stopped: false };
  control.press('w', true);
  control.beat();
  assert.deepEqual(sent.map((message) => message.type), ['drive', 'release', 'stop']);
  control.lift('w');
  control.press('w');
  control.beat();
  assert.equal(sent.at(-1).type, 'drive');
});
