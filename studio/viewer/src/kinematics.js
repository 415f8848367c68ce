// Forward kinematics: where every face of the net is when its creases stand at given angles.
// A motion is twelve numbers: nine of a rotation, row by row, then three of a shift.

const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];

export function apply(m, x, y, z) {
  return [
    m[0] * x + m[1] * y + m[2] * z + m[9],
    m[3] * x + m[4] * y + m[5] * z + m[10],
    m[6] * x + m[7] * y + m[8] * z + m[11],
  ];
}

function compose(a, b) {
  const out = new Array(12);
  for (let r = 0; r < 3; r++) {
    const [x, y, z] = [a[3 * r], a[3 * r + 1], a[3 * r + 2]];
    for (let c = 0; c < 3; c++) out[3 * r + c] = x * b[c] + y * b[3 + c] + z * b[6 + c];
    out[9 + r] = x * b[9] + y * b[10] + z * b[11] + a[9 + r];
  }
  return out;
}

/** Right-handed turn about a line in the plane z = 0, from (sx, sy) to (ex, ey); Rodrigues' formula. */
function turnAbout(sx, sy, ex, ey, angle) {
  const l = Math.hypot(ex - sx, ey - sy), x = (ex - sx) / l, y = (ey - sy) / l;
  const c = Math.cos(angle), s = Math.sin(angle), v = 1 - c;
  const m = [c + x * x * v, x * y * v, y * s, x * y * v, c + y * y * v, -x * s, -y * s, x * s, c, 0, 0, 0];
  const p = apply(m, sx, sy, 0);
  m[9] = sx - p[0]; m[10] = sy - p[1]; m[11] = -p[2];
  return m;
}

/** Ends of the crease that turns a face, in the flat net: [sx, sy, ex, ey]. */
export function hingeOf(plan, face) {
  const k = plan.slot[face], v = plan.vertices;
  const a = 2 * plan.faces[3 * face + k], b = 2 * plan.faces[3 * face + ((k + 1) % 3)];
  return [v[a], v[a + 1], v[b], v[b + 1]];
}

/** Corners of all faces, 9 numbers each, in mm in the frame of the sheet; angles in rad by child face. */
export function cornersAt(plan, angles) {
  const count = plan.faces.length / 3, motions = new Array(count), out = new Float64Array(9 * count);
  for (const f of plan.order) {
    motions[f] = f === plan.base
      ? IDENTITY
      : compose(motions[plan.parent[f]], turnAbout(...hingeOf(plan, f), angles[f]));
    for (let k = 0; k < 3; k++) {
      const v = 2 * plan.faces[3 * f + k];
      out.set(apply(motions[f], plan.vertices[v], plan.vertices[v + 1], 0), 9 * f + 3 * k);
    }
  }
  return out;
}

/** The goal laid over the reached shape by the motion that the plan's data holds, and every corner's distance. */
export function errorsOf(plan, goal, reached) {
  const placed = new Float64Array(goal.length), error = new Float64Array(goal.length / 3);
  for (let i = 0; i < error.length; i++) {
    const p = apply(plan.fit, goal[3 * i], goal[3 * i + 1], goal[3 * i + 2]);
    placed.set(p, 3 * i);
    error[i] = Math.hypot(p[0] - reached[3 * i], p[1] - reached[3 * i + 1], p[2] - reached[3 * i + 2]);
  }
  return { placed, error, largest: Math.max(...error), rms: Math.sqrt(error.reduce((s, e) => s + e * e, 0) / error.length) };
}
