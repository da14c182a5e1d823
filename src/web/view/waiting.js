// What people are told who wait in the line of a session server. No DOM.
//
// A place is {ahead, least, most, why, wantsRoom}: how many are before this page, between how many seconds the wait is likely to be,
// null where there is no estimate, and for what it waits: '' (a seat), 'room' (`wantsRoom`: machines are free, but too busy for this
// world), 'busy', 'suitable', 'draining' or 'down'.

import { siteText } from './availability.js';
import { say } from './texts.js';

const SAID_MS = 10000;
const LONGEST_MINUTES = 90; // what is longer is not known that well

export function placeText(place) {
  const text = place.ahead === 0 ? say('waiting.next') : say('waiting.place', { number: place.ahead + 1 });
  const parts = [text, reasonText(place.why), waitText(place)].filter((part) => part !== '');
  return parts.reduce((before, part) => say('waiting.placeAndWait', { place: before, wait: part }));
}

function reasonText(why) {
  switch (why) {
    case '': return siteText('full');
    case 'room': return say('waiting.room');
    case 'suitable': return say('waiting.suitable');
    case 'busy': case 'draining': return siteText(why);
    case 'down': return `${siteText(why)} ${say('waiting.tellOperator')}`;
    default: return ''; // also a word of a later server
  }
}

// The first in line need not be told that nobody knows how long it takes.
function waitText({ ahead, least, most }) {
  if (least === null || most === null)
    return ahead === 0 ? '' : say('waiting.noEstimate');
  if (most <= 60)
    return least === 0 ? say('waiting.upToSeconds', { most }) : say('waiting.seconds', { least, most });
  const minutes = { least: Math.floor(least / 60), most: Math.ceil(most / 60) };
  if (minutes.most > LONGEST_MINUTES)
    return say('waiting.long');
  if (minutes.least === 0)
    return say('waiting.upToMinutes', minutes);
  return minutes.least === minutes.most ? say('waiting.aboutMinutes', minutes) : say('waiting.minutes', minutes);
}

// The connection broke; `seconds`: how long the place is kept.
export function returningText(seconds) {
  return seconds > 0 ? say('waiting.returning', { seconds }) : say('waiting.returningLate');
}

// Of the page, which people see while they look at others. `place` is null for a page that does not wait, and has no
// `ahead` where it is not known.
export function waitingTitle(title, place) {
  if (place === null)
    return title;
  if (place.ahead === undefined)
    return say('waiting.titleWaits', { title });
  return place.ahead === 0 ? say('waiting.titleNext', { title }) : say('waiting.titlePlace', { number: place.ahead + 1, title });
}

// Says things one after the other that change quickly, and of those that came in between only the last: for screen readers, which
// read out everything.
export class SlowVoice {
  #say;
  #said = -Infinity;
  #timer = 0;

  // `say` is called with a text: at once, but not more often than every ten seconds.
  constructor(say) {
    this.#say = say;
  }

  tell(text) {
    clearTimeout(this.#timer);
    const early = this.#said + SAID_MS - performance.now();
    if (early <= 0)
      return this.#now(text);
    this.#timer = setTimeout(() => this.#now(text), early);
  }

  // Nothing more is said of what was to be said.
  stop() {
    clearTimeout(this.#timer);
    this.#said = -Infinity;
    this.#say('');
  }

  #now(text) {
    this.#said = performance.now();
    this.#say(text);
  }
}
