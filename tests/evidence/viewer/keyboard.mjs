// SPDX-License-Identifier: Apache-2.0
// The pages by the keyboard alone; contrasts by WCAG 2 (AA) in both schemes; what differs by colour alone.
//   node keyboard.mjs SCRATCH REPORT [PAGE...]       REPORT, PAGE: files of stored pages
import { basename, resolve } from 'node:path';
import { Chromium } from './browser.mjs';
import { row, sleep } from './kit.mjs';
import { startRun } from './robot.mjs';
import { seeScript } from './inpage.mjs';

const [scratch, ...files] = process.argv.slice(2);
const faults = [], lows = [], alone = [], wide = [];
let page, uses = 0, looked = { texts: 0, lines: 0 };

const active = 'see.nameOf(document.activeElement)';
/** Goes on with Tab until a control of that name has the focus. */
async function tabTo(name, css = '*') {
  for (let k = 0; k < 400; ++k) {
    await page.press('Tab');
    if (await page.value(`document.activeElement.matches('${css}') && ${name ? `${active} === ${JSON.stringify(name)}` : 'true'}`)) return true;
  }
  faults.push(`Tab does not reach ${name ?? css}`);
  return false;
}
/** Reaches a control and presses keys; `effect` may use `was`, the value of `before`. */
async function use(name, css, keys, effect, before = 'see.frame()') {
  ++uses;
  if (!await tabTo(name, css)) return;
  await page.value(`window.was = (${before})`);
  await page.press(...[keys].flat());
  if (!await page.holds(effect)) faults.push(`${name ?? css}, ${keys}: no effect: ${effect}`);
}

/** Goes once through the whole page with Tab: every control is reached, and the focus is seen on it. */
async function goThrough(what) {
  const wanted = await page.value('see.controls().map(see.nameOf)');
  const reached = new Set();
  for (let k = 0; k < wanted.length + 40; ++k) {
    await page.press('Tab');
    const { name, ring, rest } = await page.value(`(() => {
      const at = document.activeElement, styles = [at, ...at.querySelectorAll(':scope > rect')].map((each) => getComputedStyle(each));
      return { name: see.nameOf(at), rest: at === document.body, ring: at.matches(':focus-visible') && (styles[0].outlineStyle !== 'none' || styles[1]?.stroke !== 'none') };
    })()`);
    if (!rest && !ring) faults.push(`${what}: no mark of the focus on ${name}`);
    reached.add(name);
  }
  faults.push(...new Set(wanted.filter((name) => !reached.has(name)).map((name) => `${what}: Tab does not reach ${name}`)));
}

async function look(what) {
  for (const scheme of ['light', 'dark']) {
    await page.value(`document.documentElement.dataset.scheme !== '${scheme}' && document.querySelector('.scheme').click()`);
    await sleep(1200);
    const { texts, lines, low } = await page.value('see.contrasts()');
    looked = { texts: looked.texts + texts, lines: looked.lines + lines };
    lows.push(...low.map(({ ratio, least, what: text, where }) => `${what}, ${scheme}: ${ratio.toFixed(2)} < ${least}: "${text}" in ${where}`));
  }
  alone.push(...(await page.value('see.colourAlone()')).map((name) => `${what}: ${name} differs from another entry by colour alone`));
  for (const width of [1200, 400, 360]) {
    await page.size(width, 900);
    await sleep(700);
    const over = await page.value('document.documentElement.scrollWidth - document.documentElement.clientWidth');
    if (over > 0) wide.push(`${what}: ${over} px wider than a window of ${width} px`);
  }
  await page.size(1200, 900);
}

const run = await startRun(`${scratch}/keyboard`, '--robot', 'robots/lab_sim.yaml', '--behaviour', 'manual', '--frames', '9000');
page = await Chromium.open({ first: seeScript });
await page.go(run.url);
await page.holds('document.querySelector(".player") && see.frame() > 40', 60_000);
const floor = 'see.node(".plan .floor").outerHTML', ticks = 'see.node(".plot").querySelector("svg > g:nth-child(2)").textContent';
const zoomed = `${ticks} !== was`, size = 'see.text(".magnifier .filter span")';
await use('Skip to the content', 'a', 'Enter', 'document.activeElement.id === "main"');
await use('Dark', 'button', 'Enter', 'document.documentElement.dataset.scheme === "dark"');
await use('Drive', 'button', ' ', 'see.node("button", "Drive").ariaPressed === "true"');
await page.down('ArrowUp');
if (!await page.holds('/speed 50 %/.test(see.text(".drive"))')) faults.push('an arrow key does not drive');
await page.up('ArrowUp');
await use(undefined, '.drive input', 'Escape', 'see.text(".stop") === "Go"');
await use('Go', 'button', 'Enter', 'see.text(".stop") === "STOP"');
await use('STOP', 'button', ' ', 'see.text(".stop") === "Go"');
await use('Go', 'button', 'Enter', 'see.text(".stop") === "STOP"');
await use('Most speed', 'input', 'ArrowLeft', 'see.text(".drive output") === "40 %"');
await use('Outlines', 'button', ' ', 'see.node(".mirror-box .names") === undefined');
await use('The room from above. Plus and minus zoom, arrow keys move, 0 shows everything.', 'svg', ['+', 'ArrowLeft'], `${floor} !== was`, floor);
await page.press('0');
await use('Show the whole plan', 'button', 'Enter', 'true');
await use('Show odometry', '.plan .legend', 'Enter', 'see.node(".legend", "Show odometry").ariaPressed === "false"');
await use('Show sigma of the fix', '.plot .legend', ' ', 'see.node(".legend", "Show sigma of the fix").ariaPressed === "false"');
await use(undefined, '.plot .surface', ['+', '+'], zoomed, ticks);
await page.value(`window.was = ${ticks}`);
await page.press('Escape');
if (!await page.holds(zoomed)) faults.push('Escape does not end the zoom of a chart');
await page.press('Home', 'ArrowRight', 'Enter');
if (!await page.holds('see.frame() < 3')) faults.push('Enter in a chart does not show its frame');
await use('Landmark', 'select', 'ArrowDown', 'see.node(".magnifier select").value !== was', 'see.node(".magnifier select").value');
await use('More enlarged', 'button', 'Enter', `${size} !== was`, size);
await use('Less enlarged', 'button', ' ', `${size} !== was`, size);
await use('Frame', 'input', ['Home', 'ArrowRight'], 'see.frame() === 1');
await use('Play', 'button', 'Enter', 'see.frame() > was + 5');
await use('Pause', 'button', 'Enter', 'see.text(".play") === "Play"');
await use('One frame on', 'button', 'Enter', 'see.frame() === was + 1');
await use('One frame back', 'button', 'Enter', 'see.frame() === was - 1');
await use('Speed', 'select', 'ArrowDown', 'see.node(".player select").value === "2"');
await use('Frames chosen by the verdict of', 'select', 'ArrowDown', '!see.node("select", "Verdict").disabled');
await use('Next chosen frame', 'button', 'Enter', 'see.frame() > was');
await use('Keys', 'button', 'Enter', 'document.querySelector("dialog").open');
await page.press('Escape');
await use('Live', 'button', 'Enter', 'see.node("button", "Live").ariaPressed === "true"');
await use('Pause', 'button', 'Enter', 'see.text(".play") === "Play"');
await goThrough('live');
await look('live');
await run.stop();
await page.close();

for (const file of files) {
  const what = basename(file);
  page = await Chromium.open({ first: seeScript });
  await page.go(`file://${resolve(file)}`);
  await sleep(3000);
  await use(undefined, 'thead button', 'Enter', 'document.querySelector("th[aria-sort]")');
  await use(undefined, '.legend', 'Enter', 'document.activeElement.ariaPressed !== was', 'document.activeElement.ariaPressed');
  await page.press('Enter');
  await goThrough(what);
  await look(what);
  await page.close();
}

row('by the keyboard alone: controls reached with Tab and used, on the live page and the stored ones', `${uses} uses, ${faults.length} faults`, 'every control, the focus always visible', faults.length === 0);
row('contrasts by WCAG AA, in the light and the dark scheme: below 4.5 (texts), 3 (large texts, lines)',
  `${lows.length} of ${looked.texts} texts and ${looked.lines} lines`, 'none', lows.length === 0);
row('entries of one legend that only colour distinguishes', `${alone.length}`, 'none', alone.length === 0);
row('windows of 1200, 400 and 360 px: pages that are wider', `${wide.length}`, 'none', wide.length === 0);
for (const line of new Set([...faults, ...lows, ...alone, ...wide])) console.log(line);
process.exit();
