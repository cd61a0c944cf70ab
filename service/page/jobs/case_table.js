// A table of the cases, sorted by a column and filtered by a text. Each case whose curves are shown has a tick.

import { $, few, later, make, number } from "../basics/requests_and_dom.js";
import * as cases from "./case_curves.js";
import * as outcomes from "../basics/outcome_colours.js";
import { title } from "../basics/axis_labels.js";

const MOST = 200, MOST_RESULTS = 8; // largest numbers of shown rows and results
let table = null, by = "case", down = false;

export function begin() {
  $("filter").addEventListener("input", later(async () => draw(), 150));
  $("casetable").addEventListener("toggle", draw);
  $("cases").addEventListener("change", draw);
}

export function changed(now) {
  table = now;
  $("casetable").hidden = !now?.rows;
  if (now && !now.columns.some((c) => c.name === by)) [by, down] = ["case", false];
  draw();
}

const shown = () => [table.column("case"), ...table.paths, table.column("outcome"), ...table.results.slice(0, MOST_RESULTS)];
const said = (v) => (typeof v === "number" ? number(v) : v == null ? "–" : outcomes.said(String(v)));

function draw() {
  if (!table?.rows || !$("casetable").open) return;
  const columns = shown(), places = columns.map((c) => table.at(c.name)), at = table.at(by), words = $("filter").value.trim().toLowerCase();
  const rows = table.rows.filter((r) => places.some((i) => said(r[i]).toLowerCase().includes(words)));
  const order = (a, b) => (a[at] == null ? 1 : b[at] == null ? -1 : (a[at] < b[at] ? -1 : a[at] > b[at] ? 1 : 0) * (down ? -1 : 1));
  const ticked = cases.wanted();
  $("caserows").tHead.replaceChildren(make("tr", {}, ...columns.map(head)));
  $("caserows").tBodies[0].replaceChildren(...rows.sort(order).slice(0, MOST).map((r) => make("tr", {}, ...places.map((i, k) => (k ? make("td", {}, said(r[i])) : tick(r[i], ticked))))));
  $("caserowsnote").textContent = `${few(rows.length, "case")}${rows.length > MOST ? `, the first ${MOST} are listed` : ""}`;
}

function head(c) {
  const on = c.name === by, sort = () => { [by, down] = [c.name, on && !down]; draw(); document.getElementById(`sort-${c.name}`).focus(); };
  return make("th", { scope: "col", "aria-sort": on ? (down ? "descending" : "ascending") : null }, make("button", { type: "button", id: `sort-${c.name}`, title: c.name, onclick: sort }, `${title(c)}${on ? (down ? " ▼" : " ▲") : ""}`));
}

function tick(n, ticked) {
  const box = make("input", { type: "checkbox", checked: ticked.includes(n), onchange: () => (box.checked ? cases.choose(n, true) : cases.drop(n)) });
  return make("th", { scope: "row" }, make("label", {}, box, ` ${n}`));
}
