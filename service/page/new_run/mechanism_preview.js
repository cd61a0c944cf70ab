// The motion of the scene beside the editor. A changed scene runs at once. While the user drags a number, the newest text runs
// next.

import { $, ask, askText, make, problemList } from "../basics/requests_and_dom.js";
import * as browser from "./webassembly_runs.js";
import * as curve from "./motion_curve.js";

const SLOW = 600; // time until the picture of an earlier scene is marked as outdated, ms
const SHOWN = "values=0&bare=1&names=1";
const STILL = matchMedia("(prefers-reduced-motion: reduce)");
let frame = null, of = null, wanted = null, busy = false, told = () => {};
let latest = null, turn = 0, shownTurn = 0, due = false; // latest: the last data from the server; turn, shownTurn: numbers of the newest and of the shown text

// shown: called with the data of each run, except runs during a drag.
export function begin(shown) {
  told = shown;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (e) => { view()?.theme?.(e.matches); curve.draw(); });
  curve.begin();
}

export const view = () => frame?.contentWindow;

// Runs a scene next. model: the bundled model from which the scene was made. A run of another model begins with a new view.
export function run(text, model) { want({ text, model, held: false }); }

// Runs a scene next, while the user drags a number or a point. View and scales stay. The browser runs the scene if it can, else the
// server does. text: returns the newest text.
export function follow(text) {
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    const data = browser.run(latest);
    if (data) show(data, { model: of, held: true, turn: ++turn });
    else want({ text: text(), model: of, held: true });
  });
}

function want(next) {
  wanted = { ...next, turn: ++turn };
  if (!busy) work();
}

// Runs one text at a time. Of the texts that arrive during a run, only the newest is run next, so that the picture follows the drag.
async function work() {
  busy = true;
  $("preview").setAttribute("aria-busy", "true");
  while (wanted) {
    const next = wanted, late = setTimeout(() => { frame?.classList.add("stale"); $("previewnote").textContent = "Running …"; }, frame ? SLOW : 0);
    wanted = null;
    try {
      if (!frame) await open(await askText("POST", `/v1/scenes/view?shown=${encodeURIComponent(SHOWN)}`, { scene_text: next.text }));
      latest = await ask("POST", `/v1/scenes/run?held=${next.held}`, { scene_text: next.text });
      show({ ...latest }, next);
      $("previewnote").textContent = "";
    } catch (e) {
      stale(e.problems?.length ? e.problems : [{ where: "picture", what: e.message }]);
    } finally {
      clearTimeout(late);
    }
  }
  busy = false;
  $("preview").setAttribute("aria-busy", "false");
}

function show(data, { model, held, turn: mine }) {
  if (mine < shownTurn) return; // the browser has run a newer text
  shownTurn = mine;
  const inside = view(), other = model !== of;
  if (!inside?.load) throw new Error("the page could not be loaded"); // the server was lost in the meantime
  frame.classList.remove("stale");
  inside.load(data, held);
  curve.put(inside, data, held);
  if (other) { inside.reset(); inside.seek(0); inside.play(!STILL.matches); }
  of = model;
  $("outcome").textContent = data.outcome;
  if (!held) told(data);
}

// Shows why there is no new picture. The last picture stays, dimmed.
export function stale(problems) {
  frame?.classList.add("stale");
  $("previewnote").replaceChildren(...(problems.length ? [problemList(problems)] : [frame ? "The picture shows the last scene without problems." : ""]));
}

// Loads the page with the start of the scene into a frame. This frame shows all later runs.
function open(page) {
  return new Promise((resolve, reject) => {
    const made = make("iframe", { title: "the mechanism in motion: arrow keys step through time, W A S D turn it", src: "/page/blank_frame.html", class: "behind" });
    let loads = 0;
    made.addEventListener("load", () => {
      if (++loads === 1) {
        try { made.contentWindow.put(page); } catch { made.remove(); reject(new Error("the page could not be loaded")); } // the server was lost in the meantime
        return;
      }
      if (loads > 2) return;
      frame = made;
      frame.classList.remove("behind");
      made.contentDocument.addEventListener("shown", (e) => curve.cursor(e.detail.t));
      resolve();
    });
    $("preview").append(made);
  });
}
