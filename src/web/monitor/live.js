"use strict";

// What the pages of both servers share: the connection that keeps them current, and the look of their charts.
window.monitor = (() => {
  const span = 600; // seconds that are drawn
  const minSpan = 60; // of a server that has just started
  const silence = 90_000; // ms without a message after which a connection counts as dead
  const pollInterval = 5_000;
  const maxPause = 15_000;

  // Behind the gateway of a session server a machine's page has no origin (Content-Security-Policy: sandbox). Browsers give it no password, and no
  // server knows it: it has been told a key instead.
  const isSandboxed = self.origin === "null";
  const below = isSandboxed ? `/${document.body.dataset.key}` : "";

  // The server is at the page's own address; behind a proxy that passes WebSockets on for `/<port>/...` only, it is there.
  function addresses() {
    const base = (location.protocol === "https:" ? "wss://" : "ws://") + location.host;
    return [...new Set([base + location.pathname + below, `${base}/${document.body.dataset.port}/monitor${below}`])];
  }

  function showConnection(state, text) {
    const line = document.getElementById("connection");
    line.hidden = false;
    line.dataset.state = state;
    line.textContent = text;
  }

  // Calls take(message) for a snapshot and then for every update, for as long as the page is open.
  function watch(take) {
    let candidate = 0;
    let pause = 1_000;

    function connect() {
      const candidates = addresses();
      const socket = new WebSocket(candidates[candidate % candidates.length]);
      let heard = false;
      let timer = setTimeout(() => socket.close(), silence);
      socket.onmessage = event => {
        clearTimeout(timer);
        timer = setTimeout(() => socket.close(), silence);
        heard = true;
        pause = 1_000;
        showConnection("live", "live");
        take(JSON.parse(event.data));
      };
      socket.onclose = () => {
        clearTimeout(timer);
        if (heard) {
          showConnection("lost", "connection lost, trying again");
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
        const answer = await fetch(location.pathname + below, {headers: {Accept: "application/json"}, cache: "no-store"});
        if (answer.status === 410) // the key is too old: the page is told a new one
          location.reload();
        if (!answer.ok)
          throw new Error(`status ${answer.status}`);
        take(await answer.json());
        showConnection("live", "every 5 seconds");
        pause = pollInterval;
      } catch {
        showConnection("lost", "connection lost, trying again");
        pause = Math.min(2 * pause, maxPause);
      }
      setTimeout(connect, pause);
    }

    connect();
  }

  const colors = [
    ["#0067a5", "#d35f00", "#1a7f45", "#a3368f", "#7a5c00", "#00808a", "#b3261e", "#5b52b8", "#5f6b2d", "#8a4b32"],
    ["#6cb6ff", "#ff9e4d", "#5fd08d", "#f08fd8", "#e3c34d", "#4fd0d8", "#ff8a80", "#b3a8ff", "#b9c977", "#e0a184"],
  ];
  const darkness = matchMedia("(prefers-color-scheme: dark)");
  const color = index => colors[darkness.matches ? 1 : 0][index % colors[0].length];
  // Colours that are used a second time are dashed.
  const dash = index => [null, [6, 3], [2, 3]][Math.floor(index / colors[0].length) % 3];

  const charts = [];

  function theme() {
    const style = getComputedStyle(document.documentElement);
    return {gridLineColor: style.getPropertyValue("--grid").trim(), axisLineColor: style.getPropertyValue("--line").trim(),
            highlightSeriesBackgroundColor: style.getPropertyValue("--panel").trim()};
  }

  darkness.addEventListener("change", () => {
    for (const each of charts)
      each.updateOptions({...theme(), colors: each.monitorColors.map(color)});
  });

  const clock = date => date.toLocaleTimeString([], {hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false});

  // Whole minutes without their seconds.
  const minute = date => date.getSeconds() === 0 ? clock(date).slice(0, 5) : clock(date);

  // A line chart of ten minutes: drag to zoom, double-click for the whole again. Fingers scroll the page instead.
  function chart(element, labels, options) {
    const frame = element.appendChild(make("div", {class: "frame"})); // dygraphs wants an element without padding
    const touch = matchMedia("(pointer: coarse)").matches;
    const indices = options.colorIndices ?? labels.map((_, index) => index);
    const series = {};
    labels.forEach((label, index) => { series[label] = {strokePattern: dash(indices[index])}; });
    const made = new Dygraph(frame, empty(labels.length), {
      labels: ["time", ...labels], series, colors: indices.map(color), legend: "never", strokeWidth: 1.5, highlightCircleSize: 3,
      drawGapEdgePoints: true, resizable: "passive", axisLabelFontSize: 12, includeZero: true, ...theme(),
      ...(touch ? {interactionModel: {}} : {}),
      ...options,
      axes: {
        x: {axisLabelWidth: 64, pixelsPerLabel: 80, axisLabelFormatter: minute},
        y: {axisLabelWidth: 36, ...options.axis},
      },
    });
    made.monitorColors = indices;
    charts.push(made);
    return made;
  }

  function empty(count) {
    return [[new Date(), ...Array(count).fill(null)]];
  }

  // How many seconds a chart of these times shows.
  function width(times) {
    return Math.min(span, Math.max(minSpan, times.length ? times.at(-1) - times[0] : 0));
  }

  // Rows of a chart; a first one without values keeps few points at the right.
  function rows(times, columns) {
    const start = (times.at(-1) ?? Date.now() / 1000) - width(times);
    const points = times.map((time, row) => [new Date(time * 1000), ...columns.map(column => column[row])]);
    return points.length && times[0] <= start ? points : [[new Date(start * 1000), ...columns.map(() => null)], ...points];
  }

  function age(seconds) {
    if (seconds < 120)
      return `${Math.max(0, Math.floor(seconds))} s`;
    return seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
  }

  // As the servers print loads: at most two decimals, and one at least.
  function rounded(value) {
    const text = String(Math.round(value * 100) / 100);
    return text.includes(".") ? text : `${text}.0`;
  }

  // A new row of the page's table, as the server makes them.
  function newRow() {
    return document.getElementById("row").content.firstElementChild.cloneNode(true);
  }

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

  return {span, width, isSandboxed, watch, chart, charts, rows, color, dash, clock, age, rounded, newRow, make, write};
})();
