// formulas that the build left as TeX, drawn by the copy of KaTeX beside this file
document.addEventListener("DOMContentLoaded", () => {
  for (const element of document.querySelectorAll(".arithmatex")) {
    const tex = element.textContent.trim();
    const displayMode = tex.startsWith("\\[");
    katex.render(tex.slice(2, -2), element, { displayMode, throwOnError: false });
  }
});
