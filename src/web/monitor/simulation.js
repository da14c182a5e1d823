"use strict";

// The simulation server's page: the machine, its simulations, and ten minutes of every figure of monitor.csv.
{
  const {span, make, write} = monitor;
  const section = document.getElementById("charts");
  const table = document.getElementById("simulations");

  // The series by what they are measured in. `first` and `count` are places of columns of monitor.csv, as core/pages/monitor_sample.hpp
  // orders them.
  const panels = [
    {title: "Load, last 10 minutes (%)", first: 2, count: 7, options: {valueRange: [0, 103]}},
    {title: "Number of simulations", first: 0, count: 2, options: {axis: {pixelsPerLabel: 24, axisLabelFormatter: wholeNumber}}},
    {title: "Network (MB/s)", first: 9, count: 2, options: {axis: {pixelsPerLabel: 30, axisLabelFormatter: value => String(Math.round(value * 1000) / 1000)}}},
  ];
  const hasGpu = Boolean(document.getElementById("gpu-compute"));

  let times = [];
  let series = []; // {name, history}

  function wholeNumber(value) {
    return Number.isInteger(value) ? String(value) : "";
  }

  function take(message) {
    if (message.series)
      takeSnapshot(message);
    if (message.point)
      addPoint(message);
    showFigures(message);
    showDraining(message.draining === true);
    showSimulations(message);
    draw();
  }

  function takeSnapshot(message) {
    const count = message.series[0].history.length;
    times = Array.from({length: count}, (_, index) => message.now - (count - 1 - index) * message.spacing);
    series = message.series;
    if (!panels[0].chart)
      buildCharts();
  }

  function addPoint(message) {
    times.push(message.now);
    series.forEach((each, index) => each.history.push(message.point[index]));
    const old = times.findIndex(time => time >= message.now - span);
    if (old > 0) {
      times.splice(0, old);
      series.forEach(each => each.history.splice(0, old));
    }
  }

  function buildCharts() {
    section.hidden = false;
    for (const panel of panels) {
      const shown = series.slice(panel.first, panel.first + panel.count);
      // Without a graphics processor these are always 0: hidden at first, but the buttons can show them.
      panel.visible = shown.map(each => hasGpu || !each.name.startsWith("GPU"));
      panel.buttons = shown.map((each, index) => {
        const key = make("span", {class: "key", style: `background:${monitor.color(index)}`});
        const button = make("button", {type: "button", "aria-pressed": String(panel.visible[index])}, key, `${each.name} `, make("b", {}));
        button.onclick = () => toggle(panel, index);
        return button;
      });
      panel.time = make("span", {class: "reading"});
      const element = make("div", {class: "chart"});
      section.append(make("div", {class: "panel"}, make("h2", {}, panel.title, panel.time), element,
                          make("div", {class: "legend"}, ...panel.buttons)));
      panel.chart = monitor.chart(element, shown.map(each => each.name), {
        visibility: panel.visible,
        highlightCallback: (_, x, points) => {
          write(panel.time, monitor.clock(new Date(x)));
          panel.pointed = true;
          showValues(panel, name => points.find(point => point.name === name)?.yval);
        },
        unhighlightCallback: () => {
          write(panel.time, "");
          panel.pointed = false;
          showLatest(panel);
        },
        ...panel.options,
      });
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paintKeys);
  }

  function paintKeys() {
    for (const panel of panels)
      panel.buttons.forEach((button, index) => { button.firstElementChild.style.background = monitor.color(index); });
  }

  function toggle(panel, index) {
    panel.visible[index] = !panel.visible[index];
    panel.buttons[index].setAttribute("aria-pressed", String(panel.visible[index]));
    panel.chart.setVisibility(index, panel.visible[index]);
  }

  function showValues(panel, valueOf) {
    panel.buttons.forEach((button, index) => {
      const value = valueOf(series[panel.first + index].name);
      write(button.lastElementChild, value === undefined || value === null ? "" : String(Math.round(value * 100) / 100));
    });
  }

  function showLatest(panel) {
    showValues(panel, name => series.find(each => each.name === name).history.at(-1));
  }

  function showFigures(message) {
    const latest = name => series.find(each => each.name === name)?.history.at(-1) ?? 0;
    for (const [id, value] of [["load", message.load], ["cpu", latest("CPU load")], ["memory", latest("CPU memory")],
                               ["swap", latest("Swap")], ["gpu-compute", latest("GPU load compute")],
                               ["gpu-memory", latest("GPU memory")]]) {
      const element = document.getElementById(id);
      if (!element)
        continue;
      write(element, `${monitor.rounded(value)}%`);
      element.style.setProperty("--value", String(value));
    }
  }

  const known = new Map(); // rows by the simulation's number

  // The operator's buttons: one for the machine, and a column of the table.
  const intake = make("button", {type: "button", class: "act", id: "intake"});
  const column = make("th", {}, "end");
  let draining = false;

  function showDraining(isDraining) {
    draining = isDraining;
    document.getElementById("draining").hidden = !draining;
    write(intake, draining ? "Take simulations again" : "Drain this machine");
  }

  intake.onclick = () => operator.act(draining
    ? {title: "Take simulations again?", text: "Then new simulations may start on this machine.", label: "Take them", path: "drain?off"}
    : {title: "Drain this machine?", label: "Drain", path: "drain",
       text: "It takes no new simulations until you take that back here, or it restarts. Those that run go on."});

  function addEndButton(row, id) {
    const button = make("button", {type: "button", class: "act", "aria-label": `End simulation ${id}`}, "End");
    button.onclick = () => operator.act({
      title: `End simulation ${id}?`, label: "End it", path: `end?simulation=${id}`,
      text: `${row.cells[1].textContent}: whoever uses it is told that the operator has ended it. What was not saved is lost.`,
    });
    row.append(make("td", {class: "action"}, button));
  }

  operator.watch(active => {
    if (active) {
      document.getElementById("draining").after(make("p", {class: "action"}, intake));
      table.tHead.rows[0].append(column);
      known.forEach((row, id) => addEndButton(row, id));
      return;
    }
    intake.parentElement.remove();
    column.remove();
    known.forEach(row => row.lastElementChild.remove());
  });

  function showSimulations(message) {
    write(document.getElementById("count"), String(message.count));
    write(document.getElementById("staged"), message.staged ? `, ${message.staged} of them staged` : "");
    table.hidden = message.count === 0;
    if (known.size === 0)
      table.tBodies[0].replaceChildren(); // the rows of the first paint
    const left = new Set(known.keys());
    for (const simulation of message.simulations) {
      left.delete(simulation.id);
      let row = known.get(simulation.id);
      if (!row) {
        row = monitor.newRow();
        known.set(simulation.id, row);
        table.tBodies[0].append(row);
        if (operator.active)
          addEndButton(row, simulation.id);
      }
      const {cpu, graphics, memory, processes} = simulation;
      const more = simulation.more ? "more than " : "";
      [String(simulation.id), simulation.world, simulation.state, monitor.age(simulation.age),
       cpu === undefined ? "" : `${more}${cpu.toFixed(1)}%${graphics === undefined ? "" : `, GPU ${graphics.toFixed(1)}%`}`,
       memory === undefined ? "" : `${more}${memory.toFixed(1)} MB`,
       processes === undefined ? "" : `${more}${processes}`, String(simulation.process ?? ""),
       simulation.log ?? ""]
          .forEach((text, index) => write(row.cells[index], text));
      row.cells[1].title = simulation.world;
    }
    for (const id of left) {
      known.get(id).remove();
      known.delete(id);
    }
    showRest(message.count - message.simulations.length);
  }

  // If there are very many simulations, only the first are listed.
  function showRest(more) {
    let line = document.getElementById("more");
    if (!line) {
      line = make("p", {id: "more", class: "reading"});
      table.parentElement.after(line);
    }
    write(line, more > 0 ? `and ${more} more` : "");
  }

  function draw() {
    for (const panel of panels) {
      const columns = series.slice(panel.first, panel.first + panel.count).map(each => each.history);
      const highest = columns.reduce((most, column) => column.reduce((top, value) => Math.max(top, value ?? 0), most), 0);
      const range = panel.options.valueRange ?? [0, Math.max(highest * 1.1, panel.first === 0 ? 2 : 0.1)];
      panel.chart.updateOptions({file: monitor.rows(times, columns), valueRange: range});
      if (!panel.pointed)
        showLatest(panel);
    }
  }

  monitor.watch(take);
}
