// SPDX-License-Identifier: Apache-2.0
// The page of a simulated world that a program serves: its robots from above, and what their cameras see.
import { el, facts, figure, fixed, plural, schemeToggle, setText } from './kit.js';
import { Plan } from './plan.js';
import { Connection } from './live.js';

const mostTrail = 4000;  // places
const robotColours = ['c1', 'c2', 'c3', 'c4', 'c5', 'c6', 'c7', 'c8'], dashes = [undefined, '8 3', '2 3', '8 3 2 3'];

/** The page `world`. */
export function worldPage() {
  const title = el('h1', {}, 'twocone'), state = el('p', { class: 'state', role: 'status' });
  const room = el('div'), numbers = el('div'), pictures = el('div', { class: 'beside' });
  const trails = new Map(), views = new Map();
  let plan, expected = [], robots = [];

  const lookOf = (name) => {
    const at = [...trails.keys()].indexOf(name);
    return { colour: robotColours[at % robotColours.length], dash: dashes[at % dashes.length] };
  };
  const lines = {
    world: ({ name, map }) => {
      document.title = `${name}, served`;
      setText(title, document.title);
      trails.clear();
      plan = new Plan({ map, label: 'The room from above, with the robots where they really are' });
      const about = { id: 'world', title: 'Room from above', caption: 'Robots where they really are.' };
      room.replaceChildren(figure(about, plan.node));
    },
    robots: (message) => {
      robots = message.robots;
      expected = message.images;
      for (const { name, x_m, y_m } of robots) {
        if (!trails.has(name)) trails.set(name, []);
        const trail = trails.get(name);
        trail.push([x_m, y_m]);
        if (trail.length > mostTrail) trail.shift();
      }
      plan.update({
        paths: robots.map(({ name }) => ({ name, ...lookOf(name), points: trails.get(name) })),
        poses: robots.map((robot) => ({ ...robot, ...lookOf(robot.name), radius_m: 0.15 })),
        labels: robots.map(({ name, x_m, y_m }) => ({ text: name, at: [x_m, y_m], above: true })),
      });
      numbers.replaceChildren(facts(robots.map(({ name, t_s, x_m, y_m, heading_rad, contact }) => [name,
        `${fixed(t_s, 2)} s, (${fixed(x_m, 3)}, ${fixed(y_m, 3)}) m, ${fixed(heading_rad * 180 / Math.PI, 1)}\u00b0`
        + (contact ? `, touches ${contact}` : '')])));
      const present = new Set(expected.map(({ robot, camera }) => `${robot} ${camera}`));
      for (const [key, { node }] of views) {
        if (!present.has(key)) {
          node.remove();
          views.delete(key);
        }
      }
    },
  };
  const showImage = ({ frame: place, type, bytes }) => {
    if (!expected[place]) return;
    const key = `${expected[place].robot} ${expected[place].camera}`;
    if (!views.has(key)) {
      const image = el('img', { alt: `what ${key} sees` });
      const node = el('figure', {}, image, el('figcaption', {}, key));
      views.set(key, { image, node });
      pictures.append(node);
    }
    const { image } = views.get(key), before = image.src;
    image.src = URL.createObjectURL(new Blob([bytes], { type }));
    if (before) URL.revokeObjectURL(before);
  };
  const tell = (connected) => {
    state.dataset.state = connected ? 'good' : 'bad';
    const count = plural(robots.length, 'robot');
    setText(state, connected ? `Connected; ${count}.` : 'Disconnected; connecting again\u2026');
  };
  let isConnected = false;
  new Connection({
    changed: (connected) => tell(isConnected = connected),
    line: (message) => {
      lines[message.type]?.(message);
      tell(isConnected);
    },
    image: showImage,
  });
  const header = el('header', {}, title, schemeToggle());
  document.getElementById('main').replaceChildren(header, state, room, numbers, pictures);
}
