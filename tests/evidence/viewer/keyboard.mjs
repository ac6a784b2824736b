// SPDX-License-Identifier: Apache-2.0
// The pages by the keyboard alone, contrasts by WCAG 2 (AA) in both schemes, what differs by colour alone, and narrow windows.
//   node keyboard.mjs SCRATCH PAGE...       files of stored pages, in addition to a live one
import { basename, resolve } from 'node:path';
import { row, sleep } from './kit.mjs';
import { startRun } from './robot.mjs';
import { User, button, floor, isFree, isPaused, isStopped, moved, node, ticks } from './user.mjs';

const [scratch, ...files] = process.argv.slice(2);
const faults = [], low = [], alone = [], wide = [];
let user, page, uses = 0, texts = 0, lines = 0;

/** Goes on with Tab to a control, and presses keys there. */
async function use(what, keys, effect, before) {
  await user.use(what, effect, { before, act: async () => {
    for (let k = 0; !await page.value(`document.activeElement === ${what}`); ++k) {
      if (k > 400) throw new Error('Tab does not reach it');
      await page.press('Tab');
    }
    await page.press(...[keys].flat());
  } });
}

async function useLivePage() {
  const pressed = (name, value) => `${button(name)}.ariaPressed === "${value}"`, size = 'see.text(".magnifier .filter span")';
  const chart = node('.plot .surface'), choice = 'see.node(".magnifier select").value', slider = node('input', 'Frame');
  await use('document.querySelector(".skip")', 'Enter', 'document.activeElement.id === "main"');
  await use(node('.scheme'), 'Enter', 'document.documentElement.dataset.scheme === "dark"');
  await use(button('STOP'), ' ', isStopped);
  await use(button('Go'), 'Enter', isFree);
  await use(button('Drive'), ' ', pressed('Drive', true));
  await page.down('ArrowUp');
  if (!await page.holds('see.text(".drive").includes("speed 50 %")')) user.faults.push('an arrow key does not drive');
  await page.release();
  await use(node('.drive input'), 'Escape', isStopped);
  await use(button('Go'), 'Enter', isFree);
  await use(node('.drive input'), 'ArrowLeft', 'see.text(".drive output") === "40 %"');
  for (const value of [false, true]) await use(button('Outlines'), ' ', pressed('Outlines', value));
  for (const keys of [['+', 'ArrowLeft'], '-', '0']) await use(node('.plan [role=application]'), keys, `${floor} !== was`, floor);
  await use(button('Zoom in'), 'Enter', `${floor} !== was`, floor);
  await use(button('Show the whole plan'), 'Enter', `${floor} !== was`, floor);
  for (const area of ['.plan', '.plot']) {
    for (const value of [false, true]) await use(node(`${area} .legend button`), ' ', `${node(`${area} .legend button`)}.ariaPressed === "${value}"`);
  }
  for (const keys of [['+', '+'], 'Escape']) await use(chart, keys, `${ticks} !== was`, ticks);
  await use(chart, ['Home', 'ArrowRight', 'Enter'], `${slider}.value < 4 + Number(${slider}.min)`);
  await use(node('.magnifier select'), 'ArrowDown', `${choice} !== was`, choice);
  await use(button('More enlarged'), 'Enter', `${size} !== was`, size);
  await use(button('Less enlarged'), ' ', `${size} !== was`, size);
  await use(slider, ['Home', 'ArrowRight'], `Number(${slider}.value) === 1 + Number(${slider}.min)`);
  await use(button('Play'), 'Enter', 'see.frame() > was + 5');
  await use(button('Pause'), 'Enter', isPaused);
  await sleep(500);  // a frame may still be being drawn
  await use(button('One frame on'), 'Enter', 'see.frame() === was + 1');
  await use(button('One frame back'), 'Enter', 'see.frame() === was - 1');
  await use(node('select', 'Speed'), 'ArrowDown', 'see.node(".player select").value === "2"');
  await use(node('select', 'Frames chosen by the verdict of'), 'ArrowDown', `!${node('select', 'Verdict')}.disabled`);
  await use(button('Next chosen frame'), 'Enter', moved);
  await use(button('Keys'), 'Enter', 'document.querySelector("dialog").open');
  await page.press('Escape');
  await use(button('Live'), 'Enter', pressed('Live', true));
  const everywhere = { ' ': isPaused, ArrowLeft: moved, ArrowRight: 'see.frame() === was + 1', Home: `${slider}.value === ${slider}.min`,
    ']': moved, '[': moved, End: moved, o: pressed('Outlines', false), l: `${choice} !== "${await page.value(choice)}"`,
    '?': 'document.querySelector("dialog").open' };
  await page.call('document.activeElement.blur();');
  for (const [key, effect] of Object.entries(everywhere)) {
    await user.use('document.body', effect, { act: () => page.press(key) });
    await sleep(300);
  }
  await page.press('Escape');
}

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
    low.push(...found.low.map(({ ratio, least, what: words, where }) => `${what}, ${scheme}: ${ratio.toFixed(2)} < ${least}: "${words}" in ${where}`));
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
await visit(run.url, 'live', useLivePage);
await run.stop();
for (const file of files) {
  await visit(`file://${resolve(file)}`, basename(file), async () => {
    await use(node('thead button'), 'Enter', '!!document.querySelector("th[aria-sort]")');
    for (const value of [false, true]) await use(node('.legend button'), 'Enter', `${node('.legend button')}.ariaPressed === "${value}"`);
    for (const keys of ['+', 'Escape']) await use(node('.plot .surface'), keys, `${ticks} !== was`, ticks);
  });
}
row('by the keyboard alone: controls reached with Tab and used; live page and stored pages', `${uses} uses, ${faults.length} faults`,
  'no fault; the focus is visible on every control', faults.length === 0);
row('contrasts in both schemes below those of WCAG AA: 4.5, of large texts and lines 3', `${low.length} of ${texts} texts and ${lines} lines`,
  'none', low.length === 0);
row('entries of a legend that only colour distinguishes', `${alone.length}`, 'none', alone.length === 0);
row('pages that are wider than a window of 1200, 400 or 360 px', `${wide.length}`, 'none', wide.length === 0);
for (const line of new Set([...faults, ...low, ...alone, ...wide])) console.log(line);
process.exit();
