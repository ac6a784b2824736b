// SPDX-License-Identifier: Apache-2.0
// node save_figure.mjs PAGE FIGURE OUT.svg: stores a figure of a stored page as its button "Save SVG" does.
import { writeFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { Browser } from './browser.mjs';

const [page, figure, out] = process.argv.slice(2);
// What the button makes is kept instead of downloaded.
const keep = 'URL.createObjectURL = (blob) => { blob.text().then((text) => window.saved = text); return "data:,"; };';
const browser = await Browser.open({ width: 1200, first: keep });
try {
  await browser.go(`file://${resolve(page)}`);
  const button = `[...document.getElementById(${JSON.stringify(figure)}).querySelectorAll('button')].find(({ textContent }) => textContent === 'Save SVG')`;
  if (!await browser.holds(button)) throw new Error(`${page} has no figure ${figure} with a button "Save SVG"`);
  await browser.click(await browser.value(button));
  if (!await browser.holds('window.saved')) throw new Error(`${figure} was not saved`);
  writeFileSync(out, await browser.value('window.saved'));
} finally {
  await browser.close();
}
process.exit(0);
