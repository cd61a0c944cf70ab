// What a sample says: which numbers decide over a result (Sobol indices), how it is spread, how often it is above a bound. What a
// study has found: the best numbers, or where outcomes change.

import { $, ask, later, make, notice, number } from "./api.js";
import { LOOK, TOOLS, title } from "./plots.js";

const COLORS = { first: "#0072b2", total: "#d55e00", second: "#009e73", cases: "#56b4e9" };
const WORDS = { first: "alone (first)", total: "with all others (total)", second: "two together (second)" };
let job = null, table = null, method = "", indices = [];

export function begin() {
  const again = later(() => told());
  $("questionof").addEventListener("change", again);
  $("bound").addEventListener("input", again);
}

export function clear() {
  $("questions").hidden = true;
  $("bound").value = "";
  for (const id of ["indexplot", "spreadplot", "studyplot"]) { Plotly.purge($(id)); $(id).hidden = true; }
}

// A job whose rows are there is looked at.
export async function changed(now, rows) {
  [job, table] = [now, rows];
  const { sample, optimise, refine } = await ask("GET", `/v1/jobs/${job.id}/request`);
  if (job.id !== now.id) return;
  $("questiontitle").textContent = optimise ? "The best" : refine ? "Where it changes" : "What the sample says";
  $("asksample").hidden = !sample;
  $("studyplot").hidden = !(optimise || refine);
  if (optimise || refine) { await study(); return; }
  if (!sample) return;
  method = sample.method;
  indices = method === "saltelli" ? await asked("indices", "") : [];
  const kept = table.columns.slice(table.columns.findIndex((c) => c.name === "steps") + 1).map((c) => c.name);
  const names = indices.length ? indices.map((i) => i.of) : kept, before = $("questionof").value;
  $("questionof").replaceChildren(...names.map((n) => make("option", { value: n }, n === "failed" ? "failing (not ended as done)" : n)));
  if (names.includes(before)) $("questionof").value = before;
  $("questions").hidden = false;
  await told();
}

async function asked(what, query) {
  try {
    return (await ask("GET", `/v1/jobs/${job.id}/${what}${query}`))[what];
  } catch (e) {
    $("questionnote").textContent = (e.problems?.length ? e.problems : [{ what: e.message }]).map((p) => p.what).join("; ");
    return [];
  }
}

async function told() {
  const of = $("questionof").value, id = job.id, failing = of === "failed";
  $("questionnote").textContent = "";
  const above = $("bound").value.trim() ? `&above=${encodeURIComponent(`${of}=${$("bound").value.trim()}`)}` : "";
  const spread = failing ? null : (await asked("spreads", `?of=${encodeURIComponent(of)}${above}`))[0];
  if (id !== job.id) return;
  const index = indices.find((i) => i.of === of);
  $("boundlabel").hidden = failing;
  const notes = [...(index?.notes ?? []), spread?.missing ? `${spread.missing} of ${spread.cases} cases have no value.` : "", spread?.note ?? ""];
  if (!$("questionnote").textContent) $("questionnote").textContent = notes.filter(Boolean).join(" ");
  $("indexplot").hidden = !index;
  $("spreadplot").hidden = !spread;
  if (index) await bars(index);
  if (spread) await histogram(spread);
  answers(index, spread);
}

const short = (paths) => {
  for (let n = 1; ; n++) {
    const cut = paths.map((p) => p.split(".").slice(-n).join("."));
    if (new Set(cut).size === cut.length || cut.every((c, i) => c === paths[i])) return new Map(paths.map((p, i) => [p, cut[i]]));
  }
};

const bar = (kind, names, found) => ({
  type: "bar", orientation: "h", name: WORDS[kind], y: names, x: found.map((e) => e.value), marker: { color: COLORS[kind] },
  error_x: { type: "data", symmetric: false, array: found.map((e) => e.high - e.value), arrayminus: found.map((e) => e.value - e.low), color: "#1c2430", thickness: 1.2 },
  hovertemplate: "%{y}: %{x:.3f}<extra>" + WORDS[kind] + "</extra>",
});

async function bars(index) {
  const paths = index.first.map((e) => e.path), names = short(paths);
  const there = (found) => found.filter((e) => e.value != null);
  const of = (e) => names.get(e.path), pair = (e) => e.paths.map((p) => names.get(p)).join(" × ");
  const traces = ["first", "total"].map((kind) => bar(kind, there(index[kind]).map(of), there(index[kind])));
  traces.push(bar("second", there(index.second).map(pair), there(index.second)));
  const look = { ...LOOK, showlegend: true, legend: { orientation: "h", y: 1.12 }, margin: { ...LOOK.margin, l: 140, t: 30 }, barmode: "group", xaxis: title("part of the variance, with 95 % intervals"), yaxis: { autorange: "reversed", automargin: true } };
  await Plotly.react($("indexplot"), traces, look, TOOLS);
}

async function histogram(spread) {
  const at = table.columns.findIndex((c) => c.name === spread.of), outcome = table.columns.findIndex((c) => c.name === "outcome");
  const each = method === "saltelli" ? 2 * table.columns.findIndex((c) => c.name === "outcome") : 1; // paths + case: 2 (n + 1)
  const own = (r) => each === 1 || r[0] % each === 0 || r[0] % each === each - 1;
  const values = table.rows.filter((r) => own(r) && r[outcome] === "done" && r[at] != null).map((r) => r[at]);
  const line = (x, color, dash) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: { color, width: 1.5, dash } });
  const known = spread.quantiles.filter((q) => q.value != null), bounds = spread.above;
  const shapes = [...known.map((q) => line(q.value, "#1c2430", "solid")), ...bounds.map((b) => line(b.bound, COLORS.total, "dash"))];
  const word = (x, text, y, color) => ({ x, y, yref: "paper", text, showarrow: false, xanchor: "left", font: { size: 11, color } });
  const words = [...known.map((q) => word(q.value, `${+(100 * q.probability).toPrecision(4)} %`, 1, "#1c2430")), ...bounds.map((b) => word(b.bound, `above: ${number(100 * b.value)} %`, 0.85, COLORS.total))];
  const unit = spread.unit && spread.unit !== "1" ? ` (${spread.unit})` : "";
  const look = { ...LOOK, xaxis: title(spread.of + unit), yaxis: title("cases"), shapes, annotations: words, bargap: 0.02 };
  await Plotly.react($("spreadplot"), [{ type: "histogram", x: values, nbinsx: 40, marker: { color: COLORS.cases } }], look, TOOLS);
}

function answers(index, spread) {
  const rows = [];
  const row = (what, e, unit = "") => rows.push(make("tr", {}, make("th", { scope: "row" }, what), make("td", {}, e.value == null ? "–" : `${number(e.value)} ${unit}`.trim()), make("td", {}, [e.low, e.high].map((x) => (x == null ? "no end" : number(x))).join(" to "))));
  const unit = spread?.unit && spread.unit !== "1" ? spread.unit : "";
  for (const kind of ["first", "total"]) for (const e of index?.[kind] ?? []) row(`${e.path}, ${WORDS[kind]}`, e);
  for (const q of spread?.quantiles ?? []) row(`${+(100 * q.probability).toPrecision(4)} % lie below`, q, unit);
  for (const b of spread?.above ?? []) row(`above ${number(b.bound)} ${unit}: probability`, b);
  const head = ["", "value", "95 % interval"].map((x) => make("th", { scope: "col" }, x));
  $("answers").tHead.replaceChildren(make("tr", {}, ...head));
  $("answers").tBodies[0].replaceChildren(...rows);
}

// -- studies

const SHAPES = ["circle", "x", "square", "triangle-up", "diamond", "star"], SHADES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000"];
const column = (name) => table.columns.findIndex((c) => c.name === name);
const named = (name) => { const unit = table.columns[column(name)]?.unit; return unit && unit !== "1" ? `${name} (${unit})` : name; };

async function study() {
  const { answer } = await ask("GET", `/v1/jobs/${job.id}/answer`);
  if (!answer) return;
  $("questions").hidden = false;
  $("indexplot").hidden = $("spreadplot").hidden = true;
  $("questionnote").textContent = `${answer.why}; ${answer.cases} cases.` + (answer.feasible === false ? " No case keeps all constraints; this comes nearest." : "");
  await (answer.kind === "optimise" ? best(answer) : boundaries(answer));
}

// Outcomes by colour and shape, never joined by lines.
function points(x, y) {
  const low = Math.min(...table.rows.map(y).filter((v) => v != null)); // along the lower end: cases without a value
  const at = column("outcome"), outcomes = [...new Set(["done", ...table.rows.map((r) => r[at])])];
  return outcomes.map((outcome, k) => {
    const rows = table.rows.filter((r) => r[at] === outcome);
    return { type: "scatter", mode: "markers", name: outcome.replace(/_/g, " "), x: rows.map(x), y: rows.map((r) => y(r) ?? low), text: rows.map((r) => `case ${r[0]}: ${outcome}`), marker: { symbol: SHAPES[k % 6], color: SHADES[k % 6], size: 6 } };
  });
}

async function best(answer) {
  const of = column(answer.of), known = answer.path.filter((p) => p.value != null), last = known.at(-1);
  const traces = points((r) => r[0], (r) => r[of]);
  if (last) traces.push({ type: "scatter", mode: "lines", name: "best so far", line: { shape: "hv", color: "#cc79a7", width: 2 }, x: [...known.map((p) => p.case), answer.cases - 1], y: [...known.map((p) => p.value), last.value] });
  await Plotly.react($("studyplot"), traces, { ...LOOK, showlegend: true, legend: { orientation: "h", y: 1.12 }, xaxis: title("case"), yaxis: title(named(answer.of)) }, TOOLS);
  const rows = [...answer.numbers.map((n) => [n.path, n.value, n.unit]), ...Object.entries(answer.results).map(([n, v]) => [n, v, table.columns[column(n)]?.unit])];
  fill(["", "value", ""], [...rows.map(([n, v, u]) => [n, number(v), u === "1" ? "" : (u ?? "")]), ["case", String(answer.case), ""]]);
}

async function boundaries(answer) {
  const x = column(answer.paths[0]), up = answer.paths[1] ?? (answer.of === "outcome" ? null : answer.of), y = column(up);
  const shapes = answer.boundaries.slice(0, 500).map((b) => ({
    type: "rect", x0: b.low[0], x1: b.high[0], yref: answer.paths[1] ? "y" : "paper", y0: answer.paths[1] ? b.low[1] : 0, y1: answer.paths[1] ? b.high[1] : 1,
    line: { width: answer.paths[1] ? 0 : 1, color: "#8a8a8a" }, fillcolor: "rgba(138,138,138,.5)", layer: "below",
  }));
  const look = { ...LOOK, showlegend: true, legend: { orientation: "h", y: 1.12 }, shapes, xaxis: title(named(answer.paths[0])), yaxis: up ? title(named(up)) : { visible: false } };
  await Plotly.react($("studyplot"), points((r) => r[x], (r) => (up ? r[y] : 0)), look, TOOLS);
  fill([...answer.paths, "between them"], answer.boundaries.slice(0, 50).map((b) => [
    ...b.low.map((low, k) => `${number(low)} … ${number(b.high[k])}`), b.change == null ? b.outcomes.join(" | ").replace(/_/g, " ") : `jumps by ${number(b.change)}`,
  ]));
}

function fill(heads, rows) {
  $("answers").tHead.replaceChildren(make("tr", {}, ...heads.map((x) => make("th", { scope: "col" }, x))));
  $("answers").tBodies[0].replaceChildren(...rows.map(([first, ...rest]) => make("tr", {}, make("th", { scope: "row" }, first), ...rest.map((x) => make("td", {}, x)))));
}
