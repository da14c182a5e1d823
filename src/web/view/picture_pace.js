// Decides how large pictures may be for the network to bring them in time. No DOM, no clock: `now` is in milliseconds.
//
// The simulator announces each picture on its WebSocket (`time:`) and then writes it to the stream. What the network does not
// take waits in buffers on the way, and the pictures that are shown grow older and older. The age of a picture is the time
// since its announcement: the first announcement belongs to the first picture that arrives after it, and so on.

const OLD_MS = 400; // older pictures than this mean that some wait on the way
const FRESH_MS = 200;
const WINDOW_MS = 1000; // in which even the freshest picture has to be old
const SETTLING_MS = 2000; // after a change
const LAST_SETTLING_MS = 60000; // where new streams do not help
const RATE = 20; // pictures per second that the network should be able to bring
const SHARE = 0.7; // of what the network brings: the rest empties the buffers, and is for others
const SMALLEST = 0.25;
const LARGEST_STEP = 0.5;
const GROWTH = 1.2;
const FIRST_TRIAL_MS = 8000;
const LAST_TRIAL_MS = 120000;
const PROVEN_MS = 60000; // A size that was good for so long was not too large.
const MAX_ANNOUNCED = 1000;

export class PicturePace {
  #announced = [];
  #arrived = []; // in the last second: {at, age}
  #scale = 1;
  #changed = -Infinity;
  #grown = -Infinity;
  #trial = FIRST_TRIAL_MS;
  #waiting = -Infinity;
  #settling = SETTLING_MS;
  #isFirst = true;

  // The part of the full width and height that pictures are to have now, from 0.25 to 1.
  get scale() { return this.#scale; }

  // A new stream begins: what was announced for an old one does not come.
  begin(now) {
    this.#announced = [];
    this.#arrived = [];
    this.#changed = this.#waiting = now;
    this.#isFirst = true;
  }

  announce(now) {
    if (this.#announced.length < MAX_ANNOUNCED)
      this.#announced.push(now);
  }

  // A picture without an announcement is one of a simulation that is paused.
  arrive(now) {
    if (this.#isFirst)
      this.#announced = []; // for the stream before
    this.#isFirst = false;
    const announced = this.#announced.shift();
    if (announced !== undefined)
      this.#arrived.push({ at: now, age: now - announced });
  }

  // Says what to do: 'keep', 'shrink' (begin a new stream with smaller pictures: those on their way are old), 'grow', or 'renew'
  // (begin a new stream with pictures of the same size). A page that can't choose the size (`fixed`) only renews.
  decide(now, fixed = false) {
    this.#arrived = this.#arrived.filter(({ at }) => now - at < WINDOW_MS);
    if (now - this.#changed < this.#settling)
      return 'keep';
    const oldest = this.#announced[0] ?? now;
    const ages = this.#arrived.length > 0 ? this.#arrived.map(({ age }) => age) : [now - oldest];
    if (Math.min(...ages) > OLD_MS)
      return this.#slowDown(now, fixed);
    const isFresh = this.#arrived.length > 0 && Math.max(...ages) < FRESH_MS;
    if (isFresh)
      this.#settling = SETTLING_MS;
    else
      this.#waiting = now;
    if (fixed || this.#scale === 1 || now - this.#waiting < this.#trial)
      return 'keep';
    this.#scale = Math.min(1, this.#scale * GROWTH);
    this.#changed = this.#waiting = this.#grown = now;
    return 'grow';
  }

  #slowDown(now, fixed) {
    // Growing was too much: the next trial is later. Otherwise it is the network that has changed.
    this.#trial = now - this.#grown < PROVEN_MS ? Math.min(LAST_TRIAL_MS, 2 * this.#trial) : FIRST_TRIAL_MS;
    this.#changed = this.#waiting = now;
    if (fixed || this.#scale === SMALLEST) {
      this.#settling = Math.min(LAST_SETTLING_MS, 2 * this.#settling);
      return 'renew';
    }
    this.#scale = Math.max(SMALLEST, this.#scale * this.#step());
    return 'shrink';
  }

  // By what part of their width and height pictures have to shrink, so that RATE of them are a SHARE of what arrives now.
  #step() {
    if (this.#arrived.length === 0)
      return LARGEST_STEP;
    const fitting = this.#arrived.length / (WINDOW_MS / 1000) * SHARE / RATE;
    return Math.min(0.9, Math.max(LARGEST_STEP, Math.sqrt(fitting)));
  }
}
