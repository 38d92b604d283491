"use strict";
// Figures of plain data: colours by name from the style sheet, one family and one frame at a time.
const figures = []; // of the page

const colourOf = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** The value with every name of a colour replaced by the colour. */
function coloured(value) {
  if (typeof value === "string") return value.startsWith("--") ? colourOf(value) : value;
  // long lists of numbers have no colours; pairs of a colour scale begin with a number, too
  if (Array.isArray(value)) return typeof value[0] === "number" && typeof value.at(-1) === "number" ? value : value.map(coloured);
  if (value && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, coloured(inner)]));
  }
  return value;
}

/** What all layouts share, in the colours of now. */
function theme() {
  const [ink, muted, line, paper] = ["--ink", "--muted", "--line", "--paper"].map(colourOf);
  const axis = { gridcolor: line, linecolor: muted, zerolinecolor: muted, tickcolor: muted, automargin: true };
  const bare = { gridcolor: line, linecolor: muted, color: muted };
  return { layout: {
    font: { family: "system-ui, sans-serif", size: 13, color: ink },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    margin: { l: 60, r: 16, t: 30, b: 50 }, hovermode: "closest", dragmode: "zoom",
    hoverlabel: { bgcolor: paper, bordercolor: muted, font: { color: ink } },
    xaxis: axis, yaxis: axis,
    polar: { bgcolor: "rgba(0,0,0,0)", angularaxis: bare, radialaxis: bare },
    scene: { dragmode: "turntable", xaxis: bare, yaxis: bare, zaxis: bare },
  } };
}

/** A control with its label, into a box. */
function labelled(box, text, control) {
  const label = document.createElement("label");
  label.append(text, control);
  box.append(label);
  return control;
}

function chooser(options) {
  const select = document.createElement("select");
  for (const [value, text] of options) select.append(new Option(text, value));
  return select;
}

class PlotFigure {
  constructor(element, data) {
    this.element = element;
    this.data = data;
    this.plot = element.querySelector(".plot");
    this.box = element.querySelector(".controls");
    this.family = 0;
    this.frame = this.frameAt(data.start);
    this.isDrawn = false;
    this.addControls();
  }

  get frames() { return this.data.families[this.family].frames; }
  frameAt(index) { return index < 0 ? this.frames.length + index : index; }

  addControls() {
    const { families } = this.data;
    if (families.length > 1) {
      this.select = labelled(this.box, this.data.choice, chooser(families.map((each, k) => [k, each.label])));
      this.select.addEventListener("change", () => this.show(Number(this.select.value), this.frames[this.frame].label));
    }
    if (families.some(each => each.frames.length > 1)) {
      this.slider = document.createElement("input");
      Object.assign(this.slider, { type: "range", min: 0, step: 1 });
      labelled(this.box, this.data.slide, this.slider);
      this.told = document.createElement("output");
      this.slider.after(this.told);
      this.slider.addEventListener("input", () => moveTogether(this, Number(this.slider.value)));
    }
    this.tellControls();
  }

  tellControls() {
    if (this.select) this.select.value = this.family;
    if (!this.slider) return;
    const { label } = this.frames[this.frame];
    Object.assign(this.slider, { max: this.frames.length - 1, value: this.frame });
    this.slider.setAttribute("aria-valuetext", label);
    this.told.textContent = label;
  }

  /** Show a family, at the frame of this label if it has it. */
  show(family, label) {
    this.family = family;
    const found = this.frames.findIndex(each => each.label === label);
    this.frame = found >= 0 ? found : Math.min(this.frame, this.frames.length - 1);
    this.tellControls();
    if (this.isDrawn) this.draw();
  }

  /** Show the frame of this label, in the present family or the first that has it. */
  showLabel(label) {
    const has = family => family.frames.some(each => each.label === label);
    const family = has(this.data.families[this.family]) ? this.family : this.data.families.findIndex(has);
    if (family >= 0) this.show(family, label);
    return family >= 0;
  }

  /** The same figure with newer data; what the reader chose stays. */
  renew(data) {
    const { label } = this.frames[this.frame], family = this.data.families[this.family].label;
    const follows = this.frame === this.frames.length - 1;
    this.data = data;
    this.element.querySelector("figcaption").textContent = data.caption;
    this.box.replaceChildren();
    this.select = this.slider = undefined;
    this.family = Math.max(data.families.findIndex(each => each.label === family), 0);
    this.frame = this.frames.length - 1;
    this.addControls();
    this.show(this.family, follows ? this.frames.at(-1).label : label);
  }

  get isNarrow() { return this.plot.clientWidth < NARROW; }

  traces() { return [...this.data.fixed, ...this.frames[this.frame].data]; }

  draw() {
    this.isDrawn = true;
    const layout = { ...coloured(this.data.layout), template: theme(), autosize: true, uirevision: this.family };
    const traces = coloured(this.traces());
    this.drawnNarrow = this.isNarrow;
    if (this.isNarrow) narrow(layout, traces);
    return Plotly.react(this.plot, traces, layout, {
      responsive: true, displaylogo: false, showTips: false,
      modeBarButtonsToRemove: ["select2d", "lasso2d", "toImage"],
    }).then(() => this.listen());
  }

  listen() {
    if (this.listens) return;
    this.listens = true;
    this.plot.on("plotly_click", ({ event }) => {
      const state = this.stateAt(event.clientX, event.clientY);
      if (state) chooseState(state);
    });
  }

  /** The state whose mark is nearest, if one is near; plotly itself may point at the curve beside it. */
  stateAt(x, y) {
    const box = this.plot.getBoundingClientRect(), layout = this.plot._fullLayout;
    let nearest, least = 14; // pixels
    for (const { name, customdata, x: across, y: up, xaxis, yaxis } of this.plot._fullData) {
      if (name !== "state") continue;
      const [right, down] = [xaxis, yaxis].map(axis => layout[axis.replace(/^[xy]/, "$&axis")]);
      customdata.forEach((state, k) => {
        const far = Math.hypot(box.left + right._offset + right.d2p(across[k]) - x, box.top + down._offset + down.d2p(up[k]) - y);
        if (far < least) [nearest, least] = [state, far];
      });
    }
    return nearest;
  }
}

const NARROW = 520; // pixels

/** For narrow screens: panels and colour bars below each other, short words, a camera farther away. */
function narrow(layout, traces) {
  if (layout.grid) {
    const count = layout.grid.rows * layout.grid.columns;
    layout.grid = { ...layout.grid, rows: count, columns: 1, ygap: 0.3 };
    layout.height = 300 * count;
  }
  const polars = Object.keys(layout).filter(key => key.startsWith("polar"));
  for (const key of polars) {
    const axis = layout[key].angularaxis;
    axis.ticktext = axis.ticktext.map(text => text.split(" ")[0]);
  }
  if (polars.length) Object.assign(layout, { height: 460, margin: { l: 40, r: 40, t: 30, b: 30 } });
  if (polars.length > 1) { // each with its heading, which is the annotation of the same number
    const high = 1 / polars.length;
    layout.height *= polars.length;
    polars.forEach((key, k) => {
      const top = 1 - k * high;
      layout[key].domain = { x: [0.05, 0.95], y: [top - 0.92 * high, top - 0.12 * high] };
      Object.assign(layout.annotations[k], { x: 0.5, y: top });
    });
  }
  if (layout.scene) {
    const { eye } = layout.scene.camera;
    layout.scene.camera.eye = Object.fromEntries(Object.entries(eye).map(([axis, value]) => [axis, 1.35 * value]));
    const below = { orientation: "h", y: -0.02, yanchor: "top", len: 0.9 };
    for (const { colorbar, marker, line } of traces) {
      for (const bar of [colorbar, marker?.colorbar, line?.colorbar]) if (bar) Object.assign(bar, below, { title: { ...bar.title, side: "top" } });
    }
    layout.margin = { l: 0, r: 0, t: 0, b: 70 };
  }
}

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

// made anew when the page has become narrow or wide: colour bars that change sides leave traces otherwise
addEventListener("resize", () => {
  for (const figure of figures) {
    if (!figure.isDrawn || figure.isNarrow === figure.drawnNarrow) continue;
    Plotly.purge(figure.plot);
    figure.listens = false;
    figure.draw();
  }
});

/** Show a state wherever states are shown. */
function chooseState(label) {
  const shown = figures.filter(each => each.data.linked === "state" && each.showLabel(label));
  const said = document.getElementById("said");
  if (said) said.textContent = shown.length ? `Shown: ${label}` : `${label} was not probed in these directions`;
  shown[0]?.element.scrollIntoView({ block: "center" });
}
