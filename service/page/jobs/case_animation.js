// The animation of a case, in a frame beside its curves. It shows the time of the cursor.

import { $, choices } from "../basics/requests_and_dom.js";

let job = null, tell = () => {}, wide = false, ready = false, from = 0, asked = 0, wish = null;

export function begin(onTime) {
  tell = onTime;
  $("moving").addEventListener("change", () => load(true));
  $("wide").addEventListener("click", () => spread(!wide));
  document.addEventListener("keydown", (e) => { if (e.key === "Escape" && wide) spread(false); });
  $("animation").addEventListener("load", loaded);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (e) => $("animation").contentWindow?.theme?.(e.matches));
}

export function clear() {
  spread(false);
  ready = false;
  $("animation").removeAttribute("src");
  for (const id of ["animation", "animationlink", "wide"]) $(id).hidden = true;
  $("motionnote").hidden = false;
  $("moving").replaceChildren();
  job = null;
}

// Offers cases for the animation. The case that was shown stays selected, else the first case is selected.
export function offer(now, numbers) {
  const before = job?.id === now.id ? $("moving").value : "";
  job = now;
  choices($("moving"), numbers.map((n) => [String(n), `case ${n}`]));
  if (!numbers.length) { $("animation").hidden = true; $("motionnote").textContent = "No case is selected for the animation."; $("motionnote").hidden = false; return; }
  const chosen = numbers.includes(wish) ? String(wish) : $("moving").value;
  wish = null;
  if (chosen === before) return;
  $("moving").value = chosen;
  load(true);
}

// Plays this case when it is offered next.
export function prefer(n) { wish = n; }

// play: whether the motion begins at once; not for users who prefer reduced motion.
function load(play) {
  const address = `/v1/jobs/${job.id}/cases/${$("moving").value}/animation`;
  ready = false;
  asked = from;
  $("motionnote").textContent = "Loading the motion …";
  $("motionnote").hidden = false;
  $("animation").src = `${address}?values=0&t=${from}${play ? "&play=1" : ""}`;
  $("animationlink").href = address;
  for (const id of ["animation", "animationlink", "wide"]) $(id).hidden = false;
}

function loaded() {
  const inside = $("animation").contentDocument;
  if (!$("animation").hasAttribute("src") || !inside?.getElementById("stage")) {
    if ($("animation").hasAttribute("src")) refused(inside);
    return;
  }
  ready = true;
  $("motionnote").hidden = true;
  inside.addEventListener("shown", (e) => {
    if (Math.abs(e.detail.t - from) > 1e-12) { from = e.detail.t; tell(from); }
  });
  inside.addEventListener("keydown", (e) => { if (e.key === "Escape" && wide) { spread(false); $("wide").focus(); } });
  if (from !== asked) $("animation").contentWindow.seek(from); // the cursor was moved in the meantime
}

// Shows the error that the server returned instead of an animation.
function refused(inside) {
  $("animation").hidden = true;
  let why = "";
  try { const told = JSON.parse(inside.body.textContent); why = told.problems?.[0]?.what ?? told.detail; } catch { /* the response names no reason */ }
  $("motionnote").textContent = `This case cannot be animated${why ? `: ${why}` : " now"}.`;
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
