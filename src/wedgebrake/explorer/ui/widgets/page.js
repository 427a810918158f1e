// The skeleton of the page. Every part is a child that draws itself.

const CARDS = ["history", "phase", "stage", "spectrum", "section", "atlas"];
const NAMES = {
  history: "Time history", phase: "Phase portrait", stage: "The brake in motion",
  spectrum: "Spectrum", section: "Poincaré section", atlas: "Pictures over parameters",
};

function area(tag, name, child, label) {
  const element = document.createElement(tag);
  element.className = `area ${name}`;
  element.dataset.testid = `area-${name}`;
  if (label) element.setAttribute("aria-label", label);
  element.append(child);
  return element;
}

// Nothing on the page can follow any more: say so, and let nothing be changed in vain.
function lost(root) {
  if (root.querySelector(".lost")) return;
  const words = document.createElement("div");
  words.className = "lost";
  words.setAttribute("role", "alert");
  words.dataset.testid = "lost";
  words.textContent = "The connection to the explorer is lost. What you see stays; reload the page to begin again.";
  root.prepend(words);
  for (const part of root.querySelectorAll(".header, .machine, .atlas")) part.inert = true;
}

export function render({ model, view, el }) {
  const root = document.createElement("div");
  root.className = "explorer";
  root.append(area("header", "header", model.get_child("header")));
  root.append(area("aside", "machine", model.get_child("machine"), "The machine"));
  const main = document.createElement("main");
  main.append(area("section", "strip", model.get_child("strip"), "Verdict"));
  for (const name of CARDS) {
    main.append(area("section", `card ${name}`, model.get_child(name), NAMES[name]));
  }
  root.append(main);
  el.append(root);
  view.model.document.on_event("connection_lost", () => lost(root));
  // For tests and benchmarks: which change of the desk is on the screen.
  model.on("msg:custom", (numbers) => Object.assign(root.dataset, numbers));
}
