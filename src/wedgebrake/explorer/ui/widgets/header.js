// The bar at the top. It says what its user wants and keeps no values of its own.

const ICONS = {
  load: "M8 10V2m-3.5 3.5L8 2l3.5 3.5 M2.5 13.5h11",
  save: "M8 2v8m-3.5-3.5L8 10l3.5-3.5 M2.5 13.5h11",
};
const EXPORTS = [
  ["Picture of the response", [["png", "PNG", "for slides"], ["svg", "SVG", "for print"]]],
  ["Picture of the open diagram", [["diagram-png", "PNG", "for slides"], ["diagram-svg", "SVG", "for print"]]],
  ["Data of the response", [["netcdf", "netCDF", "with all settings"], ["csv", "CSV", "a table"]]],
  ["What lies on the desk", [["study", "Study file", "TOML"], ["python", "Python program", "runs as it is"]]],
];
const SHOWN = [
  ["The machine", "A driveline with a self-amplified brake under a periodic torque. Move a slider, type a number, or choose another brake or friction law."],
  ["Verdict", "Linear stability of sliding, self-locking, the class of the motion and of its stick-slip, with the brake torque. Hover for the evidence."],
  ["History, phase", "The last periods of the torque; sticks are marked by the direction of sliding before them. The conventional brake is drawn behind them where it is asked for."],
  ["Section, spectrum", "The state once in every period of the torque, and the frequencies in its velocity."],
  ["The brake", "The brake drawn in motion; drag the bar below it through time."],
  ["Diagram", "The motion over one parameter. Click in it to go there."],
  ["Regimes, stability", "Classes of motion over two parameters, and the linear stability chart."],
  ["Basins", "Which motion follows from which start."],
];

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

const icon = (name) =>
  `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;

function mark() {
  return make("div", {
    class: "mark", title: "wedgebrake: vibration of self-amplified friction brakes",
    html: `<svg width="24" height="20" viewBox="0 0 24 20" aria-hidden="true">
      <rect x="1" y="1" width="22" height="3" rx="1" fill="#5B6675"/>
      <path d="M2 17.5 L22 17.5 L22 6 Z" fill="#0072B2"/></svg><b>wedgebrake</b><span>explorer</span>`,
  });
}

class Header {
  constructor(model, el) {
    this.model = model;
    this.dismissed = 0;
    this.say = (message) => model.send_msg(message);
    this.bar = make("div", { class: "bar", role: "banner" });
    this.notice = make("div", { class: "notice", role: "status", "aria-live": "polite", "data-testid": "notice" });
    this.bar.append(
      mark(), this.presets(), make("div", { class: "rule" }), ...this.load(), this.save(), this.exports(),
      make("div", { class: "rule" }), this.laws(), this.ghost(), this.activity(), this.help(),
    );
    el.append(this.bar, this.notice, this.dialog);
  }

  presets() {
    this.preset = make("select", { class: "preset", "aria-label": "Preset machines", "data-testid": "preset" });
    this.preset.append(make("option", { value: "" }, "Choose a machine …"));
    const groups = new Map();
    for (const { name, title, group } of this.model.state.presets ?? []) {
      if (!groups.has(group)) groups.set(group, make("optgroup", { label: group }));
      groups.get(group).append(make("option", { value: name }, title));
    }
    this.preset.append(...groups.values());
    this.preset.addEventListener("change", () => {
      if (this.preset.value) this.say({ type: "preset", name: this.preset.value });
    });
    return this.preset;
  }

  load() {
    const file = make("input", { type: "file", accept: ".toml", class: "unseen", tabindex: "-1", "aria-label": "Study file", "data-testid": "file" });
    const button = make("button", {
      class: "button", type: "button", title: "Load a study file (TOML) from this computer", "data-testid": "load",
      html: `${icon("load")}<span>Load</span>`,
    });
    button.addEventListener("click", () => file.click());
    file.addEventListener("change", async () => {
      const [chosen] = file.files;
      file.value = "";
      if (chosen) await this.upload(chosen);
    });
    this.bar.addEventListener("dragover", (event) => event.preventDefault());
    this.bar.addEventListener("drop", async (event) => {
      event.preventDefault();
      const [chosen] = event.dataTransfer.files;
      if (chosen) await this.upload(chosen);
    });
    return [button, file];
  }

  async upload(file) {
    const most = this.model.state.most_upload;
    if (file.size > most) {
      this.tell(`${file.name}: is larger than ${most} bytes: must be a study file, a page of text.`, "bad");
      return;
    }
    const text = await file.text();
    this.preset.value = "";
    this.say({ type: "upload", name: file.name, size: file.size, text });
  }

  save() {
    const button = make("button", {
      class: "button", type: "button", title: "Save machine, run and view as a study file (TOML)", "data-testid": "save",
      html: `${icon("save")}<span>Save<span class="long"> study</span></span>`,
    });
    button.addEventListener("click", () => this.say({ type: "export", format: "study" }));
    return button;
  }

  exports() {
    const menu = make("details", { class: "menu", "data-testid": "export" });
    const items = make("div", { class: "items" });
    for (const [title, entries] of EXPORTS) {
      items.append(make("h3", {}, title));
      for (const [format, words, note] of entries) {
        const item = make("button", { type: "button", "data-testid": `export-${format}` }, words, make("span", {}, note));
        item.addEventListener("click", () => {
          menu.open = false;
          this.say({ type: "export", format });
        });
        items.append(item);
      }
    }
    menu.append(make("summary", { class: "button", title: "Pictures, data and programs of what is shown" }, "Export"), items);
    menu.addEventListener("keydown", (event) => {
      if (event.key === "Escape") { menu.open = false; menu.querySelector("summary").focus(); }
    });
    document.addEventListener("pointerdown", (event) => {
      if (!event.composedPath().includes(menu)) menu.open = false;
    });
    return menu;
  }

  laws() {
    this.segments = make("fieldset", {
      class: "segments", "aria-label": "Friction law", "data-testid": "law",
      title: "Exact: set-valued Coulomb friction, solved event by event. Smoothed: tanh over the speed, as in the paper's simulations.",
    });
    this.segments.addEventListener("change", (event) => {
      this.say({ type: "edit", changes: { friction: event.target.value }, seq: 0, done: true });
    });
    return this.segments;
  }

  ghost() {
    this.behind = make("input", { type: "checkbox", "data-testid": "ghost" });
    this.behind.addEventListener("change", () => {
      this.say({ type: "edit", changes: { ghost: this.behind.checked }, seq: 0, done: true });
    });
    this.label = make(
      "label", { class: "check" }, this.behind,
      make("span", { html: "conventional<span class='long'> brake behind</span>" }),
    );
    return this.label;
  }

  activity() {
    this.words = make("p", { "data-testid": "busy" });
    this.working = make("div", { class: "activity", role: "status" }, make("i"), this.words);
    return this.working;
  }

  help() {
    const list = make("dl", {}, ...SHOWN.flatMap(([term, words]) => [make("dt", {}, term), make("dd", {}, words)]));
    const close = make("button", { class: "button", type: "submit" }, "Close");
    this.dialog = make(
      "dialog", { "aria-label": "Help", "data-testid": "help-text" }, make("h2", {}, "What this page shows"), list,
      make("h3", {}, "Limits"),
      make("p", {}, this.model.state.limits ?? ""),
      make("h3", {}, "Keys"),
      make("p", { html: "<kbd>↑</kbd> <kbd>↓</kbd> in a number changes it by a step, with <kbd>Shift</kbd> by ten; <kbd>Enter</kbd> takes what was typed, <kbd>Esc</kbd> brings the old value back." }),
      make("form", { method: "dialog" }, close),
    );
    const button = make("button", { class: "button quiet", type: "button", title: "What the page shows, and its limits", "data-testid": "help" }, "Help");
    button.addEventListener("click", () => this.dialog.showModal());
    return button;
  }

  tell(text, tone) {
    this.notice.className = `notice ${tone}`;
    if (!text) { this.notice.replaceChildren(); return; }
    const away = make("button", { class: "button quiet", type: "button", "aria-label": "Dismiss", "data-testid": "dismiss" }, "×");
    away.addEventListener("click", () => this.tell("", ""));
    const words = { good: "✓ ", warn: "! ", bad: "✕ " }[tone] ?? "";
    this.notice.replaceChildren(make("p", {}, words + text), away);
    clearTimeout(this.timer);
    if (tone === "good") this.timer = setTimeout(() => this.tell("", ""), 6000);
  }

  show(state) {
    this.show_laws(state);
    this.behind.checked = Boolean(state.ghost) && !state.conventional;
    this.behind.disabled = Boolean(state.conventional);
    this.label.title = state.conventional
      ? "The brake is the conventional one already"
      : "Show the same machine with a conventional brake of the same radius behind the curves";
    this.preset.value = state.preset ?? "";
    this.words.textContent = state.busy ?? "";
    this.working.title = state.busy ?? "";
    this.working.classList.toggle("idle", !state.busy);
    this.working.style.visibility = state.busy ? "visible" : "hidden";
    const notice = state.notice;
    if (notice && notice.number > this.dismissed) {
      this.dismissed = notice.number;
      this.tell(notice.text, notice.tone);
    }
  }

  show_laws({ laws = [], friction }) {
    const key = JSON.stringify(laws);
    if (key !== this.known) {
      this.known = key;
      this.segments.replaceChildren(...laws.map(([kind, words]) => make(
        "label", {}, make("input", { type: "radio", name: "law", value: kind, "data-testid": `law-${kind}` }), words,
      )));
    }
    for (const radio of this.segments.querySelectorAll("input")) radio.checked = radio.value === friction;
  }

  save_file({ name, mime, base64 }) {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const link = make("a", { href: URL.createObjectURL(new Blob([bytes], { type: mime })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
}

export function render({ model, el }) {
  const header = new Header(model, el);
  header.show(model.state);
  model.on("state", () => header.show(model.state));
  model.on("msg:custom", (message) => {
    if (message.type === "file") header.save_file(message);
  });
}
