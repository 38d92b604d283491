"use strict";
// Grains and contacts in three dimensions, from their centres, radii and ends.

/** Vertices and faces of a unit sphere: an octahedron, each face divided in four. */
function unitSphere(divisions) {
  let vertices = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
  let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
  for (let round = 0; round < divisions; round++) {
    const middles = new Map(), finer = [];
    const middle = (a, b) => {
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      if (!middles.has(key)) {
        const sum = vertices[a].map((value, axis) => value + vertices[b][axis]);
        const size = Math.hypot(...sum);
        middles.set(key, vertices.push(sum.map(value => value / size)) - 1);
      }
      return middles.get(key);
    };
    for (const [a, b, c] of faces) {
      const [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
      finer.push([a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]);
    }
    faces = finer;
  }
  return { vertices, faces };
}

/** Signed values drawn together at the middle, so that small ones are seen, too. */
const rooted = (value, largest) => Math.sign(value) * Math.sqrt(Math.abs(value) / largest);
const largestOf = values => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0) || 1;
const AT_ONCE = 1200; // grains that are shown first

class SpecimenFigure extends PlotFigure {
  addControls() {
    const { hasWork, grains, contacts } = this.data.families[0].frames[0].data[0];
    const draw = () => this.isDrawn && this.draw();
    const select = (text, options) => {
      const control = labelled(this.box, text, chooser(options));
      control.addEventListener("change", draw);
      return control;
    };
    const colours = [["force", "normal force"], ["kind", "class of contact"]];
    this.colour = select("Colour by", hasWork ? [["w2", "second-order work"], ...colours] : colours);
    this.what = select("Show", [["both", "grains and contacts"], ["contacts", "contacts"], ["grains", "grains"]]);
    this.sign = select("Second-order work", [["all", "of any sign"], ["-", "negative only"], ["+", "positive only"]]);
    this.sign.parentElement.hidden = !hasWork;
    const most = Math.max(grains.x.length, contacts.w2.length);
    this.count = document.createElement("input");
    Object.assign(this.count, { type: "range", min: 10, max: most, value: Math.min(most, AT_ONCE) });
    labelled(this.box, hasWork ? "Largest work first, at most" : "Largest force first, at most", this.count);
    this.told = document.createElement("output");
    this.count.after(this.told);
    this.count.addEventListener("input", () => { this.told.textContent = this.count.value; });
    this.count.addEventListener("change", draw);
    this.told.textContent = this.count.value;
    const turning = document.createElement("span");
    this.box.append(turning);
    for (const [text, around, up] of [["Turn left", -0.3, 0], ["Turn right", 0.3, 0], ["Tilt up", 0, 0.2], ["Tilt down", 0, -0.2]]) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: text });
      button.addEventListener("click", () => this.turn(around, up));
      turning.append(button, " ");
    }
  }

  tellControls() {}

  turn(around, up) {
    const { x, y, z } = this.plot._fullLayout.scene.camera.eye;
    const size = Math.hypot(x, y, z), height = Math.max(-1.45, Math.min(1.45, Math.asin(z / size) + up));
    const angle = Math.atan2(y, x) + around, flat = size * Math.cos(height);
    const eye = { x: flat * Math.cos(angle), y: flat * Math.sin(angle), z: size * Math.sin(height) };
    return Plotly.relayout(this.plot, { "scene.camera.eye": eye });
  }

  traces() {
    const data = this.data.families[0].frames[0].data[0];
    const most = Number(this.count.value), sign = this.sign.value;
    const kept = values => values.map((value, k) => k).filter(k => sign === "all" || (sign === "-" ? values[k] < 0 : values[k] > 0)).slice(0, most);
    const shown = [];
    if (this.what.value !== "contacts") shown.push(this.grains(data.grains, kept(data.grains.w2)));
    if (this.what.value !== "grains") shown.push(...this.contacts(data, kept(data.contacts.w2)));
    return shown;
  }

  scale(title, signed) {
    const words = { title: { text: title, side: "right" }, thickness: 14, len: 0.7 };
    return signed
      ? { colorscale: [[0, "--negative"], [0.5, "--neutral"], [1, "--positive"]], cmin: -1, cmax: 1,
          colorbar: { ...words, tickvals: [-1, 0, 1], ticktext: ["most negative", "0", "most positive"] } }
      : { colorscale: "Cividis", cmin: 0, colorbar: words };
  }

  grains({ x, y, z, r, w2 }, kept) {
    const sphere = unitSphere(kept.length > 1500 ? 1 : 2), mesh = { x: [], y: [], z: [], i: [], j: [], k: [] };
    const intensity = [], largest = largestOf(w2), byWork = this.colour.value === "w2";
    for (const g of kept) {
      const at = mesh.x.length;
      for (const [u, v, w] of sphere.vertices) {
        mesh.x.push(x[g] + r[g] * u);
        mesh.y.push(y[g] + r[g] * v);
        mesh.z.push(z[g] + r[g] * w);
        intensity.push(rooted(w2[g], largest));
      }
      for (const [a, b, c] of sphere.faces) { mesh.i.push(at + a); mesh.j.push(at + b); mesh.k.push(at + c); }
    }
    const colour = byWork ? { ...this.scale("work of grains (root)", true), intensity } : { color: "--muted", showscale: false };
    const both = this.what.value === "both";
    return { type: "mesh3d", ...mesh, ...colour, opacity: both ? 0.12 : 1, hoverinfo: "skip", name: "grains",
      showscale: byWork && !both, lighting: { ambient: 0.7, diffuse: 0.5, specular: 0.05 } };
  }

  contacts({ contacts, classes }, kept) {
    const lines = which => {
      const ends = { x: [], y: [], z: [], text: [] };
      for (const c of which) {
        const word = `${classes[contacts.kind[c]]}<br>w2 ${contacts.w2[c].toPrecision(3)} J<br>force ${contacts.force[c]} of the mean`;
        for (const end of [contacts.from[c], contacts.to[c]]) {
          ends.x.push(end[0]); ends.y.push(end[1]); ends.z.push(end[2]); ends.text.push(word);
        }
        ends.x.push(null); ends.y.push(null); ends.z.push(null); ends.text.push("");
      }
      return { type: "scatter3d", mode: "lines", ...ends, hovertemplate: "%{text}<extra></extra>", showlegend: false };
    };
    if (this.colour.value === "kind") {
      return classes.map((name, k) => {
        const own = kept.filter(c => contacts.kind[c] === k);
        return { ...lines(own), name: `${name} (${own.length})`, showlegend: true, line: { width: 5, color: `--c${k}` } };
      }).filter(trace => trace.x.length);
    }
    const byWork = this.colour.value === "w2", largest = largestOf(contacts.w2);
    const value = c => byWork ? rooted(contacts.w2[c], largest) : contacts.force[c];
    const color = kept.flatMap(c => [value(c), value(c), value(c)]);
    const scale = this.scale(byWork ? "work of contacts (root)" : "force over its mean", byWork);
    return [{ ...lines(kept), name: "contacts", line: { width: 5, color, showscale: true, ...scale } }];
  }
}
