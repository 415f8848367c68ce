// Colours, after Okabe and Ito and after the cividis and inferno scales: told apart by colour-blind eyes, and every
// scale also runs from dark to light. Red, green and blue from 0 to 1.

const parse = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);

export const COLOUR = Object.fromEntries(Object.entries({
  face: "#b4c1cf", base: "#86c7b1", active: "#f2a93b", picked: "#3fa7e6", blocked: "#d48fb0", bad: "#b3005e",
  edge: "#26323f", sheet: "#c9cdd3", frame: "#aab1ba", beam: "#e03b12", glow: "#ff8a2a", hot: "#ffd23f",
  goal: "#0b66c3", tab: "#009e73", cut: "#6b7683", machine: "#7d8896", flap: "#c9b79b",
}).map(([name, text]) => [name, parse(text)]));

const SCALES = {
  order: ["#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838"].map(parse),
  heat: ["#b4c1cf", "#7a2a6b", "#bc3754", "#ed6925", "#fbb61a", "#fcffa4"].map(parse),
  error: ["#e8eef4", "#9fc5dd", "#f3c46b", "#e0762d", "#a1150f"].map(parse),
};

/** Colour of a share from 0 to 1 on a scale. */
export function scale(name, share) {
  const stops = SCALES[name], at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2), f = at - k;
  return stops[k].map((v, i) => v + (stops[k + 1][i] - v) * f);
}

/** A colour for CSS. */
export const css = (rgb) => `rgb(${rgb.map((v) => Math.round(255 * v)).join(",")})`;

/** The scale as a CSS gradient, left to right. */
export const gradient = (name) => `linear-gradient(90deg, ${SCALES[name].map(css).join(", ")})`;

export const HEAT_C = [20, 600];

/** How far along the heat scale a temperature is. */
export const heatShare = (celsius) => (celsius - HEAT_C[0]) / (HEAT_C[1] - HEAT_C[0]);
