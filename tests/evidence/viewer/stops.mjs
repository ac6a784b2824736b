// SPDX-License-Identifier: Apache-2.0
// How soon the wheels stand when the browser that drives is gone. By the wall clock, from the last request to drive that
// passed a proxy to the first frame that stands.
//   node stops.mjs SCRATCH DEED TIMES       DEED: tab (it is closed), kill (the browser is killed), cut (nothing passes any more)
import { readFileSync } from 'node:fs';
import { Chromium } from './browser.mjs';
import { row, sleep, until } from './kit.mjs';
import { beginOfRun_ms, startRun, streamOf, table } from './robot.mjs';
import { openStream, startProxy } from './stream.mjs';
import { seeScript } from './inpage.mjs';

const [scratch, deed, count] = process.argv.slice(2);
const words = { tab: 'the tab is closed', kill: 'the browser is killed', cut: 'a proxy passes nothing any more' }[deed];
const run = await startRun(`${scratch}/stops_${deed}`, '--robot', 'robots/lab_sim.yaml', '--behaviour', 'manual', '--frames', '9000');
const answered = new Map(), rows = [];
let status = {};
const watcher = openStream(streamOf(run.url), { text: (line) => {
  if (line.type === 'status') status = line;
  if (line.type === 'frame') answered.set(line.frame, line.host_t_s + line.age_s);
} });
await until(() => answered.size > 3, 60_000);
for (const type of ['stop', 'go', 'stop', 'go']) {  // for the run's clock
  watcher.send({ type });
  await sleep(500);
}

const lasts_ms = [];
for (let k = 0; k < Number(count); ++k) {
  const proxy = await startProxy(Number(new URL(run.url).port));
  const { host } = new URL(run.url);
  const browser = await Chromium.open({ first: seeScript, args: [`--host-resolver-rules=MAP ${host} 127.0.0.1:${proxy.port}`] });
  await browser.go(run.url);
  await browser.holds('document.querySelector(".player") && see.frame() > 0', 20_000);
  await browser.click(await browser.value('see.node("button", "Drive")'));
  await browser.down('a');  // it turns on the spot
  const driving = await until(() => status.driver, 10_000);
  await sleep(700 + 66 * Math.random());
  if (!driving || !proxy.lastDrive_ms) throw new Error('the browser does not drive');
  if (deed === 'tab') await browser.closeTab();
  else if (deed === 'kill') browser.kill();
  else proxy.isCut = true;
  await until(() => !status.driver, 5000);
  lasts_ms.push(proxy.lastDrive_ms);
  await sleep(1200);
  proxy.isCut = true;
  if (deed !== 'kill') await browser.close();
  proxy.server.close();
}
await sleep(500);
await run.stop();

const begin_ms = beginOfRun_ms(run.folder, 4, answered);
const clock = table(run.folder, 'frames.csv').map(({ host_t_s }) => begin_ms + 1000 * Number(host_t_s));
const moves = table(run.folder, 'drive.csv').map((line) => Number(line.left_command_radps) !== 0 || Number(line.right_command_radps) !== 0);
const angles = table(run.folder, 'drive.csv').map((line) => Number(line.left_rad));
// The row of a frame has the command that was in effect before it.
const stops_s = lasts_ms.map((last_ms) => {
  const before = clock.findLastIndex((at_ms) => at_ms < last_ms);
  let k = clock.findIndex((at_ms, i) => i > before + 1 && !moves[i] && !moves[i + 1]);
  while (k > 0 && angles[k + 1] !== angles[k]) ++k;
  return moves[before] ? (clock[k] - last_ms) / 1000 : NaN;
});
const timeout_s = Number(/command_timeout_s: ([\d.]+)/.exec(readFileSync('robots/lab_sim.yaml', 'utf8'))[1]);
const worst = Math.max(...stops_s);
row(`${words}, ${count} times: from the last request to drive until the wheels stand`,
  `${Math.min(...stops_s).toFixed(2)} to ${worst.toFixed(2)} s`, `at most ${(timeout_s + 0.1).toFixed(1)} s`, worst <= timeout_s + 0.1);
console.log(stops_s.map((each) => each.toFixed(3)).join(' '));
process.exit();
