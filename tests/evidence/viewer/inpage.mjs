// SPDX-License-Identifier: Apache-2.0
// What the scripts need inside a page. It runs before the page's own script, and is `see` there.

function inPage() {
  const all = (css) => [...document.querySelectorAll(css)];
  const isShown = (node) => node.checkVisibility({ visibilityProperty: true }) && node.getClientRects().length > 0;
  const nameOf = (node) => node.getAttribute('aria-label') ?? node.getAttribute('placeholder')
    ?? (node.tagName === 'INPUT' ? node.closest('label')?.firstChild : node)?.textContent ?? '';
  const colours = new Map(), paper = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true });
  /** [r, g, b, opacity] of a CSS colour. */
  const rgba = (text) => {
    if (!colours.has(text)) {
      const [clear, opacity] = [/^(?:rgba\(.*,|color\(.*\/)\s*([\d.]+)\)$/.exec(text), 1].map((found) => found?.[1]);
      paper.clearRect(0, 0, 1, 1);
      paper.fillStyle = clear === undefined ? text : text.replace(/[,/]\s*[\d.]+\)$/, (end) => `${end[0]} 1)`);
      paper.fillRect(0, 0, 1, 1);
      const [r, g, b] = paper.getImageData(0, 0, 1, 1).data;
      colours.set(text, [r, g, b, clear === undefined ? opacity ?? 1 : Number(clear)]);
    }
    return colours.get(text);
  };
  const over = ([r, g, b, a], under) => [r, g, b].map((value, i) => a * value + (1 - a) * under[i]);
  const luminance = (rgb) => [0.2126, 0.7152, 0.0722].reduce((sum, factor, i) => {
    const value = rgb[i] / 255;
    return sum + factor * (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
  }, 0);
  const contrast = (a, b) => {
    const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (high + 0.05) / (low + 0.05);
  };
  /** The colours that may be behind a node: one, or black and white where an image is. The rim of a text hides what is behind. */
  const grounds = (node) => {
    const layers = [], { paintOrder, stroke } = getComputedStyle(node);
    if (/^stroke/.test(paintOrder) && stroke !== 'none') return [rgba(stroke).slice(0, 3)];
    for (let at = node; at; at = at.parentElement) {
      const layer = at.closest('svg.drawing') && at.tagName !== 'FIGURE' ? [0, 0, 0, 0] : rgba(getComputedStyle(at).backgroundColor);
      if (layer[3] > 0) layers.unshift(layer);
      if (layer[3] === 1) return [layers.reduce((under, each) => over(each, under), [0, 0, 0])];
      if (at.matches('.names, .pano, .mirror-box, .magnified')) break;
    }
    return [[0, 0, 0], [255, 255, 255]].map((image) => layers.reduce((under, each) => over(each, under), image));
  };
  const opacityOf = (node) => {
    let opacity = 1;
    for (let at = node; at; at = at.parentElement) opacity *= Number(getComputedStyle(at).opacity);
    return opacity;
  };
  const worst = (colour, node, opacity) => Math.min(...grounds(node).map((ground) =>
    contrast(over([...colour.slice(0, 3), colour[3] * opacity], ground), ground)));

  window.see = {
    isShown, nameOf,
    /** The k-th shown node of a selector whose name is `name`. */
    node: (css, name, k = 0) => all(css).filter((node) => isShown(node) && (name === undefined || nameOf(node) === name))[k],
    frame: () => parseInt(document.querySelector('.player .time')?.textContent),
    text: (css) => document.querySelector(css)?.textContent ?? '',
    controls: () => all('a[href], button, select, input, summary, [tabindex="0"]').filter((node) => isShown(node) && !node.disabled),
    /** The rows of a table by their heads, each an object of texts by the heads of its columns. */
    rows: (caption) => {
      const table = all('table').find((each) => each.caption?.textContent === caption);
      const heads = [...table.tHead.rows].at(-1).cells;
      return [...table.tBodies[0].rows].map((row) =>
        Object.fromEntries([...row.cells].map((cell, i) => [heads[i].textContent, cell.textContent])));
    },
    /** Texts and lines whose contrast is below that of WCAG AA, except of inactive controls; how many were looked at. */
    contrasts: () => {
      const texts = [], lines = [];
      const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
      while (walker.nextNode()) {
        const node = walker.currentNode.parentElement;
        if (!walker.currentNode.data.trim() || !isShown(node)
          || node.closest('script, style, :disabled, [aria-disabled=true], .legend [aria-pressed=false]')) continue;
        const style = getComputedStyle(node), size = parseFloat(style.fontSize);
        const least = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700) ? 3 : 4.5;
        const ratio = worst(rgba(node.ownerSVGElement ? style.fill : style.color), node, opacityOf(node));
        texts.push({ ratio, least, what: walker.currentNode.data.trim().slice(0, 40),
          where: node.closest('[class]')?.getAttribute('class') });
      }
      for (const node of all('svg.drawing path:is(.line, .thin, .hollow, .area)').filter((each) => isShown(each) && each.getAttribute('d'))) {
        const style = getComputedStyle(node);
        const ratio = worst(rgba(style.stroke === 'none' ? style.fill : style.stroke), node, 1);
        lines.push({ ratio, least: 3, what: node.closest('button')?.textContent ?? style.stroke,
          where: node.closest('figure')?.id ?? '' });
      }
      const low = (found) => found.filter(({ ratio, least }) => ratio < least - 0.005);
      return { texts: texts.length, lines: lines.length, low: [...low(texts), ...low(lines)] };
    },
    /** Entries of one legend that differ by colour alone. */
    colourAlone: () => all('.legend').filter(isShown).flatMap(({ children }) => {
      const signs = [...children].map((entry) => [...entry.querySelectorAll('.key > *')].map((sign) =>
        [sign.textContent, ...['class', 'd', 'stroke-dasharray'].map((name) => sign.getAttribute(name))]).join());
      return [...children].filter((_, i) => signs.indexOf(signs[i]) !== signs.lastIndexOf(signs[i])).map(nameOf);
    }),
  };
}

export const seeScript = `(${inPage})();`;
