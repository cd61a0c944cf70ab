// Parallel coordinates, with one axis for each varied number and one for the result. A case is a line through its values. For very
// many cases, the density between neighbouring axes is shaded. The user selects a range by dragging along an axis, or by typing
// numbers.

import { $, breaking, make, number } from "../basics/requests_and_dom.js";
import { inks } from "./plotly.js";
import * as outcomes from "../basics/outcome_colours.js";
import { lines, title } from "../basics/axis_labels.js";

const MOST = 10, TOP = 64, FOOT = 18, HIGH = 320, LEAST = 116, SIDE = 76, BINS = 24; // most axes; margins above and below, height, least distance of axes, margin at the sides, all in px; bins of each axis
let axes = [], selection = new Map(), tell = () => {}, paint = () => {}, watcher = null;

export function clear() {
  $("parallel").replaceChildren();
  watcher?.disconnect();
  axes = [];
}

export async function draw(box, table, up, chosen, changed, still) {
  const columns = [...table.paths.slice(0, MOST - 1), table.column(up)];
  const pairs = table.large ? await Promise.all(columns.slice(1).map((c, i) => table.bins(columns[i].name, c.name, "", { nx: BINS, ny: BINS }))) : null;
  const some = table.large && chosen.size ? await Promise.all(columns.slice(1).map((c, i) => table.bins(columns[i].name, c.name, "", { nx: BINS, ny: BINS, within: chosen }))) : null;
  if (!still()) return;
  [selection, tell] = [chosen, changed];
  axes = columns.map((c, i) => ({ c, ...(pairs ? ends((pairs[i]?.x ?? pairs[i - 1].y).edges) : ends(table.rows.map((r) => r[table.at(c.name)]))) }));
  const canvas = make("canvas", { role: "img", "aria-label": `parallel coordinates of ${columns.map((c) => c.name).join(", ")}` });
  const scroll = make("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "parallel coordinates" }, canvas);
  const open = box.querySelector("details")?.open, focus = box.contains(document.activeElement) ? document.activeElement.dataset.of : null;
  box.replaceChildren(scroll, numbers(open));
  if (focus) [...box.querySelectorAll("input")].find((n) => n.dataset.of === focus)?.focus();
  paint = () => (pairs ? shaded(canvas, pairs, some) : lined(canvas, table));
  brush(canvas);
  watcher?.disconnect();
  watcher = new ResizeObserver(() => paint());
  watcher.observe(scroll);
}

function ends(values) {
  const known = values.filter((v) => v != null && Number.isFinite(v)), low = Math.min(...known), high = Math.max(...known);
  return !known.length ? { low: 0, high: 1 } : low < high ? { low, high } : { low: low - 0.5, high: high + 0.5 };
}

const spot = (k) => SIDE + k * gap();
let wide = 600;
const gap = () => (wide - 2 * SIDE) / Math.max(1, axes.length - 1);
const height = (a, v) => TOP + (HIGH - TOP - FOOT) * (1 - (v - a.low) / (a.high - a.low));
const value = (a, y) => a.low + (a.high - a.low) * Math.min(1, Math.max(0, 1 - (y - TOP) / (HIGH - TOP - FOOT)));

function sheet(canvas) {
  const ratio = window.devicePixelRatio || 1;
  wide = Math.max(canvas.parentElement.clientWidth, LEAST * (axes.length - 1) + 2 * SIDE);
  Object.assign(canvas, { width: wide * ratio, height: HIGH * ratio });
  Object.assign(canvas.style, { width: `${wide}px`, height: `${HIGH}px` });
  const ctx = canvas.getContext("2d");
  ctx.scale(ratio, ratio);
  return ctx;
}

const within = (v, [low, high]) => v != null && (low == null || v >= low) && (high == null || v <= high);

function lined(canvas, table) {
  const ctx = sheet(canvas), at = axes.map((a) => table.at(a.c.name)), outcome = table.at("outcome"), { soft } = inks();
  const chosen = (r) => [...selection].every(([name, e]) => within(r[table.at(name)], e));
  const line = (r) => {
    ctx.beginPath();
    let down = false;
    at.forEach((i, k) => { if (r[i] == null) { down = false; return; } if (down) ctx.lineTo(spot(k), height(axes[k], r[i])); else ctx.moveTo(spot(k), height(axes[k], r[i])); down = true; });
    ctx.stroke();
  };
  const grey = selection.size ? table.rows.filter((r) => !chosen(r)) : [], full = selection.size ? table.rows.filter(chosen) : table.rows;
  Object.assign(ctx, { strokeStyle: soft, globalAlpha: 0.08, lineWidth: 1 });
  grey.forEach(line);
  for (const r of [...full].sort((a, b) => (a[outcome] === "done" ? 0 : 1) - (b[outcome] === "done" ? 0 : 1))) {
    Object.assign(ctx, { strokeStyle: outcomes.of(r[outcome]).color, globalAlpha: r[outcome] === "done" ? Math.max(0.12, Math.min(0.8, 60 / full.length)) : 0.7, lineWidth: 1.2 });
    ctx.setLineDash(outcomes.isEarly(r[outcome]) ? [4, 3] : []);
    line(r);
  }
  ctx.setLineDash([]);
  ruled(ctx);
}

function shaded(canvas, pairs, some) {
  const ctx = sheet(canvas), { soft, accent } = inks();
  const layer = (all, color, strong) => all.forEach((got, k) => {
    const c = got.cells, most = Math.max(...pairs[k].cells.cases);
    c.x.forEach((i, n) => {
      const [a, b] = [axes[k], axes[k + 1]], y = [height(a, got.x.edges[i]), height(a, got.x.edges[i + 1]), height(b, got.y.edges[c.y[n] + 1]), height(b, got.y.edges[c.y[n]])];
      Object.assign(ctx, { fillStyle: color, globalAlpha: strong * (c.cases[n] / most) ** 0.7 });
      ctx.beginPath();
      ctx.moveTo(spot(k), y[0]); ctx.lineTo(spot(k), y[1]); ctx.lineTo(spot(k + 1), y[2]); ctx.lineTo(spot(k + 1), y[3]);
      ctx.fill();
    });
  });
  layer(pairs, some ? soft : accent, some ? 0.02 : 0.06); // nearly transparent, because about twenty bands overlap at each point
  if (some) layer(some, accent, 0.2);
  ruled(ctx);
}

// Draws the axes with their titles, ends and selected ranges.
function ruled(ctx) {
  const { ink, accent, paper } = inks();
  ctx.globalAlpha = 1;
  axes.forEach((a, k) => {
    const x = spot(k), e = selection.get(a.c.name);
    Object.assign(ctx, { strokeStyle: ink, lineWidth: 1.4, fillStyle: ink, textAlign: "center", font: "600 11px system-ui, sans-serif" });
    ctx.beginPath(); ctx.moveTo(x, TOP); ctx.lineTo(x, HIGH - FOOT); ctx.stroke();
    lines(title(a.c), Math.floor(Math.min(gap(), 2 * SIDE) / 6.4)).split("<br>").slice(0, 4).forEach((text, i) => ctx.fillText(text, x, 11 + 12 * i));
    ctx.font = "11px system-ui, sans-serif";
    for (const [v, y] of [[a.high, TOP - 4], [a.low, HIGH - 5]]) ctx.fillText(number(+v.toPrecision(4)).replace(/\.?0+e/, "e"), x, y);
    ctx.textAlign = "left";
    for (const f of [0.25, 0.5, 0.75]) {
      const v = a.low + f * (a.high - a.low), y = height(a, v), text = number(+v.toPrecision(3)).replace(/\.?0+e/, "e");
      Object.assign(ctx, { lineWidth: 4, strokeStyle: paper, fillStyle: ink });
      ctx.strokeText(text, x + 6, y + 4); ctx.fillText(text, x + 6, y + 4);
      Object.assign(ctx, { lineWidth: 1.4, strokeStyle: ink });
      ctx.beginPath(); ctx.moveTo(x - 3, y); ctx.lineTo(x + 3, y); ctx.stroke();
    }
    if (!e) return;
    const [low, high] = [height(a, Math.max(a.low, e[0] ?? a.low)), height(a, Math.min(a.high, e[1] ?? a.high))];
    Object.assign(ctx, { fillStyle: accent, globalAlpha: 0.35 });
    ctx.fillRect(x - 7, high, 14, Math.max(3, low - high));
    ctx.globalAlpha = 1;
  });
}

function brush(canvas) {
  let held = null;
  const where = (e) => { const b = canvas.getBoundingClientRect(); return [e.clientX - b.left, e.clientY - b.top]; };
  canvas.addEventListener("pointerdown", (e) => {
    const [x, y] = where(e), k = axes.findIndex((_, i) => Math.abs(spot(i) - x) < 22);
    if (k < 0) return;
    held = { k, from: y };
    canvas.setPointerCapture(e.pointerId);
    e.preventDefault();
  });
  canvas.addEventListener("pointermove", (e) => {
    const [x, y] = where(e);
    canvas.style.cursor = axes.some((_, i) => Math.abs(spot(i) - x) < 22) ? "ns-resize" : "";
    if (!held) return;
    const a = axes[held.k], now = [value(a, held.from), value(a, y)].sort((p, q) => p - q);
    selection = new Map(selection).set(a.c.name, now);
    paint();
  });
  canvas.addEventListener("pointerup", (e) => {
    if (!held) return;
    const [, y] = where(e), name = axes[held.k].c.name, now = new Map(selection);
    if (Math.abs(y - held.from) < 4) now.delete(name); // a click without dragging clears the selection
    held = null;
    tell(now);
  });
}

// Input fields, in which the user types the selected range by the keyboard.
function numbers(open) {
  const rows = axes.map(({ c, low, high }) => {
    const ends = [0, 1].map((i) => make("input", { type: "number", step: "any", class: "short", "data-of": `${c.name} ${i}`, "aria-label": `${i ? "most" : "least"} ${c.name}`, placeholder: number(+(i ? high : low).toPrecision(4)), value: selection.get(c.name)?.[i] ?? "" }));
    const change = () => {
      const now = new Map(selection), [a, b] = ends.map((n) => (n.value === "" ? null : +n.value));
      if (a == null && b == null) now.delete(c.name); else now.set(c.name, [a, b]);
      tell(now);
    };
    for (const n of ends) n.addEventListener("change", change);
    return make("li", {}, make("span", {}, ...breaking(c.name)), make("span", { class: "ends" }, ends[0], " to ", ends[1]));
  });
  return make("details", { open }, make("summary", {}, "Select by numbers"), make("ul", { class: "ranges" }, ...rows), make("p", { class: "help" }, "Or drag along an axis of the plot; a click clears the selection."));
}
