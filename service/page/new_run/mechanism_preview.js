// An interactive view of the mechanism at its start, beside the editor. It is an animation page in a frame.

import { $, askText, later, make, problemList } from "../basics/requests_and_dom.js";

const SLOW = 600; // time until the picture of an earlier scene is marked as outdated, ms
const SHOWN = "values=0&bare=1&names=1";
let front = null, of = "", turn = 0;

export function begin() {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (e) => front?.contentWindow.theme?.(e.matches));
}

export const draw = later(async (signal, text, model) => {
  const mine = ++turn;
  $("preview").setAttribute("aria-busy", "true");
  const late = () => { if (mine === turn) { front?.classList.add("stale"); $("previewnote").textContent = "Drawing …"; } };
  const slow = setTimeout(late, front ? SLOW : 0);
  try {
    const page = await askText("POST", `/v1/scenes/view?shown=${encodeURIComponent(SHOWN)}`, { scene_text: text }, signal);
    if (mine === turn) await show(page, model);
    $("previewnote").textContent = "";
  } catch (e) {
    if (e.name === "AbortError") throw e;
    stale(e.problems?.length ? e.problems : [{ where: "picture", what: e.message }]);
  } finally {
    clearTimeout(slow);
    if (mine === turn) $("preview").setAttribute("aria-busy", "false");
  }
}, 150);

// Shows why there is no new picture. The last picture stays and is dimmed.
export function stale(problems) {
  front?.classList.add("stale");
  $("previewnote").replaceChildren(...(problems.length ? [problemList(problems)] : [front ? "The picture shows the last scene without problems." : ""]));
}

// Loads a new frame behind the visible frame. After it is drawn, the new frame replaces the visible frame. If both show the same
// model, the view direction stays the same.
function show(page, model) {
  return new Promise((resolve, reject) => {
    const frame = make("iframe", { title: "the mechanism at its start: arrow keys and W A S D turn it", src: "/page/blank_frame.html", class: "behind" });
    let loads = 0;
    frame.addEventListener("load", () => {
      if (++loads === 1) {
        try { frame.contentWindow.put(page); } catch { frame.remove(); reject(new Error("the page could not be loaded")); } // the server was lost in the meantime
        return;
      }
      if (loads > 2) return;
      const inside = frame.contentWindow;
      if (front && model === of) inside.standing?.(front.contentWindow.standing?.());
      requestAnimationFrame(() => requestAnimationFrame(() => {
        frame.classList.remove("behind");
        for (const other of [...$("preview").querySelectorAll("iframe")]) if (other !== frame) other.remove();
        [front, of] = [frame, model];
        resolve();
      }));
    });
    $("preview").append(frame);
  });
}
