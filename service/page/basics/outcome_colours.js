// Colours and marker shapes of outcomes, in plots and legends.

import { make, many } from "./requests_and_dom.js";

const KNOWN = ["done", "jammed", "no_solution", "max_steps", "out_of_time", "inaccurate", "invalid", "step_underflow"];
const SHAPES = ["circle", "x", "square", "triangle-up", "diamond", "star", "cross", "triangle-down"];
const DRAWN = {
  circle: "M8 3a5 5 0 1 0 .01 0z", x: "M3 5l2-2 3 3 3-3 2 2-3 3 3 3-2 2-3-3-3 3-2-2 3-3z", square: "M3 3h10v10H3z", "triangle-up": "M8 2l6 11H2z",
  diamond: "M8 1l6 7-6 7-6-7z", star: "M8 1l2 5h5l-4 3 2 6-5-4-5 4 2-6-4-3h5z", cross: "M6 2h4v4h4v4h-4v4H6v-4H2V6h4z", "triangle-down": "M8 14L2 3h12z",
};
const others = [];

function place(name) {
  const at = KNOWN.indexOf(name);
  if (at >= 0) return at;
  if (!others.includes(name)) others.push(name);
  return 1 + others.indexOf(name) % (KNOWN.length - 1); // the first mark is only for the outcome done
}

export const color = (k) => getComputedStyle(document.documentElement).getPropertyValue(`--c${k % 8}`).trim();
export const shape = (k) => SHAPES[k % SHAPES.length];
export const of = (name) => ({ color: color(place(name)), shape: shape(place(name)), open: isEarly(name) });
export const said = (name) => name.replace(/_/g, " ");

// Cases that ended before their end time. Their results cover only a part of the time. Their marks are hollow, and colour scales
// ignore them.
const WHOLE = ["done", "inaccurate"];
export const COMPLETE = `outcome=${WHOLE.join(",")}`; // selects the cases that did not end early
export const isEarly = (name) => !WHOLE.includes(name);
export const early = (job) => Object.entries(job.outcomes).reduce((sum, [name, n]) => sum + (isEarly(name) ? n : 0), 0);
export const earlyText = (job) => (early(job) ? `${many(early(job))} of ${many(job.done)} ended early` : "");

// An SVG mark for a legend. Screen readers ignore the mark.
function drawn(width, height, box, path) {
  const [svg, line] = ["svg", "path"].map((tag) => document.createElementNS("http://www.w3.org/2000/svg", tag));
  for (const [name, value] of Object.entries({ viewBox: box, width, height, "aria-hidden": "true" })) svg.setAttribute(name, value);
  for (const [name, value] of Object.entries(path)) line.setAttribute(name, value);
  svg.append(line);
  return svg;
}

export const mark = ({ color: c, shape: s, open }) => drawn(12, 12, "0 0 16 16", { d: DRAWN[s], ...(open ? { fill: "none", stroke: c, "stroke-width": 2 } : { fill: c }) });
export const symbol = ({ shape: s, open }) => (open ? `${s}-open` : s);
export const stroke = (dashes) => drawn(34, 6, "0 0 34 6", { d: "M0 3h34", stroke: "currentColor", "stroke-width": 2, "stroke-dasharray": dashes });

export const chips = (counts) => Object.entries(counts).map(([name, n]) => make("li", {}, mark(of(name)), ` ${many(n)} ${said(name)}`));
