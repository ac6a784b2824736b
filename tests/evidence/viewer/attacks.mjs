// SPDX-License-Identifier: Apache-2.0
// Attacks a robot that drives: requests that must be refused, connections that do not end, and web_attack.
//   node attacks.mjs SCRATCH PROGRAM WEB_ATTACK COUNT
import { execFile } from 'node:child_process';
import { connect } from 'node:net';
import { promisify } from 'node:util';
import { row, sleep, until, wall_ms } from './kit.mjs';
import { startRun, streamOf } from './robot.mjs';
import { maskedFrame, openStream } from './stream.mjs';

const [scratch, program, webAttack, count] = process.argv.slice(2);
process.env.TWOCONE = program;
const run = await startRun(`${scratch}/attacked`, '--robot', 'robots/lab_sim.yaml', '--frames', '90000');
const { hostname, port, host, search } = new URL(run.url);
const frames = [];
openStream(streamOf(run.url), { text: (line) => line.type === 'frame' && frames.push(line) });
await until(() => frames.length > 30, 120_000);

/** Sends bytes on a connection of its own; returns [what was received, whether the server ended it]. */
function send(bytes) {
  return new Promise((resolve) => {
    let text = '';
    const socket = connect(Number(port), hostname, () => socket.write(bytes, 'latin1'));
    const timer = setTimeout(() => resolve([text, false, socket.destroy()]), 8000);
    socket.on('data', (part) => text += part.toString('latin1')).on('error', () => {}).on('close', () => {
      clearTimeout(timer);
      resolve([text, true]);
    });
  });
}
const upgrade = 'Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
  + 'Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n';
const get = (target, { to = host, headers = 'Connection: close\r\n' } = {}) =>
  `GET ${target} HTTP/1.1\r\nHost: ${to}\r\n${headers}\r\n`;
const statusOf = async (bytes) => Number(/^HTTP\/1.1 (\d+)/.exec((await send(bytes))[0])?.[1]);

async function refused(what, requests) {
  const statuses = await Promise.all(requests.map(statusOf));
  row(what, `${requests.length} requests, status ${[...new Set(statuses)].join(', ')}`, '400, 403, 404 or 426',
    statuses.every((status) => [400, 403, 404, 426].includes(status)));
}

/** Does something, and reports whether the page is answered at the end of it and the robot drives on. */
async function during(what, work) {
  const before = frames.at(-1), begin_ms = wall_ms();
  let hasFailed = false;
  const figure = await work().catch(({ message }) => (hasFailed = true, message.trim()));
  const asked_ms = wall_ms(), isAnswered = await statusOf(get(`/${search}`)) === 200, took_ms = wall_ms() - asked_ms;
  await sleep(Math.max(begin_ms + 5000 - wall_ms(), 0));
  const after = frames.at(-1), passed = after.frame - before.frame;
  row(what, `${figure}; the page is ${isAnswered ? `answered in ${took_ms.toFixed(0)} ms` : 'not answered'}; `
    + `${(passed / (after.host_t_s - before.host_t_s)).toFixed(1)} frames a second, `
    + `${after.late_frames - before.late_frames} of ${passed} late`,
  'the page is answered, the robot drives on', isAnswered && passed > 10 && !hasFailed);
}

await during('no attack, for comparison', () => sleep(5000).then(() => 'five seconds'));
await refused('path traversal, with the token', ['/../../etc/passwd', '/%2e%2e/%2e%2e/etc/passwd', '/..%2f..%2fetc/passwd', '//etc/passwd',
  '/etc/passwd', '/image', '/lower/000000.png', '/..\\..\\etc\\passwd', '/%00', '/run.yaml', '/%2fetc%2fpasswd', '/.', '/stream/../run.yaml']
  .map((path) => get(path + search)));
const origins = ['http://evil.example', 'null', `https://${host}`, `http://${hostname}`];
const hosts = ['evil.example', `evil.example:${port}`, hostname];
await refused('other sites and users: Origin, Host (DNS rebinding), no token, a wrong one', ['/', '/stream'].flatMap((path) => [
  ...origins.map((origin) => get(path + search, { headers: `Origin: ${origin}\r\n${upgrade}` })),
  ...hosts.map((to) => get(path + search, { to, headers: upgrade })),
  get(path, { headers: upgrade }), get(`${path}?token=${'0'.repeat(32)}`, { headers: upgrade })]));
// Without a mask, reserved bits and opcodes, endless and too long ones, a continuation of nothing, a long ping, binary.
const forged = ['\x81\x05hello', '\xf1\x80\0\0\0\0', '\x83\x80\0\0\0\0', '\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0', '\x80\x80\0\0\0\0',
  '\x89\xfe\x0f\xff\0\0\0\0', maskedFrame(1, 'x'.repeat(1100)).toString('latin1'), maskedFrame(2, '{}').toString('latin1')];
const ends = await Promise.all(forged.map((each) => send(get(`/stream${search}`, { headers: upgrade }) + each)));
row('forged frames of WebSocket', `${ends.filter(([, isEnded]) => isEnded).length} of ${forged.length} connections ended by the server`, 'all',
  ends.every(([, isEnded]) => isEnded));
let told;
const driver = openStream(streamOf(run.url), { text: (line) => told ??= line.type === 'refused' ? line.text : undefined });
await driver.opened;
driver.send({ type: 'drive', speed: 1, turn: 1 });
row('a request to drive while the robot wanders', await until(() => told) ?? 'no answer', 'refused', told !== undefined);
driver.socket.destroy();

const sockets = [];
const hold = (number) => Promise.all(Array.from({ length: number }, () => new Promise((resolve) => {
  const socket = connect(Number(port), hostname, resolve).on('error', resolve).on('close', () => socket.hasEnded = true);
  sockets.push(socket);
})));
const ended = () => `${sockets.filter(({ hasEnded }) => hasEnded).length} of ${sockets.length} ended by the server`;
await during('100 clients that send a byte each second (slow loris)', async () => {
  await hold(100);
  for (let k = 0; k < 12; ++k, await sleep(1000)) sockets.forEach((socket) => socket.write(get(`/${search}`)[k]));
  return ended();
});
await during('1000 further connections', () => hold(1000).then(() => sleep(3000)).then(ended));
sockets.forEach((socket) => socket.destroy());
await during('web_attack', () => promisify(execFile)(webAttack, [run.url, count]).then(({ stdout }) => stdout.split('\n')[0]));
const code = await Promise.race([run.stop(), sleep(60_000)]);
const reports = run.said().match(/ERROR: \w+Sanitizer|runtime error:/g) ?? [];
row('the program after all this, ended with ctrl-C', `status ${code}, ${reports.length} reports of sanitizers`,
  '130, 0', code === 130 && reports.length === 0);
if (reports.length) console.log(run.said());
process.exit();
