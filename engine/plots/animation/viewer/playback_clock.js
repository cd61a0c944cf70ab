// The clock: current time, speed of playback, and redrawing at most once per frame of the screen.
"use strict";

const $ = (id) => document.getElementById(id);
const clock = { t: start, playing: false, speed: run.speed, then: 0 };
const digits = () => Math.max(0, Math.min(9, 3 - Math.floor(Math.log10((end - start) || 1))));
let shown = { places: [] }, queued = false, hover = null;

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
  const text = "t = " + clock.t.toFixed(digits()) + " s";
  $("scrub").value = String(clock.t);
  $("scrub").setAttribute("aria-valuetext", text);
  $("clock").textContent = text;
  update($("values"));
  tip();
  document.dispatchEvent(new CustomEvent("shown", { detail: { t: clock.t, playing: clock.playing } })); // for the embedding page
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
  $("play").setAttribute("aria-pressed", String(on));
  if (on) requestAnimationFrame(frame); else refresh();
}

function nudge(rowsOn) {
  play(false);
  const w = locate(clock.t), here = w.f > 0.999 ? w.i + 1 : w.i;
  const row = rowsOn < 0 && w.f > 0.001 && w.f <= 0.999 ? here + rowsOn + 1 : here + rowsOn;
  seek(times[Math.min(last, Math.max(0, row))]);
}

function ticks() {
  $("ticks").replaceChildren();
  for (const e of run.events) {
    const tick = document.createElement("span");
    tick.style.left = 100 * (e.t - start) / ((end - start) || 1) + "%";
    tick.title = e.text;
    tick.onclick = () => { play(false); seek(e.t); };
    $("ticks").append(tick);
  }
}

function speeds() {
  $("speed").replaceChildren();
  clock.speed = run.speed;
  for (const k of run.speeds) $("speed").add(new Option("× " + k, String(k), k === run.speed, k === run.speed));
  $("speed").onchange = () => { clock.speed = Number($("speed").value); };
}

function faster(k) {
  const options = [...$("speed").options], i = options.findIndex((o) => o.selected) + k;
  if (options[i]) { options[i].selected = true; clock.speed = Number(options[i].value); }
}
