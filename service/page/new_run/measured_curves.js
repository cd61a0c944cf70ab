// Measured curves for a fit, from a CSV file. The file has the time in s, then the curves in SI units. Each curve is assigned to a
// column of the scene.

import { $, choices, make, notice } from "../basics/requests_and_dom.js";
import { words } from "../basics/axis_labels.js";

const UNUSED = "-";
let time = [], curves = [], columns = [];

export function begin(changed) {
  $("measured").addEventListener("change", async () => { read(await $("measured").files[0].text()); changed(); });
  $("curvesof").addEventListener("change", changed);
}

// Offers the columns of the scene for each curve. At first, a curve is assigned to the column that has the curve's name.
export function offer(found) {
  columns = found;
  for (const [k, select] of [...$("curvesof").querySelectorAll("select")].entries()) {
    const options = [[UNUSED, "not used"], ...columns.map((c) => [c.name, words(c), c.name])];
    choices(select, options, columns.find((c) => c.name === curves[k].name)?.name ?? (k ? UNUSED : columns.find((c) => /[.]q\[1\]$/.test(c.name))?.name));
  }
}

function read(text) {
  const [heads, ...rows] = text.trim().split(/\r?\n/).map((line) => line.split(/[,;\t]/).map((x) => x.trim().replace(/^"|"$/g, "")));
  const numbers = rows.map((row) => row.map(Number));
  const bad = numbers.findIndex((row) => row.length !== heads.length || row.some((x) => !Number.isFinite(x)));
  notice(bad >= 0 ? `Line ${bad + 2} of the file does not have a number for each of the ${heads.length} columns in line 1.` : "");
  if (bad >= 0) return;
  time = numbers.map((row) => row[0]);
  curves = heads.slice(1).map((name, k) => ({ name, values: numbers.map((row) => row[k + 1]) }));
  $("curvesof").replaceChildren(...curves.map((c) => make("label", {}, `${c.name} is `, make("select"))));
  offer(columns);
}

export function runs() {
  const of = [...$("curvesof").querySelectorAll("select")].map((s) => s.value), used = of.map((name, k) => [name, curves[k]?.values]).filter(([name]) => name && name !== UNUSED);
  return used.length ? [{ time, curves: Object.fromEntries(used) }] : [];
}
