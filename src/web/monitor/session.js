"use strict";

// The session server's page: free seats and who waits, its machines with the reasons of their states, and the past of the site.
{
  const { make, write, SPANS } = monitor;
  const MOST_LINES = 6; // more can't be told apart: then the chart shows average and extremes, and each row its own line
  const known = (value) => value !== null && value !== undefined;
  const isUp = (server) => known(server.load);

  let servers = [];
  let about = {};
  let threshold = 95;
  let site = {};
  const minutes = monitor.timeline(SPANS.minutes);
  const day = monitor.timeline(SPANS.day);

  // --- what the site is now ------------------------------------------------------------------------------------------------
  const free = make('p', { id: 'free' });
  const sentence = make('span', { id: 'site' });
  const lamp = make('p', {}, make('span', { class: 'dot', 'aria-hidden': 'true' }), sentence);
  const waiting = make('p', { id: 'waiting' });
  const facts = make('dl', { id: 'facts' });
  const now = make('section', { id: 'now', class: 'panel' }, make('div', { class: 'seats' }, make('p', { class: 'hint' }, say('monitor.seats')), free, lamp, waiting), facts);

  const SITE = { unknown: () => say('site.unknown'), free: () => say('site.free'), busy: () => say('site.busy'), full: () => say('site.full'),
    draining: () => say('site.draining'), down: () => say('site.down') };
  const WAITS = { seat: () => say('site.full'), room: () => say('waiting.room'), busy: () => say('site.busy'),
    suitable: () => say('waiting.suitable'), draining: () => say('site.draining'), down: () => say('site.down') };

  const sum = (list, name) => list.reduce((total, each) => total + (each[name] ?? 0), 0);
  // Busy machines have seats, too: somebody gets them as soon as there is power.
  const takes = (server) => ['free', 'busy', 'full'].includes(server.state);

  function showSite() {
    const up = servers.filter(isUp);
    const seated = up.filter((server) => known(server.seats));
    const seats = sum(seated, 'seats');
    const freeSeats = seated.filter(takes).reduce((total, { seats: all, sessions = 0 }) => total + Math.max(0, all - sessions), 0);
    const freeMachines = servers.filter(({ state }) => state === 'free').length;
    write(free, seated.length ? say('monitor.seatsFree', { free: texts.count(freeSeats), seats: texts.count(seats) })
      : servers.length === 0 ? say('monitor.machines', { count: 0 }) : say('monitor.machinesFree', { free: texts.count(freeMachines), machines: texts.count(servers.length) }));
    now.dataset.state = site.state ?? 'unknown';
    write(sentence, SITE[site.state]?.() ?? site.stateText ?? '');
    showWaiting();
    const taken = sum(up, 'sessions');
    const load = up.length ? texts.percent(sum(up, 'load') / up.length) : '–';
    showFacts([[say('monitor.machinesAnswer'), say('monitor.of', { part: texts.count(up.length), whole: texts.count(servers.length) })],
      [say('monitor.simulations'), texts.count(taken)],
      ...(servers.length > 1 ? [[say('monitor.averageLoad'), load]] : []),
      ...(known(site.relayed) ? [[say('monitor.relayed'), texts.count(site.relayed)]] : [])]);
  }

  function showFacts(rows) {
    if (facts.children.length !== rows.length)
      facts.replaceChildren(...rows.map(() => make('div', {}, make('dt', {}), make('dd', {}))));
    rows.forEach(([name, value], index) => {
      write(facts.children[index].firstElementChild, name);
      write(facts.children[index].lastElementChild, value);
    });
  }

  // Who waits, how long, and why, in sentences.
  function showWaiting() {
    waiting.hidden = !known(site.waiting);
    if (waiting.hidden)
      return;
    if (site.waiting === 0)
      return write(waiting, say('monitor.nobodyWaits'));
    const reasons = Object.entries(site.waitingFor ?? {}).filter(([why]) => WAITS[why]).map(([why, count]) => [WAITS[why](), count]);
    const why = reasons.length > 1 ? reasons.map(([each, count]) => say('monitor.soManyWait', { count: texts.count(count), why: each }))
      : reasons.map(([each]) => each).filter((each) => each !== sentence.textContent); // it stands above
    const who = site.waiting === 1 ? say('monitor.oneWaits', { time: texts.duration(site.longestWait, 'long') })
      : say('monitor.manyWait', { count: texts.count(site.waiting), time: texts.duration(site.longestWait, 'long') });
    write(waiting, [who, ...why].join('\n'));
  }

  // --- machines ------------------------------------------------------------------------------------------------------------
  const columns = [{ name: 'machine', title: say('monitor.machine') }, { name: 'seats', title: say('monitor.seatsTaken') },
    { name: 'load', title: say('monitor.load') }, { name: 'state', title: say('monitor.state') },
    { name: 'placed', title: say('monitor.sentThere'), isNumber: true }, { name: 'heard', title: say('monitor.heard'), isNumber: true }];
  const table = monitor.table('servers', columns);
  const managing = make('h2', { id: 'managing' });
  const nobody = make('p', { class: 'hint', hidden: '' }, say('monitor.noMachine'));
  const machines = make('section', {}, managing, table.frame, nobody);

  // Where a machine's own page is: below ours behind the gateway, whatever browsers call us. One that the session server calls localhost is on
  // the machine that this page comes from.
  function monitorOf({ address, path }) {
    if (path)
      return `${path.slice(1)}/monitor`;
    const [, port] = /\/(\d+)$/.exec(address) ?? [];
    if (about.gateway && port)
      return `${port}/monitor`;
    const link = `${about.tls ? 'https' : 'http'}://${address}/monitor`;
    const isHere = (name) => /^(localhost|127\.[\d.]+|\[::1\])$/.test(name);
    const url = URL.canParse(link) ? new URL(link) : null;
    if (!url || !isHere(url.hostname) || isHere(location.hostname))
      return link;
    url.hostname = location.hostname;
    return url.href;
  }

  function buildTable() {
    table.body.replaceChildren(...servers.map((server) => {
      const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
      const line = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      line.setAttribute('viewBox', '0 0 100 25');
      line.setAttribute('preserveAspectRatio', 'none');
      line.setAttribute('class', 'spark');
      line.setAttribute('aria-hidden', 'true');
      line.append(path);
      const cells = { path, seats: monitor.bar(), load: monitor.bar(), state: make('b', {}), reason: make('span', { class: 'reason' }),
        placed: table.cell('placed'), heard: table.cell('heard') };
      const found = server.foundBy ? [make('span', { class: 'hint' }, server.foundBy)] : [];
      const dot = make('span', { class: 'dot', 'aria-hidden': 'true' });
      cells.row = make('tr', {}, table.cell('machine', make('a', { href: monitorOf(server) }, server.address), ...found),
        table.cell('seats', cells.seats.element), table.cell('load', cells.load.element, line),
        table.cell('state', dot, cells.state, cells.reason), cells.placed, cells.heard);
      server.cells = cells;
      return cells.row;
    }));
    if (operator.active)
      servers.forEach(addDrainButton);
    const count = servers.length;
    write(managing, count === 1 ? say('monitor.oneMachine') : say('monitor.machines', { count: texts.count(count) }));
    nobody.hidden = count > 0;
    for (const empty of [managing, table.frame, past.section, facts])
      empty.hidden = count === 0;
  }

  const STATES = { unknown: () => say('monitor.stateUnknown'), free: () => say('monitor.stateFree'), busy: () => say('monitor.stateBusy'),
    full: () => say('monitor.stateFull'), draining: () => say('monitor.stateDraining'), down: () => say('monitor.stateDown') };
  const DRAINED = { operator: () => say('monitor.drainedByOperator'), configuration: () => say('monitor.drainedByConfiguration'),
    machine: () => say('monitor.drainedByMachine') };

  // Why a machine is in its state, in a sentence. What machines and the server say themselves is English.
  function reasonOf({ state, drained, refusal, problem, load }) {
    if (drained)
      return [DRAINED[drained]?.() ?? drained];
    if (refusal)
      return [say('monitor.refused', { why: refusal })];
    if (problem)
      return [problem, 'en'];
    if (state === 'busy')
      return [load >= threshold ? say('monitor.overThreshold', { threshold: texts.percent(threshold) }) : say('monitor.noPower')];
    return [state === 'full' ? say('monitor.allTaken') : state === 'unknown' ? say('monitor.notHeard') : ''];
  }

  function showRow(server) {
    const { cells, sessions, seats, state, load } = server;
    const taken = !known(sessions) ? '–' : known(seats) ? say('monitor.of', { part: texts.count(sessions), whole: texts.count(seats) }) : texts.count(sessions);
    cells.seats.show(known(sessions) && seats > 0 ? 100 * sessions / seats : null, taken, state === 'full');
    cells.load.show(isUp(server) ? load : null, isUp(server) ? texts.percent(load) : '–', isUp(server) && load >= threshold);
    cells.row.dataset.state = state ?? 'unknown';
    write(cells.state, STATES[state]?.() ?? state ?? '');
    const [reason, language] = reasonOf(server);
    write(cells.reason, reason);
    cells.reason.lang = language ?? texts.language;
    write(cells.placed, texts.count(server.placed));
    showDrainButton(server);
    showAge(server);
  }

  function showAge(server) {
    const age = isUp(server) ? server.age + (performance.now() - server.heard) / 1000 : null;
    write(server.cells.heard, age === null ? '–' : say('monitor.ago', { time: texts.duration(age) }));
  }

  // --- the operator's buttons: a column of the table -----------------------------------------------------------------------
  const column = make('th', { scope: 'col' }, say('monitor.newSessions'));
  const hint = make('p', { id: 'hint', class: 'hint' }, say('monitor.endHint'));

  function addDrainButton(server) {
    const { address } = server;
    server.cells.drain = make('button', { type: 'button', class: 'act' });
    server.cells.drain.onclick = () => {
      const machine = encodeURIComponent(address);
      operator.act(server.drained === 'operator'
        ? { title: say('monitor.takeBackTitle', { machine: address }), text: say('monitor.takeBackText'), label: say('monitor.takeBack'),
            path: `drain?machine=${machine}&off` }
        : { title: say('monitor.drainTitle', { machine: address }), text: say('monitor.drainText'), label: say('monitor.drain'),
            path: `drain?machine=${machine}` });
    };
    server.cells.row.append(make('td', { class: 'action' }, server.cells.drain));
    showDrainButton(server);
  }

  function showDrainButton({ cells, drained, address }) {
    if (!cells.drain)
      return;
    const isBack = drained === 'operator';
    write(cells.drain, isBack ? say('monitor.takeBack') : say('monitor.drain'));
    cells.drain.setAttribute('aria-label', isBack ? say('monitor.takeBackLabel', { machine: address }) : say('monitor.drainLabel', { machine: address }));
    cells.drain.hidden = drained === 'configuration';
  }

  operator.watch((active) => {
    if (active) {
      table.head.append(column);
      table.frame.after(hint);
      servers.forEach(addDrainButton);
    } else {
      column.remove();
      hint.remove();
      for (const { cells } of servers) {
        cells.drain.parentElement.remove();
        cells.drain = null;
      }
    }
    void readDecisions();
  });

  // --- why browsers were sent where they were sent -------------------------------------------------------------------------
  const REFUSED = { unknown: () => say('monitor.notUnknown'), lost: () => say('monitor.notLost'), stale: () => say('monitor.notStale'),
    draining: () => say('monitor.notDraining'), full: () => say('monitor.notFull'), memory: () => say('monitor.notMemory'), load: () => say('monitor.notLoad'),
    committed: () => say('monitor.notCommitted'), labels: () => say('monitor.notLabels'), excluded: () => say('monitor.notExcluded'), room: () => say('monitor.notRoom') };
  const MOST_DECISIONS = 12;
  const decisionList = make('ol', {});
  const decisions = make('section', { id: 'decisions', hidden: '' }, make('h2', {}, say('monitor.decisions')), decisionList);

  function inWords({ chosen, refused, held, freeSeats, machines }, times) {
    const passed = Object.entries(refused).map(([why, count]) => say('monitor.passed', { count: texts.count(count), why: REFUSED[why]?.() ?? why }));
    if (held)
      passed.push(say('monitor.heldSeats', { held: texts.count(held), seats: texts.count(freeSeats) }));
    const machine = machines.find(({ server }) => server === chosen);
    const where = chosen === null ? (times > 1 ? say('monitor.nobodyTimes', { count: texts.count(times) }) : say('monitor.nobodyPlaced'))
      : machine ? say('monitor.sentTo', { machine: chosen, load: texts.percent(machine.load), sessions: texts.count(machine.sessions) })
        : say('monitor.sentToOne', { machine: chosen });
    return passed.length ? `${where} ${say('monitor.notOffered', { reasons: passed.join(', ') })}` : where;
  }

  // Those that follow each other and refused for the same reasons are one.
  function merged(list) {
    const rows = [];
    for (const decision of list) {
      const last = rows.at(-1);
      const reasons = JSON.stringify([decision.refused, decision.held]);
      if (last && last.decision.chosen === null && decision.chosen === null && last.reasons === reasons)
        last.times += 1;
      else
        rows.push({ decision, reasons, times: 1 });
    }
    return rows.slice(0, MOST_DECISIONS);
  }

  async function readDecisions() {
    const isShown = about.decisions || operator.active;
    decisions.hidden = !isShown;
    if (!isShown)
      return;
    const answer = await operator.ask('decisions', 'GET');
    if (answer.status !== 200)
      return;
    const rows = merged(JSON.parse(answer.text).decisions);
    decisionList.replaceChildren(...(rows.length ? rows.map(({ decision, times }) => make('li', {},
      make('span', { class: 'reading' }, say('monitor.ago', { time: texts.duration(decision.secondsAgo) })), ` ${inWords(decision, times)}`))
      : [make('li', {}, say('monitor.nothingDecided'))]));
  }

  // --- the past ------------------------------------------------------------------------------------------------------------
  const loads = charts.chart({ title: say('monitor.load'), format: texts.percent, least: 100 });
  const seatsTaken = charts.chart({ title: say('monitor.seats'), format: texts.count, least: 4, isWhole: true });
  const limitText = () => say('monitor.limit', { threshold: texts.percent(threshold) });
  const past = monitor.history((span, name) => {
    if (name === 'minutes') {
      loads.show(minutes.times, linesOfMinutes(), span, threshold, limitText());
      return [loads];
    }
    const waits = day.of('waiting').some((value) => value > 0) ? [{ name: say('monitor.waiting'), values: day.of('waiting') }] : [];
    seatsTaken.show(day.times, [{ name: say('monitor.seatsTaken'), values: day.of('taken'), isFilled: true }, { name: say('monitor.seats'), values: day.of('seats') }, ...waits], span);
    loads.show(day.times, [{ name: say('monitor.averageLoad'), values: day.of('load'), isFilled: true }], span, threshold, limitText());
    return [seatsTaken, loads];
  });

  function linesOfMinutes() {
    if (servers.length <= MOST_LINES)
      return servers.map((server) => ({ name: server.address, values: server.history, isFilled: servers.length === 1 }));
    const at = minutes.times.map((_, row) => servers.map(({ history }) => history[row]).filter(known));
    const each = (choose) => at.map((values) => (values.length ? choose(values) : null));
    return [{ name: say('monitor.average'), values: each((values) => values.reduce((total, value) => total + value, 0) / values.length) },
      { name: say('monitor.highest'), values: each((values) => Math.max(...values)) }, { name: say('monitor.lowest'), values: each((values) => Math.min(...values)) }];
  }

  // --- messages of the server ----------------------------------------------------------------------------------------------
  function takeSnapshot(message) {
    threshold = message.threshold;
    about = message.about ?? about;
    site = { ...message, servers: undefined };
    const same = servers.length === message.servers.length && servers.every(({ address, foundBy, path }, index) =>
      address === message.servers[index].address && foundBy === message.servers[index].foundBy && path === message.servers[index].path);
    const cells = servers.map((server) => server.cells);
    servers = message.servers.map((server) => ({ ...server, heard: performance.now() }));
    if (same && cells.length)
      servers.forEach((server, index) => { server.cells = cells[index]; });
    else
      buildTable();
    minutes.restate(servers.map(({ address, history }) => ({ name: address, history })), message.now - message.last, message.spacing);
    day.restate(message.day.series, message.now - message.day.last, message.day.spacing);
    write(started, say('monitor.started', { time: texts.moment(about.started), version: about.version }));
  }

  const TOLD = ['load', 'age', 'sessions', 'seats', 'state', 'drained', 'refusal', 'problem']; // whole in each update of a row

  function take(message) {
    if (message.servers)
      takeSnapshot(message);
    for (const name of ['state', 'stateText', 'waiting', 'longestWait', 'relayed'])
      site[name] = message[name] ?? site[name];
    if (known(message.waiting))
      site.waitingFor = message.waitingFor;
    for (const { row, ...told } of message.rows ?? []) {
      for (const name of TOLD)
        servers[row][name] = undefined;
      showRow(Object.assign(servers[row], told, { heard: performance.now() }));
    }
    if (message.servers)
      servers.forEach(showRow);
    if (message.point)
      minutes.add(message.now, servers.map((server) => server.load));
    if (message.dayPoint)
      day.add(message.now, message.dayPoint);
    showSite();
    if (message.servers || message.point || message.dayPoint) {
      servers.forEach(({ cells, history }) => cells.path.setAttribute('d', charts.spark(history)));
      past.refresh();
    }
  }

  const started = make('p', { id: 'started', class: 'hint' });
  monitor.link('viewer/worlds/', say('monitor.worlds'));
  monitor.link('class/', say('monitor.class'));
  monitor.main.append(now, machines, past.section, decisions, ...operator.sections, started);
  setInterval(() => servers.forEach(showAge), 1000);
  setInterval(() => void readDecisions(), 5000);
  monitor.watch(take);
  void readDecisions();
}
