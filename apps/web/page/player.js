// SPDX-License-Identifier: Apache-2.0
// The frames of a run, and what plays them. Logic without DOM.

/** The standard deviation of a place, in both directions together, of its covariance; undefined where there is none. */
export function positionSigma(row) {
  const sum = (row?.var_x_m2 ?? NaN) + (row?.var_y_m2 ?? NaN);
  return sum >= 0 ? Math.sqrt(sum) : undefined;
}

/** The distance between two rows with x_m and y_m; undefined where one is missing. */
export function distanceBetween(a, b) {
  const distance = Math.hypot((a?.x_m ?? NaN) - (b?.x_m ?? NaN), (a?.y_m ?? NaN) - (b?.y_m ?? NaN));
  return Number.isNaN(distance) ? undefined : distance;
}

/** What the figures over time and the choice of frames need of a frame. It stays when the frame itself is dropped. */
export function digest({ frame, t_s, truth, track, odometry, fixes: [fix] = [], ranges = [], lower_lost, upper_lost }) {
  const verdicts = {};
  if (fix?.verdict) verdicts.fix = fix.verdict;
  if (track?.state) verdicts.track = track.state;
  for (const { landmark, verdict } of ranges) verdicts[`range:${landmark}`] = verdict;
  const place = (row) => row?.x_m === undefined || row.y_m === undefined ? null : [row.x_m, row.y_m];
  return {
    frame, t_s, verdicts, lost: (lower_lost ?? 0) + (upper_lost ?? 0),
    fixError: fix?.error_m, fixSigma: positionSigma(fix),
    trackError: distanceBetween(track, truth), trackSigma: positionSigma(track),
    truth: place(truth), track: place(track), odometry: place(odometry),
  };
}

/**
 * Frames by their position: 0 is the first of the run, or of those that are embedded. Of a live run the oldest frames
 * are dropped, so that positions begin at `begin`; of a stored run that is loaded in chunks, some may be absent.
 */
export class FrameStore {
  /** @param most number of frames that are held; @param rate_hz gives the times of frames that are not loaded */
  constructor({ count = 0, rate_hz = 15, most = Infinity } = {}) {
    Object.assign(this, { begin: 0, end: count, rate_hz, most, frames: new Map(), digests: new Map() });
    this.counts = new Map();  // of 'fix', 'track', 'range:NAME': a Map from verdict to number of frames
    this.version = 0;         // changes with the digests, so that figures know when they are stale
  }

  /** Is called with the position of a frame that is about to be shown. */
  want() {}

  put(position, frame) {
    this.frames.set(position, frame);
    this.end = Math.max(this.end, position + 1);
    if (this.digests.has(position)) return;
    this.digests.set(position, digest(frame));
    this.count(this.digests.get(position), 1);
    ++this.version;
  }

  append(frame) {
    this.put(this.end, frame);
    while (this.end - this.begin > this.most) {
      this.count(this.digests.get(this.begin), -1);
      this.digests.delete(this.begin);
      this.frames.delete(this.begin++);
    }
  }

  count({ verdicts }, step) {
    for (const [who, verdict] of Object.entries(verdicts)) {
      if (!this.counts.has(who)) this.counts.set(who, new Map());
      const of = this.counts.get(who);
      of.set(verdict, (of.get(verdict) ?? 0) + step);
      if (of.get(verdict) === 0) of.delete(verdict);
    }
  }

  at(position) { return this.frames.get(position); }

  timeAt(position) { return this.digests.get(position)?.t_s ?? position / this.rate_hz; }

  /** The last position whose time is at most t_s. */
  positionAt(t_s) {
    let low = this.begin, high = this.end - 1;
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.timeAt(middle) <= t_s + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }
}

/** A store that loads chunks when they are needed. It holds the frames of the chunks that were needed last. */
export class ChunkedStore extends FrameStore {
  /** @param load (from, count) returns a promise of the frames; @param arrived is called after frames were put */
  constructor(load, { count, rate_hz, chunk = 450, held = 6, arrived = () => {} }) {
    super({ count, rate_hz });
    Object.assign(this, { load, chunk, held, arrived, pending: new Map() });
    this.recent = [];  // chunks of which the frames are held, or will be, the last needed one at the end
  }

  want(position) {
    this.need(Math.floor(position / this.chunk));
    this.need(Math.floor((position + this.chunk / 4) / this.chunk));
  }

  need(index) {
    if (index * this.chunk >= this.end) return;
    if (this.recent.at(-1) !== index) this.recent = [...this.recent.filter((other) => other !== index), index];
    if (this.recent.length > this.held) this.drop(this.recent.shift());
    if (!this.frames.has(index * this.chunk)) this.fetch(index).catch(() => {});
  }

  fetch(index) {
    if (!this.pending.has(index)) {
      this.pending.set(index, this.load(index * this.chunk, this.chunk).then((frames) => {
        frames.forEach((frame, i) => this.put(index * this.chunk + i, frame));
        if (!this.recent.includes(index)) this.drop(index);
        this.arrived();
      }).finally(() => this.pending.delete(index)));
    }
    return this.pending.get(index);
  }

  drop(index) {
    for (let i = 0; i < this.chunk; ++i) this.frames.delete(index * this.chunk + i);
  }

  /** Loads all chunks once, one after the other, for the digests; stops at the first failure. */
  async fetchDigests() {
    for (let index = 0; index * this.chunk < this.end; ++index) {
      if (!this.digests.has(index * this.chunk)) await this.fetch(index);
    }
  }
}

export const playerSpeeds = [0.25, 0.5, 1, 2, 4, 8];

/** What is shown of a store, and when. Its owner calls tick() with the time that has passed. */
export class Player {
  constructor(store, { live = false } = {}) {
    Object.assign(this, { store, live, following: live, playing: live, speed: 1, position: 0, clock_s: 0 });
    this.listeners = [];  // are called after every change
    this.chosen = null;  // { who, verdict }: frames that next() stops at
  }

  changed() { this.listeners.forEach((listener) => listener(this)); }

  get frame() { return this.store.at(this.position); }

  get time_s() { return this.store.timeAt(this.position); }

  moveTo(position) {
    const { begin, end } = this.store;
    this.position = Math.min(Math.max(Math.round(position), begin), Math.max(end - 1, begin));
    if (end > begin) this.store.want(this.position);
  }

  seek(position) {
    this.following = false;
    if (this.live) this.playing = false;
    this.moveTo(position);
    this.clock_s = this.time_s;
    this.changed();
  }

  seekTime(t_s) { this.seek(this.store.positionAt(t_s)); }

  step(frames) {
    this.playing = false;
    this.seek(this.position + frames);
  }

  play() {
    if (this.position >= this.store.end - 1 && !this.live) this.moveTo(this.store.begin);
    this.playing = true;
    this.clock_s = this.time_s;
    this.changed();
  }

  pause() {
    this.playing = this.following = false;
    this.changed();
  }

  toggle() { this[this.playing ? 'pause' : 'play'](); }

  /** Shows the newest frame of a live run, and those that follow it. */
  goLive() {
    this.following = this.playing = true;
    this.grown();
  }

  /** Is called after the store got frames: a paused view stays where it is, unless its frame was dropped. */
  grown() {
    if (this.following || this.position < this.store.begin) this.moveTo(this.following ? this.store.end - 1 : 0);
    this.changed();
  }

  /** Plays on by `passed_s` of the wall clock. It waits at frames that are absent, and ends at the last one. */
  tick(passed_s) {
    if (!this.playing || this.following || !this.frame) return;
    this.clock_s += passed_s * this.speed;
    const before = this.position;
    this.moveTo(this.store.positionAt(this.clock_s));
    const ended = this.position >= this.store.end - 1;
    if (ended) this.playing = this.following = this.live;
    if (ended || this.position !== before) this.changed();
  }

  faster(step) {
    const at = playerSpeeds.indexOf(this.speed) + step;
    this.speed = playerSpeeds[Math.min(Math.max(at, 0), playerSpeeds.length - 1)];
    this.changed();
  }

  choose(chosen) {
    this.chosen = chosen;
    this.changed();
  }

  /** Goes to the next chosen frame in a direction (+1 or -1), and pauses. Returns whether there is one. */
  next(direction) {
    const { begin, end, digests } = this.store;
    for (let at = this.position + direction; this.chosen && at >= begin && at < end; at += direction) {
      if (digests.get(at)?.verdicts[this.chosen.who] !== this.chosen.verdict) continue;
      this.playing = false;
      this.seek(at);
      return true;
    }
    return false;
  }
}
