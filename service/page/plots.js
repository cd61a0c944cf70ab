// What a job gave: reductions over the sweep, one case against time, and that case moving.

import { $, ask, later, make, notice, number } from "./api.js";

const COLORS = ["#0072b2", "#d55e00"];
const MOST = 20000;
const LOOK = { margin: { l: 70, r: 20, t: 12, b: 50 }, font: { family: "system-ui, sans-serif", size: 13 }, showlegend: false };
const TOOLS = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
let job = null, columns = [], table = null;

export function begin() {
  for (const id of ["across", "up"]) $(id).addEventListener("change", () => sweep().catch((e) => notice(e.message)));
  const oneCase = later(() => aCase());
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
  }
  await fetched();
  if (table.rows.length) {
    await sweep();
    await aCase();
  }
}

async function fetched() {
  table = await ask("GET", `/v1/jobs/${job.id}/results?format=json&count=${MOST}`);
  columns = table.columns;
  const firstKept = columns.findIndex((c) => c.name === "steps") + 1;
  const paths = columns.slice(1, columns.findIndex((c) => c.name === "outcome"));
  const option = (c) => make("option", { value: c.name }, c.unit && c.unit !== "1" ? `${c.name} (${c.unit})` : c.name);
  keep($("across"), [...paths, columns[0]].map(option));
  keep($("up"), [...columns.slice(firstKept), columns.find((c) => c.name === "outcome.time"), columns.find((c) => c.name === "steps")].map(option));
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
  const hover = good.map((r) => `case ${r[0]}: ${r[place("outcome")]}` + columns.slice(1, place("outcome")).map((c, i) => `<br>${c.name} = ${number(r[i + 1])}`).join(""));
  const marker = { size: good.length > 500 ? 4 : 7, color: COLORS[0] };
  if (other > 0) Object.assign(marker, { color: good.map((r) => r[other]), colorscale: "Viridis", colorbar: { title: { text: columns[other].name, side: "right" }, thickness: 12 } });
  const trace = {
    type: "scatter", mode: other > 0 || good.length > 500 ? "markers" : "lines+markers", x: good.map((r) => r[x]), y: good.map((r) => r[y]),
    text: hover, hovertemplate: "%{text}<br>%{y}<extra></extra>", customdata: good.map((r) => r[0]), marker, line: { color: "#9cc3dd", width: 1 },
  };
  await Plotly.react($("sweepplot"), [trace], { ...LOOK, xaxis: { title: { text: titled($("across").value) } }, yaxis: { title: { text: titled($("up").value) } } }, TOOLS);
  $("sweepplot").removeAllListeners?.("plotly_click");
  $("sweepplot").on("plotly_click", (e) => { $("case").value = e.points[0].customdata; aCase().catch((x) => notice(x.message)); });
}

async function aCase() {
  const n = +$("case").value, row = table.rows.find((r) => r[0] === n);
  const said = row ? columns.slice(1, place("outcome")).map((c, i) => `${c.name} = ${number(row[i + 1])} ${c.unit === "1" ? "" : c.unit}`).join(", ") : "";
  $("casevalues").textContent = row ? `${said} — ${row[place("outcome")]}${row[place("outcome.joint")] ? ` in ${row[place("outcome.joint")]}` : ""}` : "";
  if (!row || row[place("outcome")] === "invalid") return;
  const base = `/v1/jobs/${job.id}/cases/${n}/trajectory?format=json`;
  const wanted = $("column").value;
  const rows = await ask("GET", base + (wanted ? `&outputs=${encodeURIComponent(wanted)}` : ""));
  if (!wanted) {
    const best = rows.columns.find((c) => c.name.endsWith(".normal_force")) || rows.columns[1];
    $("column").replaceChildren(...rows.columns.slice(1).map((c) => make("option", { value: c.name }, c.unit === "1" ? c.name : `${c.name} (${c.unit})`)));
    $("column").value = best.name;
  }
  const y = rows.columns.findIndex((c) => c.name === $("column").value), unit = rows.columns[y].unit;
  const trace = { type: "scatter", mode: "lines", x: rows.rows.map((r) => r[0]), y: rows.rows.map((r) => r[y]), line: { color: COLORS[1], width: 1.6 } };
  const up = unit === "1" ? rows.columns[y].name : `${rows.columns[y].name} (${unit})`;
  await Plotly.react($("timeplot"), [trace], { ...LOOK, xaxis: { title: { text: "time (s)" } }, yaxis: { title: { text: up } } }, TOOLS);
  if (!$("animation").hidden) animate();
}

function animate() {
  const address = `/v1/jobs/${job.id}/cases/${+$("case").value}/animation`;
  $("animation").src = address;
  $("animation").hidden = false;
  $("animationlink").href = address;
  $("animationlink").hidden = false;
}
