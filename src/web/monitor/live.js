"use strict";

// What the pages of both servers share: the connection that keeps them current, their header, and the history below them.
const monitor = (() => {
  const silence = 90_000; // ms without a message after which a connection counts as dead
  const pollInterval = 5_000;
  const maxPause = 15_000;
  const SPANS = { minutes: 600, day: 86400 }; // s

  // Behind the gateway of a session server a machine's page has no origin (Content-Security-Policy: sandbox). Browsers give it no password, and no
  // server knows it: it has been told a key instead.
  const isSandboxed = self.origin === 'null';
  const below = isSandboxed ? `/${document.body.dataset.key}` : '';

  // An element with text or elements in it; text stays text.
  function make(tag, attributes, ...content) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes))
      element.setAttribute(name, value);
    element.append(...content);
    return element;
  }

  // Writes only text that differs, so that a selection survives.
  function write(element, text) {
    if (element.textContent !== text)
      element.textContent = text;
  }

  // The server is at the page's own address; behind a proxy that passes WebSockets on for `/<port>/...` only, it is there.
  function addresses() {
    const base = (location.protocol === 'https:' ? 'wss://' : 'ws://') + location.host;
    return [...new Set([base + location.pathname + below, `${base}/${document.body.dataset.port}/monitor${below}`])];
  }

  const header = document.querySelector('header');
  const main = document.querySelector('main');
  const connection = make('p', { id: 'connection', role: 'status', hidden: '' });
  const language = make('select', { id: 'language', 'aria-label': say('monitor.language') });
  language.append(...texts.names.map(([name, own]) => {
    const option = new Option(own, name, false, name === texts.language);
    option.lang = name;
    return option;
  }));
  language.onchange = () => texts.choose(language.value);
  document.documentElement.lang = texts.language;
  const second = make('div', { class: 'second' }, connection);
  header.append(second, language);

  // Where else people may go, by addresses below the page's own folder.
  function link(address, text) {
    connection.before(make('a', { href: address }, text));
  }

  const CONNECTIONS = { live: () => say('monitor.live'), asks: () => say('monitor.everyFiveSeconds'), lost: () => say('monitor.connectionLost') };
  function showConnection(state) {
    connection.hidden = false;
    connection.dataset.state = state;
    write(connection, CONNECTIONS[state]());
  }

  // Calls take(message) for a snapshot and then for every update, for as long as the page is open. The first one stands in the page.
  function watch(take) {
    let candidate = 0;
    let pause = 1_000;
    const first = document.getElementById('snapshot').textContent;
    if (first) // a page of very many machines has none
      take(JSON.parse(first));

    function connect() {
      const candidates = addresses();
      const socket = new WebSocket(candidates[candidate % candidates.length]);
      let heard = false;
      let timer = setTimeout(() => socket.close(), silence);
      socket.onmessage = (event) => {
        clearTimeout(timer);
        timer = setTimeout(() => socket.close(), silence);
        heard = true;
        pause = 1_000;
        showConnection('live');
        take(JSON.parse(event.data));
      };
      socket.onclose = () => {
        clearTimeout(timer);
        if (heard) {
          showConnection('lost');
          setTimeout(connect, pause);
          return;
        }
        candidate += 1;
        if (candidate % candidates.length !== 0)
          connect();
        else
          poll();
      };
    }

    // Where no WebSocket gets through, the page polls.
    async function poll() {
      try {
        const answer = await fetch(location.pathname + below, { headers: { Accept: 'application/json' }, cache: 'no-store' });
        if (answer.status === 410) // the key is too old: the page is told a new one
          location.reload();
        if (!answer.ok)
          throw new Error(`status ${answer.status}`);
        take(await answer.json());
        showConnection('asks');
        pause = pollInterval;
      } catch {
        showConnection('lost');
        pause = Math.min(2 * pause, maxPause);
      }
      setTimeout(connect, pause);
    }

    connect();
  }

  // Series over time: those of a snapshot, and the points that follow.
  function timeline(span) {
    return {
      times: [],
      series: [], // {name, history}
      restate(series, last, spacing) {
        const count = series[0]?.history.length ?? 0;
        this.series = series;
        this.times = Array.from({ length: count }, (_, index) => last - (count - 1 - index) * spacing);
      },
      add(time, values) {
        this.times.push(time);
        this.series.forEach(({ history }, index) => history.push(values[index] ?? null));
        const old = this.times.findIndex((each) => each >= time - span);
        if (old > 0) {
          this.times.splice(0, old);
          this.series.forEach(({ history }) => history.splice(0, old));
        }
      },
      of(name) { return this.series.find((each) => each.name === name)?.history ?? []; },
    };
  }

  // The section with charts of ten minutes or of a day; `draw(span, name)` draws them, and says which are shown.
  function history(draw) {
    const buttons = Object.entries({ minutes: say('monitor.tenMinutes'), day: say('monitor.aDay') }).map(([name, text]) => {
      const button = make('button', { type: 'button', 'aria-pressed': 'false', 'data-span': name }, text);
      button.onclick = () => choose(name);
      return button;
    });
    const place = make('div', { class: 'charts' });
    const section = make('section', { id: 'history' },
      make('div', { class: 'title' }, make('h2', {}, say('monitor.history')), make('div', { class: 'choice', role: 'group', 'aria-label': say('monitor.history') }, ...buttons)), place);
    let chosen = 'minutes';

    function choose(name) {
      chosen = name;
      refresh();
    }

    function refresh() {
      for (const button of buttons)
        button.setAttribute('aria-pressed', String(button.dataset.span === chosen));
      const wanted = draw(SPANS[chosen], chosen).map((each) => each.element);
      if (wanted.length !== place.children.length || wanted.some((each, index) => each !== place.children[index]))
        place.replaceChildren(...wanted);
    }

    return { section, refresh };
  }

  // A bar from 0 to 100 %, and what it says in words beside it.
  function bar() {
    const fill = make('span', { class: 'fill' });
    const words = make('b', {});
    const element = make('span', { class: 'measure' }, make('span', { class: 'bar', 'aria-hidden': 'true' }, fill), words);
    return {
      element,
      show(share, text, isHigh = false) {
        element.firstElementChild.hidden = share === null;
        fill.style.setProperty('--value', String(Math.round(Math.min(100, Math.max(0, share ?? 0)))));
        element.classList.toggle('high', isHigh);
        write(words, text);
      },
    };
  }

  // A table; on a phone its rows are cards, whose cells say which column they are of.
  function table(id, columns) {
    const head = make('tr', {}, ...columns.map(({ title, isNumber }) => make('th', { scope: 'col', ...(isNumber ? { class: 'number' } : {}) }, title)));
    const body = make('tbody', {});
    const element = make('table', { id }, make('thead', {}, head), body);
    const cell = (name, ...content) => {
      const column = columns.find((each) => each.name === name);
      return make('td', { 'data-label': name, 'data-title': column.title, ...(column.isNumber ? { class: 'number' } : {}) }, ...content);
    };
    return { element, frame: make('div', { class: 'scroll panel' }, element), head, body, cell };
  }

  return { SPANS, isSandboxed, header: second, main, make, write, link, watch, timeline, history, bar, table };
})();
