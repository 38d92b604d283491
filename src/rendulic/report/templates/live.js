"use strict";
// Asks how far the study is, and now and then for the figures, which cost the machine that runs it some reading.
const SECONDS = 2, SECONDS_PER_FIGURES = 20;
let drawnAt = -1, shownAt = -Infinity;

/** Rows of plain text into the body of a table. */
function fill(id, rows) {
  const body = document.getElementById(id);
  body.replaceChildren(...rows.map(cells => {
    const row = document.createElement("tr");
    for (const cell of cells) row.insertCell().textContent = cell;
    return row;
  }));
  body.closest(".table").hidden = rows.length === 0;
}

const share = far => far && far[1] ? `${Math.round(100 * far[0] / far[1])} %, ${far[2]}` : "";

async function ask() {
  const told = document.getElementById("told");
  try {
    const answer = await fetch("/status.json");
    if (!answer.ok) throw new Error(await answer.text());
    const now = await answer.json();
    Object.assign(document.getElementById("progress"), { max: Math.max(now.total, 1), value: now.done });
    told.textContent = `${now.done} of ${now.total} units are done, ${now.running.length} running, ${now.n_failed} failed`;
    fill("kinds", now.kinds);
    fill("running", now.running.map(([label, far]) => [label, share(far)]));
    fill("failed", now.failed);
    const isTime = performance.now() - shownAt > 1000 * SECONDS_PER_FIGURES || now.done === now.total;
    if (now.done !== drawnAt && isTime) await showFigures(now.done);
  } catch (error) {
    told.textContent = `no answer: ${error.message}`;
  }
  setTimeout(ask, 1000 * SECONDS);
}

async function showFigures(done) {
  const answer = await fetch("/figures.json");
  if (!answer.ok) throw new Error(await answer.text());
  for (const data of await answer.json()) {
    const known = figures.find(each => each.element.dataset.name === data.name);
    if (known) known.renew(data);
    else figures.push(added(data));
  }
  [drawnAt, shownAt] = [done, performance.now()];
}

/** A new figure at the end of the page. */
function added(data) {
  const element = document.createElement("figure"), box = document.createElement("div"), plot = document.createElement("div");
  const caption = document.createElement("figcaption");
  element.dataset.name = data.name;
  box.className = "controls";
  plot.className = "plot";
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", data.caption);
  plot.style.minHeight = `${data.layout.height}px`;
  caption.textContent = data.caption;
  element.append(box, plot, caption);
  document.getElementById("figures").append(element);
  const figure = new PlotFigure(element, data);
  figure.draw();
  return figure;
}

ask();
