// The controls of the page: pointer, keys, buttons and options in the address. This file also starts the page.
"use strict";

const pointers = new Map();
const PHONE = window.matchMedia("(max-width: 760px)"), DARK = window.matchMedia("(prefers-color-scheme: dark)");
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const TURN = 0.008, STEP = 0.12, MOVE = 40; // radians per pixel, radians per key, pixels per key

// Show the values of the joint under the pointer.
function pointAt(x, y, near) {
  let best = null;
  shown.places.forEach((p, i) => {
    const d = Math.hypot(p[0] - x, p[1] - y);
    if (d < near) { near = d; best = { joint: run.joints[i], x, y }; }
  });
  if (!best && !hover) return;
  hover = best;
  tip();
}

function drag(e) {
  if (grip) return pull(e);
  const before = pointers.get(e.pointerId);
  if (!before) return pointAt(e.clientX, e.clientY, 16);
  const dx = e.clientX - before.x, dy = e.clientY - before.y, other = [...pointers].find(([id]) => id !== e.pointerId);
  if (other) {
    const o = other[1], was = Math.hypot(before.x - o.x, before.y - o.y), is = Math.hypot(e.clientX - o.x, e.clientY - o.y);
    zoom(is / (was || 1));
    shift(dx / 2, dy / 2);
  } else if (e.shiftKey || before.button === 2) shift(dx, dy); else turn(TURN * dx, TURN * dy);
  pointers.set(e.pointerId, { ...before, x: e.clientX, y: e.clientY, moved: before.moved + Math.abs(dx) + Math.abs(dy) });
  refresh();
}

function lift(e) {
  if (grip) return release();
  const before = pointers.get(e.pointerId);
  pointers.delete(e.pointerId);
  if (before && before.moved < 6 && e.pointerType !== "mouse") pointAt(e.clientX, e.clientY, 30);
}

const BUTTONS = { labels: "names", xray: "xray", follow: "follow", traces: "traces", parallel: "parallel" };
function toggle(name) {
  const key = BUTTONS[name];
  look[key] = !look[key];
  press(name, look[key]);
  refresh();
}
const press = (name, on) => $(name).setAttribute("aria-pressed", String(on));

// Set the section: "" (off), "view", "x", "y" or "z".
function section(which) {
  look.cut = which;
  if (which === "view") look.cutFrom = view.toward.slice();
  if (which) $("cut").value = which;
  $("cutting").hidden = !which;
  press("section", Boolean(which));
  settle();
  refresh();
}

function numbers(on) {
  $("values").hidden = !on;
  if (on) panel();
  press("numbers", on);
  refresh();
}

function theme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  press("night", dark);
  refresh();
}

function reset() {
  view = firstView();
  refresh();
}

function go(which) { along(which); refresh(); }

function move(x, y, e) {
  if (e.shiftKey) shift(MOVE * x, MOVE * y); else turn(STEP * x, STEP * y);
  refresh();
}

function bigger(k) { zoom(k); refresh(); }

function arrows(k) { look.arrows *= k; legend(); refresh(); }

const keys = {
  " ": () => play(!clock.playing), ArrowLeft: (e) => nudge(e.shiftKey ? -10 : -1), ArrowRight: (e) => nudge(e.shiftKey ? 10 : 1),
  ArrowUp: () => faster(1), ArrowDown: () => faster(-1), Home: () => seek(start), End: () => seek(end),
  a: (e) => move(-1, 0, e), d: (e) => move(1, 0, e), w: (e) => move(0, -1, e), s: (e) => move(0, 1, e),
  "+": () => bigger(1.2), "=": () => bigger(1.2), "-": () => bigger(1 / 1.2), 1: () => go("front"), 2: () => go("side"), 3: () => go("top"),
  l: () => toggle("labels"), x: () => toggle("xray"), f: () => toggle("follow"), t: () => toggle("traces"), p: () => toggle("parallel"),
  c: () => section(look.cut ? "" : "view"), v: () => numbers($("values").hidden), n: () => theme(document.documentElement.dataset.theme !== "dark"),
  r: reset, "?": () => $("keys").showModal(), "[": () => arrows(0.8), "]": () => arrows(1.25),
};

// Whether the element in focus uses the key.
function taken(e) {
  const on = e.target.closest ? e.target.closest("button, select, input, summary, dialog") : null;
  if (!on || on.id === "scrub") return false;
  if (on.matches("dialog")) return true;
  if (on.matches("button, summary")) return e.key === " " || e.key === "Enter";
  return e.key.startsWith("Arrow") || e.key === "Home" || e.key === "End" || (on.matches("select") && e.key === " ");
}

function typed(e) {
  const act = keys[e.key] || keys[e.key.toLowerCase()];
  if (!act || e.ctrlKey || e.metaKey || e.altKey || taken(e)) return;
  e.preventDefault();
  act(e);
}

// Apply the options in the page, then the options in the address after ?, then the options after #. Later options override earlier
// options. The options are t (s), play, names, xray, traces, parallel, section (view, x, y, z), theme (light, dark), values, bare
// (no title; on narrow screens no legend) and flat (no WebGL).
function parameters() {
  const given = new URLSearchParams(run.shown);
  for (const part of [window.location.search, window.location.hash]) new URLSearchParams(part.slice(1)).forEach((x, key) => given.set(key, x));
  for (const [name, key] of Object.entries(BUTTONS)) if (given.has(key) && look[key] !== (given.get(key) === "1")) toggle(name);
  if (["view", "x", "y", "z"].includes(given.get("section"))) section(given.get("section"));
  if (given.has("theme")) theme(given.get("theme") === "dark");
  if (given.has("values")) numbers(given.get("values") !== "0");
  document.documentElement.toggleAttribute("data-bare", given.get("bare") === "1");
  const t = Number(given.get("t"));
  seek(given.has("t") && Number.isFinite(t) ? t : start);
  if (given.get("play") && !STILL.matches) play(true);
  return given;
}

// Each button acts as its key does.
const KEYS = { play: " ", labels: "l", xray: "x", follow: "f", traces: "t", parallel: "p", section: "c", numbers: "v", night: "n", reset: "r", help: "?" };
function buttons() {
  for (const [name, key] of Object.entries(KEYS)) $(name).onclick = keys[key];
  for (const [name, key] of Object.entries(BUTTONS)) press(name, look[key]);
  $("cut").onchange = () => section($("cut").value);
  $("cutat").oninput = () => { look.cutAt = Number($("cutat").value); refresh(); };
  $("scrub").oninput = () => { play(false); seek(Number($("scrub").value)); };
}

function hands() {
  stage.onpointerdown = (e) => { if (grasp(e)) return stage.setPointerCapture(e.pointerId); stage.setPointerCapture(e.pointerId); pointers.set(e.pointerId, { x: e.clientX, y: e.clientY, button: e.button, moved: 0 }); };
  stage.onpointermove = drag;
  stage.onpointerup = stage.onpointercancel = lift;
  stage.oncontextmenu = (e) => e.preventDefault();
  stage.addEventListener("wheel", (e) => { e.preventDefault(); bigger(Math.exp(-0.0012 * e.deltaY)); }, { passive: false });
  stage.addEventListener("webglcontextlost", (e) => { e.preventDefault(); refresh(); });
  stage.addEventListener("webglcontextrestored", () => { card = null; equip(false); refresh(); });
  window.addEventListener("resize", () => { resize(); render(); });
  window.addEventListener("hashchange", parameters);
  window.addEventListener("keydown", typed);
  DARK.addEventListener("change", () => theme(DARK.matches));
}

// Shows the title, times, events and values of the run.
function describe() {
  $("title").textContent = run.title;
  $("caption").textContent = run.caption;
  Object.assign($("scrub"), { min: String(start), max: String(end) });
  document.documentElement.toggleAttribute("data-still", last === 0);
  ticks();
  if (!$("values").hidden) panel();
  legend();
}

const HELD = ["up", "center", "arrow", "force", "pressure", "extent", "floor", "grid", "size", "view", "follow", "speeds", "speed", "rails"];

// Shows another run, at the same time and from the same view. held: whether the scales and the fit into the window stay, too.
// Scales and fit stay while the user drags a number of the scene.
function load(data, held = false) {
  const old = run, first = last === 0, alike = shapeOf(data) === shape;
  if (alike) for (const key of ["meshes", "parts", "joints"]) data[key] = old[key]; // the buffers belong to the old objects
  if (held) for (const key of HELD) data[key] = old[key];
  take(data);
  traced = hover = null;
  if (!alike) boxes = boxesOf();
  if (!held) { swept = sweep(); fits.clear(); }
  if (!held && (first || data.end !== old.end)) speeds();
  for (const joint of run.joints) for (const v of joint.values) delete v.large;
  describe();
  if (!held || !alike) equip(document.documentElement.dataset.drawn === "flat");
  else if (things?.traces) things.traces = null;
  clock.t = Math.min(end, Math.max(start, clock.t));
  render();
}

// Draws the outlines of the bodies of another run of the mechanism, at the same times. null removes the outlines.
function beside(data) {
  other = data && [data, ...read(data), data.width, 0];
  if (other) other[4] = other[1].length - 1;
  refresh();
}

function begin() {
  theme(DARK.matches);
  numbers(!PHONE.matches);
  document.documentElement.toggleAttribute("data-framed", window !== window.top && window.matchMedia("(hover: hover)").matches);
  section("");
  buttons();
  hands();
  speeds();
  describe();
  resize();
  equip(parameters().get("flat") === "1");
  render();
}

begin();
