// The part in three dimensions: faces with their colours, edges, marked creases, and the goal laid over it.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Group, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, MeshBasicMaterial, ShaderMaterial, Vector3,
} from "three";
import { COLOUR, heatShare, scale } from "./palette.js";

const colour = (rgb) => new Color(...rgb);

/**
 * A lit material of which the back is a little warmer in tone, so that the sides of the sheet are told apart. Light is
 * worked out at corners only, one normal to a face, which is four times faster than per pixel where the processor draws.
 */
export function twoSided(options) {
  return new ShaderMaterial({
    side: DoubleSide,
    uniforms: { opacity: { value: 1 } },
    vertexShader: `
      attribute vec3 color;
      varying vec3 vFront, vBack;
      void main() {
        vec3 n = normalize(normalMatrix * normal);
        float side = dot(n, vec3(-0.36, 0.48, 0.80));
        vFront = color * (0.50 + 0.56 * (0.5 + 0.5 * side));
        vBack = color * vec3(0.98, 0.91, 0.79) * (0.50 + 0.56 * (0.5 - 0.5 * side));
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `
      uniform float opacity;
      varying vec3 vFront, vBack;
      void main() { gl_FragColor = vec4(gl_FrontFacing ? vFront : vBack, opacity); }`,
    ...options,
  });
}

/** A straight bar between two points, to mark an edge more boldly than a line of one pixel. */
class Bar extends Mesh {
  constructor(rgb) {
    super(new BoxGeometry(1, 1, 1), new MeshBasicMaterial({ color: colour(rgb) }));
    this.matrixAutoUpdate = false;
  }

  put(a, b, width) {
    const along = new Vector3().subVectors(b, a), length = along.length() || 1e-9;
    const up = Math.abs(along.z) > 0.9 * length ? new Vector3(1, 0, 0) : new Vector3(0, 0, 1);
    const x = along.divideScalar(length), y = new Vector3().crossVectors(up, x).normalize();
    const z = new Vector3().crossVectors(x, y);
    const middle = new Vector3().addVectors(a, b).multiplyScalar(0.5);
    this.matrix.makeBasis(x.clone().multiplyScalar(length), y.multiplyScalar(width), z.multiplyScalar(width));
    this.matrix.premultiply(new Matrix4().makeTranslation(middle.x, middle.y, middle.z));
    this.matrixWorldNeedsUpdate = true;
    this.visible = true;
  }
}

export class Part extends Group {
  constructor(plan, timeline, goal) {
    super();
    this.plan = plan;
    this.timeline = timeline;
    this.count = timeline.faceCount;
    this.panel = new Set(plan.panel);
    this.blocked = new Map(plan.blocked.map((b) => [b.face, b]));
    this.width = 0.006 * Math.hypot(span(plan.vertices, 0), span(plan.vertices, 1));
    this.position_ = new BufferAttribute(new Float32Array(9 * this.count), 3).setUsage(DynamicDrawUsage);
    this.colour_ = new BufferAttribute(new Float32Array(9 * this.count), 3).setUsage(DynamicDrawUsage);
    const shape = new BufferGeometry();
    this.normal_ = new BufferAttribute(new Float32Array(9 * this.count), 3).setUsage(DynamicDrawUsage);
    shape.setAttribute("position", this.position_).setAttribute("color", this.colour_).setAttribute("normal", this.normal_);
    this.mesh = new Mesh(shape, twoSided({ polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    this.mesh.frustumCulled = false;
    this.add(this.mesh, this.edges(this.position_, COLOUR.edge, 1));
    this.goal = new Group();
    this.goal.visible = false;
    const placed = new BufferAttribute(new Float32Array(goal), 3), over = new BufferGeometry();
    over.setAttribute("position", placed);
    const glass = new MeshBasicMaterial({
      color: colour(COLOUR.goal), transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false,
    });
    this.goal.add(new Mesh(over, glass), this.edges(placed, COLOUR.goal, 0.9));
    this.add(this.goal);
    this.bars = plan.blocked.map((b) => [b.face, new Bar(COLOUR.bad)]);
    this.marked = new Bar(COLOUR.picked);
    this.burning = new Bar(COLOUR.hot);
    this.marked.visible = this.burning.visible = false;
    this.add(...this.bars.map(([, bar]) => bar), this.marked, this.burning);
    this.heated = this.cornersAtCreases();
  }

  edges(positions, rgb, opacity) {
    const index = [];
    for (let f = 0; f < this.count; f++) for (let k = 0; k < 3; k++) index.push(3 * f + k, 3 * f + ((k + 1) % 3));
    const shape = new BufferGeometry();
    shape.setAttribute("position", positions).setIndex(index);
    const lines = new LineSegments(
      shape, new LineBasicMaterial({ color: colour(rgb), transparent: opacity < 1, opacity }),
    );
    lines.frustumCulled = false;
    return lines;
  }

  /** For every crease the corners (three to a face) that lie on it, on both of its faces. */
  cornersAtCreases() {
    const { faces, creaseOf, parent, slot } = this.plan, found = new Map();
    creaseOf.forEach((crease, face) => {
      if (crease < 0) return;
      const mine = [3 * face + slot[face], 3 * face + ((slot[face] + 1) % 3)];
      const ends = new Set(mine.map((at) => faces[at]));
      const theirs = [0, 1, 2].map((k) => 3 * parent[face] + k).filter((at) => ends.has(faces[at]));
      found.set(crease, [...mine, ...theirs]);
    });
    return found;
  }

  corner(at) {
    return new Vector3().fromBufferAttribute(this.position_, at);
  }

  hinge(face) {
    const k = this.plan.slot[face];
    return [this.corner(3 * face + k), this.corner(3 * face + ((k + 1) % 3))];
  }

  /** Move the faces to these corners and colour them. */
  update(corners, state, look) {
    this.position_.array.set(corners);
    this.position_.needsUpdate = true;
    this.upright(corners);
    this.paint(state, look);
    for (const [face, bar] of this.bars) bar.put(...this.hinge(face), 1.1 * this.width);
    this.burning.visible = this.marked.visible = false;
    if (state.active >= 0) this.burning.put(...this.hinge(state.active), 1.2 * this.width);
    if (look.crease >= 0) this.marked.put(...this.hinge(this.timeline.faceOf.get(look.crease)), 1.7 * this.width);
    this.goal.visible = look.goal;
  }

  /** One normal to a face, at its three corners. */
  upright(p) {
    const out = this.normal_.array;
    for (let i = 0; i < p.length; i += 9) {
      const [ax, ay, az] = [p[i + 3] - p[i], p[i + 4] - p[i + 1], p[i + 5] - p[i + 2]];
      const [bx, by, bz] = [p[i + 6] - p[i], p[i + 7] - p[i + 1], p[i + 8] - p[i + 2]];
      const n = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
      for (let k = 0; k < 9; k++) out[i + k] = n[k % 3];
    }
    this.normal_.needsUpdate = true;
  }

  paint(state, look) {
    const out = this.colour_.array, { timeline } = this;
    for (let f = 0; f < this.count; f++) {
      let rgb = this.panel.has(f) ? COLOUR.base : this.blocked.has(f) ? COLOUR.blocked : COLOUR.face;
      if (look.mode === "order") rgb = orderColour(timeline, this.plan.creaseOf[f]) ?? COLOUR.face;
      if (f === state.active && look.mode !== "error") rgb = COLOUR.active;
      if (f === look.face) rgb = COLOUR.picked;
      for (let k = 0; k < 3; k++) {
        const at = 3 * f + k;
        const mine = look.mode === "error" && f !== look.face ? scale("error", look.errors[at] / look.largest) : rgb;
        out.set(mine, 3 * at);
      }
    }
    if (look.mode === "heat") this.glow(timeline.warmth(state), look.face);
    this.colour_.needsUpdate = true;
  }

  glow(warm, picked) {
    const hottest = new Map();
    for (const [crease, celsius] of warm) {
      if (celsius < 25) continue;
      for (const at of this.heated.get(crease)) hottest.set(at, Math.max(hottest.get(at) ?? 0, celsius));
    }
    for (const [at, celsius] of hottest) {
      if (Math.floor(at / 3) !== picked) this.colour_.array.set(scale("heat", heatShare(celsius)), 3 * at);
    }
  }
}

/** Colour of a crease by its place in the order of folds; null if it is never folded. */
export function orderColour(timeline, crease) {
  const place = timeline.orderOf.get(crease);
  return place === undefined ? null : scale("order", place / Math.max(timeline.turn.length - 1, 1));
}

/** Extent of every second number of a list. */
export function span(list, from) {
  let low = Infinity, high = -Infinity;
  for (let i = from; i < list.length; i += 2) { low = Math.min(low, list[i]); high = Math.max(high, list[i]); }
  return high - low;
}
