// Pictures over parameters between their tabs and their legend. Only the open one is displayed;
// the others keep what they show, and are laid out when they are opened.

const PLATES = {
  diagram: "Bifurcation diagram", regimes: "Map of regimes", stability: "Map of stability",
  basins: "Basins of attraction",
};

function make(name, ...children) {
  const element = document.createElement("div");
  element.className = name;
  element.append(...children);
  return element;
}

export function render({ model, el }) {
  const panels = new Map();
  for (const [name, words] of Object.entries(PLATES)) {
    const panel = make("panel", model.get_child(name));
    panel.setAttribute("role", "tabpanel");
    panel.setAttribute("aria-label", words);
    panel.dataset.testid = `panel-${name}`;
    panels.set(name, panel);
  }
  const root = make(
    "atlas", model.get_child("head"), make("panels", ...panels.values()), model.get_child("foot"),
  );
  root.dataset.testid = "atlas";
  el.append(root);
  const open = () => panels.forEach((panel, name) => { panel.hidden = name !== model.tab; });
  model.on("tab", open);
  open();
}
