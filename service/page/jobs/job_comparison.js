// Compares jobs. Shows the differences of their requests, and plots a result of each job over a common varied number.

import { $, ask, choices, few, fill, make, many, number, wrong } from "../basics/requests_and_dom.js";
import * as charts from "../plots/plotly.js";
import * as outcomes from "../basics/outcome_colours.js";
import { Table, middles } from "../basics/result_rows.js";
import { learn, title, unit, words } from "../basics/axis_labels.js";

const MOST = 6, MOST_DIFFERENCES = 60, SETTINGS = ["until", "every", "rtol", "method", "kernel", "cpu_limit"], ASKED = ["vary", "sample", "cases", "optimise", "refine", ...SETTINGS];
let tables = [], requests = [], turn = 0;

export function begin() {
  for (const id of ["compareup", "compareacross", "comparekind"]) $(id).addEventListener("change", () => drawn().catch(wrong));
  charts.onScheme(() => { if (tables.length) { listed(); return drawn(); } return null; });
}

export async function enter(query) {
  const mine = ++turn, ids = (query.get("jobs") ?? "").split(",").filter((x) => /^[0-9a-z]{24}$/.test(x)).slice(0, MOST);
  tables = [];
  for (const id of ["compared", "differences", "comparetable"].map((x) => $(x))) (id.tBodies?.[0] ?? id).replaceChildren();
  $("comparenote").textContent = "";
  if (ids.length < 2) { $("comparenote").textContent = "Choose at least two jobs in the list."; return leave; }
  try {
    await learn();
    const jobs = await Promise.all(ids.map((id) => ask("GET", `/v1/jobs/${id}`)));
    requests = await Promise.all(ids.map((id) => ask("GET", `/v1/jobs/${id}/request`)));
    const made = jobs.map((j, i) => new Table(j, requests[i]));
    await Promise.all(made.map((t) => t.fetch()));
    if (mine !== turn) return leave;
    tables = made;
    listed();
    differences();
    const names = (of) => of(tables[0]).filter((c) => tables.every((t) => t.column(c.name)));
    choices($("compareup"), names((t) => t.results).map((c) => [c.name, words(c), c.name]));
    choices($("compareacross"), [...names((t) => t.paths), tables[0].column("case")].map((c) => [c.name, words(c), c.name]));
    await drawn();
  } catch (e) {
    $("comparenote").textContent = e.message;
  }
  return leave;
}

const leave = () => { turn++; tables = []; charts.clear($("compareplot")); };
const look = (i) => ({ color: outcomes.color(i), shape: outcomes.shape(i) });
const named = (t) => t.job.label || t.job.scene;
const several = () => new Set(tables.map(named)).size < tables.length;
const called = (t) => (several() ? `${named(t)} (${t.job.id.slice(0, 4)})` : named(t));

function listed() {
  $("compared").replaceChildren(...tables.map((t, i) => make("li", {}, outcomes.mark(look(i)), " ", make("a", { href: `/jobs/${t.job.id}`, "data-route": true }, called(t)),` · ${few(t.job.cases, "case")}, ${t.job.state}: `, Object.entries(t.job.outcomes).map(([o, n]) => `${many(n)} ${outcomes.said(o)}`).join(", "))));
}

// Lists the fields in which the requests differ, by path.
function differences() {
  const flat = requests.map((r) => {
    const out = new Map();
    const walk = (value, path) => {
      if (value && typeof value === "object" && !(Array.isArray(value) && value.every((v) => typeof v !== "object"))) for (const [k, v] of Object.entries(value)) walk(v, path ? `${path}.${k}` : k);
      else if (value != null) out.set(path, Array.isArray(value) ? value.join(", ") : typeof value === "number" ? number(value) : String(value));
    };
    walk(r.scene, "");
    for (const key of ASKED) walk(r[key], key);
    return out;
  });
  const paths = [...new Set(flat.flatMap((f) => [...f.keys()]))].filter((p) => new Set(flat.map((f) => f.get(p))).size > 1);
  const absent = (p) => (SETTINGS.includes(p) ? "default" : "not given");
  const rows = paths.slice(0, MOST_DIFFERENCES).map((p) => [p, ...flat.map((f) => f.get(p) ?? absent(p))]);
  if (paths.length > rows.length) rows.push([`and ${paths.length - rows.length} more`, ...flat.map(() => "")]);
  fill($("differences"), ["", ...tables.map(called)], rows.length ? rows : [["none: the requests are equal", ...flat.map(() => "")]]);
}

// The bins of a job that have a mean, each as [place, mean, least, largest, cases with a value, first case].
function cells(got) {
  if (!got) return [];
  const at = middles(got.x), c = got.cells;
  return c.mean.map((mean, j) => [at[c.x[j]], mean, c.least[j], c.most[j], c.known[j], c.first[j]]).filter(([, mean]) => mean != null);
}

// The means of a job minus the means of the first job, at equal values of the varied number; [] if the jobs have no value in
// common.
function differing(mine, of, got) {
  const first = new Map(of.map(([x, mean]) => [x, mean]));
  return got.every((g) => !g || g.x.values) ? mine.filter(([x]) => first.has(x)).map(([x, mean, , , , n]) => [x, mean - first.get(x), null, null, 1, n]) : [];
}

async function drawn() {
  const mine = turn, up = $("compareup").value, across = $("compareacross").value, minus = $("comparekind").value === "difference";
  if (!up || !across) { $("comparenote").textContent = "These jobs have no common result, or no common varied number."; return; }
  const got = await Promise.all(tables.map((t) => (t.job.done ? t.bins(across, "", up, { nx: 60, words: [outcomes.COMPLETE] }) : null)));
  if (mine !== turn) return;
  const c = tables[0].column(up), x = tables[0].column(across), found = got.map(cells), apart = found.map((f) => differing(f, found[0], got));
  const shown = minus ? apart : found;
  const traces = tables.map((t, i) => ({ t, i })).slice(minus ? 1 : 0).map(({ t, i }) => {
    const { color, shape } = look(i), cell = shown[i], spread = cell.some((k) => k[4] > 1);
    return {
      type: "scatter", mode: "markers", name: called(t), x: cell.map((k) => k[0]), y: cell.map((k) => k[1]), marker: { color, symbol: shape, size: 8 },
      ...(spread ? { error_y: { type: "data", symmetric: false, array: cell.map((k) => k[3] - k[1]), arrayminus: cell.map((k) => k[1] - k[2]), color, thickness: 1, width: 0 } } : {}),
      text: cell.map(([, mean, least, most, known, first]) => (known > 1 ? `mean of ${few(known, "case")}: ${number(mean)}, ${number(least)} to ${number(most)}` : `case ${first}: ${number(mean)}`)), hovertemplate: "%{x}<br>%{text}<extra>%{fullData.name}</extra>",
    };
  });
  const about = minus ? `${title(c)}, minus ${called(tables[0])}` : title(c);
  $("compareplot").hidden = minus && traces.every((t) => !t.x.length);
  if (!$("compareplot").hidden) await charts.draw($("compareplot"), traces, { ...charts.legend, xaxis: charts.axis(title(x)), yaxis: charts.axis(about, { zeroline: minus }) }, `${words(c)} against ${words(x)} of ${tables.length} jobs${minus ? ", as differences" : ""}`);
  const none = tables.filter((_, i) => i && !apart[i].length).map(called);
  $("comparenote").textContent = minus && none.length ? `No case of ${none.join(" or ")} has the same number as a case of the first job.`
    : traces.some((t) => t.error_y) ? "Marks are means over several cases with the same number; lines go to the smallest and the largest value." : "";
  const u = unit(c.unit), put = (v) => (Number.isFinite(v) ? `${number(v)}\u00a0${u}`.trim() : "–"), mean = (f) => f.reduce((sum, k) => sum + k[1] * k[4], 0) / f.reduce((sum, k) => sum + k[4], 0);
  fill($("comparetable"), ["", "cases with a value", "least", "mean", "largest", "mean difference from the first"], tables.map((t, i) => [
    called(t), many(found[i].reduce((sum, k) => sum + k[4], 0)), put(Math.min(...found[i].map((k) => k[2]))), put(mean(found[i])), put(Math.max(...found[i].map((k) => k[3]))), i ? put(mean(apart[i])) : "–",
  ]));
}
