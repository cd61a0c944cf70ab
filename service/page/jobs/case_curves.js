// Plots cases against time: several cases and columns, with marked events. A cursor sets the time of the animation.

import { $, ask, choices, downloads, few, later, make, notice, number, wrong } from "../basics/requests_and_dom.js";
import * as charts from "../plots/plotly.js";
import * as motion from "./case_animation.js";
import * as outcomes from "../basics/outcome_colours.js";
import * as router from "../basics/router.js";
import { title, unit, words } from "../basics/axis_labels.js";

const MOST_CASES = 12, MOST_COLUMNS = 6, MOST_EVENTS = 200, DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const STROKES = ["none", "6 4", "2 3", "6 3 2 3", "11 4", "11 3 2 3"];
let job = null, table = null, offered = [], shown = [], kept = new Map(), turn = 0, span = [0, 1], at = 0;

export const start = motion.start;

// onCase: called with the number of a case that is played.
export function begin(onCase) {
  motion.begin((t) => cursor(t, true), onCase);
  const again = later(() => drawn(), 250);
  $("cases").addEventListener("input", again);
  $("marked").addEventListener("change", again);
  $("addcolumn").addEventListener("click", () => { add($("column").value); drawn().catch(wrong); });
  $("at").addEventListener("input", () => cursor(+$("at").value));
  $("timeplot").addEventListener("pointerdown", (e) => { if (e.button === 0) dragged(e); });
  $("timeplot").addEventListener("pointermove", (e) => { if (e.buttons & 1) dragged(e); });
  charts.onScheme(() => job && drawn());
  window.addEventListener("resize", later(async () => line(), 100));
}

export function clear() {
  [job, table, offered, shown, kept] = [null, null, [], [], new Map()];
  turn++;
  charts.clear($("timeplot"));
  motion.clear();
  $("column").replaceChildren();
  $("cases").value = "0";
  for (const id of ["shown", "casevalues", "casedownloads"]) $(id).replaceChildren();
}

export async function changed(now, rows, query) {
  const fresh = !job;
  [job, table] = [now, rows];
  if (fresh) {
    const { scene, optimise } = table.request;
    if (query?.get("cases")) $("cases").value = query.get("cases");
    else $("cases").value = String((optimise ? (await table.answer())?.case : null) ?? (await earliest()) ?? 0);
    if (job?.id !== now.id) return;
    offered = (await ask("POST", "/v1/scenes/check", { scene })).columns;
    if (job?.id !== now.id) return;
    choices($("column"), offered.map((c) => [c.name, words(c), c.name]));
    const asked = (query?.get("columns") ?? "").split(" ").filter((n) => offered.some((c) => c.name === n));
    const first = offered.find((c) => c.name.endsWith(".normal_force")) ?? offered.find((c) => /\.q\[1\]$/.test(c.name)) ?? offered[0];
    for (const name of asked.length ? asked : [first.name]) add(name);
    await drawn();
  } else if (missing) await drawn();
}

// The first case with the outcome done or, without such a case, the first case.
async function earliest() {
  if (table.rows) return (table.rows.find((r) => r[table.at("outcome")] === "done") ?? table.rows[0])?.[0];
  const of = (words) => table.bins("case", "", "", { nx: 1, words }).then((got) => got.cells.first[0]);
  return (await of(["outcome=done"])) ?? of([]);
}

// Shows the case n, which was selected in another plot. more: whether the other shown cases stay.
export function choose(n, more) {
  const now = more ? [...wanted().filter((k) => k !== n), n] : [n];
  $("cases").value = now.slice(-MOST_CASES).join(", ");
  motion.prefer(n);
  $("cases").dispatchEvent(new Event("change"));
  drawn().catch(wrong);
}

// Hides the curves of a case.
export function drop(n) {
  $("cases").value = wanted().filter((k) => k !== n).join(", ");
  drawn().catch(wrong);
}

export function wanted() {
  if (!job) return [];
  const out = [];
  for (const part of $("cases").value.split(/[,;\s]+/).filter(Boolean)) {
    const [a, b] = part.split("-").map(Number);
    for (let n = a; n <= (b ?? a) && out.length < MOST_CASES; n++) if (Number.isInteger(n) && n >= 0 && n < job.cases) out.push(n);
  }
  return [...new Set(out)].slice(0, MOST_CASES);
}

function add(name) {
  if (!name || shown.includes(name)) return;
  if (shown.length === MOST_COLUMNS) { notice(`At most ${MOST_COLUMNS} columns can be drawn at a time.`); return; }
  shown.push(name);
  const said = words(offered.find((c) => c.name === name)), chip = make("li", { title: name }, said, " ", make("button", { type: "button", "aria-label": `do not show ${said}`, onclick: () => { shown = shown.filter((n) => n !== name); chip.remove(); $("addcolumn").focus(); drawn().catch(wrong); } }, "×"));
  $("shown").append(chip);
}

let missing = false;

// Rows and events of a case. The case runs again on the server, and the browser caches the result.
async function one(n, columns) {
  const there = `/v1/jobs/${job.id}/cases/${n}`, key = `${n} ${columns.join(" ")}`;
  if (!kept.has(key)) {
    const got = await ask("GET", `${there}/trajectory?format=json` + columns.map((c) => `&outputs=${encodeURIComponent(c)}`).join(""));
    kept.set(key, { columns: got.columns, rows: got.rows });
  }
  if ($("marked").checked && !kept.has(`${n} events`)) kept.set(`${n} events`, await ask("GET", `${there}/events`));
  return { ...kept.get(key), events: $("marked").checked ? kept.get(`${n} events`).events : [] };
}

async function drawn() {
  const mine = ++turn, numbers = wanted(), columns = [...shown], id = job.id;
  router.remember({ ...(numbers.length ? { cases: numbers.join(",") } : {}), ...(columns.length ? { columns: columns.join(" ") } : {}) });
  const heads = await Promise.all(numbers.map((n) => table.row(n)));
  if (mine !== turn || id !== job?.id) return;
  missing = heads.some((r) => !r);
  told(numbers, heads);
  const runs = numbers.filter((_, i) => heads[i] && heads[i][table.at("outcome")] !== "invalid");
  $("casedownloads").replaceChildren(...(runs.length ? [`Case ${runs[0]}:`, ...downloads(`/v1/jobs/${id}/cases/${runs[0]}/trajectory`)] : []));
  if (!runs.length) motion.offer(job, []);
  if (!runs.length || !columns.length) { charts.clear($("timeplot")); $("at").disabled = true; return; }
  const all = await Promise.all(runs.map((n) => one(n, columns)));
  if (mine !== turn || id !== job?.id) return;
  const some = runs.filter((_, i) => all[i].rows.length); // a case may end before its first row
  motion.offer(job, some);
  if (some.length) await plotted(numbers, some, columns, all.filter((c) => c.rows.length));
  else { charts.clear($("timeplot")); $("at").disabled = true; }
}

// Lists the shown cases with mark, parameter values and outcome.
function told(numbers, heads) {
  $("casevalues").replaceChildren(...numbers.map((n, i) => {
    const r = heads[i], mark = outcomes.mark({ color: outcomes.color(i), shape: "square" });
    if (!r) return make("li", {}, mark, ` case ${n}: no result yet`);
    const of = (name) => r[table.at(name)], values = table.paths.map((c) => `${words(c)} = ${number(of(c.name))} ${unit(c.unit)}`.trim()).join(", ");
    const end = `${outcomes.said(of("outcome"))}${of("outcome.joint") ? ` in ${of("outcome.joint")}` : ""}${of("outcome.advice") ? `: ${of("outcome.advice")}` : ""}`;
    return make("li", {}, mark, make("b", {}, ` case ${n}`), `: ${values}; ${end}${of("audit.note") ? `; ${of("audit.note")}` : ""}${of("error.why") ? `; no errors are stated (${of("error.why")})` : ""}`);
  }));
}

async function plotted(numbers, runs, columns, found) {
  const about = columns.map((name) => found[0].columns.find((c) => c.name === name)), units = [...new Set(about.map((c) => c.unit))];
  dashed();
  const traces = [], layout = { hovermode: "x", dragmode: false, xaxis: charts.axis("time (s)", { anchor: `y${units.length > 1 ? units.length : ""}` }), shapes: [] };
  units.forEach((u, k) => {
    const mine = about.filter((c) => c.unit === u), room = 1 / units.length;
    layout[`yaxis${k ? k + 1 : ""}`] = charts.axis(mine.length === 1 ? title(mine[0]) : unit(u) ? `${mine.length} columns (${unit(u)})` : `${mine.length} columns`, { domain: [1 - (k + 1) * room + 0.03 * (k < units.length - 1), 1 - k * room - 0.03 * (k > 0)] }, Math.floor(42 / units.length));
  });
  span = [0, 0];
  runs.forEach((n, i) => {
    const { rows, columns: has, events } = found[i], color = outcomes.color(numbers.indexOf(n)), times = rows.map((r) => r[0]);
    span[1] = Math.max(span[1], times.at(-1) ?? 0);
    about.forEach((c, k) => {
      const y = has.findIndex((h) => h.name === c.name), yaxis = `y${units.indexOf(c.unit) ? units.indexOf(c.unit) + 1 : ""}`;
      const name = [runs.length > 1 ? `case ${n}` : "", columns.length > 1 ? words(c) : ""].filter(Boolean).join(", ") || words(c);
      traces.push({ type: "scatter", mode: "lines", name, x: times, y: rows.map((r) => r[y]), yaxis, line: { color, dash: DASHES[k % 6], width: 1.7 }, hovertemplate: "%{y:.5g}" });
      if (k || !events.length) return;
      const marked = events.slice(0, MOST_EVENTS), near = marked.map((e) => between(times, rows, y, e.time));
      traces.push({ type: "scatter", mode: "markers", name: `events of case ${n}`, showlegend: false, x: marked.map((e) => e.time), y: near, yaxis, text: marked.map((e) => e.text), hovertemplate: "%{text}<extra></extra>", marker: { symbol: "diamond-open", size: 9, color, line: { width: 2 } } });
      for (const e of marked.slice(0, 60)) layout.shapes.push({ type: "line", x0: e.time, x1: e.time, yref: "paper", y0: 0, y1: 1, line: { color, width: 0.8, dash: "dot" }, opacity: 0.6 });
    });
  });
  const what = `${columns.map((c, k) => words(about[k])).join("; ")} of ${few(runs.length, "case")} against time, events marked`;
  if (!(await charts.draw($("timeplot"), traces, layout, what))) return;
  Object.assign($("at"), { disabled: false, min: 0, max: span[1], step: span[1] / 1000 || 0.001 });
  charts.on($("timeplot"), "plotly_afterplot", line);
  charts.on($("timeplot"), "plotly_relayout", line);
  cursor(Math.min(at, span[1]));
}

// Shows the line style of each column in the legend. Colours distinguish the cases.
function dashed() {
  [...$("shown").children].forEach((chip, k) => {
    chip.querySelector("svg")?.remove();
    if (shown.length > 1) chip.prepend(outcomes.stroke(STROKES[k % 6]));
  });
}

// The value of a column at time t, interpolated linearly between the rows, as the curve is.
function between(times, rows, y, t) {
  const i = lowest(times, t), [a, b] = [rows[Math.max(0, i - 1)]?.[y], rows[i]?.[y]], step = times[i] - times[i - 1];
  return i && a != null && b != null && step > 0 && t < times[i] ? a + ((b - a) * (t - times[i - 1])) / step : b;
}

function lowest(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) { const m = (low + high) >> 1; if (times[m] < t) low = m + 1; else high = m; }
  return low;
}

// Moves the cursor over the curves to time t. The animation moves, too, unless it caused the move (told).
function cursor(t, told = false) {
  at = Math.min(span[1], Math.max(span[0], t));
  $("at").value = at;
  $("attime").textContent = `${number(+at.toPrecision(5))} s`;
  $("at").setAttribute("aria-valuetext", $("attime").textContent);
  if (!told) motion.seek(at);
  line();
}

// Moves the cursor to the pointer.
function dragged(e) {
  const x = $("timeplot")._fullLayout?.xaxis, place = e.clientX - $("timeplot").getBoundingClientRect().left - (x?._offset ?? 0);
  if (x?.p2l && place >= -9 && place <= x._length + 9) cursor(x.p2l(place));
}

function line() {
  const box = $("timeplot"), x = box._fullLayout?.xaxis;
  let rule = box.querySelector(".rule");
  if (!x?.l2p) { rule?.remove(); return; }
  if (!rule) box.append(rule = make("div", { class: "rule", "aria-hidden": "true" }));
  const place = x._offset + x.l2p(at);
  rule.hidden = place < x._offset - 1 || place > x._offset + x._length + 1;
  rule.style.left = `${place}px`;
}
