// SPDX-License-Identifier: Apache-2.0
// Whether pages can be read and used: stored ones with keys alone, the order and the mark of the focus, contrasts by WCAG 2 (AA)
// in both schemes, what differs by colour alone, and narrow windows.
//   node access.mjs SCRATCH PAGE...       files of stored pages, in addition to a live one
import { basename, resolve } from 'node:path';
import { row, sleep } from './kit.mjs';
import { startRun } from './robot.mjs';
import { User, node } from './user.mjs';

const [scratch, ...files] = process.argv.slice(2);
const faults = [], low = [], alone = [], wide = [];
let user, page, uses = 0, texts = 0, lines = 0;

/** Goes through a page with Tab: every control is reached, and shows that it has the focus. */
async function goThrough(what) {
  const wanted = await page.value('see.controls().map(see.nameOf)'), reached = new Set();
  for (let k = 0; k < wanted.length + 30; ++k) {
    await page.press('Tab');
    const [name, isMarked] = await page.value(`((at) => [see.nameOf(at), at === document.body
      || (at.matches(':focus-visible') && getComputedStyle(at).outlineStyle !== 'none')])(document.activeElement)`);
    if (!isMarked) user.faults.push(`${what}: the focus is not visible on ${name}`);
    reached.add(name);
  }
  user.faults.push(...wanted.filter((name) => !reached.has(name)).map((name) => `${what}: Tab does not reach ${name}`));
}

async function look(what) {
  for (const scheme of ['light', 'dark']) {
    await page.value(`document.documentElement.dataset.scheme === '${scheme}' || see.node('.scheme').click()`);
    await sleep(1200);
    const found = await page.value('see.contrasts()');
    texts += found.texts;
    lines += found.lines;
    low.push(...found.low.map(({ ratio, least, what: words, where }) =>
      `${what}, ${scheme}: ${ratio.toFixed(2)} < ${least}: "${words}" in ${where}`));
  }
  alone.push(...(await page.value('see.colourAlone()')).map((name) => `${what}: only colour distinguishes ${name} from another entry`));
  for (const width of [1200, 400, 360]) {
    await page.size(width, 900);
    await sleep(700);
    const more = await page.value('document.documentElement.scrollWidth - document.documentElement.clientWidth');
    if (more > 0) wide.push(`${what}: ${more} px wider than ${width} px`);
  }
}

async function visit(url, what, useIt) {
  user = await User.open(url);
  page = user.page;
  await sleep(3000);
  await useIt();
  await goThrough(what);
  await look(what);
  await page.close();
  uses += user.uses;
  faults.push(...user.faults);
}

const run = await startRun(`${scratch}/keyboard`, '--robot', 'robots/lab_sim.yaml', '--behaviour', 'manual');
await visit(run.url, 'live', () => {});
await run.stop();
for (const file of files) {
  await visit(`file://${resolve(file)}`, basename(file), async () => {
    const entry = node('.legend button'), use = (...given) => user.press(...given);
    const chart = node('.plot .surface', undefined, 1), drawn = `${chart}.closest("svg").textContent`;  // bars do not zoom
    const reached = { isReached: true, before: drawn };
    await use(node('thead button'), 'Enter', '!!document.querySelector("th[aria-sort]")', reached);
    for (const value of [false, true]) await use(entry, 'Enter', `${entry}.ariaPressed === "${value}"`, reached);
    for (const keys of ['+', 'Escape']) await use(chart, keys, `${drawn} !== was`, reached);
  });
}
row('stored pages with keys alone (sort a table, hide a series, zoom, show all), and Tab through them and the live page',
  `${uses} uses, ${faults.length} faults`, 'no fault; Tab reaches every control, and the focus is visible', faults.length === 0);
row('contrasts in both schemes below those of WCAG AA: 4.5, of large texts and lines 3', `${low.length} of ${texts} texts and ${lines} lines`,
  'none', low.length === 0);
row('entries of a legend that only colour distinguishes', `${alone.length}`, 'none', alone.length === 0);
row('pages that are wider than a window of 1200, 400 or 360 px', `${wide.length}`, 'none', wide.length === 0);
for (const line of new Set([...faults, ...low, ...alone, ...wide])) console.log(line);
process.exit();
