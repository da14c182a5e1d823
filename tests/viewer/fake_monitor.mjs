// The monitor pages of a site of the test's making, without servers: the shell as core/pages/monitor_page.cpp makes it, and whatever snapshot the
// test says. Nothing listens for WebSockets, so a page asks every five seconds, as behind a proxy that lets none through.
//
//   const monitor = await startFakeMonitor('session');   // or 'simulation'; ends with the tests of the file
//   monitor.snapshot = { … };                            // monitor.url is the page

import { once } from 'node:events';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { after } from 'node:test';

const WEB = new URL('../../src/web/', import.meta.url);
const read = (name) => readFileSync(new URL(name, WEB), 'utf-8');
const LANGUAGES = ['en', 'de', 'es', 'fr', 'it', 'ja', 'zh'];
const STYLES = ['view/tokens.css', 'viewer/base.css', 'viewer/page.css', 'monitor/monitor.css'];

function texts() {
  const own = Object.entries(JSON.parse(read('monitor/texts.json')));
  return Object.fromEntries(LANGUAGES.map((language) => [language, {
    ...Object.fromEntries(Object.entries(JSON.parse(read(`view/texts/${language}.json`))).filter(([key]) => /^(site\.|waiting\.(room|suitable)$)/.test(key))),
    ...Object.fromEntries(own.map(([key, said]) => [key, said[language]]))
  }]));
}

const data = (id, value) => `<script type="application/json" id="${id}">${JSON.stringify(value).replaceAll('<', '\\u003c')}</script>\n`;

function page(kind, snapshot) {
  const scripts = ['texts.js', 'chart.js', 'live.js', 'operator.js', `${kind}.js`];
  return `<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><meta name="color-scheme" content="light dark">
<title>Webots ${kind} server</title>${STYLES.map((name) => `<style>\n${read(name)}</style>`).join('\n')}</head>
<body data-port="1999"><header>
${read('viewer/favicon.svg')}<h1>${kind === 'session' ? 'Webots session server' : snapshot.about.title || 'Webots simulation server'}</h1></header>
<main></main>${data('texts', texts())}${data('snapshot', snapshot)}${scripts.map((name) => `<script>\n${read(`monitor/${name}`)}</script>`).join('\n')}
</body></html>`;
}

export async function startFakeMonitor(kind) {
  const monitor = { kind, snapshot: null, decisions: null, asked: [] };
  const server = createServer(({ url, method, headers }, answer) => {
    const path = url.split('?')[0];
    monitor.asked.push(`${method} ${url}`);
    const say = (status, type, body) => answer.writeHead(status, { 'Content-Type': type }).end(body);
    if (path === '/monitor' && headers.accept?.startsWith('application/json'))
      return say(200, 'application/json', JSON.stringify(monitor.snapshot));
    if (path === '/monitor')
      return say(200, 'text/html; charset=UTF-8', page(kind, monitor.snapshot));
    if (path === '/api/decisions' && monitor.decisions)
      return say(200, 'application/json', JSON.stringify({ decisions: monitor.decisions }));
    if (path === '/api/operator')
      return say(200, 'text/plain', 'operator');
    if (path.startsWith('/api/doctor'))
      return say(200, 'application/json', JSON.stringify({ verdict: 'ok', examined: '2026-11-29T10:00:00Z', underWay: false, findings: [{ verdict: 'ok', subject: 'clock', found: 'it is right', remedy: '' }] }));
    return say(path.startsWith('/api/') ? 200 : 404, 'text/plain', 'done');
  });
  server.listen(0, 'localhost');
  await once(server, 'listening');
  after(() => {
    server.closeAllConnections();
    server.close();
  });
  monitor.url = `http://localhost:${server.address().port}/monitor`;
  return monitor;
}
