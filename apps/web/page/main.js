// SPDX-License-Identifier: Apache-2.0
import { livePage } from './live.js';
import { worldPage } from './world.js';
import { viewPage } from './view.js';
import { reportPage } from './report.js';
import { comparePage } from './compare.js';
import { tradeoffPage } from './tradeoff.js';
import { designPage } from './design.js';

/** Shows the page that the document's data name. */
export function main() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const pages = { live: livePage, world: worldPage, view: viewPage, report: reportPage, compare: comparePage,
    tradeoff: tradeoffPage, design: designPage };
  pages[data.page](data);
}
