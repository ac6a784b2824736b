// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { byFrequency, contrast, degrees, fixed, millimetres, noValue, parseJsonLines, percent, plural, readableColour, significant, sortRows,
  verdictOf } from '../../apps/web/page/kit.js';

test('a number that is missing is a dash', () => {
  for (const missing of [undefined, null, NaN, Infinity, '3']) {
    for (const text of [fixed(missing), significant(missing), millimetres(missing), degrees(missing), percent(missing, 3)]) {
      assert.equal(text, noValue);
    }
  }
  assert.equal(percent(1, 0), noValue);
});

test('numbers have their digits and units', () => {
  assert.equal(fixed(1.005, 1), '1.0');
  assert.equal(fixed(-0.001, 2), '0.00');
  assert.equal(fixed(-1.25, 1), '\u22121.3');
  assert.equal(millimetres(0.01234, 2), '12.34\u00a0mm');
  assert.equal(degrees(Math.PI / 7, 2), '25.71\u00b0');
  assert.equal(percent(1, 3), '33.3\u00a0%');
  assert.equal(plural(1, 'frame'), '1 frame');
  assert.equal(plural(0, 'frame'), '0 frames');
});

test('significant digits, without zeros that say nothing', () => {
  const cases = [[0, '0'], [1234.5, '1235'], [999.96, '1000'], [0.012345, '0.0123'], [100, '100'], [2.5, '2.5'], [-0.5, '\u22120.5'],
    [0.00001234, '1.23e\u22125'], [123456789, '1.23e8'], [0.2 + 0.1, '0.3']];
  for (const [value, text] of cases) assert.equal(significant(value, value === 1234.5 ? 4 : 3), text);
});

test('rows are sorted by value, and those without one are last both ways', () => {
  const rows = [{ v: 10 }, { v: undefined }, { v: 9 }, { v: NaN }, { v: -1 }];
  const value = (row) => row.v;
  assert.deepEqual(sortRows(rows, value, 1).map(value), [-1, 9, 10, undefined, NaN]);
  assert.deepEqual(sortRows(rows, value, -1).map(value), [10, 9, -1, undefined, NaN]);
  assert.deepEqual(sortRows(rows, value, 0), rows);
  assert.deepEqual(sortRows(['b10', 'b9', 'a'], (text) => text, 1), ['a', 'b9', 'b10']);
});

test('JSON lines: half a last line is left out, any other damage is an error', () => {
  assert.deepEqual(parseJsonLines('{"a":1}\n\n{"a":2}\n'), [{ a: 1 }, { a: 2 }]);
  assert.deepEqual(parseJsonLines('{"a":1}\n{"a":'), [{ a: 1 }]);
  assert.deepEqual(parseJsonLines(''), []);
  assert.throws(() => parseJsonLines('{"a":\n{"a":2}\n'), /line 1/);
});

test('verdicts', () => {
  assert.equal(verdictOf('not_seen', 'paper').meaning, 'nothing of its colour in the lower mirror');
  assert.equal(verdictOf('not_seen', 'outline').meaning, 'nothing of its colour in either mirror');
  assert.deepEqual(verdictOf('constructor', 'outline'), { colour: 'v-other', sign: '?', meaning: '' });
  assert.deepEqual(byFrequency({ weak: 3, ok: 1, gap: 7, none: 0 }), [['ok', 1], ['gap', 7], ['weak', 3]]);
});

test('a landmark\'s own colour is made readable on both grounds', () => {
  for (const ground of [[255, 255, 255], [29, 35, 39]]) {
    for (const rgb of [[250, 240, 30], [10, 10, 30], [255, 255, 255], [0, 0, 0], [200, 30, 30]]) {
      assert.ok(contrast(readableColour(rgb, ground), ground) >= 3, `${rgb} on ${ground}`);
    }
  }
  assert.deepEqual(readableColour([200, 30, 30], [255, 255, 255]), [200, 30, 30]);
  assert.equal(contrast([0, 0, 0], [255, 255, 255]).toFixed(1), '21.0');
});

test('WCAG AA: the colours of both schemes', () => {
  const css = readFileSync(new URL('../../apps/web/page/style.css', import.meta.url), 'utf8');
  const [light, dark] = [css.slice(0, css.indexOf('@media screen')), css.slice(css.indexOf('[data-scheme=dark] {'), css.indexOf('.own'))];
  for (const [scheme, text] of [['light', light], ['dark', dark]]) {
    const colours = Object.fromEntries([...text.matchAll(/--([\w-]+): #(\w{6});/g)].map(([, name, hex]) =>
      [name, [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16))]));
    for (const ground of ['card', 'page']) {
      for (const name of ['ink', 'soft', 'accent', 'good', 'bad']) {
        const found = contrast(colours[name], colours[ground]);
        assert.ok(found >= 4.5, `${scheme}: text ${name} on ${ground}: ${found}`);
      }
    }
    assert.ok(contrast(colours['on-accent'], colours.accent) >= 4.5, scheme);
    for (const name of Object.keys(colours).filter((each) => /^(v-|c\d|truth|fix|odometry|track|bound|paper|edge)/.test(each))) {
      const found = contrast(colours[name], colours.card);
      assert.ok(found >= 3, `${scheme}: line ${name}: ${found}`);
    }
  }
});
