// SPDX-License-Identifier: Apache-2.0
// What every page is made of: elements, numbers, tables, figures, verdicts, colours.

export const noValue = '\u2013';
const nbsp = '\u00a0';

// ---- elements

export function setAttributes(node, attributes) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === undefined || value === null || value === false) node.removeAttribute(name);
    else if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? '' : value);
  }
}

function build(node, attributes, children) {
  setAttributes(node, attributes);
  node.append(...children.flat(Infinity).filter((child) => child !== undefined && child !== null && child !== false));
  return node;
}

/** Returns an HTML element. Attributes `onclick` and the like are listeners; children are nodes, texts, or lists. */
export function el(tag, attributes, ...children) {
  return build(document.createElement(tag), attributes, children);
}

/** Returns an SVG element, as el(). */
export function svg(tag, attributes, ...children) {
  return build(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);
}

export function svgPath(style, d, dash) {
  return svg('path', { class: style, d, 'stroke-dasharray': dash });
}

export function svgText(x, y, words, anchor, style) {
  return svg('text', { x, y, 'text-anchor': anchor, class: style }, words);
}

/** Sets a node's text if it differs: the page's layout is then left as it is. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Returns the children of `parent`, one for each key and in that order, made by make(key) when a key is new. */
export function keyedChildren(parent, keys, make) {
  return d3.select(parent).selectAll(() => parent.children).data(keys, (key) => key)
    .join((entering) => entering.append((key) => make(key))).order().nodes();
}

export function button(label, onclick, attributes) {
  return el('button', { type: 'button', onclick, ...attributes }, label);
}

/** Returns a labelled range input; `oninput` gets the number, `show` makes its text. */
export function slider({ label, min, max, step = 1, value, show = String, oninput }) {
  const output = el('output', {}, show(value));
  const changed = ({ target }) => {
    output.textContent = show(Number(target.value));
    target.setAttribute('aria-valuetext', output.textContent);
    oninput(Number(target.value));
  };
  const attributes = { type: 'range', min, max, step, value, 'aria-valuetext': show(value), oninput: changed };
  return el('label', { class: 'slider' }, el('span', {}, label), el('input', attributes), output);
}

/** Calls changed(width) with the width of a node, in whole pixels, at the beginning and whenever it changes. */
export function watchWidth(node, changed) {
  let width = 0;
  new ResizeObserver(([{ contentRect }]) => requestAnimationFrame(() => {
    const now = Math.floor(contentRect.width);
    if (now === width || now === 0) return;
    width = now;
    changed(width);
  })).observe(node);
}

// ---- numbers. A missing value is a dash, never 0 or NaN.

export function exists(value) {
  return typeof value === 'number' && Number.isFinite(value);
}

export function fixed(value, digits = 2) {
  if (!exists(value)) return noValue;
  const text = value.toFixed(digits);
  return text.startsWith('-') ? (Number(text) === 0 ? text.slice(1) : `\u2212${text.slice(1)}`) : text;
}

/** Returns a number with `digits` significant digits, without trailing zeros. */
export function significant(value, digits = 3) {
  if (!exists(value)) return noValue;
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1).replace('e+', 'e').replaceAll('-', '\u2212');
  const places = Math.max(digits - 1 - Math.floor(Math.log10(size)), 0);
  return fixed(Number(value.toPrecision(digits)), Math.min(places, 12)).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '');
}

export function quantity(value, unit, digits = 2) {
  return exists(value) ? `${fixed(value, digits)}${unit === '\u00b0' ? '' : nbsp}${unit}` : noValue;
}

export function millimetres(value_m, digits = 1) {
  return quantity(exists(value_m) ? value_m * 1000 : undefined, 'mm', digits);
}

export function degrees(value_rad, digits = 1) {
  return quantity(exists(value_rad) ? value_rad * 180 / Math.PI : undefined, '\u00b0', digits);
}

export function percent(part, whole, digits = 1) {
  return exists(part) && whole > 0 ? quantity(100 * part / whole, '%', digits) : noValue;
}

export function plural(count, one, many = `${one}s`) {
  return `${count} ${count === 1 ? one : many}`;
}

// ---- data

/** Returns the address of something that the page's program serves to those who have its token. */
export function addressOf(path, query) {
  const token = new URLSearchParams(location.search).get('token') ?? '';
  return new URL(`/${path}?${new URLSearchParams({ token, ...query })}`, location).href;
}

/** Returns the objects of JSON lines. A last line that is cut off, as that of a run that was stopped, is left out. */
export function parseJsonLines(text) {
  const lines = text.split('\n').filter((line) => line.trim() !== '');
  return lines.flatMap((line, i) => {
    try {
      return [JSON.parse(line)];
    } catch (error) {
      if (i === lines.length - 1 && !text.endsWith('\n')) return [];
      throw new Error(`line ${i + 1} is not JSON: ${error.message}`);
    }
  });
}

// ---- parts of a page

/** Fills the page. @param lead nodes between title and navigation; @param sections made by section() */
export function showPage({ title, lead = [], sections }) {
  const shown = sections.filter(Boolean);
  document.getElementById('main').replaceChildren(
    el('header', {}, el('h1', {}, title), schemeToggle()), ...[lead].flat(Infinity).filter(Boolean),
    ...(shown.length > 1 ? [navigation(shown)] : []), ...shown);
}

export function section(id, title, ...children) {
  return el('section', { id, 'aria-labelledby': `${id}-title` }, el('h2', { id: `${id}-title` }, title), ...children);
}

/** Returns links to sections; the one in view is marked. */
export function navigation(sections) {
  const links = new Map(sections.map((each) =>
    [each, el('a', { href: `#${each.id}` }, each.shortTitle ?? each.querySelector('h2').textContent)]));
  const nav = el('nav', { class: 'places', 'aria-label': 'Parts of the page' }, [...links.values()]);
  const seen = new Set();
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) seen[isIntersecting ? 'add' : 'delete'](target);
    const current = sections.find((each) => seen.has(each));
    for (const [each, link] of links) setAttributes(link, { 'aria-current': each === current && 'true' });
    const link = links.get(current);
    if (link) nav.scrollLeft = link.offsetLeft - nav.clientWidth / 2 + link.offsetWidth / 2;
  }, { rootMargin: '-20% 0px -60% 0px' });
  for (const each of sections) observer.observe(each);
  return nav;
}

/** @param pairs name and value, a text or nodes; pairs without a value are left out */
export function facts(pairs) {
  return el('dl', { class: 'facts' }, pairs.filter(([, value]) => value !== undefined && value !== null && value !== '')
    .map(([name, value]) => [el('dt', {}, name), el('dd', {}, value)]));
}

export function list(sentences, nothing) {
  if (sentences.length === 0) return nothing ? el('p', {}, nothing) : null;
  return el('ul', {}, sentences.map((sentence) => el('li', {}, sentence)));
}

/** @param pairs [value, meaning] */
export function tiles(pairs) {
  return el('div', { class: 'tiles' },
    pairs.map(([value, meaning]) => el('div', { class: 'tile' }, el('b', {}, value), el('span', {}, meaning))));
}

/** A judgement in words, with a colour and a sign: good true, false, or undefined where there is none. */
export function judgement(good, text) {
  const sign = good === undefined ? '' : good ? '\u2713 ' : '\u2717 ';
  return el('strong', { class: good === undefined ? 'soft' : good ? 'met' : 'unmet' }, sign + text);
}

// ---- tables

/** Returns rows in the order of value(row); rows without a value are last. @param direction 1, -1, or 0: as they are */
export function sortRows(rows, value, direction) {
  if (direction === 0) return [...rows];
  const missing = (v) => v === undefined || v === null || v === '' || Number.isNaN(v);
  const compare = (a, b) => typeof a === 'number' && typeof b === 'number' ? a - b
    : String(a).localeCompare(String(b), 'en', { numeric: true });
  return rows.map((row) => [value(row), row])
    .sort(([a], [b]) => missing(a) || missing(b) ? missing(a) - missing(b) : direction * compare(a, b))
    .map(([, row]) => row);
}

/**
 * A table that can be sorted by its heads, and filtered if it is long.
 * @param columns { head, key: of the values in the rows, default the head; value: row => number or text, in place of
 *   it; digits, show: row => text or node, text: true for words, title: explains the head }; the first column is the
 *   head of the row
 * @param groups [head, columns] in place of the columns: heads above several of them
 */
export function table({ caption, rows, groups, columns = groups.flatMap(([, group]) => group) }) {
  const body = el('tbody'), filter = rows.length > 12;
  let sorted = -1, direction = 0;
  const valueOf = (column, row) => column.value ? column.value(row) : row[column.key ?? column.head];
  const isUnordered = (column) => rows.length < 2 || rows.every((row) => valueOf(column, row) === undefined);
  const text = (column, row) => {
    if (column.show) return column.show(row);
    const value = valueOf(column, row);
    return typeof value === 'number' ? fixed(value, column.digits ?? 0) : value ?? noValue;
  };
  const lines = new Map(rows.map((row) => [row, el('tr', {}, columns.map((column, i) =>
    el(i === 0 ? 'th' : 'td', { scope: i === 0 && 'row', class: column.text && 'words' }, text(column, row))))]));
  const fill = () => {
    const words = box ? box.value.toLowerCase().split(/\s+/) : [];
    const kept = rows.filter((row) => words.every((word) => lines.get(row).textContent.toLowerCase().includes(word)));
    const order = sortRows(kept, (row) => valueOf(columns[sorted], row), direction);
    body.replaceChildren(...order.map((row) => lines.get(row)));
    if (count) count.textContent = kept.length === rows.length ? '' : `${kept.length} of ${rows.length} rows`;
  };
  const heads = columns.map((column, i) => el('th', { scope: 'col', class: column.text && 'words' },
    !column.head || isUnordered(column) ? column.head : button(column.head, () => {
      const first = column.text || i === 0 ? 1 : -1;  // of numbers the largest is wanted first
      direction = sorted !== i ? first : direction === first ? -first : 0;
      sorted = direction === 0 ? -1 : i;
      const order = direction > 0 ? 'ascending' : 'descending';
      heads.forEach((head, j) => setAttributes(head, { 'aria-sort': j === sorted && order }));
      fill();
    }, { title: column.title })));
  const box = filter && el('input', { type: 'search', placeholder: 'Filter rows', oninput: () => fill(),
    'aria-label': `Filter rows: ${caption}` });
  const count = filter && el('span', { class: 'soft', role: 'status' });
  fill();
  return el('div', { class: 'table' }, filter && el('div', { class: 'filter' }, box, count),
    el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption },
      el('table', {}, el('caption', {}, caption), el('thead', {}, groups && el('tr', {}, groups.map(([head, group]) =>
        el('th', { colspan: group.length, scope: 'colgroup' }, head))), el('tr', {}, heads)), body)));
}

// ---- figures

/** Returns a figure with its caption, and buttons that save the drawings in it. */
export function figure({ id, number, title, caption, wide = true }, ...content) {
  const name = (id ?? title).toLowerCase().replace(/[^a-z0-9_]+/g, '_');
  const buttons = el('span', { class: 'save' },
    button('Save SVG', () => saveBlob(new Blob([standaloneSvg(node)], { type: 'image/svg+xml' }), `${name}.svg`)),
    button('Save PNG', async () => saveBlob(await pngOf(standaloneSvg(node)), `${name}.png`)));
  const node = el('figure', { id, class: wide && 'wide' }, el('div', { class: 'content' }, ...content),
    el('figcaption', {}, buttons, el('strong', {}, `${title}${number ? ` (the paper's ${number})` : ''}.`),
      caption && ` ${caption}`));
  return node;
}

export function figures(...content) {
  const shown = content.flat(Infinity).filter(Boolean);
  return shown.length > 0 && el('div', { class: 'figures' }, shown);
}

export function saveBlob(blob, name) {
  const url = URL.createObjectURL(blob);
  el('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

// All of them are inherited.
const savedStyles = ['fill', 'fill-opacity', 'stroke', 'stroke-opacity', 'stroke-width', 'stroke-dasharray',
  'stroke-linecap', 'stroke-linejoin', 'font-family', 'font-size', 'font-weight', 'text-anchor', 'paint-order'];

function inlineStyles(from, to, inherited) {
  const style = getComputedStyle(from);
  const values = savedStyles.map((name) => style.getPropertyValue(name));
  const own = savedStyles.map((name, i) => values[i] === inherited?.[i] ? '' : `${name}:${values[i]};`).join('');
  to.removeAttribute('class');
  to.removeAttribute('style');
  if (style.opacity !== '1') to.setAttribute('opacity', style.opacity);
  if (own) to.setAttribute('style', own);
  [...to.children].forEach((child, i) => inlineStyles(from.children[i], child, values));
  for (const child of [...to.children]) if (child.dataset.transient !== undefined) child.remove();
}

/** Returns the drawings and legends in a node, as they lie there, as an SVG file in the colours of the light scheme. */
export function standaloneSvg(node) {
  const root = document.documentElement, { scheme } = root.dataset;
  root.dataset.scheme = 'light';
  const area = (node.querySelector('.content') ?? node).getBoundingClientRect();
  const size = { width: Math.ceil(area.width), height: Math.ceil(area.height) };
  const whole = svg('svg', { ...size, viewBox: `0 0 ${size.width} ${size.height}` },
    svg('rect', { ...size, fill: '#ffffff' }));
  for (const drawing of node.querySelectorAll('svg.drawing')) {
    const entry = drawing.closest('.legend button');
    if (entry?.getAttribute('aria-pressed') === 'false') continue;
    const box = drawing.getBoundingClientRect(), [x, y] = [box.left - area.left, box.top - area.top];
    const copy = drawing.cloneNode(true);
    inlineStyles(drawing, copy);
    setAttributes(copy, { x, y, width: box.width, height: box.height });
    for (const name of ['tabindex', 'role', 'aria-label']) copy.removeAttribute(name);
    whole.append(copy);
    if (entry) whole.append(svg('text', { x: x + 24, y: y + 13, style: 'font:12px sans-serif' }, entry.textContent));
  }
  root.dataset.scheme = scheme;
  return new XMLSerializer().serializeToString(whole);
}

/** Returns a PNG of an SVG file, with two pixels for each of the drawing's. */
export async function pngOf(text) {
  const url = URL.createObjectURL(new Blob([text], { type: 'image/svg+xml' }));
  const image = el('img', { src: url });
  await image.decode();
  const canvas = el('canvas', { width: 2 * image.naturalWidth, height: 2 * image.naturalHeight });
  canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(url);
  return new Promise((resolve) => canvas.toBlob(resolve, 'image/png'));
}

// ---- verdicts

const verdictTable = {
  // name: sign, meaning, meaning in method `paper` where it differs
  ok: ['\u2713', 'an answer'],
  gap: ['\u2248', 'a position, although two circles did not meet: the middle of the gap between them was taken'],
  ambiguous: ['2', 'two positions fit the measurements equally well',
    'two positions fit the three ranges equally well'],
  not_seen: ['\u2013', 'nothing of its colour in either mirror', 'nothing of its colour in the lower mirror'],
  too_few: ['<', 'too few measurements to determine a position', 'fewer than three ranges'],
  truncated: ['\u2191', 'it reaches the rims: too near for its top to be seen',
    'it reaches the lower rim: too near for its top to be seen'],
  no_match: ['\u2260', 'seen, but its outline could not be fitted',
    'seen in the lower mirror, not found in the upper one'],
  beyond_limit: ['\u221e', 'too far: within 3 sigma the images do not distinguish its range from infinity',
    'too far: its disparity is not positive'],
  same_colour: ['=', 'another landmark has this colour'],
  one_view: ['1', 'a range from one mirror and the known height of the top'],
  occluded: ['\u00bd',
    'something hides a part of its outline: a range without a bearing where its top is whole, else none'],
  saturated: ['\u2600', 'too bright: its colour cannot be recognised'],
  two_candidates: ['2', 'two objects of its colour, and the images do not show which one it is'],
  inconsistent: ['\u2717', "the two mirrors contradict each other, or the map's height and radius"],
  impossible: ['!', 'no position of a landmark gives these images'],
  weak: ['~', 'a position that is hardly determined along one direction'],
  contradictory: ['\u2717', 'the measurements contradict each other, and it is unknown which one is wrong'],
  out_of_bounds: ['!', "a position outside the map's bounds, where the robot cannot be"],
  no_image: ['\u00d7', 'an image of the frame is missing or damaged'],
};

/** Returns { colour, sign, meaning } of a verdict. @param method of the run; the meanings depend on it */
export function verdictOf(name, method) {
  if (!Object.hasOwn(verdictTable, name)) return { colour: 'v-other', sign: '?', meaning: '' };
  const [sign, meaning, ofPaper = meaning] = verdictTable[name];
  return { colour: `v-${name}`, sign, meaning: method === 'paper' ? ofPaper : meaning };
}

export function verdictChip(name, method) {
  const { colour, sign, meaning } = verdictOf(name, method);
  const mark = paint(el('i', { 'aria-hidden': 'true' }, sign), colour);
  return el('span', { class: 'verdict', title: meaning || null }, mark, name);
}

/** Returns [verdict, count] of counts by verdict: `ok` first, then by descending count. */
export function byFrequency(counts) {
  return Object.entries(counts).filter(([, count]) => count > 0)
    .sort(([a, n], [b, m]) => (b === 'ok') - (a === 'ok') || m - n || a.localeCompare(b));
}

/** Returns a bar that shows counts by verdict as shares. */
export function shareBar(counts) {
  const whole = Object.values(counts).reduce((a, b) => a + b, 0);
  const words = byFrequency(counts).map((each) => each.join(' ')).join(', ');
  return el('span', { class: 'share', role: 'img', 'aria-label': words }, byFrequency(counts).map(([name, count]) =>
    paint(el('i', { title: `${name}: ${count}`, style: `width:${100 * count / whole}%` }), verdictOf(name).colour)));
}

// ---- colours

function luminance(rgb) {
  const [r, g, b] = rgb.map((code) => code <= 10.31475 ? code / 3294.6 : ((code / 255 + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

/** Returns the contrast of two colours by WCAG 2. @param a,b [r, g, b] from 0 to 255 */
export function contrast(a, b) {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

/** Returns the colour, moved towards black or white until it can be seen as a line on `ground`. */
export function readableColour(rgb, ground) {
  const towards = luminance(ground) > 0.2 ? 0 : 255;
  for (let share = 0; share < 1; share += 0.05) {
    const mixed = rgb.map((code) => Math.round(code + (towards - code) * share));
    if (contrast(mixed, ground) >= 3) return mixed;
  }
  return [towards, towards, towards];
}

/** Gives a node its colour, which CSS uses as --s: the name of a variable of style.css, or [r, g, b] of a thing. */
export function paint(node, colour) {
  if (Array.isArray(colour)) {
    node.classList.add('own');
    node.style.setProperty('--on-light', `rgb(${readableColour(colour, [255, 255, 255])})`);
    node.style.setProperty('--on-dark', `rgb(${readableColour(colour, [29, 35, 39])})`);
  } else {
    node.style.setProperty('--s', `var(--${colour})`);
  }
  return node;
}

/** Returns a disc in a thing's own colour. @param rgb from 0 to 255 */
export function swatch(rgb) {
  return el('span', { class: 'swatch', style: rgb && `background:rgb(${rgb.map(Number)})` });
}

/** Returns the button that exchanges the light and the dark scheme. Drawings on a canvas listen to `schemechange`. */
export function schemeToggle() {
  const root = document.documentElement;
  const label = () => root.dataset.scheme === 'dark' ? 'Light' : 'Dark';
  const toggle = button(label(), () => {
    root.dataset.scheme = root.dataset.scheme === 'dark' ? 'light' : 'dark';
    toggle.textContent = label();
    document.dispatchEvent(new Event('schemechange'));
  }, { class: 'scheme', title: 'Exchange the light and the dark colours' });
  return toggle;
}
