// Parses the "Connect to" field. No DOM, no network.

const EXPECTED =
  'Expected the address of a world (https://github.com/<owner>/<repository>/blob/<branch>/worlds/<file>.wbt), ' +
  'of a session server (http://<host>:1999/session?url=<world>) or of a running simulator (ws://<host>:<port>).';

// The servers' addresses keep everything before the last path segment, so that "https://host/1999/viewer/" and
// "https://host/1999/session" (ports rewritten to paths by a proxy) both lead to "https://host/1999/".
export function sessionServerOf(url) {
  return new URL('.', url).href.replace(/[?#].*$/, '');
}

// "http" becomes "ws" and "https" becomes "wss"; `webToSocket` and `socketToWeb` undo each other.
export const webToSocket = (url) => url.replace(/^http/i, 'ws');
export const socketToWeb = (url) => url.replace(/^ws/i, 'http');

// Returns {kind: 'session', server, request, world} or {kind: 'simulator', url}; throws an Error whose message can
// be shown. `ownServer` is the address of the session server that served this page, ending with a slash.
export function parseAddress(text, ownServer) {
  const address = text.trim();
  if (address === '')
    throw new Error(`The address is empty. ${EXPECTED}`);
  const url = parseUrl(address);
  if (url.protocol === 'ws:' || url.protocol === 'wss:')
    return simulator(url, address);
  const isWeb = url.protocol === 'http:' || url.protocol === 'https:';
  if (!isWeb && !isFolder(url))
    throw new Error(`An address cannot start with "${url.protocol}". ${EXPECTED}`);
  if (isWeb && /\/session(\.php)?$/.test(url.pathname))
    return sessionRequest(url, address);
  if (isWorld(url.pathname))
    return { kind: 'session', server: ownServer, request: `${ownServer}session?url=${address}`, world: address };
  throw new Error(`"${address}" names neither a world nor a session server. ${EXPECTED}`);
}

function parseUrl(address) {
  try {
    return new URL(address);
  } catch {
    throw new Error(`"${address}" is not a complete address. ${EXPECTED}`);
  }
}

// "local:/owner/repository/...": a folder that the simulation servers have under a name of their operator's choice.
const isFolder = (url) => url.host === '' && url.pathname.startsWith('/');

const isWorld = (path) => path.toLowerCase().endsWith('.wbt');

function simulator(url, address) {
  if (isWorld(url.pathname))
    throw new Error(`"${address}" is the address of a project on a web site, which this page cannot start. ${EXPECTED}`);
  return { kind: 'simulator', url: `${url.protocol}//${url.host}${url.pathname}`.replace(/\/+$/, '') };
}

function sessionRequest(url, address) {
  // Taken literally, as existing clients do: the simulation server expects the text that follows "url=". Only an
  // address that was encoded as a whole (https%3A%2F%2F..., local%3A%2F...) is decoded.
  const literal = /[?&]url=([^&#]*)/.exec(address)?.[1] ?? '';
  const world = /^[a-z][a-z0-9+.-]*%3a/i.test(literal) ? url.searchParams.get('url') : literal;
  if (world === '')
    throw new Error(`"${address}" does not say which world to start: "?url=<world>" is missing. ${EXPECTED}`);
  return { kind: 'session', server: sessionServerOf(url), request: address, world };
}
