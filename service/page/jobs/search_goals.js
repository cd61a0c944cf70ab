// The target, the constraints and the best case of a search, drawn over the results of its cases.

import { number } from "../basics/requests_and_dom.js";
import * as charts from "../plots/plotly.js";
import { unit } from "../basics/axis_labels.js";

const TOLD = 1e-6; // relative distance from the target above which the page reports a miss

// The levels of a result: [value, text].
function levels(answer, of) {
  const bounds = answer.within.filter((w) => w.of === of).flatMap((w) => [[w.low, "at least"], [w.high, "at most"]]);
  return [...(answer.of === of ? [[answer.target, "target"]] : []), ...bounds].filter(([value]) => value != null);
}

// A text that states whether the best case misses the target or a constraint.
export function missed(answer, table) {
  const by = answer.constraints_missed, u = unit(table.column(answer.of)?.unit);
  if (!answer.feasible) return by == null ? "no case has a value" : `no case satisfies all constraints; the nearest case, ${answer.case}, misses them by ${number(by)} of their scales`;
  return Math.abs(answer.off_target) > TOLD * Math.abs(answer.target) ? `the nearest case, ${answer.case}, is off target by ${number(answer.off_target)} ${u}`.trim() : "";
}

// Plotly's shapes and annotations for the plot of a result. of: name of the result. at: abscissa of the best case.
export function drawn(answer, table, of, at) {
  if (answer?.kind !== "optimise") return { shapes: [], annotations: [] };
  const { ink } = charts.inks(), found = levels(answer, of), y = answer.results[of];
  const shapes = found.map(([value, text]) => ({ type: "line", xref: "paper", x0: 0, x1: 1, y0: value, y1: value, line: { color: ink, width: 1.5, dash: text === "target" ? "solid" : "dash" } }));
  const word = { showarrow: false, xref: "paper", x: 1, xanchor: "right", yanchor: "bottom", font: { size: 11, color: ink } };
  const annotations = found.map(([value, text]) => ({ ...word, y: value, text: `${text} ${number(value)} ${unit(table.column(of).unit)}`.trim() }));
  const best = { x: at, y, text: missed(answer, table) ? "nearest miss" : "best", showarrow: true, arrowhead: 0, ax: 0, ay: -28, font: { size: 11, color: ink }, arrowcolor: ink };
  return { shapes, annotations: y == null || at == null ? annotations : [...annotations, best] };
}
