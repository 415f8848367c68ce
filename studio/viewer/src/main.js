// The page of the report comes alive: data, view, net, table and controls are tied together here.
import { cornersAt, errorsOf } from "./kinematics.js";
import { Net } from "./net.js";
import { gradient, HEAT_C } from "./palette.js";
import { Player } from "./player.js";
import { Timeline } from "./timeline.js";
import { View } from "./view.js";
import { duration, pickedText, rotaryText, stepText } from "./words.js";

const el = (id) => document.getElementById(id);
const plan = JSON.parse(el("plan-data").textContent);
const timeline = new Timeline(plan);
const reached = cornersAt(plan, timeline.at(timeline.length).angles);
const goal = errorsOf(plan, cornersAt(plan, timeline.wanted()), reached);
const largest = Math.max(goal.largest, 1e-3);
const canvas = el("view"), HINT = el("picked-text").textContent;
const look = {
  mode: "heat", face: -1, crease: -1, sheet: true, beam: true, machine: true, goal: false, errors: goal.error, largest,
};
let state = timeline.at(timeline.length), corners = reached, view = null, markedRow = null;

try {
  view = new View(canvas, plan, timeline, goal.placed);
} catch {
  el("view-note").textContent =
    "This browser has no WebGL 2, so the 3-D view is not shown; everything else on the page is complete.";
  el("view-note").hidden = false;
}

const table = el("steps");
let tableInSight = false;
new IntersectionObserver(([entry]) => {
  tableInSight = entry.isIntersecting;
  if (tableInSight) scrollToRow();
}).observe(table);
const rows = Array.from(document.querySelectorAll("tr[data-step]"));
const net = new Net(plan, timeline, pick);
const player = new Player(timeline, show);

function show(time) {
  state = timeline.at(time);
  corners = cornersAt(plan, state.angles);
  say();
  draw();
}

function draw() {
  view?.update(corners, state, look);
}

function say() {
  const { time } = state, number = Math.min(Math.ceil(time), timeline.length), text = stepText(timeline, time);
  el("step-text").textContent = text;
  el("step-number").textContent = `${number} / ${timeline.length}`;
  el("time").setAttribute("aria-valuetext", `step ${number}: ${text}`);
  el("rotary-text").textContent = rotaryText(state);
  const whole = timeline.clock[timeline.length];
  el("clock-text").textContent = whole > 0 ? `${duration(timeline.secondsAt(time))} of ${duration(whole)}` : "";
  const row = time > 0 && time < timeline.length ? rows[number - 1] : null;
  if (row !== markedRow) {
    markedRow?.classList.remove("now");
    row?.classList.add("now");
    markedRow = row;
    if (tableInSight) scrollToRow();
  }
  net.burn(state.active >= 0 ? plan.creaseOf[state.active] : -1);
  if (look.face >= 0) tellPicked();
}

/** The table follows only while it is on the screen: drawing it again costs more than all the rest. */
function scrollToRow() {
  if (markedRow) table.scrollTop = markedRow.offsetTop - 0.4 * table.clientHeight;
}

function tellPicked() {
  if (look.face < 0) {
    el("picked-text").textContent = HINT;
    return;
  }
  const angle = (state.angles[look.face] * 180) / Math.PI;
  el("picked-text").textContent = pickedText(plan, timeline, look.face, look.crease, angle);
}

/** Mark a face, or a crease and the face that it turns, in view, net and table; null or the same again: nothing. */
function pick(what) {
  const same = what === null || (what.face === look.face && what.crease === look.crease);
  look.face = same ? -1 : what.face;
  look.crease = same ? -1 : what.crease;
  const crease = look.crease >= 0 ? look.crease : plan.creaseOf[look.face] ?? -1;
  net.mark(look.face, look.crease);
  tellPicked();
  const blocked = plan.blocked.find((b) => b.crease === crease);
  el("picked-blocked").textContent = blocked ? blocked.text : "";
  const folds = timeline.foldsOf.get(crease) ?? [];
  el("jump").hidden = folds.length === 0;
  el("jump").dataset.jump = crease;
  for (const row of document.querySelectorAll("tr.of-picked")) row.classList.remove("of-picked");
  for (const step of folds) rows[step].classList.add("of-picked");
  draw();
}

function jump(crease) {
  const folds = timeline.foldsOf.get(crease);
  if (folds) player.seek(folds[folds.length - 1] + 0.999);
}

/* ---- what is shown ---- */
const KEYS = {
  heat: [`${HEAT_C[0]} °C`, `${HEAT_C[1]} °C`], order: ["folded first", "last"], error: ["0", `${largest.toFixed(2)} mm`],
};
function colourBy(mode) {
  look.mode = mode;
  net.paint(mode, goal.error, largest);
  const words = KEYS[mode];
  el("scale").hidden = !words;
  if (words) {
    el("scale-low").textContent = words[0];
    el("scale-high").textContent = words[1];
    el("scale-bar").style.background = gradient(mode);
  }
  draw();
}
const hasHeat = plan.steps.some((step) => step.start);
if (!hasHeat) el("colour").querySelector("[value=heat]").remove();
el("colour").value = look.mode = hasHeat ? "heat" : "plain";
el("colour").addEventListener("change", () => colourBy(el("colour").value));
for (const name of ["sheet", "beam", "machine", "goal"]) {
  const box = el(`show-${name}`);
  box.checked = look[name];
  box.addEventListener("change", () => { look[name] = box.checked; draw(); });
}
el("error-text").textContent =
  `reached shape against goal: ${goal.rms.toFixed(2)} mm rms, ${goal.largest.toFixed(2)} mm at most`;
el("compare").addEventListener("click", () => {
  player.seek(timeline.length);
  el("show-goal").checked = look.goal = true;
  el("colour").value = "error";
  colourBy("error");
});

/* ---- pointer and keys ---- */
let pressed = null;
canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
canvas.addEventListener("pointerup", (event) => {
  const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5;
  if (still && event.button === 0 && view) pick(view.under(event));
});
canvas.addEventListener("keydown", (event) => {
  if (!view || event.ctrlKey || event.metaKey || event.altKey) return;
  const keys = {
    ArrowLeft: () => view.turn(-0.1, 0), ArrowRight: () => view.turn(0.1, 0), ArrowUp: () => view.turn(0, -0.1),
    ArrowDown: () => view.turn(0, 0.1), "+": () => view.zoom(1.15), "=": () => view.zoom(1.15), "-": () => view.zoom(1 / 1.15),
    0: () => view.reset(),
  };
  player.key(event, keys);
});
el("reset-view").addEventListener("click", () => view?.reset());
el("net").addEventListener("keydown", (event) => {
  const walk = (by) => {
    const at = plan.order.indexOf(look.face), count = plan.order.length;
    pick({ face: plan.order[at < 0 ? 0 : (at + by + count) % count], crease: -1 });
  };
  player.key(event, {
    ArrowRight: () => walk(1), ArrowDown: () => walk(1), ArrowLeft: () => walk(-1), ArrowUp: () => walk(-1),
    Enter: () => jump(plan.creaseOf[look.face]),
  });
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape") pick(null); });
table.addEventListener("keydown", (event) => {
  player.key(event, { ArrowDown: () => player.step(1), ArrowUp: () => player.step(-1) });
});
rows.forEach((row, step) => row.addEventListener("click", () => {
  const folded = plan.steps[step];
  player.seek(step + 0.999);
  if (folded.op === "fold" && look.crease !== folded.crease) pick({ face: folded.face, crease: folded.crease });
}));
for (const button of document.querySelectorAll("[data-jump]")) {
  button.addEventListener("click", () => {
    const crease = Number(button.dataset.jump);
    jump(crease);
    if (look.crease !== crease) pick({ face: timeline.faceOf.get(crease), crease });
    canvas.scrollIntoView({ block: "center", behavior: "instant" });
  });
}
new ResizeObserver(() => view?.render()).observe(canvas);
window.addEventListener("beforeprint", () => view?.render());

const marker = /[#&]t=([\d.]+)/.exec(location.hash);
colourBy(look.mode);
player.go(marker ? Number(marker[1]) : timeline.length);

/** For tests and for whoever opens the console: the pose that is shown, read from what is drawn. */
window.blossom = {
  steps: timeline.length,
  seek: (time) => player.seek(time),
  corners: () => Array.from(view ? view.part.position_.array : corners),
  rotary: () => (view ? view.machine.rotation.x : state.rotary),
  errors: () => ({ rms: goal.rms, largest: goal.largest }),
  picked: () => ({ face: look.face, crease: look.crease }),
  place: (face) => view && view.onScreen(view.part.corner(3 * face).add(view.part.corner(3 * face + 1)).add(view.part.corner(3 * face + 2)).divideScalar(3)),
  placeOfCrease: (crease) => {
    const [a, b] = view.part.hinge(timeline.faceOf.get(crease));
    return view.onScreen(a.add(b).multiplyScalar(0.5));
  },
  shown: () => ({ sheet: view.sheet.visible, flat: view.sheet.flat.geometry.drawRange.count / 3, falling: view.sheet.falling.visible, beam: view.beam.visible, tabs: view.sheet.tab.visible, goal: view.part.goal.visible }),
};
document.documentElement.dataset.ready = "1";
