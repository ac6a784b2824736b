// SPDX-License-Identifier: Apache-2.0
// What the inlining of the modules into one script requires (apps/web/embed.cmake).
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { test } from 'node:test';

const folder = new URL('../../apps/web/page/', import.meta.url);
const modules = readdirSync(folder).filter((name) => name.endsWith('.js'))
  .map((name) => [name, readFileSync(new URL(name, folder), 'utf8')]);

test('no two modules have a top-level name in common', () => {
  const homes = new Map();
  for (const [name, text] of modules) {
    for (const [, found] of text.matchAll(/^(?:export )?(?:async )?(?:function|class|const|let) ([\w$]+)/gm)) {
      assert.ok(!homes.has(found), `${found} is in ${homes.get(found)} and in ${name}`);
      homes.set(found, name);
    }
  }
  assert.ok(homes.size > 50);
});

test('imports are whole lines of existing names, exports are prefixes', () => {
  for (const [name, text] of modules) {
    assert.ok(!/<\/script/i.test(text), name);
    for (const [line] of text.matchAll(/^(?:import|export)\b.*/gm)) {
      assert.match(line, /^import \{ [\w, $]+ \} from '\.\/\w+\.js';$|^export (async )?(function|class|const) /, `${name}: ${line}`);
    }
    for (const [, names, from] of text.matchAll(/^import \{ (.*) \} from '\.\/(\w+\.js)';$/gm)) {
      const home = modules.find(([other]) => other === from)?.[1] ?? '';
      for (const each of names.split(', ')) {
        assert.match(home, new RegExp(`^export (async )?(function|class|const) \\*?${each}\\b`, 'm'), `${name}: ${each} of ${from}`);
      }
    }
  }
});
