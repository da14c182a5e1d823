"use strict";

// The simulation server's page: its free seats, the machine, its simulations, and the past of every figure of monitor.csv.
{
  const { make, write, SPANS } = monitor;
  const minutes = monitor.timeline(SPANS.minutes);
  const day = monitor.timeline(SPANS.day);
  let about = null;

  // --- what the machine is now ---------------------------------------------------------------------------------------------
  const free = make('p', { id: 'free' });
  const sentence = make('span', { id: 'site' });
  const lamp = make('p', {}, make('span', { class: 'dot', 'aria-hidden': 'true' }), sentence);
  const draining = make('p', { id: 'draining', class: 'banner warning', hidden: '' }, say('monitor.drains'));
  const notices = make('section', { id: 'notices' });
  const measures = make('dl', { id: 'measures' });
  const now = make('section', { id: 'now', class: 'panel' }, make('div', { class: 'seats' }, make('p', { class: 'hint' }, say('monitor.seats')), free, lamp), measures);

  // Shares of the machine, by their columns in monitor.csv, whose names programs know.
  const SHARES = [
    { name: 'CPU load', title: () => say('monitor.processor') },
    { name: 'CPU memory', title: () => say('monitor.memory') },
    { name: 'GPU load compute', title: () => say('monitor.graphics'), isOfGpu: true },
    { name: 'GPU memory', title: () => say('monitor.graphicsMemory'), isOfGpu: true },
    { name: 'Swap', title: () => say('monitor.swap'), isOptional: true },
    { name: 'Disk', title: () => say('monitor.disk') },
  ];
  const hasShare = ({ name, isOfGpu, isOptional }) => (!isOfGpu || Boolean(about.host.gpu)) && (!isOptional || minutes.of(name).some((value) => value > 0));
  // What is shown now: `of` finds the value in a message (undefined: it is not shown); one with a format of its own is no share, and has no bar.
  const MEASURES = [
    { name: 'load', title: () => say('monitor.load'), of: ({ load }) => load },
    ...SHARES.map((share) => ({ ...share, of: () => (hasShare(share) ? minutes.of(share.name).at(-1) ?? 0 : undefined) })),
    { name: 'sent', title: () => say('monitor.sentToBrowsers'), of: ({ sent }) => sent, format: (bytes) => texts.megabytes(bytes / 1e6) },
  ];
  let bars = new Map(); // by name

  function showNow(message) {
    const { capacity, count, staged } = message;
    const taken = count - (staged ?? 0);
    const left = Math.max(0, capacity - taken);
    const isFull = left === 0;
    write(free, say('monitor.seatsFree', { free: texts.count(draining.hidden ? left : 0), seats: texts.count(capacity) }));
    now.dataset.state = draining.hidden ? (isFull ? 'full' : 'free') : 'draining';
    write(sentence, `${draining.hidden ? (isFull ? say('site.full') : say('monitor.takesMore')) : say('monitor.takesNone')}${staged ? ` ${say('monitor.staged', { count: texts.count(staged) })}` : ''}`);
    const shown = MEASURES.filter(({ of }) => of(message) !== undefined);
    if (shown.length !== bars.size || !shown.every(({ name }) => bars.has(name))) {
      bars = new Map(shown.map(({ name }) => [name, monitor.bar()]));
      measures.replaceChildren(...shown.map(({ name, title }) => make('div', { 'data-name': name }, make('dt', {}, title()), make('dd', {}, bars.get(name).element))));
    }
    for (const { name, of, format } of shown) {
      const value = of(message);
      bars.get(name).show(format ? null : value, (format ?? texts.percent)(value), !format && value >= 90);
    }
  }

  // --- what never changes --------------------------------------------------------------------------------------------------
  const links = (addresses) => addresses.map((address) => make('li', {}, /^https?:\/\//.test(address) ? make('a', { href: address }, address) : address));

  // [term, elements] of a list of definitions.
  function definitions(rows) {
    return make('dl', { class: 'facts' }, ...rows.map(([term, ...content]) => make('div', {}, make('dt', {}, term), make('dd', {}, ...content))));
  }

  function machineFacts() {
    const { host, sandbox, display } = about;
    const english = (text) => make('span', { lang: 'en' }, text);
    return definitions([
      [say('monitor.host'), `${host.name} (${host.system})`],
      [say('monitor.processor'), `${host.processor}, ${host.cores === host.threads ? say('monitor.cores', { cores: texts.count(host.cores) })
        : say('monitor.threads', { cores: texts.count(host.cores), threads: texts.count(host.threads) })}`],
      [say('monitor.memory'), texts.memory(host.memory)],
      ...(host.gpu ? [[say('monitor.graphics'), host.gpu]] : []),
      ...(sandbox ? [[say('monitor.sandbox'), make('span', { id: 'sandbox', lang: 'en' }, sandbox)]] : []),
      ...(display ? [[say('monitor.display'), make('span', { id: 'display', lang: 'en' }, display)]] : []),
      ...(about.allowed.length ? [[say('monitor.allowed'), make('ul', {}, ...links(about.allowed))]] : []),
      ...(about.blocked.length ? [[say('monitor.blocked'), make('ul', {}, ...links(about.blocked))]] : []),
      [say('monitor.share'), about.registries.length ? say('monitor.shareOn', { load: texts.percent(about.shareIdleTime) }) : say('monitor.shareUpTo', { load: texts.percent(about.shareIdleTime) }),
        ...(about.registries.length ? [make('ul', {}, ...links(about.registries))] : [])],
      [say('monitor.version'), english(about.version)],
    ]);
  }

  function describe() {
    notices.hidden = !about.notices.length && !about.description;
    notices.replaceChildren(...about.notices.map((notice) => make('p', { class: 'banner warning', lang: 'en' }, notice)),
      ...(about.description ? [make('p', {}, about.description)] : []));
    facts.replaceChildren(make('h2', {}, say('monitor.machine')), machineFacts());
  }

  // --- simulations ---------------------------------------------------------------------------------------------------------
  const columns = [{ name: 'number', title: '#', isNumber: true }, { name: 'world', title: say('monitor.world') }, { name: 'state', title: say('monitor.state') },
    { name: 'age', title: say('monitor.age'), isNumber: true }, { name: 'CPU', title: say('monitor.processor'), isNumber: true },
    { name: 'memory', title: say('monitor.memory'), isNumber: true }, { name: 'processes', title: say('monitor.processes'), isNumber: true }];
  const table = monitor.table('simulations', columns);
  const heading = make('h2', { id: 'count' });
  const none = make('p', { class: 'hint' }, say('monitor.noSimulation'));
  const rest = make('p', { id: 'more', class: 'hint' });
  const simulations = make('section', {}, heading, none, table.frame, rest);
  const rows = new Map(); // by the simulation's number

  // As the server names them (protocol 13.9).
  const STATES = { 'fetching the project': () => say('monitor.simFetching'), 'loading the world': () => say('monitor.simLoading'), idle: () => say('monitor.simIdle'),
    running: () => say('monitor.simRunning'), 'waiting for its browser': () => say('monitor.simWaiting'), 'fetching for later': () => say('monitor.simFetchingLater'),
    'being staged': () => say('monitor.simStaging'), staged: () => say('monitor.simStaged') };

  function newRow(id) {
    const hints = { world: 2, CPU: 1, processes: 1 };
    const row = make('tr', {}, ...columns.map(({ name }) =>
      table.cell(name, make('b', {}), ...Array.from({ length: hints[name] ?? 0 }, () => make('span', { class: 'hint' })))));
    rows.set(id, row);
    table.body.append(row);
    if (operator.active)
      addEndButton(row, id);
    return row;
  }

  function showRow(row, { id, world, state, age, cpu, graphics, memory, processes, process, log, more }) {
    const least = (text) => (more ? say('monitor.moreThan', { figure: text }) : text);
    const file = /[^/]+$/.exec(world)?.[0] ?? world;
    const figures = { number: String(id), state: STATES[state]?.() ?? state, age: texts.duration(age), CPU: cpu === undefined ? '' : least(texts.percent(cpu)),
      memory: memory === undefined ? '' : least(texts.megabytes(memory)), processes: processes === undefined ? '' : least(texts.count(processes)) };
    for (const [name, text] of Object.entries(figures))
      write(row.querySelector(`[data-label="${name}"] b`), text);
    row.dataset.state = state;
    const notes = { world: [world.slice(0, world.length - file.length), log ? `${say('monitor.log')}: ${log}` : ''],
      CPU: [graphics === undefined ? '' : `${say('monitor.graphics')} ${texts.percent(graphics)}`], processes: [process === undefined ? '' : `${say('monitor.process')} ${process}`] };
    for (const [name, lines] of Object.entries(notes))
      lines.forEach((text, index) => write(row.querySelectorAll(`[data-label="${name}"] .hint`)[index], text));
    write(row.querySelector('[data-label="world"] b'), file);
    row.cells[1].title = world;
  }

  function showSimulations({ count, simulations: shown }) {
    write(heading, count === 0 ? say('monitor.simulations') : count === 1 ? say('monitor.oneSimulation') : say('monitor.manySimulations', { count: texts.count(count) }));
    none.hidden = count > 0;
    table.frame.hidden = count === 0;
    const left = new Set(rows.keys());
    for (const simulation of shown) {
      left.delete(simulation.id);
      showRow(rows.get(simulation.id) ?? newRow(simulation.id), simulation);
    }
    for (const id of left) {
      rows.get(id).remove();
      rows.delete(id);
    }
    rest.hidden = count === shown.length; // of very many only the first are listed
    write(rest, say('monitor.andMore', { count: texts.count(count - shown.length) }));
  }

  // --- the operator's buttons: one for the machine, and a column of the table ----------------------------------------------
  const intake = make('button', { type: 'button', class: 'act', id: 'intake' });
  const intakeLine = make('p', { class: 'action' }, intake);
  const column = make('th', { scope: 'col' }, say('monitor.end'));

  function showDraining(isDraining) {
    draining.hidden = !isDraining;
    write(intake, isDraining ? say('monitor.takeAgain') : say('monitor.drainThis'));
  }

  intake.onclick = () => operator.act(draining.hidden
    ? { title: say('monitor.drainThisTitle'), label: say('monitor.drain'), path: 'drain', text: say('monitor.drainThisText') }
    : { title: say('monitor.takeAgainTitle'), text: say('monitor.takeAgainText'), label: say('monitor.takeThem'), path: 'drain?off' });

  function addEndButton(row, id) {
    const button = make('button', { type: 'button', class: 'act', 'aria-label': say('monitor.endLabel', { id }) }, say('monitor.end'));
    button.onclick = () => operator.act({
      title: say('monitor.endTitle', { id }), label: say('monitor.endIt'), path: `end?simulation=${id}`,
      text: say('monitor.endText', { world: row.cells[1].title }),
    });
    row.append(make('td', { class: 'action' }, button));
  }

  operator.watch((active) => {
    if (active) {
      now.after(intakeLine);
      table.head.append(column);
      rows.forEach((row, id) => addEndButton(row, id));
      return;
    }
    intakeLine.remove();
    column.remove();
    rows.forEach((row) => row.lastElementChild.remove());
  });

  // --- the past ------------------------------------------------------------------------------------------------------------
  const loads = charts.chart({ title: say('monitor.load'), format: texts.percent, least: 100 });
  const numbers = charts.chart({ title: say('monitor.simulations'), format: texts.count, least: 4, isWhole: true });
  const network = charts.chart({ title: say('monitor.network'), format: texts.rate, least: 0.01 });
  const past = monitor.history((span, name) => {
    const { times, of } = name === 'minutes' ? minutes : day;
    const line = (column, title, isFilled = false) => ({ name: title, values: of.call(name === 'minutes' ? minutes : day, column), isFilled });
    loads.show(times, SHARES.filter(hasShare).map((each) => line(each.name, each.title())), span);
    numbers.show(times, [line('Webots running', say('monitor.simRunning'), true), line('Webots idle', say('monitor.simIdle'))], span);
    network.show(times, [line('Network sent', say('monitor.sent'), true), line('Network received', say('monitor.received'))], span);
    return [loads, numbers, network];
  });

  // --- messages of the server ----------------------------------------------------------------------------------------------
  function take(message) {
    if (message.series) {
      about = message.about ?? about;
      describe();
      minutes.restate(message.series, message.now, message.spacing);
      day.restate(message.day.series, message.now - message.day.last, message.day.spacing);
    }
    if (message.point)
      minutes.add(message.now, message.point);
    if (message.dayPoint)
      day.add(message.now, message.dayPoint);
    showDraining(message.draining === true);
    showNow(message);
    showSimulations(message);
    past.refresh();
  }

  const facts = make('section', { id: 'machine' });
  if (monitor.isSandboxed) // behind the gateway of a session server
    monitor.link(/\/machine\/[^/]+\/monitor$/.test(location.pathname) ? '../../monitor' : '../monitor', say('monitor.allMachines'));
  monitor.main.append(notices, draining, now, simulations, past.section, facts, ...operator.sections);
  monitor.watch(take);
}
