"use strict";

// What the pages of both servers say, in the language of whoever reads them, and numbers as people there write them. All languages stand in
// the page: behind a proxy that knows /monitor alone nothing else could be fetched.
const texts = (() => {
  const CHOICE = 'webots_cloud.language'; // as view/page_texts.js
  const all = JSON.parse(document.getElementById('texts').textContent);
  const find = (names) => names.map((name) => name.toLowerCase().split('-')[0]).find((name) => Object.hasOwn(all, name)) ?? 'en';
  const language = find([new URLSearchParams(location.search).get('lang'), remembered(), ...navigator.languages].filter(Boolean));

  // In a sandbox browsers keep nothing.
  function remembered() {
    try {
      return localStorage.getItem(CHOICE);
    } catch {
      return null;
    }
  }

  // Loads the page in another language.
  function choose(name) {
    try {
      localStorage.setItem(CHOICE, name);
    } catch { /* See above. */ }
    location.search = `?lang=${name}`;
  }

  const say = (key, values = {}) => (all[language][key] ?? all.en[key] ?? key).replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');

  // A language in its own words, with a capital letter.
  function nameOf(name) {
    const own = new Intl.DisplayNames(name, { type: 'language' }).of(name);
    return own[0].toLocaleUpperCase(name) + own.slice(1);
  }

  const number = (value, options) => new Intl.NumberFormat(language, options).format(value);
  const unit = (value, name, digits = 0, unitDisplay = 'short') => number(value, { style: 'unit', unit: name, unitDisplay, maximumFractionDigits: digits });
  const digits = (value) => (value < 10 ? 1 : 0);

  return {
    say,
    choose,
    names: Object.keys(all).map((name) => [name, nameOf(name)]),
    language,
    count: (value) => number(value, { maximumFractionDigits: 0 }),
    // On an axis: with as many digits as its highest value.
    percent: (value, top = value) => number(value / 100, { style: 'percent', maximumFractionDigits: digits(top) }),
    megabytes: (value) => (value < 1000 ? unit(value, 'megabyte', digits(value)) : unit(value / 1000, 'gigabyte', 1)),
    // Of memories, in powers of two, as their makers name them.
    memory: (bytes) => unit(bytes / 2 ** 30, 'gigabyte', 1),
    rate: (value, top = value) => (top < 1 ? unit(value * 1000, 'kilobyte-per-second') : unit(value, 'megabyte-per-second', digits(top))),
    // `display`: `short` in tables, `long` in sentences.
    duration(seconds, display = 'short') {
      const whole = Math.max(0, Math.floor(seconds));
      const [name, length] = whole < 120 ? ['second', 1] : whole < 7200 ? ['minute', 60] : whole < 172800 ? ['hour', 3600] : ['day', 86400];
      return unit(Math.floor(whole / length), name, 0, display);
    },
    clock: (time, withSeconds) => new Date(time * 1000).toLocaleTimeString(language,
      { hour: '2-digit', minute: '2-digit', ...(withSeconds ? { second: '2-digit' } : {}), hour12: false }),
    moment: (time) => new Date(time * 1000).toLocaleString(language, { dateStyle: 'long', timeStyle: 'short' }),
  };
})();
const { say } = texts;
