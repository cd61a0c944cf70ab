// Plots all cases of a job as points, heat map, contours or parallel coordinates. The count of varied numbers decides which plots
// are offered. All plots share one selection.

import { $, choices, few, later, make, many, number, wrong } from "../basics/requests_and_dom.js";
import * as cases from "./case_curves.js";
import * as caseTable from "./case_table.js";
import * as charts from "../plots/plotly.js";
import * as goals from "./search_goals.js";
import * as heat from "../plots/heat_map.js";
import * as outcomes from "../basics/outcome_colours.js";
import * as parallel from "../plots/parallel_coordinates.js";
import { title, words } from "../basics/axis_labels.js";

const KINDS = { points: "points", heat: "heat map", contour: "contour", parallel: "parallel coordinates" };
let table = null, selection = new Map(), turn = 0, playing = null, last = null;

export function begin() {
  for (const id of ["across", "up", "by", "kind"]) $(id).addEventListener("change", () => drawn().catch(wrong));
  charts.onScheme(drawn);
  caseTable.begin();
}

export function clear() {
  table = null;
  caseTable.changed(null);
  selection = new Map();
  playing = last = null;
  turn++;
  charts.clear($("sweepplot"));
  parallel.clear();
  $("sweepnote").textContent = "";
  $("selected").hidden = $("parallel").hidden = true;
  for (const id of ["kind", "across", "up", "by"]) $(id).replaceChildren();
}

// Draws all plots after the table of the cases has changed.
export async function changed(now) {
  table = now;
  const paths = table.paths.map((c) => [c.name, words(c), c.name]), n = paths.length;
  const kinds = n === 2 ? ["heat", "contour", "points"] : n > 2 ? ["parallel", "heat", "points"] : ["points"];
  choices($("kind"), kinds.map((k) => [k, KINDS[k]]));
  choices($("across"), [...paths, ["case", "number of the case"]]);
  choices($("by"), paths, paths[1]?.[0]);
  choices($("up"), table.results.map((c) => [c.name, words(c), c.name]));
  caseTable.changed(now);
  await drawn();
}

async function drawn() {
  if (!table) return;
  const kind = $("kind").value, mine = ++turn, flat = kind === "heat" || kind === "contour";
  $("bylabel").hidden = !flat;
  $("parallel").hidden = kind !== "parallel";
  const still = () => mine === turn;
  if (kind === "parallel") await parallel.draw($("parallel"), table, $("up").value, selection, selected, still);
  if (!still()) return;
  const of = { table, x: $("across").value, y: $("by").value, up: $("up").value, selection, still }, { up } = of;
  const notes = flat && of.x !== of.y && of.x !== "case" ? await heat.field($("sweepplot"), of, kind) : table.large ? await heat.density($("sweepplot"), of) : await scatter(of);
  if (!still() || !notes) return;
  $("sweepnote").textContent = notes.filter(Boolean).join(" ");
  charts.on($("sweepplot"), "plotly_click", (e) => { const n = e.points[0].customdata; if (n != null) cases.choose(n, e.event?.shiftKey); });
  charts.on($("sweepplot"), "plotly_selected", (e) => { if (e?.range) boxed(of, e.range); });
  last = { ...of, up: flat ? of.y : up, goals: !flat };
  await Promise.all([marked(), told()]);
}

// Called with the number of the case that is played.
export function played(n) {
  playing = n;
  if (table) marked().catch(wrong);
}

// Draws the goals of a search, and a ring around the case that is played.
async function marked() {
  const { table: mine, x, up, goals: wanted, still } = last ?? {};
  if (!mine) return;
  const row = async (n) => (n == null ? null : mine.row(n)), answer = wanted ? await mine.answer() : null;
  const [here, best] = await Promise.all([row(playing), row(answer?.case)]);
  if (!still() || !$("sweepplot").layout) return;
  const [spot, { shapes, annotations }] = [[x, up].map((name) => here?.[mine.at(name)]), goals.drawn(answer, mine, up, best?.[mine.at(x)])];
  const ring = { x: spot[0], y: spot[1], text: "◯", showarrow: false, font: { size: 22, color: charts.inks().ink } };
  await window.Plotly.relayout($("sweepplot"), { shapes, annotations: spot.every((v) => v != null) ? [...annotations, ring] : annotations });
}

async function scatter({ x, up }) {
  const at = table.at("outcome"), i = table.at(x), k = table.at(up), lost = table.rows.filter((r) => r[k] == null).length;
  const traces = charts.points(table.rows, at, (r) => r[i], (r) => r[k], (r) => charts.hover(table.columns, r), selection.size ? inside : null);
  const said = `${words(table.column(up))} against ${words(table.column(x))}, ${few(table.rows.length, "case")}, outcomes by colour and shape`;
  await charts.draw($("sweepplot"), traces, { ...charts.legend, showlegend: traces.length > 1, xaxis: charts.axis(title(table.column(x))), yaxis: charts.axis(title(table.column(up))) }, said);
  return [outcomes.early(table.job) ? "Hollow marks: cases that ended early; their results cover the time until then." : "", lost ? `${few(lost, "case")} of ${many(table.rows.length)} without this result: drawn below the others.` : "", "Click a case to play it and to show its curves; shift-click to add another case."];
}

// Whether a row satisfies the selection.
const inside = (r) => [...selection].every(([name, [low, high]]) => { const v = r[table.at(name)]; return v != null && (low == null || v >= low) && (high == null || v <= high); });

const again = later(() => drawn(), 120);

function selected(now) {
  selection = now;
  again();
}

// Selects the ranges of two columns that a box in the plot covers.
function boxed({ x, y, up }, range) {
  const flat = $("kind").value === "heat" || $("kind").value === "contour", now = new Map(selection);
  now.set(x, range.x);
  now.set(flat ? y : up, range.y);
  selected(now);
}

// Shows the number of selected cases, their outcomes, and buttons for the first cases.
async function told() {
  const box = $("selected");
  box.hidden = !selection.size;
  if (!selection.size) return;
  let count, counts = {}, first = [];
  if (table.large) {
    const got = await table.bins("case", "", "", { nx: 12, within: selection });
    [count, first] = [got.cases, got.cells.first];
    for (const [name, n] of Object.entries(got.cells.outcomes)) counts[name] = n.reduce((a, b) => a + b, 0);
  } else {
    const rows = table.rows.filter(inside);
    count = rows.length;
    first = rows.slice(0, 12).map((r) => r[0]);
    for (const r of rows) counts[r[table.at("outcome")]] = (counts[r[table.at("outcome")]] ?? 0) + 1;
  }
  const conditions = [...selection].map(([name, [low, high]]) => `${words(table.column(name))} ${low == null ? "" : `from ${number(low)} `}${high == null ? "" : `to ${number(high)}`}`).join(", ");
  box.replaceChildren(
    make("p", {}, make("b", {}, `${few(count, "case")} selected`), ` (${conditions}) `, make("button", { type: "button", onclick: () => selected(new Map()) }, "Select all again")),
    make("ul", { class: "outcomes" }, ...outcomes.chips(counts)),
    make("p", { class: "row small" }, first.length ? "Show case" : "", ...first.map((n) => make("button", { type: "button", onclick: () => cases.choose(n, true) }, String(n)))));
}
