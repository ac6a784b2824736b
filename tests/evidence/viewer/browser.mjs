// SPDX-License-Identifier: Apache-2.0
// Pages in Chromium (by chromedriver) and in Firefox, both by WebDriver BiDi. They scroll at once.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { sleep, until } from './kit.mjs';
import { openStream } from './stream.mjs';

/** Starts a program, and returns it with what a pattern finds in its messages. */
async function start(program, args, pattern, env = {}) {
  const child = spawn(program, args, { stdio: ['ignore', 'pipe', 'pipe'], env: { ...process.env, ...env } });
  process.on('exit', () => child.kill());
  let text = '';
  for (const pipe of [child.stdout, child.stderr]) pipe.on('data', (bytes) => text += bytes);
  const found = await until(() => pattern.exec(text), 30_000);
  if (!found) throw new Error(`${program} does not start: ${text}`);
  return [child, found[1]];
}

async function request(method, url, body) {
  const { value } = await (await fetch(url, { method, body: body && JSON.stringify(body) })).json();
  if (value?.error) throw new Error(value.message);
  return value;
}

let driver;
async function startChromium(args, downloads) {
  driver ??= (await start('chromedriver', ['--port=0'], /started successfully on port (\d+)/))[1];
  const base = `http://127.0.0.1:${driver}/session`;
  const { sessionId, capabilities } = await request('POST', base, { capabilities: { alwaysMatch: {
    browserName: 'chrome', webSocketUrl: true, 'goog:loggingPrefs': { browser: 'ALL' }, 'goog:chromeOptions': {
      args: ['--headless=new', '--no-sandbox', '--disable-gpu', '--hide-scrollbars', '--force-prefers-reduced-motion', ...args],
      prefs: { 'download.default_directory': downloads } } } } });
  return { address: capabilities.webSocketUrl, name: `Chromium ${capabilities.browserVersion}`,
    close: () => request('DELETE', `${base}/${sessionId}`).catch(() => {}),
    kill: () => process.kill(capabilities['goog:processID'], 'SIGKILL'),
    errors: async () => (await request('POST', `${base}/${sessionId}/se/log`, { type: 'browser' }))
      .filter(({ level }) => level !== 'INFO' && level !== 'DEBUG').map(({ message }) => message) };
}

async function startFirefox(args, downloads) {
  const profile = mkdtempSync(`${tmpdir()}/twocone-firefox-`);
  const settings = { 'ui.prefersReducedMotion': 1, 'browser.download.folderList': 2, 'browser.download.dir': downloads };
  writeFileSync(`${profile}/user.js`, Object.entries(settings).filter(([, value]) => value !== undefined)
    .map(([key, value]) => `user_pref("${key}", ${JSON.stringify(value)});\n`).join(''));
  const [program, address] = await start('firefox-esr', ['--headless', '--profile', profile, '--remote-debugging-port', '0'],
    /WebDriver BiDi listening on (ws:\S+)/, { HOME: profile });
  const close = async () => {
    program.kill();
    await until(() => program.exitCode !== null || program.signalCode, 5000);
    rmSync(profile, { recursive: true, force: true });
  };
  return { address: `${address}/session`, isNew: true, close };
}

// Keys by the names that KeyboardEvent.key gives them, as WebDriver numbers them.
const codes = { Tab: 4, Enter: 7, Escape: 12, ' ': 13, End: 16, Home: 17, ArrowLeft: 18, ArrowUp: 19, ArrowRight: 20, ArrowDown: 21 };
const keyAction = (type, key) => ({ type, value: key in codes ? String.fromCharCode(0xe000 + codes[key]) : key });

export class Browser {
  /** @param browser chromium or firefox; first: a script that runs before those of each page */
  static async open({ browser = 'chromium', width = 1200, height = 1000, args = [], first = '', downloads } = {}) {
    const page = Object.assign(new Browser(), { calls: new Map(), entries: [] },
      await { chromium: startChromium, firefox: startFirefox }[browser](args, downloads));
    page.stream = openStream(page.address, { text: (message) => {
      if (message.id !== undefined) page.calls.get(message.id)(message);
      else if (message.method === 'log.entryAdded') page.entries.push(message.params);
    } });
    await page.stream.opened;
    if (page.isNew) page.name = `Firefox ${(await page.send('session.new', { capabilities: {} })).capabilities.browserVersion}`;
    page.context = (await page.send('browsingContext.getTree')).contexts[0].context;
    await page.send('session.subscribe', { events: ['log.entryAdded'] });
    await page.send('script.addPreloadScript', { functionDeclaration: `() => { ${first} }` });
    await page.size(width, height);
    return page;
  }

  send(method, params = {}) {
    const id = this.calls.size + 1;
    this.stream.send({ id, method, params });
    return new Promise((resolve, reject) => this.calls.set(id, ({ result, error, message }) =>
      error ? reject(new Error(`${error}: ${message}`)) : resolve(result)));
  }
  /** Returns what the body of a function returns in the page; an element becomes what click() and others take. */
  async call(code, ...args) {
    const { result, exceptionDetails } = await this.send('script.callFunction', { awaitPromise: true, target: { context: this.context },
      arguments: args.map(({ sharedId }) => ({ sharedId })),
      functionDeclaration: `function () { const value = (function () { ${code} }).apply(null, arguments);
        return value instanceof Element ? value : JSON.stringify(value); }` });
    if (exceptionDetails) throw new Error(exceptionDetails.text);
    return result.type === 'node' ? result : result.type === 'string' ? JSON.parse(result.value) : undefined;
  }
  value(expression) {
    return this.call(`return (${expression});`);
  }
  holds(expression, patience_ms) {
    return until(() => this.value(expression), patience_ms);
  }
  size(width, height) {
    return this.send('browsingContext.setViewport', { context: this.context, viewport: { width, height } });
  }
  go(url) {
    return this.send('browsingContext.navigate', { context: this.context, url, wait: 'complete' });
  }
  /** Returns the errors of the console since the last call. */
  async errors() {
    return this.entries.splice(0).filter(({ level }) => level === 'error' || level === 'warn').map(({ text }) => text);
  }
  async screenshot(file) {
    writeFileSync(file, (await this.send('browsingContext.captureScreenshot', { context: this.context })).data, 'base64');
  }

  perform(source) {
    return this.send('input.performActions', { context: this.context, actions: [source] });
  }
  /** Lifts what is held. */
  release() {
    return this.send('input.releaseActions', { context: this.context });
  }
  down(key) {
    return this.perform({ type: 'key', id: 'keys', actions: [keyAction('keyDown', key)] });
  }
  press(...keys) {
    return this.perform({ type: 'key', id: 'keys', actions:
      keys.flatMap((key) => [keyAction('keyDown', key), keyAction('keyUp', key)]) });
  }
  /** Moves a pointer to a share of an element's size from its middle. `then` is what it does there. */
  async point(element, right = 0, down = 0, { then = () => [], pointerType = 'mouse' } = {}) {
    const [x, y, w, h, isFree] = await this.call(`const [element] = arguments;
      const box = () => element.getBoundingClientRect();
      const isFree = ({ x, y, width, height }) => element.contains(document.elementFromPoint(x + width / 2, y + height / 2));
      if (!isFree(box()) || box().top < 0 || box().bottom > innerHeight) element.scrollIntoView({ block: 'center', behavior: 'instant' });
      return [box().x, box().y, box().width, box().height, isFree(box())];`, element);
    if (!isFree) throw new Error('something covers it');
    const move = (to, below) => ({ type: 'pointerMove', duration: 30,
      x: Math.round(x + (0.5 + to) * w), y: Math.round(y + (0.5 + below) * h) });
    await this.perform({ type: 'pointer', id: pointerType, parameters: { pointerType }, actions: [move(right, down), ...then(move)] });
  }
  click(element) {
    return this.drag(element, [0, 0], [0, 0]);
  }
  drag(element, from, to) {
    return this.point(element, ...from, { then: (move) =>
      [{ type: 'pointerDown', button: 0 }, move(...to), { type: 'pointerUp', button: 0 }] });
  }
  /** Presses a pointer in an element until release(). */
  hold(element, right, down, pointerType) {
    return this.point(element, 0, 0, { pointerType, then: (move) => [{ type: 'pointerDown', button: 0 }, move(right, down)] });
  }
}
