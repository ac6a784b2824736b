// SPDX-License-Identifier: Apache-2.0
// What serving costs, how late an image is, and whether watchers change a run. Lab, 640x480, 15 Hz, in real time.
//   node serving.mjs SCRATCH [FRAMES]
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { Browser } from './browser.mjs';
import { median, row, sleep, until, wall_ms } from './kit.mjs';
import { beginOfRun_ms, servingTime_s, slowWatcher, startRun, streamOf } from './robot.mjs';
import { openStream } from './stream.mjs';

const [scratch, count = '450'] = process.argv.slice(2);

/** In a page: notes when the line of each frame has arrived, and when the screen was painted with its image. */
function watchFrames() {
  Object.assign(window, { arrived: [], painted: [] });
  const now = () => performance.timeOrigin + performance.now();
  window.WebSocket = class extends WebSocket {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => {
        const { type, frame, host_t_s, age_s } = typeof data === 'string' ? JSON.parse(data) : {};
        if (type === 'frame') window.arrived.push([frame, now(), host_t_s, age_s]);
      });
    }
  };
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    draw.apply(this, given);
    if (this.canvas.ariaLabel !== 'Image of the lower mirror') return;
    const frame = parseInt(document.querySelector('.player .time').textContent);
    requestAnimationFrame(() => window.painted.push([frame, now()]));
  };
}

/** Drives with watchers: a program that takes all frames, a page in a browser, slow programs. */
async function drive(name, { program, browser, slow = 0 } = {}) {
  const run = await startRun(`${scratch}/${name}`, '--robot', 'robots/lab_sim.yaml', '--frames', count, '--seed', '7');
  let arrived = [], painted = [], share, late, page;
  const stream = (program || browser) && openStream(streamOf(run.url), { text: ({ type, frame, host_t_s, age_s, late_frames }) => {
    if (type === 'frame') arrived.push([frame, wall_ms(), host_t_s, age_s]);
    late = late_frames ?? late;
  } });
  const slowOnes = Array.from({ length: slow }, () => slowWatcher(run.url));
  if (browser) {
    stream.socket.pause();  // it only presses the stop button, for the run's clock
    page = await Browser.open({ first: `(${watchFrames})();` });
    await page.go(run.url);
  }
  await sleep(4000);
  const [begin_s, from_ms] = [servingTime_s(run.pid), wall_ms()];
  for (let k = 0; wall_ms() - from_ms < 1000 * (Number(count) / 15 - 10); ++k) {
    await sleep(1000);
    stream?.send({ type: k % 2 ? 'go' : 'stop' });
    share = 1000 * (servingTime_s(run.pid) - begin_s) / (wall_ms() - from_ms);
  }
  if (page) {
    await page.holds('document.querySelector(".state").textContent.startsWith("The run ")', 20_000);
    [arrived, painted] = [await page.value('arrived'), await page.value('painted')];
  }
  await run.ended;
  await page?.close();
  const answers = new Map(arrived.map(([frame, , host_t_s, age_s]) => [frame, [host_t_s, host_t_s + age_s]]));
  const begin_ms = stream && beginOfRun_ms(run.folder, answers);
  // Medians in milliseconds, [since the frame's arrival in the program, since its answer].
  const delays = (times) => [0, 1].map((k) => Math.round(median(times.filter(([frame]) => answers.has(frame))
    .map(([frame, at_ms]) => at_ms - begin_ms - 1000 * answers.get(frame)[k]))));
  const { own_cpu_s, wall_s } = JSON.parse(readFileSync(`${run.folder}/summary.json`));
  return { share, own_cpu_s, wall_s, late, slowOnes, frames: painted.length, arrival: delays(arrived), painting: delays(painted) };
}

const percent = (share) => `${(100 * share).toFixed(1)} %`;
const alone = await drive('alone');
const program = await drive('program', { program: true });
const browser = await drive('browser', { browser: true });
const slow = await drive('slow', { slow: 10 });

row('serving one watcher that takes all frames, and one in Chromium: processor time of the server\'s thread, of one core',
  `${percent(program.share)}, ${percent(browser.share)}; with nobody ${percent(alone.share)}`, 'at most 10 %',
  Math.max(program.share, browser.share) <= 0.1);
const more = (program.own_cpu_s - alone.own_cpu_s) / program.wall_s;
row('processor time of the whole program with that watcher, and with nobody',
  `${program.own_cpu_s.toFixed(1)} s, ${alone.own_cpu_s.toFixed(1)} s: ${percent(more)} of a core; ${program.late} of ${count} frames late`,
  'at most 10 % of a core more', more <= 0.1);
row('median time from a frame\'s answer until that watcher has it', `${program.arrival[1]} ms`, 'at most 150 ms', program.arrival[1] <= 150);
row('from a frame\'s answer until Chromium has its image, and until it has drawn it',
  `${browser.arrival[1]} ms, ${browser.painting[1]} ms, of ${browser.frames} frames drawn`, 'at most 150 ms', browser.painting[1] <= 150);
row('the same from its arrival in the program, whose images are then rendered',
  `${browser.arrival[0]} ms, ${browser.painting[0]} ms`, 'at most 150 ms', browser.painting[0] <= 150);

// Times of the machine may differ, nothing else.
const names = ['timing.csv', 'run.log', 'run.yaml', 'summary.json', 'frames.csv'], both = [`${scratch}/alone`, `${scratch}/slow`];
let difference = '';
try {
  execFileSync('diff', ['-rq', ...names.flatMap((name) => ['-x', name]), ...both]);
} catch (error) {
  difference = `${error.stdout}`;
}
const [ours, theirs] = both.map((folder) => readFileSync(`${folder}/frames.csv`, 'utf8').replace(/,[^,]*$/gm, ''));
if (ours !== theirs) difference += 'frames.csv\n';
const taken = slow.slowOnes.map(({ frames }) => frames);
row('one seed with nobody, and with ten watchers that take a part of the stream each half second: files that differ',
  `${difference.split('\n').length - 1}; the watchers had ${Math.min(...taken)} to ${Math.max(...taken)} of ${count} frames`, '0',
  difference === '' && Math.min(...taken) > 0 && Math.max(...taken) < 0.9 * Number(count));
console.log(difference);
process.exit();
