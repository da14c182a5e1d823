// Parses the addresses that people and pages enter. No DOM, no network.

import { say } from './texts.js';

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
// A badge, as a README has it, in Markdown or HTML, counts as the link that it is.
export function parseAddress(text, ownServer) {
  const address = text.trim();
  if (address === '')
    throw new Error(say('address.empty'));
  for (const link of linksIn(address))
    try {
      return parseLink(link, ownServer);
    } catch { /* The picture of a badge is a link, too. */ }
  return parseLink(address, ownServer);
}

function parseLink(text, ownServer) {
  const address = withScheme(text);
  const url = parseUrl(address);
  if (url.protocol === 'ws:' || url.protocol === 'wss:')
    return asksForWorld(url) ? sessionRequest(parseUrl(socketToWeb(address)), socketToWeb(address)) : simulator(url, address);
  const isWeb = url.protocol === 'http:' || url.protocol === 'https:';
  if (!isWeb && !isFolder(url))
    throw new Error(say('address.scheme', { scheme: url.protocol }));
  if (isWeb && /\/session(\.php)?$/.test(url.pathname))
    return sessionRequest(url, address);
  if (isWeb && /^\/run\/?$/.test(url.pathname) && asksForWorld(url)) // https://webots.cloud/run?version=R2025a&url=<world>
    return parseLink(worldIn(url, address), ownServer);
  if (isWorld(url.pathname))
    return { kind: 'session', server: ownServer, request: `${ownServer}session?url=${address}`, world: address };
  throw new Error(say('address.unknown', { address }));
}

// The address of a repository, or of a folder in one, that stands where a world's is wanted; '' for anything else.
export function folderIn(text) {
  const typed = text.trim();
  const address = withScheme(linksIn(typed).at(-1) ?? typed);
  let url;
  try {
    url = new URL(address);
  } catch {
    return '';
  }
  const isWeb = url.protocol === 'http:' || url.protocol === 'https:';
  const names = url.pathname.split('/').filter((name) => name !== '');
  const isPlace = (isWeb || isFolder(url)) && names.length >= 2 && !asksForWorld(url);
  return isPlace && !isWorld(url.pathname) && !/\/session(\.php)?$/.test(url.pathname) ? address : '';
}

// [![name](picture)](link), [name]: link, <a href="link"><img src="picture"></a>, <link>, and ":target: link" of reStructuredText.
function linksIn(text) {
  const links = text.matchAll(/\]\(\s*<?([^\s<>()]+)|href\s*=\s*["']?([^\s"'<>]+)|^\[[^\]]*\]:\s*<?([^\s<>]+)|^<(\w+:[^\s<>]+)>$|:target:\s*(\S+)/gi);
  return Array.from(links, (found) => found.slice(1).find((link) => link !== undefined).replaceAll('&amp;', '&'));
}

// Some browsers show, and let people copy, addresses without "https://".
const withScheme = (text) => (/^[a-z0-9-]+(\.[a-z0-9-]+)+\//i.test(text) ? `https://${text}` : text);

function parseUrl(address) {
  try {
    return new URL(address);
  } catch {
    throw new Error(say('address.incomplete', { address }));
  }
}

// "local:/owner/repository/...": a folder that the simulation servers have under a name of their operator's choice.
const isFolder = (url) => url.host === '' && url.pathname.startsWith('/');

const isWorld = (path) => path.toLowerCase().endsWith('.wbt');

function simulator(url, address) {
  if (isWorld(url.pathname))
    throw new Error(say('address.website', { address }));
  return { kind: 'simulator', url: `${url.protocol}//${url.host}${url.pathname}`.replace(/\/+$/, '') };
}

const asksForWorld = (url) => /[?&]url=/.test(url.search);

function sessionRequest(url, address) {
  const world = worldIn(url, address);
  if (world === '')
    throw new Error(say('address.noWorld', { address }));
  return { kind: 'session', server: sessionServerOf(url), request: address, world };
}

// Taken literally, as existing clients do: the simulation server expects the text that follows "url=". Only an
// address that was encoded as a whole (https%3A%2F%2F..., local%3A%2F...) is decoded.
function worldIn(url, address) {
  const literal = /[?&]url=([^&#]*)/.exec(address)?.[1] ?? '';
  return /^[a-z][a-z0-9+.-]*%3a/i.test(literal) ? url.searchParams.get('url') : literal;
}

// Parses what View.open() takes, on a page at the address `page`. Returns what parseAddress() returns, or
//   {kind: 'session', server, request, world, project, file}  a project of the page's own website, below a session server:
//                                                              ws://host:port/<project>/worlds/<file>.wbt
//   {kind: 'scene', url}                                       an exported scene: file.x3d, file.w3d
export function parseViewAddress(text, ownServer, page) {
  const address = text.trim();
  if (/\.[wx]3d([?#].*)?$/i.test(address))
    return { kind: 'scene', url: new URL(address, page).href };
  if (!/^wss?:/i.test(address))
    return parseAddress(address, ownServer);
  const url = parseUrl(address);
  if (asksForWorld(url) || !isWorld(url.pathname)) // ws://host:port/session?url=<world>, as pages of 2021 have it
    return parseLink(address, ownServer);
  const [, project, file] = /^wss?:\/\/[^/]+\/(.+)\/worlds\/([^/?#]+)$/i.exec(address) ?? []; // sent as it was entered
  if (project === undefined)
    throw new Error(say('address.noProject', { address }));
  const server = `${socketToWeb(url.protocol)}//${url.host}/`;
  return { kind: 'session', server, request: `${server}session`, world: address, project, file };
}
