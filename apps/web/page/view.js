// SPDX-License-Identifier: Apache-2.0
// The page of stored runs: their list, one run, or several side by side.
import { addressOf, button, el, millimetres, parseJsonLines, percent, schemeToggle, showPage, table } from './kit.js';
import { ChunkedStore } from './player.js';
import { RunView, runWords } from './runview.js';

const mostBeside = 4;

/** The state of the page in the address: { runs: [numbers], t_s }. */
export function stateOfHash(hash) {
  const query = new URLSearchParams(hash.replace(/^#/, ''));
  const runs = (query.get('runs') ?? '').split(',').filter((text) => /^\d+$/.test(text)).map(Number);
  return { runs: [...new Set(runs)].slice(0, mostBeside), t_s: Number(query.get('t')) || 0 };
}

/** The time is rounded up, so that it is not before the frame's. */
export function hashOfState({ runs, t_s = 0 }) {
  const time = t_s > 0 ? `&t=${Math.ceil(t_s * 1000 - 1e-6) / 1000}` : '';
  return runs.length ? `#runs=${runs.join(',')}${time}` : '#';
}

/** The list of runs; `open` is called with the numbers of those that are selected. */
function runList(rows, open) {
  const chosen = new Set();
  const opener = button('Show the selected runs', () => open([...chosen]), { disabled: true });
  const choice = el('span', { class: 'soft', role: 'status' }, ` Select up to ${mostBeside} to see them side by side.`);
  const box = ({ run, name }) => el('input', { type: 'checkbox', 'aria-label': `Select ${name}`,
    onchange: ({ target }) => {
      chosen[target.checked ? 'add' : 'delete'](run);
      opener.disabled = chosen.size === 0 || chosen.size > mostBeside;
      choice.textContent = ` ${chosen.size} selected, of at most ${mostBeside}.`;
    } });
  const shown = (head, key, show) => ({ head, key, show: (row) => show(row[key]) });
  const share = (value) => percent(value, 1), mm = (value_m) => millimetres(value_m, 2), text = true;
  const link = ({ run, name }) => el('a', { href: hashOfState({ runs: [run] }) }, name);
  const columns = [{ head: 'run', key: 'name', show: link }, { head: 'select', key: 'run', show: box, text },
    { head: 'robot', text }, { head: 'behaviour', text }, { head: 'method', text }, { head: 'seed' },
    { head: 'frames' },
    { head: 'finished', text, value: ({ finished }) => finished === false ? 'no' : finished && 'yes' },
    shown('mean error', 'mean_error_m', mm), shown('95 % of errors below', 'p95_error_m', mm),
    shown('in 95 % ellipse', 'coverage_95', share), shown('frames with a fix', 'fixes_share', share),
    shown('mean error, track', 'track_mean_error_m', mm)];
  const known = columns.filter(({ head, key = head }) => rows.some((row) => row[key] !== undefined));
  return el('div', { class: 'run-list' }, table({ caption: 'Runs', columns: known, rows }),
    rows.length > 1 && el('p', { class: 'screen-only' }, opener, choice));
}

/** The page `view`. */
export function viewPage() {
  const asked = async (path, query) => {
    const answer = await fetch(addressOf(path, query));
    if (!answer.ok) throw new Error(`${path}: status ${answer.status}`);
    return answer;
  };
  const get = async (path, query) => (await asked(path, query)).text();
  let listed, generation = 0;

  const openRun = async ({ run: number, frames: count }, container, options) => {
    const load = async (from, most) => parseJsonLines(await get('telemetry', { run: number, from, count: most }));
    const ofType = (lines, wanted) => lines.filter(({ type }) => type === wanted);
    const first = await load(0, 450), [run] = ofType(first, 'run'), events = ofType(first, 'event');
    const store = new ChunkedStore(async (from, most) => ofType(from === 0 ? first : await load(from, most), 'frame'),
      { count, rate_hz: run.robot?.rate_hz });
    await store.fetch(0);
    const view = new RunView(container, { run, events }, { ...options, store,
      cloudOf: async (frame) => (await asked('cloud', { run: number, frame })).arrayBuffer(),
      imageOf: (frame, side) => addressOf('image', { run: number, view: side, frame: frame.frame }) });
    container.after(el('p', { class: 'soft' }, runWords(run)));
    store.arrived = () => view.request();
    store.fetchDigests().catch(({ message }) => view.note.textContent = `Not all frames could be loaded: ${message}`);
    return view;
  };

  const showRuns = async (rows, t_s, mine) => {
    const names = rows.map(({ name }) => name), runs = rows.map(({ run }) => run);
    const containers = rows.map(() => el('div', {}, el('p', { class: 'soft' }, 'Loading\u2026')));
    const page = document.getElementById('main');
    page.replaceChildren(el('header', {}, el('h1', {}, names.join(' and ')), el('span', {},
      listed.length > 1 && el('a', { href: '#list' }, 'All runs'), ' ', schemeToggle())),
    el('div', { class: 'beside' }, containers.map((node, i) =>
      el('section', {}, rows.length > 1 && el('h2', {}, names[i]), node))));
    // The longest run has the player; the others show the same time.
    const longest = rows.indexOf(rows.reduce((a, b) => (b.frames ?? 0) > (a.frames ?? 0) ? b : a));
    const views = await Promise.all(rows.map((row, i) => openRun(row, containers[i],
      { follow: i !== longest, keyTarget: document })));
    if (mine !== generation) return;
    const { player, bar } = views[longest];
    if (views.length > 1) page.append(bar.node);
    let timer;
    const note = () => {
      if (mine !== generation || player.playing) return;
      history.replaceState(null, '', hashOfState({ runs, t_s: player.time_s }));
    };
    player.listeners.push(() => {
      views.forEach((view, i) => i !== longest && view.player.seekTime(player.time_s));
      clearTimeout(timer);
      timer = setTimeout(note, 300);
    });
    player.seekTime(t_s);
  };

  const open = (runs) => location.hash = hashOfState({ runs });
  const show = async () => {
    const mine = ++generation;
    try {
      listed ??= JSON.parse(await get('runs'));
      const { runs, t_s } = stateOfHash(location.hash);
      const rows = listed.length === 1 ? listed : listed.filter(({ run }) => runs.includes(run));
      if (rows.length) await showRuns(rows, t_s, mine);
      else showPage({ title: 'Stored runs', sections: [runList(listed, open)] });
    } catch ({ message }) {
      showPage({ title: 'twocone', sections: [el('p', { class: 'warning', role: 'alert' },
        `The program does not answer (${message}). Is it still running?`)] });
    }
  };
  window.addEventListener('hashchange', show);
  show();
}
