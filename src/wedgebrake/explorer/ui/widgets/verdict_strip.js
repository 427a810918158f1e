// The verdict: words first, colour and a sign beside them.

const WORDS = { good: "good", warn: "caution", bad: "critical", neutral: "" };
const SIGNS = {
  good: '<circle cx="7" cy="7" r="6.2" fill="#007A5A"/><path d="M4 7.2l2.1 2.1L10 5.2" stroke="#fff" stroke-width="1.6" fill="none"/>',
  warn: '<path d="M7 .8L13.6 12.8H.4z" fill="#B26A00"/><path d="M7 5v3.6M7 10v1.4" stroke="#fff" stroke-width="1.5"/>',
  bad: '<path d="M4.2.6h5.6L13.4 4.2v5.6L9.8 13.4H4.2L.6 9.8V4.2z" fill="#B93A00"/><path d="M4.6 4.6l4.8 4.8M9.4 4.6L4.6 9.4" stroke="#fff" stroke-width="1.6"/>',
  neutral: '<circle cx="7" cy="7" r="2.2" fill="#98A3B0"/>',
};

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

class Tile {
  constructor(name) {
    this.sign = make("span", { class: "sign" });
    this.means = make("span", { class: "unseen" });
    this.title = make("dt");
    this.value = make("dd", { class: "value" });
    this.detail = make("dd", { class: "detail" });
    this.root = make("div", { class: "tile", "data-testid": `tile-${name}` }, this.title, this.sign, this.value, this.detail);
    this.value.append(this.words = make("span"), this.means);
  }

  show({ title, value, detail, hint, tone }) {
    say(this.title, title);
    say(this.words, value);
    say(this.means, WORDS[tone] ? ` (${WORDS[tone]})` : "");
    say(this.detail, detail);
    this.root.title = hint;
    if (this.tone !== tone) {
      this.tone = tone;
      this.root.className = `tile ${tone}`;
      this.root.dataset.tone = tone;
      this.sign.innerHTML = `<svg viewBox="0 0 14 14" aria-hidden="true">${SIGNS[tone]}</svg>`;
    }
  }
}

export function render({ model, el }) {
  const headline = make("p", { class: "headline", role: "status", "aria-live": "polite", "data-testid": "headline" }, "…");
  const word = make("span", { class: "word", "data-testid": "tone" });
  const computing = make("span", { class: "computing", "aria-hidden": "true" }, "computing …");
  const list = make("dl", { class: "tiles" });
  const root = make("div", { class: "strip", "data-testid": "verdict" }, make("div", { class: "top" }, headline, computing, word), list);
  const tiles = new Map();
  el.append(root);

  function show({ verdict, pending }) {
    root.className = `strip ${verdict?.tone ?? ""} ${pending ? "pending" : ""}`;
    root.dataset.pending = String(Boolean(pending));
    if (!verdict) return;
    say(headline, verdict.headline);
    say(word, WORDS[verdict.tone] ?? "");
    for (const tile of verdict.tiles) {
      if (!tiles.has(tile.name)) {
        tiles.set(tile.name, new Tile(tile.name));
        list.append(tiles.get(tile.name).root);
      }
      tiles.get(tile.name).show(tile);
    }
  }

  show(model.state);
  model.on("state", () => show(model.state));
}
