// The legend of the open picture, and how much of it is known.

export function render({ model, el }) {
  const foot = document.createElement("div");
  foot.className = "foot";
  foot.innerHTML =
    '<ul class="legend" data-testid="legend" aria-label="Legend"></ul>' +
    '<span class="progress" data-testid="progress"></span>' +
    '<span class="note">Click: the machine goes there</span>';
  const [legend, progress] = foot.children;
  el.append(foot);

  function show() {
    const { chips = [], progress: said = "", note = "" } = model.state;
    legend.replaceChildren(...chips.map(([background, words]) => {
      const item = document.createElement("li");
      const swatch = document.createElement("i");
      swatch.style.background = background;
      swatch.setAttribute("aria-hidden", "true");
      item.append(swatch, words);
      return item;
    }));
    progress.textContent = said;
    foot.title = note;
  }
  model.on("state", show);
  show();
}
