// An animation as Webots exports it beside a scene: {basicTimeStep, ids, frames: [{time, updates, labels}]}, where a frame has what has
// changed since the one before ("poses" instead of "updates" up to R2022b). No DOM, no clock: whoever shows it says when.

export class Animation {
  #frames;
  #start; // the update that leads from any frame to before the first one
  #shown = -1; // the frame that is shown

  // `data` is what the file contains; `initial` returns the value of a field of a node in the scene before the first frame: (id, name)
  // => text, or undefined where that is not known. Throws where `data` is no animation.
  constructor(data, initial = () => undefined) {
    const step = Number(data?.basicTimeStep) > 0 ? Number(data.basicTimeStep) : 32;
    if (!Array.isArray(data?.frames) || data.frames.length === 0)
      throw new Error('no frames');
    let last = -step;
    this.#frames = data.frames.map((frame) => {
      const { time, updates, poses, labels } = frame ?? {};
      last = Number.isFinite(time) ? Math.max(last, time) : last + step;
      return { time: last, updates: list(updates ?? poses), labels: list(labels) };
    });
    this.#start = this.#before(initial);
  }

  // Of the last frame, in milliseconds.
  get duration() { return this.#frames.at(-1).time; }

  // What has to change so that the scene is as at `time`, as an update of Scene.receive(); null when nothing has.
  at(time) {
    const wanted = this.#frameAt(time);
    if (wanted === this.#shown)
      return null;
    const merged = merge(wanted < this.#shown ? this.#start : NOTHING,
      this.#frames.slice(wanted < this.#shown ? 0 : this.#shown + 1, wanted + 1));
    this.#shown = wanted;
    return { time: this.#frames[wanted].time, ...merged };
  }

  // The last frame that is not later.
  #frameAt(time) {
    let [low, high] = [0, this.#frames.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.#frames[middle].time <= time)
        low = middle;
      else
        high = middle - 1;
    }
    return low;
  }

  #before(initial) {
    const { updates, labels } = merge(NOTHING, this.#frames);
    for (const update of updates)
      for (const name of Object.keys(update).filter((key) => key !== 'id')) {
        update[name] = initial(update.id, name);
        if (update[name] === undefined)
          delete update[name];
      }
    return { updates, labels: labels.map(({ id }) => ({ id, text: '' })) };
  }
}

const NOTHING = { updates: [], labels: [] };

const list = (value) => (Array.isArray(value) ? value.filter((item) => typeof item === 'object' && item !== null) : []);

function merge(first, others) {
  const [updates, labels] = [new Map(), new Map()];
  for (const part of [first, ...others]) {
    for (const update of part.updates)
      updates.set(update.id, { ...updates.get(update.id), ...update });
    for (const label of part.labels)
      labels.set(label.id, { ...labels.get(label.id), ...label });
  }
  return { updates: [...updates.values()], labels: [...labels.values()] };
}
