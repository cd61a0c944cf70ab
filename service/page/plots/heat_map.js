// Plots a result over two numbers as heat map or contours, or the density of very many cases. The data are bins of all cases.

import { few, many, number } from "../basics/requests_and_dom.js";
import * as charts from "./plotly.js";
import * as outcomes from "../basics/outcome_colours.js";
import { middles } from "../basics/result_rows.js";
import { lines, title, words } from "../basics/axis_labels.js";

// The colour scale: beside a wide plot, below a narrow plot.
const BAR = (text, box) => (box.clientWidth > 560
  ? { title: { text: lines(text, 30), side: "right", font: { size: 11 } }, thickness: 12, outlinewidth: 0 }
  : { title: { text: lines(text, 46), side: "top", font: { size: 11 } }, thickness: 10, outlinewidth: 0, orientation: "h", y: -74 / (box.clientHeight - BELOW), yanchor: "top" });
const BELOW = 128, room = (box) => (box.clientWidth > 560 ? {} : { margin: { l: 20, r: 16, t: 16, b: BELOW } }); // px for the titles and the colour scale
const fit = (n) => Math.max(8, Math.min(80, Math.round(Math.sqrt(n / 2))));

// A matrix [y][x] of the values of(k) for all cells k; null for empty cells.
function matrix(got, of) {
  const out = Array.from({ length: got.y.edges.length - 1 }, () => new Array(got.x.edges.length - 1).fill(null));
  got.cells.x.forEach((i, k) => { out[got.cells.y[k]][i] = of(k); });
  return out;
}

// Marks for the cells with failed cases. The mark shows the most frequent failure outcome of the cell. at: ordinate of the marks,
// for bins over one column.
function failing(got, at = null) {
  const c = got.cells, names = Object.keys(c.outcomes).filter((n) => n !== "done"), xs = middles(got.x), ys = got.y ? middles(got.y) : null;
  return names.map((name) => {
    const k = c.x.map((_, j) => j).filter((j) => c.outcomes[name][j] && names.every((o) => c.outcomes[o][j] <= c.outcomes[name][j]));
    const look = outcomes.of(name), edge = look.open ? { width: 1.5 } : { color: charts.inks().paper, width: k.length > 800 ? 0 : 1 };
    return {
      type: "scatter", mode: "markers", name: outcomes.said(name), x: k.map((j) => xs[c.x[j]]), y: k.map((j) => (ys ? ys[c.y[j]] : at)), customdata: k.map((j) => c.first[j]),
      text: k.map((j) => `${many(c.outcomes[name][j])} of ${few(c.cases[j], "case")}: ${outcomes.said(name)}`), hovertemplate: "%{text}<extra></extra>",
      marker: { color: look.color, symbol: outcomes.symbol(look), size: k.length > 800 ? 4 : 7, line: edge },
    };
  }).filter((t) => t.x.length);
}

// The ends of the colour scale, chosen so that a few far outliers do not extend the scale; {} (Plotly's default) without outliers.
export function span(values) {
  const known = values.filter((v) => v != null).sort((a, b) => a - b), at = (part) => known[Math.round(part * (known.length - 1))];
  if (known.length < 20) return {};
  const [least, low, high, most] = [0, 0.02, 0.98, 1].map(at), far = 2 * (high - low), top = most - high > far ? high : most, foot = low - least > far ? low : least;
  return top === most && foot === least ? {} : { zmin: foot, zmax: top };
}

// A text about the counted cases: all or selected.
const counted = (got, selection) => `${selection.size ? "" : "All "}${few(got.cases, "case")}`;

// The bins of the cases that did not end early. If all cases ended early, no cell has a value.
async function complete(table, all, names, options) {
  if (!outcomes.early(table.job)) return all;
  const got = await table.bins(...names, { ...options, words: [outcomes.COMPLETE] });
  return got.cases ? got : { ...all, cells: { ...all.cells, mean: all.cells.mean.map(() => null), cases: all.cells.cases.map(() => 0) } };
}

// Draws a result over two numbers.
export async function field(box, { table, x, y, up, selection, still }, kind) {
  const n = table.large ? fit(table.job.cases / 2) : fit(table.rows.length), got = await table.bins(x, y, up, { nx: 200, ny: 200, within: selection });
  const grid = got.x.values && got.y.values && got.x.values.length * got.y.values.length <= 3 * got.cases; // whether the cases form a grid, which has few cells for its number of cases
  const coarse = grid ? got : await table.bins(x, y, up, { nx: n, ny: n, within: selection });
  const bins = grid ? 200 : n, whole = await complete(table, coarse, [x, y, up], { nx: bins, ny: bins, within: selection });
  if (!still()) return null;
  const c = whole.cells, ends = span(c.mean), z = matrix(whole, (k) => c.mean[k]), text = matrix(whole, (k) => told(c, k, up));
  const data = { x: middles(whole.x), y: middles(whole.y), z, colorscale: "Viridis", colorbar: BAR(title(table.column(up)), box), name: "" };
  const shown = kind === "contour"
    ? { ...data, type: "contour", connectgaps: false, contours: { showlabels: true, labelfont: { size: 11, color: "white" } }, line: { width: 0.8 } }
    : { ...data, type: "heatmap" };
  const traces = [{ ...shown, ...ends, text, customdata: matrix(whole, (k) => c.first[k]), hovertemplate: `${x} = %{x}<br>${y} = %{y}<br>%{text}<extra></extra>` }, ...failing(coarse)];
  const said = `${words(table.column(up))} over ${words(table.column(x))} and ${words(table.column(y))}, ${few(coarse.cases, "case")}, as a ${kind === "contour" ? "contour plot" : "heat map"}`;
  await charts.draw(box, traces, { ...charts.legend, ...room(box), showlegend: traces.length > 1, xaxis: charts.axis(title(table.column(x))), yaxis: charts.axis(title(table.column(y))) }, said);
  const most = Math.max(0, ...c.cases), none = c.mean.filter((v) => v == null).length;
  return [
    `${counted(coarse, selection)}${most > 1 ? `, up to ${many(most)} in a cell, whose colour shows their mean` : ""}.`,
    none ? `${few(none, "cell")} without this result.` : "", traces.length > 1 ? "Marks: cells with cases whose outcome is not done; colours leave out cases that ended early." : "",
    "zmax" in ends ? `Colours cover ${number(ends.zmin)} to ${number(ends.zmax)}; some cells lie outside this range.` : "",
  ];
}

function told(c, k, up) {
  const others = Object.entries(c.outcomes).filter(([name, n]) => n[k] && name !== "done").map(([name, n]) => `${many(n[k])} ${outcomes.said(name)}`);
  const value = c.mean[k] == null ? "no value" : c.known[k] > 1 ? `mean ${number(c.mean[k])}, ${number(c.least[k])} to ${number(c.most[k])}` : number(c.mean[k]);
  return [`${up}: ${value}`, c.cases[k] > 1 ? few(c.cases[k], "case") : `case ${c.first[k]}`, ...others].join("<br>");
}

// Draws the density of very many cases, for a result over one number. Marks below the plot show cases without the result.
export async function density(box, { table, x, up, selection, still }) {
  const n = Math.max(20, Math.min(150, Math.round(Math.sqrt(table.job.cases) / 3)));
  const options = { nx: n, ny: Math.round(n / 1.5), within: selection };
  const [every, all] = await Promise.all([table.bins(x, up, "", options), table.bins(x, "", "", { nx: n, within: selection })]), got = await complete(table, every, [x, up, ""], options);
  if (!still()) return null;
  const c = got.cells, z = matrix(got, (k) => Math.log10(c.cases[k])), ends = [got.y.edges[0], got.y.edges.at(-1)], most = Math.max(1, ...c.cases);
  const ticks = [1, 10, 100, 1000, 1e4, 1e5, 1e6].filter((v) => v <= most), floor = ends[0] - 0.06 * (ends[1] - ends[0]);
  const traces = [{
    type: "heatmap", x: middles(got.x), y: middles(got.y), z, colorscale: "Viridis", zmin: 0, name: "", customdata: matrix(got, (k) => c.first[k]), text: matrix(got, (k) => few(c.cases[k], "case")),
    hovertemplate: "%{x}, %{y}<br>%{text}<extra></extra>", colorbar: { ...BAR("cases in a cell", box), tickvals: ticks.map(Math.log10), ticktext: ticks.map(many) },
  }, ...failing(all, floor)];
  const said = `${words(table.column(up))} against ${words(table.column(x))}: density of ${few(all.cases, "case")}`;
  await charts.draw(box, traces, { ...charts.legend, ...room(box), showlegend: traces.length > 1, xaxis: charts.axis(title(table.column(x))), yaxis: charts.axis(title(table.column(up))) }, said);
  const lost = Object.values(got.missing).reduce((a, b) => a + b, 0);
  return [`${counted(all, selection)}, counted in cells.`, lost ? `${few(lost, "case")} without this result.` : "", traces.length > 1 ? "Marks below: numbers at which the outcome of cases is not done." : "", "Click a cell to show one of its cases."];
}
