// The scene editor, with line numbers and with problems at their lines.

import { $, make } from "../basics/requests_and_dom.js";

const GAP = 3; // distance between the end of a line and its problem, characters
let lines = 0, told = [];

export function begin(changed) {
  const box = $("scene");
  box.addEventListener("input", () => { numbered(); changed(); });
  box.addEventListener("scroll", follow);
}

export const text = () => $("scene").value;

export function put(given) {
  $("scene").value = given;
  $("scene").scrollTop = $("scene").scrollLeft = 0;
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
  told = problems.filter((p) => p.line);
  const rows = $("scene").value.split("\n"), byLine = Map.groupBy ? Map.groupBy(told, (p) => p.line) : grouped(told);
  $("marks").replaceChildren(...[...byLine].map(([line, found]) => {
    const words = make("span", { "data-at": (rows[line - 1] ?? "").length }, found.map((p) => p.what).join("; "));
    const mark = make("div", { class: "mark" }, words);
    mark.style.setProperty("--line", line - 1);
    return mark;
  }));
  $("scene").setAttribute("aria-invalid", String(problems.length > 0));
  follow();
}

function grouped(problems) {
  const out = new Map();
  for (const p of problems) out.set(p.line, [...(out.get(p.line) ?? []), p]);
  return out;
}

export function toLine(line) {
  const box = $("scene"), rows = box.value.split("\n"), at = rows.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  box.focus();
  box.setSelectionRange(at, at + (rows[line - 1] || "").length);
  box.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(box).lineHeight));
}
