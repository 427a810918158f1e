// The tabs of the pictures over parameters, and what the open picture goes over.

const SOON = 1500; // ms in which an edit is answered
const HINTS = {
  axis: "Parameter of the diagram", across: "Parameter to the right", up: "Parameter upwards",
};

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "class") element.className = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

const written = (value) => (value === null ? "" : String(Number(value.toPrecision(5))));

function read(text) {
  const plain = text.trim().replaceAll("−", "-").replace(/^([^.]*),([^.,]*)$/, "$1.$2");
  return plain === "" ? NaN : Number(plain);
}

// One parameter: which one, from where to where.

class Control {
  constructor(send, control) {
    this.send = send;
    this.root = make("span", { class: "control" });
    this.select = make("select", { "data-testid": control.role });
    this.select.addEventListener("change", () => send({ [this.control.role]: this.select.value }));
    this.name = make("span", { class: "name" });
    const first = control.role === "axis" ? "" : `${control.role}-`;
    [this.low, this.high] = ["from", "to"].map((end) => this.end(end, `${first}${end}`));
    this.unit = make("span", { class: "unit" });
    this.root.append(
      this.select, this.name, make("span", { class: "word" }, "from"), this.low,
      make("span", { class: "word" }, "to"), this.high, this.unit,
    );
    this.update(control);
  }

  end(word, id) {
    const input = make("input", {
      type: "text", inputmode: "decimal", autocomplete: "off", spellcheck: "false",
      "data-testid": id,
    });
    input.addEventListener("change", () => this.commit());
    input.addEventListener("focus", () => input.select());
    input.addEventListener("keydown", (event) => {
      if (event.key === "Escape") { this.put(); input.select(); }
    });
    return input;
  }

  commit() {
    // What is no number is sent as it is, to be refused in words.
    const span = [this.low, this.high].map((input) => {
      const value = read(input.value);
      input.classList.toggle("bad", !Number.isFinite(value));
      return Number.isFinite(value) ? value : input.value;
    });
    this.send({ spans: { [this.control.name]: span } });
    // What was refused, or taken otherwise, is shown as it is; unless it is being changed again.
    const typed = [this.low.value, this.high.value].join();
    setTimeout(() => { if ([this.low.value, this.high.value].join() === typed) this.put(); }, SOON);
  }

  put() {
    for (const [input, value] of [[this.low, this.control.low], [this.high, this.control.high]]) {
      input.value = written(value);
      input.disabled = value === null;
      input.classList.remove("bad");
    }
  }

  update(control) {
    const typing = [this.low, this.high].includes(this.root.getRootNode().activeElement);
    const other = this.control?.name !== control.name;
    this.control = control;
    const chooses = control.choices.length > 0;
    this.select.hidden = !chooses;
    this.name.hidden = chooses;
    this.name.textContent = `${control.symbol} ${control.label}`.trim();
    this.select.title = HINTS[control.role];
    this.select.setAttribute("aria-label", HINTS[control.role]);
    this.low.setAttribute("aria-label", `${control.label || control.name} from`);
    this.high.setAttribute("aria-label", `${control.label || control.name} to`);
    this.choose(control);
    this.unit.textContent = control.unit;
    if (!typing || other) this.put();
  }

  choose({ choices, name }) {
    const text = JSON.stringify(choices);
    if (text !== this.choices) {
      this.choices = text;
      const groups = new Map();
      for (const [value, words, heading] of choices) {
        if (!groups.has(heading)) groups.set(heading, make("optgroup", { label: heading }));
        groups.get(heading).append(make("option", { value }, words));
      }
      this.select.replaceChildren(...groups.values());
    }
    this.select.value = name;
  }
}

class Head {
  constructor(model, el) {
    this.send = (changes) => model.send_msg({ type: "edit", changes });
    this.tabs = make("div", { class: "tabs", role: "tablist", "aria-label": "Pictures" });
    this.controls = make("div", { class: "controls" });
    this.buttons = new Map();
    this.kept = [];
    this.quantity = this.quantities();
    this.tabs.addEventListener("keydown", (event) => this.key(event));
    el.append(make("div", { class: "head" }, this.tabs, this.controls));
  }

  quantities() {
    const select = make(
      "select", {
        "data-testid": "quantity", "aria-label": "Quantity",
        title: "What is drawn of the Poincaré section",
      },
      make("option", { value: "velocity" }, "velocity"), make("option", { value: "angle" }, "angle"),
    );
    select.addEventListener("change", () => this.send({ quantity: select.value }));
    return select;
  }

  key(event) {
    const names = [...this.buttons.keys()];
    const place = names.indexOf(this.tab);
    const next = {
      ArrowRight: (place + 1) % names.length,
      ArrowLeft: (place + names.length - 1) % names.length,
      Home: 0, End: names.length - 1,
    }[event.key];
    if (next === undefined) return;
    event.preventDefault();
    this.buttons.get(names[next]).focus();
    this.open(names[next]);
  }

  open(name) {
    if (name === this.tab) return;
    this.mark(name);
    this.send({ plate: name });
  }

  mark(name) {
    this.tab = name;
    for (const [one, button] of this.buttons) {
      button.setAttribute("aria-selected", String(one === name));
      button.tabIndex = one === name ? 0 : -1;
    }
  }

  show({ tabs, tab, controls, quantity }) {
    if (!tabs) return;
    for (const [name, words, title] of tabs) {
      if (this.buttons.has(name)) continue;
      const button = make(
        "button", { type: "button", role: "tab", "data-testid": `tab-${name}`, title }, words,
      );
      button.addEventListener("click", () => this.open(name));
      this.buttons.set(name, button);
      this.tabs.append(button);
    }
    this.mark(tab);
    const roles = controls.map((one) => one.role).join();
    if (roles !== this.roles) {
      this.roles = roles;
      this.kept = controls.map((one) => new Control(this.send, one));
    } else controls.forEach((one, i) => this.kept[i].update(one));
    const wanted = this.kept.map((one) => one.root);
    if (quantity) {
      this.quantity.value = quantity;
      wanted.push(this.quantity);
    }
    const there = [...this.controls.children];
    if (there.length !== wanted.length || there.some((one, i) => one !== wanted[i])) {
      this.controls.replaceChildren(...wanted);
    }
  }
}

export function render({ model, el }) {
  const head = new Head(model, el);
  const show = () => head.show(JSON.parse(model.state));
  model.on("state", show);
  show();
}
