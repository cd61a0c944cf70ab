// Points that the user can drag in the plane of the motion, if the embedding page offers them. The picture then shows the start of
// the run.
"use strict";

const REACH = 16, HANDLE = 6, PLANE_SAMPLES = 20, FLAT = 1e-6, GRID_DOTS = 4; // pixels, pixels, rows, fraction of the size, dots
let handles = [], onPull = null, grip = null, normal = -1;

// The index of the world axis along which no part moves and which no part tilts. Of several axes, the one nearest to the view. −1
// if no axis fits.
function planeOf() {
  const fits = [0, 1, 2].filter((k) => run.parts.every((_, i) => {
    const first = moment(start).poses[i];
    for (let n = 1; n <= PLANE_SAMPLES; n++) {
      const b = moment(start + (end - start) * n / PLANE_SAMPLES).poses[i];
      const tilts = [0, 1, 2].some((r) => [0, 1, 2].some((c) => r !== c && (r === k || c === k) && Math.abs(turnBetween(first.r, b.r)[3 * r + c]) > FLAT));
      if (tilts || Math.abs(b.p[k] - first.p[k]) > FLAT * run.size) return false;
    }
    return true;
  }));
  return fits.reduce((best, k) => (best < 0 || Math.abs(run.view[2][k]) > Math.abs(run.view[2][best]) ? k : best), -1);
}

// The matrix b·aᵀ of two rotation matrices.
const turnBetween = (a, b) => [0, 1, 2].flatMap((r) => [0, 1, 2].map((c) => dot(b.slice(3 * r, 3 * r + 3), a.slice(3 * c, 3 * c + 3))));

// Offers points for dragging. The view is along the normal of the plane. An empty list removes all handles. given: [{part (name; ""
// for the ground), name, at (for the ground), grid (m)}]. tell: called with the index of a point, its new place on the part, and
// whether the point was released.
function offer(given, tell) {
  handles = given;
  onPull = tell;
  if (!given.length) return refresh();
  normal = planeOf();
  const e = [0, 1, 2].map((k) => (k === normal ? Math.sign(view.toward[k]) || 1 : 0)), flat = Math.abs(dot(e, run.up)) < 0.9;
  view.toward = e;
  view.up = unit(add(flat ? run.up : Math.abs(e[1]) < 0.9 ? [0, 1, 0] : [0, 0, -1], e, flat ? -dot(run.up, e) : 0));
  view.right = cross(view.up, view.toward);
  play(false);
  seek(start);
  reveal();
}

// Zooms and moves the picture so that all points are in the free part of the window.
function reveal() {
  const m = moment(start), f = free();
  for (const last of [false, true]) {
    const places = handles.map((h) => handleAt(h, m)).filter(Boolean).map((there) => camera(m).project(there.world));
    const [x, y] = [0, 1].map((k) => places.map((p) => p[k])), [a, b] = [x, y].map((v) => [Math.min(...v), Math.max(...v)]);
    if (!places.length || (a[0] > f.x + REACH && a[1] < f.x + f.w - REACH && b[0] > f.y + REACH && b[1] < f.y + f.h - REACH)) return;
    if (last) shift(f.x + f.w / 2 - (a[0] + a[1]) / 2, f.y + f.h / 2 - (b[0] + b[1]) / 2);
    else zoom(Math.min(1, (0.8 * f.w) / (a[1] - a[0] || 1), (0.8 * f.h) / (b[1] - b[0] || 1)));
  }
}

// The place of a point on its part, and in the world; null when the part has no such point.
function handleAt(h, m) {
  const part = h.part ? run.parts.findIndex((p) => p.name === h.part) : -1;
  const local = part < 0 ? h.at : run.parts[part].traced.find((s) => s.name === h.name)?.at;
  return local && (part >= 0 || !h.part) ? { part, local, world: m.place(part, local) } : null;
}

function grasp(e) {
  if (!handles.length || clock.t !== start || e.button) return false;
  let near = REACH;
  handles.forEach((h, index) => {
    const there = handleAt(h, shown.m), p = there && shown.cam.project(there.world), d = there ? Math.hypot(p[0] - e.clientX, p[1] - e.clientY) : Infinity;
    if (d < near) { near = d; grip = { index, ...there, r: shown.m.pose(there.part).r, cam: shown.cam }; }
  });
  return Boolean(grip);
}

// The point under a pixel, in the plane through the held point.
function under(x, y) {
  const { cam, world } = grip, along = [0, 1, 2].filter((k) => k !== normal).map((k) => [0, 1, 2].map((i) => (i === k ? run.size : 0)));
  const lines = [world, add(world, along[0]), add(world, along[1])].map((p) => { const [px, py, , d] = cam.project(p); return [(px - x) * d, (py - y) * d]; });
  const [a, b, c, d] = [lines[1][0] - lines[0][0], lines[2][0] - lines[0][0], lines[1][1] - lines[0][1], lines[2][1] - lines[0][1]];
  const s = (-d * lines[0][0] + b * lines[0][1]) / (a * d - b * c), t = (c * lines[0][0] - a * lines[0][1]) / (a * d - b * c);
  return add(add(world, along[0], s), along[1], t);
}

function pull(e) {
  const d = add(under(e.clientX, e.clientY), grip.world, -1), r = grip.r;
  const moved = [0, 1, 2].map((k) => r[k] * d[0] + r[k + 3] * d[1] + r[k + 6] * d[2]);
  onPull(grip.index, moved, false);
}

function release() {
  const { index } = grip;
  grip = null;
  onPull(index, null, true);
  refresh();
}

// Draws the handles, and the grid around the held point.
function marked(m, cam, ink) {
  for (const [i, h] of handles.entries()) {
    const there = handleAt(h, m);
    if (!there) continue;
    const [x, y] = cam.project(there.world);
    if (grip?.index === i) dots(there, h.grid, m, cam, ink);
    paint.beginPath();
    paint.arc(x, y, HANDLE, 0, 2 * Math.PI);
    paint.fillStyle = css(ink.paper);
    paint.strokeStyle = "#d55e00";
    paint.lineWidth = 3;
    paint.fill();
    paint.stroke();
    if (grip?.index === i || !grip) words(`${h.part || "ground"}.${h.name}`, x + 11, y - 8, css(ink.ink), ink);
  }
}

function dots(there, grid, m, cam, ink) {
  const r = m.pose(there.part).r, axes = [0, 1, 2].map((k) => [r[k], r[k + 3], r[k + 6]]).filter((e) => Math.abs(e[normal]) < 0.5);
  if (axes.length !== 2) return;
  paint.fillStyle = css(ink.line);
  for (let i = -GRID_DOTS; i <= GRID_DOTS; i++) for (let k = -GRID_DOTS; k <= GRID_DOTS; k++) {
    const [x, y] = cam.project(add(add(there.world, axes[0], i * grid), axes[1], k * grid));
    paint.fillRect(x - 1, y - 1, 2, 2);
  }
}
