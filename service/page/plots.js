// What a job gave: reductions over the sweep, one case against time, and that case moving.

import { $, ask, downloads, later, make, notice, number } from "./api.js";
import * as questions from "./questions.js";

const COLORS = ["#0072b2", "#d55e00"];
const MOST = 20000;
export const LOOK = { margin: { l: 70, r: 20, t: 12, b: 50 }, font: { family: "system-ui, sans-serif", size: 13 }, showlegend: false };
export const TOOLS = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
const GROW = 2000; // ms between looks at the rows of a job that runs; ten times longer than a look takes
export const title = (text) => ({ title: { text, font: { size: text.length > 36 ? 11 : 13 } } });
const looks = (x, y) => ({ ...LOOK, xaxis: title(x), yaxis: title(y) });
let job = null, columns = [], table = null, next = 0, asked = 0, drawn = 0;

export function begin() {
  questions.begin();
  for (const id of ["across", "up"]) $(id).addEventListener("change", () => sweep().catch((e) => notice(e.message)));
  const oneCase = later((signal) => aCase(signal));
  $("case").addEventListener("input", oneCase);
  $("column").addEventListener("change", oneCase);
  $("animate").addEventListener("click", animate);
}

// Another job is looked at (fresh), or the one shown has ended.
export async function changed(now, fresh) {
  job = now;
  if (fresh) {
    $("animation").hidden = $("animationlink").hidden = true;
    for (const id of ["sweepplot", "timeplot"]) Plotly.purge($(id));
    $("case").max = job.cases - 1;
    $("case").value = 0;
    $("column").replaceChildren();
    for (const id of ["casevalues", "casedownloads", "sweepnote"]) $(id).replaceChildren();
  }
  if (fresh) questions.clear();
  if (!(await fetched())) return;
  await questions.changed(job, table);
  await aCase();
}

// Its job runs: the rows there are so far.
export async function grown(now) {
  if (Date.now() < next) return;
  next = Infinity;
  const began = Date.now();
  job = now;
  let some = false;
  try {
    some = await fetched();
  } finally {
    next = Date.now() + Math.max(GROW, 10 * (Date.now() - began));
  }
  if (some && !$("column").options.length) await aCase();
}

// The table, drawn; false when there are no rows, or another job or a later table is looked at by now.
async function fetched() {
  const id = job.id, turn = ++asked, got = await ask("GET", `/v1/jobs/${id}/results?format=json&count=${MOST}`);
  if (id !== job.id || turn < drawn) return false;
  drawn = turn;
  table = got;
  columns = table.columns;
  choices();
  if (table.rows.length) await sweep();
  return table.rows.length > 0;
}

function choices() {
  const firstKept = columns.findIndex((c) => c.name === "steps") + 1;
  const paths = columns.slice(1, columns.findIndex((c) => c.name === "outcome"));
  const option = (c) => make("option", { value: c.name }, c.unit && c.unit !== "1" ? `${c.name} (${c.unit})` : c.name);
  keep($("across"), [...paths, columns[0]].map(option));
  keep($("up"), [...columns.slice(firstKept), ...["outcome.time", "audit.energy", "steps"].map((name) => columns.find((c) => c.name === name)).filter(Boolean)].map(option));
}

function keep(select, options) {
  const before = select.value;
  select.replaceChildren(...options);
  if (options.some((o) => o.value === before)) select.value = before;
}

const place = (name) => columns.findIndex((c) => c.name === name);
const titled = (name) => { const c = columns[place(name)]; return c.unit && c.unit !== "1" ? `${name} (${c.unit})` : name; };

async function sweep() {
  const x = place($("across").value), y = place($("up").value);
  const other = columns.findIndex((c, i) => i !== x && i > 0 && i < place("outcome"));
  const good = table.rows.filter((r) => r[y] != null);
  const many = (n) => n.toLocaleString("en");
  const notes = [
    job.cases > MOST ? `Cases 0 to ${many(MOST - 1)} of ${many(job.cases)} are drawn; the table to download has all.` : "",
    good.length < table.rows.length ? `${many(table.rows.length - good.length)} of ${many(table.rows.length)} have no such number.` : "",
  ];
  $("sweepnote").textContent = notes.filter(Boolean).join(" ");
  const hover = good.map((r) => `case ${r[0]}: ${r[place("outcome")]}${r[place("audit")] === "note" ? ", with a note" : ""}` + columns.slice(1, place("outcome")).map((c, i) => `<br>${c.name} = ${number(r[i + 1])}`).join(""));
  const marker = { size: good.length > 500 ? 4 : 7, color: COLORS[0] };
  if (other > 0) Object.assign(marker, { color: good.map((r) => r[other]), colorscale: "Viridis", colorbar: { title: { text: columns[other].name, side: "right" }, thickness: 12 } });
  const trace = {
    type: "scatter", mode: "markers", x: good.map((r) => r[x]), y: good.map((r) => r[y]),
    text: hover, hovertemplate: "%{text}<br>%{y}<extra></extra>", customdata: good.map((r) => r[0]), marker,
  };
  await Plotly.react($("sweepplot"), [trace], looks(titled($("across").value), titled($("up").value)), TOOLS);
  $("sweepplot").removeAllListeners?.("plotly_click");
  $("sweepplot").on("plotly_click", (e) => { $("case").value = e.points[0].customdata; aCase().catch((x) => notice(x.message)); });
}

// The columns that the job's scene can give, however many its runs keep.
async function offered() {
  const { scene } = await ask("GET", `/v1/jobs/${job.id}/request`);
  const found = (await ask("POST", "/v1/scenes/check", { scene })).columns;
  const named = (c) => make("option", { value: c.name, title: c.description }, c.unit === "1" ? c.name : `${c.name} (${c.unit})`);
  $("column").replaceChildren(...found.map(named));
  $("column").value = (found.find((c) => c.name.endsWith(".normal_force")) || found[0]).name;
}

async function aCase(signal) {
  const id = job.id, n = +$("case").value, there = `/v1/jobs/${id}/cases/${n}/trajectory`;
  const row = table.rows.find((r) => r[0] === n) ?? (await ask("GET", `/v1/jobs/${id}/results?format=json&first=${n}&count=1`, undefined, signal)).rows[0];
  const said = row ? columns.slice(1, place("outcome")).map((c, i) => `${c.name} = ${number(row[i + 1])} ${c.unit === "1" ? "" : c.unit}`.trim()).join(", ") : "";
  const of = (name) => row[place(`outcome.${name}`)];
  const noted = row && row[place("audit.note")] ? `; ${row[place("audit.note")]}` : "";
  $("casevalues").textContent = row
    ? `${said} — ${row[place("outcome")].replace(/_/g, " ")}${of("joint") ? ` in ${of("joint")}` : ""}${of("advice") ? `: ${of("advice")}` : ""}${noted}`
    : "this case is not there (yet)";
  const run = row && row[place("outcome")] !== "invalid";
  $("casedownloads").replaceChildren(...(run ? ["Download this case:", ...downloads(there)] : []));
  $("animate").disabled = !run;
  if (!run) { Plotly.purge($("timeplot")); return; }
  if (!$("column").options.length) await offered();
  const rows = await ask("GET", `${there}?format=json&outputs=${encodeURIComponent($("column").value)}`, undefined, signal);
  if (id !== job.id) return;
  const y = rows.columns.findIndex((c) => c.name === $("column").value), unit = rows.columns[y].unit;
  const trace = { type: "scatter", mode: "lines", x: rows.rows.map((r) => r[0]), y: rows.rows.map((r) => r[y]), line: { color: COLORS[1], width: 1.6 } };
  const up = unit === "1" ? rows.columns[y].name : `${rows.columns[y].name} (${unit})`;
  await Plotly.react($("timeplot"), [trace], looks("time (s)", up), TOOLS);
  if (!$("animation").hidden) animate();
}

function animate() {
  const address = `/v1/jobs/${job.id}/cases/${+$("case").value}/animation`;
  $("animation").src = address;
  $("animation").hidden = false;
  $("animationlink").href = address;
  $("animationlink").hidden = false;
}
