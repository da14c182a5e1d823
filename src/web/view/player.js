// The bar below an animation: play, pause and the position. Touches the DOM.

import { say } from './texts.js';

const ICONS = { play: 'M4 2.5v11l9-5.5z', pause: 'M4 3h3v10H4zm5 0h3v10H9z' };

export class Player {
  #animation;
  #show;
  #loop;
  #bar = document.createElement('div');
  #button = document.createElement('button');
  #icon = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  #slider = document.createElement('input');
  #time = 0;
  #playing = false;
  #tick = 0; // when the last frame was drawn
  #frame = 0;

  // Adds the bar to `container`, and shows the beginning: `show` is called with updates for Scene.receive().
  constructor(container, animation, show, { play = true, loop = true } = {}) {
    this.#animation = animation;
    this.#show = show;
    this.#loop = loop;
    this.#build();
    container.append(this.#bar);
    this.sayNames();
    this.seek(0);
    if (play)
      this.play();
  }

  get playing() { return this.#playing; }

  get time() { return this.#time; }

  play() {
    if (!this.#loop && this.#time >= this.#animation.duration)
      this.seek(0);
    this.#playing = true;
    this.#tick = performance.now();
    this.#next();
    this.sayNames();
  }

  pause() {
    this.#playing = false;
    cancelAnimationFrame(this.#frame);
    this.sayNames();
  }

  // In milliseconds from the beginning.
  seek(time) {
    this.#time = Math.min(Math.max(0, time), this.#animation.duration);
    this.#slider.value = this.#time;
    this.#slider.setAttribute('aria-valuetext', `${(this.#time / 1000).toFixed(1)} s`);
    const update = this.#animation.at(this.#time);
    if (update !== null)
      this.#show(update);
  }

  close() {
    this.pause();
    this.#bar.remove();
  }

  // Says what the button and the slider are for, in the language of the page.
  sayNames() {
    this.#button.setAttribute('aria-label', this.#playing ? say('player.pause') : say('player.play'));
    this.#slider.setAttribute('aria-label', say('player.position'));
    this.#icon.setAttribute('d', this.#playing ? ICONS.pause : ICONS.play);
  }

  #build() {
    Object.assign(this.#bar.style, { position: 'absolute', left: '0', right: '0', bottom: '0', display: 'flex', gap: '8px', padding: '6px 8px',
      alignItems: 'center', background: 'rgb(16 21 29 / .6)' });
    Object.assign(this.#button.style, { width: '44px', height: '32px', border: 'none', background: 'none', cursor: 'pointer' });
    Object.assign(this.#slider.style, { flex: '1', minWidth: '0' });
    const image = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    image.setAttribute('viewBox', '0 0 16 16');
    image.setAttribute('aria-hidden', 'true');
    Object.assign(image.style, { width: '20px', height: '20px', fill: '#fff' });
    image.append(this.#icon);
    this.#button.type = 'button';
    this.#button.append(image);
    this.#button.addEventListener('click', () => (this.#playing ? this.pause() : this.play()));
    Object.assign(this.#slider, { type: 'range', min: 0, max: this.#animation.duration, step: 'any' });
    this.#slider.addEventListener('input', () => this.seek(Number(this.#slider.value)));
    this.#bar.append(this.#button, this.#slider);
  }

  // Hidden pages draw no frames, and an animation waits for them.
  #next() {
    this.#frame = requestAnimationFrame((now) => {
      const passed = Math.min(Math.max(0, now - this.#tick), 1000);
      this.#tick = now;
      const { duration } = this.#animation;
      const time = this.#time + passed;
      if (time < duration || duration === 0)
        this.seek(time);
      else if (this.#loop)
        this.seek(time % duration);
      else {
        this.seek(duration);
        return this.pause();
      }
      this.#next();
    });
  }
}
