// The picture: polygons from back to front, pins and contacts over them, so that the inside of the joints is always seen.
"use strict";

const stage = document.getElementById("stage"), paint = stage.getContext("2d");
const layer = document.createElement("canvas"), ink = layer.getContext("2d");
const look = { names: false, xray: false, follow: run.follow, arrows: 1 };
let view = firstView();
const LIGHT = unit([0.3, 0.65, 0.7]);
const shades = new Map();

function firstView() {
  return { right: run.view[0].slice(), up: run.view[1].slice(), toward: run.view[2].slice(), target: run.center.slice(), zoom: 1 };
}

function resize() {
  const ratio = window.devicePixelRatio || 1;
  for (const c of [stage, layer]) {
    c.width = Math.round(window.innerWidth * ratio);
    c.height = Math.round(window.innerHeight * ratio);
  }
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
}

// Pixels a metre: the whole motion fits; when following, the mechanism does.
function scale() {
  const [w, h] = look.follow ? run.extent.near : run.extent.all;
  return 0.86 * Math.min(window.innerWidth / w, (window.innerHeight - 190) / h) * view.zoom;
}

function middle(m) {
  if (!look.follow) return view.target;
  const c = [0, 0, 0];
  for (const b of m.poses) for (let k = 0; k < 3; k++) c[k] += b.p[k] / m.poses.length;
  return add(add(c, view.target), run.center, -1);
}

function projector(m) {
  const s = scale(), o = middle(m), x0 = window.innerWidth / 2, y0 = (window.innerHeight - 40) / 2;
  return (p) => { const d = add(p, o, -1); return [x0 + s * dot(d, view.right), y0 - s * dot(d, view.up), dot(d, view.toward)]; };
}

function shade(color, light) {
  const level = Math.round(light * 24), key = color + level;
  if (!shades.has(key)) {
    const rgb = [1, 3, 5].map((k) => parseInt(color.slice(k, k + 2), 16));
    shades.set(key, "rgb(" + rgb.map((x) => Math.round(x * level / 24)).join(",") + ")");
  }
  return shades.get(key);
}

// Faces of a mesh that look at the viewer, with their depth.
function visible(mesh, pose, color, project, bias, out) {
  const spots = [], v = mesh.v;
  for (let i = 0; i < v.length; i += 3) spots.push(project(add(pose.p, apply(pose.r, [v[i], v[i + 1], v[i + 2]]))));
  mesh.f.forEach((face, k) => {
    const c = face.map((i) => spots[i]);
    const a = [c[1][0] - c[0][0], c[1][1] - c[0][1]], b = [c[2][0] - c[1][0], c[2][1] - c[1][1]];
    if (a[0] * b[1] - a[1] * b[0] >= 0) return;
    const s = scale(), e = [a[0] / s, -a[1] / s, c[1][2] - c[0][2]], g = [b[0] / s, -b[1] / s, c[2][2] - c[1][2]];
    const light = 0.58 + 0.42 * Math.max(0, dot(unit(cross(e, g)), LIGHT));
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

function grid(project, m) {
  const up = run.up, step = run.grid, o = middle(m), u = Math.abs(up[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0];
  const e = unit(add(u, up, -dot(u, up))), f = cross(up, e), n = 16;
  const foot = add(o, up, run.floor - dot(o, up));
  paint.lineWidth = 1;
  paint.strokeStyle = "#e6e6e6";
  paint.beginPath();
  for (const [p, q] of [[e, f], [f, e]]) {
    const shift = Math.round(dot(foot, q) / step) * step - dot(foot, q), along = Math.round(dot(foot, p) / step) * step - dot(foot, p);
    for (let k = -n; k <= n; k++) {
      const c = add(add(foot, q, shift + k * step), p, along);
      const from = project(add(c, p, -n * step)), to = project(add(c, p, n * step));
      paint.moveTo(from[0], from[1]);
      paint.lineTo(to[0], to[1]);
    }
  }
  paint.stroke();
}

function arrow(ctx, tail, tip, color) {
  const length = Math.hypot(tip[0] - tail[0], tip[1] - tail[1]);
  if (length < 1) return;
  const d = [(tip[0] - tail[0]) / length, (tip[1] - tail[1]) / length], h = Math.min(11, 0.6 * length);
  ctx.strokeStyle = ctx.fillStyle = color;
  ctx.lineWidth = 2.2;
  ctx.beginPath();
  ctx.moveTo(tail[0], tail[1]);
  ctx.lineTo(tip[0] - 0.8 * h * d[0], tip[1] - 0.8 * h * d[1]);
  ctx.stroke();
  ctx.beginPath();
  ctx.moveTo(tip[0], tip[1]);
  ctx.lineTo(tip[0] - h * d[0] + 0.4 * h * d[1], tip[1] - h * d[1] - 0.4 * h * d[0]);
  ctx.lineTo(tip[0] - h * d[0] - 0.4 * h * d[1], tip[1] - h * d[1] + 0.4 * h * d[0]);
  ctx.fill();
}

function rails(m, project) {
  paint.setLineDash([9, 4, 2, 4]);
  paint.strokeStyle = "#555";
  paint.lineWidth = 1.2;
  for (const rail of run.rails) {
    const b = m.pose(rail.part), [p, q] = [rail.from, rail.to].map((x) => project(add(b.p, apply(b.r, x))));
    paint.beginPath();
    paint.moveTo(p[0], p[1]);
    paint.lineTo(q[0], q[1]);
    paint.stroke();
  }
  paint.setLineDash([]);
}

// Springs and dampers between points, as zigzags across the line of sight.
const ZIGZAG = [[0, 0], [0.15, 0], ...Array.from({ length: 9 }, (_, k) => [0.19 + 0.0775 * k, k % 2 ? -0.05 : 0.05]), [0.85, 0], [1, 0]];
function springs(m, project) {
  paint.strokeStyle = run.colors.ink;
  paint.lineWidth = 1.6;
  for (const ends of run.springs) {
    const [p, q] = ends.map((e) => { const b = m.pose(e.part); return project(add(b.p, apply(b.r, e.point))); });
    const d = [q[0] - p[0], q[1] - p[1]];
    paint.beginPath();
    ZIGZAG.forEach(([along, aside], k) => {
      const x = p[0] + along * d[0] + aside * d[1], y = p[1] + along * d[1] - aside * d[0];
      if (k) paint.lineTo(x, y); else paint.moveTo(x, y);
    });
    paint.stroke();
  }
}

function contacts(m, project) {
  const k = run.arrow * look.arrows;
  for (const c of m.contacts) arrow(paint, project(add(c.point, c.normal, c.force * k)), project(c.point), run.colors.arrow);
  for (const c of m.contacts) {
    const p = project(c.point), state = run.states[String(c.state)] || run.states.other;
    paint.beginPath();
    paint.arc(p[0], p[1], 5, 0, 2 * Math.PI);
    paint.fillStyle = state[0];
    paint.fill();
    paint.strokeStyle = "#fff";
    paint.lineWidth = 1.3;
    paint.stroke();
  }
}

function words(text, x, y, color) {
  paint.lineWidth = 3.5;
  paint.strokeStyle = "#fffc";
  paint.strokeText(text, x, y);
  paint.fillStyle = color;
  paint.fillText(text, x, y);
}

// Everything at time t; the places of the joints on the screen are kept for the pointer.
function draw(t) {
  const m = moment(t), project = projector(m), bodies = [], pins = [];
  paint.clearRect(0, 0, window.innerWidth, window.innerHeight);
  ink.clearRect(0, 0, window.innerWidth, window.innerHeight);
  grid(project, m);
  run.parts.forEach((part, i) => visible(run.meshes[part.mesh], m.poses[i], part.color, project, (i % 4) * 0.07 * run.size, bodies));
  polygons(ink, bodies);
  paint.globalAlpha = look.xray ? 0.3 : 0.9;
  paint.drawImage(layer, 0, 0, window.innerWidth, window.innerHeight);
  paint.globalAlpha = 1;
  rails(m, project);
  springs(m, project);
  for (const j of run.joints) for (const pin of j.pins) visible(run.meshes[pin.mesh], m.pose(pin.part), run.colors.joint, project, 0, pins);
  paint.globalAlpha = 0.82;
  polygons(paint, pins);
  paint.globalAlpha = 1;
  contacts(m, project);
  const places = run.joints.map((j) => { const b = m.pose(j.parts[1]); return project(add(b.p, apply(b.r, j.point))); });
  if (look.names) {
    paint.font = "12px system-ui, sans-serif";
    run.parts.forEach((part, i) => { const p = project(m.poses[i].p); words(part.name, p[0] - paint.measureText(part.name).width / 2, p[1] + 4, "#111"); });
    run.joints.forEach((j, i) => words(j.name, places[i][0] + 8, places[i][1] - 8, "#06507c"));
  }
  return { m, places };
}
