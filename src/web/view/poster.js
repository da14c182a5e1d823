// What stands where a simulation will be: a picture of its world, or else a drawn one. Touches the DOM.

// Robots in an arena. Presentation attributes need no permission of a page's Content-Security-Policy.
const DRAWN = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1600 900" preserveAspectRatio="xMidYMid slice" aria-hidden="true">
<rect width="1600" height="900" fill="#c3d6ea"/><rect y="560" width="1600" height="340" fill="#dbe7f3"/>
<path fill="#8795ab" d="M330 330 1240 250 1560 730 60 830z"/><path fill="#eef2f7" d="M352 362 1228 284 1508 706 110 800z"/>
<path fill="#d5dee9" d="M352 362 493 349 464 425 310 439zM635 337 780 324 781 398 621 412zM927 311 1077 297 1108 370 943 385zM464 425 621 412 604 504 429 518zM781 398 943 385 963 475 782 490zM1108 370 1276 356 1335 445 1147 460zM258 532 429 518 386 635 193 649zM604 504 782 490 783 605 582 620zM963 475 1147 460 1197 574 988 590zM386 635 582 620 554 770 330 785zM783 605 988 590 1020 739 784 755zM1197 574 1410 558 1508 706 1261 723z" opacity=".8"/>
<path fill="#b98d5b" d="m410 420 90-60 90 45-10 90-90 56-86-52z"/><path fill="#d6ab77" d="m410 420 90-60 90 45-94 62z"/><path fill="#8f6a40" d="m496 467 94-62-10 90-90 56z"/>
<path fill="#7d8ba0" d="m930 520 250 26-4 52-250-28z"/><path fill="#a5b3c8" d="m930 520 30-28 246 24-26 30z"/>
<g opacity=".55" fill="none" stroke="#4fae6a" stroke-width="3"><path d="M740 490 600 440M740 490 620 540M740 490 680 570M1020 400 1130 340M1020 400 1150 420"/></g>
<g transform="translate(40 -150)"><ellipse cx="702" cy="664" rx="60" ry="24" fill="#0003"/><path fill="#1b4fae" d="M650 628v24a52 25 0 0 0 104 0v-24z"/><ellipse cx="702" cy="628" rx="52" ry="25" fill="#2f74e0"/><path fill="#fff" d="m668 640 42-24 14 24-22-4z"/></g>
<g><ellipse cx="1022" cy="422" rx="48" ry="19" fill="#0003"/><path fill="#a52a20" d="M980 394v19a42 20 0 0 0 84 0v-19z"/><ellipse cx="1022" cy="394" rx="42" ry="20" fill="#e5483b"/><path fill="#fff" d="m1006 384 38 12-30 10z"/></g>
<g><ellipse cx="1250" cy="650" rx="62" ry="25" fill="#0003"/><path fill="#b98508" d="M1196 612v26a54 26 0 0 0 108 0v-26z"/><ellipse cx="1250" cy="612" rx="54" ry="26" fill="#f7b91d"/><path fill="#fff" d="m1226 622 16-28 30 22-24 0z"/></g>
</svg>`;

// Shows the picture at `url`, or while there is none, or it does not come, the drawn one.
export function showPoster(place, url = '') {
  const drawn = document.importNode(new DOMParser().parseFromString(DRAWN, 'image/svg+xml').documentElement, true);
  place.replaceChildren(drawn);
  if (url === '')
    return;
  const picture = Object.assign(document.createElement('img'), { alt: '' });
  picture.addEventListener('load', () => drawn.remove());
  picture.addEventListener('error', () => picture.remove());
  picture.src = url;
  place.append(picture);
}

// The name of the world at this address, as people say it: "soccer field" of …/worlds/soccer_field.wbt. '' where there is none.
export function worldName(address) {
  const file = /([^/?#&=]+)\.wbt\b/i.exec(decoded(address))?.[1] ?? '';
  return file.replace(/[_-]+/g, ' ').trim();
}

function decoded(address) {
  try {
    return decodeURIComponent(address);
  } catch {
    return address;
  }
}
