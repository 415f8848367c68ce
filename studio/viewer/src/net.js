// The flat net beside the view: layers, colours, and which face or crease was clicked.
import { css, scale } from "./palette.js";
import { orderColour } from "./part.js";

export class Net {
  constructor(plan, timeline, picked) {
    this.plan = plan;
    this.timeline = timeline;
    this.root = document.getElementById("net");
    this.faces = new Map(), this.creases = new Map();
    for (const shape of this.root.querySelectorAll("[data-face]")) this.faces.set(Number(shape.dataset.face), shape);
    for (const line of this.root.querySelectorAll("[data-crease]")) this.creases.set(Number(line.dataset.crease), line);
    this.root.addEventListener("click", (event) => {
      const { face, crease } = event.target.dataset;
      if (crease !== undefined) picked({ crease: Number(crease), face: timeline.faceOf.get(Number(crease)) });
      else picked(face === undefined ? null : { face: Number(face), crease: -1 });
    });
    this.over = this.lay();
    for (const box of document.querySelectorAll("[data-layer]")) {
      box.checked = true;
      box.addEventListener("change", () => this.root.classList.toggle(`hide-${box.dataset.layer}`, !box.checked));
    }
  }

  /** Colour the faces as the view does. */
  paint(mode, errors, largest) {
    for (const [face, shape] of this.faces) {
      let rgb = null;
      if (mode === "order") rgb = orderColour(this.timeline, this.plan.creaseOf[face]);
      if (mode === "error") rgb = scale("error", (errors[3 * face] + errors[3 * face + 1] + errors[3 * face + 2]) / 3 / largest);
      shape.style.fill = rgb ? css(rgb) : "";
    }
  }

  mark(face, crease) {
    this.swap("picked", [this.faces.get(face), this.creases.get(crease)]);
  }

  /** A picture over the net for what changes while it plays: the net itself, which is large, is not drawn again. */
  lay() {
    const over = this.root.cloneNode(false), space = this.root.namespaceURI;
    for (const name of ["role", "tabindex", "aria-label"]) over.removeAttribute(name);
    over.id = "net-over";
    over.setAttribute("aria-hidden", "true");
    this.root.after(over);
    return over.appendChild(document.createElementNS(space, "line"));
  }

  /** Mark the crease that is folded now; -1: none. */
  burn(crease) {
    const line = this.creases.get(crease);
    this.over.style.display = line ? "" : "none";
    if (!line || this.over.dataset.burning === String(crease)) return;
    this.over.dataset.burning = crease;
    for (const name of ["x1", "y1", "x2", "y2"]) this.over.setAttribute(name, line.getAttribute(name));
  }

  swap(name, shapes) {
    for (const old of this.root.querySelectorAll(`.${name}`)) if (!shapes.includes(old)) old.classList.remove(name);
    for (const shape of shapes) shape?.classList.add(name);
  }
}
