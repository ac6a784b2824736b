// SPDX-License-Identifier: Apache-2.0
// How soon the wheels stand when the browser that drives is gone: by the wall clock, from the last request to drive that
// passed a proxy to the first frame before which the wheels stood.
//   node stops.mjs SCRATCH tab|kill|cut TIMES       the tab is closed, the browser killed, nothing passes any more
import { readFileSync } from 'node:fs';
import { row, sleep, until } from './kit.mjs';
import { beginOfRun_ms, startRun, streamOf, table } from './robot.mjs';
import { openStream, startProxy } from './stream.mjs';
import { User, button } from './user.mjs';

const [scratch, deed, count] = process.argv.slice(2);
const words = { tab: 'the tab is closed', kill: 'the browser is killed', cut: 'a proxy passes nothing any more' }[deed];
const run = await startRun(`${scratch}/stops_${deed}`, '--robot', 'robots/lab_sim.yaml', '--behaviour', 'manual');
const { host, port } = new URL(run.url);
const answers = new Map();
let status = {};
const watcher = openStream(streamOf(run.url), { text: (line) => {
  if (line.type === 'status') status = line;
  if (line.type === 'frame') answers.set(line.frame, [line.host_t_s, line.host_t_s + line.age_s]);
} });
await until(() => answers.size > 30, 60_000);
for (const type of ['stop', 'go', 'stop', 'go']) {  // for the run's clock
  watcher.send({ type });
  await sleep(500);
}

const lasts_ms = [];
for (let k = 0; k < Number(count); ++k) {
  const proxy = await startProxy(Number(port));
  const { page } = await User.open(run.url, { args: [`--host-resolver-rules=MAP ${host} 127.0.0.1:${proxy.port}`] });
  await page.click(await page.value(button('Drive')));
  await page.down('a');  // it turns on the spot
  if (!await until(() => status.driver && proxy.lastDrive_ms, 10_000)) throw new Error('the browser does not drive');
  await sleep(700 + 66 * Math.random());
  if (deed === 'tab') await page.send('browsingContext.close', { context: page.context });
  else if (deed === 'kill') page.kill();
  else proxy.isCut = true;
  await until(() => !status.driver, 5000);
  lasts_ms.push(proxy.lastDrive_ms);
  await sleep(1200);
  proxy.isCut = true;
  if (deed !== 'kill') await page.close();
  proxy.server.close();
}
await run.stop();

const begin_ms = beginOfRun_ms(run.folder, answers);
const clock = table(run.folder, 'frames.csv').map(({ host_t_s }) => begin_ms + 1000 * Number(host_t_s));
const drive = table(run.folder, 'drive.csv');
const moves = drive.map((line) => Number(line.left_command_radps) !== 0 || Number(line.right_command_radps) !== 0);
const turns = drive.map(({ left_rad }, i) => left_rad !== drive[i - 1]?.left_rad);
// The row of a frame has the command that was in effect before it, and the angles at it.
const stops_s = lasts_ms.map((last_ms) => {
  const next = clock.findIndex((at_ms) => at_ms > last_ms);
  const stands = moves.findIndex((isMoving, i) => i >= next && !isMoving && !turns[i]);
  return moves.slice(next - 2, next + 2).includes(true) ? (clock[stands] - last_ms) / 1000 : NaN;
});
const most_s = Number(/command_timeout_s: ([\d.]+)/.exec(readFileSync('robots/lab_sim.yaml', 'utf8'))[1]) + 0.1;
row(`${words}, ${count} times: from the last request to drive until the wheels stand`,
  `${Math.min(...stops_s).toFixed(2)} to ${Math.max(...stops_s).toFixed(2)} s`, `at most ${most_s} s`, Math.max(...stops_s) <= most_s);
console.log(stops_s.map((each) => each.toFixed(3)).join(' '));
process.exit();
