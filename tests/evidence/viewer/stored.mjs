// SPDX-License-Identifier: Apache-2.0
// A stored page: its size, and how soon it is drawn when it is opened from its file.
//   node stored.mjs PAGE WORDS
//   node stored.mjs PAGE WORDS SCREENSHOT WIDTH [HEIGHT]       a picture in place of that; without HEIGHT, of all the page
import { statSync } from 'node:fs';
import { resolve } from 'node:path';
import { Browser } from './browser.mjs';
import { median, row, sleep } from './kit.mjs';

const [file, words, screenshot, width = '1200', height] = process.argv.slice(2);
const errors = [], opened = [];
let requests = 0;

/** In a page: notes when the first drawing was painted, and when the last change before half a second without changes was. */
function watchDrawing() {
  let last;
  const painted = (done) => requestAnimationFrame(() => setTimeout(() => done(performance.now())));
  new MutationObserver(() => {
    if (!window.first && document.querySelector('svg.drawing path[d]:not([d=""]), canvas')) painted((now) => window.first ??= now);
    painted((now) => {
      last = now;
      setTimeout(() => last === now && (window.whole ??= now), 500);
    });
  }).observe(document, { childList: true, subtree: true, attributes: true });
}

for (let k = 0; k < (screenshot ? 1 : 5); ++k) {
  const page = await Browser.open({ width: Number(width), first: `(${watchDrawing})();` });
  await page.go(`file://${resolve(file)}`);
  await page.holds('window.whole', 60_000);
  opened.push(await page.value('[window.first, window.whole]'));
  errors.push(...await page.errors());
  requests += await page.value('performance.getEntriesByType("resource").filter(({ name }) => !/^(data|blob):/.test(name)).length');
  if (screenshot) {
    await page.size(Number(width), Number(height ?? await page.value('document.documentElement.scrollHeight')));
    await sleep(1500);
    await page.screenshot(screenshot);
  }
  await page.close();
}
if (!screenshot) {
  const [first, whole] = [0, 1].map((k) => median(opened.map((times) => times[k])) / 1000);
  const size_mb = statSync(file).size / 1e6;
  row(`${words}: size`, `${size_mb.toFixed(1)} MB`, 'at most 15 MB', size_mb <= 15);
  row(`${words}: opened from its file, medians of five: first figure drawn, everything drawn`,
    `${first.toFixed(2)} s, ${whole.toFixed(2)} s`, 'at most 2 s', whole <= 2);
  row(`${words}: errors in the console, requests of the network`, `${errors.length}, ${requests}`, '0, 0', errors.length + requests === 0);
}
for (const line of errors) console.log(line);
process.exit();
