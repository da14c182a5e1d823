"use strict";

// What only the operator may do on the pages of both servers. Everybody may read them; whoever has the operator's token types it, and this page
// remembers it until it is left. It is stored nowhere: a gateway has pages of machines at the same origin, and they could read it there. Over
// the operator's socket, which people forward to their machine, no token is needed.
const operator = (() => {
  const {make} = monitor;
  const patience = 15_000; // ms
  const api = new URL("api/", location.href); // also below /<port>/ of a proxy
  const listeners = [];
  let token = ""; // empty: none is needed, or nobody has typed it
  let isActive = false;

  // Resolves to {status, text}; status 0: no answer.
  async function ask(path, method, shown = token) {
    const headers = shown ? {Authorization: `Bearer ${shown}`} : {};
    try {
      const answer = await fetch(new URL(path, api), {method, headers, cache: "no-store", credentials: "omit",
                                                      signal: AbortSignal.timeout(patience)});
      return {status: answer.status, text: (await answer.text()).trim()};
    } catch {
      return {status: 0, text: ""};
    }
  }

  // Why the server did not do it, for the person who asked.
  function reason({status, text}, hadToken) {
    if (status === 0)
      return say('monitor.noAnswer');
    if (status === 404 || status === 401) {
      const first = hadToken ? say('monitor.wrongToken') : say('monitor.asksForToken');
      return location.pathname === "/monitor" ? first : `${first} ${say('monitor.perhapsProxy')}`;
    }
    // Ours are sentences; a proxy's may be whole pages.
    return text.length < 300 && !text.includes("<") ? text : say('monitor.httpStatus', {status});
  }

  function setActive(active) {
    if (active === isActive)
      return;
    isActive = active;
    document.body.classList.toggle("operator", active);
    button.textContent = active ? say('monitor.stopOperator') : say('monitor.operator');
    for (const listener of listeners)
      listener(active);
  }

  async function signIn(typed) {
    const answer = await ask("operator", "GET", typed);
    if (answer.status === 200) {
      token = typed;
      setActive(true);
    }
    return answer;
  }

  function signOut() {
    token = "";
    setActive(false);
  }

  // A question with a button that does what is asked, and stays open until that is done. `action` resolves to an empty text, or to why it failed.
  function dialog({title, text, label, field, action}) {
    const failure = make("p", {class: "failure", role: "alert"});
    const doIt = make("button", {type: "submit", class: "act primary"}, label);
    const cancel = make("button", {type: "button", class: "act"}, say('monitor.cancel'));
    const form = make("form", {}, make("h2", {id: "dialog-title"}, title), make("p", {}, text), ...(field ? [field] : []), failure,
                      make("div", {class: "buttons"}, cancel, doIt));
    const element = make("dialog", {"aria-labelledby": "dialog-title"}, form);
    const before = document.activeElement;
    cancel.onclick = () => element.close();
    element.onclose = () => {
      element.remove();
      if (before?.isConnected)
        before.focus();
    };
    form.onsubmit = async event => {
      event.preventDefault();
      if (doIt.getAttribute("aria-busy") === "true")
        return;
      doIt.setAttribute("aria-busy", "true");
      failure.textContent = "";
      const why = await action();
      doIt.removeAttribute("aria-busy");
      if (!why)
        return element.close();
      failure.textContent = why;
      form.querySelector("input")?.select();
    };
    document.body.append(element);
    element.showModal();
    (form.querySelector("input") ?? cancel).focus();
  }

  function askForToken() {
    const input = make("input", {type: "password", id: "token", autocomplete: "current-password", required: ""});
    dialog({
      title: say('monitor.operator'),
      text: say('monitor.tokenText'),
      label: say('monitor.continue'),
      field: make("p", {}, make("label", {for: "token"}, say('monitor.token')), input),
      action: async () => {
        const typed = input.value.trim();
        const answer = /^[\x21-\x7e]+$/.test(typed) ? await signIn(typed) : {status: 404, text: ""};
        return answer.status === 200 ? "" : reason(answer, true);
      },
    });
  }

  // Asks whether it is meant, and then the server: `POST api/<path>`.
  function act({title, text, label, path}) {
    dialog({
      title, text, label,
      action: async () => {
        const answer = await ask(path, "POST");
        return answer.status === 200 ? "" : reason(answer, Boolean(token));
      },
    });
  }

  // What the server finds wrong with itself and its machine, as with its option --doctor.
  const doctor = (() => {
    const patience = 20; // questions, one a second
    const note = make("p", {role: "status"});
    const look = make("button", {type: "button", class: "act", id: "examine"}, say('monitor.lookAgain'));
    const list = make("ul", {lang: "en"}); // as the server writes it
    const section = make("section", {id: "doctor", hidden: ""}, make("h2", {}, say('monitor.doctor')), list, note, look);

    function show({examined, underWay, findings}) {
      list.replaceChildren(...findings.map(({verdict, subject, found, remedy}) =>
        make("li", {class: verdict}, make("b", {}, verdict), ` ${subject}: ${found}. ${remedy}`)));
      note.textContent = underWay ? say('monitor.looking') : examined ? say('monitor.lookedAt', {time: texts.moment(Date.parse(examined) / 1000)}) : "";
    }

    async function examine() {
      look.hidden = true;
      for (let asked = 0; asked < patience && isActive; ++asked) {
        const answer = await ask(asked === 0 ? "doctor" : "doctor?last", "GET");
        if (answer.status !== 200) {
          note.textContent = reason(answer, Boolean(token));
          break;
        }
        const said = JSON.parse(answer.text);
        show(said);
        if (!said.underWay)
          break;
        await new Promise(resolve => setTimeout(resolve, 1_000));
      }
      look.hidden = false;
    }

    look.onclick = examine;
    listeners.push(active => {
      section.hidden = !active;
      if (active)
        void examine();
    });
    return section;
  })();

  const button = make("button", {type: "button", class: "act", id: "operator"}, say('monitor.operator'));
  button.onclick = async () => {
    if (isActive)
      return signOut();
    button.setAttribute("aria-busy", "true");
    const answer = await signIn(""); // over the operator's socket that is enough
    button.removeAttribute("aria-busy");
    if (answer.status !== 200)
      askForToken();
  };

  const sections = [];
  // A page that shows ours in a frame could have its visitor press our buttons. What a session server passes on from a machine is no place for
  // tokens, and no gateway passes on what they allow.
  if (monitor.isSandboxed) {
    sections.push(make("p", {id: "elsewhere", class: "hint"}, say('monitor.elsewhere')));
  } else if (window === window.top) {
    monitor.header.append(button);
    sections.push(doctor);
  }

  return {
    act,
    ask, // resolves to {status, text}
    sections, // of the page, at its end
    get active() { return isActive; },
    // Calls listener(active) whenever that changes.
    watch(listener) { listeners.push(listener); },
  };
})();
