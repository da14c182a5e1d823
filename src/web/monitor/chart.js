"use strict";

// Charts of figures over time, as SVG: a line for each figure, whose values at the pointer, or the last ones, stand below. Colours are the
// design tokens, so that charts follow light and dark by themselves.
const charts = (() => {
  const SVG = 'http://www.w3.org/2000/svg';
  const STEPS = [15, 30, 60, 120, 300, 600, 1800, 3600, 7200, 10800, 14400, 21600]; // s between two times on the axis
  const LETTERS = ['a', 'b', 'c', 'd', 'e', 'f'];
  const HEIGHT = 190; // px
  const EDGE = { left: 58, right: 12, top: 10, bottom: 24 };

  const draw = (name, attributes, ...content) => {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes))
      element.setAttribute(key, value);
    element.append(...content);
    return element;
  };

  // The least of 1, 2, 5, 10, 20 ... of which five reach `value`.
  function roundStep(value) {
    const power = 10 ** Math.floor(Math.log10(value / 5));
    return [1, 2, 5, 10].map((each) => each * power).find((each) => each * 5 >= value * 0.999);
  }

  const known = (value) => value !== null && value !== undefined;

  // `format(value, top)` writes a value of an axis that reaches to `top`. `least`: it reaches at least so far. `isWhole`: of counts.
  function chart({ title, format, least = 1, isWhole = false }) {
    const { make, write } = monitor;
    const svg = draw('svg', { role: 'img' });
    const time = make('span', { class: 'reading' });
    const legend = make('ul', { class: 'legend' });
    const note = make('p', { class: 'hint limit-note', hidden: '' });
    const heading = make('h3', {}, title);
    const element = make('figure', { class: 'chart panel' }, make('figcaption', {}, heading, time), svg, legend, note);
    let shown = { times: [], series: [], span: 600, limit: undefined };
    let pointed = null; // index of a time
    let mark = null;

    function scale() {
      const width = Math.max(240, svg.clientWidth || element.clientWidth || 600);
      const { times, series, span } = shown;
      const end = times.at(-1) ?? Date.now() / 1000;
      const length = Math.min(span, Math.max(span / 10, end - (times[0] ?? end)));
      const highest = series.reduce((top, { values }) => values.reduce((most, value) => Math.max(most, value ?? 0), top), 0);
      const step = Math.max(roundStep(Math.max(least, highest)), isWhole ? 1 : 0);
      const top = Math.ceil(Math.max(least, highest) / step - 0.001) * step;
      const x = (at) => EDGE.left + (at - end + length) / length * (width - EDGE.left - EDGE.right);
      const y = (value) => HEIGHT - EDGE.bottom - value / top * (HEIGHT - EDGE.top - EDGE.bottom);
      return { width, end, length, top, step, x, y };
    }

    function axes({ width, end, length, top, step: stepUp, x, y }) {
      const parts = Array.from({ length: Math.round(top / stepUp) + 1 }, (_, line) => line * stepUp).flatMap((value) => [
        draw('line', { class: 'grid', x1: EDGE.left, x2: width - EDGE.right, y1: y(value), y2: y(value) }),
        draw('text', { x: EDGE.left - 8, y: y(value) + 4, 'text-anchor': 'end' }, format(value, top)),
      ]);
      const step = STEPS.find((each) => length / each * 70 <= width - EDGE.left - EDGE.right) ?? STEPS.at(-1);
      const zone = new Date(end * 1000).getTimezoneOffset() * 60;
      for (let at = Math.ceil((end - length - zone) / step) * step + zone; at <= end; at += step) {
        if (x(at) > width - EDGE.right - 16 && x(at) < width - EDGE.right)
          continue; // it would be cut off
        parts.push(draw('line', { class: 'grid', x1: x(at), x2: x(at), y1: HEIGHT - EDGE.bottom, y2: HEIGHT - EDGE.bottom + 4 }),
          draw('text', { x: Math.max(x(at), EDGE.left), y: HEIGHT - 6, 'text-anchor': 'middle' }, texts.clock(at, step < 60)));
      }
      return parts;
    }

    function line({ values, letter, isFilled }, { x, y, end, length }) {
      const pieces = [];
      let piece = null;
      shown.times.forEach((at, index) => {
        if (!known(values[index]) || at < end - length)
          piece = null;
        else if (piece)
          piece.push([x(at), y(values[index])]);
        else
          pieces.push(piece = [[x(at), y(values[index])]]);
      });
      const path = (points) => points.map(([a, b], index) => `${index ? 'L' : 'M'}${a.toFixed(1)} ${b.toFixed(1)}`).join('');
      const area = pieces.map((points) => `${path(points)}V${y(0)}H${points[0][0].toFixed(1)}Z`).join('');
      return [...(isFilled ? [draw('path', { class: `area ${letter}`, d: area })] : []),
        draw('path', { class: `line ${letter}`, d: pieces.map((points) => `${path(points)}${points.length === 1 ? 'h1' : ''}`).join('') })];
    }

    function render() {
      const place = scale();
      svg.setAttribute('viewBox', `0 0 ${place.width} ${HEIGHT}`);
      mark = draw('line', { class: 'mark', y1: EDGE.top, y2: HEIGHT - EDGE.bottom, hidden: '' });
      const limit = known(shown.limit) && shown.limit <= place.top // one that is never reached is no reason for another scale
        ? [draw('line', { class: 'limit', x1: EDGE.left, x2: place.width - EDGE.right, y1: place.y(shown.limit), y2: place.y(shown.limit) })] : [];
      svg.replaceChildren(...axes(place), ...limit, ...shown.series.flatMap((each) => line(each, place)), mark);
      showValues();
    }

    function showValues() {
      const { times, series } = shown;
      if (pointed !== null && pointed >= times.length)
        pointed = null;
      const index = pointed ?? times.length - 1;
      mark.toggleAttribute('hidden', pointed === null);
      if (pointed !== null) {
        const { x } = scale();
        mark.setAttribute('x1', x(times[index]));
        mark.setAttribute('x2', x(times[index]));
      }
      write(time, pointed === null ? '' : texts.clock(times[index], shown.span < 3600));
      const values = series.map(({ values: all }) => (known(all[index]) ? format(all[index]) : '–'));
      series.forEach((_, place) => write(legend.children[place].lastElementChild, values[place]));
      svg.setAttribute('aria-label', `${title}: ${series.map(({ name }, place) => `${name} ${values[place]}`).join(', ')}`);
    }

    svg.addEventListener('pointermove', ({ clientX }) => {
      const box = svg.getBoundingClientRect();
      const { x, width } = scale();
      const at = (clientX - box.left) * width / box.width;
      const near = shown.times.reduce((best, each, index) => (Math.abs(x(each) - at) < Math.abs(x(shown.times[best]) - at) ? index : best), 0);
      pointed = shown.times.length ? near : null;
      showValues();
    });
    svg.addEventListener('pointerleave', () => {
      pointed = null;
      showValues();
    });
    new ResizeObserver(render).observe(element);

    return {
      element,
      // What is drawn, for tests: the values of a line, oldest first.
      values: (place) => shown.series[place]?.values ?? [],
      // `series`: [{name, values, isFilled}], `span` in seconds. `limit`: a dashed line there, which `limitText` explains.
      show(times, series, span, limit, limitText) {
        const lettered = series.map((each, index) => ({ ...each, letter: LETTERS[index % LETTERS.length] }));
        const isSame = shown.series.length === series.length && series.every(({ name }, index) => name === shown.series[index].name);
        shown = { times, series: lettered, span, limit };
        if (!isSame)
          legend.replaceChildren(...lettered.map(({ name, letter }) =>
            make('li', {}, make('span', { class: `key ${letter}` }), `${name} `, make('b', {}))));
        write(note, known(limit) ? limitText : '');
        render();
        note.hidden = !svg.querySelector('.limit');
      },
    };
  }

  // A small line without axes, from 0 to `top`.
  function spark(values, top = 100) {
    const points = values.map((value, index) => (known(value) ? [index * 100 / Math.max(1, values.length - 1), 24 - Math.min(value, top) / top * 22] : null));
    let isOpen = false;
    const path = points.map((point) => {
      const command = point === null ? '' : `${isOpen ? 'L' : 'M'}${point[0].toFixed(1)} ${point[1].toFixed(1)}${isOpen ? '' : 'h.1'}`;
      isOpen = point !== null;
      return command;
    }).join('');
    return path;
  }

  return { chart, spark };
})();
