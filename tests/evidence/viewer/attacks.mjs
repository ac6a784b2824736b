// SPDX-License-Identifier: Apache-2.0
// Attacks a robot that drives: requests that must be refused, connections that never end, and at last web_attack.
//   node attacks.mjs SCRATCH PROGRAM WEB_ATTACK COUNT
import { execFile } from 'node:child_process';
import { connect } from 'node:net';
import { row, sleep, until, wall_ms } from './kit.mjs';
import { startRun, streamOf } from './robot.mjs';
import { maskedFrame, openStream } from './stream.mjs';

const [scratch, program, webAttack, count] = process.argv.slice(2);
process.env.TWOCONE = program;
const run = await startRun(`${scratch}/attacked`, '--robot', 'robots/lab_sim.yaml', '--frames', '90000');
const { hostname, port, host, search } = new URL(run.url);
const frames = [];
const watcher = openStream(streamOf(run.url), { text: (line) => line.type === 'frame' && frames.push(line) });
await until(() => frames.length > 30, 120_000);

/** Sends bytes on a connection of its own; returns what was received when the server ended it, or until `patience_ms`. */
function send(bytes, patience_ms = 3000) {
  return new Promise((resolve) => {
    let text = '';
    const socket = connect(Number(port), hostname);
    const done = () => {
      resolve(text);
      socket.destroy();
    };
    socket.on('data', (part) => text += part.toString('latin1')).on('error', () => {}).on('close', done);
    socket.write(bytes, 'latin1');
    setTimeout(done, patience_ms);
  });
}
const get = (target, { to = host, headers = '' } = {}) => `GET ${target} HTTP/1.1\r\nHost: ${to}\r\n${headers}Connection: close\r\n\r\n`;
const upgrade = 'Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n';
const statusOf = async (bytes) => Number(/^HTTP\/1.1 (\d+)/.exec(await send(bytes))?.[1]);

/** Counts requests whose status is not one of those allowed. */
async function refused(what, requests, allowed) {
  let others = 0;
  for (const each of requests) others += !allowed.includes(await statusOf(each));
  row(what, `${requests.length} requests, ${others} of them not refused`, 'all refused', others === 0);
}

/** Does something, and reports whether the page is answered meanwhile and the robot drives on. */
async function during(what, work) {
  const [first, begin_ms] = [frames.length, wall_ms()];
  const figure = await work();
  const asked_ms = wall_ms();
  const isAnswered = await statusOf(get(`/${search}`)) === 200;
  const answered_ms = wall_ms() - asked_ms, late = frames.at(-1).late_frames - frames[first].late_frames;
  await until(() => wall_ms() - begin_ms > 5000, 6000);
  const rate = (frames.at(-1).frame - frames[first].frame) / (frames.at(-1).host_t_s - frames[first].host_t_s);
  row(what, `${figure}; the page is ${isAnswered ? `answered in ${answered_ms.toFixed(0)} ms` : 'not answered'}; ${rate.toFixed(1)} frames a second, `
    + `${late} of ${frames.at(-1).frame - frames[first].frame} late`, 'the page is answered, the robot drives on', isAnswered && frames.length > first + 10);
}

await during('nothing, for comparison', () => sleep(5000).then(() => 'no attack'));
const climbs = ['/../../etc/passwd', '/%2e%2e/%2e%2e/etc/passwd', '/..%2f..%2fetc/passwd', '//etc/passwd', '/etc/passwd', '/image', '/lower/000000.png',
  '/..\\..\\etc\\passwd', '/%00', '/run.yaml', '/%2fetc%2fpasswd', '/.', '/stream/../run.yaml'];
await refused('path traversal, with the token', climbs.map((path) => get(path + search)), [400, 404]);
const stream = `/stream${search}`;
await refused('other sites: Origin, Host (DNS rebinding), no token, a wrong one', ['/', '/stream'].flatMap((path) => [
  ...['http://evil.example', 'null', `https://${host}`, `http://${hostname}`].map((origin) => get(path + search, { headers: `Origin: ${origin}\r\n${upgrade}` })),
  ...['evil.example', `evil.example:${port}`, hostname, '0.0.0.0'].map((to) => get(path + search, { to, headers: upgrade })),
  get(path, { headers: upgrade }), get(`${path}?token=${'0'.repeat(32)}`, { headers: upgrade })]), [400, 403]);
const open = get(stream, { headers: upgrade }).replace('Connection: close\r\n', '');
const forged = ['\x81\x05hello', '\xf1\x80\0\0\0\0', '\x83\x80\0\0\0\0', '\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0', '\x80\x80\0\0\0\0', '\x89\xfe\x0f\xff\0\0\0\0',
  maskedFrame(1, 'x'.repeat(1100)).toString('latin1'), maskedFrame(2, '{}').toString('latin1')];
let kept = 0;
for (const each of forged) {
  const begin_ms = wall_ms();
  await send(open + each, 8000).then(() => kept += wall_ms() - begin_ms > 7000);
}
row('forged frames of WebSocket', `${forged.length} kinds, ${kept} not ended`, 'all ended', kept === 0);
let told;
const driver = openStream(streamOf(run.url), { text: (line) => line.type === 'refused' && (told = line.text) });
await driver.opened;
driver.send({ type: 'drive', speed: 1, turn: 1 });
await until(() => told);
driver.socket.destroy();
row('a request to drive while the robot wanders', told ?? 'no answer', 'refused', told !== undefined);

const sockets = [];
const hold = (number) => Promise.all(Array.from({ length: number }, () => new Promise((resolve) => {
  const socket = connect(Number(port), hostname, () => resolve(socket)).on('error', () => resolve(socket)).on('close', () => socket.hasEnded = true);
  sockets.push(socket);
})));
await during('100 clients that send a byte each second (slow loris)', async () => {
  const slow = await hold(100);
  for (let k = 0; k < 12; ++k, await sleep(1000)) slow.forEach((socket) => socket.write(get(`/${search}`)[k]));
  return `${slow.filter(({ hasEnded }) => hasEnded).length} ended after 12 s`;
});
await during('1000 connections at once', async () => {
  await hold(1000);
  await sleep(3000);
  return `${sockets.filter(({ hasEnded }) => !hasEnded).length} open after 3 s`;
});
sockets.forEach((socket) => socket.destroy());
await during('web_attack', () => new Promise((resolve) => execFile(webAttack, [run.url, count], (error, out, errors) => resolve(error ? errors.trim() : out.split('\n')[0]))));
watcher.socket.destroy();
const code = await Promise.race([run.stop(), sleep(60_000)]);
const reports = (run.said().match(/ERROR: \w+Sanitizer|runtime error:/g) ?? []).length;
row('the program after all this, stopped with ctrl-C', `exit ${code}, ${reports} reports of sanitizers`, 'exit 130, none', code === 130 && reports === 0);
process.exit();
