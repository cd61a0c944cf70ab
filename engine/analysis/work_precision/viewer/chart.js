"use strict";
const get = id => document.getElementById(id), svg = get("chart"), NS = "http://www.w3.org/2000/svg";
const COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7A6A00", "#8B4513", "#6A5ACD"];
const off = new Set();
let hues = 0;
const hue = {};
for (const c of study.curves) {
  const key = c.program + c.method;
  if (!(key in hue)) hue[key] = COLORS[hues++ % COLORS.length];
  c.color = hue[key];
  c.name = c.label + (c.law ? " · " + c.law : "");
}

function make(tag, attributes, parent) {
  const e = document.createElementNS(NS, tag);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  return (parent || svg).appendChild(e);
}
function text(parent, tag, words) {
  const e = document.createElement(tag);
  e.textContent = words;
  parent.appendChild(e);
  return e;
}
const finite = x => x !== null && x > 0;
const chosen = () => study.curves.filter(c => (get("law").value === "" || c.law === get("law").value) && (get("fixed").checked || !c.fixed));

function range(values, pad) {
  if (!values.length) return [-1, 1];
  const lo = Math.log10(Math.min(...values)), hi = Math.log10(Math.max(...values));
  return [lo - pad, hi + pad];
}
function power(k) { return "1e" + k; }

function axes(x, y, W, H, m, xr, yr) {
  for (let k = Math.ceil(xr[0]); k <= xr[1]; k++) {
    make("line", { class: "grid", x1: x(10 ** k), x2: x(10 ** k), y1: m.top, y2: H - m.bottom });
    make("text", { x: x(10 ** k), y: H - m.bottom + 15, "text-anchor": "middle" }).textContent = power(k);
  }
  for (let k = Math.ceil(yr[0]); k <= yr[1]; k++) {
    make("line", { class: "grid", x1: m.left, x2: W - m.right, y1: y(10 ** k), y2: y(10 ** k) });
    make("text", { x: m.left - 6, y: y(10 ** k) + 4, "text-anchor": "end" }).textContent = power(k);
  }
  make("text", { x: (m.left + W - m.right) / 2, y: H - 6, "text-anchor": "middle" }).textContent = "error, relative";
  make("text", { x: 12, y: m.top - 6 }).textContent = "time, ms";
}

function draw() {
  svg.textContent = "";
  const W = svg.clientWidth || 800, H = 560, m = { left: 56, right: 70, top: 22, bottom: 42 };
  const kind = get("kind").value, time = get("time").value, shown = chosen().filter(c => !off.has(c.name));
  const points = shown.flatMap(c => c.points.map(p => ({ c, p })));
  const xr = range(points.filter(d => finite(d.p[kind])).map(d => d.p[kind]), 0.3);
  const yr = range(points.filter(d => finite(d.p[time])).map(d => 1e3 * d.p[time]), 0.15);
  const x = e => m.left + (Math.log10(e) - xr[0]) / (xr[1] - xr[0]) * (W - m.left - m.right);
  const y = t => H - m.bottom - (Math.log10(t) - yr[0]) / (yr[1] - yr[0]) * (H - m.top - m.bottom);
  make("rect", { x: W - m.right + 6, y: m.top, width: m.right - 8, height: H - m.top - m.bottom, fill: "#f6eeee" });
  make("text", { x: W - m.right / 2, y: m.top + 14, "text-anchor": "middle" }).textContent = "failed";
  axes(x, y, W, H, m, xr, yr);
  const law = get("law").value, ref = study.references.find(r => r.law === (kind === "model_error" || !law ? study.exact : law));
  if (ref && ref.error > 10 ** xr[0]) {
    make("line", { x1: x(ref.error), x2: x(ref.error), y1: m.top, y2: H - m.bottom, stroke: "#999", "stroke-dasharray": "2 3" });
    make("text", { x: x(ref.error) + 4, y: m.top + 12 }).textContent = "the reference's own error";
  }
  for (const c of shown) {
    const good = c.points.filter(p => p.outcome === "done" && finite(p[kind]) && finite(p[time]));
    const path = good.map((p, i) => (i ? "L" : "M") + x(p[kind]) + " " + y(1e3 * p[time])).join("");
    make("path", { d: path, fill: "none", stroke: c.color, "stroke-width": c.program === "trunnion" ? 1.6 : 1.1, "stroke-dasharray": c.fixed ? "5 3" : "" });
    for (const p of good) dot(c, p, make("circle", { cx: x(p[kind]), cy: y(1e3 * p[time]), r: 4, fill: c.fixed ? "#fff" : c.color, stroke: c.color, "stroke-width": 1.4 }));
    for (const p of c.points.filter(p => p.outcome !== "done" && finite(p[time])))
      dot(c, p, make("text", { x: W - m.right / 2, y: y(1e3 * p[time]) + 4, "text-anchor": "middle", style: "fill:" + c.color + ";font-size:15px" })).textContent = "×";
  }
  legend();
}

function dot(c, p, e) {
  e.addEventListener("pointerenter", event => {
    const number = v => v === null ? "–" : v.toPrecision(3);
    const lines = [c.name, p.setting, p.outcome === "done" ? "" : "FAILED: " + p.outcome,
      "error " + number(p.error) + (p.predicted ? " · estimated by the run itself " + number(p.predicted) : "") + (c.law ? " · against the exact law " + number(p.model_error) : ""),
      "median " + number(1e3 * p.median) + " ms, minimum " + number(1e3 * p.minimum) + " ms of " + p.repeats,
      p.steps ? p.steps + " steps, " + p.rejected + " rejected, " + p.evaluations + " evaluations, " + p.events + " events" : "",
      p.leaves_out ? "leaves out: " + p.leaves_out : ""];
    const tip = get("tip");
    tip.textContent = lines.filter(Boolean).join("\n");
    tip.hidden = false;
    tip.style.left = Math.min(event.pageX + 12, document.documentElement.clientWidth - 330) + "px";
    tip.style.top = event.pageY + 12 + "px";
  });
  e.addEventListener("pointerleave", () => { get("tip").hidden = true; });
  return e;
}

function legend() {
  const box = get("legend");
  box.textContent = "";
  for (const c of chosen()) {
    const b = text(box, "button", ""), line = text(b, "i", "");
    line.style.borderColor = c.color;
    if (c.fixed) line.className = "dash";
    b.append(c.name);
    b.className = off.has(c.name) ? "off" : "";
    b.onclick = () => { off.has(c.name) ? off.delete(c.name) : off.add(c.name); draw(); };
  }
}

function list(title, items) {
  if (!items.length) return;
  text(get("words"), "h2", title);
  const ul = text(get("words"), "ul", "");
  for (const i of items) text(ul, "li", i);
}

get("title").textContent = study.title + ": error against time";
get("caption").textContent = "0–" + study.until + " s · " + study.measure + " · " + study.machine.processor + ", " + study.machine.system + ", Python " + study.machine.python + ", Trunnion " + study.machine.trunnion;
const laws = [...new Set(study.curves.map(c => c.law))];
if (laws.length > 1) get("law").append(new Option("all", ""));
const guests = new Set(study.curves.filter(c => c.program !== "trunnion").map(c => c.law));
for (const l of laws) get("law").append(new Option((l || "no friction") + (guests.has(l) ? " (with other programs)" : ""), l));
if (laws.includes(study.exact)) get("law").value = study.exact;
if (laws.length < 2) get("law").parentElement.hidden = get("kind").parentElement.hidden = true;
for (const id of ["kind", "time", "law", "fixed"]) get(id).onchange = draw;
get("all").onclick = () => { off.clear(); draw(); };
get("none").onclick = () => { for (const c of chosen()) off.add(c.name); draw(); };
list("References", study.references.map(r => (r.law ? r.law + ": " : "") + r.made_by + ", which differ by " + r.error.toExponential(1)));
list("Against other programs", study.verdict);
list("What the other programs leave out", study.peers.map(p => p.filter(Boolean).join(" — ")));
list("Build times, once per structure, not included in the times", study.builds.map(b => b[0] + ": " + b[1].toPrecision(3) + " s"));
list("Failures", study.curves.flatMap(c => c.points.filter(p => p.outcome !== "done").map(p => c.name + ", " + p.setting + ": " + p.outcome)));
list("Notes", study.notes);
window.addEventListener("resize", draw);
draw();
