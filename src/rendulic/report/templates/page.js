"use strict";
// The page: figures are drawn when they come near, move together, and follow light and dark.
const KINDS = { plot: PlotFigure, specimen: SpecimenFigure };

for (const element of document.querySelectorAll("figure[data-name]")) {
  const data = JSON.parse(document.getElementById(`data-${element.dataset.name}`).textContent);
  figures.push(new KINDS[data.drawn_by](element, data));
}

for (const row of document.querySelectorAll("button[data-state]")) {
  row.addEventListener("click", () => chooseState(row.dataset.state));
}

const near = new IntersectionObserver(entries => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    near.unobserve(entry.target);
    figures.find(each => each.element === entry.target).draw();
  }
}, { rootMargin: "300px" });
for (const figure of figures) near.observe(figure.element);

// on paper all figures are shown, dark on light
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
  const select = labelled(box, `Rows by ${table.dataset.filter}`, chooser([["", "all"], ...values.map(each => [each, each])]));
  select.addEventListener("change", () => {
    for (const row of rows) row.hidden = select.value !== "" && row.cells[column].textContent !== select.value;
  });
}
