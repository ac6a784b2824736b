// SPDX-License-Identifier: Apache-2.0
// A user of a page, who notes what has no effect.
import { Browser } from './browser.mjs';
import { seeScript } from './inpage.mjs';

// Expressions in a page. The k-th shown node of a selector whose name is `name`:
export const node = (css, name, k = 0) => `see.node(${JSON.stringify(css)}, ${JSON.stringify(name)}, ${k})`;
export const button = (name, k) => node('button', name, k);
// These change when the room, or the chart, is moved or zoomed:
export const floor = 'see.node(".plan .floor").outerHTML';
export const ticks = 'see.text(".plot .stage svg")';

export class User {
  /** Opens a page; a live one has some frames then. @param options as those of Browser.open() */
  static async open(url, options = {}) {
    const page = await Browser.open({ ...options, first: seeScript + (options.first ?? '') });
    await page.go(url);
    if (!url.startsWith('file:') && !await page.holds('see.frame() > 30', 60_000)) throw new Error('no frames');
    return Object.assign(new User(), { page, uses: 0, faults: [] });
  }

  /**
   * Does something, and checks its effect: an expression that may use `was`, the value of the expression `before`.
   * @param what an expression of the control, which becomes the argument of `act`
   */
  async use(what, effect, { before = 'see.frame()', act }) {
    ++this.uses;
    try {
      const control = await this.page.value(what);
      if (!control) throw new Error('it is not there');
      await this.page.call(`window.was = ${before};
        (window.used ??= new Set()).add(see.nameOf(arguments[0])).add(arguments[0]);`, control);
      await act(control);
      if (!await this.page.holds(effect)) throw new Error(`no effect: ${effect}`);
    } catch (error) {
      this.faults.push(`use ${this.uses}, ${what}: ${error.message}`);
    }
  }

  /** Presses keys in a control. @param isReached with Tab; else it is given the focus */
  press(what, keys, effect, { before, isReached = false } = {}) {
    return this.use(what, effect, { before, act: async (control) => {
      if (!isReached) await this.page.call('arguments[0].focus();', control);
      for (let k = 0; !await this.page.value(`document.activeElement === ${what}`); ++k) {
        if (k > 300) throw new Error('Tab does not reach it');
        await this.page.press('Tab');
      }
      await this.page.press(...[keys].flat());
    } });
  }

  /** Adds the controls within a selector that were not used to the faults. */
  async checkAllUsed(within) {
    const names = await this.page.value(`see.controls().filter((each) => each.closest('${within}') && !window.used.has(each)
      && !window.used.has(see.nameOf(each)) && !each.matches('.scroll, a')).map(see.nameOf)`);
    this.faults.push(...names.map((name) => `not used: ${name}`));
  }
}
