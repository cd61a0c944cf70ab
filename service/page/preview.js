// The mechanism at its start, drawn beside the editor, to be turned: the same page as runs are shown on, in a frame.

import { $, askText, later, make, problemList } from "./api.js";

const SLOW = 600; // ms, after which the picture of an earlier scene is seen to be that
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

// Why there is no new picture; the last one stays, faintly.
export function stale(problems) {
  front?.classList.add("stale");
  $("previewnote").replaceChildren(...(problems.length ? [problemList(problems)] : [front ? "The picture is of the last scene that was right." : ""]));
}

// A new frame is loaded behind the one that is seen, and takes its place, and its view where it is the same model, when it is drawn.
function show(page, model) {
  return new Promise((resolve, reject) => {
    const frame = make("iframe", { title: "the mechanism at its start: arrow keys and W A S D turn it", src: "/page/stage.html", class: "behind" });
    let loads = 0;
    frame.addEventListener("load", () => {
      if (++loads === 1) {
        try { frame.contentWindow.put(page); } catch { frame.remove(); reject(new Error("it could not be loaded")); } // the server went meanwhile
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
