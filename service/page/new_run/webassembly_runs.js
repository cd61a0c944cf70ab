// Runs a scene in the browser, by the scene's WebAssembly module, while the user drags a number. The server compiles the module
// once.

import { ask } from "../basics/requests_and_dom.js";
import * as editor from "./scene_editor.js";
import * as sliders from "./number_sliders.js";

const WARNING = 1; // largest status of a call that succeeded
const DRAWN = /^(m|rad)$/; // units of numbers that may change the shapes of the picture; start values never change shapes
let module = null, asked = null;

// The text without its numbers. Texts that differ only in numbers have the same module.
function skeleton() {
  let text = editor.text();
  for (const n of [...sliders.numbers()].sort((a, b) => b.at[0] - a.at[0])) text = text.slice(0, n.at[0]) + text.slice(n.at[1]);
  return text;
}

const values = () => new Map(sliders.numbers().map((n) => [n.path, n.factor === null ? (n.value ? NaN : 0) : n.value * n.factor]));

// Requests the module of the present text, unless the module is loaded or the server refused it.
export async function prepare() {
  const base = skeleton(), first = values();
  if (asked === base) return;
  asked = base;
  try {
    const made = await ask("POST", "/v1/scenes/module", { scene_text: editor.text() });
    const code = Uint8Array.from(atob(made.wasm), (c) => c.charCodeAt(0)), { instance } = await WebAssembly.instantiate(code, {});
    instance.exports._initialize?.();
    module = { ...made, base, first, web: instance.exports };
  } catch (e) {
    if (!e.status) asked = null; // without an answer, the request can be repeated; a refusal is final
  }
}

// The variable of the module that sets a number. undefined if no variable sets it, or if the number may change the shapes of the
// picture.
function variable(path, unit) {
  const { parameters } = module;
  return DRAWN.test(unit) && !path.includes(".start.") ? undefined : parameters[path] ?? parameters[`${path}[1]`];
}

// The data of a run of the present text. The shapes come from the data `before`. Returns null if only the server can run the text.
export function run(before) {
  if (!module || module.base !== skeleton() || !before) return null;
  const changes = [];
  for (const [path, value] of values()) {
    if (value === module.first.get(path)) continue;
    const at = variable(path, sliders.numbers().find((n) => n.path === path).si_unit);
    if (at === undefined || !Number.isFinite(value)) return null;
    changes.push([at, value]);
  }
  const columns = before.sources.map((s) => (s.startsWith("rotation:") ? [1, 2, 3, 4].map((k) => module.columns[`${s.slice(9)}[${k}]`]) : module.columns[s]));
  const computed = (k) => before.sources[k] === "" && [1, 2].some((d) => before.sources[k - d]?.startsWith("rotation:"));
  if (before.sources.some((s, k) => s !== "0" && !computed(k) && [columns[k]].flat().includes(undefined))) return null;
  return stepped(changes, columns, before);
}

function stepped(changes, columns, before) {
  const { web } = module, width = columns.length, count = Math.round(before.until / before.every) + 1, rows = new Float32Array(width * count), times = new Float64Array(count);
  web.web_init();
  if (changes.some(([at, value]) => web.web_set(at, value) > WARNING) || web.web_start(0) > WARNING) return null;
  let n = 0, last = [1, 0, 0, 0];
  for (;;) {
    times[n] = web.web_time();
    columns.forEach((c, k) => {
      if (Array.isArray(c)) { last = turned(c.map((i) => web.web_get(i)), last, n === 0); rows.set(vector(last), n * width + k); }
      else if (c !== undefined) rows[n * width + k] = web.web_get(c);
    });
    if (++n === count || web.web_step((before.until * n) / (count - 1) - times[n - 1]) > WARNING) break;
  }
  return { ...before, times: times.slice(0, n), rows: rows.slice(0, n * width), events: [], outcome: n === count ? "" : `ended early at t = ${times[n - 1].toPrecision(4)} s` };
}

// The unit quaternion q or -q, which are the same rotation. First: the one with a positive scalar. Later: the one nearer to `last`.
function turned(q, last, first) {
  const nearer = first ? q[0] : q.reduce((sum, x, k) => sum + x * last[k], 0);
  return nearer < 0 ? q.map((x) => -x) : q;
}

function vector([w, ...v]) {
  const size = Math.hypot(...v), k = size > 1e-12 ? (2 * Math.atan2(size, w)) / size : 2;
  return v.map((x) => k * x);
}
