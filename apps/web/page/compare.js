// SPDX-License-Identifier: Apache-2.0
// The page of a comparison: where two runs differ, by how much, and why.
import { el, svg, exists, fixed, significant, noValue, plural, slider } from './kit.js';
import { showPage, section, facts, list, table, figure, figures } from './kit.js';
import { Plot, markerShapes, fillLegend, readableLimit } from './plot.js';
import { Plan, boundsOf } from './plan.js';

// ---- words and numbers

export function plainNumber(value) {
  return Math.abs(value) >= 1e4 ? fixed(value, 0) : significant(value, 4);
}

/** Returns the number of decimals that shows one digit of sigma, or two if one would be coarse: 0.05, but 0.10. */
function sigmaDecimals(sigma) {
  const magnitude = Math.floor(Math.log10(sigma));
  return Math.min(Math.max((sigma / 10 ** magnitude < 2.95 ? 1 : 0) - magnitude, 0), 9);
}

export function toPrecisionOf(sigma, value) {
  return sigma > 0 ? fixed(value, sigmaDecimals(sigma)) : plainNumber(value);
}

/** Returns "+2.00 ± 0.10"; without a sigma the value alone. */
export function withSigma(value, sigma) {
  if (!exists(value)) return noValue;
  const signed = (value >= 0 ? '+' : '') + toPrecisionOf(sigma, value);
  return sigma > 0 ? `${signed}\u00a0\u00b1\u00a0${toPrecisionOf(sigma, sigma)}` : signed;
}

/** Returns "62 %", "−3 %", "< 1 %". */
export function shareText(share) {
  if (!exists(share)) return noValue;
  return share > 0 && share < 0.01 ? '<\u00a01\u00a0%' : `${fixed(100 * share, 0)}\u00a0%`;
}

/** Returns a p-value: "0.004", "1.0e−9", "< 1e−99". */
export function chanceText(p) {
  return exists(p) && p < 1e-99 ? '<\u00a01e\u221299' : significant(p, 2);
}

function unitAfter(before, unit) {
  return unit && unit !== '1' ? before + unit : '';
}

/** Returns the name of a component without its unit and without the words of its source: "rim radius". */
export function shortName({ where, kind }, { name, unit }) {
  const without = (text, start) => start && text.startsWith(start) ? text.slice(start.length) : text;
  let short = without(name, `${where}.`);
  // A unit ends the name or a part of it: centre_px.column. Units in names are those of robot files, not those shown.
  for (const each of [unit, 'px', 'rad', 'm', 's'].filter(Boolean)) {
    const at = short.indexOf(`_${each}`), end = at + each.length + 1;
    if (at >= 0 && (end === short.length || short[end] === '.')) short = short.slice(0, at) + short.slice(end);
  }
  return without(without(short.replace(/[_.]/g, ' '), kind), ' ');
}

function largestShare({ shares }) {
  return Math.max(0, ...shares.map(({ share }) => share).filter(exists));
}

/** Returns the sources that differ; those that explain the largest part of a gap come first. */
export function sourcesByShare(sources) {
  return sources.filter(({ verdict }) => verdict === 'differs').sort((a, b) => largestShare(b) - largestShare(a));
}

/** Returns a source's name with its most certain number: "lower focal length (rim radius +2.00 ± 0.10 px)". */
function namedWithNumber(source) {
  const sigmas = ({ difference, sigma }) => sigma > 0 ? Math.abs(difference) / sigma : 0;
  const best = source.components.reduce((a, b) => a && sigmas(a) >= sigmas(b) ? a : b, undefined);
  if (!best) return source.name;
  let what = shortName(source, best);
  if (source.kind.includes(what)) what = '';  // the name of the source has these words already
  else if (what.endsWith(` ${source.kind}`)) what = what.slice(0, -source.kind.length - 1);
  const number = withSigma(best.difference, best.sigma) + unitAfter('\u00a0', best.unit);
  return `${source.name} (${what && `${what} `}${number})`;
}

export function compareHeadline({ sources }) {
  const differing = sourcesByShare(sources);
  if (differing.length > 0) return `Differs: ${differing.map(namedWithNumber).join(', ')}.`;
  const tested = sources.some(({ verdict }) => verdict === 'agrees');
  return tested ? 'No difference found.' : 'No source of a difference could be tested.';
}

/** Returns a sentence about the sources that the headline does not name; empty without any. */
export function otherSources({ sources }) {
  const [differs, agrees, unknown] = ['differs', 'agrees', 'cannot tell'].map((wanted) =>
    sources.filter(({ verdict }) => verdict === wanted).length);
  const tested = differs ? 'tested without a difference' : 'tested';
  const parts = [agrees > 0 && `${plural(agrees, differs ? 'other source' : 'source')} ${tested}`,
    unknown > 0 && `${unknown} cannot be determined from these data`].filter(Boolean);
  return parts.length > 0 ? `${parts.join('; ')}.` : '';
}

/**
 * Returns the series of a panel of residuals, one for each landmark.
 * @param axis t_s or range_m; @param key before_m or after_m
 */
export function residualSeries(points, landmarks, axis, key) {
  const series = new Map();
  points.landmark.forEach((landmark, i) => {
    const at = points[axis][i], value = points[key][i];
    if (!exists(at) || !exists(value)) return;
    if (!series.has(landmark)) {
      const { name = `landmark ${landmark}`, rgb } = landmarks[landmark] ?? {};
      series.set(landmark, { name, colour: rgb ?? `c${landmark % 8 + 1}`, kind: 'points', r: 2, legend: false,
        shape: markerShapes[landmark % markerShapes.length], x: [], y: [] });
    }
    series.get(landmark).x.push(at);
    series.get(landmark).y.push(1000 * value);
  });
  return [...series].sort(([a], [b]) => a - b).map(([, each]) => each);
}

// ---- causes

function cellLines(items, text) {
  return items.length > 0 ? items.map((item) => el('div', { class: 'nowrap' }, text(item))) : noValue;
}

function sourceTable(sources, caption, differs) {
  const parts = (head, text) => ({ head, show: ({ components }) => cellLines(components, text) });
  return el('div', { class: 'sources' }, table({ caption, rows: sources, columns: [
    { head: 'source', key: 'name' },
    { ...parts('number', ({ name }) => name), text: true },
    parts('simulated', ({ simulated, sigma }) => toPrecisionOf(sigma, simulated)),
    parts('real', ({ real, sigma }) => toPrecisionOf(sigma, real)),
    parts('real \u2212 simulated', (part) => withSigma(part.difference, part.sigma) + unitAfter('\u00a0', part.unit)),
    { head: 'p-value', key: 'p_value', show: ({ p_value }) => chanceText(p_value) },
    differs && { head: 'explains', text: true, value: largestShare,
      show: ({ shares }) => cellLines(shares, ({ share, of }) => `${shareText(share)} of ${of}`) },
    differs && { head: 'hard to distinguish from', text: true,
      show: (source) => cellLines(source.hardly_told_from, String) },
  ].filter(Boolean) }));
}

function testSentence({ false_alarm, level }, tested) {
  if (tested === 0) return 'No source was tested.';
  const from = level > 0 ? `, so a source counts as different where p < ${significant(level, 2)}` : '';
  return `${plural(tested, 'source was', 'sources were')} tested by \u03c7\u00b2 against no difference. A whole `
    + `comparison of two equal robots raises a false alarm with probability ${significant(false_alarm, 2)}${from}.`;
}

function causesSection(data) {
  const differing = sourcesByShare(data.sources);
  const [agreeing, unknown] = ['agrees', 'cannot tell'].map((wanted) =>
    data.sources.filter(({ verdict }) => verdict === wanted));
  return section('why', 'Causes', el('p', {}, testSentence(data, differing.length + agreeing.length)),
    differing.length > 0 && [
      sourceTable(differing, 'Sources that differ, sorted by the largest part of a gap that they explain', true),
      el('p', { class: 'soft' }, '\u00b1: standard deviation. Explains: the part of a gap that disappears when this '
        + "source is corrected, shared among the sources; negative where a source hides a part of another's effect."),
      el('h3', {}, 'What to change'),
      el('ul', {}, differing.map(({ name, advice }) => el('li', {}, el('strong', {}, `${name}: `), advice)))],
    agreeing.length > 0 && el('details', {}, el('summary', {}, `Tested without a difference: ${agreeing.length}`),
      sourceTable(agreeing, 'Sources whose difference is within the noise', false)),
    unknown.length > 0 && el('details', {}, el('summary', {}, `Cannot be determined: ${unknown.length}`),
      list(unknown.map(({ name, reason }) => `${name}: ${reason || 'no reason is given'}`))));
}

// ---- gaps

function gapBars(gaps) {
  const names = gaps.map(({ of }) => of);
  const most = gaps.map(({ before, after, floor }) => Math.max(before ?? 0, after ?? 0, floor ?? 0));
  const series = [['before', 'before', 'fix'], ['after', 'after correction of the differences', 'odometry'],
    ['floor', 'floor', 'truth']].map(([key, name, colour]) => ({ key, name, colour, shape: 'plus', r: 9, y: names,
    open: key === 'after',
    kind: key === 'floor' ? 'points' : 'bars',
    x: gaps.map((gap, i) => most[i] > 0 && exists(gap[key]) ? Math.max(gap[key], 0) / most[i] : null),
    show: (i) => plainNumber(gaps[i][key]) + unitAfter('\u00a0', gaps[i].unit) }));
  const labels = (plot) => {
    const bars = plot.shown.filter(({ kind }) => kind === 'bars');
    const part = plot.sy.bandwidth() / Math.max(bars.length, 1);
    const floors = plot.shown.find(({ key }) => key === 'floor')?.x ?? [];
    return bars.flatMap((each, k) => names.flatMap((name, i) => {
      if (!exists(each.x[i])) return [];
      const words = each.show(i), end = plot.sx(each.x[i]) + 6, floor = exists(floors[i]) ? plot.sx(floors[i]) : -99;
      const x = floor > end - 16 && floor < end + 7 * words.length + 10 ? floor + 14 : end;
      return [svg('text', { class: 'outlined', x, y: plot.sy(name) + part * (k + 0.5) + 4 }, words)];
    }));
  };
  return new Plot({ label: 'Gaps before and after', height: 64 * gaps.length, series, labels,
    x: { min: 0, max: 1.35, show: () => '' }, y: { scale: 'band', values: names } }).node;
}

function gapsSection({ gaps }) {
  const title = 'Gaps before and after';
  if (gaps.length === 0) return section('gaps', title, el('p', {}, 'No gap was measured.'));
  const column = (head, text) => ({ head, show: (gap) => text(gap[head]) });
  return section('gaps', title,
    figure({ id: 'gap-bars', title: 'Distance of the real run from a run without any difference',
      caption: 'Each gap has its own scale. Floor: the gap of the simulation, or of noise. Unexplained: the part of '
        + 'the gap that remains after the correction. Unnamed: the part that is corrected by numbers of the '
        + 'calibration that no source names as different.' }, gapBars(gaps)),
    table({ caption: 'The same in numbers', rows: gaps, columns: [{ head: 'gap', key: 'of' }, { head: 'unit' },
      ...['before', 'after', 'floor'].map((head) => column(head, plainNumber)),
      ...['unexplained', 'unnamed'].map((head) => column(head, shareText))] }));
}

// ---- stages

/** A light is a sign, a word and a colour, so that none of them is needed alone. */
const lightWords = { green: ['\u25cf', 'within the limit'], amber: ['\u25b2', 'within twice the limit'],
  red: ['\u25a0', 'beyond twice the limit'], 'cannot tell': ['?', 'with a sigma above the limit'] };

function lightMark(light) {
  if (!lightWords[light]) return noValue;
  return el('span', { class: `light ${light.replace(' ', '-')}` }, `${lightWords[light][0]}\u00a0${light}`);
}

function stagesSection({ rows }) {
  const title = 'Stage by stage';
  if (rows.length === 0) return section('stages', title, el('p', {}, 'No stage was compared.'));
  const count = (light) => rows.filter((row) => row.light === light).length;
  const number = (head) => ({ head, show: (row) => plainNumber(row[head]) });
  const order = ['green', 'cannot tell', 'amber', 'red'];
  const gapText = ({ gap, gap_sigma: sigma }) =>
    exists(gap) && sigma > 0 ? withSigma(gap, sigma).replace(/^\+/, '') : plainNumber(gap);
  return section('stages', title,
    el('p', {}, Object.entries(lightWords).map(([light, [, meaning]], i) =>
      [i > 0 && ', ', lightMark(light), ` ${count(light)} ${meaning}`]),
    `; ${count('none')} without a limit, or without a number to compare with it.`),
    el('div', { class: 'stages' }, table({ caption: 'Both sides, their gap and its limit', rows, columns: [
      { head: 'quantity', key: 'name' }, { head: 'stage', text: true }, { head: 'unit' },
      number('simulated'), number('real'), { head: 'gap', show: gapText },
      { head: 'limit',
        show: ({ limit, limit_key: key }) => [exists(limit) && key && el('small', {}, key), plainNumber(limit)] },
      { head: 'light', text: true, value: ({ light }) => order.includes(light) ? order.indexOf(light) : null,
        show: ({ light }) => lightMark(light) },
      { head: 'note', text: true },
    ] })));
}

// ---- frames

function exhibitName({ simulated: a, real: b }) {
  const turned = a.heading_rad - b.heading_rad, turn = Math.abs(Math.atan2(Math.sin(turned), Math.cos(turned)));
  return `t = ${fixed(a.t_s)} s simulated, ${fixed(b.t_s)} s real; `
    + `${fixed(1000 * Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m), 1)} mm and ${fixed(turn * 180 / Math.PI)}\u00b0 apart`;
}

function captioned(content, words) {
  return el('figure', {}, content, el('figcaption', {}, words));
}

function exhibitStrips(view, name) {
  const strips = [['simulated', view.simulated_strip], ['real', view.real_strip], ['difference', view.difference]]
    .filter(([, image]) => image);
  if (strips.length === 0) return null;
  const grey = view.mean_difference_grey, bearings = ['behind', 'left 90\u00b0', 'ahead', 'right 90\u00b0', 'behind'];
  const apart = exists(grey) ? `; the brightness differs by ${fixed(grey, 1)} grey levels on average` : '';
  return captioned([
    el('div', { class: 'strips' }, strips.map(([kind, src]) =>
      [el('span', {}, kind), el('img', { src, alt: `${name}, ${kind}, unrolled` })])),
    el('div', { class: 'bearings', 'aria-hidden': 'true' }, bearings.map((word) => el('span', {}, word)))],
  `${name === 'lower' ? 'Lower' : 'Upper'} mirror unrolled${apart}.`);
}

function exhibitNode({ views }) {
  return Object.entries(views).map(([name, view]) => [
    view.notes.map((note) => el('p', { class: 'warning' }, note)),
    el('div', { class: 'pairs' },
      ['simulated', 'real'].filter((side) => view[side]).map((side) =>
        captioned(el('img', { src: view[side], alt: `${name}, ${side}` }), `${name}, ${side}`)),
      view.simulated && view.real && captioned(el('div', { class: 'blend' },
        el('img', { src: view.simulated, alt: `${name}, blended` }), el('img', { src: view.real, alt: '' })),
      `${name}, real over simulated`)),
    exhibitStrips(view, name)]);
}

function framesSection({ exhibits, difference_scale: scale }) {
  if (exhibits.length === 0) return null;
  const holder = el('div', { class: 'frames' });
  const show = (i) => holder.replaceChildren(...[exhibitNode(exhibits[i])].flat(Infinity).filter(Boolean));
  const blend = (percent) => holder.style.setProperty('--real', percent / 100);
  show(0);
  blend(50);
  return section('frames', 'Frames', el('div', { class: 'sliders screen-only' },
    slider({ label: 'frame', min: 0, max: exhibits.length - 1, value: 0, show: (i) => exhibitName(exhibits[i]),
      oninput: show }),
    slider({ label: 'blend', min: 0, max: 100, value: 50, show: (part) => `${100 - part} % simulated, ${part} % real`,
      oninput: blend })), holder,
  el('p', { class: 'soft' }, `Difference: real darker by ${scale.strongest_grey} grey levels or more `,
    el('span', { class: 'ramp', style: `background:linear-gradient(to right,${scale.colours.join()})` }),
    ' real brighter; white: equal. The simulated strip is turned by the difference of the headings, so that bearings '
    + 'of the world line up.'));
}

// ---- residuals and paths

/** Returns a legend that plots have in common; it hides and shows series in all of them. */
function commonLegend(plots, entries) {
  const hidden = plots[0].hidden, node = el('div', { class: 'legend', role: 'group', 'aria-label': 'Series' });
  for (const plot of plots) plot.hidden = hidden;
  const fill = () => fillLegend(node, entries, hidden, () => {
    for (const plot of plots) plot.render();
    fill();
  });
  fill();
  return node;
}

function residualFigure({ residuals, map }, axis) {
  const time = axis === 't_s';
  const panels = [['simulated', residuals.simulated, 'before_m'], ['real, as measured', residuals.real, 'before_m'],
    ['real, corrected', residuals.real, 'after_m']].map(([title, points, key]) =>
    [title, residualSeries(points, map.landmarks, axis, key)]);
  const all = panels.flatMap(([, series]) => series);
  if (all.length === 0) return null;
  const sizes = all.flatMap(({ y }) => y).map(Math.abs), limit = 1.08 * Math.max(readableLimit(sizes), 1e-3);
  const [from, to] = d3.extent(all.flatMap(({ x }) => x)), margin = Math.max(0.03 * (to - from), 0.01);
  const plots = panels.map(([title, series]) => new Plot({ label: `${title}: range residuals`, height: 260,
    mode: time ? 'x' : 'xy', series: [...series, { name: 'zero', kind: 'rule', colour: 'paper', y: 0, legend: false }],
    x: { label: time ? 'time' : 'range', unit: time ? 's' : 'm', min: from - margin, max: to + margin },
    y: { label: title, unit: 'mm', min: -limit, max: limit } }));
  const entries = all.map(({ name, colour, shape }) => ({ name, colour, shape, kind: 'points' }));
  const every = Math.max(residuals.simulated.every, residuals.real.every);
  return figure({ id: time ? 'residuals_time' : 'residuals_range',
    title: `Range residuals against ${time ? 'time' : 'range'}`,
    caption: 'Each measured range minus the distance to the reference pose. Corrected: after correction of the '
      + 'differences that were found. All three panels have the same scale.'
      + `${d3.max(sizes) > limit ? ' Triangles mark points beyond the axis.' : ''}`
      + `${every > 1 ? ` One in ${every} points is drawn.` : ''}` },
  commonLegend(plots, entries), el('div', { class: 'panels' }, plots.map(({ node }) => node)));
}

function bothPathsFigure({ paths, map, overhead, reference, rendered_again: again }) {
  const looks = [['odometry', 'real odometry', 'odometry', '8,4'],
    ['real', reference ? `real (${reference})` : 'real', 'truth', null], ['simulated', 'simulated', 'fix', '2,3']];
  const layers = looks.map(([key, name, colour, dash]) => {
    const { t_s, x_m, y_m } = paths[key];
    return { name, colour, dash, halo: true,
      points: x_m.map((x, i) => exists(x) && exists(y_m[i]) ? [x, y_m[i]] : null),
      show: (i) => `t = ${fixed(t_s[i])} s, x ${fixed(x_m[i], 3)} m, y ${fixed(y_m[i], 3)} m` };
  }).filter(({ points }) => points.length > 0);
  if (layers.length === 0) return null;
  const one = again ? " The simulated images were rendered at the real run's poses, so there is one path." : '';
  const [x0, y0, x1, y1] = map.bounds_m;
  const plan = new Plan({ map, underlay: overhead, label: 'Both paths from above', tallest: 760,
    bounds_m: x0 < x1 && y0 < y1 ? map.bounds_m : boundsOf(layers.flatMap(({ points }) => points.filter(Boolean))) });
  plan.update({ paths: layers });
  return figure({ id: 'paths', title: 'Both paths',
    caption: `${overhead ? 'Over the arena from above as POV-Ray sees it.' : 'Over the plan drawn from the map.'} Axes `
      + `in metres.${one}` },
  plan.node);
}

// ---- the page

export function comparePage(data) {
  const { simulated, real, frames, matched, reference, notes, exhibits } = data;
  const named = (name) => name || 'not named';
  const headline = compareHeadline(data), tests = otherSources(data);
  const shownFrames = framesSection(data), paths = figures(bothPathsFigure(data));
  const residuals = figures(residualFigure(data, 't_s'), residualFigure(data, 'range_m'));
  const missing = [!shownFrames && 'No frames are shown: there is no matched pair of images.',
    !residuals && 'No range residuals are shown.', !paths && 'No paths are shown.'].filter(Boolean);
  const ofImages = exhibits.flatMap(({ views }) => Object.values(views).flatMap((view) => view.notes));
  const again = data.rendered_again ? ", rendered at the real run's poses" : '';
  showPage({ title: `twocone compare: ${named(simulated)} against ${named(real)}`,
    lead: [el('p', { class: headline.length > 160 ? 'headline long' : 'headline' }, headline),
      tests && el('p', {}, tests)],
    sections: [
      section('what', 'What was compared', facts([
        ['simulated', `${named(simulated)}, ${frames.simulated} frames${again}`],
        ['real', `${named(real)}, ${frames.real} frames`],
        ['matched', `${matched.by_time} frames by time, ${matched.by_pose} by pose`],
        ['poses of the real robot', reference || 'unknown']]),
      notes.length > 0 && [el('h3', {}, 'Notes'), list(notes)]),
      causesSection(data), gapsSection(data), stagesSection(data), shownFrames,
      residuals && section('residuals', 'Residuals', residuals), paths && section('paths-over', 'Paths', paths),
      section('page-notes', 'Notes on this page',
        list([...new Set([...data.page_notes, ...ofImages, ...missing])], 'Nothing is missing.')),
    ] });
}
