// Points of a plane mechanism, which the user can drag on a grid in the picture. Dragging writes the coordinates of the point into
// the text.

import { $ } from "../basics/requests_and_dom.js";
import * as preview from "./mechanism_preview.js";
import * as sliders from "./number_sliders.js";

const LENGTHS = { "": 1, m: 1, mm: 1e-3, cm: 1e-2, km: 1e3, in: 0.0254, ft: 0.3048 };
const POINT = /^(?:bodies[.]([^.]+)|ground)[.]points[.]([^.]+)\[([123])\]$/, CELLS = 40; // cells of the grid across the mechanism
let points = [], size = 1, from = null, moved = () => {}, released = () => {};

// move, release: called while a point moves, and after it was released.
export function begin(move, release) {
  [moved, released] = [move, release];
  $("drag").addEventListener("click", () => { $("drag").setAttribute("aria-pressed", String(!on())); offer(); });
}

const on = () => $("drag").getAttribute("aria-pressed") === "true";
const nice = (x) => { const p = 10 ** Math.floor(Math.log10(x)); return (x < 2 * p ? 1 : x < 5 * p ? 2 : 5) * p; };

// Finds the points in the text that is shown. A coordinate that the text gives by an expression cannot be dragged.
export function put(parameters, data) {
  if (from) return;
  size = data?.size ?? size;
  const numbers = new Map(sliders.numbers().map((n) => [n.path, n])), found = new Map();
  for (const p of parameters) {
    const [, part = "", name, k] = p.path.match(POINT) ?? [];
    if (!name) continue;
    const point = found.get(`${part}.${name}`) ?? { part, name, at: [0, 0, 0], numbers: [null, null, null], grid: nice(size / CELLS) };
    const n = numbers.get(p.path), factor = n && (n.factor ?? LENGTHS[n.unit]);
    point.at[k - 1] = p.value;
    if (factor) point.numbers[k - 1] = Object.assign(n, { factor });
    found.set(`${part}.${name}`, point);
  }
  const names = (all) => all.map((p) => `${p.part}.${p.name}`).join(), was = names(points), before = on();
  points = [...found.values()].filter((p) => p.numbers.some(Boolean));
  const flat = data ? preview.view().planeOf() >= 0 : !$("drag").disabled;
  $("drag").disabled = !points.length || !flat;
  $("drag").title = $("drag").disabled ? (points.length ? "the mechanism does not move in a plane" : "the scene gives no points as numbers") : "show the plane of the motion, and drag the points in it";
  if ($("drag").disabled || names(points) !== was) $("drag").setAttribute("aria-pressed", "false");
  if (before) offer();
}

function offer() { preview.view()?.offer?.(on() ? points.map(({ part, name, at, grid }) => ({ part, name, at: [...at], grid })) : [], pulled); }

function pulled(index, delta, done) {
  const point = points[index];
  if (done) { from = null; released(); return; }
  from ??= point.numbers.map((n) => n?.value);
  const changes = point.numbers.flatMap((n, k) => (n && Math.abs(delta[k]) > point.grid / 2 ? [[n, sliders.rounded(from[k] + delta[k] / n.factor, point.grid / n.factor)]] : n ? [[n, from[k]]] : []));
  sliders.write(changes, `point ${point.part}.${point.name}`);
  point.at = point.at.map((x, k) => (point.numbers[k] ? point.numbers[k].value * point.numbers[k].factor : x));
  moved();
}
