// Remembers things for a tab of the browser, so that a page finds them again after a reload, or with the button Back: such as the
// simulation to which it can return. No DOM, but for the storage of the tab.

const ANSWER_MS = 200;
const PLACE_KEPT_MS = 60000;

export class TabMemory {
  #key;
  #mine = null; // what tells this tab's from those of others
  #channel = null;

  constructor(key) {
    this.#key = key;
  }

  // `found` is what recall() is to find; `id` belongs to this tab alone.
  remember(found, id) {
    this.#mine = id;
    this.#listen();
    store()?.setItem(this.#key, JSON.stringify({ found, id, page: page() }));
  }

  forget() {
    this.#mine = null;
    store()?.removeItem(this.#key);
  }

  // What was remembered, or null. A tab that was duplicated has a copy of what its original remembers: that is not its own.
  async recall() {
    const kept = this.#read();
    if (kept === null || kept.page !== page())
      return null;
    if (!isReload() && await this.#isElsewhere(kept.id)) {
      this.forget();
      return null;
    }
    return kept.found;
  }

  #read() {
    try {
      const kept = JSON.parse(store()?.getItem(this.#key) ?? 'null');
      return typeof kept?.found === 'object' && typeof kept.id === 'string' ? kept : null;
    } catch {
      return null;
    }
  }

  #listen() {
    this.#channel ??= new BroadcastChannel(this.#key);
    this.#channel.onmessage = ({ data }) => data?.asks === this.#mine && this.#mine !== null && this.#channel.postMessage({ has: this.#mine });
  }

  #isElsewhere(id) {
    const asking = new BroadcastChannel(this.#key);
    return new Promise((answer) => {
      asking.onmessage = ({ data }) => data?.has === id && answer(true);
      setTimeout(() => answer(false), ANSWER_MS);
      asking.postMessage({ asks: id });
    }).finally(() => asking.close());
  }
}

// The simulation, or the place in the line, to which the page can return: `ticket`, from the event of Session, and whatever else the
// page needs.
const simulation = new TabMemory('webots.simulation');

export const remember = (found) => simulation.remember({ ...found, at: Date.now() }, found.ticket.token ?? found.ticket.waiting);
export const forget = () => simulation.forget();

// A place that was left long ago is not found: nobody expects a simulation to start by itself then.
export async function recall() {
  const found = await simulation.recall();
  if (typeof found?.ticket?.machine !== 'string')
    return null;
  const { token, waiting } = found.ticket;
  const isKept = typeof token === 'string' || (typeof waiting === 'string' && Date.now() - found.at < PLACE_KEPT_MS);
  return isKept ? found : null;
}

const page = () => location.pathname + location.search;
const isReload = () => performance.getEntriesByType('navigation')[0]?.type === 'reload';

// Browsers may refuse the storage to pages in frames of other sites.
function store() {
  try {
    return sessionStorage;
  } catch {
    return null;
  }
}
