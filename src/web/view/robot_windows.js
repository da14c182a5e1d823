// The windows of robots: pages that the simulator serves and that talk to it by a WebSocket of their own, or, of old
// simulations, pages beside the page that shows them. Touches the DOM.

const OLD_MESSAGES = 200; // kept for a window that is still loading

// Pages of a simulation are written by whoever wrote the simulation. In a frame of another origin they can't reach the page around
// them; where a proxy gives both one origin, the frame gets an origin of its own. Our servers give them one wherever they are
// shown (Content-Security-Policy: sandbox), since a window may lead its frame elsewhere.
const ALLOWED = 'allow-scripts allow-forms allow-popups allow-downloads';

export class RobotWindows {
  #windows = new Map(); // by the robot's name
  #changed;
  #showPanel;

  // `showPanel(title, frame, closed)` shows a frame and returns the function that takes it away; `changed` is called when
  // there are other windows than before, or other ones open.
  constructor(showPanel, changed) {
    this.#showPanel = showPanel;
    this.#changed = changed;
  }

  // [{robot, open}]
  get list() {
    return [...this.#windows].map(([robot, { close }]) => ({ robot, open: close !== null }));
  }

  // What the simulator says of a window: {robot, window, main, visible, remove}; `base` is the address of the simulator.
  announce({ robot, window, visible, remove }, base) {
    if (typeof robot !== 'string' || typeof window !== 'string' || window === '<none>')
      return;
    if (remove === true)
      return this.#forget(robot);
    const name = encodeURIComponent(window === '<generic>' ? 'generic' : window);
    this.#add(robot, { url: `${base}/robot_windows/${name}/${name}.html?name=${encodeURIComponent(robot)}` });
    if (visible === true)
      this.open(robot);
  }

  // A window of an old simulation: a page beside the page around it, to which `send(message, robot)` belongs.
  announceOld(robot, window, send) {
    if (/^(<|$)/.test(window) || (this.#windows.has(robot) && this.#windows.get(robot).script === undefined))
      return; // <none>, <generic>; or the simulator has a newer one
    const name = encodeURIComponent(window);
    const url = new URL(`window/${name}/${name}.html`, document.baseURI).href;
    this.#add(robot, { url, script: url.replace(/html$/, 'js'), name: window, send });
  }

  open(robot) {
    const window = this.#windows.get(robot);
    if (window === undefined || window.close !== null)
      return;
    const frame = document.createElement('iframe');
    frame.title = robot;
    if (window.script === undefined)
      frame.setAttribute('sandbox', new URL(window.url).origin === location.origin ? ALLOWED : `${ALLOWED} allow-same-origin`);
    else
      frame.addEventListener('load', () => fillOldWindow(frame, window, robot));
    frame.src = window.url;
    window.close = this.#showPanel(robot, frame, () => this.close(robot));
    this.#changed();
  }

  close(robot) {
    const window = this.#windows.get(robot);
    if (window === undefined || window.close === null)
      return;
    window.close();
    window.close = window.receive = null;
    this.#changed();
  }

  // A message of a robot to its old window; newer windows get it by themselves.
  receive(robot, message) {
    const window = this.#windows.get(robot);
    if (window?.script === undefined)
      return;
    if (window.receive !== null)
      window.receive(message, robot);
    else if (window.pending.push(message) > OLD_MESSAGES)
      window.pending.shift();
  }

  clear() {
    for (const robot of [...this.#windows.keys()])
      this.#forget(robot);
  }

  #add(robot, window) {
    if (this.#windows.get(robot)?.url === window.url)
      return; // simulators may say it twice
    this.#forget(robot);
    this.#windows.set(robot, { ...window, close: null, receive: null, pending: [] });
    this.#changed();
  }

  #forget(robot) {
    this.close(robot);
    if (this.#windows.delete(robot))
      this.#changed();
  }
}

// The script of an old window finds `webots.window(<name>)` with send(message, robot), and sets its receive(message, robot).
function fillOldWindow(frame, window, robot) {
  const page = frame.contentWindow;
  const itself = {
    send: window.send,
    set receive(handler) {
      window.receive = handler;
      window.pending.splice(0).forEach((message) => handler(message, robot));
    },
  };
  page.webots = { window: () => itself };
  const script = page.document.createElement('script');
  script.src = window.script;
  page.document.body.append(script);
}
