// Everything around the part that the machine sees: sheet with its clipped and bent pieces, cuts, tabs, rotary.
import {
  BufferAttribute, BufferGeometry, Color, Group, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, TorusGeometry, Vector3,
} from "three";
import { COLOUR } from "./palette.js";
import { span, twoSided } from "./part.js";
import { ease } from "./timeline.js";

const colour = (rgb) => new Color(...rgb);

function segments(numbers, rgb, opacity = 1) {
  const shape = new BufferGeometry();
  shape.setAttribute("position", new BufferAttribute(new Float32Array(numbers), 3));
  const lines = new LineSegments(
    shape, new LineBasicMaterial({ color: colour(rgb), transparent: opacity < 1, opacity }),
  );
  lines.frustumCulled = false;
  return lines;
}

/** Segments of polylines in the sheet plane: six numbers each. */
function pieces(paths) {
  const out = [];
  for (const p of paths) {
    for (let i = 2; i < p.length; i += 2) out.push(p[i - 2], p[i - 1], 0, p[i], p[i + 1], 0);
  }
  return out;
}

export class Sheet extends Group {
  constructor(plan, timeline) {
    super();
    this.plan = plan;
    this.timeline = timeline;
    this.radius = 0.5 * Math.hypot(span(plan.sheet.outline, 0), span(plan.sheet.outline, 1)) || 1;
    this.metal = new Group();
    this.add(this.metal);
    this.material = twoSided({ polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.lay();
    this.cuts();
    this.tabs();
  }

  /** Triangles in the order in which they go, the last to go first: what is left is a range of the mesh. */
  lay() {
    const { plan, timeline } = this, frame = new Set(plan.sheet.frame);
    const bent = new Set(plan.steps.flatMap((s) => (s.op === "bend" ? s.faces : [])));
    const all = Array.from(timeline.goneAt.keys()).filter((t) => !bent.has(t));
    all.sort((a, b) => timeline.goneAt[b] - timeline.goneAt[a] || a - b);
    this.lastSteps = all.map((t) => timeline.goneAt[t]);
    this.flat = new Mesh(this.triangles(all, frame), this.material);
    this.flat.frustumCulled = false;
    this.metal.add(this.flat);
    this.falling = new Mesh(this.flat.geometry.clone(), this.material.clone());
    this.falling.material.transparent = true;
    this.falling.frustumCulled = false;
    this.metal.add(this.falling);
    this.bent = new Map();
    plan.steps.forEach((step, i) => {
      if (step.op !== "bend") return;
      const mesh = new Mesh(this.triangles(step.faces, frame), this.material);
      mesh.matrixAutoUpdate = false;
      this.bent.set(i, mesh);
      this.metal.add(mesh);
    });
    const o = plan.sheet.outline;
    this.metal.add(segments(pieces([[...o, o[0], o[1]]]), COLOUR.edge));
  }

  triangles(members, frame) {
    const { vertices, faces } = this.plan.sheet;
    const place = new Float32Array(9 * members.length), tone = new Float32Array(9 * members.length);
    const up = new Float32Array(9 * members.length).map((_, i) => (i % 3 === 2 ? 1 : 0));
    members.forEach((t, i) => {
      for (let k = 0; k < 3; k++) {
        const v = 2 * faces[3 * t + k];
        place.set([vertices[v], vertices[v + 1], 0], 9 * i + 3 * k);
        tone.set(frame.has(t) ? COLOUR.frame : COLOUR.sheet, 9 * i + 3 * k);
      }
    });
    const shape = new BufferGeometry();
    shape.setAttribute("position", new BufferAttribute(place, 3)).setAttribute("color", new BufferAttribute(tone, 3));
    shape.setAttribute("normal", new BufferAttribute(up, 3));
    return shape;
  }

  cuts() {
    const numbers = [];
    this.cutEnd = [];
    for (const step of this.plan.steps) {
      if (step.op === "cut") numbers.push(...pieces(step.paths));
      this.cutEnd.push(numbers.length / 3);
    }
    this.done = segments(numbers, COLOUR.cut);
    this.now = segments(new Float32Array(6 * 4096), COLOUR.beam);
    this.metal.add(this.done);
    this.add(this.now);
  }

  tabs() {
    const wide = 0.008 * this.radius, place = [];
    for (const [ax, ay, bx, by] of this.plan.tabs) {
      const l = Math.hypot(bx - ax, by - ay) || 1e-9, nx = (-(by - ay) / l) * wide, ny = ((bx - ax) / l) * wide;
      const [p, q, r, s] = [[ax + nx, ay + ny], [bx + nx, by + ny], [bx - nx, by - ny], [ax - nx, ay - ny]];
      for (const [x, y] of [p, q, r, p, r, s]) place.push(x, y, 0);
    }
    const shape = new BufferGeometry();
    shape.setAttribute("position", new BufferAttribute(new Float32Array(place), 3));
    this.tab = new Mesh(shape, new MeshBasicMaterial({ color: colour(COLOUR.tab), side: 2 }));
    this.metal.add(this.tab);
  }

  /** Show the sheet as it is; returns where the beam cuts, in the sheet plane, or null. */
  update(state, shown) {
    const { plan, timeline } = this, free = ease(state.release);
    this.visible = shown && free < 1;
    if (!this.visible) return null;
    const left = this.lastSteps.findIndex((step) => step < state.done);
    const kept = left < 0 ? this.lastSteps.length : left;
    const falls = this.lastSteps.findIndex((step) => step <= state.falling);
    const whole = state.falling < 0 || falls < 0 ? kept : falls;
    this.flat.geometry.setDrawRange(0, 3 * whole);
    this.falling.visible = state.falling >= 0;
    if (this.falling.visible) {
      this.falling.geometry.setDrawRange(3 * whole, 3 * (kept - whole));
      const drop = Math.cos(state.rotary) < 0 ? 1 : -1;
      this.falling.position.z = 0.5 * drop * this.radius * state.share * state.share;
      this.falling.material.uniforms.opacity.value = 1 - state.share;
    }
    this.material.uniforms.opacity.value = 1 - free;
    this.material.transparent = free > 0;
    this.metal.position.z = -0.6 * this.radius * free * (Math.cos(state.rotary) < 0 ? -1 : 1);
    const bends = new Map(state.bends);
    for (const [step, mesh] of this.bent) {
      const [ax, ay, bx, by] = plan.steps[step].hinge, line = new Vector3(bx - ax, by - ay, 0).normalize();
      mesh.matrix.makeRotationAxis(line, bends.get(step) ?? 0);
      mesh.matrix.premultiply(new Matrix4().makeTranslation(ax, ay, 0));
      mesh.matrix.multiply(new Matrix4().makeTranslation(-ax, -ay, 0));
      mesh.matrixWorldNeedsUpdate = true;
    }
    const past = Math.min(state.done, this.cutEnd.length) - 1;
    this.done.geometry.setDrawRange(0, past < 0 ? 0 : this.cutEnd[past]);
    this.done.visible = free === 0;
    this.tab.visible = free === 0;
    return state.cutting === null ? this.stop() : this.burn(pieces(plan.steps[state.cutting].paths), state.share);
  }

  stop() {
    this.now.visible = false;
    return null;
  }

  burn(numbers, share) {
    const place = this.now.geometry.attributes.position, all = Math.min(numbers.length, place.array.length);
    const lengths = [];
    for (let i = 0; i < all; i += 6) lengths.push(Math.hypot(numbers[i + 3] - numbers[i], numbers[i + 4] - numbers[i + 1]));
    let rest = share * lengths.reduce((a, b) => a + b, 0), k = 0, end = [numbers[0], numbers[1], 0];
    for (; k < lengths.length && rest > 0; k++) {
      const at = 6 * k, f = Math.min(1, rest / (lengths[k] || 1e-9));
      end = [0, 1, 2].map((i) => numbers[at + i] + (numbers[at + 3 + i] - numbers[at + i]) * f);
      place.array.set([...numbers.slice(at, at + 3), ...end], at);
      rest -= lengths[k];
    }
    place.needsUpdate = true;
    this.now.geometry.setDrawRange(0, 2 * k);
    this.now.visible = true;
    return new Vector3(...end);
  }
}

/** The rotary: its axis, and a ring with a spoke at each end that turns with the sheet. */
export class Rotary extends Group {
  constructor(plan, radius) {
    super();
    const low = Math.min(...plan.sheet.outline.filter((_, i) => i % 2 === 0));
    const high = Math.max(...plan.sheet.outline.filter((_, i) => i % 2 === 0));
    const past = 0.14 * radius, ring = 0.13 * radius, [from, to] = [low - past, high + past];
    this.add(segments([from, 0, 0, low, 0, 0, high, 0, 0, to, 0, 0], COLOUR.machine));
    for (const x of [from, to]) {
      const chuck = new Mesh(
        new TorusGeometry(ring, 0.1 * ring, 10, 32), new MeshLambertMaterial({ color: colour(COLOUR.machine) }),
      );
      chuck.rotation.y = Math.PI / 2;
      chuck.position.x = x;
      this.add(chuck, segments([x, 0, 0, x, 0, 0.98 * ring], COLOUR.beam));
    }
  }
}
