// A curve of the run beside the editor. While a number is dragged, the curve before the drag stays visible. Dragging over the curve
// moves the time.

import { $, choices, number } from "../basics/requests_and_dom.js";

const PAD = 6, LABELS = 15; // pixels around the curve; height of the line of labels
let inside = null, offered = new Map(), now = null, before = null, at = 0, wish = "";

// the curve to select as soon as a run has it
export const prefer = (name) => { wish = name; };

export function begin() {
  $("curveof").addEventListener("change", () => { before = null; read(); draw(); });
  const box = $("curve"), seek = (e) => { if (now && e.buttons) { inside.play(false); inside.seek(timeAt(e.offsetX)); } };
  box.addEventListener("pointerdown", (e) => { box.setPointerCapture(e.pointerId); seek(e); });
  box.addEventListener("pointermove", seek);
  new ResizeObserver(draw).observe(box);
}

// Draws the curve of the chosen column of a run. held: whether the user is dragging a number.
export function put(view, data, held) {
  inside = view;
  offered = new Map(data.joints.flatMap((j) => j.values.map((v) => [`${j.name} ${v.label}`, v])));
  const names = [...offered.keys()], first = names.find((n) => n.endsWith("normal_force")) ?? names[0];
  choices($("curveof"), names.map((n) => [n, offered.get(n).unit ? `${n} (${offered.get(n).unit})` : n]), first);
  if (offered.has(wish)) { $("curveof").value = wish; wish = ""; }
  $("curvebox").hidden = !names.length;
  if (held) before ??= now; else before = null;
  read();
  draw();
}

function read() {
  const v = offered.get($("curveof").value);
  if (!v) { now = null; return; }
  const { t, y } = inside.curveOf(v.channel);
  now = { t, y: y.map((x) => v.factor * x) };
  $("curve").setAttribute("aria-label", `${$("curveof").value} against time, from ${number(least(now.y))} to ${number(most(now.y))} ${v.unit}`);
}

const least = (y) => y.reduce((a, x) => (x < a ? x : a), Infinity), most = (y) => y.reduce((a, x) => (x > a ? x : a), -Infinity);

export function cursor(t) {
  at = t;
  draw();
}

const width = () => $("curve").clientWidth - 2 * PAD;
const timeAt = (x) => (now.t.at(-1) * Math.min(width(), Math.max(0, x - PAD))) / width();

export function draw() {
  const box = $("curve"), g = box.getContext("2d"), ratio = devicePixelRatio || 1, [w, h] = [box.clientWidth, box.clientHeight];
  if (!w) return;
  if (box.width !== Math.round(w * ratio) || box.height !== Math.round(h * ratio)) [box.width, box.height] = [Math.round(w * ratio), Math.round(h * ratio)];
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  if (!now) return;
  const ink = (name) => getComputedStyle(box).getPropertyValue(name).trim(), both = before ? [before, now] : [now];
  const low = Math.min(...both.map((c) => least(c.y))), high = Math.max(...both.map((c) => most(c.y))), end = now.t.at(-1) || 1;
  const x = (t) => PAD + (width() * t) / end, y = (v) => h - LABELS - PAD - ((h - LABELS - 2 * PAD) * (v - low)) / (high - low || 1);
  for (const [curve, color, wide] of [[before, ink("--edge"), 1], [now, ink("--c0"), 1.8]]) {
    if (!curve) continue;
    g.beginPath();
    curve.t.forEach((t, i) => { if (Number.isFinite(curve.y[i])) g.lineTo(x(t), y(curve.y[i])); });
    g.strokeStyle = color;
    g.lineWidth = wide;
    g.stroke();
  }
  g.fillStyle = ink("--c1");
  g.fillRect(x(Math.min(at, end)) - 1, 2, 2, h - LABELS - 2);
  g.fillStyle = ink("--soft");
  g.font = "12px system-ui, sans-serif";
  g.fillText(`${number(low)} … ${number(high)} ${offered.get($("curveof").value).unit}`, PAD, h - 3);
  const text = `${number(end)} s`;
  g.fillText(text, w - PAD - g.measureText(text).width, h - 3);
}
