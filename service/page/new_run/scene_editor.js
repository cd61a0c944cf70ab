// The scene editor, with line numbers and with problems at their lines. Undo works for typed changes and for dragged changes.

import { $, make } from "../basics/requests_and_dom.js";

const GAP = 3; // distance between the end of a line and its problem, characters
const PAUSE = 1000, MOST = 500; // ms after which typing begins a new change; number of changes that can be undone
let lines = 0, past = [], future = [], last = { text: "", name: "", time: 0 }, changed = () => {};

export function begin(onChange) {
  changed = onChange;
  const box = $("scene");
  box.addEventListener("input", () => { note("typed", PAUSE); changed(); });
  box.addEventListener("beforeinput", (e) => { if (e.inputType.startsWith("history")) { e.preventDefault(); step(e.inputType === "historyUndo"); } });
  box.addEventListener("scroll", follow);
  $("compose").addEventListener("keydown", (e) => {
    const key = e.key.toLowerCase(), own = !e.target.matches("input:not([type=range]), textarea:not(#scene)");
    if ((e.ctrlKey || e.metaKey) && own && (key === "z" || key === "y")) { e.preventDefault(); step(key === "z" && !e.shiftKey); }
  });
  $("undo").addEventListener("click", () => step(true));
  $("redo").addEventListener("click", () => step(false));
}

// Records a change of the text. Undo reverts two consecutive changes together if they have the same name and at most `pause` ms lie
// between them.
function note(name, pause = Infinity) {
  const now = performance.now();
  if (last.name !== name || now - last.time > pause) past = [...past, last.text].slice(-MOST);
  future = [];
  last = { text: text(), name, time: now };
  numbered();
  enable();
}

const enable = () => { $("undo").disabled = !past.length; $("redo").disabled = !future.length; };

function step(back) {
  const [from, to] = back ? [past, future] : [future, past];
  if (!from.length) return;
  to.push(last.text);
  last = { text: from.pop(), name: "", time: 0 };
  const { scrollTop, scrollLeft } = $("scene");
  $("scene").value = last.text;
  Object.assign($("scene"), { scrollTop, scrollLeft });
  numbered();
  enable();
  changed();
}

// Replaces the characters from first to end. Changes with the same name are undone together, until `settle`.
export function replace(first, end, by, name) {
  $("scene").setRangeText(by, first, end, "preserve");
  note(name);
}

export const settle = () => { last.name = ""; };

export const text = () => $("scene").value;

export function put(given) {
  $("scene").value = given;
  $("scene").scrollTop = $("scene").scrollLeft = 0;
  [past, future, last] = [[], [], { text: text(), name: "", time: 0 }];
  enable();
  tell([]);
  numbered();
}

function numbered() {
  const n = $("scene").value.split("\n").length;
  if (n === lines) return;
  lines = n;
  $("gutter").textContent = Array.from({ length: n }, (_, i) => i + 1).join("\n");
  follow();
}

function follow() {
  const { scrollTop, scrollLeft } = $("scene");
  $("gutter").style.transform = `translateY(${-scrollTop}px)`;
  $("marks").style.transform = `translateY(${-scrollTop}px)`;
  for (const m of $("marks").querySelectorAll("span")) m.style.left = `calc(${+m.dataset.at + GAP}ch - ${scrollLeft}px)`;
}

// Shows problems at the ends of their lines.
export function tell(problems) {
  const told = problems.filter((p) => p.line);
  const rows = $("scene").value.split("\n"), byLine = Map.groupBy(told, (p) => p.line);
  $("marks").replaceChildren(...[...byLine].map(([line, found]) => {
    const words = make("span", { "data-at": (rows[line - 1] ?? "").length }, found.map((p) => p.what).join("; "));
    const mark = make("div", { class: "mark" }, words);
    mark.style.setProperty("--line", line - 1);
    return mark;
  }));
  $("scene").setAttribute("aria-invalid", String(problems.length > 0));
  follow();
}

export function toLine(line) {
  const box = $("scene"), rows = box.value.split("\n"), at = rows.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  box.focus();
  box.setSelectionRange(at, at + (rows[line - 1] || "").length);
  box.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(box).lineHeight));
}
