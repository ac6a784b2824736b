// SPDX-License-Identifier: Apache-2.0
// A run with --live, its watchers without a browser, and the tables that it leaves.
import { spawn } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { sleep } from './kit.mjs';
import { openStream } from './stream.mjs';

/**
 * Drives a robot. When its page can be opened, returns { url, folder, pid, ended: a promise of the exit code, stop(),
 * said(): its messages }.
 */
export async function startRun(folder, ...options) {
  rmSync(folder, { recursive: true, force: true });
  const args = ['run', '--out', folder, '--live', '--log-level', 'info', ...options];
  const program = spawn(process.env.TWOCONE ?? 'build/release/twocone', args, { stdio: ['ignore', 'ignore', 'pipe'] });
  process.on('exit', () => program.kill());
  const ended = new Promise((resolve) => program.on('exit', resolve));
  let text = '';
  const url = await Promise.race([ended.then(() => undefined), new Promise((resolve) => {
    program.stderr.on('data', (bytes) => {
      const found = /watch at (http:\S+)/.exec(text += bytes);
      if (found) resolve(found[1]);
    });
  })]);
  if (!url) throw new Error(`the run ended at once: ${text}`);
  const stop = () => {
    program.kill('SIGINT');
    return ended;
  };
  return { url, folder, pid: program.pid, ended, stop, said: () => text };
}

/** Returns the rows of a table of a run folder as objects of texts. */
export function table(folder, name) {
  const [head, ...lines] = readFileSync(`${folder}/${name}`, 'utf8').trimEnd().split('\n');
  const keys = head.split(',');
  return lines.map((line) => Object.fromEntries(line.split(',').map((field, i) => [keys[i], field])));
}

/** Returns the seconds of processor time that the thread of the server has used. */
export function servingTime_s(pid) {
  const tasks = `/proc/${pid}/task`;
  const server = readdirSync(tasks).find((task) => readFileSync(`${tasks}/${task}/comm`, 'utf8') === 'twocone-web\n');
  return Number(readFileSync(`${tasks}/${server}/schedstat`, 'utf8').split(' ')[0]) / 1e9;
}

/**
 * Returns when a run began, by the wall clock in milliseconds. The log has the time of day of "frame K: a person stopped the
 * wheels", which is decided directly after the frame's arrival. The earliest of several is the least delayed one.
 * @param answers a Map from a frame's number to [arrival, answer], in seconds since the run began
 */
export function beginOfRun_ms(folder, answers) {
  const begins = [];
  for (const line of readFileSync(`${folder}/run.log`, 'utf8').split('\n')) {
    const found = /^(\S+) \S+ run: frame (\d+): a person (?:stopped|freed)/.exec(line);
    const [arrival_s] = (found && answers.get(Number(found[2]))) ?? [];
    if (arrival_s) begins.push(Date.parse(found[1]) - 1000 * arrival_s);
  }
  return Math.min(...begins);
}

/** The address of the stream that belongs to that of the page. */
export const streamOf = (url) => url.replace('/?', '/stream?');

/** A client that takes a part of the stream each half second; returns { frames: the number that it has received }. */
export function slowWatcher(url) {
  const seen = { frames: 0 };
  const { socket } = openStream(streamOf(url), { text: ({ type }) => seen.frames += type === 'frame' });
  socket.on('data', () => socket.pause());
  const timer = setInterval(() => socket.resume(), 500);
  socket.on('close', () => clearInterval(timer));
  return seen;
}

/** Waits until a table of a run has a number of rows; returns whether it has. */
export async function hasRows(folder, name, count, patience_ms = 60_000) {
  for (let left = patience_ms; left > 0; left -= 200, await sleep(200)) {
    if (existsSync(`${folder}/${name}`) && table(folder, name).length >= count) return true;
  }
  return false;
}
