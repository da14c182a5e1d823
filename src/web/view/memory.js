// Remembers for a tab of the browser the simulation to which it can return after a reload, or with the button Back. No DOM,
// but the storage of the tab.

const KEY = 'webots.simulation';
const ANSWER_MS = 200;

let mine = null; // the token of the simulation that this page shows
let channel = null;

// `found` is what recall() is to find: `ticket`, from the event of Session, and whatever else the page needs.
export function remember(found) {
  mine = found.ticket.token;
  listen();
  store()?.setItem(KEY, JSON.stringify({ ...found, page: page() }));
}

export function forget() {
  mine = null;
  store()?.removeItem(KEY);
}

// What was remembered, or null. A tab that was duplicated has a copy of what its original remembers: that is not its own.
export async function recall() {
  const kept = read();
  if (kept === null || kept.page !== page())
    return null;
  if (!isReload() && await isElsewhere(kept.ticket.token)) {
    forget();
    return null;
  }
  return kept;
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

function read() {
  try {
    const kept = JSON.parse(store()?.getItem(KEY) ?? 'null');
    return typeof kept?.ticket?.token === 'string' && typeof kept.ticket.machine === 'string' ? kept : null;
  } catch {
    return null;
  }
}

function listen() {
  channel ??= new BroadcastChannel(KEY);
  channel.onmessage = ({ data }) => data?.asks === mine && mine !== null && channel.postMessage({ has: mine });
}

function isElsewhere(token) {
  const asking = new BroadcastChannel(KEY);
  return new Promise((answer) => {
    asking.onmessage = ({ data }) => data?.has === token && answer(true);
    setTimeout(() => answer(false), ANSWER_MS);
    asking.postMessage({ asks: token });
  }).finally(() => asking.close());
}
