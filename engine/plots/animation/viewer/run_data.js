// The run's data: rows, and every quantity at any time between two rows.
"use strict";

let run, times, rows, width, last, start, end, shape;
let other = null; // [run, times, rows, width, last] of another run of the mechanism, whose bodies are outlined
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };
// A unit vector perpendicular to a unit vector.
const perpendicular = (e) => unit(cross(e, Math.abs(e[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0]));
const apply = (m, v) => [0, 3, 6].map((i) => m[i] * v[0] + m[i + 1] * v[1] + m[i + 2] * v[2]);

function decoded(text, Type) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Type(bytes.buffer);
}

const shapeOf = (data) => JSON.stringify([data.meshes, data.parts, data.joints]);

const read = (data) => (typeof data.rows === "string" ? [decoded(data.times, Float64Array), decoded(data.rows, Float32Array)] : [data.times, data.rows]);

function take(data) {
  run = data;
  shape = shapeOf(data);
  [times, rows] = read(data);
  [width, last] = [run.width, times.length - 1];
  [start, end] = [times[0], times[last]];
}
take(JSON.parse(document.getElementById("data").textContent));

// The place of time t among the rows: the row i, and the fraction f of the way from row i to row i + 1.
function locate(t) {
  let low = 0, high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle; else high = middle;
  }
  if (!last) return { i: 0, f: 0 };
  const span = times[low + 1] - times[low];
  return { i: low, f: span > 0 ? Math.min(1, Math.max(0, (t - times[low]) / span)) : 0 };
}

// The rows' times, and the values of a channel in them.
function curveOf(channel) { return { t: times, y: Float32Array.from(times, (_, i) => at(i, channel)) }; }

const at = (row, channel) => rows[row * width + channel];

function value(w, channel) {
  const a = at(w.i, channel);
  if (w.f === 0) return a;
  return a + w.f * (at(w.i + 1, channel) - a);
}

const nearest = (w, channel) => at(w.f < 0.5 ? w.i : w.i + 1, channel);
const three = (w, channel) => [0, 1, 2].map((k) => value(w, channel + k));

// Rotation matrix (row-major) of the quaternion at a channel. Between two rows, the quaternion is interpolated along the shorter
// rotation.
function turned(w, channel) {
  let q = [0, 1, 2, 3].map((k) => at(w.i, channel + k));
  if (w.f > 0) {
    const r = [0, 1, 2, 3].map((k) => at(w.i + 1, channel + k));
    const s = q.reduce((sum, x, k) => sum + x * r[k], 0) < 0 ? -1 : 1;
    q = q.map((x, k) => (1 - w.f) * x + w.f * s * r[k]);
  }
  const [a, b, c, d] = q, n = 2 / (a * a + b * b + c * c + d * d);
  return [1 - n * (c * c + d * d), n * (b * c - a * d), n * (b * d + a * c),
    n * (b * c + a * d), 1 - n * (b * b + d * d), n * (c * d - a * b),
    n * (b * d - a * c), n * (c * d + a * b), 1 - n * (b * b + c * c)];
}

const GROUND = { p: [0, 0, 0], r: [1, 0, 0, 0, 1, 0, 0, 0, 1] };

// The run at time t: poses of all parts, and for each contact with a force its point, outward normal, force and state.
function moment(t) {
  const w = locate(t);
  const poses = run.parts.map((part) => ({ p: three(w, part.channel), r: turned(w, part.channel + 3) }));
  const pose = (i) => (i < 0 ? GROUND : poses[i]);
  const contacts = [];
  for (const j of run.joints) {
    for (const c of j.contacts) {
      const f = value(w, c.force);
      let n = three(w, c.normal);
      if (Math.hypot(...n) < 0.9) n = [0, 1, 2].map((k) => nearest(w, c.normal + k)); // the normal jumps between the rows
      if (!(f > 0) || !(Math.hypot(...n) > 0.5)) continue;
      const world = apply(pose(j.parts[0]).r, apply(j.frame, unit(n)));
      const body = pose(c.part);
      const base = c.bases === undefined ? c.base : three(w, c.bases);
      const point = add(add(body.p, apply(body.r, base)), world, c.arm);
      contacts.push({ joint: j, mark: c, point, normal: world, force: f, state: Math.round(nearest(w, c.state)) });
    }
  }
  const place = (part, point) => add(pose(part).p, apply(pose(part).r, point)); // a part's point in the world
  return { t, w, poses, pose, place, contacts };
}

// The other run's bodies at time t: meshes and poses.
function bodiesBeside(t) {
  const mine = [run, times, rows, width, last];
  [run, times, rows, width, last] = other;
  const { poses } = moment(t), found = run.parts.map((part, i) => ({ mesh: run.meshes[part.mesh], ...poses[i] }));
  [run, times, rows, width, last] = mine;
  return found;
}
