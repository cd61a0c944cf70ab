// Checks the server repeatedly. Shows a banner while the server does not respond or is not ready.

import { $, onAnswer, key } from "./requests_and_dom.js";

const CALM = 10000, EAGER = 1500; // ms between checks
let gone = null, back = new Set(), timer = 0;

// Adds a function that is called when the server responds again. Returns a function that removes the added function.
export const onReturn = (work) => { back.add(work); return () => back.delete(work); };

export function begin() {
  onAnswer((there) => (there ? returned() : lost()));
  document.addEventListener("visibilitychange", () => { if (!document.hidden) look(); });
  look();
}

function lost() {
  gone ??= new Date();
  const since = gone.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit" });
  say(`The server has not answered since ${since}. Your text is safe; the page retries until the server answers.`);
  if (!timer) soon(EAGER);
}

function returned() {
  if (!gone) return;
  gone = null;
  say("");
  for (const work of [...back]) work();
}

const say = (text) => { if ($("banner").textContent !== text) $("banner").textContent = text; $("banner").hidden = !text; };

function soon(wait) {
  clearTimeout(timer);
  timer = setTimeout(look, wait);
}

async function look() {
  clearTimeout(timer);
  timer = 0;
  if (document.hidden && !gone) return;
  try {
    const answer = await fetch("/readyz", { headers: key() ? { Authorization: `Bearer ${key()}` } : {} });
    const told = await answer.json().catch(() => ({}));
    returned();
    if (answer.status === 503) {
      const why = told.trouble || (told.database !== "ok" ? `its database is ${told.database}` : "it has just started");
      say(`The server is not ready: ${why}. Jobs are stored and continue later.`);
    } else if (!gone) say("");
  } catch {
    lost();
  }
  soon(gone ? EAGER : CALM);
}
