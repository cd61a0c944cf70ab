// Shows the results of samples (Sobol indices, distributions, probabilities that a result exceeds a bound), of studies (optimum,
// boundaries) and of fits.

import { $, ask, choices, few, fill, later, many, number } from "../basics/requests_and_dom.js";
import * as charts from "../plots/plotly.js";
import * as goals from "./search_goals.js";
import * as outcomes from "../basics/outcome_colours.js";
import { middles } from "../basics/result_rows.js";
import { sentences, short, title, unit, words } from "../basics/axis_labels.js";

const SHADES = { first: 0, total: 1, second: 2, cases: 5 };
const shade = (kind) => outcomes.color(SHADES[kind]);
const WORDS = { first: "alone (first)", total: "with all others (total)", second: "interaction of two (second)" };
let job = null, table = null, method = "", indices = [];

export function begin() {
  const again = later(() => told());
  $("questionof").addEventListener("change", again);
  $("bound").addEventListener("input", again);
  charts.onScheme(() => ($("questions").hidden || !job ? null : changed(job, table)));
}

export function clear() {
  $("questions").hidden = true;
  $("bound").value = "";
  for (const id of ["indexplot", "spreadplot", "studyplot"]) { charts.clear($(id)); $(id).hidden = true; }
  for (const part of [$("answers").tHead, $("answers").tBodies[0]]) part.replaceChildren();
}

// Shows the results of a job that has rows.
export async function changed(now, rows) {
  [job, table] = [now, rows];
  if (table.fits) { await fitted(); return; }
  const { sample, optimise, refine } = table.request;
  $("questiontitle").textContent = optimise ? "Best values" : refine ? "Places of change" : "Results of the sample";
  $("asksample").hidden = !sample;
  $("studyplot").hidden = !(optimise || refine);
  if (optimise || refine) { await study(); return; }
  if (!sample) return;
  method = sample.method;
  indices = method === "saltelli" ? await asked("indices", "") : [];
  const kept = table.columns.slice(table.columns.findIndex((c) => c.name === "steps") + 1).map((c) => c.name);
  const names = indices.length ? indices.map((i) => i.of) : kept;
  choices($("questionof"), names.map((n) => [n, n === "failed" ? "failed (outcome other than done)" : words(table.column(n)), n]));
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
  const notes = [...(index?.notes ?? []), spread?.missing ? `${many(spread.missing)} of ${few(spread.cases, "case")} have no value` : "", spread?.note ?? ""];
  if (!$("questionnote").textContent) $("questionnote").textContent = sentences(notes);
  $("indexplot").hidden = !index;
  $("spreadplot").hidden = !spread;
  if (index) await bars(index);
  if (spread) await histogram(spread);
  answers(index, spread);
}

const bar = (kind, names, found) => ({
  type: "bar", orientation: "h", name: WORDS[kind], y: names, x: found.map((e) => e.value), marker: { color: shade(kind) },
  error_x: { type: "data", symmetric: false, array: found.map((e) => e.high - e.value), arrayminus: found.map((e) => e.value - e.low), color: charts.inks().ink, thickness: 1.2 },
  hovertemplate: "%{y}: %{x:.3f}<extra>" + WORDS[kind] + "</extra>",
});

async function bars(index) {
  const names = short(index.first.map((e) => e.path)), there = (found) => found.filter((e) => e.value != null);
  const of = (e) => names.get(e.path), pair = (e) => e.paths.map((p) => names.get(p)).join(" × ");
  const traces = ["first", "total"].map((kind) => bar(kind, there(index[kind]).map(of), there(index[kind])));
  traces.push(bar("second", there(index.second).map(pair), there(index.second)));
  const layout = { ...charts.legend, barmode: "group", xaxis: charts.axis("share of the variance, with 95 % intervals"), yaxis: charts.axis("", { autorange: "reversed" }) };
  await charts.draw($("indexplot"), traces, layout, `Sobol indices of ${index.of}, with intervals`);
}

// Draws a histogram of a result over the finished cases, with quantiles and bounds.
async function histogram(spread) {
  const got = await table.bins(spread.of, "", "", { nx: 40, words: ["outcome=done"] }), ink = charts.inks().ink;
  const line = (x, color, dash) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: { color, width: 1.5, dash } });
  const known = spread.quantiles.filter((q) => q.value != null), bounds = spread.above;
  const shapes = [...known.map((q) => line(q.value, ink, "solid")), ...bounds.map((b) => line(b.bound, shade("total"), "dash"))];
  const word = (x, text, y, color) => ({ x, y, yref: "paper", text, showarrow: false, xanchor: "left", xshift: 3, font: { size: 11, color } });
  const words = [...known.map((q, i) => word(q.value, `${+(100 * q.probability).toPrecision(4)} %`, 1 - 0.06 * i, ink)), ...bounds.map((b) => word(b.bound, `above: ${number(100 * b.value)} %`, 0.94 - 0.06 * known.length, shade("total")))];
  const at = middles(got.x), layout = { xaxis: charts.axis(title(table.column(spread.of))), yaxis: charts.axis("cases"), shapes, annotations: words, bargap: 0.02 };
  await charts.draw($("spreadplot"), [{ type: "bar", x: got.cells.x.map((i) => at[i]), y: got.cells.cases, marker: { color: shade("cases") } }], layout, `histogram of ${spread.of}, with quantiles`);
}

function answers(index, spread) {
  const rows = [], u = unit(spread?.unit);
  const row = (what, e, unit_ = "") => rows.push([what, e.value == null ? "–" : `${number(e.value)}\u00a0${unit_}`.trim(), [e.low, e.high].map((x) => (x == null ? "no end" : number(x))).join(" to ")]);
  for (const kind of ["first", "total"]) for (const e of index?.[kind] ?? []) row(`${e.path}, ${WORDS[kind]}`, e);
  for (const q of spread?.quantiles ?? []) row(`${+(100 * q.probability).toPrecision(4)} % lie below`, q, u);
  for (const b of spread?.above ?? []) row(`above ${number(b.bound)} ${u}: probability`, b);
  fill($("answers"), ["", "value", "95 % interval"], rows);
}

// -- studies

const column = (name) => table.at(name);
const named = (name) => title(table.column(name));

async function study() {
  const answer = await table.answer();
  if (!answer) return;
  $("questions").hidden = false;
  $("indexplot").hidden = $("spreadplot").hidden = true;
  $("questionnote").textContent = sentences([`${answer.why}; ${few(answer.cases, "case")}`, answer.kind === "optimise" ? goals.missed(answer, table) : ""]);
  await (answer.kind === "optimise" ? best(answer) : boundaries(answer));
}

const points = (x, y) => charts.points(table.rows, column("outcome"), x, y, (r) => charts.hover(table.columns, r), null);

async function best(answer) {
  const of = column(answer.of), known = answer.path.filter((p) => p.value != null), last = known.at(-1);
  const traces = points((r) => r[0], (r) => r[of]);
  if (last) traces.push({ type: "scatter", mode: "lines", name: "best so far", line: { shape: "hv", color: outcomes.color(3), width: 2 }, x: [...known.map((p) => p.case), answer.cases - 1], y: [...known.map((p) => p.value), last.value] });
  await charts.draw($("studyplot"), traces, { ...charts.legend, ...goals.drawn(answer, table, answer.of, answer.case), xaxis: charts.axis("case"), yaxis: charts.axis(named(answer.of)) }, `${answer.of} of each case, and the best so far`);
  const rows = [...answer.numbers.map((n) => [n.path, n.value, n.unit]), ...Object.entries(answer.results).map(([n, v]) => [n, v, table.column(n)?.unit])];
  fill($("answers"), ["", "value", ""], [...rows.map(([n, v, u]) => [n, number(v), unit(u)]), ["case", String(answer.case), ""]]);
}

async function boundaries(answer) {
  const x = column(answer.paths[0]), up = answer.paths[1] ?? (answer.of === "outcome" ? null : answer.of), y = column(up);
  const shapes = answer.boundaries.slice(0, 500).map((b) => ({
    type: "rect", x0: b.low[0], x1: b.high[0], yref: answer.paths[1] ? "y" : "paper", y0: answer.paths[1] ? b.low[1] : 0, y1: answer.paths[1] ? b.high[1] : 1,
    line: { width: answer.paths[1] ? 0 : 1, color: "#8a8a8a" }, fillcolor: "rgba(138,138,138,.5)", layer: "below",
  }));
  const layout = { ...charts.legend, shapes, xaxis: charts.axis(named(answer.paths[0])), yaxis: up ? charts.axis(named(up)) : { visible: false } };
  await charts.draw($("studyplot"), points((r) => r[x], (r) => (up ? r[y] : 0)), layout, "cases of the study, and where outcomes change");
  fill($("answers"), [...answer.paths, "between them"], answer.boundaries.slice(0, 50).map((b) => [
    ...b.low.map((low, k) => `${number(low)} … ${number(b.high[k])}`), b.change == null ? b.outcomes.join(" | ").replace(/_/g, " ") : `jumps by ${number(b.change)}`,
  ]));
}

// -- fits

const end = (value, kind) => (value == null ? "no end" : kind === "bound" ? `[${number(value)}]` : `${number(value)}${kind === "open" ? "?" : ""}`);

async function fitted() {
  const { id } = job, { answer } = await ask("GET", `/v1/jobs/${id}/answer`);
  if (id !== job.id || !answer) return;
  const { fit, compared, experiments } = answer;
  $("questiontitle").textContent = "Results of the fit";
  $("questions").hidden = false;
  for (const part of ["asksample", "indexplot", "spreadplot", "studyplot"]) $(part).hidden = true;
  $("questionnote").textContent = sentences([answer.why, ...(compared?.notes ?? fit?.notes ?? [])]);
  const rows = Object.entries(fit?.values ?? {}).map(([name, value]) => {
    const i = fit.intervals[name], local = fit.deviation[name];
    return [name, `${number(value)}\u00a0${unit(fit.units[name])}`.trim(), i ? `${end(i.low, i.low_end)} to ${end(i.high, i.high_end)}` : "–", local == null ? "open" : `± ${number(local)}`];
  });
  for (const c of compared?.candidates ?? []) rows.push([c.name, c.fit ? `weight ${number(c.weight)}` : c.why, c.fit ? `BIC worse by ${number(c.worse_by_bic)}` : "", ""]);
  for (const e of experiments) rows.push([e.name, e.gain == null ? e.why : `would tell ${number(e.gain)} bits`, "", ""]);
  fill($("answers"), ["", "value", `${number(100 * (fit?.level ?? 0.95))} % interval`, "deviation"], rows);
}
