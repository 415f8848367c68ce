// The state of part, sheet and machine at a moment of the plan. Time is counted in steps: 3.5 is half of the fourth.

const RAD = Math.PI / 180;

export const ease = (f) => f * f * (3 - 2 * f);

export class Timeline {
  constructor(plan) {
    this.plan = plan;
    this.steps = plan.steps;
    this.length = plan.steps.length;
    this.faceCount = plan.faces.length / 3;
    this.faceOf = new Map();
    plan.creaseOf.forEach((crease, face) => { if (crease >= 0) this.faceOf.set(crease, face); });
    this.foldsOf = new Map();
    this.clock = new Float64Array(this.length + 1);
    this.goneAt = new Int32Array(plan.sheet.faces.length / 3).fill(this.length + 1);
    plan.steps.forEach((step, i) => {
      this.clock[i + 1] = this.clock[i] + (step.seconds ?? 0);
      if (step.op === "fold") this.foldsOf.set(step.crease, [...(this.foldsOf.get(step.crease) ?? []), i]);
      if (step.op === "clip") for (const piece of step.faces) this.goneAt[piece] = i;
    });
    this.turn = [...this.foldsOf.keys()];
    this.orderOf = new Map(this.turn.map((crease, i) => [crease, i]));
  }

  /** Machine time in s at a moment. */
  secondsAt(time) {
    const i = Math.min(Math.floor(time), this.length - 1);
    return i < 0 ? 0 : this.clock[i] + (this.clock[i + 1] - this.clock[i]) * Math.min(time - i, 1);
  }

  /** Angles (rad, by child face), rotary (rad), what is cut, bent, falling, and what the beam does. */
  at(time) {
    const done = Math.min(Math.floor(time), this.length), part = time - done;
    const state = {
      time, done, angles: new Float64Array(this.faceCount), rotary: 0, active: -1, share: 0, step: null,
      falling: -1, bends: [], cutting: null, release: 0,
    };
    for (let i = 0; i <= done && i < this.length; i++) {
      const step = this.steps[i], now = i === done, f = now ? part : 1;
      if (now && f <= 0) break;
      if (now) { state.step = step; state.share = f; }
      switch (step.op) {
        case "fold":
          state.angles[step.face] = (step.from + (step.to - step.from) * f) * RAD;
          if (now) state.active = step.face;
          break;
        case "rotate": state.rotary += (step.to * RAD - state.rotary) * ease(f); break;
        case "clip": if (now) state.falling = i; break;
        case "bend": state.bends.push([i, step.to * RAD * f]); break;
        case "release": state.release = f; // falls through: it is a cut, too
        case "cut": if (now) state.cutting = i; break;
      }
    }
    return state;
  }

  /** Goal angles in rad by child face. */
  wanted() {
    const angles = new Float64Array(this.faceCount);
    for (const [crease, degrees] of Object.entries(this.plan.wanted)) {
      angles[this.faceOf.get(Number(crease))] = degrees * RAD;
    }
    return angles;
  }

  /** Temperature of every crease that is warm, in °C: by the process while it is burnt, cooling alone afterwards. */
  warmth(state) {
    const warm = new Map(), now = this.secondsAt(state.time), ages = this.plan.ages ?? [];
    const last = Math.min(state.done, this.length - 1);
    for (let i = 0; i <= last; i++) {
      const step = this.steps[i];
      if (step.op !== "fold" || !step.start) continue;
      if (i === state.done) {
        if (state.share > 0) warm.set(step.crease, step.start[0] + (step.start[1] - step.start[0]) * state.share);
        continue;
      }
      warm.set(step.crease, cooled(ages, step.after, now - this.clock[i + 1]));
    }
    return warm;
  }
}

/** Temperature at an age between the ages where it is known; beyond the last it only falls. */
function cooled(ages, temperatures, age) {
  let k = 0;
  while (k < ages.length - 1 && ages[k + 1] <= age) k++;
  if (k === ages.length - 1) return Math.min(temperatures[k], 20 + (temperatures[k] - 20) * (ages[k] / Math.max(age, ages[k])));
  const f = (age - ages[k]) / (ages[k + 1] - ages[k]);
  return temperatures[k] + (temperatures[k + 1] - temperatures[k]) * Math.max(f, 0);
}
