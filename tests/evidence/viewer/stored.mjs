// SPDX-License-Identifier: Apache-2.0
// A stored page: its size, and how soon it is drawn when it is opened from its file.
//   node stored.mjs PAGE WORDS [SCREENSHOT] [WIDTH]     with SCREENSHOT: of the whole page, WIDTH pixels wide, in place of the rest
import { statSync } from 'node:fs';
import { resolve } from 'node:path';
import { Chromium } from './browser.mjs';
import { median, row } from './kit.mjs';

const [file, words, screenshot, width = '1200'] = process.argv.slice(2);
const url = `file://${resolve(file)}`;

/** Notes when the first drawing has been painted, and when the last change before a pause of half a second was. */
function watchDrawing() {
  let last;
  const painted = (done) => requestAnimationFrame(() => setTimeout(() => done(performance.now())));
  new MutationObserver(() => {
    if (!window.first && document.querySelector('svg.drawing path[d], canvas')) painted((now) => window.first ??= now);
    painted((now) => {
      last = now;
      setTimeout(() => last === now && (window.whole ??= now), 500);
    });
  }).observe(document, { childList: true, subtree: true, attributes: true });
}

const opened = [], errors = [];
let network = 0;
for (let k = 0; k < (screenshot ? 1 : 5); ++k) {
  const page = await Chromium.open({ width: Number(width), first: `(${watchDrawing})();` });
  await page.go(url);
  await page.holds('window.whole', 60_000);
  opened.push(await page.value('({ first: window.first, whole: window.whole })'));
  errors.push(...await page.errors());
  network += await page.value('performance.getEntriesByType("resource").filter(({ name }) => !/^(data|blob):/.test(name)).length');
  if (screenshot) {
    await page.size(Number(width), await page.value('document.documentElement.scrollHeight'));
    await page.holds('false', 1500);
    await page.screenshot(screenshot);
  }
  await page.close();
}
if (!screenshot) {
  const [first, whole] = ['first', 'whole'].map((key) => median(opened.map((each) => each[key])) / 1000);
  const size_mb = statSync(file).size / 1e6;
  row(`${words}: size`, `${size_mb.toFixed(1)} MB`, 'at most 15 MB', size_mb <= 15);
  row(`${words}: opened from its file, median of five: first figure drawn, everything drawn`, `${first.toFixed(2)} s, ${whole.toFixed(2)} s`, 'at most 2 s', whole <= 2);
  row(`${words}: errors in the console, requests of the network`, `${errors.length}, ${network}`, '0, 0', errors.length + network === 0);
}
for (const line of errors) console.log(line);
process.exit();
