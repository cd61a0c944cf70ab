// Paths of points. The path of the whole run is faint, the path up to the current time is strong.
"use strict";

const MOST_SPOTS = 600;

// {part, name, at, path (points), times} of each traced point that moves; computed at the first call.
let traced = null;
function paths() {
  if (traced) return traced;
  const step = Math.max(1, Math.ceil((last + 1) / MOST_SPOTS)), picked = [];
  for (let i = 0; i <= last; i += step) picked.push(i);
  if (picked[picked.length - 1] !== last) picked.push(last);
  traced = run.parts.flatMap((part, p) => part.traced.map((spot) => ({ part: p, name: spot.name, at: spot.at, times: picked.map((i) => times[i]), path: picked.map((i) => onBody(p, spot.at, times[i])) })));
  traced = traced.filter((t) => t.path.some((q) => Math.hypot(...add(q, t.path[0], -1)) > 1e-6 * run.size));
  return traced;
}

function onBody(part, at, t) {
  const w = locate(t), channel = run.parts[part].channel;
  return add(three(w, channel), apply(turned(w, channel + 3), at));
}

// The path up to time t.
function past(trace, t) {
  const n = trace.times.findIndex((x) => x > t), upTo = n < 0 ? trace.path.length : n;
  return [...trace.path.slice(0, upTo), onBody(trace.part, trace.at, t)];
}

function traces(m, cam) {
  if (!look.traces) return;
  const gl = card.gl;
  if (!things.traces) things.traces = paths().map((t) => ({ t, whole: card.lines(new Float32Array(strip(t.path))), past: card.lines(new Float32Array(EDGE), gl.DYNAMIC_DRAW) }));
  for (const { t, whole, past: gone } of things.traces) {
    const color = mixed(rgb(run.parts[t.part].color), inks().ink, 0.35), where = { ...pose(GROUND), uCut: OFF, uBias: 0 };
    card.edges(whole, { ...where, uColor: [...color, 0.35], uWidth: cam.ratio });
    card.refill(gone, new Float32Array(strip(past(t, m.t))));
    card.edges(gone, { ...where, uColor: [...color, 1], uWidth: 2.2 * cam.ratio });
  }
}
