// What the page says about a moment and about what is picked.

const RAD = Math.PI / 180;

export const degrees = (value) => `${(Math.round(10 * value) / 10 + 0).toFixed(1)}°`;

/** A duration as people say it, as on the command line. */
export function duration(seconds) {
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds), two = (n) => String(n).padStart(2, "0");
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${two(whole % 60)} s`;
  return `${Math.floor(whole / 3600)} h ${two(Math.floor((whole % 3600) / 60))} min`;
}

export function stepText(timeline, time) {
  if (time <= 0) return "flat sheet";
  if (time >= timeline.length) return "finished";
  return timeline.steps[Math.min(Math.ceil(time) - 1, timeline.length - 1)].text;
}

export function rotaryText(state) {
  const turned = Math.round(state.rotary / RAD);
  const side = { 0: "top side up", 180: "bottom side up" }[turned] ?? "tilted";
  return `rotary ${turned}°, ${side}`;
}

/** One line about a picked face or crease. */
export function pickedText(plan, timeline, face, crease, angleDegrees) {
  const own = crease >= 0 ? crease : plan.creaseOf[face];
  const name = crease >= 0 ? `crease ${crease}, turns face ${timeline.faceOf.get(crease)}` : `face ${face}`;
  if (own < 0) return `${name}: the base face, it stays where it is`;
  const place = timeline.orderOf.get(own), wanted = plan.wanted[own];
  const turns = crease >= 0 ? "" : `, turned by crease ${own}`;
  if (Math.abs(wanted) < 0.05) return `${name}${turns}: a flat joint, never folded`;
  const order = place === undefined ? "never folded" : `fold ${place + 1} of ${timeline.turn.length}`;
  return `${name}${turns}: ${wanted > 0 ? "valley" : "mountain"}, now ${degrees(angleDegrees)} of ${degrees(wanted)}, ${order}`;
}
