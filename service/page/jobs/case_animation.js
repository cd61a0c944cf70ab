// The animation of a case, in a frame beside the curves of the case. The animation shows the time of the cursor.

import { $, askText, choices, wrong } from "../basics/requests_and_dom.js";

let job = null, tell = () => {}, played = () => {}, wide = false, ready = false, from = 0, asked = 0, wish = null, others = [], still = "", over = false;

// onTime: called with the time that the animation shows; onCase: called with the number of a case that is loaded.
export function begin(onTime, onCase) {
  [tell, played] = [onTime, onCase];
  $("moving").addEventListener("change", () => load(true));
  $("wide").addEventListener("click", () => spread(!wide));
  document.addEventListener("keydown", (e) => { if (e.key === "Escape" && wide) spread(false); });
  $("animation").addEventListener("load", loaded);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (e) => $("animation").contentWindow?.theme?.(e.matches));
}

export function clear() {
  spread(false);
  [ready, still] = [false, ""];
  $("animation").removeAttribute("src");
  for (const id of ["animation", "animationlink", "wide"]) $(id).hidden = true;
  say("");
  $("moving").replaceChildren();
  $("moving").parentElement.hidden = true;
  job = null;
}

const say = (text) => { $("motionnote").textContent = text; };

// Shows the start of a job's scene until its first case has a row.
export async function start(now, scene, ended) {
  if (job) return;
  [job, over] = [now, ended];
  say("Loading the start …");
  const page = await askText("POST", "/v1/scenes/view?shown=values%3D0%26bare%3D1", { scene });
  if (job?.id !== now.id || $("moving").value) return;
  still = page;
  $("animation").src = "/page/blank_frame.html";
  $("animation").hidden = false;
}

// Offers cases for the animation. If the shown case is among the offered cases, it stays selected. Otherwise the first case is
// selected.
export function offer(now, numbers) {
  const before = job?.id === now.id ? $("moving").value : "";
  job = now;
  choices($("moving"), numbers.map((n) => [String(n)]));
  $("moving").parentElement.hidden = !numbers.length;
  others = numbers;
  if (!numbers.length) { $("animation").hidden = true; say("No case is selected for the animation."); return; }
  const chosen = numbers.includes(wish) ? String(wish) : $("moving").value;
  wish = null;
  if (chosen === before) { if (ready) outlined().catch(wrong); return; }
  $("moving").value = chosen;
  load(true);
}

// Plays this case as soon as the list offers it.
export function prefer(n) { wish = n; }

// play: whether the motion begins at once. For users who prefer reduced motion, the motion never begins at once.
function load(play) {
  const address = `/v1/jobs/${job.id}/cases/${$("moving").value}/animation`;
  ready = false;
  asked = from;
  say("Loading the motion …");
  played(+$("moving").value);
  $("animation").src = `${address}?values=0&bare=1&t=${from}${play ? "&play=1" : ""}`;
  $("animationlink").href = address;
  for (const id of ["animation", "animationlink", "wide"]) $(id).hidden = false;
}

function loaded() {
  const inside = $("animation").contentDocument;
  if (still) {
    const page = still;
    still = "";
    try { $("animation").contentWindow.put(page); } catch { $("animation").hidden = true; say(""); return; } // the server was lost in the meantime
    say(`The start of the mechanism.${over ? "" : " The first finished case will be played here."}`);
    return;
  }
  if (!$("animation").hasAttribute("src") || !inside?.getElementById("stage")) {
    if ($("animation").hasAttribute("src")) refused(inside);
    return;
  }
  if (!$("moving").value) return; // the start
  ready = true;
  say("");
  inside.addEventListener("shown", (e) => {
    if (Math.abs(e.detail.t - from) > 1e-12) { from = e.detail.t; tell(from); }
  });
  inside.addEventListener("keydown", (e) => { if (e.key === "Escape" && wide) { spread(false); $("wide").focus(); } });
  if (from !== asked) $("animation").contentWindow.seek(from); // the cursor was moved in the meantime
  outlined().catch(wrong);
}

// Draws the outlines of a second case over the case that is played. The second case is the first other shown case.
async function outlined() {
  const n = others.find((k) => String(k) !== $("moving").value), mine = job.id, inside = $("animation").contentWindow;
  if (n === undefined) { inside.beside(null); say(""); return; }
  const page = await askText("GET", `/v1/jobs/${mine}/cases/${n}/animation`);
  if (job?.id !== mine || !ready || n !== others.find((k) => String(k) !== $("moving").value)) return;
  inside.beside(JSON.parse(new DOMParser().parseFromString(page, "text/html").getElementById("data").textContent));
  say(`Outlined: case ${n}.`);
}

// Shows the error that the server returned instead of an animation.
function refused(inside) {
  $("animation").hidden = true;
  let why = "";
  try { const told = JSON.parse(inside.body.textContent); why = told.problems?.[0]?.what ?? told.detail; } catch { /* the response names no reason */ }
  say(`This case cannot be animated${why ? `: ${why}` : " now"}.`);
}

export function seek(t) {
  from = t;
  if (ready) $("animation").contentWindow.seek(t);
}

function spread(on) {
  wide = on;
  $("motion").classList.toggle("wide", on);
  document.body.classList.toggle("covered", on);
  $("wide").textContent = on ? "Back to the page" : "Fill the window";
  if (ready) $("animation").contentWindow.numbers?.(on && innerWidth > 900);
}
