// A slider for each number in the scene's text. A moved slider writes the new number into the text.

import { $, breaking, make } from "../basics/requests_and_dom.js";
import * as editor from "./scene_editor.js";

const FIRST = /^parameters[.]|[.]start[.]|[.]friction[.]|^forces[.]|[.](drive|effort|spring|damping|signal)\b/;
const WRITTEN = /^["']?([-+]?(?:\d+[.]?\d*|[.]\d+)(?:[eE][-+]?\d+)?)(?![xo\d])([^{]*)$/;
const STEPS = 200; // smallest number of steps of a slider
let there = [], moved = () => {}, released = () => {};

// move, release: called while a slider moves, and after it was released.
export function begin(move, release) { [moved, released] = [move, release]; }

const nice = (x) => { const p = 10 ** Math.floor(Math.log10(x)); return (x < 2 * p ? 1 : x < 5 * p ? 2 : 5) * p; };

// The numbers of a text: {path, at, value (as written), unit (as written), factor (to the SI unit)}.
function written(parameters) {
  return parameters.flatMap((p) => {
    const [, value, rest] = (p.at && editor.text().slice(...p.at).match(WRITTEN)) ?? [];
    return value === undefined ? [] : [{ path: p.path, at: [...p.at], value: +value, digits: value, unit: rest.replace(/["']$/, "").trim() || (p.unit === "1" ? "" : p.unit), factor: +value ? p.value / +value : null, si_unit: p.unit }];
  });
}

// Shows a slider for each number of the present text. If the text has the same numbers as before, the sliders keep their ranges.
export function put(parameters) {
  const found = written(parameters), same = found.map((n) => n.path).join() === there.map((n) => n.path).join();
  there = found.map((n, i) => (same ? Object.assign(there[i], n) : n));
  if (same) { there.forEach(tell); return; }
  const [first, others] = [true, false].map((is) => there.filter((n) => FIRST.test(n.path) === is).sort((a, b) => b.path.startsWith("parameters.") - a.path.startsWith("parameters.")));
  $("sliders").replaceChildren(...first.map((n) => slider(n)));
  $("otherscount").textContent = others.length;
  $("othersliders").replaceChildren(...others.map((n) => slider(n)));
  $("others").hidden = !others.length;
  $("others").open = !first.length;
}

export const numbers = () => there;

function slider(n) {
  const id = `slide-${n.path}`;
  n.input = make("input", { type: "range", id, title: n.path, oninput: () => slide(n), onchange: () => { if ([n.low, n.high].includes(n.value)) ranged(n); released(); } });
  n.output = make("output", { for: id });
  ranged(n);
  return make("li", {}, make("label", { for: id, title: n.path }, ...breaking(n.path.replace(/^(parameters|joints|forces|bodies)[.]/, ""))), n.input, n.output);
}

function ranged(n) {
  [n.low, n.high] = n.value ? [0, 2 * n.value].sort((a, b) => a - b) : [-1, 1];
  n.step = nice((n.high - n.low) / STEPS);
  [n.low, n.high] = [Math.floor(n.low / n.step + 1e-9) * n.step, Math.ceil(n.high / n.step - 1e-9) * n.step];
  Object.assign(n.input, { min: n.low, max: n.high, step: n.step });
  tell(n);
}

function tell(n) {
  if (n.value < n.low || n.value > n.high) { ranged(n); return; }
  n.input.value = n.value;
  n.output.textContent = `${n.digits} ${n.unit.replaceAll("*", "·")}`.trim();
  n.input.setAttribute("aria-valuetext", n.output.textContent);
}

// A multiple of a step without digits of round-off.
export const rounded = (x, step) => +(Math.round(x / step) * step).toPrecision(12);

function slide(n) {
  write([[n, rounded(+n.input.value, n.step)]], n.path);
  moved();
}

// Writes values at their places in the text. Changes with the same name are undone together.
export function write(changes, name) {
  for (const [n, value] of changes) {
    if (n.value === value) continue;
    const text = editor.text().slice(...n.at).replace(n.digits, String(value)), more = text.length - (n.at[1] - n.at[0]), end = n.at[1];
    editor.replace(...n.at, text, name);
    [n.value, n.digits] = [value, String(value)];
    for (const other of there) other.at = other.at.map((i) => (i >= end ? i + more : i));
    tell(n);
  }
}
