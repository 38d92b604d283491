"use strict";
// Light or dark as the reader's system has it, until the button says otherwise.
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
