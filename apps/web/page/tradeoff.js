// SPDX-License-Identifier: Apache-2.0
// The page of a sweep: what accuracy costs in time.
import { el, svg, exists, fixed, noValue, paint, button } from './kit.js';
import { showPage, section, facts, list, table, figure, figures } from './kit.js';
import { Plot, markerPath } from './plot.js';

// ---- logic without DOM

/** Returns a number with that many significant digits, as the program's own tables have it. */
export function tableNumber(value, digits = 3) {
  if (!exists(value)) return noValue;
  if (value === 0) return '0';
  return fixed(value, Math.min(Math.max(digits - 1 - Math.floor(Math.log10(Math.abs(value))), 0), 6));
}

/** The ends of the interval of a column: of `simulation_s` in `simulation_low_s` and `simulation_high_s`. */
function intervalOf(setting, column) {
  return ['low', 'high'].map((end) => setting[column.replace(/(_(?:m|s|rad))?$/, `_${end}$1`)]);
}

/** The two planes. `x` is the column of a cost in seconds; it is shown in `unit`. */
export const costPlanes = {
  simulation: { title: "Mean position error against the simulation's time for a frame", unit: 's', unit_s: 1,
    frontier: 'simulation_frontier', x: 'simulation_s', label: 'simulation time of a frame, one core', time: '',
    caption: 'Simulation time: robot time plus the median processor time of rendering both images.' },
  robot: { title: "Mean position error against the robot's time for a frame", unit: 'ms', unit_s: 1e-3,
    frontier: 'robot_frontier', x: 'robot_p95_s', label: 'robot time of a frame, one core', time: ' a stereo frame',
    caption: 'Robot time: vision and localisation of one frame on one core, 95 % quantile. --budget-ms limits this '
      + "time. The paper's star is for a whole stereo frame on the computer of its day, ranging included." },
};

/**
 * Returns the marks of a plane by rising cost: { index, setting, x, y, xs: [low, high], ys, onFrontier, answers }, in
 * the plane's unit and mm. What has no place on logarithmic axes is left out.
 */
export function planeMarks({ settings, least_answered: least }, plane) {
  const ends = ([low, high], unit) => [(low ?? 0) / unit, (high ?? Infinity) / unit];
  return settings.map((setting, index) => ({ index, setting,
    x: setting[plane.x] / plane.unit_s, xs: ends(intervalOf(setting, plane.x), plane.unit_s),
    y: setting.position_mean_m / 1e-3, ys: ends(intervalOf(setting, 'position_mean_m'), 1e-3),
    onFrontier: setting[plane.frontier] === 1, answers: setting.answered >= least * setting.frames_observed }))
    .filter(({ x, y }) => x > 0 && y > 0 && exists(x) && exists(y)).sort((a, b) => a.x - b.x || a.y - b.y);
}

/** Returns the points [x, y] that no other point undercuts, by rising x. */
export function lowestPoints(points) {
  const lowest = [];
  for (const point of [...points].sort(([a, b], [c, d]) => a - c || b - d)) {
    if (lowest.length === 0 || point[1] < lowest.at(-1)[1]) lowest.push(point);
  }
  return lowest;
}

/** Returns the lowest bounds [x, y] of the settings that use all that an image holds, by rising cost. */
export function boundPoints({ settings }, plane) {
  return lowestPoints(settings.filter(({ estimator }) => estimator === 'fine' || estimator === 'adaptive')
    .map((setting) => [setting[plane.x] / plane.unit_s, setting.bound_m / 1e-3]).filter(([x, y]) => x > 0 && y > 0));
}

/** Returns [low, high] of a logarithmic axis that shows all values, with some air. */
export function planeRange(values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const air = 10 ** (0.06 * Math.max(Math.log10(high / low), 0.5));
  return [low / air, high * air];
}

function millimetresOf(length_m) {
  return String(Number((1000 * length_m).toPrecision(6)));
}

/** The axes of a sweep: the value of a setting as text, by which settings are filtered. */
export const sweepAxes = {
  size: ({ width_px, height_px }) => `${width_px} \u00d7 ${height_px}`,
  rays: ({ antialias }) => antialias > 1 ? `+R${antialias}` : noValue,
  effects: ({ effects }) => effects,
  estimator: (s) => exists(s.enough_m) ? `${s.estimator} to ${millimetresOf(s.enough_m)} mm` : s.estimator,
  landmarks: ({ landmarks }) => String(landmarks),
  bearings: ({ bearings }) => bearings ? 'yes' : 'no',
  'rate/Hz': ({ rate_hz }) => String(rate_hz),
  frames: ({ frames }) => String(frames),
  frontier: (setting) => setting.robot_frontier || setting.simulation_frontier ? 'on a frontier' : 'on none',
};

/** Returns whether a setting has all wanted values. @param filter by axis; an axis without a value allows all */
export function hasValues(setting, filter) {
  return Object.entries(filter).every(([axis, value]) => !value || sweepAxes[axis](setting) === value);
}

/** Returns [axis, values in order] of the axes on which settings differ. */
export function axisValues(settings) {
  return Object.entries(sweepAxes).map(([axis, value]) => [axis, [...new Set(settings.map(value))]
    .sort((a, b) => a.localeCompare(b, 'en', { numeric: true }))]).filter(([, values]) => values.length > 1);
}

/** Returns the value that most settings have; of equally frequent ones the smallest. */
function mostCommon(values) {
  const count = (value) => values.filter((each) => each === value).length;
  return [...values].sort((a, b) => count(b) - count(a) || a - b)[0];
}

/** Returns a function that names a setting by what differs from most settings: "320x240 +R2 fine x4". */
export function shortNames(settings) {
  const landmarks = mostCommon(settings.map((each) => each.landmarks));
  const rate = mostCommon(settings.map((each) => each.rate_hz));
  return (s) => [`${s.width_px}x${s.height_px}`, s.antialias > 1 && `+R${s.antialias}`,
    s.effects !== 'scene' && s.effects, s.estimator, exists(s.enough_m) && `${millimetresOf(s.enough_m)}mm`,
    s.landmarks !== landmarks && `${s.landmarks}lm`, !s.bearings && s.estimator !== 'paper' && 'ranges',
    s.frames > 1 && `x${s.frames}`, s.rate_hz !== rate && `${s.rate_hz}Hz`].filter(Boolean).join(' ');
}

export function sweepHeadline({ settings }) {
  const marks = planeMarks({ settings }, costPlanes.simulation).filter(({ onFrontier }) => onFrontier);
  if (marks.length === 0) return 'No setting answers often enough to be on a frontier.';
  const [first, last] = [marks[0], marks.at(-1)];  // along a frontier the error falls while the cost rises
  return `${tableNumber(first.y, 2)} mm take ${tableNumber(first.x, 2)} s of processor time per frame in simulation, `
    + `${tableNumber(last.y, 2)} mm take ${tableNumber(last.x, 2)} s: ${settings.length} settings, ${marks.length} of `
    + 'them on the frontier.';
}

/** Returns a setting with its accuracy and costs, in lines. */
export function settingWords(s, least_answered) {
  const within = (unit, value) => {
    const ends = intervalOf(s, value).filter(exists).map((end) => tableNumber(end / unit));
    return tableNumber(s[value] / unit) + (ends.length === 2 ? ` (${ends[0]} to ${ends[1]})` : '');
  };
  const mm = (value) => `${tableNumber(s[value] / 1e-3)} mm`, ms = (value) => `${tableNumber(s[value] / 1e-3)} ms`;
  const on = [s.robot_frontier && 'robot time', s.simulation_frontier && 'simulation time'].filter(Boolean);
  const covered = exists(s.coverage)
    ? `; 95 % ellipses contain the truth in ${within(0.01, 'coverage')} %` : '';
  const enough = s.answered > 0 && s.answered >= least_answered * s.frames_observed;
  return [s.is,
    exists(s.position_mean_m) && `error: mean ${within(1e-3, 'position_mean_m')} mm; 95 % below `
      + `${mm('position_p95_m')}; max ${mm('position_max_m')}`,
    exists(s.heading_mean_rad) && `heading: mean ${within(Math.PI / 180, 'heading_mean_rad')}\u00b0`,
    `answered: ${s.answered} of ${s.frames_observed} frames${covered}`,
    exists(s.bound_m) && `bound (Cram\u00e9r-Rao), rms: ${mm('bound_m')}`,
    `robot: ${within(1e-3, 'robot_p95_s')} ms (95 % quantile); medians: vision ${ms('vision_median_s')}, `
      + `localisation ${ms('localisation_median_s')}`,
    `rendering: ${within(1, 'render_median_s')} s; simulation: ${tableNumber(s.simulation_s)} s`,
    `memory: ${fixed(s.peak_bytes / 2 ** 20, 0)} MiB, POV-Ray ${fixed(s.render_bytes / 2 ** 20, 0)} MiB`,
    on.length > 0 ? `on the frontier of ${on.join(' and of ')}`
      : enough ? 'dominated' : 'does not answer often enough for a frontier'].filter(Boolean);
}

/**
 * Returns the upper left corner of free space for words, and adds their box to `keep`: boxes [left, top, right, bottom,
 * weight] that should not be covered. Of equally free places the nearer one is better; of equally near ones, the one
 * below and to the left. @param frame [left, top, right, bottom] that limits the space
 */
export function placeWords(keep, frame, [px, py], width, height) {
  const directions = [135, 157.5, 112.5, 180, 90, 202.5, 67.5, 225, 45, 247.5, 22.5, 270, 0, 292.5, 337.5, 315];
  const overlap = (a, b, from, to) => Math.max(Math.min(b, to) - Math.max(a, from), 0);
  let best = [px - width / 2, py - height / 2], least = Infinity;
  for (const gap of [7, 11, 16, 22, 30, 40, 52]) {
    directions.forEach((degrees, turn) => {
      const angle = degrees * Math.PI / 180;
      const x = px + Math.cos(angle) * (gap + width / 2) - width / 2;
      const y = py + Math.sin(angle) * (gap + height / 2) - height / 2;
      if (x < frame[0] || y < frame[1] || x + width > frame[2] || y + height > frame[3]) return;
      let penalty = 0.6 * gap + 0.05 * turn;
      for (const [left, top, right, bottom, weight] of keep) {
        penalty += weight * overlap(x, x + width, left, right) * overlap(y, y + height, top, bottom);
      }
      if (penalty < least) [best, least] = [[x, y], penalty];
    });
  }
  keep.push([...best, best[0] + width, best[1] + height, 5]);
  return best;
}

/** Adds boxes along a line. */
function keepLine(keep, [x0, y0], [x1, y1], weight) {
  const steps = Math.min(Math.max(1, Math.ceil(Math.hypot(x1 - x0, y1 - y0) / 4)), 500);
  for (let i = 0; i <= steps; ++i) {
    const x = x0 + (x1 - x0) * i / steps, y = y0 + (y1 - y0) * i / steps;
    keep.push([x - 1.5, y - 1.5, x + 1.5, y + 1.5, weight]);
  }
}

// ---- a plane

const levelLooks = { paper: ['paper', 'square'], found: ['c4', 'triangle'], coarse: ['c5', 'diamond'],
  fine: ['c1', 'circle'], adaptive: ['c2', 'down'] };

/** Returns the series of a plane, of the settings that `shows` allows. */
function planeSeries(data, plane, marks, [xRange, yRange], shows) {
  const rarely = `answers under ${fixed(100 * data.least_answered, 0)} %`;
  const entry = (name, colour, more) => ({ name, colour, kind: 'points', x: [], y: [], hover: false, ...more });
  const clamped = (held, key, k, [low, high]) => held.map((mark) => Math.min(Math.max(mark[key][k], low), high));
  const solid = ({ onFrontier, index }) => onFrontier || index === data.baseline || index === data.as_is;
  const series = [], kept = marks.filter(({ setting }) => shows(setting));
  for (const wanted of [false, true]) {
    for (const [level, [colour, shape]] of Object.entries(levelLooks)) {
      const all = kept.filter((mark) => mark.setting.estimator === level && solid(mark) === wanted);
      const bars = (held) => wanted && { xLow: clamped(held, 'xs', 0, xRange), xHigh: clamped(held, 'xs', 1, xRange),
        low: clamped(held, 'ys', 0, yRange), high: clamped(held, 'ys', 1, yRange) };
      const add = (tags, held, more) => held.length > 0 && series.push({ name: [level, ...tags].join(', '),
        tags: [level, ...tags], colour, shape, kind: 'points', r: wanted ? 4 : 2.4, legend: false, marks: held,
        x: held.map(({ x }) => x), y: held.map(({ y }) => y), ...bars(held), ...more,
        show: (i) => settingWords(held[i].setting, data.least_answered).join('\n') });
      const often = all.filter(({ answers }) => answers || wanted), also = wanted ? [] : ['dominated'];
      add([rarely], all.filter(({ answers }) => !answers && !wanted), { shape: 'cross' });
      add(['one frame', ...also], often.filter(({ setting }) => setting.frames === 1), { open: true });
      add(['several frames', ...also], often.filter(({ setting }) => setting.frames > 1));
    }
  }
  const levels = Object.entries(levelLooks).filter(([level]) => data.settings.some((each) => each.estimator === level));
  const frontier = marks.filter(({ onFrontier }) => onFrontier), bound = boundPoints(data, plane);
  return [...levels.map(([level, [colour, shape]]) => entry(level, colour, { shape })),
    entry('one frame', 'ink', { open: true, key: 'any shape' }), entry('several frames', 'ink', { key: 'any shape' }),
    entry('dominated', 'ink', { key: 'small' }),
    marks.some(({ answers }) => !answers) && entry(rarely, 'ink', { shape: 'cross' }),
    frontier.length > 0 && { name: 'frontier', kind: 'steps', colour: 'c8', hover: false,
      x: [frontier[0].x, ...frontier.map(({ x }) => x), xRange[1]],
      y: [yRange[1], ...frontier.map(({ y }) => y), frontier.at(-1).y] },
    bound.length > 0 && { name: 'bound (Cram\u00e9r-Rao), rms', kind: 'line', colour: 'bound', dash: '7,4',
      hover: false, x: bound.map(([x]) => x), y: bound.map(([, y]) => y) }, ...series].filter(Boolean);
}

function starPath(x, y, r) {
  const corners = Array.from({ length: 10 }, (_, i) => [r * (i % 2 ? 0.4 : 1), i * Math.PI / 5]);
  return `M${corners.map(([size, angle]) => [x + size * Math.sin(angle), y - size * Math.cos(angle)]).join('L')}z`;
}

/** Returns the words in a plane: numbers of the frontier, the paper's star, the choice's ring, and some names. */
function planeWords(plot, data, plane, marks, paper, shows) {
  const frame = [plot.left + 2, plot.top, plot.right, plot.bottom - 2], nodes = [], keep = [];
  const at = ({ x, y }) => [plot.sx(x), plot.sy(y)];
  const isInside = ([x, y]) => x >= frame[0] && x <= frame[2] && y >= frame[1] && y <= frame[3];
  const put = (place, words) => {
    if (!isInside(place)) return;
    const [x, y] = place, width = words.length * 6.3 + 2, [left, top] = placeWords(keep, frame, place, width, 13);
    const nearX = Math.min(Math.max(x, left), left + width), nearY = Math.min(Math.max(y, top), top + 13);
    const reach = Math.hypot(nearX - x, nearY - y), to = [x + (nearX - x) * 6 / reach, y + (nearY - y) * 6 / reach];
    if (reach > 12) nodes.push(svg('path', { class: 'axis', d: `M${nearX},${nearY}L${to}` }));
    nodes.push(svg('text', { class: 'outlined', x: left + width / 2, y: top + 11, 'text-anchor': 'middle' }, words));
  };
  const shown = marks.filter(({ setting }) => shows(setting)), frontier = marks.filter(({ onFrontier }) => onFrontier);
  for (const mark of shown) {
    const [x, y] = at(mark);
    keep.push([x - 6, y - 6, x + 6, y + 6, mark.onFrontier ? 3 : 0.6]);
    if (!mark.onFrontier) continue;
    const [[left, right], [low, high]] = [mark.xs, mark.ys].map(([a, b]) => [Math.max(a, 1e-9), Math.min(b, 1e9)]);
    keep.push([x - 1.5, plot.sy(high), x + 1.5, plot.sy(low), 1], [plot.sx(left), y - 1.5, plot.sx(right), y + 1.5, 1]);
  }
  for (const { kind, x, y } of plot.shown.filter((each) => each.kind !== 'points')) {
    const corners = x.flatMap((value, i) => [...(kind === 'steps' && i > 0 ? [[value, y[i - 1]]] : []), [value, y[i]]])
      .map(([a, b]) => [plot.sx(a), plot.sy(b)]);
    corners.slice(1).forEach((to, i) => keepLine(keep, corners[i], to, 0.8));
  }
  const star = at(paper), choice = shown.find(({ index }) => index === data.choice?.setting);
  keep.push([star[0] - 9, star[1] - 9, star[0] + 9, star[1] + 9, 5]);
  if (isInside(star)) nodes.push(paint(svg('path', { class: 'area', d: starPath(...star, 9) }), 'ink'));
  if (choice && isInside(at(choice))) {
    nodes.push(paint(svg('path', { class: 'thin', d: markerPath('circle', ...at(choice), 9) }), 'ink'));
  }
  frontier.forEach((mark, i) => shows(mark.setting) && put(at(mark), String(i + 1)));
  put(star, `the paper, 2006: ${fixed(paper.y, 0)} mm, about ${data.paper.time_s} s${plane.time}`);
  const named = [[data.baseline, 'method paper, measured here'], [data.as_is, 'robot file, unchanged'],
    [choice?.index, 'the choice']];
  for (const [index, words] of named) {
    const mark = shown.find((each) => each.index === index);
    if (mark) put(at(mark), words);
  }
  return nodes;
}

/** Returns the numbered list of the frontier. It is a drawing too, so that it is saved with the plane. */
function frontierList(marks, unit, name) {
  const rows = [[['', 'on the frontier', 'mm', unit]], ...marks.filter(({ onFrontier }) => onFrontier).map((mark, i) =>
    [[i + 1, name(mark.setting), tableNumber(mark.y), tableNumber(mark.x)], mark.index])];
  const columns = [[18, 'end'], [24, 'start'], [282, 'end'], [338, 'end']], height = rows.length * 17 + 6;
  return svg('svg', { class: 'drawing frontier', width: 344, height, viewBox: `0 0 344 ${height}` },
    rows.map(([words, index], i) => svg('g', { 'data-setting': index },
      svg('rect', { class: 'surface', y: i * 17, width: 344, height: 17 }), words.map((word, k) => svg('text',
        { class: i === 0 && 'tick', x: columns[k][0], y: i * 17 + 13, 'text-anchor': columns[k][1] }, word)))));
}

/** Returns { node, plot, refresh } of a plane. @param point is called with the setting that is pointed at, or none */
function planeFigure(data, key, shows, point) {
  const plane = costPlanes[key], marks = planeMarks(data, plane);
  const paper = { x: data.paper.time_s / plane.unit_s, y: data.paper.mean_error_m / 1e-3 };
  const ranges = [planeRange([paper.x, ...marks.map(({ x }) => x)]),
    planeRange([paper.y, ...marks.map(({ y }) => y), ...boundPoints(data, plane).map(([, y]) => y)])];
  const series = () => planeSeries(data, plane, marks, ranges, shows);
  const plot = new Plot({ label: plane.title, height: 600, mode: 'xy', series: series(),
    labels: () => planeWords(plot, data, plane, marks, paper, shows),
    x: { label: plane.label, unit: plane.unit, scale: 'log', min: ranges[0][0], max: ranges[0][1] },
    y: { label: 'mean position error', unit: 'mm', scale: 'log', min: ranges[1][0], max: ranges[1][1] },
    onHover: (at) => point(at?.each.marks?.[at.i].index, plot),
    onPick: (_, each, i) => point(each.marks?.[i].index, plot, true) });
  const silent = data.settings.filter(({ position_mean_m: mean }) => !exists(mean)).length;
  const node = figure({ id: `${key}_time`, title: plane.title,
    caption: `${plane.caption} Marks with 95 % intervals are on the frontier; no swept setting is below the staircase `
      + 'line. Small marks are dominated, and crosses answer too rarely. The dashed line connects the smallest '
      + 'Cram\u00e9r-Rao bounds of settings fine and adaptive, with all landmarks of the map and, for several frames, '
      + 'with wheels that measure their motion exactly. Bounds are root mean squares; a mean error can be as small as '
      + `0.8 times its own root mean square.${exists(data.choice?.setting) ? ' The ring marks the choice.' : ''}`
      + `${silent > 0 ? ` ${silent} of ${data.settings.length} settings never answered and are not drawn.` : ''}`
      + ' Point at a mark, or use the arrow keys, to see its setting; a click shows it in the table. Drag to zoom; '
      + 'Escape shows everything.' },
  el('div', { class: 'plane' }, plot.node, frontierList(marks, plane.unit, shortNames(data.settings))));
  return { node, plot, refresh: () => plot.update(series()) };
}

// ---- the table

function meanText(setting) {
  const { position_mean_m: mean } = setting, [low, high] = intervalOf(setting, 'position_mean_m');
  const within = exists(high) && el('small', {}, ` ${tableNumber(low / 1e-3)}\u2013${tableNumber(high / 1e-3)}`);
  return exists(mean) ? [tableNumber(mean / 1e-3), within] : noValue;
}

function settingsTable(settings) {
  const words = (head, key = head) => ({ head, key, show: sweepAxes[head] });
  const levels = Object.keys(levelLooks);
  const numbers = [['RMSE/mm', 'position_rmse_m', 1e-3], ['95 %/mm', 'position_p95_m', 1e-3],
    ['max/mm', 'position_max_m', 1e-3], ['heading/\u00b0', 'heading_mean_rad', Math.PI / 180],
    ['range/mm', 'range_mean_m', 1e-3], ['answered/%', 'answered', 0.01], ['coverage/%', 'coverage', 0.01],
    ['bound/mm', 'bound_m', 1e-3], ['vision/ms', 'vision_median_s', 1e-3],
    ['localisation/ms', 'localisation_median_s', 1e-3], ['robot 95 %/ms', 'robot_p95_s', 1e-3],
    ['rendering/s', 'render_median_s', 1], ['simulation/s', 'simulation_s', 1], ['memory/MiB', 'peak_bytes', 2 ** 20]];
  const valueOf = (s, key) => key === 'answered' ? s.answered / s.frames_observed : s[key];
  const caption = 'Errors are position errors unless stated otherwise; small numbers: 95 % interval';
  return table({ caption, rows: settings, columns: [
    { head: 'size/px', value: (s) => s.width_px * s.height_px,
      show: (s) => el('span', { 'data-setting': settings.indexOf(s) }, sweepAxes.size(s)) },
    { head: 'frontier', title: 'R: of robot time, S: of simulation time',
      value: (s) => s.robot_frontier + 2 * s.simulation_frontier,
      show: (s) => [s.robot_frontier && 'R', s.simulation_frontier && 'S'].filter(Boolean).join('\u2009') },
    words('rays', 'antialias'), words('effects'),
    { ...words('estimator'), text: true, value: (s) => levels.indexOf(s.estimator) + (s.enough_m ?? 0) },
    words('landmarks'), words('bearings'), words('rate/Hz', 'rate_hz'), words('frames'),
    { head: 'mean/mm', key: 'position_mean_m', show: meanText },
    ...numbers.map(([head, key, unit]) => ({ head, value: (s) => valueOf(s, key),
      show: (s) => exists(valueOf(s, key)) ? tableNumber(valueOf(s, key) / unit) : noValue })),
  ] });
}

// ---- the page

/** Returns the choice of settings to show: { node, shows(setting) }. */
function settingsFilter(settings, changed) {
  const count = el('span', { class: 'soft', role: 'status' });
  const apply = () => {
    const kept = settings.filter(shows).length;
    count.textContent = kept === settings.length ? '' : `${kept} of ${settings.length} settings are shown`;
    changed();
  };
  const selects = axisValues(settings).map(([axis, values]) => el('select', { name: axis, 'aria-label': axis },
    ['', ...values].map((value) => el('option', { value }, `${axis}: ${value || 'all'}`))));
  const shows = (setting) => hasValues(setting, Object.fromEntries(selects.map(({ name, value }) => [name, value])));
  const clear = button('Show all', () => {
    for (const select of selects) select.value = '';
    apply();
  });
  const attributes = { class: 'filters screen-only', role: 'group', 'aria-label': 'Settings to show', onchange: apply };
  return { shows, node: el('div', attributes, selects, clear, count) };
}

export function tradeoffPage(data) {
  const { settings, choice } = data;
  const { node: filters, shows } = settingsFilter(settings, () => {
    rows.forEach((row, index) => row.hidden = !shows(settings[index]));
    for (const { refresh } of planes) refresh();
  });
  const all = el('div', { id: 'all' }, settingsTable(settings));
  const rows = settings.map((_, index) => all.querySelector(`[data-setting="${index}"]`).closest('tr'));
  const isOnFrontier = (setting) => setting.robot_frontier + setting.simulation_frontier > 0;
  rows.forEach((row, index) => row.classList.toggle('on-frontier', isOnFrontier(settings[index])));
  // Marks a setting in the table, in the lists, and in all planes but the one that is pointed at.
  const point = (index, from, wantsRow) => {
    for (const each of document.querySelectorAll('.pointed')) each.classList.remove('pointed');
    for (const each of document.querySelectorAll(`[data-setting="${index}"]`)) {
      (each.closest('tr') ?? each).classList.add('pointed');
    }
    for (const { plot } of planes) {
      if (plot !== from) plot.ring(plot.shown.flatMap(({ marks = [] }) => marks).find((each) => each.index === index));
    }
    if (wantsRow) rows[index]?.scrollIntoView({ block: 'center' });
  };
  const planes = Object.keys(costPlanes).map((key) => planeFigure(data, key, shows, point));
  for (const each of [all, ...planes.map(({ node }) => node.querySelector('.frontier'))]) {
    each.addEventListener('pointerover', ({ target }) => {
      const at = target.closest('tr')?.querySelector('[data-setting]') ?? target.closest('[data-setting]');
      point(at ? Number(at.dataset.setting) : undefined);
    });
    each.addEventListener('pointerleave', () => point(undefined));
  }
  const link = (file) => el('a', { href: file }, file);
  showPage({ title: `twocone tradeoff: robot ${data.robot}, seed ${data.seed}`,
    lead: [el('p', { class: 'headline' }, sweepHeadline(data)),
      el('div', { class: 'columns' }, data.rules.map((rule) => el('p', {}, rule))),
      choice?.why && el('p', { class: 'choice' }, choice.why)],
    sections: [
      section('images', 'What accuracy costs in time', filters, figures(planes.map(({ node }) => node))),
      section('conclusions', 'Effect and cost of each axis',
        list(Object.values(data.conclusions), 'All settings are equal.')),
      section('growth', 'Growth of error and time', el('p', {}, 'Exponents of power laws, with 95 % intervals:'),
        list(data.growth, 'None was found.')),
      section('settings', 'All settings', el('p', {}, 'The same data as files: ', link('tradeoff.csv'),
        ' (with times and frontiers), ', link('errors.csv'), " (what does not depend on the machine's speed), ",
        link('tradeoff.json'), ' (with the sentences).'), all),
      section('repeat', 'How to repeat this',
        el('p', {}, 'The same version makes the same errors byte for byte, and its own times:'),
        el('pre', { class: 'command' }, data.repeat), facts([['twocone', `${data.version}, commit ${data.commit}`],
          ...['compiler', 'machine', 'robot', 'map', 'seed', 'episodes'].map((name) => [name, data[name]]),
          ['landmarks, the most important first', data.landmarks.join(', ')]])),
    ] });
}
