"use strict";

// The session server's page: its simulation servers and ten minutes of their loads.
{
  const {span, make, write} = monitor;
  const maxLines = 20; // more lines can't be told apart: then the chart shows average and extremes, and each row its own line
  const section = document.getElementById("charts");
  const table = document.getElementById("servers");
  const body = table.tBodies[0];
  const line = document.getElementById("waiting"); // where the server relays

  let servers = [];
  let times = []; // of the points, in seconds since 1970
  let threshold = 95;
  let chart = null;

  const known = server => server.load !== null && server.load !== undefined;
  const isCrowd = () => servers.length > maxLines;

  function take(message) {
    if (message.servers)
      takeSnapshot(message);
    if (message.stateText !== undefined)
      write(document.getElementById("site"), message.stateText);
    if (message.waiting !== undefined)
      showWaiting(message);
    for (const row of message.rows ?? []) {
      const server = servers[row.row];
      Object.assign(server, {sessions: undefined, seats: undefined, state: undefined, problem: undefined, age: undefined, drained: undefined,
                            refusal: undefined}, row, {heard: performance.now()});
      showRow(server);
    }
    if (message.point)
      addPoint(message.now);
    showSummary();
    if (message.servers || message.point)
      draw();
  }

  // As the server says it.
  function showWaiting({waiting, longestWait, relayed}) {
    const longest = waiting ? ` (longest ${monitor.age(longestWait)})` : "";
    write(line, `Waiting: ${waiting}${longest}, relayed: ${relayed}`);
  }

  function takeSnapshot(message) {
    line.hidden = message.waiting === undefined;
    threshold = message.threshold;
    const count = message.servers[0]?.history.length ?? 0;
    times = Array.from({length: count}, (_, index) => message.now - message.last - (count - 1 - index) * message.spacing);
    const isSame = servers.length === message.servers.length &&
      servers.every((server, index) => server.address === message.servers[index].address && server.foundBy === message.servers[index].foundBy &&
        server.path === message.servers[index].path);
    const cells = servers.map(server => server.cells);
    servers = message.servers.map(server => ({...server, heard: performance.now()}));
    if (isSame && cells.length)
      servers.forEach((server, index) => { server.cells = cells[index]; });
    else
      buildTable();
    if (!isSame || !chart)
      buildChart();
    servers.forEach(showRow);
  }

  function addPoint(now) {
    times.push(now);
    for (const server of servers)
      server.history.push(known(server) ? server.load : null);
    const old = times.findIndex(time => time >= now - span);
    if (old > 0) {
      times.splice(0, old);
      for (const server of servers)
        server.history.splice(0, old);
    }
  }

  function buildTable() {
    document.body.classList.add("live");
    body.replaceChildren(...servers.map((server, index) => {
      const row = monitor.newRow();
      const cell = label => row.querySelector(`[data-label="${label}"]`);
      const link = row.querySelector("a");
      link.setAttribute("href", server.path ? `${server.path.slice(1)}/monitor` : monitorOf(server.address, link.getAttribute("href")));
      link.textContent = server.address;
      row.cells[0].textContent = String(index + 1);
      const found = row.querySelector(".found");
      found.textContent = server.foundBy ?? "";
      found.hidden = !server.foundBy;
      server.cells = {row, drained: row.querySelector(".drained"), refusal: row.querySelector(".refusal"), key: row.querySelector(".key"), path: row.querySelector("path"), load: cell("load"),
                      sessions: cell("sessions"), state: cell("state"), placed: cell("placed"), report: cell("last report")};
      row.onpointerenter = () => chart && !isCrowd() && chart.setSelection(chart.numRows() - 1, label(index));
      row.onpointerleave = () => chart && chart.clearSelection();
      return row;
    }));
    if (operator.active)
      servers.forEach(addDrainButton);
    paintKeys();
    const count = servers.length;
    write(document.getElementById("managing"), `Managing ${count} simulation server${count > 1 ? "s" : ""}:`);
  }

  // `template`: the link for machines that browsers reach directly. One that the session server calls localhost is on the machine
  // that this page comes from.
  function monitorOf(address, template) {
    const [, port] = /\/(\d+)$/.exec(address) ?? [];
    if (table.hasAttribute("data-gateway") && port)
      return `${port}/monitor`;
    const link = template.replace("{address}", address);
    const isHere = name => /^(localhost|127\.[\d.]+|\[::1\])$/.test(name);
    const url = new URL(link);
    if (!isHere(url.hostname) || isHere(location.hostname))
      return link;
    url.hostname = location.hostname;
    return url.href;
  }

  function paintKeys() {
    servers.forEach((server, index) => {
      server.cells.key.hidden = isCrowd();
      server.cells.key.style.background = monitor.color(index);
      server.cells.key.classList.toggle("dashed", Boolean(monitor.dash(index)));
    });
  }

  function showRow(server) {
    const {cells} = server;
    write(cells.load, known(server) ? `${monitor.rounded(server.load)}%` : "N/A");
    cells.load.classList.toggle("full", known(server) && server.load >= threshold);
    cells.row.classList.toggle("down", !known(server));
    write(cells.sessions, sessionsText(server.sessions, server.seats));
    cells.sessions.classList.toggle("full", server.state === "full");
    write(cells.state, server.state ?? "");
    write(cells.placed, String(server.placed));
    write(cells.drained, drainedTexts[server.drained] ?? "");
    cells.drained.hidden = !server.drained;
    write(cells.refusal, server.refusal ? `refused its last start: ${server.refusal}` : "");
    cells.refusal.hidden = !server.refusal;
    showDrainButton(server);
    showAge(server);
  }

  // As the server says it.
  function sessionsText(sessions, seats) {
    if (sessions === undefined)
      return "";
    return seats === undefined ? String(sessions) : `${sessions} of ${seats}`;
  }

  // As the server says it.
  const drainedTexts = {operator: "drained by the operator", configuration: "drained by the configuration", machine: "draining"};

  // The operator's buttons: a column of the table.
  const column = make("th", {}, "new sessions");
  const hint = make("p", {id: "hint"}, "To end a simulation, open the page of its machine.");
  const corner = make("td", {});

  function addDrainButton(server) {
    server.cells.drain = make("button", {type: "button", class: "act"});
    server.cells.drain.onclick = () => {
      const machine = encodeURIComponent(server.address);
      operator.act(server.drained === "operator"
        ? {title: `Send browsers to ${server.address} again?`, text: "It gets new sessions as the other machines do.", label: "Take back",
           path: `drain?machine=${machine}&off`}
        : {title: `Drain ${server.address}?`, label: "Drain", path: `drain?machine=${machine}`,
           text: "This session server sends nobody there until you take that back here, or it restarts. Simulations that run there go on."});
    };
    server.cells.row.append(make("td", {class: "action"}, server.cells.drain));
    showDrainButton(server);
  }

  function showDrainButton({cells, drained, address}) {
    if (!cells.drain)
      return;
    write(cells.drain, drained === "operator" ? "Take back" : "Drain");
    cells.drain.setAttribute("aria-label", drained === "operator" ? `Take back the drain of ${address}` : `Drain ${address}`);
    cells.drain.hidden = drained === "configuration";
  }

  operator.watch(active => {
    if (active) {
      table.tHead.rows[0].append(column);
      table.tFoot.rows[0].append(corner);
      table.parentElement.after(hint);
      servers.forEach(addDrainButton);
      return;
    }
    for (const each of [column, corner, hint])
      each.remove();
    for (const {cells} of servers) {
      cells.drain.parentElement.remove();
      cells.drain = null;
    }
  });

  function showAge(server) {
    const text = known(server) ? monitor.age(server.age + (performance.now() - server.heard) / 1000) : server.problem ?? "waiting";
    write(server.cells.report, text);
  }

  function showSummary() {
    const up = servers.filter(known);
    const mean = up.reduce((sum, server) => sum + server.load, 0) / up.length;
    const text = up.length ? `${monitor.rounded(mean)}%` : "N/A";
    write(document.getElementById("average"), text);
    const total = name => up.reduce((sum, server) => sum + (server[name] ?? 0), 0);
    const inState = state => String(servers.filter(server => server.state === state).length);
    const seats = up.some(server => server.seats !== undefined) ? total("seats") : undefined;
    const parts = [["average load", text], ["up", `${up.length} of ${servers.length}`], ["full", inState("full")], ["busy", inState("busy")],
                   ["sessions", sessionsText(total("sessions"), seats)]];
    section.querySelectorAll(".tiles b").forEach((element, index) => write(element, parts[index][1]));
  }

  const label = index => `${index + 1} ${servers[index].address}`;

  function buildChart() {
    section.hidden = false;
    const tiles = ["average load", "servers up", "servers full", "servers busy", "sessions"]
      .map(name => make("div", {}, make("span", {}, name), make("b", {})));
    const element = make("div", {class: "chart", id: "chart"});
    const reading = make("p", {class: "reading", id: "reading"});
    const title = isCrowd() ? "Load of all servers, last 10 minutes" : "Load, last 10 minutes";
    section.replaceChildren(make("div", {class: "tiles"}, ...tiles), make("h2", {}, title), element, reading);
    if (chart)
      monitor.charts.splice(monitor.charts.indexOf(chart), 1)[0].destroy();
    const labels = isCrowd() ? ["average", "highest", "lowest"] : servers.map((_, index) => label(index));
    const idle = isCrowd() ? "Blue: average. Orange: highest. Green: lowest." : "";
    write(reading, idle);
    chart = monitor.chart(element, labels, {
      underlayCallback: drawThreshold,
      highlightSeriesOpts: {strokeWidth: 3},
      highlightSeriesBackgroundAlpha: isCrowd() ? 1 : 0.5,
      highlightCallback: (_, x, points, row, name) => {
        const point = points.find(each => each.name === name);
        if (!point)
          return;
        const shown = isCrowd() ? name : servers[labels.indexOf(name)].address;
        write(reading, `${monitor.clock(new Date(x))}  ${shown}: ${monitor.rounded(point.yval)}%`);
        if (!isCrowd())
          servers.forEach((server, index) => server.cells.row.classList.toggle("marked", labels[index] === name));
      },
      unhighlightCallback: () => {
        write(reading, idle);
        servers.forEach(server => server.cells.row.classList.remove("marked"));
      },
    });
  }

  function drawThreshold(context, area, graph) {
    const y = graph.toDomYCoord(threshold);
    if (y < area.y)
      return;
    context.save();
    context.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue("--bad");
    context.setLineDash([4, 4]);
    context.beginPath();
    context.moveTo(area.x, y);
    context.lineTo(area.x + area.w, y);
    context.stroke();
    context.restore();
  }

  // Average, highest and lowest of each moment.
  function extremes() {
    const columns = [[], [], []];
    times.forEach((_, row) => {
      const loads = servers.map(server => server.history[row]).filter(load => load !== null);
      const isKnown = loads.length > 0;
      columns[0].push(isKnown ? loads.reduce((sum, load) => sum + load, 0) / loads.length : null);
      columns[1].push(isKnown ? Math.max(...loads) : null);
      columns[2].push(isKnown ? Math.min(...loads) : null);
    });
    return columns;
  }

  function draw() {
    const columns = isCrowd() ? extremes() : servers.map(server => server.history);
    const highest = columns.reduce((most, column) => column.reduce((top, load) => Math.max(top, load ?? 0), most), 100);
    chart.updateOptions({file: monitor.rows(times, columns), valueRange: [0, highest * 1.03]});
    servers.forEach(drawLine);
  }

  function drawLine(server) {
    const last = times.at(-1) ?? 0;
    const right = server.cells.path.ownerSVGElement.viewBox.baseVal.width;
    const scale = right / monitor.width(times);
    let path = "";
    let isOpen = false;
    server.history.forEach((load, index) => {
      if (load !== null) {
        const x = Math.round(right - (last - times[index]) * scale);
        path += `${isOpen ? "L" : "M"}${x} ${Math.round(100 - Math.min(load, 100))}`;
        if (!isOpen)
          path += "h1"; // makes a single point visible
      }
      isOpen = load !== null;
    });
    server.cells.path.setAttribute("d", path);
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paintKeys);
  setInterval(() => servers.forEach(showAge), 1000);
  monitor.watch(take);
}
