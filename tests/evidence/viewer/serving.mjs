// SPDX-License-Identifier: Apache-2.0
// What serving costs, how late an image is, and whether watchers change a run. Lab, 640x480, 15 Hz, in real time.
//   node serving.mjs SCRATCH [FRAMES]
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { Chromium } from './browser.mjs';
import { median, row, sleep, until, wall_ms } from './kit.mjs';
import { beginOfRun_ms, servingTime_s, slowWatcher, startRun, streamOf } from './robot.mjs';
import { openStream } from './stream.mjs';

const scratch = process.argv[2], frames = Number(process.argv[3] ?? 450);
const lab = 'robots/lab_sim.yaml', prompt = `${scratch}/latency_0.yaml`;
writeFileSync(prompt, readFileSync(lab, 'utf8').replace(/^latency_frames: .*/m, 'latency_frames: 0').replaceAll('../', `${process.cwd()}/`));

/** Notes when each frame's line has arrived in a page, and when a repaint followed the drawing of its image. */
function watchFrames() {
  window.arrived = new Map();
  window.painted = new Map();
  const now = () => performance.timeOrigin + performance.now();
  window.WebSocket = class extends WebSocket {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => {
        if (typeof data !== 'string') return;
        const line = JSON.parse(data);
        if (line.type === 'frame') window.arrived.set(line.frame, [now(), line.host_t_s, line.age_s]);
      });
    }
  };
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    draw.apply(this, given);
    if (this.canvas.ariaLabel !== 'Image of the lower mirror') return;
    const frame = parseInt(document.querySelector('.player .time').textContent);
    requestAnimationFrame(() => window.painted.set(frame, now()));
  };
}

/** Drives with some kind of watcher: returns { share, cpu_s, wall_s, late, arrived, painted }: of each frame [ms since its arrival, since its answer]. */
async function drive(name, robot, { browser, client, stops = Boolean(browser || client), slow = 0 } = {}) {
  const run = await startRun(`${scratch}/${name}`, '--robot', robot, '--frames', String(frames), '--seed', '7');
  let seen = new Map(), page, painted = [], share, late;
  const stream = (client || stops) && openStream(streamOf(run.url), { text: (line) => {
    if (line.type !== 'frame' || !client) return;
    late = line.late_frames;
    seen.set(line.frame, [wall_ms(), line.host_t_s, line.age_s]);
  } });
  const watchers = Array.from({ length: slow }, () => slowWatcher(run.url));
  if (browser) {
    stream.socket.pause();  // it only presses the stop button
    page = await Chromium.open({ first: `(${watchFrames})();` });
    await page.go(run.url);
  }
  await sleep(4000);
  const [begin_s, from_ms] = [servingTime_s(run.pid), wall_ms()];
  for (let k = 0; wall_ms() - from_ms < 1000 * (frames / 15 - 10); ++k) {
    await sleep(1000);
    if (stops) stream.send({ type: k % 2 ? 'go' : 'stop' });
    share = 1000 * (servingTime_s(run.pid) - begin_s) / (wall_ms() - from_ms);
  }
  if (page) {
    await page.holds('document.querySelector(".state").dataset.state === "end"', 20_000);
    seen = new Map(await page.value('[...window.arrived]'));
    painted = await page.value('[...window.painted]');
  }
  await until(async () => (await Promise.race([run.ended, sleep(50)])) !== undefined, 60_000);
  await page?.close();
  const answered = new Map([...seen].map(([frame, [, host_t_s, age_s]]) => [frame, host_t_s + age_s]));
  const begin_ms = stops ? beginOfRun_ms(run.folder, robot === prompt ? 0 : 4, answered) : NaN;
  const delays = (pairs) => pairs.filter(([frame]) => seen.has(frame)).map(([frame, at_ms]) => {
    const [, host_t_s, age_s] = seen.get(frame);
    return { arrival: at_ms - begin_ms - 1000 * host_t_s, answer: at_ms - begin_ms - 1000 * (host_t_s + age_s) };
  });
  const { own_cpu_s, wall_s } = JSON.parse(readFileSync(`${run.folder}/summary.json`));
  return { share, own_cpu_s, wall_s, late, watchers, arrived: delays([...seen].map(([frame, [at_ms]]) => [frame, at_ms])), painted: delays(painted) };
}

const percent = (share) => `${(100 * share).toFixed(1)} %`;
const ms = (delays, key) => median(delays.map((each) => each[key])).toFixed(0);

const alone = await drive('alone', lab);
const client = await drive('client', lab, { client: true });
const browser = await drive('browser', lab, { browser: true });
const first = await drive('prompt', prompt, { browser: true });
const slow = await drive('slow', lab, { slow: 10 });

const shares = [client, browser].map(({ share }) => share);
row('serving one watcher, a program that takes all frames, and Chromium: processor time of the server\'s thread, of one core',
  `${shares.map(percent).join(', ')}; nobody: ${percent(alone.share)}`, 'at most 10 %', Math.max(...shares) <= 0.1);
row('the same runs as wholes: processor time with that program against nobody, of one core',
  `${percent(client.own_cpu_s / client.wall_s)} against ${percent(alone.own_cpu_s / alone.wall_s)}; late frames: ${client.late}`, 'at most 10 % more',
  client.own_cpu_s / client.wall_s - alone.own_cpu_s / alone.wall_s <= 0.1);
row('from a frame\'s answer until it is received by that program, median', `${ms(client.arrived, 'answer')} ms, of ${client.arrived.length} frames`, 'a figure', true);
row('from a frame\'s answer until its image is in Chromium: received, and drawn on the screen; medians',
  `${ms(browser.arrived, 'answer')} ms, ${ms(browser.painted, 'answer')} ms, of ${browser.painted.length} frames`, 'at most 150 ms', ms(browser.painted, 'answer') <= 150);
row('from a frame\'s arrival in the program, latency_frames: 0, likewise',
  `${ms(first.arrived, 'arrival')} ms, ${ms(first.painted, 'arrival')} ms, of ${first.painted.length} frames`, 'at most 150 ms', ms(first.painted, 'arrival') <= 150);
row('from a frame\'s arrival, latency_frames: 4, of which the simulation makes use to render ahead', `${ms(browser.painted, 'arrival')} ms, of it 267 ms by choice`, 'a figure', true);

// Times of the machine may differ, nothing else.
let difference = '';
try {
  execFileSync('diff', ['-rq', '-x', 'timing.csv', '-x', 'run.log', '-x', 'run.yaml', '-x', 'summary.json', '-x', 'frames.csv', `${scratch}/alone`, `${scratch}/slow`]);
} catch (error) {
  difference = `${error.stdout}`;
}
const [times, others] = ['alone', 'slow'].map((name) => readFileSync(`${scratch}/${name}/frames.csv`, 'utf8').replace(/,[^,]*$/gm, ''));
if (times !== others) difference += 'frames.csv\n';
row('the same seed without watchers and with ten that take a part of the stream each half second: tables and images that differ',
  `${difference ? difference.trim().split('\n').length : 'none'}; each watcher had ${slow.watchers.map(({ frames: count }) => count).join(', ')} of ${frames} frames`, 'no byte',
  !difference && slow.watchers.every(({ frames: count }) => count > 0 && count < 0.9 * frames));
if (difference) console.log(difference);
process.exit();
