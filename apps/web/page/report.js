// SPDX-License-Identifier: Apache-2.0
// The report of one run. The keys of its data are described in apps/report/run_json.cpp and report.cpp.
import { el, svg, svgPath, svgText, exists, fixed, significant, quantity, percent, plural, noValue } from './kit.js';
import { showPage, section, facts, list, tiles, judgement, table, figure, figures, watchWidth } from './kit.js';
import { verdictOf, verdictChip, byFrequency, shareBar, swatch, setAttributes } from './kit.js';
import { Plot, histogram, linkPlots, markerShapes, readableLimit } from './plot.js';
import { Plan, boundsOf } from './plan.js';
import { distanceBetween } from './player.js';
import { staggeredRows } from './mirrors.js';
import { RunView } from './runview.js';

const scaled = (value, scale) => exists(value) ? scale * value : undefined;
const inMm = (value_m) => scaled(value_m, 1000);
const mmText = (value_m, digits = 3) => `${significant(inMm(value_m), digits)}\u00a0mm`;

// ---- the run in words

/** The result in one sentence. */
export function reportHeadline({ summary: { frames, fix }, paper }) {
  if (frames === 0) return 'This run has no frames.';
  if (fix.frames_with_fix === 0) return `None of ${plural(frames, 'frame')} has a position.`;
  if (!fix.position_error) {
    return `${fix.frames_with_fix} of ${frames} frames have a position; without ground truth its error is unknown.`;
  }
  return "From one stereo frame at a time, the robot's position is off by "
    + `${mmText(fix.position_error.mean_m, 2)} on average; the paper reports ${paper.position_mean_mm} mm.`;
}

/** Whether the run is as good as the paper: true, false, or undefined without ground truth; and why, in words. */
export function reportVerdict({ summary: { frames, fix }, paper, has_truth }) {
  const missing = `${frames - fix.frames_with_fix} of ${frames} frames have no position.`;
  if (!has_truth) return { met: undefined, text: `without ground truth it cannot be judged; ${missing}` };
  const error = fix.position_error;
  if (!error) return { met: false, text: missing };
  const [mean_mm, max_mm] = [inMm(error.mean_m), inMm(error.max_m)];
  return { met: mean_mm <= paper.position_mean_mm && max_mm <= paper.position_within_mm,
    text: `mean ${fixed(mean_mm)} mm, worst ${fixed(max_mm)} mm; ${missing}` };
}

function rules(data) {
  const { met, text } = reportVerdict(data), { position_mean_mm, position_within_mm } = data.paper;
  const paragraph = (head, words) => el('p', {}, el('strong', {}, head), words);
  return el('div', { class: 'columns' }, el('div', {},
    paragraph('Criterion of success.', ' As good as the paper: over every frame with a position the mean error is at '
      + `most ${position_mean_mm} mm and none is above ${position_within_mm} mm. Nothing is left out: of two answers `
      + 'to one frame the worse one counts, and a frame without an answer is counted by its reason (the paper writes '
      + '0 for it).'),
    el('p', {}, judgement(met, met === undefined ? 'Not judged:' : met ? 'Met:' : 'Not met:'), ` ${text}`)),
  el('div', {}, data.has_truth
    ? paragraph('Precision of the truth.', " The truth is the simulated world's own pose: the numbers that place the "
      + 'cameras in the scene, written with every digit. A true range is the distance from there to the landmark\'s '
      + 'axis in the map, so it is exact as far as the map agrees with the scene. No behaviour and no estimator reads '
      + 'the truth.')
    : paragraph('No ground truth.', ' This run has none (a real robot in a real room), so only coverage is reported '
      + 'below, and no error.'),
  el('p', { class: 'soft' }, "The paper's numbers stand beside ours for comparison only: Burbridge & Spacek (2006) had "
    + 'another room, and a rig whose sizes they do not give.')));
}

function numberTiles({ summary, paper }) {
  const { fix, frames, odometry_error: odometry, position_error: error = fix.position_error } = summary;
  return tiles([
    error && [mmText(error.mean_m), `mean position error (paper: ${paper.position_mean_mm})`],
    error && [mmText(error.max_m), `worst position error (paper: within ${paper.position_within_mm})`],
    [percent(fix.frames_with_fix, frames), `of ${plural(frames, 'frame')} have a position`],
    odometry && [mmText(odometry.mean_m), 'mean error of odometry alone'],
    exists(summary.travelled_m) && [quantity(summary.travelled_m, 'm'), `driven in ${fixed(summary.duration_s, 1)} s`],
    exists(summary.headings_covered_deg)
      && [quantity(summary.headings_covered_deg, '\u00b0', 0), 'of all 360\u00b0 of heading covered'],
  ].filter(Boolean));
}

// ---- tables

/** Columns of an error's statistics. @param of returns those of a row; @param scale from metres or radians */
function errorColumns(of, scale, unit, digits) {
  return [['mean', 'mean'], ['rmse', 'rmse'], ['95\u00a0%', 'p95'], ['max', 'max']].map(([head, key]) =>
    ({ head, digits, value: (row) => scaled(of(row)?.[`${key}_${unit}`], scale) }));
}

const boundColumns = (head, of, scale, unit, digits) => [
  { head, digits, value: (row) => scaled(of(row)?.[`bound_rms_${unit}`], scale) },
  { head: 'rmse / bound', digits: 2, value: (row) => of(row)?.rmse_over_bound }];

/** A column of shares. @param of returns [part, whole] of a row; nothing: not known */
function shareColumn(head, of) {
  const value = (row) => of(row)?.[1] > 0 ? 100 * of(row)[0] / of(row)[1] : undefined;
  return { head, value, show: (row) => quantity(value(row), '%', 1) };
}

const heldOf = (share) => share && [share.held, share.count];

function rangeTable({ summary, baseline, landmarks, has_truth, has_bounds }) {
  const rowOf = (of, name) => of?.landmarks.find((each) => each.name === name) ?? {};
  const rows = landmarks.map((landmark) =>
    ({ ...landmark, own: rowOf(summary, landmark.name), before: rowOf(baseline, landmark.name) }));
  const covered = ({ own }) => own.frames_with_range ?? 0;
  const paperColumn = (head) => ({ head, value: ({ paper }) => paper?.[`${head}_mm`],
    show: ({ paper }) => paper ? String(paper[`${head}_mm`]) : noValue });
  const beforeColumns = errorColumns(({ before }) => before.range_error, 1000, 'm', 2);
  const groups = [
    ['', [{ head: 'landmark', key: 'name',
      show: ({ rgb, name }) => el('span', { class: 'named' }, swatch(rgb), name) }]],
    ['frames', [{ head: 'with a range', value: covered },
      shareColumn('covered', (row) => [covered(row), summary.frames])]],
    has_truth && ['error / mm', errorColumns(({ own }) => own.range_error, 1000, 'm', 2)],
    has_truth && has_bounds && ['Cram\u00e9r\u2013Rao bound', [
      ...boundColumns('rms / mm', ({ own }) => own.range_bound, 1000, 'm', 2),
      shareColumn('in 1.96 \u03c3', ({ own }) => heldOf(own['range_within_1.96_sigma']))]],
    has_truth && !has_bounds && ['rounding to pixels',
      [{ head: 'alone: mean', digits: 2, value: ({ rounding_error_m }) => inMm(rounding_error_m) }]],
    has_truth && baseline && ['method paper', [beforeColumns[0], beforeColumns[3]]],
    has_truth && ['the paper', [paperColumn('mean'), paperColumn('max')]]].filter(Boolean);
  return [table({ caption: `Range to each landmark${has_truth ? ', |computed \u2212 true|' : ''}`, rows, groups }),
  has_truth && el('p', { class: 'soft' }, has_bounds
    ? 'The Cram\u00e9r\u2013Rao bound is the smallest standard deviation that any unbiased method can have. It is '
      + "computed from the landmark's outline in both mirrors, at the true pose, with the noise of the outline as "
      + 'measured in this run. "rmse / bound" is over the frames that have both. "In 1.96 \u03c3" is the share of '
      + 'ranges whose error is within 1.96 of their own stated sigmas; it is 95\u00a0% if the sigmas are correct.'
    : '"Rounding to pixels alone" is the mean error if both matches were right to the nearest whole pixel and nothing '
      + 'else were wrong: a third of a pixel of disparity at the true ranges of this run.')];
}

function coverageTable({ summary, method }) {
  const rows = [...summary.landmarks, { name: 'position', verdicts: summary.fix.verdicts }];
  const seen = new Set(rows.flatMap(({ verdicts }) => byFrequency(verdicts).map(([verdict]) => verdict)));
  const ok = ({ verdicts }) => verdicts.ok ?? 0;
  // Not every frame with verdict `occluded` has a range.
  const hidden = (row) => (row.frames_with_range ?? 0) - ok(row) - (row.verdicts.one_view ?? 0);
  const words = (row) => byFrequency(row.verdicts).map(([verdict, count]) => el('span', { class: 'count' },
    verdictChip(verdict, method), ` ${count}`,
    verdict === 'occluded' && hidden(row) > 0 && ` (${hidden(row)} with a range)`));
  return [table({ caption: 'Result of each frame', rows, columns: [{ head: '', key: 'name' },
    { head: 'share of the frames', text: true, value: ok, show: ({ verdicts }) => shareBar(verdicts) },
    { head: 'frames by verdict', text: true, value: ok, show: words }] }),
  el('div', { class: 'meanings' }, [...seen].sort().map((verdict) =>
    el('span', {}, verdictChip(verdict, method), verdictOf(verdict, method).meaning)))];
}

function positionTable({ summary, baseline, paper, has_truth, has_bounds }) {
  const { fix, estimate, frames, method, odometry_error: odometry } = summary;
  const counted = (name, error) => ({ name, error, frames: error?.count ?? 0 });
  const rows = [
    { name: `fix, method ${method}`, frames: fix.frames_with_fix, error: fix.position_error, bound: fix.position_bound,
      share: fix.position_in_95_percent_ellipse },
    fix.position_bound_with_map_and_rig
      && { name: 'bound with the sigmas of map and rig', bound: fix.position_bound_with_map_and_rig },
    baseline && { name: 'fix, method paper', frames: baseline.fix.frames_with_fix, error: baseline.fix.position_error },
    has_truth && estimate?.position_error && counted('estimate (estimate.tum)', estimate.position_error),
    has_truth && counted('odometry alone', odometry),
    has_truth && { name: 'the paper (max: "within")',
      error: { mean_m: paper.position_mean_mm / 1000, max_m: paper.position_within_mm / 1000 } }].filter(Boolean);
  const first = [{ head: '', key: 'name' }, { head: 'frames' }];
  const columns = [...first, shareColumn('covered', (row) => exists(row.frames) ? [row.frames, frames] : undefined)];
  if (has_truth) columns.push(...errorColumns(({ error }) => error, 1000, 'm', 2));
  if (has_truth && has_bounds) {
    columns.push(...boundColumns('bound, rms', ({ bound }) => bound, 1000, 'm', 2),
      shareColumn('in 95\u00a0% ellipse', ({ share }) => heldOf(share)));
  }
  const headings = [[`fix, method ${method}`, fix.heading_error, fix.heading_bound],
    ['estimate (estimate.tum)', estimate?.heading_error]].filter(([, error]) => error)
    .map(([name, error, bound]) => ({ ...counted(name, error), bound }));
  const outliers = summary.landmarks.filter((each) => each.outliers > 0).map((each) => `${each.name} ${each.outliers}`);
  return [table({ caption: `Position${has_truth ? ', distance from the true one in mm' : ''}`, rows, columns }),
    headings.length > 0 && table({ caption: 'Heading, difference from the true one in degrees', rows: headings,
      columns: [...first, ...errorColumns(({ error }) => error, 180 / Math.PI, 'rad', 4),
        ...fix.heading_bound ? boundColumns('bound, rms', ({ bound }) => bound, 180 / Math.PI, 'rad', 4) : []] }),
    outliers.length > 0 ? el('p', {}, `Left out of fixes as outliers, in frames: ${outliers.join(', ')}.`)
      : has_bounds && el('p', {}, 'No measurement was left out of a fix as an outlier.')];
}

function budgetTable(budget) {
  const column = (of, key, head) => {
    const value = (line) => budget[of === 'range' ? 'ranges' : 'poses'] > 0 ? inMm(line[of][`${key}_m`]) : undefined;
    const show = (line) => !exists(value(line)) ? noValue : value(line) < 5e-4 ? '0' : value(line).toPrecision(3);
    return { head, value, show };
  };
  const pair = (of) => [column(of, 'analytic', 'analytic'), column(of, 'monte_carlo', 'Monte Carlo')];
  const [total, ...lines] = budget.lines, { withheld_ranges, withheld_positions } = budget;
  return [table({ caption: 'Root mean square error in mm that each source adds', rows: [...lines, total],
    groups: [['', [{ head: 'source' }, { head: 'wrong by', key: 'size' }]],
      [`range at ${budget.range_m} m`, pair('range')], ['position', pair('position')]] }),
  el('p', { class: 'soft' }, `Ranges over ${budget.ranges} landmarks and bearings, positions over ${budget.poses} `
    + `poses of this run; noise of the outlines ${fixed(budget.edge_noise_px, 3)} px `
    + `(${budget.noise_measured ? 'measured' : 'assumed'}); skew at ${fixed(budget.speed_mps)} m/s and `
    + `${fixed(budget.turn_rate_radps)} rad/s. Each number is a standard deviation. The Monte Carlo uses `
    + `${budget.draws} draws, so its relative statistical error is ${fixed(100 / Math.sqrt(2 * budget.draws), 1)} %. `
    + 'Where it differs by more from the analytic value, the source is too large for linear propagation.'
    + (withheld_ranges + withheld_positions === 0 ? '' : ` Among the draws ${withheld_ranges} ranges and `
      + `${withheld_positions} positions were withheld; no number includes them.`))];
}

// ---- figures of the positions

/** The distance of two paths at each frame; undefined where one is missing. */
export function pathErrors(path, truth) {
  const at = ({ x_m, y_m }, i) => ({ x_m: x_m[i], y_m: y_m[i] });
  return path && truth ? path.x_m.map((_, i) => distanceBetween(at(path, i), at(truth, i))) : undefined;
}

const fixKeys = ['x_m', 'y_m', 'true_x_m', 'true_y_m', 'var_x_m2', 'cov_xy_m2', 'var_y_m2'];
const placesOf = (path) => path.x_m.map((x, i) => [x, path.y_m[i]]);
const isFix = ({ x_m, y_m, verdict }, i) => exists(x_m[i]) && exists(y_m[i]) && verdict[i] !== 'out_of_bounds';

/** Marks of the frames without an answer, in a row for each reason. */
function reasonLanes(frames, verdicts, isMissing, prefix) {
  const missing = d3.range(verdicts.length).filter((i) => verdicts[i] !== null && isMissing(i));
  return d3.nest().key((i) => verdicts[i]).entries(missing).map(({ key, values }) =>
    ({ name: prefix + key, kind: 'lane', ...verdictOf(key), x: values.map((i) => frames[i]) }));
}

function beyondWords(errors_mm, limit_mm) {
  const beyond = errors_mm.filter(exists).map(Math.abs).filter((error) => error > limit_mm);
  return beyond.length === 0 ? '' : ` ${plural(beyond.length, 'error lies', 'errors lie')} beyond the axis, up to `
    + `${significant(Math.max(...beyond))} mm: ${beyond.length === 1 ? 'a triangle' : 'triangles'} at its edge.`;
}

/** The start and the end of a path, on sides that keep the two words apart. */
function endsOf(path) {
  const places = path ? placesOf(path).filter((place) => place.every(exists)) : [];
  if (places.length === 0) return { labels: [], points: [] };
  const start = places[0], end = places.at(-1), above = start[1] >= end[1];
  return { labels: [{ text: 'start', at: start, above }, { text: 'end', at: end, above: !above }],
    points: [{ colour: 'ink', r: 4, points: [start], open: true },
      { colour: 'ink', r: 4, points: [end], shape: 'square' }] };
}

const mapOf = ({ run, landmarks }) => ({ ...run.map, landmarks });

function trajectoryFigure(data) {
  const { truth, odometry, estimate, overhead, frame } = data, path = truth ?? odometry ?? estimate;
  const name = truth ? 'true trajectory' : `trajectory by ${odometry ? 'odometry' : 'the fixes'}`;
  const plan = new Plan({ map: mapOf(data), underlay: overhead, label: `The ${name} in the room from above` });
  const show = (i) => `frame ${frame[i]}`;
  plan.update({ ...endsOf(path),
    paths: path ? [{ name, colour: 'c1', halo: true, points: placesOf(path), show }] : [] });
  const dead = 'Dead reckoning alone, because there is no ground truth.';
  const caption = [truth ? 'The path that the robot really drove.' : odometry ? dead
    : 'There is neither ground truth nor odometry.', overhead
    ? 'The arena from above as POV-Ray sees it, with the robot at its start.'
    : 'Plan drawn from the map: walls, obstacles, landmarks.',
  `Axes in metres; 1 POV-Ray unit is ${significant(100 * data.unit_m)} cm.`].join(' ');
  return figure({ id: 'fig07_trajectory', number: 'Figure 7', wide: false, caption,
    title: truth ? "The robot's true trajectory" : `The ${name}` }, plan.node);
}

function drivenFigure(data) {
  const { truth, odometry, estimate, fixes, frame } = data, map = mapOf(data);
  const held = fixes.frame.map((_, i) => i).filter((i) => isFix(fixes, i));
  const bounds = boundsOf([truth, odometry].filter(Boolean).flatMap(placesOf), 0.35) ?? map.bounds_m;
  const plan = new Plan({ map, bounds_m: bounds, label: 'True and calculated trajectory' });
  const paths = [['true', truth, 'truth'], ['odometry', odometry, 'odometry', '8 4'],
    ['estimate', estimate, 'track', '2 3']].filter(([, path]) => path).map(([name, path, colour, dash]) =>
      ({ name, colour, dash, points: placesOf(path), show: (i) => `frame ${frame[i]}` }));
  const calculated = { name: 'calculated', colour: 'fix', r: 2, points: held.map((i) => [fixes.x_m[i], fixes.y_m[i]]),
    show: (k) => `frame ${fixes.frame[held[k]]}, error ${mmText(fixes.error_m[held[k]])}` };
  const ends = endsOf(truth ?? odometry);
  plan.update({ paths, labels: ends.labels, points: [...ends.points, ...held.length > 0 ? [calculated] : []],
    ellipses: held.filter((i) => exists(fixes.var_x_m2[i])).map((i) => ({ name: '95 % ellipses', colour: 'fix',
      sigmas: Math.sqrt(5.991465), ...Object.fromEntries(fixKeys.map((key) => [key, fixes[key][i]])) })) });
  const outside = held.filter((i) => !(fixes.x_m[i] >= bounds[0] && fixes.x_m[i] <= bounds[2]
    && fixes.y_m[i] >= bounds[1] && fixes.y_m[i] <= bounds[3])).length;
  return figure({ id: 'fig18_paths', number: 'Figure 18', title: 'True and calculated trajectory', wide: false,
    caption: [`${held.length} positions from one stereo frame each`, truth && 'the true trajectory',
      odometry && 'the path by odometry alone', estimate && 'the estimate from all frames'].filter(Boolean).join(', ')
      + '. Zoom in to see the ellipses.'
      + (outside > 0 ? ` ${plural(outside, 'position lies', 'positions lie')} outside this figure.` : '') }, plan.node);
}

function errorFigure(data, plots) {
  const { truth, fixes, frame, paper } = data, { figure_17_frames: shown } = paper;
  const errors_mm = fixes.error_m.map((error, i) => isFix(fixes, i) ? inMm(error) : undefined);
  const paths = [['odometry', data.odometry, 'odometry', '8 4'], ['estimate', data.estimate, 'track', '2 3']]
    .map(([name, path, colour, dash]) =>
      ({ name, kind: 'line', colour, dash, thin: true, x: frame, y: pathErrors(path, truth)?.map(inMm) }))
    .filter(({ y }) => y?.some(exists));
  if (!errors_mm.some(exists) && paths.length === 0) return null;
  // On a linear axis that holds the paper's mean, errors of a hundredth of it would all lie on the zero line.
  const limit = readableLimit(errors_mm), log = limit > 0 && limit < paper.position_mean_mm / 10;
  const most = 1.05 * Math.max(limit, 1.2 * paper.position_mean_mm, ...paths.flatMap(({ y }) => y.filter(exists)));
  const plot = new Plot({ label: 'Position error by frame', x: { label: 'frame' }, onPick: plots.pick,
    y: { label: 'position error', unit: 'mm', ...log ? { scale: 'log' } : { min: 0, max: most } } });
  if (log) for (const path of paths) path.y = path.y.map((error) => error > 0 ? error : undefined);
  plot.update([...paths, { name: 'fix', kind: 'points', colour: 'fix', x: fixes.frame, y: errors_mm },
    { name: "the paper's mean", kind: 'rule', colour: 'paper', dash: '6 4', y: paper.position_mean_mm },
    ...frame.at(-1) > shown ? [{ name: 'end of the paper', legend: false, kind: 'rule', colour: 'paper', dash: '2 3',
      x: shown, text: `the paper shows the first ${shown} frames` }] : [],
    ...reasonLanes(fixes.frame, fixes.verdict, (i) => !isFix(fixes, i), 'no fix: ')]);
  plots.push(plot);
  return figure({ id: 'fig17_error', number: 'Figure 17', title: 'Position error', caption: 'Distance from the true '
    + 'position, frame by frame. Each fix uses one stereo frame, the map and the rig only, so its error does not grow '
    + `with time; that of odometry does.${log ? ' The axis is logarithmic.' : beyondWords(errors_mm, most)}`
    + (fixes.frame.every((_, i) => isFix(fixes, i)) ? '' : ' Marks along the bottom: frames without a position.') },
  plot.node);
}

// ---- figures of the ranges

function rangeFigure(data, landmark, plots) {
  const { name, rgb: colour = 'c5', paper, range_m, true_range_m, sigma_range_m, verdict } = landmark;
  if (verdict.every((each) => each === null)) return null;
  const { frame, summary } = data, x = frame, left = 44;
  const errors_mm = range_m.map((range, i) => exists(range) && exists(true_range_m[i])
    ? 1000 * (range - true_range_m[i]) : undefined);
  const judged = errors_mm.some(exists), limit = 1.08 * readableLimit(errors_mm);
  const sigma = (i) => exists(sigma_range_m[i]) ? ` \u00b1 ${mmText(sigma_range_m[i])}` : '';
  const range = new Plot({ label: `Range to ${name} by frame`, height: 150, left, onPick: plots.pick,
    x: { label: judged ? undefined : 'frame' }, y: { label: 'range', unit: 'm', zero: true }, series: [
      ...judged ? [{ name: 'true', kind: 'line', colour: 'truth', thin: true, x, y: true_range_m }] : [],
      { name: 'computed', kind: 'points', colour, r: 2, x, y: range_m,
        show: (i) => `${fixed(range_m[i], 4)} m${sigma(i)}, ${verdict[i]}` },
      ...reasonLanes(frame, verdict, (i) => !exists(range_m[i]), '')] });
  const error = judged && new Plot({ label: `Error of the range to ${name} by frame`, height: 90, left,
    onPick: plots.pick, x: { label: 'frame' }, y: { label: 'error', unit: 'mm', max: 'readable', both: true }, series: [
      { name: 'zero', kind: 'rule', colour: 'edge', y: 0, legend: false },
      { name: 'error', kind: 'points', colour, r: 2, legend: false, x, y: errors_mm }] });
  const both = [range, error].filter(Boolean);
  linkPlots(both);
  plots.push(...both);
  const own = summary.landmarks.find((each) => each.name === name) ?? { frames_with_range: 0 }, found = own.range_error;
  const words = [`${own.frames_with_range} of ${summary.frames} frames have a range.`, found && `Mean error `
    + `${mmText(found.mean_m)}, 95 % within ${mmText(found.p95_m)}, worst ${mmText(found.max_m)}.`, found && paper
    && `The paper: mean ${paper.mean_mm}, worst ${paper.max_mm} mm.`, beyondWords(errors_mm, limit).trim(),
  !range_m.every(exists) && 'Marks along the bottom: frames without a range, by the reason.'];
  return figure({ id: `range_${name}`, number: paper && `Figure ${paper.figure}`, title: `Range to ${name}`,
    wide: false, caption: words.filter(Boolean).join(' ') }, ...both.map(({ node }) => node));
}

// ---- errors beside what was to be expected

/** The errors of the ranges in units of their own stated sigmas. */
export function normalisedRanges(landmarks) {
  return landmarks.flatMap(({ range_m, true_range_m, sigma_range_m }) => range_m.map((range, i) =>
    sigma_range_m[i] > 0 ? ((range ?? NaN) - (true_range_m[i] ?? NaN)) / sigma_range_m[i] : NaN).filter(exists));
}

/** The squared errors of the positions in units of their own stated covariances, of fixes with one answer. */
export function normalisedPositions(fixes) {
  return fixes.verdict.map((verdict, i) => {
    const [x, y, true_x, true_y, xx, xy, yy] = fixKeys.map((key) => fixes[key][i] ?? NaN);
    const dx = x - true_x, dy = y - true_y, determinant = xx * yy - xy * xy;
    if (['weak', 'ambiguous', 'out_of_bounds'].includes(verdict) || !(determinant > 0)) return NaN;
    return (dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx) / determinant;
  }).filter(exists);
}

function boundFigure({ bound_m, fixes, t_s }) {
  const errors_mm = fixes.error_m.map(inMm), limit = 1.08 * Math.max(readableLimit(errors_mm), 1e-3);
  if (!bound_m || !errors_mm.some(exists)) return null;
  const plot = new Plot({ label: 'Position error and its bound by time', x: { label: 'time', unit: 's' },
    y: { label: 'position error', unit: 'mm', min: 0, max: limit }, series: [
      { name: 'fix', kind: 'points', colour: 'fix', x: fixes.t_s, y: errors_mm },
      { name: 'bound, 1 sigma of the distance', kind: 'line', colour: 'bound', x: t_s, y: bound_m.map(inMm) }] });
  return figure({ id: 'bound_position', title: 'Position error and its Cram\u00e9r\u2013Rao bound', caption: 'Line: '
    + 'the smallest standard deviation that the images of that frame allow (Cram\u00e9r\u2013Rao bound), \u221a(var x '
    + '+ var y), at the true pose with the measured noise of the outlines. No unbiased estimator has smaller errors on '
    + `average.${beyondWords(errors_mm, limit)}` }, plot.node);
}

function normalisedFigure({ landmarks, fixes }) {
  const ranges = normalisedRanges(landmarks), positions = normalisedPositions(fixes);
  if (ranges.length + positions.length === 0) return null;
  const panel = (values, from, to, label, name, density) => {
    const x = d3.range(201).map((i) => from + (to - from) * i / 200);
    const bars = { name: 'this run', kind: 'bars', colour: 'c1', ...histogram(values, { from, to }) };
    return new Plot({ label: `Distribution: ${label}`, height: 200, x: { label, min: from, max: to },
      y: { label: 'density', zero: true },
      series: [bars, { name, kind: 'line', colour: 'bound', x, y: x.map(density) }] }).node;
  };
  const outside = ranges.filter((v) => !(v >= -5 && v < 5)).length + positions.filter((v) => !(v < 12)).length;
  return figure({ id: 'bound_normalised', title: 'Errors compared with the stated sigmas', caption: 'Errors in units '
    + `of the sigmas that the method states with them: ${plural(ranges.length, 'range')}, `
    + `${plural(positions.length, 'position')}. The lines are the distributions that correct sigmas give. Where the `
    + 'histogram is wider than its line, the sigmas are too small; where it is narrower, they are too large.'
    + (outside === 0 ? '' : ` ${plural(outside, 'error lies', 'errors lie')} beyond the axes; the densities count `
      + 'them.') },
  el('div', { class: 'columns' },
    panel(ranges, -5, 5, 'range error / its sigma', 'normal', (x) => Math.exp(-x * x / 2) / Math.sqrt(2 * Math.PI)),
    panel(positions, 0, 12, 'position error squared by its covariance', 'chi-squared', (x) => Math.exp(-x / 2) / 2)));
}

function budgetFigure(budget) {
  if (budget.ranges + budget.poses === 0) return null;
  const least_mm = 0.01, [total, ...rest] = budget.lines;
  const size = ({ range, position }) => range.analytic_m + position.analytic_m;
  const lines = [total, ...rest.sort((a, b) => size(b) - size(a))];
  const y = lines.map(({ source, size: by }) => by ? `${source}: ${by}` : source);
  const values = (of, key) => lines.map((line) => inMm(line[of][key]) >= least_mm ? inMm(line[of][key]) : undefined);
  const series = [['range', `range at ${budget.range_m} m`, 'odometry', false, 'circle'],
    ['position', 'position', 'fix', true, 'diamond']]
    .flatMap(([of, name, colour, open, shape]) => [{ name, kind: 'bars', colour, open, y, x: values(of, 'analytic_m') },
      { name: `${name}, Monte Carlo`, kind: 'points', colour: 'ink', shape, open: true, r: 4, beside: name, y,
        x: values(of, 'monte_carlo_m') }]);
  return figure({ id: 'error_budget', title: 'The error budget', caption: 'Error that each source adds if it is wrong '
    + 'by the standard deviation beside its name. Bars: linear propagation; circles and diamonds: '
    + `${budget.draws} draws each. Values below ${least_mm} mm are not drawn.` }, new Plot({ label: 'The error budget', series,
    height: 27 * y.length, x: { label: 'root mean square', unit: 'mm', scale: 'log', min: least_mm },
    y: { scale: 'band', values: y } }).node);
}

// ---- the rig

/**
 * One mirror in the half-plane right of the axis; places are [from the axis, height]. Every ray that it shows seems to
 * come from `viewpoint`, between the ray through the tip and the ray through the rim.
 */
export function sideView({ lens_height_m: h, lens_to_tip_m: d, mirror_radius_m: r, apex_rad }) {
  return { lens: [0, h], tip: [0, h + d], rim: [r, h + d + r / Math.tan(apex_rad / 2)],
    viewpoint: [-d * Math.sin(apex_rad), h + d * (1 - Math.cos(apex_rad))] };
}

/** The part of a convex polygon left of the ray from one point through another (Sutherland-Hodgman clipping). */
export function keepLeft(polygon, [ox, oy], [tx, ty]) {
  const side = ([x, y]) => (tx - ox) * (y - oy) - (ty - oy) * (x - ox);
  return polygon.flatMap((a, i) => {
    const b = polygon[(i + 1) % polygon.length], [s, t] = [side(a), side(b)];
    const crossing = a.map((value, k) => value + (b[k] - value) * s / (s - t));
    return [...s >= 0 ? [a] : [], ...(s >= 0) !== (t >= 0) ? [crossing] : []];
  });
}

/** Returns the polygon, right of the axis and over the floor, that all views show between the limits of each. */
export function sharedRegion(views, far) {
  const whole = [[0, 0], [far, 0], [far, far], [0, far]];
  return views.reduce((polygon, { viewpoint, lowest, highest }) =>
    keepLeft(keepLeft(polygon, viewpoint, lowest), highest, viewpoint), whole);
}

/** [height, range from which the lower mirror shows it] of the landmarks' tops: all up to three, else the extremes. */
function shownTops({ landmarks, rig }) {
  const all = new Map(landmarks.map(({ top_m }, i) => [top_m, rig.nearest_top_m?.[i]]));
  const tops = [...all].sort((a, b) => a[0] - b[0]);
  return tops.length > 3 ? [tops[0], tops.at(-1)] : tops;
}

function geometryFigure(data) {
  const { rig } = data, views = [sideView(rig.lower), sideView(rig.upper)], [lower, upper] = views;
  const tops = shownTops(data), [highest, nearest] = tops.at(-1) ?? [], tallest = Math.max(upper.rim[1], highest ?? 0);
  // The figure is wide enough to show where the highest top enters the lower mirror's view.
  const width = exists(nearest) ? Math.min(Math.max(1.25 * nearest, 1.2 * tallest), 4 * tallest) : 1.6 * tallest;
  const left = Math.min(lower.viewpoint[0], upper.viewpoint[0]) - 0.12 * tallest, far = 10 * width;
  const limits = ({ viewpoint, tip, rim }) => ({ viewpoint, lowest: tip, highest: rim });
  const along = ([x, y], [tx, ty]) => [far, y + (ty - y) * (far - x) / Math.max(tx - x, 1e-9)];
  const rays = ({ viewpoint, tip, rim }, name, colour, dash) => [tip, rim].flatMap((through) => [
    { name, colour, dash, points: [through, along(viewpoint, through)] },
    { name, colour, dash: '3 4', points: [viewpoint, through] }]);
  const plan = new Plan({ bounds_m: [left, 0, width, 1.25 * tallest], label: 'The rig from the side', tallest: 480,
    floor: false, xLabel: 'distance from the axis / m', yLabel: 'height above the floor / m' });
  plan.update({
    areas: [{ name: 'common region', colour: 'bound',
      points: sharedRegion(views.map(limits), far) },
    ...views.map(({ tip, rim }) => ({ colour: 'edge', solid: true, points: [tip, rim, [-rim[0], rim[1]]] }))],
    paths: [...rays(lower, 'lower mirror', 'fix'), ...rays(upper, 'upper mirror', 'odometry', '10 3'),
      { colour: 'paper', dash: '8 3 1 3', points: [[0, 0], [0, 2 * tallest]] },
      ...views.map(({ lens, rim }) => ({ colour: 'paper', dash: '1 3', points: [lens, rim] })),
      ...tops.map(([top]) => ({ name: 'landmark tops', colour: 'ink', dash: '1 3', points: [[0, top], [far, top]] }))],
    points: [{ name: 'camera lens', colour: 'ink', r: 4.5, points: views.map(({ lens }) => lens) },
      { name: 'virtual viewpoint', colour: 'ink', shape: 'plus', r: 6, points: views.map((view) => view.viewpoint) }],
    labels: [...views.map(({ rim, tip }, k) => ({ text: k ? 'upper mirror' : 'lower mirror', at: [rim[0], tip[1]] })),
      ...tops.map(([top]) => ({ text: `landmark tops, ${fixed(top)} m`, at: [width, top], end: true }))] });
  const from = exists(nearest)
    ? `; the lower mirror shows tops at ${fixed(highest)} m from a range of ${fixed(nearest)} m` : '';
  return figure({ id: 'fig08_geometry', number: 'Figure 8', title: 'What the two mirrors see', caption: 'This rig from '
    + `the side, to scale: mirror radius R = ${mmText(rig.lower.mirror_radius_m)}, lens to tip d = `
    + `${mmText(rig.lower.lens_to_tip_m)}, distance of the mirrors s = ${mmText(rig.mirror_separation_m)}. Each mirror `
    + 'shows the region between its horizon (the ray at the tip) and its rim ray, as seen from a virtual viewpoint '
    + 'beyond the axis. A range requires the top of a landmark in the common region.' + (exists(rig.nearest_common_m)
    ? ` This region begins ${fixed(rig.nearest_common_m)} m from the axis${from}.` : '') }, plan.node);
}

function resolutionFigure(data) {
  const { rig, landmarks, run } = data, { nearest_common_m: common } = rig;
  if (!exists(rig.range_per_pixel_factor)) return null;
  const [x0, y0, x1, y1] = run.map.bounds_m;
  const farthest = d3.max(landmarks.flatMap(({ true_range_m }) => true_range_m)) || Math.hypot(x1 - x0, y1 - y0);
  const end = 1.1 * Math.max(exists(farthest) ? farthest : 1, common), x = d3.range(201).map((i) => end * i / 200);
  const points = landmarks.map(({ name, rgb, range_m, true_range_m }, k) => {
    const y = range_m.map((range, i) => Math.abs(inMm((range ?? NaN) - (true_range_m[i] ?? NaN)) ?? NaN));
    return { name, kind: 'points', colour: rgb ?? 'c5', shape: markerShapes[k % markerShapes.length], r: 2.2,
      x: true_range_m, y };
  }).filter(({ y }) => y.some(exists));
  const errors = points.flatMap(({ y }) => y).filter((error) => error > 0).sort((a, b) => a - b);
  const some = errors.length > 0;
  const rule = (at, row, text) =>
    ({ name: text, kind: 'rule', colour: 'paper', dash: '4 3', legend: false, x: at, row, text });
  const series = [...points, { name: 'one pixel of disparity', kind: 'line', colour: 'truth', x,
    y: x.map((range) => inMm((range + rig.lower.lens_to_tip_m) ** 2 * rig.range_per_pixel_factor)) },
  rule(common, 0, `common region from ${fixed(common)} m`),
  ...shownTops(data).filter(([, nearest]) => nearest > common).map(([top, nearest], k) =>
    rule(nearest, k + 1, `tops at ${fixed(top)} m inside the lower rim from ${fixed(nearest)} m`))];
  // An axis that held the smallest errors would be mostly empty.
  const y = { label: some ? 'range error' : 'range', unit: some ? 'mm' : 'mm per pixel', scale: 'log',
    min: errors[Math.floor(errors.length / 50)] ?? 1 };
  return figure({ id: 'fig08_resolution', title: 'Range of one pixel of disparity', caption: 'Change of range for one '
    + 'pixel of disparity, (range + d)\u00b2 / (v s) by equation 1: it grows with the square of the range.'
    + `${some ? ' Points: the errors of this run, by landmark; the smallest are marked at the edge.' : ''} Ranges are `
    + 'measured to the axis of a landmark.' }, new Plot({ label: 'Range of one pixel of disparity', mode: 'xy',
    height: 280, series, y, x: { label: 'true range', unit: 'm', min: 0, max: end } }).node);
}

// ---- images of the mirrors

function disparityFigure({ disparity, landmarks }) {
  if (!disparity) return null;
  const { width_px: width, height_px: height, centre_px: centre, matches, frame, image } = disparity;
  const root = svg('svg', { class: 'drawing picture', viewBox: `0 0 ${width} ${height}`, role: 'img',
    'aria-label': 'Both mirrors, one on the other' }, svg('image', { href: image, width, height }));
  const isMatch = ({ verdict, lower_px, upper_px }) => verdict === 'ok' && lower_px && upper_px;
  for (const { landmark, lower_px: a, upper_px: b } of matches.filter(isMatch)) {
    const rgb = landmarks.find(({ name }) => name === landmark)?.rgb ?? [255, 255, 255];
    for (const style of ['stroke:#000000;stroke-width:3', `stroke:rgb(${rgb.map(Number)});stroke-width:1.4`]) {
      root.append(...[a, b].map(([cx, cy]) => svg('circle', { cx, cy, r: 6, style: `fill:none;${style}` })));
    }
    const length = Math.hypot(a[0] - centre[0], a[1] - centre[1]) || 1;  // the name is beside the circles
    const [x, y] = [a[0] - 12 * (a[1] - centre[1]) / length, a[1] + 12 * (a[0] - centre[0]) / length + 4];
    root.append(svgText(x, y, landmark, x >= a[0] ? 'start' : 'end', 'over'));
  }
  const missing = matches.filter((match) => !isMatch(match)).map(({ landmark, verdict }) => `${landmark} (${verdict})`);
  return figure({ id: 'fig09_disparity', number: 'Figure 9', title: 'The disparity between the two mirrors', caption:
    `Frame ${frame}: the upper mirror's image, half transparent, on the lower mirror's image. The circles show where `
    + "the paper's algorithm matched the top of a landmark: the outer circle in the lower mirror, the inner one in the "
    + `upper mirror.${missing.length > 0 ? ` No match: ${missing.join(', ')}.` : ''}` }, root);
}

/** Draws both mirrors of a frame, unrolled, with the landmarks' names at their measured bearings. */
function drawPanorama(root, { frame, t_s, lower, upper, marks }, width) {
  const tall = Math.round(width * 150 / 960), top = 22, bottom = top + 2 * tall + 4;
  const xOf = (bearing_rad) => width * (0.5 - bearing_rad / (2 * Math.PI));
  const anchored = (x, half) => x < half ? 'start' : x > width - half ? 'end' : 'middle';
  const texts = marks.map(({ landmark, range_m }) => exists(range_m) ? `${landmark} ${fixed(range_m)} m` : landmark);
  const wide = 7 * Math.max(...texts.map((text) => text.length), 1);
  const rows = staggeredRows(marks.map(({ bearing_rad }) => xOf(bearing_rad)), wide, 4);
  setAttributes(root, { width, height: bottom + 26, viewBox: `0 0 ${width} ${bottom + 26}` });
  root.replaceChildren(svgText(0, 14, `frame ${frame}, t = ${fixed(t_s)} s`),
    ...[['lower', lower], ['upper', upper]].flatMap(([name, href], k) => [
      svg('image', { href, x: 0, y: top + k * (tall + 4), width, height: tall, preserveAspectRatio: 'none' }),
      svgText(4, top + k * (tall + 4) + tall - 6, name, 'start', 'over')]),
    ...marks.flatMap(({ bearing_rad }, i) => {
      const x = xOf(bearing_rad), y = top + 14 + 15 * rows[i];
      return [svgPath('bearing', `M${x},${y + 4}V${bottom}`), svgText(x, y, texts[i], anchored(x, wide / 2), 'over')];
    }),
    ...['behind', 'left 90\u00b0', 'ahead', 'right 90\u00b0', 'behind'].flatMap((word, k) => {
      const x = width * k / 4;
      return [svgPath('axis', `M${x},${bottom}v5`), svgText(x, bottom + 18, word, anchored(x, 20), 'soft')];
    }));
}

function panoramaFigure({ panoramas }) {
  if (panoramas.length === 0) return null;
  const roots = panoramas.map(({ frame }) =>
    svg('svg', { class: 'drawing', role: 'img', 'aria-label': `Frame ${frame}` }));
  const node = el('div', {}, roots);
  watchWidth(node, (width) => panoramas.forEach((each, i) => drawPanorama(roots[i], each, width)));
  return figure({ id: 'views_unwrapped', title: 'Panorama of both mirrors', caption: "The two mirrors' images "
    + 'unrolled, lower above upper, on the same bearings: a landmark has the same bearing in both and stands higher in '
    + 'the lower mirror. Rows run from the rim (top) to the tip, which is the horizon of 90 degree cones.' }, node);
}

// ---- the page

function runFacts(data) {
  const links = data.files.flatMap((name, i) => [i > 0 && ', ', el('a', { href: name }, name)]);
  return [facts(data.facts), el('h3', {}, 'Tables of the run'),
    el('p', {}, 'Beside this page: ', links, '; images in lower/ and upper/.'),
    el('h3', {}, 'Events during the run'), list(data.events, 'Nothing out of the ordinary.'),
    el('h3', {}, 'Notes on this report'), list(data.notes, 'Nothing is missing.')];
}

/** Shows the report. */
export function reportPage(data) {
  const plots = [], player = el('div'), { summary, error_budget: budget, repeat } = data;
  let view;
  plots.pick = (frame) => view?.player.seek(Math.round(data.frame.indexOf(frame) / data.every));
  const part = (id, title, short, ...content) => {
    const nodes = content.flat(Infinity).filter(Boolean);
    return nodes.length > 0 && Object.assign(section(id, title, ...nodes), { shortTitle: short });
  };
  showPage({ title: data.title, lead: [el('p', { class: 'headline' }, reportHeadline(data)),
    !data.finished && el('p', { class: 'warning' }, `This run was cut off after ${summary.frames} of `
      + `${data.frames_wanted} frames; the results below are of those.`), rules(data), numberTiles(data)],
  sections: [
    part('ranges', 'Ranges', 'Ranges', rangeTable(data), coverageTable(data)),
    part('position', 'Position', 'Position', positionTable(data)),
    part('browse', 'Frames of the run', 'Frames', data.frames.length > 0 && player),
    part('paths', 'Trajectories', 'Trajectories',
      figures(trajectoryFigure(data), drivenFigure(data), errorFigure(data, plots))),
    part('range-figures', 'Ranges frame by frame', 'Range figures',
      figures(data.landmarks.map((landmark) => rangeFigure(data, landmark, plots)))),
    part('bounds', 'Errors beside their bounds', 'Bounds', figures(boundFigure(data), normalisedFigure(data))),
    part('error-budget', 'The error budget', 'Error budget', budgetTable(budget), figures(budgetFigure(budget))),
    part('rig', 'The rig', 'Rig', figures(geometryFigure(data), resolutionFigure(data))),
    part('views', 'Images of the mirrors', 'Images', figures(disparityFigure(data), panoramaFigure(data))),
    part('repeat', 'How to repeat this', 'Repeat', el('p', {}, 'With this command the same version repeats the run '
      + `byte for byte${repeat.exact ? '' : ', unless the time limit cuts an answer short'}:`),
    el('pre', { class: 'command' }, repeat.command)),
    part('run', 'The run', 'Run', runFacts(data)),
  ] });
  if (data.frames.length === 0) return;
  view = new RunView(player, { run: data.run, frames: data.frames, images: data.images, every: data.every });
  view.player.listeners.push(() => plots.forEach((plot) => plot.setCursor(view.player.frame?.frame)));
}
