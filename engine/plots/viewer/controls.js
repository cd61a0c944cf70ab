// The controls: time, speed, pointer and keys, the values of the joints, the legend.
"use strict";

const $ = (id) => document.getElementById(id);
const clock = { t: start, playing: false, speed: run.speed, then: 0 };
let shown = { places: [] }, pointers = new Map(), queued = false, hover = null;
const digits = Math.max(0, Math.min(9, 3 - Math.floor(Math.log10((end - start) || 1))));

function seek(t) {
  clock.t = Math.min(end, Math.max(start, t));
  refresh();
}

function refresh() {
  if (queued) return;
  queued = true;
  requestAnimationFrame(() => { queued = false; render(); });
}

function render() {
  shown = draw(clock.t);
  $("scrub").value = String(clock.t);
  $("clock").textContent = "t = " + clock.t.toFixed(digits) + " s";
  fill($("values"), run.joints.filter((j) => j.panel));
  tip();
}

function frame(now) {
  if (!clock.playing) return;
  const step = clock.then ? (now - clock.then) / 1000 : 0;
  clock.then = now;
  clock.t = Math.min(end, clock.t + step * clock.speed);
  render();
  if (clock.t >= end) play(false); else requestAnimationFrame(frame);
}

function play(on) {
  if (on && clock.t >= end) clock.t = start;
  clock.playing = on;
  clock.then = 0;
  $("play").textContent = on ? "❚❚" : "▶";
  if (on) requestAnimationFrame(frame);
}

function nudge(rowsOn) {
  play(false);
  const w = locate(clock.t), here = w.f > 0.999 ? w.i + 1 : w.i;
  const row = rowsOn < 0 && w.f > 0.001 && w.f <= 0.999 ? here + rowsOn + 1 : here + rowsOn;
  seek(times[Math.min(last, Math.max(0, row))]);
}

function shownNumber(x) {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  return size !== 0 && (size >= 1e5 || size < 1e-3) ? x.toExponential(2) : x.toPrecision(4);
}

// A table of a joint's values, written once and then only updated.
function fill(box, joints) {
  const key = joints.map((j) => j.name).join("|");
  if (box.dataset.key !== key) {
    box.dataset.key = key;
    box.replaceChildren(...joints.flatMap((j) => {
      const head = document.createElement("b"), table = document.createElement("table");
      head.textContent = j.name + " (" + j.type + ")";
      for (const v of j.values) {
        const row = table.insertRow();
        for (const text of [v.label, "", v.unit]) row.insertCell().textContent = text;
      }
      return [head, table];
    }));
  }
  if (!shown.m) return;
  const cells = box.querySelectorAll("td:nth-child(2)");
  joints.flatMap((j) => j.values).forEach((v, k) => { cells[k].textContent = shownNumber(v.factor * nearest(shown.m.w, v.channel)); });
}

function tip() {
  $("tip").hidden = !hover;
  if (!hover) return;
  fill($("tip"), [hover.joint]);
  $("tip").style.left = Math.min(hover.x + 14, window.innerWidth - 250) + "px";
  $("tip").style.top = Math.min(hover.y + 10, window.innerHeight - 60 - $("tip").offsetHeight) + "px";
}

function pointAt(x, y) {
  let best = null, near = 16;
  shown.places.forEach((p, i) => {
    const d = Math.hypot(p[0] - x, p[1] - y);
    if (d < near) { near = d; best = { joint: run.joints[i], x, y }; }
  });
  hover = best;
  tip();
}

function rotate(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle), k = dot(v, axis) * (1 - c), w = cross(axis, v);
  return [0, 1, 2].map((i) => v[i] * c + w[i] * s + axis[i] * k);
}

function turn(dx, dy) {
  for (const k of ["right", "up", "toward"]) view[k] = rotate(view[k], run.up, -0.008 * dx);
  const tilted = rotate(view.up, view.right, -0.008 * dy);
  if (dot(tilted, run.up) < 0.01) return;
  view.toward = rotate(view.toward, view.right, -0.008 * dy);
  view.up = tilted;
}

function drag(e) {
  const before = pointers.get(e.pointerId);
  if (!before) return pointAt(e.clientX, e.clientY);
  const dx = e.clientX - before.x, dy = e.clientY - before.y;
  const others = [...pointers].filter(([id]) => id !== e.pointerId);
  if (others.length) {
    const o = others[0][1], was = Math.hypot(before.x - o.x, before.y - o.y), is = Math.hypot(e.clientX - o.x, e.clientY - o.y);
    view.zoom *= is / (was || 1);
  } else if (e.shiftKey || before.button === 2) {
    const s = scale();
    view.target = add(add(view.target, view.right, -dx / s), view.up, dy / s);
  } else turn(dx, dy);
  pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, button: before.button });
  refresh();
}

function faster(k) {
  const options = [...$("speed").options], i = options.findIndex((o) => o.selected) + k;
  if (options[i]) { options[i].selected = true; clock.speed = Number(options[i].value); }
}

function toggle(name, key) {
  look[key] = !look[key];
  $(name).classList.toggle("on", look[key]);
  refresh();
}

const keys = {
  " ": () => play(!clock.playing), ArrowLeft: (e) => nudge(e.shiftKey ? -10 : -1), ArrowRight: (e) => nudge(e.shiftKey ? 10 : 1),
  ArrowUp: () => faster(1), ArrowDown: () => faster(-1), Home: () => seek(start), End: () => seek(end),
  l: () => toggle("labels", "names"), x: () => toggle("xray", "xray"), f: () => toggle("follow", "follow"), r: () => $("reset").click(),
  "[": () => { look.arrows /= 1.25; legend(); refresh(); }, "]": () => { look.arrows *= 1.25; legend(); refresh(); },
};

// Colours of the contact points, and an arrow of a round force at the scale in use.
function legend() {
  const box = $("legend");
  box.replaceChildren();
  if (!run.joints.some((j) => j.contacts.length)) return;
  for (const [key, [color, text]] of Object.entries(run.states)) {
    if (key === "other") continue;
    const line = document.createElement("div"), dotMark = document.createElement("i");
    dotMark.style.background = color;
    line.append(dotMark, "contact: " + text);
    box.append(line);
  }
  const line = document.createElement("div");
  line.style.color = run.colors.arrow;
  const metres = run.force * run.arrow * look.arrows;
  line.textContent = "arrow: normal force on the pin, " + shownNumber(metres) + " m long for " + run.force + " N";
  box.append(line);
}

function ticks() {
  for (const e of run.events) {
    const tick = document.createElement("span");
    tick.style.left = 100 * (e.t - start) / ((end - start) || 1) + "%";
    tick.title = e.text;
    tick.onclick = () => { play(false); seek(e.t); };
    $("ticks").append(tick);
  }
}

function speeds() {
  for (const k of run.speeds) $("speed").add(new Option("× " + k, String(k), k === run.speed, k === run.speed));
  $("speed").onchange = () => { clock.speed = Number($("speed").value); $("speed").blur(); };
}

// ?t=0.5 or #t=0.5 opens at that time; &play=1 starts; &names=1, &xray=1.
function parameters() {
  const given = new URLSearchParams(window.location.search.slice(1) + "&" + window.location.hash.slice(1));
  if (given.get("names")) toggle("labels", "names");
  if (given.get("xray")) toggle("xray", "xray");
  const t = Number(given.get("t"));
  seek(given.has("t") && Number.isFinite(t) ? t : start);
  if (given.get("play")) play(true);
}

function begin() {
  $("title").textContent = run.title;
  $("caption").textContent = run.caption;
  Object.assign($("scrub"), { min: String(start), max: String(end) });
  $("scrub").oninput = () => { play(false); seek(Number($("scrub").value)); };
  $("play").onclick = () => { play(!clock.playing); $("play").blur(); };
  $("labels").onclick = () => { keys.l(); $("labels").blur(); };
  $("xray").onclick = () => { keys.x(); $("xray").blur(); };
  $("follow").onclick = () => { keys.f(); $("follow").blur(); };
  $("follow").classList.toggle("on", look.follow);
  $("reset").onclick = () => { view = firstView(); $("reset").blur(); refresh(); };
  stage.onpointerdown = (e) => { stage.setPointerCapture(e.pointerId); pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, button: e.button }); };
  stage.onpointermove = drag;
  stage.onpointerup = stage.onpointercancel = (e) => pointers.delete(e.pointerId);
  stage.oncontextmenu = (e) => e.preventDefault();
  stage.addEventListener("wheel", (e) => { e.preventDefault(); view.zoom = Math.min(60, Math.max(0.05, view.zoom * Math.exp(-0.0012 * e.deltaY))); refresh(); }, { passive: false });
  window.addEventListener("resize", () => { resize(); render(); });
  window.addEventListener("hashchange", parameters);
  window.addEventListener("keydown", (e) => {
    const act = keys[e.key] || keys[e.key.toLowerCase()];
    if (!act || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    act(e);
  });
  speeds();
  ticks();
  legend();
  resize();
  parameters();
  render();
}

begin();
