// Plots by Plotly, in the colours of the page. Plotly is part of the installed package and is loaded for the first plot.

import { make, number, wrong } from "../basics/requests_and_dom.js";
import * as outcomes from "../basics/outcome_colours.js";
import { lines, words } from "../basics/axis_labels.js";

// Buttons to remove, because they would upload plots to Plotly.
const AWAY = ["sendChartToCloud", "sendDataToCloud", "editInChartStudio"];
const tools = () => ({
  responsive: true, displaylogo: false, displayModeBar: window.innerWidth < 600 ? false : "hover", plotlyServerURL: "",
  modeBarButtonsToRemove: ["lasso2d", "autoScale2d", ...AWAY],
});
const drawn = new Set(), schemes = [];
let loading = null;

export const plotly = () => (loading ??= new Promise((resolve, reject) => {
  const script = make("script", { src: "/page/plotly.min.js" });
  script.addEventListener("load", () => resolve(window.Plotly));
  script.addEventListener("error", () => { loading = null; reject(new Error("the plots could not be loaded")); });
  document.head.append(script);
}));

export function inks() {
  const style = getComputedStyle(document.documentElement), get = (name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: get("ink"), soft: get("soft"), line: get("line"), paper: get("paper"), accent: get("accent") };
}

const ROOM = 42, NARROW = 30; // most characters in a line of a title

export const axis = (text, more = {}, room = window.innerWidth < 600 ? NARROW : ROOM) => ({ title: { text: lines(text, room), font: { size: text.length > 60 ? 11 : 13 }, standoff: 8 }, automargin: true, zeroline: false, ...more });

// The layout with the colours of the page for background, texts and axes.
function colored(layout) {
  const { ink, soft, accent, line } = inks(), out = {
    modebar: { bgcolor: "rgba(0,0,0,0)", color: soft, activecolor: accent },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: "system-ui, sans-serif", size: 12.5, color: ink } };
  for (const name of Object.keys(layout)) if (/^[xy]axis\d*$/.test(name)) out[name] = { ...layout[name], gridcolor: line, linecolor: line, tickcolor: line };
  return { ...layout, ...out };
}

export const legend = { showlegend: true, legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" } };

// Draws a plot into a box. said: description for screen readers. Returns null if the box is hidden.
export async function draw(box, traces, layout, said) {
  const P = await plotly();
  if (!box.isConnected || box.closest("[hidden]")) return null;
  box.setAttribute("aria-label", said);
  drawn.add(box);
  await P.react(box, traces, colored({ margin: { l: 20, r: 16, t: window.innerWidth < 600 ? 16 : 30, b: 20 }, showlegend: false, hovermode: "closest", ...layout }), tools());
  return box;
}

export function clear(...boxes) {
  for (const box of boxes) if (drawn.delete(box)) window.Plotly?.purge(box);
}

export function on(box, what, work) {
  box.removeAllListeners?.(what);
  box.on?.(what, work);
}

// Adds a function that redraws when the colour scheme changes.
export const onScheme = (work) => schemes.push(work);

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", async () => {
  for (const box of drawn) if (box.isConnected && box.layout) window.Plotly.relayout(box, colored(box.layout));
  for (const work of schemes) await Promise.resolve(work()).catch(wrong);
});

const look = (outcome) => ({ color: outcomes.of(outcome).color, symbol: outcomes.symbol(outcomes.of(outcome)), size: 8 });

// The traces of cases as points, one trace for each outcome. chosen: function that tells whether a case is highlighted; null
// highlights all.
export function points(rows, at, x, y, text, chosen) {
  const known = rows.map(y).filter((v) => v != null && Number.isFinite(v)), low = Math.min(...known), high = Math.max(...known);
  const floor = known.length ? low - 0.06 * ((high - low) || Math.abs(low) || 1) : 0; // height of cases without a value, below all values
  const names = [...new Set(rows.map((r) => r[at]))].sort((a, b) => (a === "done" ? -1 : b === "done" ? 1 : a < b ? -1 : 1));
  const told = (outcome) => ({ type: "scatter", mode: "markers", name: outcomes.said(outcome), legendgroup: outcome, x: [null], y: [null], marker: look(outcome) }); // gives the legend an entry with full opacity
  return names.flatMap((outcome) => {
    const mine = rows.filter((r) => r[at] === outcome), size = mine.length > 1000 ? 4 : mine.length > 200 ? 5.5 : 8;
    const opacity = chosen ? mine.map((r) => (chosen(r) ? 0.95 : 0.12)) : mine.length > 1000 ? 0.6 : 0.9;
    const drawn = { type: "scatter", mode: "markers", name: outcomes.said(outcome), legendgroup: outcome, showlegend: !chosen, x: mine.map(x), y: mine.map((r) => y(r) ?? floor), customdata: mine.map((r) => r[0]), text: mine.map(text), hovertemplate: "%{text}<extra></extra>", marker: { ...look(outcome), size, opacity } };
    return chosen ? [drawn, told(outcome)] : [drawn];
  });
}

export const hover = (columns, row) => row.map((v, i) => [columns[i], v]).filter(([c, v]) => v !== "" && v != null && !c.name.startsWith("audit") && c.name !== "outcome.advice" && c.name !== "version").slice(0, 14).map(([c, v]) => `${words(c)} = ${typeof v === "number" ? number(v) : v}`).join("<br>");
