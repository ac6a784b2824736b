// SPDX-License-Identifier: Apache-2.0
// Uses every control of the live page while a robot drives, and compares the page's numbers with the run's tables.
//   node controls.mjs SCRATCH chromium|firefox
import { mkdirSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { resolve } from 'node:path';
import { row, sleep, until } from './kit.mjs';
import { hasRows, startRun, streamOf, table } from './robot.mjs';
import { openStream } from './stream.mjs';
import { User, button, floor, isFree, isPaused, isStopped, moved, node, ticks } from './user.mjs';

const [scratch, browser] = process.argv.slice(2);
const saved = resolve(scratch, 'saved');
const faults = [], errors = [];
let user, page, uses = 0, compared = 0;
const use = (...given) => user.use(...given);

async function usePlayer() {
  const pressed = (name, value) => `${button(name)}.ariaPressed === "${value}"`;
  await use(button('Pause'), isPaused);
  await sleep(500);  // a frame may still be being drawn
  await use(button('One frame back'), 'see.frame() === was - 1');
  await use(button('One frame on'), 'see.frame() === was + 1');
  await use(node('input', 'Frame'), 'see.frame() < was - 5', { act: (slider) => page.drag(slider, [-0.3, 0], [-0.3, 0]) });
  await user.press(node('select', 'Speed'), ['ArrowDown', 'ArrowDown'], 'see.node(".player select").value === "4"');
  await use(button('Play'), 'see.frame() > was + 8');
  await use(button('Pause'), isPaused);
  await user.press(node('select', 'Frames chosen by the verdict of'), 'f', `!${node('select', 'Verdict')}.disabled`);
  await user.press(node('select', 'Verdict'), ['o', 'k'], `${node('select', 'Verdict')}.value === "ok"`);
  await use(button('Previous chosen frame'), moved);
  await use(button('Next chosen frame'), moved);
  await use(button('Live'), `${pressed('Live', true)} && see.frame() > was`);
  await use(button('Pause'), isPaused);
  await use(button('Outlines'), pressed('Outlines', false));
  await use(button('Outlines'), pressed('Outlines', true));
  await use(button('Keys'), 'document.querySelector("dialog").open');
  await use(button('Close'), '!document.querySelector("dialog").open');
}

async function useFigures() {
  const size = 'see.text(".magnifier .filter span")', landmark = 'see.node(".magnifier select").value';
  await user.press(node('select', 'Landmark'), 'b', `${landmark} === "blue"`);
  for (const name of ['More enlarged', 'Less enlarged']) await use(button(name), `${size} !== was`, { before: size });
  for (const k of [0, 1]) {  // landmarks under the pointer
    await use(node('.mirror-box'), `${landmark} === window.wanted`, { act: async (box) => page.point(box, ...await page.call(`
      const [box] = arguments, { left, top, width, height } = box.getBoundingClientRect(), names = box.querySelectorAll('.name');
      const marks = [...box.querySelectorAll('svg g')].map((group, i) => [group.querySelector('.over'), names[i].textContent]);
      const [path, name] = marks.filter(([outline]) => outline.getAttribute('d')?.length > 100)[${k}];
      window.wanted = [...see.node('.magnifier select').options].find(({ value }) => name.includes(value)).value;
      const { x, y } = path.getPointAtLength(path.getTotalLength() / 2).matrixTransform(path.getScreenCTM());
      return [(x - left) / width - 0.5, (y - top) / height - 0.5];`, box)) });
  }
  const point = (control) => page.point(control);
  await use(node('.pano-mark .name', undefined, 1), '!!see.node(".pano-mark.selected")', { act: point });
  await use(node('tr th', undefined, 2), '!!see.node("tr.selected")', { act: point });

  const changes = (what, act) => [`${what} !== was`, { before: what, act }];
  for (const name of ['Zoom in', 'Show the whole plan', 'Zoom out', 'Show the whole plan']) await use(button(name), ...changes(floor));
  await use(node('.plan [role=application]'), ...changes(floor, (plan) => page.drag(plan, [0, 0], [0.1, 0.1])));
  for (const area of ['.plan', '.plot']) {
    for (let k = 0; k < 2 * await page.value(`document.querySelectorAll('${area} .legend button').length`); ++k) {
      const entry = node(`${area} .legend button`, undefined, k >> 1);
      await use(entry, `${entry}.ariaPressed === "${k % 2 === 1}"`);
    }
  }
  const chart = node('.plot .surface'), strip = node('.strip canvas');
  await use(chart, ...changes(ticks, (control) => page.drag(control, [-0.3, 0], [0.1, 0])));
  await user.press(chart, 'Escape', ...changes(ticks));
  await use(chart, moved, { act: (control) => page.drag(control, [-0.2, 0], [-0.2, 0]) });
  await use(strip, moved, { act: (control) => page.drag(control, [0.1, 0], [0.1, 0]) });
  for (const [area, control] of [['.strip', strip], ['.plot', chart]]) {
    await use(control, `!!see.node("${area} .readout")`, { act: (at) => page.point(at, 0.1) });
    await sleep(1500);
    if (!await page.value(`see.node("${area} .readout")`)) user.faults.push(`${area}: values vanish while frames arrive`);
  }
  for (const [kind, begin] of [['SVG', '<svg'], ['PNG', '\x89PNG']]) {
    for (const k of [0, 1]) {
      const before = readdirSync(saved);
      await use(button(`Save ${kind}`, k), 'true');
      const file = await until(() => readdirSync(saved).find((name) => !before.includes(name) && name.endsWith(kind.toLowerCase())), 8000);
      if (!file || !readFileSync(`${saved}/${file}`, 'latin1').startsWith(begin)) user.faults.push(`Save ${kind} ${k}: no file`);
    }
  }
  for (const scheme of ['dark', 'light']) await use(node('.scheme'), `document.documentElement.dataset.scheme === "${scheme}"`);
}

async function useDriving(url) {
  const command = 'see.text(".drive > div > p:last-child")', pad = node('.pad'), who = 'see.text(".drive-state")';
  const stands = '/^[−-]?0\\.00/.test([...document.querySelectorAll(".gauges .tile")].at(-1).textContent)';
  await user.press(node('.drive input'), 'ArrowRight', 'see.text(".drive output") === "60 %"');
  for (const pointerType of ['mouse', 'touch']) {
    await use(pad, `${command}.includes("turn 36 %")`, { act: (control) => page.hold(control, -0.3, 0, pointerType) });
    await page.release();
    if (!await page.holds(`${command} === "speed 0 %, turn 0 %"`)) user.faults.push(`${pointerType} has left the pad, but it drives`);
  }
  for (const [key, words, turns] of [['w', 'speed 60 %'], ['ArrowLeft', 'turn 60 %', true], ['d', 'turn −60 %', true], ['s', 'speed −60 %']]) {
    await use(button('Drive'), `${button('Drive')}.ariaPressed === "true"`);
    await use(pad, `${command}.includes("${words}") && ${stands} === ${Boolean(turns)}`, { act: () => page.down(key) });
    await page.release();
    await use(button('Drive'), `${stands} && ${who} === "Nobody drives."`);
  }
  await use(button('Drive'), `${who} === "You drive."`);
  await page.value('window.axes = [0, -1]');
  await use(pad, `${command} === "speed 60 %, turn 0 %"`, { act: () => {} });  // a gamepad's stick
  await page.value('window.axes = null');

  let refused;
  const other = openStream(streamOf(url), { text: (line) => refused ??= line.type === 'refused' ? line.text : undefined });
  await other.opened;
  const sends = (type) => ({ act: () => other.send({ type, speed: 1, turn: 0 }) });
  await use(node('.rates'), 'see.text(".rates").includes("2 watchers")', sends('drive'));
  if (!await until(() => refused)) user.faults.push('a second browser may drive too');
  await use(pad, isStopped, { act: () => page.press('Escape') });
  await use(button('Go'), isFree);
  await use(button('STOP'), `${isStopped} && ${stands} && ${button('Drive')}.disabled`);
  await use(button('Go'), isFree);
  await use(node('.stop'), isStopped, sends('stop'));
  await use(button('Go'), isFree);
  other.socket.destroy();
}

/** Compares a text of the page with numbers of the tables, to the digits that it shows. */
function compare(where, text, ...wanted) {
  const shown = [...text.replaceAll('\u2212', '-').matchAll(/-?\d+(?:\.(\d+))?/g)];
  const numbers = wanted.filter(Number.isFinite);
  const isEqual = ([number, digits = ''], i) => Math.abs(Number(number) - numbers[i]) <= 0.5001 * 10 ** -digits.length;
  ++compared;
  if (shown.length !== numbers.length || !shown.every(isEqual)) faults.push(`${where}: ${text}, but the tables have ${numbers.join(', ')}`);
}

function compareFrame(folder, { frame, ranges, poses }) {
  const number = (text) => text === '' ? NaN : Number(text), degrees = (text) => 180 / Math.PI * number(text);
  const of = (name) => table(folder, name).filter((line) => Number(line.frame) === frame);
  for (const line of of('ranges.csv')) {
    const shown = ranges.find(({ landmark }) => landmark === line.landmark), where = `frame ${frame}, ${line.landmark}`;
    const [range_mm, sigma_mm, true_mm] = ['range_m', 'sigma_range_m', 'true_range_m'].map((key) => 1000 * number(line[key]));
    if (!shown.verdict.endsWith(line.verdict)) faults.push(`${where}: ${shown.verdict}, but the tables have ${line.verdict}`);
    compare(where, shown.range, range_mm, sigma_mm);
    compare(`${where}, error`, shown.error, range_mm - true_mm);
    compare(`${where}, bearing`, shown.bearing, degrees(line.bearing_rad));
  }
  for (const [name, line] of [['fix', of('fixes.csv')[0]], ['track', of('track.csv')[0]]]) {
    const shown = poses.find(({ pose }) => pose === name), where = `frame ${frame}, ${name}`;
    compare(where, [shown['x / m'], shown['y / m'], shown.heading, shown.sigma].join(' '), number(line.x_m), number(line.y_m),
      degrees(line.heading_rad), 1000 * Math.sqrt(number(line.var_x_m2) + number(line.var_y_m2)));
    if (name === 'fix') compare(`${where}, error`, shown.error, 1000 * number(line.error_m));
    if (!shown.state.includes(line.verdict ?? line.state)) faults.push(`${where}: ${shown.state}, but the tables have another verdict`);
  }
}

const gamepad = 'navigator.getGamepads = () => window.axes ? [{ axes: window.axes }] : [];';
rmSync(saved, { recursive: true, force: true });
mkdirSync(saved, { recursive: true });
for (const behaviour of ['wander', 'manual']) {
  const run = await startRun(`${scratch}/${behaviour}`, '--robot', 'robots/lab_sim.yaml', '--behaviour', behaviour, '--frames', '9000');
  user = await User.open(run.url, { browser, first: gamepad, downloads: saved });
  page = user.page;
  const shown = [];
  if (behaviour === 'wander') {
    await page.holds('see.frame() > 150', 30_000);
    await page.screenshot(`${scratch}/viewer-live.png`);
    await usePlayer();
    await useFigures();
    await use(button('STOP'), isStopped);
    await use(button('Go'), isFree);
    for (let k = 0; k < 6; ++k) {
      await page.press('End', ...Array(k).fill('ArrowLeft'));
      await sleep(600);
      shown.push(await page.value('({ frame: see.frame(), ranges: see.rows("Ranges of this frame"), poses: see.rows("Poses of this frame") })'));
    }
    await user.checkAllUsed('#main');
    await page.size(400, 800);
    await sleep(1500);
    await page.screenshot(`${scratch}/viewer-phone.png`);
    await hasRows(run.folder, 'frames.csv', Math.max(...shown.map(({ frame }) => frame)) + 1);
  } else {
    await useDriving(run.url);
    await user.checkAllUsed('.drive');
  }
  errors.push(...await page.errors());
  await run.stop();
  if (!await page.holds('see.text(".state").startsWith("The run ")')) faults.push('the page does not say that the run has ended');
  shown.forEach((each) => compareFrame(run.folder, each));
  await page.close();
  uses += user.uses;
  faults.push(...user.faults);
}

row(`every control of the live page used in ${page.name} while a robot drives, each with its effect`, `${uses} uses, ${faults.length} faults`,
  'no fault', faults.length === 0);
row('errors in its console', `${errors.length}`, '0', errors.length === 0);
row('its numbers of frames that were paused on, ranges, fix and track, against the run\'s tables', `${compared} cells compared`,
  'equal to the digits shown', compared >= 60 && !faults.some((fault) => fault.includes('but the tables have')));
for (const line of [...faults, ...errors]) console.log(line);
process.exit();
