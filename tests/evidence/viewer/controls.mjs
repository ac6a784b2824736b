// SPDX-License-Identifier: Apache-2.0
// Uses every control of the live page while a robot drives, with a pointer or with keys alone, and compares the page's numbers
// with the run's tables.
//   node controls.mjs SCRATCH chromium|firefox pointer|keys
import { mkdirSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { resolve } from 'node:path';
import { row, sleep, until } from './kit.mjs';
import { hasRows, startRun, streamOf, table } from './robot.mjs';
import { openStream } from './stream.mjs';
import { User, button, floor, node, ticks } from './user.mjs';

const [scratch, browser, tool] = process.argv.slice(2);
const saved = resolve(scratch, 'saved'), byKeys = tool === 'keys';
const faults = [], errors = [];
let user, page, uses = 0, compared = 0;

const moved = 'see.frame() !== was', isPaused = 'see.text(".play") === "Play"';
const isStopped = '(see.node("button", "Go") !== undefined)', isFree = `!${isStopped}`;
const pressed = (control, value) => `${control}.ariaPressed === "${value}"`;
const changes = (what) => [`${what} !== was`, { before: what }];

/** Uses a control: with keys (reached with Tab), or by a click or what `pointer` does. Choices are made with keys. */
function use(control, keys, effect, { before, pointer = (found) => page.click(found) } = {}) {
  if (byKeys) return user.press(control, keys, effect, { before, isReached: true });
  if (control.includes('"select"')) return user.press(control, keys, effect, { before });
  return user.use(control, effect, { before, act: pointer });
}

async function usePlayer() {
  const slider = node('input', 'Frame'), verdict = node('select', 'Verdict');
  await use(button('Pause'), 'Enter', isPaused);
  await sleep(500);  // a frame may still be being drawn
  await use(button('One frame back'), 'Enter', 'see.frame() === was - 1');
  await use(button('One frame on'), ' ', 'see.frame() === was + 1');
  await use(slider, ['Home', 'ArrowRight'], 'see.frame() < was - 5', { pointer: (found) => page.drag(found, [-0.3, 0], [-0.3, 0]) });
  await use(node('select', 'Speed'), ['ArrowDown', 'ArrowDown'], 'see.node("select", "Speed").value === "4"');
  await use(button('Play'), 'Enter', 'see.frame() > was + 8');
  await use(button('Pause'), 'Enter', isPaused);
  await use(node('select', 'Frames chosen by the verdict of'), 'f', `!${verdict}.disabled`);
  await use(verdict, ['o', 'k'], `${verdict}.value === "ok"`);
  await use(button('Previous chosen frame'), 'Enter', moved);
  await use(button('Next chosen frame'), 'Enter', moved);
  await use(button('Live'), 'Enter', `${pressed(button('Live'), true)} && see.frame() > was`);
  await use(button('Pause'), 'Enter', isPaused);
  for (const value of [false, true]) await use(button('Outlines'), ' ', pressed(button('Outlines'), value));
  await use(button('Keys'), 'Enter', 'document.querySelector("dialog").open');
  await use(button('Close'), 'Enter', '!document.querySelector("dialog").open');
  if (!byKeys) return;
  await use('document.querySelector(".skip")', 'Enter', 'document.activeElement.id === "main"');
  const landmark = 'see.node(".magnifier select").value', help = 'document.querySelector("dialog").open';
  const everywhere = { ' ': `!(${isPaused})`, ArrowLeft: isPaused, ArrowRight: 'see.frame() === was + 1', End: moved,
    Home: `${slider}.value === ${slider}.min`, ']': moved, '[': moved, o: pressed(button('Outlines'), false),
    l: `${landmark} !== "${await page.value(landmark)}"`, '?': help, Escape: `!${help}` };
  await page.call('document.activeElement.blur();');
  for (const [key, effect] of Object.entries(everywhere)) {
    await user.use('document.body', effect, { act: () => page.press(key) });
    await sleep(300);
  }
}

async function useFigures() {
  const size = 'see.text(".magnifier .filter span")', landmark = node('select', 'Landmark'), plan = node('.plan [role=application]');
  const chart = node('.plot .surface'), strip = node('.strip canvas');
  await use(landmark, 'b', `${landmark}.value === "blue"`);
  for (const name of ['More enlarged', 'Less enlarged']) await use(button(name), ' ', ...changes(size));
  for (const name of ['Zoom in', 'Show the whole plan', 'Zoom out', 'Show the whole plan']) {
    await use(button(name), 'Enter', ...changes(floor));
  }
  await use(plan, ['+', 'ArrowLeft'], `${floor} !== was`, { before: floor, pointer: (found) => page.drag(found, [0, 0], [0.1, 0.1]) });
  for (const area of ['.plan', '.plot']) {
    for (let k = 0; k < 2 * await page.value(`document.querySelectorAll('${area} .legend button').length`); ++k) {
      const entry = node(`${area} .legend button`, undefined, k >> 1);
      await use(entry, 'Enter', pressed(entry, k % 2 === 1));
    }
  }
  await use(chart, ['+', '+'], `${ticks} !== was`, { before: ticks, pointer: (found) => page.drag(found, [-0.3, 0], [0.1, 0]) });
  await user.press(chart, 'Escape', ...changes(ticks));
  await use(chart, ['Home', 'ArrowRight', 'Enter'], moved, { pointer: (found) => page.drag(found, [-0.2, 0], [-0.2, 0]) });
  for (const [kind, begin] of [['SVG', '<svg'], ['PNG', '\x89PNG']]) {
    for (const k of [0, 1]) {
      const before = readdirSync(saved);
      const isNew = (file) => !before.includes(file) && readFileSync(`${saved}/${file}`, 'latin1').startsWith(begin);
      await use(button(`Save ${kind}`, k), 'Enter', 'true');
      if (!await until(() => readdirSync(saved).some(isNew), 8000)) user.faults.push(`Save ${kind} ${k}: no file`);
    }
  }
  for (const scheme of ['dark', 'light']) await use(node('.scheme'), 'Enter', `document.documentElement.dataset.scheme === "${scheme}"`);
  if (byKeys) return;

  // What only a pointer does; keys have other ways to it.
  for (const k of [0, 1]) {
    await user.use(node('.mirror-box'), `${landmark}.value === window.wanted`, { act: async (box) => page.point(box, ...await page.call(`
      const [box] = arguments, { left, top, width, height } = box.getBoundingClientRect(), names = box.querySelectorAll('.name');
      const marks = [...box.querySelectorAll('svg g')].map((group, i) => [group.querySelector('.over'), names[i].textContent]);
      const [path, name] = marks.filter(([outline]) => outline.getAttribute('d')?.length > 100)[${k}];
      window.wanted = [...${landmark}.options].find(({ value }) => name.includes(value)).value;
      const { x, y } = path.getPointAtLength(path.getTotalLength() / 2).matrixTransform(path.getScreenCTM());
      return [(x - left) / width - 0.5, (y - top) / height - 0.5];`, box)) });
  }
  const point = { act: (found) => page.point(found, 0.1) };
  await user.use(node('.pano-mark .name', undefined, 1), '!!see.node(".pano-mark.selected")', point);
  await user.use(node('tr th', undefined, 2), '!!see.node("tr.selected")', point);
  await user.use(strip, moved, { act: (found) => page.drag(found, [0.1, 0], [0.1, 0]) });
  for (const [area, control] of [['.strip', strip], ['.plot', chart]]) {
    await user.use(control, `!!see.node("${area} .readout")`, point);
    await sleep(1500);
    if (!await page.value(`see.node("${area} .readout")`)) user.faults.push(`${area}: values vanish while frames arrive`);
  }
}

async function useDriving(url) {
  const command = 'see.text(".drive > div > p:last-child")', pad = node('.pad'), who = 'see.text(".drive-state")';
  const stands = '/^[−-]?0\\.00/.test([...document.querySelectorAll(".gauges .tile")].at(-1).textContent)';
  await user.press(node('.drive input'), 'ArrowRight', 'see.text(".drive output") === "60 %"', { isReached: byKeys });
  for (const pointerType of byKeys ? [] : ['mouse', 'touch']) {
    await user.use(pad, `${command}.includes("turn 36 %")`, { act: (found) => page.hold(found, -0.3, 0, pointerType) });
    await page.release();
    if (!await page.holds(`${command} === "speed 0 %, turn 0 %"`)) user.faults.push(`${pointerType} has left the pad, but it drives`);
  }
  for (const [key, words, turns = false] of [['w', 'speed 60 %'], ['ArrowLeft', 'turn 60 %', true], ['d', 'turn −60 %', true],
    ['s', 'speed −60 %']]) {
    await use(button('Drive'), ' ', pressed(button('Drive'), true));
    await user.use(pad, `${command}.includes("${words}") && ${stands} === ${turns}`, { act: () => page.down(key) });
    await page.release();
    await use(button('Drive'), 'Enter', `${stands} && ${who} === "Nobody drives."`);
  }
  await use(button('Drive'), 'Enter', `${who} === "You drive."`);
  await page.value('window.axes = [0, -1]');
  await user.use(pad, `${command} === "speed 60 %, turn 0 %"`, { act: () => {} });  // a gamepad's stick
  await page.value('window.axes = null');

  let refused;
  const other = openStream(streamOf(url), { text: (line) => refused ??= line.type === 'refused' ? line.text : undefined });
  await other.opened;
  const sends = (type) => ({ act: () => other.send({ type, speed: 1, turn: 0 }) });
  await user.use(node('.rates'), 'see.text(".rates").includes("2 watchers")', sends('drive'));
  if (!await until(() => refused)) user.faults.push('a second browser may drive too');
  await user.use(pad, isStopped, { act: () => page.press('Escape') });
  await use(button('Go'), 'Enter', isFree);
  await use(button('STOP'), ' ', `${isStopped} && ${stands} && ${button('Drive')}.disabled`);
  await use(button('Go'), 'Enter', isFree);
  await user.use(node('.stop'), isStopped, sends('stop'));
  await use(button('Go'), 'Enter', isFree);
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
    if (!byKeys) await page.screenshot(`${scratch}/viewer-live.png`);
    await usePlayer();
    await useFigures();
    await use(button('STOP'), 'Enter', isStopped);
    await use(button('Go'), 'Enter', isFree);
    for (let k = 0; k < 6; ++k) {
      await page.press('End', ...Array(k).fill('ArrowLeft'));
      await sleep(600);
      const [ranges, poses] = ['Ranges', 'Poses'].map((name) => `see.rows("${name} of this frame")`);
      shown.push(await page.value(`({ frame: see.frame(), ranges: ${ranges}, poses: ${poses} })`));
    }
    await user.checkAllUsed('#main');
    await page.size(400, 800);
    await page.call('scrollTo(0, 0);');
    await sleep(1500);
    if (!byKeys) await page.screenshot(`${scratch}/viewer-phone.png`);
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

row(`${page.name}: every control of the live page used ${byKeys ? 'with keys alone' : 'with a pointer'}, while a robot drives`,
  `${uses} uses, ${faults.length} without their effect`, 'all have it', faults.length === 0);
row(`${page.name}: errors in the console meanwhile`, `${errors.length}`, '0', errors.length === 0);
row(`${page.name}: numbers of frames that were paused on (ranges, fix, track), against the run's tables`,
  `${compared} cells compared`, 'equal to the digits shown',
  compared >= 60 && !faults.some((fault) => fault.includes('but the tables have')));
for (const line of [...faults, ...errors]) console.log(line);
process.exit();
