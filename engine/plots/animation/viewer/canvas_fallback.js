// The picture without WebGL: polygons from back to front, then pins and contacts over the polygons.
"use strict";

// Canvases in main memory. The finished picture is copied to the page. With software rendering, this way is faster for many
// polygons.
const [layer, leaf] = [0, 1].map(() => document.createElement("canvas").getContext("2d", { willReadFrequently: true }));
const LIGHT = unit([0.3, 0.65, 0.7]);
const shades = new Map();

function shade(color, light) {
  const level = Math.round(light * 24), key = color + level;
  if (!shades.has(key)) shades.set(key, css(rgb(color).map((x) => x * level / 24)));
  return shades.get(key);
}

// Append the polygons of a mesh that face the viewer, with their depth.
function visible(mesh, pose, color, cam, bias, out) {
  const spots = [], v = mesh.v, s = cam.s;
  for (let i = 0; i < v.length; i += 3) spots.push(cam.project(add(pose.p, apply(pose.r, [v[i], v[i + 1], v[i + 2]]))));
  mesh.f.forEach((face, k) => {
    const c = face.map((i) => spots[i]), n = newell(c.map((p) => [p[0] / s, -p[1] / s, p[2]]));
    if (n[2] <= 0) return;
    const light = 0.58 + 0.42 * Math.max(0, dot(unit(n), LIGHT));
    out.push({ z: c.reduce((sum, p) => sum + p[2], 0) / c.length + bias, c, light, color, edges: mesh.e[k] });
  });
}

function polygons(ctx, faces) {
  faces.sort((a, b) => a.z - b.z);
  for (const f of faces) {
    ctx.beginPath();
    f.c.forEach((p, k) => (k ? ctx.lineTo(p[0], p[1]) : ctx.moveTo(p[0], p[1])));
    ctx.closePath();
    ctx.fillStyle = ctx.strokeStyle = shade(f.color, f.light);
    ctx.lineWidth = 0.7;
    ctx.fill();
    ctx.stroke();
    if (!f.edges) continue;
    ctx.strokeStyle = shade(f.color, 0.42);
    ctx.beginPath();
    f.c.forEach((p, k) => {
      if (!(f.edges & (1 << k))) return;
      const q = f.c[(k + 1) % f.c.length];
      ctx.moveTo(p[0], p[1]);
      ctx.lineTo(q[0], q[1]);
    });
    ctx.stroke();
  }
}

function lines(cam, points, color, width) {
  leaf.strokeStyle = color;
  leaf.lineWidth = width;
  leaf.beginPath();
  points.forEach((p, k) => { const q = cam.project(p); if (k) leaf.lineTo(q[0], q[1]); else leaf.moveTo(q[0], q[1]); });
  leaf.stroke();
}

function grid(m, cam, ink) {
  const up = run.up, step = run.grid, o = cam.o, u = Math.abs(up[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0];
  const e = unit(add(u, up, -dot(u, up))), f = cross(up, e), n = 12, foot = add(o, up, run.floor - dot(o, up));
  for (const [p, q] of [[e, f], [f, e]]) {
    const aside = Math.round(dot(foot, q) / step) * step - dot(foot, q), along = Math.round(dot(foot, p) / step) * step - dot(foot, p);
    for (let k = -n; k <= n; k++) {
      const c = add(add(foot, q, aside + k * step), p, along), ends = [add(c, p, -n * step), add(c, p, n * step)];
      if (ends.every((x) => cam.project(x)[3] > 0.1)) lines(cam, ends, css(mixed(ink.paper, ink.grid, 0.5)), 1);
    }
  }
}

// The zigzag of a spring: coordinates along and across the spring, divided by the spring's length.
const ZIGZAG = [[0, 0], [0.15, 0], ...Array.from({ length: 9 }, (_, k) => [0.19 + 0.0775 * k, k % 2 ? -0.05 : 0.05]), [0.85, 0], [1, 0]];
function threads(m, cam, ink) {
  for (const ends of run.springs) {
    const [p, q] = ends.map((e) => m.place(e.part, e.point)), d = add(q, p, -1);
    const aside = add(add([0, 0, 0], cam.right, dot(d, cam.up)), cam.up, -dot(d, cam.right));
    lines(cam, ZIGZAG.map(([a, b]) => add(add(p, d, a), aside, b)), css(ink.ink), 1.6);
  }
  for (const ends of run.rods) lines(cam, ends.map((e) => m.place(e.part, e.point)), css(ink.ink), 3);
}

function arrow(tail, tip, color) {
  const length = Math.hypot(tip[0] - tail[0], tip[1] - tail[1]);
  if (length < 1) return;
  const d = [(tip[0] - tail[0]) / length, (tip[1] - tail[1]) / length], h = Math.min(11, 0.6 * length);
  leaf.strokeStyle = leaf.fillStyle = color;
  leaf.lineWidth = 2.2;
  leaf.beginPath();
  leaf.moveTo(tail[0], tail[1]);
  leaf.lineTo(tip[0] - 0.8 * h * d[0], tip[1] - 0.8 * h * d[1]);
  leaf.stroke();
  leaf.beginPath();
  leaf.moveTo(tip[0], tip[1]);
  leaf.lineTo(tip[0] - h * d[0] + 0.4 * h * d[1], tip[1] - h * d[1] - 0.4 * h * d[0]);
  leaf.lineTo(tip[0] - h * d[0] - 0.4 * h * d[1], tip[1] - h * d[1] + 0.4 * h * d[0]);
  leaf.fill();
}

function marks(m, cam) {
  const k = run.arrow * look.arrows;
  for (const c of m.contacts) arrow(cam.project(add(c.point, c.normal, c.force * k)), cam.project(c.point), css(ramp(pressure(c))));
  for (const c of m.contacts) {
    const p = cam.project(c.point), state = run.states[String(c.state)] || run.states.other;
    leaf.beginPath();
    leaf.arc(p[0], p[1], 5, 0, 2 * Math.PI);
    leaf.fillStyle = state[0];
    leaf.fill();
    leaf.strokeStyle = "#fff";
    leaf.lineWidth = 1.3;
    leaf.stroke();
  }
}

function flat(m, cam, ink) {
  const solids = [], pins = [];
  for (const sheet of [layer, leaf]) {
    sheet.canvas.width = over.width;
    sheet.canvas.height = over.height;
    sheet.setTransform(paint.getTransform());
  }
  grid(m, cam, ink);
  run.parts.forEach((part, i) => visible(run.meshes[part.mesh], m.poses[i], part.color, cam, (i % 4) * 0.07 * run.size, solids));
  polygons(layer, solids);
  leaf.globalAlpha = look.xray ? 0.3 : 0.9;
  leaf.drawImage(layer.canvas, 0, 0, cam.w, cam.h);
  leaf.globalAlpha = 1;
  leaf.setLineDash([9, 4, 2, 4]);
  for (const rail of run.rails) lines(cam, [rail.from, rail.to].map((x) => m.place(rail.part, x)), css(ink.line), 1.2);
  leaf.setLineDash([]);
  threads(m, cam, ink);
  if (look.traces) for (const t of paths()) lines(cam, past(t, m.t), css(mixed(rgb(run.parts[t.part].color), ink.ink, 0.35)), 2);
  for (const j of run.joints) for (const pin of j.pins) visible(run.meshes[pin.mesh], m.pose(pin.part), run.colors.joint, cam, 0, pins);
  leaf.globalAlpha = 0.82;
  polygons(leaf, pins);
  leaf.globalAlpha = 1;
  marks(m, cam);
  paint.drawImage(leaf.canvas, 0, 0, cam.w, cam.h);
}
