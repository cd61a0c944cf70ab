// The picture with depth: ground and shadow, bodies, pins and contacts. Pins and contacts remain faintly visible behind bodies.
"use strict";

const stage = document.getElementById("stage");
const LIT = unit([-0.35, 0.75, 0.6]), SUN = 0.35; // direction of light in the axes of the view; slant of the shadow
const HIDDEN = 0.42, LINE = 1.4, BIAS = 2e-4, DOT_SIZE = 11;
let card = null, things = null;

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
const mixed = (a, b, k) => a.map((x, i) => x + k * (b[i] - x));
const css = (c) => "rgb(" + c.map((x) => Math.round(255 * x)).join(",") + ")";

// Colours of the page, light or dark.
function inks() {
  const style = getComputedStyle(document.documentElement), get = (name) => rgb(style.getPropertyValue(name).trim());
  return { paper: get("--paper"), ink: get("--ink"), grid: get("--grid"), line: get("--line") };
}

// Colour of a pressure, from amber over crimson to violet. x: pressure divided by the largest pressure.
const RAMP = run.colors.ramp.map(rgb);
function ramp(x) {
  const s = Math.min(1, Math.max(0, x)) * (RAMP.length - 1), k = Math.min(RAMP.length - 2, Math.floor(s));
  return mixed(RAMP[k], RAMP[k + 1], s - k);
}
const pressure = (c) => (run.pressure > 0 && c.mark.area > 0 ? c.force / c.mark.area / run.pressure : 0);

function prepared() {
  const shapes = run.meshes.map((mesh) => card.shape(mesh)), patches = new Map();
  for (const j of run.joints) for (const c of j.contacts) if (c.arm !== 0 && c.wide > 0) patches.set(c, card.shape(patchOf(c)));
  const shells = new Set(run.joints.flatMap((j) => j.pins).filter(shell));
  const rails = run.rails.map((rail) => ({ part: rail.part, lines: card.lines(new Float32Array(dashes(rail.from, rail.to))) }));
  const empty = () => card.lines(new Float32Array(EDGE), card.gl.DYNAMIC_DRAW);
  return { shapes, patches, shells, rails, shaft: card.shape(SHAFT), head: card.shape(HEAD), coils: empty(), rods: empty(), rim: empty(), traces: null };
}

// Whether a pin is as large as its body, as for a drawer in its runners. Only the edges of such a pin are drawn.
function shell(pin) {
  if (pin.part < 0) return false;
  const [own, body] = [pin.mesh, run.parts[pin.part].mesh].map((i) => boxes[i][7].map((x, k) => x - boxes[i][0][k]).sort((a, b) => a - b));
  return own.every((x, k) => x > 0.7 * body[k]);
}

function dashes(from, to) {
  const n = Math.max(2, Math.round(Math.hypot(...add(to, from, -1)) / (0.06 * run.size))), out = [];
  const spot = (k) => add(from, add(to, from, -1), k / n);
  for (let k = 0; k < n; k += 1) out.push(...strip([spot(k), spot(k + (k % 2 ? 0.12 : 0.7))]));
  return out;
}

// A spring or damper between two points: a coil with straight ends.
function coil(p, q) {
  const d = add(q, p, -1), length = Math.hypot(...d), e = unit(d), r = Math.min(0.09 * length, 0.06 * run.size), points = [p];
  const u = perpendicular(e), w = cross(e, u), turns = 9, steps = 20 * turns;
  for (let k = 0; k <= steps; k++) {
    const a = 2 * Math.PI * turns * k / steps, swell = r * Math.min(1, k / 10, (steps - k) / 10);
    points.push(add(add(add(p, d, 0.12 + 0.76 * k / steps), u, swell * Math.cos(a)), w, swell * Math.sin(a)));
  }
  return strip([...points, q]);
}

// The plane that cuts bodies (normal, level). The plane faces the direction of the viewer at the time of the choice, or is
// perpendicular to an axis. Points beyond the plane are not drawn.
function cutting() {
  if (!look.cut) return OFF;
  const n = look.cut === "view" ? look.cutFrom : [0, 1, 2].map((k) => (k === "xyz".indexOf(look.cut) ? 1 : 0));
  const side = look.cut === "view" || dot(n, view.toward) >= 0 ? n : n.map((x) => -x), m = moment(clock.t), spots = [];
  run.parts.forEach((part, i) => { const v = run.meshes[part.mesh].v; for (let k = 0; k < v.length; k += 3) spots.push(dot(side, m.place(i, v.slice(k, k + 3)))); });
  const low = Math.min(...spots), high = Math.max(...spots);
  return [...side, low + (1.002 * look.cutAt - 0.001) * (high - low)]; // from slightly below to slightly above the bodies
}

const pose = (b) => ({ uModel: placed(b.r, b.p), uTurn: turning(b.r) });

// Draw a shape's creases and its outline from the eye.
function outlined(shape, b, cam, how) {
  const e = add(cam.eye.slice(0, 3), b.p, -cam.eye[3]), local = [0, 1, 2].map((k) => b.r[k] * e[0] + b.r[k + 3] * e[1] + b.r[k + 6] * e[2]);
  card.edges(shape.creases, { ...pose(b), ...how });
  if (!shape.smooth.length) return;
  card.refill(things.rim, rim(shape.smooth, [...local, cam.eye[3]]));
  card.edges(things.rim, { ...pose(b), ...how });
}

function bodies(m, cam, cut) {
  const gl = card.gl;
  const order = run.parts.map((_, i) => i);
  if (look.xray) order.sort((a, b) => dot(m.poses[a].p, cam.toward) - dot(m.poses[b].p, cam.toward));
  gl.depthMask(!look.xray);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(1, 1);
  if (cut === OFF) gl.enable(gl.CULL_FACE);
  for (const i of order) {
    const color = rgb(run.parts[i].color);
    card.surface(things.shapes[run.parts[i].mesh], { ...pose(m.poses[i]), uColor: [...color, 1], uCut: cut, uGhost: look.xray ? 1 : 0 });
  }
  gl.disable(gl.POLYGON_OFFSET_FILL);
  if (cut !== OFF && !look.xray) for (const i of order) capped(i, m, cut);
  for (const i of order) {
    const color = mixed(rgb(run.parts[i].color), [0, 0, 0], 0.62);
    outlined(things.shapes[run.parts[i].mesh], m.poses[i], cam, { uColor: [...color, look.xray ? 0.7 : 1], uCut: cut, uWidth: LINE * cam.ratio, uBias: 0 });
  }
  gl.disable(gl.CULL_FACE);
  gl.depthMask(true);
}

// Draw the cap of a cut body. A pixel of the cut is inside the body if the view has more back faces than front faces there.
function capped(i, m, cut) {
  const gl = card.gl, n = cut.slice(0, 3), along = perpendicular(n);
  const { p } = m.poses[i], spots = boxes[run.parts[i].mesh], reach = 2 * Math.max(...spots.map((b) => Math.hypot(...b)));
  const color = [...rgb(run.parts[i].color), 1], foot = add(p, n, cut[3] - dot(n, p));
  gl.clear(gl.STENCIL_BUFFER_BIT);
  gl.enable(gl.STENCIL_TEST);
  gl.colorMask(false, false, false, false);
  gl.depthMask(false);
  gl.disable(gl.DEPTH_TEST);
  gl.stencilFunc(gl.ALWAYS, 0, 255);
  gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
  gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
  card.surface(things.shapes[run.parts[i].mesh], { ...pose(m.poses[i]), uColor: color, uCut: cut, uGhost: 0 });
  gl.colorMask(true, true, true, true);
  gl.depthMask(true);
  gl.enable(gl.DEPTH_TEST);
  gl.stencilFunc(gl.NOTEQUAL, 0, 255);
  gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
  card.cap({ uFoot: foot, uAlong: along, uAcross: cross(n, along), uReach: reach, uColor: color });
  gl.disable(gl.STENCIL_TEST);
}

// Draw pins, coils, rods, rails and contacts.
function drawJoints(m, cam, alpha, ink) {
  const gl = card.gl, k = run.arrow * look.arrows, thick = Math.max(0.011 * run.size, 1.3 / cam.s);
  gl.enable(gl.CULL_FACE);
  for (const j of run.joints) {
    for (const pin of j.pins) {
      const b = m.pose(pin.part);
      if (!things.shells.has(pin)) card.surface(things.shapes[pin.mesh], { ...pose(b), uColor: [...rgb(run.colors.joint), alpha], uCut: OFF, uGhost: 0 });
      outlined(things.shapes[pin.mesh], b, cam, { uColor: [0.16, 0.17, 0.19, alpha], uCut: OFF, uWidth: cam.ratio, uBias: 0 });
    }
  }
  for (const rail of things.rails) card.edges(rail.lines, { ...pose(m.pose(rail.part)), uColor: [...ink.line, alpha], uCut: OFF, uWidth: 1.5 * cam.ratio, uBias: 0 });
  const thread = Math.min(2.6, Math.max(1.5, 0.006 * run.size * cam.s)) * cam.ratio;
  for (const [all, lines, wide] of [[run.springs, things.coils, thread], [run.rods, things.rods, 2 * thread]])
    if (all.length) card.edges(lines, { ...pose(GROUND), uColor: [...ink.ink, alpha], uCut: OFF, uWidth: wide, uBias: 0 });
  for (const c of m.contacts) {
    const color = [...ramp(pressure(c)), alpha], there = patchPose(m, c), patch = things.patches.get(c.mark);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(-1, -2);
    if (patch) card.surface(patch, { ...there, uColor: color, uCut: OFF, uGhost: 0 });
    gl.disable(gl.POLYGON_OFFSET_FILL);
    const long = c.force * k, head = Math.min(0.45 * long, 5 * thick), r = [...arrowTurn(c.normal)];
    const slim = Math.min(thick, 0.2 * long), spots = [add(c.point, c.normal, head), add(c.point, c.normal, long)];
    card.surface(things.shaft, { uModel: placed(r, spots[1], [long - head, slim, slim]), uTurn: turning(r), uColor: color, uCut: OFF, uGhost: 0 });
    card.surface(things.head, { uModel: placed(r, spots[0], [head, 2.3 * slim, 2.3 * slim]), uTurn: turning(r), uColor: color, uCut: OFF, uGhost: 0 });
  }
  gl.disable(gl.CULL_FACE);
  for (const c of m.contacts) {
    const state = run.states[String(c.state)] || run.states.other;
    card.dot({ uPlace: c.point, uColor: [...rgb(state[0]), alpha], uRim: [1, 1, 1], uSize: DOT_SIZE * cam.ratio, uBias: BIAS });
  }
}

// Axes (row-major) of a contact's arrow. The first axis points against the normal.
function arrowTurn(n) {
  const e = n.map((x) => -x), u = perpendicular(e), w = cross(e, u);
  return [e[0], u[0], w[0], e[1], u[1], w[1], e[2], u[2], w[2]];
}

// Matrices of a contact's patch: its axes are outward normal, across, along the pin; its origin is on the pin's axis.
function patchPose(m, c) {
  const body = m.pose(c.mark.part), along = apply(body.r, c.mark.axis), n = c.normal;
  const z = Math.abs(dot(along, n)) < 0.9 ? unit(add(along, n, -dot(along, n))) : perpendicular(n);
  const y = cross(z, n), r = [n[0], y[0], z[0], n[1], y[1], z[1], n[2], y[2], z[2]];
  return { uModel: placed(r, add(c.point, n, -c.mark.arm)), uTurn: turning(r) };
}

function ground(m, cam, ink) {
  const gl = card.gl, u = run.up, e = unit(add(Math.abs(u[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0], u, -dot(Math.abs(u[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0], u))), f = cross(u, e);
  const foot = add(cam.o, u, run.floor - dot(cam.o, u)), reach = 1.1 * Math.max(...(look.follow ? run.extent.near : run.extent.all)) + 3 * run.size;
  let step = run.grid;
  while (step * cam.s < 22) step *= 2;
  const sheet = { uFoot: foot, uAlong: e, uAcross: f, uReach: reach, uStep: step, uColor: [...ink.grid, 1] };
  const sun = add(add(u, cam.right, SUN), cam.toward, -SUN * 0.5), flat = flattened(u, sun, run.floor);
  gl.depthMask(false);
  if (dot(cam.toward, u) > 0.03) {
    gl.enable(gl.STENCIL_TEST);
    gl.colorMask(false, false, false, false);
    gl.disable(gl.DEPTH_TEST);
    gl.stencilFunc(gl.ALWAYS, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    run.parts.forEach((part, i) => card.surface(things.shapes[part.mesh], { uModel: times4(flat, placed(m.poses[i].r, m.poses[i].p)), uTurn: turning(m.poses[i].r), uColor: [0, 0, 0, 1], uCut: OFF, uGhost: 0 }));
    gl.colorMask(true, true, true, true);
    gl.stencilFunc(gl.EQUAL, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    card.ground({ ...sheet, uShade: look.xray ? 0.06 : 0.13 });
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.DEPTH_TEST);
  }
  card.ground({ ...sheet, uShade: 0 });
  gl.depthMask(true);
}

// Column-major matrix that projects points along ``sun`` onto the plane u·x = level.
function flattened(u, sun, level) {
  const k = dot(u, sun), out = [];
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) out.push((r === c ? 1 : 0) - (r < 3 ? sun[r] * (c < 3 ? u[c] : -level) / k : 0));
  return out;
}

function times4(a, b) {
  const out = new Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
