// Draws one picture with WebGL, or a flat picture without WebGL. Names and axes are drawn over the picture.
"use strict";

const over = document.getElementById("over"), paint = over.getContext("2d");
const OTHER = "#d55e00"; // the outlines of the bodies of the other run
const AXES = [["x", "#d55e00"], ["y", "#009e73"], ["z", "#0072b2"]];

// Choose WebGL. For ?flat=1, and in browsers without WebGL 2, choose the flat picture.
function equip(refused) {
  card = refused ? null : card;
  try {
    if (card && !card.gl.isContextLost()) card.discard();
    else card = refused ? null : graphics(stage);
    if (card) things = prepared();
  } catch (e) {
    card = null;
    console.warn(e);
  }
  document.documentElement.dataset.drawn = card ? "depth" : "flat";
  document.getElementById("note").hidden = Boolean(card);
}

// Pass the height of the controls to the style sheet. In narrow windows, the style sheet places the panel of values above the
// controls.
function settle() {
  document.documentElement.style.setProperty("--foot", $("foot").offsetHeight + "px");
}

function resize() {
  const ratio = window.devicePixelRatio || 1;
  for (const c of [stage, over]) {
    c.width = Math.round(window.innerWidth * ratio);
    c.height = Math.round(window.innerHeight * ratio);
  }
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  settle();
}

function deep(m, cam, ink) {
  const gl = card.gl, cut = cutting();
  cam.ratio = window.devicePixelRatio || 1;
  gl.viewport(0, 0, stage.width, stage.height);
  gl.clearColor(...ink.paper, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const light = unit(add(add(add([0, 0, 0], cam.right, LIT[0]), cam.up, LIT[1]), cam.toward, LIT[2]));
  card.all({ uView: cam.matrix, uEye: cam.eye, uHalf: [stage.width / 2, stage.height / 2], uNear: cam.near, uLight: light, uUp: run.up, uHatch: 9 * cam.ratio });
  const [coils, rods] = [run.springs, run.rods].map((all) => all.map((s) => s.map((e) => m.place(e.part, e.point))));
  if (coils.length) card.refill(things.coils, new Float32Array(coils.flatMap(([p, q]) => coil(p, q))));
  if (rods.length) card.refill(things.rods, new Float32Array(rods.flatMap(strip)));
  ground(m, cam, ink);
  if (look.xray) {
    drawJoints(m, cam, 1, ink);
    traces(m, cam);
    bodies(m, cam, cut);
    return;
  }
  bodies(m, cam, cut);
  gl.depthFunc(gl.GREATER);
  gl.depthMask(false);
  drawJoints(m, cam, HIDDEN, ink);
  gl.depthMask(true);
  gl.depthFunc(gl.LEQUAL);
  drawJoints(m, cam, 1, ink);
  traces(m, cam);
}

// Draw the run at time t. Returns the moment, the camera and the pixels of the joints.
function draw(t) {
  const m = moment(t), cam = camera(m), ink = inks();
  paint.clearRect(0, 0, cam.w, cam.h);
  if (card && !card.gl.isContextLost()) deep(m, cam, ink); else flat(m, cam, ink);
  const places = run.joints.map((j) => cam.project(m.place(j.parts[1], j.point)));
  if (other) outlines(t, cam);
  if (look.names) names(m, cam, places, ink);
  axes(cam, ink);
  if (handles.length && t === start) marked(m, cam, ink);
  return { m, cam, places };
}

// Draw the creases of the other run's bodies.
function outlines(t, cam) {
  paint.strokeStyle = OTHER;
  paint.lineWidth = 1.5;
  paint.beginPath();
  for (const { mesh, p, r } of bodiesBeside(t)) {
    const spots = [];
    for (let i = 0; i < mesh.v.length; i += 3) spots.push(cam.project(add(p, apply(r, mesh.v.slice(i, i + 3)))));
    mesh.f.forEach((face, k) => face.forEach((a, n) => {
      const [from, to] = [spots[a], spots[face[(n + 1) % face.length]]];
      if (!(mesh.e[k] & (1 << n)) || from[3] < 0.1 || to[3] < 0.1) return;
      paint.moveTo(from[0], from[1]);
      paint.lineTo(to[0], to[1]);
    }));
  }
  paint.stroke();
}

// Write names, each at a free place near its body or joint. A line joins a name to a distant body or joint.
function names(m, cam, places, ink) {
  const taken = places.map(([x, y]) => [x - 4, y - 4, x + 4, y + 4]), dark = ink.paper[0] < 0.5;
  const wanted = run.parts.map((part, i) => [part.name, cam.project(m.poses[i].p), css(ink.ink), "600 12px system-ui, sans-serif", 0])
    .concat(run.joints.map((j, i) => [j.name, places[i], dark ? "#7cc4f5" : "#06507c", "12px system-ui, sans-serif", 12]));
  for (const [text, [x, y], color, font, away] of wanted) {
    paint.font = font;
    const w = paint.measureText(text).width, h = 14;
    const box = candidates(x, y, w, h, away).find((b) => !taken.some((o) => b[0] < o[2] && b[2] > o[0] && b[1] < o[3] && b[3] > o[1]));
    if (!box) continue;
    taken.push(box);
    const far = Math.hypot((box[0] + box[2]) / 2 - x, (box[1] + box[3]) / 2 - y) > w / 2 + 20;
    paint.strokeStyle = color;
    paint.lineWidth = 1;
    if (far) { paint.beginPath(); paint.moveTo(x, y); paint.lineTo(Math.min(box[2], Math.max(box[0], x)), Math.min(box[3], Math.max(box[1], y))); paint.stroke(); }
    words(text, box[0], box[3] - 3, color, ink);
  }
}

function candidates(x, y, w, h, away) {
  const out = away ? [] : [[x - w / 2, y - h / 2, x + w / 2, y + h / 2]];
  for (const r of [12, 26, 42, 60, 80]) {
    for (const [a, b] of [[1, -1], [-1, -1], [1, 1], [-1, 1], [0, -1.4], [0, 1.4], [1.3, 0], [-1.3, 0]]) {
      const left = x + a * r + (a > 0 ? 0 : a < 0 ? -w : -w / 2), top = y + b * r - h / 2;
      out.push([left, top, left + w, top + h]);
    }
  }
  return out.filter((b) => b[0] > 2 && b[2] < window.innerWidth - 2 && b[1] > 2);
}

function words(text, x, y, color, ink) {
  paint.lineWidth = 3.5;
  paint.lineJoin = "round";
  paint.strokeStyle = "rgba(" + ink.paper.map((v) => Math.round(255 * v)).join(",") + ",0.85)";
  paint.strokeText(text, x, y);
  paint.fillStyle = color;
  paint.fillText(text, x, y);
}

// Draw the directions of the world's axes at the lower right.
function axes(cam, ink) {
  const f = free(), x = f.x + f.w - 46, y = f.y + f.h - 44, ends = AXES.map(([name, color], k) => [name, color, cam.right[k], cam.up[k], cam.toward[k]]);
  ends.sort((a, b) => a[4] - b[4]);
  paint.font = "600 12px system-ui, sans-serif";
  for (const [name, color, right, up] of ends) {
    paint.strokeStyle = color;
    paint.lineWidth = 2.4;
    paint.beginPath();
    paint.moveTo(x, y);
    paint.lineTo(x + 28 * right, y - 28 * up);
    paint.stroke();
    words(name, x + 38 * right - 3.5, y - 38 * up + 4, color, ink);
  }
}
