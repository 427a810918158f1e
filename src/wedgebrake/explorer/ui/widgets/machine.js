// The machine's values. Rows are kept by name and changed in place, so that what is in the
// user's hand stays there; a value that was sent is not overwritten before it is answered.

const WAIT = 400; // ms after which an unanswered edit no longer holds back the next one
const QUIET = 250; // ms without a key until a value counts as chosen
const READ = 12000; // ms that a refusal stays when its input has been left
const FORGET = 3000; // ms after which an unanswered control shows the state again
const FINE = 400; // steps of a logarithmic slider

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "class") element.className = value;
    else if (name === "html") element.innerHTML = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

// Numbers as text, and back.

function written(value, whole = false, digits = 5) {
  if (value === null || value === undefined) return "";
  if (whole) return String(Math.round(value));
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
    return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

function read(text) {
  const plain = text.trim().replaceAll("−", "-").replace(/^([^.]*),([^.,]*)$/, "$1.$2");
  return plain === "" ? NaN : Number(plain);
}

// A slider counts its steps from 0 on.

const steps = (row) =>
  row.scale === "log" ? FINE : Math.min(Math.max(Math.round((row.high - row.low) / row.step), 10), 4000);

function share(row, value) {
  const part = row.scale === "log"
    ? Math.log(Math.max(value, row.low) / row.low) / Math.log(row.high / row.low)
    : (value - row.low) / (row.high - row.low);
  return Math.min(Math.max(part, 0), 1);
}

function at(row, place) {
  const part = place / steps(row);
  if (part <= 0) return row.low;
  if (part >= 1) return row.high;
  let value = row.scale === "log"
    ? Number((row.low * (row.high / row.low) ** part).toPrecision(3))
    : Math.round((row.low + part * (row.high - row.low)) / row.step) * row.step;
  if (row.whole) value = Math.round(value);
  return Math.min(Math.max(Number(value.toPrecision(12)), row.low), row.high);
}

// One edit is under way at a time; of those that wait the newest is sent.

class Sender {
  constructor(model, first) {
    this.model = model;
    this.seq = first;
    this.flying = 0;
    this.waiting = null;
    this.timer = 0;
  }

  send(name, value, done) {
    this.seq += 1;
    const edit = { type: "edit", changes: { [name]: value }, seq: this.seq, done };
    const other = this.waiting !== null && !(name in this.waiting.changes);
    if (other) this.release();
    if (done || !this.flying) this.post(edit);
    else this.waiting = edit;
    return this.seq;
  }

  post(edit) {
    this.waiting = null;
    this.flying = edit.seq;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.answered(Infinity), WAIT);
    this.model.send_msg(edit);
  }

  release() {
    if (this.waiting !== null) this.post(this.waiting);
  }

  answered(seq) {
    if (!this.flying || seq < this.flying) return;
    clearTimeout(this.timer);
    this.flying = 0;
    this.release();
  }
}

// Rows.

class Row {
  constructor(panel, row) {
    this.panel = panel;
    this.sent = 0; // number of the edit that is not answered yet
    this.held = false; // a slider in the hand
    this.timers = {};
    this.root = make("div", { class: `row ${row.kind}${row.symbol ? "" : " plain"}`, "data-testid": `row-${row.name}` });
    this.message = make("p", {
      class: "refusal", id: `refusal-${row.name}`, "aria-live": "polite",
      "data-testid": `refusal-${row.name}`,
    });
    this.message.title = "Click to dismiss";
    this.message.addEventListener("click", () => this.settle());
    this.build(row);
    this.root.append(this.message);
    this.control.setAttribute("aria-describedby", this.message.id);
    this.update(row);
  }

  get busy() { return this.held || this.sent > 0; }

  labelled(row) {
    return make(
      "label", { for: `input-${row.name}` },
      make("span", { class: "symbol", html: row.symbol }), make("span", { class: "words" }, row.label),
    );
  }

  send(value, done) {
    this.sent = this.panel.sender.send(this.row.name, value, done);
    clearTimeout(this.timers.forget);
    this.timers.forget = setTimeout(() => { this.sent = 0; this.put(this.row); }, FORGET);
  }

  // While keys repeat, a value is a passing one; it is chosen when they rest.
  passing(value) {
    this.send(value, false);
    clearTimeout(this.timers.quiet);
    this.timers.quiet = setTimeout(() => this.send(value, true), QUIET);
  }

  answered(seq) {
    if (this.sent && seq >= this.sent) {
      this.sent = 0;
      clearTimeout(this.timers.forget);
    }
  }

  update(row) {
    this.row = row;
    this.root.title = row.hint;
    this.control.disabled = !row.enabled;
    if (!this.busy) this.put(row);
  }

  refuse(words) {
    this.message.textContent = words;
    this.control.classList.toggle("bad", words !== "");
    this.control.setAttribute("aria-invalid", String(words !== ""));
    clearTimeout(this.timers.read);
    if (words && !this.panel.focused(this.control)) {
      this.timers.read = setTimeout(() => this.settle(), READ);
    }
  }

  // Nothing is refused any more: the value in force is shown.
  settle() {
    this.refuse("");
    if (!this.busy) this.put(this.row);
  }

  get refused() { return this.message.textContent !== ""; }
}

class Typed extends Row {
  field(row, attributes = {}) {
    this.control = make("input", {
      type: "text", id: `input-${row.name}`, "data-testid": `input-${row.name}`,
      autocomplete: "off", spellcheck: "false", ...attributes,
    });
    this.control.addEventListener("keydown", (event) => this.key(event));
    this.control.addEventListener("focus", () => {
      if (!this.refused && !this.busy) this.write(this.text(this.row, 12));
      this.control.select();
    });
    this.control.addEventListener("blur", () => {
      if (this.typing) this.commit();
      else this.settle();
    });
    return this.control;
  }

  key(event) {
    if (event.key === "Enter") { this.commit(); this.control.select(); }
    if (event.key === "Escape") { this.refuse(""); this.write(this.text(this.row)); this.control.select(); }
  }

  write(text) { this.control.value = this.shown = text; }

  get typing() { return this.control.value !== this.shown; }

  put(row) {
    if (!this.typing && !this.refused && !this.sent) this.write(this.text(row));
  }

  commit() {
    if (!this.typing) return;
    this.shown = this.control.value; // once, also where it is refused
    const value = this.value(this.control.value);
    if (value !== null) {
      this.refuse("");
      this.send(value, true);
      return;
    }
    this.refuse(this.wrong());
    if (!this.panel.focused(this.control)) this.write(this.text(this.row));
  }

  settle() {
    const typing = this.typing && this.panel.focused(this.control);
    this.refuse("");
    if (!this.busy && !typing) this.write(this.text(this.row));
  }
}

class NumberRow extends Typed {
  build(row) {
    this.slider = make("input", {
      type: "range", min: 0, step: 1, "data-testid": `slider-${row.name}`,
      "aria-label": `${row.label}, slider`,
    });
    this.unit = make("span", { class: "unit" });
    this.root.append(
      this.labelled(row), this.slider, this.field(row, { inputmode: "decimal" }), this.unit,
    );
    this.slider.addEventListener("pointerdown", () => { this.grip = true; });
    this.slider.addEventListener("input", () => {
      this.held = this.grip;
      const value = at(this.row, Number(this.slider.value));
      this.refuse("");
      this.write(written(value, this.row.whole));
      this.paint(value);
      if (this.grip) { this.send(value, false); this.moved = true; }
      else this.passing(value);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      this.slider.addEventListener(end, () => setTimeout(() => this.let_go()));
    }
  }

  // Chosen also where it was moved there and back, which is no change to a browser.
  let_go() {
    const value = at(this.row, Number(this.slider.value));
    if (this.moved) this.send(value, true);
    this.grip = this.held = this.moved = false;
  }

  key(event) {
    super.key(event);
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!way || !this.row.enabled) return;
    event.preventDefault();
    const now = read(this.control.value);
    if (!Number.isFinite(now)) return;
    const step = this.row.step * (event.shiftKey ? 10 : 1);
    // On to the next multiple of the step, as a grid is easier to come back to.
    const next = way > 0 ? Math.floor(now / step + 1 + 1e-6) : Math.ceil(now / step - 1 - 1e-6);
    const value = Number((next * step).toPrecision(12));
    this.refuse("");
    this.write(written(value, this.row.whole));
    this.place(value);
    this.passing(value);
  }

  text(row, digits) { return written(row.value, row.whole, digits); }

  value(text) {
    const value = read(text);
    return Number.isFinite(value) ? value : null;
  }

  wrong() { return `${this.row.label}: write a number, for example ${written(this.row.high, this.row.whole)}.`; }

  put(row) {
    super.put(row);
    this.unit.textContent = row.unit;
    this.place(row.value);
  }

  place(value) {
    this.slider.max = steps(this.row);
    this.slider.value = Math.round(share(this.row, value) * steps(this.row));
    this.paint(value);
  }

  // The bar reaches from zero, or from the lower end, to the value.
  paint(value) {
    const along = (part) => `calc(6px + ${part.toFixed(4)} * (100% - 12px))`;
    const zero = this.row.scale === "linear" ? share(this.row, 0) : 0;
    const here = share(this.row, value);
    this.slider.style.setProperty("--from", along(Math.min(zero, here)));
    this.slider.style.setProperty("--to", along(Math.max(zero, here)));
    this.slider.setAttribute("aria-valuetext", `${written(value, this.row.whole)} ${this.row.unit}`);
  }

  update(row) {
    super.update(row);
    this.slider.disabled = !row.enabled;
  }
}

class ListRow extends Typed {
  build(row) {
    this.root.append(this.labelled(row), this.field(row), make("span", { class: "unit" }, row.unit));
  }

  text(row, digits) { return row.value.map((one) => written(one, false, digits)).join(", "); }

  value(text) {
    const values = text.trim().split(/[\s,;]+/).filter((one) => one !== "").map(read);
    return values.length && values.every(Number.isFinite) ? values : null;
  }

  wrong() { return `${this.row.label}: write numbers with commas between them, for example 0, 0.1, 1.`; }
}

class ChoiceRow extends Row {
  build(row) {
    this.control = make("select", { id: `input-${row.name}`, "data-testid": `input-${row.name}` });
    for (const [value, words] of row.choices) this.control.append(make("option", { value }, words));
    this.root.append(this.labelled(row), this.control);
    this.control.addEventListener("change", () => this.send(this.control.value, true));
  }

  put(row) { this.control.value = row.value; }
}

class SwitchRow extends Row {
  build(row) {
    this.control = make("input", {
      type: "checkbox", id: `input-${row.name}`, "data-testid": `input-${row.name}`,
    });
    this.root.append(
      make("label", {}, this.control, make("span", { class: "words" }, row.label)),
    );
    this.control.addEventListener("change", () => this.send(this.control.checked, true));
  }

  put(row) { this.control.checked = row.value; }
}

const KINDS = { number: NumberRow, list: ListRow, choice: ChoiceRow, switch: SwitchRow };

// What cannot be changed, in one line at the end of a section.
class Fact {
  constructor(_panel, row) {
    this.number = make("span", { class: "number" });
    this.root = make(
      "span", { "data-testid": `row-${row.name}` },
      make("span", { class: "symbol", html: row.symbol }), this.number,
    );
    this.update(row);
  }

  update(row) {
    this.row = row;
    this.root.title = row.hint;
    this.number.textContent = `${Number(row.value.toPrecision(4))}${row.unit ? ` ${row.unit}` : ""}`;
  }

  answered() {}
  settle() {}
  refuse() {}
}

class Panel {
  constructor(model, el) {
    this.root = make("div", { class: "panel", "data-testid": "machine" });
    this.tree = el;
    this.sender = new Sender(model, JSON.parse(model.state).seq ?? 0);
    this.sections = new Map();
    this.rows = new Map();
    el.append(this.root);
  }

  focused(element) { return this.tree.getRootNode().activeElement === element; }

  show(state) {
    if (!state.sections) return;
    const seq = state.seq ?? 0;
    const kept = new Set();
    for (const section of state.sections) {
      const bodies = this.section(section);
      for (const row of section.rows) {
        kept.add(row.name);
        let one = this.rows.get(row.name);
        one?.answered(seq);
        if (state.refusal?.[0] === row.name) one?.refuse(state.refusal[1]);
        if (one === undefined || one.row.kind !== row.kind) {
          one?.root.remove();
          one = row.kind === "fixed" ? new Fact(this, row) : new KINDS[row.kind](this, row);
          this.rows.set(row.name, one);
        } else one.update(row);
      }
      for (const [fixed, body] of bodies) {
        const roots = section.rows.filter((row) => (row.kind === "fixed") === fixed)
          .map((row) => this.rows.get(row.name).root);
        arrange(body, roots);
      }
    }
    for (const name of [...this.rows.keys()]) if (!kept.has(name)) this.rows.delete(name);
    this.refusals(state.refusal);
    this.sender.answered(seq || Infinity);
  }

  section({ name, title }) {
    if (!this.sections.has(name)) {
      const [body, facts] = [make("div"), make("div", { class: "facts" })];
      const root = make(
        "details", { open: "", class: name, "data-testid": `section-${name}` },
        make("summary", {}, title), body, facts,
      );
      this.root.append(root);
      this.sections.set(name, [[false, body], [true, facts]]);
    }
    return this.sections.get(name);
  }

  refusals(refusal) {
    const [name, words] = refusal ?? ["", ""];
    for (const [one, row] of this.rows) {
      if (one !== name) row.settle();
      else {
        row.refuse(words);
        // What was typed stays to be mended; a slider or a choice goes back.
        const typed = row.control.type === "text" && this.focused(row.control);
        if (!typed && row.put && !row.held) {
          if (row.write) row.write(row.text(row.row));
          row.put(row.row);
        }
      }
    }
  }
}

// Children in an order, moving none that stands right: a moved one would lose the focus.
function arrange(body, wanted) {
  for (const child of [...body.children]) if (!wanted.includes(child)) child.remove();
  wanted.forEach((child, place) => {
    if (body.children[place] !== child) body.insertBefore(child, body.children[place] ?? null);
  });
}

export function render({ model, el }) {
  const panel = new Panel(model, el);
  const show = () => panel.show(JSON.parse(model.state));
  show();
  model.on("state", show);
}
