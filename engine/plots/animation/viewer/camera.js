// The camera. The camera has the axes of the view, fits the motion into the free part of the window, and converts points to pixels.
"use strict";

const FIELD = Math.tan(0.5 * 22 * Math.PI / 180); // half of the visible height, divided by the distance of the eye
const NEAREST = 0.02, EMPTY = 1e-9; // near plane, divided by the distance of the eye; smallest extent, m
const look = { names: false, xray: false, follow: run.follow, arrows: 1, traces: false, parallel: false, cut: "", cutAt: 0.5 };
let view = firstView();

function firstView() {
  return { right: run.view[0].slice(), up: run.view[1].slice(), toward: run.view[2].slice(), shift: [0, 0, 0], zoom: 1 };
}

// Mean of the mass centres. A view that follows the mechanism keeps this point in the middle.
function centre(m) {
  const c = [0, 0, 0];
  for (const b of m.poses) for (let k = 0; k < 3; k++) c[k] += b.p[k] / m.poses.length;
  return c;
}

// The eight corners of the box around each mesh.
const boxesOf = () => run.meshes.map((mesh) => {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < mesh.v.length; i++) { low[i % 3] = Math.min(low[i % 3], mesh.v[i]); high[i % 3] = Math.max(high[i % 3], mesh.v[i]); }
  return Array.from({ length: 8 }, (_, k) => [0, 1, 2].map((i) => (k >> i & 1 ? high : low)[i]));
});

// Points at up to 60 instants (corners of boxes, ends of springs and rods, tips of arrows): in the world, and relative to ``centre``.
const sweep = () => {
  const all = [], near = [], count = Math.min(60, last + 1);
  for (let k = 0; k < count; k++) {
    const m = moment(times[Math.round(k * last / Math.max(1, count - 1))]), c = centre(m);
    const spots = run.parts.flatMap((part, i) => boxes[part.mesh].map((p) => m.place(i, p)));
    for (const ends of [...run.springs, ...run.rods]) for (const e of ends) spots.push(m.place(e.part, e.point));
    for (const j of run.joints) {
      for (const pin of j.pins) for (const p of boxes[pin.mesh]) spots.push(m.place(pin.part, p));
      spots.push(m.place(j.parts[1], j.point));
    }
    for (const f of m.contacts) spots.push(add(f.point, f.normal, Math.min(f.force * run.arrow, 0.5 * run.size)));
    all.push(...spots);
    near.push(...spots.map((p) => add(p, c, -1)));
  }
  return { all, near };
};
let boxes = boxesOf(), swept = sweep();

// The part of the window without controls: left, top, width, height in pixels.
function free() {
  const w = window.innerWidth, h = window.innerHeight, box = (id) => document.getElementById(id).getBoundingClientRect();
  const side = box("values"), top = box("head").bottom + 6, bottom = box("foot").top - 6;
  const right = side.width > 0 && side.width < 0.4 * w ? side.left - 8 : w;
  return { x: 0, y: Math.min(top, 0.3 * h), w: Math.max(60, right), h: Math.max(60, bottom - Math.min(top, 0.3 * h)) };
}

// Scale (pixels per metre) and middle point at which the motion fits, for the current window and choices.
const fits = new Map();
function fit() {
  const f = free(), key = [look.follow, look.parallel, f.w, f.h, window.innerHeight].join();
  if (fits.has(key)) return fits.get(key);
  const axes = run.view, spots = (look.follow ? swept.near : swept.all).map((p) => axes.map((e) => dot(e, p)));
  const low = [0, 1, 2].map((k) => Math.min(...spots.map((p) => p[k]))), high = [0, 1, 2].map((k) => Math.max(...spots.map((p) => p[k])));
  const mid = low.map((x, k) => (x + high[k]) / 2), far = look.parallel ? 0 : FIELD * 2 / window.innerHeight;
  let s = Infinity;
  for (const p of spots) {
    const [x, y, z] = p.map((v, k) => v - mid[k]);
    for (const [a, half] of [[Math.abs(x), 0.46 * f.w], [Math.abs(y), 0.46 * f.h]]) {
      const spread = a + z * half * far;
      if (spread > EMPTY) s = Math.min(s, half / spread);
    }
  }
  fits.set(key, { scale: Number.isFinite(s) ? s : 100, middle: axes.reduce((sum, e, k) => add(sum, e, mid[k]), [0, 0, 0]) });
  return fits.get(key);
}

const scale = () => fit().scale * view.zoom;

function middle(m) {
  const at = add(fit().middle, view.shift);
  return look.follow ? add(at, centre(m)) : at;
}

// The camera at a moment. matrix: column-major, from the world to clip space. eye: (position of the eye, 1), or in parallel
// projection (direction towards the eye, 0). project: function from a point to pixels from the left and from the top, metres
// towards the viewer, and depth.
function camera(m) {
  const w = window.innerWidth, h = window.innerHeight, f = free(), s = scale(), o = middle(m);
  const x0 = f.x + f.w / 2, y0 = f.y + f.h / 2, distance = h / (2 * s * FIELD), span = 4 * distance + 40 * run.size;
  const eye = look.parallel ? [...view.toward, 0] : [...add(o, view.toward, distance), 1];
  const row = (a, k) => [...a.map((x) => k * x), -k * dot(a, o)];
  const right = row(view.right, 2 * s / w), up = row(view.up, 2 * s / h), toward = row(view.toward, 1);
  // deep: depth divided by the distance; 1 at the middle point. The middle point is drawn in the middle of the free part of the
  // window.
  const deep = look.parallel ? [0, 0, 0, 1] : toward.map((x, k) => (k === 3 ? 1 : 0) - x / distance);
  const shift = [2 * x0 / w - 1, 1 - 2 * y0 / h], near = NEAREST, far = span / distance;
  const line = look.parallel
    ? toward.map((x, k) => -x / span)
    : deep.map((x, k) => (far + near) / (far - near) * x - (k === 3 ? 2 * far * near / (far - near) : 0));
  const rows = [right.map((x, k) => x + shift[0] * deep[k]), up.map((x, k) => x + shift[1] * deep[k]), line, deep];
  const matrix = new Float32Array(16);
  rows.forEach((r, i) => r.forEach((x, k) => { matrix[4 * k + i] = x; }));
  const project = (p) => {
    const [x, y, , d] = rows.map((r) => r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3]);
    return [w * (1 + x / d) / 2, h * (1 - y / d) / 2, dot(add(p, o, -1), view.toward), d];
  };
  return { matrix, eye, project, s, o, w, h, near: look.parallel ? 0 : near, toward: view.toward, right: view.right, up: view.up, distance };
}

function rotate(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle), k = dot(v, axis) * (1 - c), w = cross(axis, v);
  return [0, 1, 2].map((i) => v[i] * c + w[i] * s + axis[i] * k);
}

// Turn about the vertical axis, and tilt about the view's horizontal axis, radians. A tilt beyond the view from above or below is
// ignored.
function turn(around, over) {
  for (const k of ["right", "up", "toward"]) view[k] = rotate(view[k], run.up, -around);
  const tilted = rotate(view.up, view.right, -over);
  if (dot(tilted, run.up) < 0.02) return;
  view.toward = rotate(view.toward, view.right, -over);
  view.up = tilted;
}

function shift(dx, dy) {
  const s = scale();
  view.shift = add(add(view.shift, view.right, -dx / s), view.up, dy / s);
}

function zoom(k) { view.zoom = Math.min(60, Math.max(0.05, view.zoom * k)); }

// Look along an axis. The front view looks along the horizontal axis that is nearest to the direction of the first view.
function along(which) {
  const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].filter((e) => Math.abs(dot(e, run.up)) < 0.9), first = run.view[2];
  const e = axes.reduce((a, b) => (Math.abs(dot(b, first)) > Math.abs(dot(a, first)) ? b : a));
  const front = unit(add(e, run.up, -dot(e, run.up))).map((x) => x * (dot(e, first) < 0 ? -1 : 1)), side = cross(run.up, front);
  view.toward = which === "top" ? run.up.slice() : which === "side" ? side : front;
  view.up = which === "top" ? front.map((x) => -x) : run.up.slice();
  view.right = cross(view.up, view.toward);
}
