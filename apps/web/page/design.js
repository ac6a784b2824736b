// SPDX-License-Identifier: Apache-2.0
// The page of a rig's design: its measures, what both mirrors see where, and how accurately.
import { el, svg, svgText, button, exists, fixed, significant, noValue } from './kit.js';
import { quantity, millimetres, degrees } from './kit.js';
import { showPage, section, table, figure, figures, tiles } from './kit.js';
import { Plan } from './plan.js';
import { Plot } from './plot.js';
import { sideView, sharedRegion } from './report.js';

// ---- logic without DOM

/**
 * Returns what one mirror shows right of the axis: its parts (sideView), and the two limits of its view as lines from
 * the mirror outwards, to the distance `far`.
 */
export function viewLimits(view, far) {
  const side = sideView(view), [x, y] = side.viewpoint;
  const along = (angle_rad) => [far, y + (far - x) * Math.tan(angle_rad)];
  return { ...side, lowest: along(view.lowest_rad), highest: along(view.highest_rad) };
}

/** Returns the steps of a scale for values: round numbers between the 2nd and the 98th percentile, and these two. */
export function scaleRange(values) {
  const sorted = values.filter(exists).sort((a, b) => a - b);
  if (sorted.length === 0) return [0, 1];
  const at = (share) => sorted[Math.min(Math.floor(share * sorted.length), sorted.length - 1)];
  return at(0.02) < at(0.98) ? [at(0.02), at(0.98)] : [at(0.5) * 0.9, at(0.5) * 1.1 || 1];
}

export function designHeadline({ floor_from_m: floor, nearest_m: nearest, least_height_m: least, distances }) {
  if (!exists(nearest)) return 'The two mirrors have nothing in common within 6 m: this pair ranges nothing.';
  const at = distances.find(({ distance_m }) => distance_m === 3);
  const sigma = at && exists(at.most_sigma_m)
    ? ` At 3 m, the sigma of a range is ${millimetres(at.least_sigma_m)} to ${millimetres(at.most_sigma_m)}.` : '';
  const seen = exists(floor) ? `both mirrors see the floor from ${fixed(floor)} m on`
    : `both mirrors see nothing lower than ${fixed(least)} m`;
  return `Ranges begin ${fixed(nearest)} m from the axis; ${seen}.${sigma}`;
}

// ---- figures

const mm = (length_m) => `${significant(1000 * length_m, 4)}\u00a0mm`;

/** A line between two places, moved aside, with its measure. */
function measure(from, to, words, [dx, dy]) {
  const [a, b] = [from, to].map(([x, y]) => [x + dx, y + dy]);
  return { path: { colour: 'ink', points: [a, b] }, points: { colour: 'ink', shape: 'plus', r: 4, points: [a, b] },
    label: { text: words, at: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], above: a[1] === b[1] } };
}

function measuresFigure(data) {
  const { rig, body_radius_m: body } = data, views = [rig.lower, rig.upper], sides = views.map(sideView);
  const tall = sides[1].rim[1] + data.plate_m, wide = Math.max(body, ...views.map((view) => view.mirror_radius_m));
  const step = 0.6 * wide;
  const lines = views.flatMap(({ mirror_radius_m, lens_to_tip_m }, k) => {
    const { tip, rim, lens } = sides[k];
    return [measure([0, rim[1]], rim, `R ${mm(mirror_radius_m)}`, [0, data.plate_m + 0.02 * tall]),
      measure([0, lens[1]], [0, tip[1]], `d ${mm(lens_to_tip_m)}`, [-wide - step, 0]),
      measure([0, 0], [0, lens[1]], `lens ${mm(lens[1])}`, [wide + step * (k ? 2.6 : 0.4), 0])];
  });
  lines.push(measure(sides[0].tip, sides[1].tip, `s ${mm(rig.mirror_separation_m)}`, [-wide - 2.4 * step, 0]));
  lines.push(measure([0, 0], [0, tall], `whole ${mm(tall)}`, [wide + 4.8 * step, 0]));
  const plan = new Plan({ bounds_m: [-wide - 3.2 * step, -0.06 * tall, wide + 6.4 * step, 1.1 * tall], floor: false,
    label: 'The measures of the rig, from the side', xLabel: 'distance from the axis / m',
    yLabel: 'height above the floor / m' });
  plan.update({ areas: [{ name: 'room of the body', colour: 'c7', points: [[-body, 0], [body, 0],
      [body, sides[0].lens[1] * 0.72], [-body, sides[0].lens[1] * 0.72]] },
    ...sides.map(({ tip, rim }) => ({ name: 'mirrors', colour: 'c6', solid: true,
      points: [tip, rim, [rim[0], rim[1] + data.plate_m], [-rim[0], rim[1] + data.plate_m], [-rim[0], rim[1]]] }))],
    paths: [{ colour: 'paper', dash: '8 3 1 3', points: [[0, 0], [0, 1.05 * tall]] },
      ...lines.map(({ path }) => path)],
    points: [{ name: 'lenses', colour: 'fix', r: 5, points: sides.map(({ lens }) => lens) },
      ...lines.map(({ points }) => points)],
    labels: [...lines.map(({ label }) => label), ...sides.map(({ tip, rim }, k) =>
      ({ text: `cone ${degrees(views[k].apex_rad)}`, at: [rim[0], (tip[1] + rim[1]) / 2] }))] });
  return figure({ id: 'measures', title: 'Measures', caption: 'From the side, to scale. R is the radius of a rim, d '
    + "the distance from a lens to its mirror's tip, s that of the two tips. A cone's angle is the full one at its "
    + 'tip.' }, plan.node);
}

function sightFigure(data) {
  const { rig, nearest_m: nearest, sigma_lines: lines } = data, far = 40, wide = 5;
  const views = [rig.lower, rig.upper].map((view) => viewLimits(view, far)), [lower, upper] = views;
  const highest = d3.max(lines, ({ points_m }) => d3.max(points_m, ([, z]) => z)) ?? 0;
  const tall = Math.min(Math.max(1.3 * upper.rim[1], 0.2 + highest), 2.5);
  const limits = ({ viewpoint, tip, rim, lowest, highest }, name, colour, dash) => [
    { name, colour, dash, points: [tip, lowest] }, { name, colour, dash, points: [rim, highest] },
    { name, colour, dash: '3 4', points: [viewpoint, tip] }, { name, colour, dash: '3 4', points: [viewpoint, rim] }];
  const plan = new Plan({ bounds_m: [-0.3, 0, wide, tall], label: 'What both mirrors see, from the side', floor: false,
    tallest: 420, xLabel: 'distance from the axis / m', yLabel: 'height above the floor / m' });
  plan.update({ areas: [{ name: 'seen by both: ranged', colour: 'bound', points: sharedRegion(views, far) },
    ...views.map(({ tip, rim }) => ({ colour: 'edge', solid: true, points: [tip, rim, [-rim[0], rim[1]]] }))],
    paths: [...limits(lower, 'lower mirror', 'fix'), ...limits(upper, 'upper mirror', 'odometry', '10 3'),
      ...lines.map(({ points_m: points }) => ({ name: 'equal sigma of a range', colour: 'ink', dash: '2 3', points }))],
    points: [{ name: 'camera lens', colour: 'ink', r: 4.5, points: views.map(({ lens }) => lens) },
      { name: 'virtual viewpoint', colour: 'ink', shape: 'plus', r: 6, points: views.map((view) => view.viewpoint) }],
    labels: lines.filter(({ points_m: [[x]] }) => x < wide).map(({ sigma_m, points_m }) =>
      ({ text: mm(sigma_m), at: points_m[Math.floor(points_m.length / 2)] })) });
  return figure({ id: 'sight', title: 'What both mirrors see, and how accurately', caption: 'Only what both mirrors '
    + `see is ranged${exists(nearest) ? `, from ${fixed(nearest)} m on` : ''}. Dotted: where the range of a point with `
    + 'texture has the standard deviation that is written beside, for a disparity of '
    + `${significant(data.sigma_px)} px. Nearer and lower than the green region the robot is blind.` }, plan.node);
}

function sigmaFigure({ distances }) {
  const seen = distances.filter(({ least_sigma_m: least }) => exists(least));
  const series = (name, key, colour, dash) => ({ name, kind: 'line', colour, dash,
    x: seen.map(({ distance_m }) => distance_m), y: seen.map((at) => at[key] * 1000) });
  return figure({ id: 'sigma', title: 'Sigma of a range by distance', caption: 'It grows with the square of the '
    + 'distance from the virtual viewpoint. At one distance it depends on the height, because a cone shows some '
    + 'elevations more finely than others.' }, new Plot({ label: 'Sigma of a range by distance', height: 260,
    series: [series('at the best height', 'least_sigma_m', 'bound'),
      series('at the worst height', 'most_sigma_m', 'fix', '8 4')],
    x: { label: 'distance', unit: 'm' }, y: { label: 'sigma', unit: 'mm', scale: 'log' } }).node);
}

// ---- the room

const roomViews = {
  sigma_m: ['by the noise of the images', 'Standard deviation of the position, by the noise of the images alone.'],
  whole_sigma_m: ['with rig and map as uncertain as stated', 'Standard deviation of the position, where rig and map '
    + 'are as uncertain as their files state.'],
  landmarks: ['number of landmarks', 'Number of landmarks that both mirrors show. Three determine a place.'],
};

/** Draws the cells of a room, and what stands in it, as an image that covers its bounds. */
function roomImage({ map: { bounds_m: [x0, y0, x1, y1], obstacles }, step_m: step, cells }, k, colour) {
  const scale = 8 / step, [width, height] = [x1 - x0, y1 - y0].map((length) => Math.round(length * scale));
  const canvas = el('canvas', { width, height });
  const context = canvas.getContext('2d');
  context.fillStyle = '#d9dcdf';
  context.fillRect(0, 0, canvas.width, canvas.height);
  for (const cell of cells) {
    context.fillStyle = exists(cell[k]) ? colour(cell[k]) : '#b3261e';
    context.fillRect((cell[0] - step / 2 - x0) * scale, (y1 - cell[1] - step / 2) * scale, step * scale + 0.5,
      step * scale + 0.5);
  }
  context.fillStyle = '#7d8489';
  for (const { outline_m: corners, x_m, y_m, radius_m } of obstacles) {
    context.beginPath();
    if (corners) corners.forEach(([x, y]) => context.lineTo((x - x0) * scale, (y1 - y) * scale));
    else context.arc((x_m - x0) * scale, (y1 - y_m) * scale, radius_m * scale, 0, 2 * Math.PI);
    context.fill();
  }
  return canvas.toDataURL();
}

/** A bar of colours with the numbers at its ends. */
function colourBar([low, high], colour, show) {
  const steps = d3.range(40).map((i) => svg('rect', { x: 60 + 5 * i, y: 2, width: 5.5, height: 14,
    fill: colour(low + (high - low) * (i + 0.5) / 40) }));
  return svg('svg', { class: 'drawing', width: 330, height: 20, role: 'img',
    'aria-label': `Colours from ${show(low)} to ${show(high)}` }, steps, svgText(54, 14, show(low), 'end'),
  svgText(266, 14, show(high), 'start'));
}

function roomFigure({ room, edge_noise_px: noise }, key) {
  const k = room.columns.indexOf(key), values = room.cells.map((cell) => cell[k]).filter(exists);
  const isCount = key === 'landmarks', range = isCount ? [0, Math.max(...values, 3)] : scaleRange(values);
  // Few landmarks and large sigmas are dark.
  const share = (value) => Math.min(Math.max((value - range[0]) / (range[1] - range[0]), 0), 1);
  const colour = (value) => d3.interpolateViridis(isCount ? share(value) : 1 - share(value));
  const show = (value) => isCount ? fixed(value, 0) : millimetres(value, value < 0.01 ? 2 : 1);
  const underlay = roomImage(room, k, colour);
  const plan = new Plan({ map: room.map, underlay, label: 'The room from above', tallest: 520 });
  const every = Math.max(1, Math.round(0.5 / room.step_m));
  const isShown = ([x, y]) => [[x, room.map.bounds_m[0]], [y, room.map.bounds_m[1]]].every(([at, from]) =>
    Math.floor((at - from) / room.step_m) % every === Math.floor(every / 2));
  plan.update({ labels: room.cells.filter(isShown).map((cell) => ({ at: [cell[0] - 0.1, cell[1] + 0.1],
    text: !exists(cell[k]) ? noValue : isCount ? fixed(cell[k], 0) : significant(1000 * cell[k], 2) })) });
  return figure({ id: `room_${key}`, title: `Places in the room: ${roomViews[key][0]}`, caption: `${roomViews[key][1]} `
    + `${isCount ? '' : 'The numbers are millimetres. '}Outlines have ${significant(noise)} px of noise per pixel of `
    + 'their length. Landmarks hide each other; furniture hides nothing, because the map states no heights of it. Red: '
    + 'no place is determined. Grey: no room for the body.' }, colourBar(range, colour, show), plan.node);
}

function roomSection(data) {
  if (!data.room) return null;
  const { cells, columns } = data.room, at = (key) => columns.indexOf(key);
  const isExact = cells.every((cell) => cell[at('whole_sigma_m')] === cell[at('sigma_m')]);
  const keys = Object.keys(roomViews).filter((key) => key !== 'whole_sigma_m' || !isExact);
  const place = el('div'), buttons = keys.map((key) => button(roomViews[key][0], () => choose(key)));
  const choose = (key) => {
    buttons.forEach((each, i) => each.setAttribute('aria-pressed', keys[i] === key));
    place.replaceChildren(figures(roomFigure(data, key)));
  };
  choose(keys[0]);
  const choice = el('div', { class: 'plan-buttons', role: 'group', 'aria-label': 'What is shown' }, buttons);
  return section('room', 'A place in the room', choice, place);
}

export function designPage(data) {
  const { rig, distances, sensitivities } = data;
  const length = (head, key, digits) => ({ head, value: (row) => row[key] ?? undefined,
    show: (row) => quantity(exists(row[key]) ? row[key] : undefined, 'm', digits) });
  const sigma = (head, key) => ({ head, value: (row) => row[key] ?? undefined,
    show: (row) => millimetres(exists(row[key]) ? row[key] : undefined) });
  showPage({ title: `twocone design: ${data.robot}`, lead: [el('p', { class: 'headline' }, designHeadline(data)),
    tiles([[degrees(rig.lower.apex_rad), 'angle of the lower cone'],
      [mm(rig.lower.mirror_radius_m), 'radius R of its rim'],
      [mm(rig.lower.lens_to_tip_m), 'd, from lens to tip'], [mm(rig.mirror_separation_m), 's, between the tips'],
      [`${fixed(rig.lower.lowest_rad * 180 / Math.PI, 0)} to ${degrees(rig.lower.highest_rad, 0)}`,
        'elevations of the lower mirror'],
      [exists(data.floor_from_m) ? quantity(data.floor_from_m, 'm') : 'never', 'from where both see the floor']])],
  sections: [
    section('sees', 'What it sees', figures(sightFigure(data), sigmaFigure(data)), table({ rows: distances,
      caption: `By distance, for a disparity of ${significant(data.sigma_px)} px: heights that both mirrors see, and `
        + 'sigma of a range',
      columns: [length('distance', 'distance_m', 2), length('lowest', 'lowest_m', 2), length('highest', 'highest_m', 2),
        sigma('least sigma', 'least_sigma_m'), sigma('most sigma', 'most_sigma_m')] })),
    section('build', 'How to build it', figures(measuresFigure(data)), sensitivities.length > 0 && table({
      rows: sensitivities, caption: `Error of a range at ${significant(data.at_m)} m and ${fixed(data.at_height_m)} m `
        + 'of height, by one number that is wrong by its sigma. A calibration finds most of these numbers',
      columns: [{ head: 'number', key: 'number', text: true }, { head: 'sigma', value: ({ words }) => words },
        sigma('range', 'range_m')] })),
    roomSection(data)] });
}
