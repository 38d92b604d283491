"use strict";
// The page: figures are drawn when they come near, move together, and follow light and dark.
const figures = [];
const KINDS = { plot: PlotFigure, specimen: SpecimenFigure };

for (const element of document.querySelectorAll("figure[data-name]")) {
  const data = JSON.parse(document.getElementById(`data-${element.dataset.name}`).textContent);
  figures.push(new KINDS[data.drawn_by](element, data));
}

const say = text => { document.getElementById("said").textContent = text; };

/** Move one slider, and those linked to it. */
function moveTogether(moved, frame) {
  const { label } = moved.frames[frame];
  moved.show(moved.family, label);
  if (moved.data.linked) {
    for (const other of figures) {
      if (other !== moved && other.data.linked === moved.data.linked) other.showLabel(label);
    }
  }
}

/** Show a state wherever states are shown. */
function chooseState(label) {
  const shown = figures.filter(each => each.data.linked === "state" && each.showLabel(label));
  say(shown.length ? `Shown: ${label}` : `${label} was not probed in these directions`);
  shown[0]?.element.scrollIntoView({ block: "center" });
}

for (const button of document.querySelectorAll("button[data-state]")) {
  button.addEventListener("click", () => chooseState(button.dataset.state));
}

const near = new IntersectionObserver(entries => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    near.unobserve(entry.target);
    figures.find(each => each.element === entry.target).draw();
  }
}, { rootMargin: "300px" });
for (const figure of figures) near.observe(figure.element);

/** Light or dark as the reader's system has it, until the button says otherwise. */
const dark = matchMedia("(prefers-color-scheme: dark)");
const button = document.getElementById("theme");
function dress(isDark, redraw = true) {
  document.documentElement.dataset.theme = isDark ? "dark" : "light";
  button.textContent = isDark ? "Light" : "Dark";
  button.setAttribute("aria-pressed", String(isDark));
  if (redraw) for (const figure of figures) if (figure.isDrawn) figure.draw();
}
let chosen = dark.matches;
dress(chosen, false);
dark.addEventListener("change", event => dress(chosen = event.matches));
button.addEventListener("click", () => dress(chosen = !chosen));
addEventListener("beforeprint", () => { dress(false, false); for (const figure of figures) figure.draw(); });
addEventListener("afterprint", () => dress(chosen));

/** Tables that can be reduced to the rows with one value in a column. */
for (const table of document.querySelectorAll("table[data-filter]")) {
  const column = [...table.tHead.rows[0].cells].findIndex(cell => cell.textContent === table.dataset.filter);
  const rows = [...table.tBodies[0].rows];
  const values = [...new Set(rows.map(row => row.cells[column].textContent))];
  const box = document.createElement("div");
  box.className = "controls";
  table.parentElement.before(box);
  const select = labelled(box, `Show where ${table.dataset.filter} is`, chooser([["", "anything"], ...values.map(each => [each, each])]));
  select.addEventListener("change", () => {
    for (const row of rows) row.hidden = select.value !== "" && row.cells[column].textContent !== select.value;
  });
}
