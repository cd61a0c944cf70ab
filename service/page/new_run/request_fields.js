// Converts the fields of a request from the form and to the form.

import { $, make } from "../basics/requests_and_dom.js";
import * as measured from "./measured_curves.js";

const SEP = ", ";
export const way = () => document.querySelector("input[name=way]:checked").value;
const study = () => way() === "optimise" || way() === "refine";

export function clear() {
  $("axes").replaceChildren();
  for (const id of ["reductions", "until", "label", "goalof", "target", "within"]) $(id).value = "";
}

// Sets the default result of a study. The default of a refinement is the outcome. Other studies have the scene's first default
// reduction.
export function proposed(facts) {
  measured.offer(facts?.columns ?? []);
  if (study() && (!$("goalof").value || $("goalof").value === "outcome")) $("goalof").value = way() === "refine" ? "outcome" : (facts?.reductions[0] ?? "");
}

export function switched(facts) {
  $("fitting").hidden = way() !== "fit";
  for (const id of ["reductions", "keephelp", "untillabel"]) $(id).hidden = way() === "fit";
  $("axes").hidden = $("moreaxes").hidden = way() === "once";
  $("sampling").hidden = way() !== "sample";
  $("study").hidden = !study();
  $("goallabel").hidden = $("withinlabel").hidden = way() !== "optimise";
  $("targetlabel").hidden = way() !== "optimise" || $("goal").value !== "reach";
  proposed(facts);
  if (way() === "once") return;
  for (const input of document.querySelectorAll(".values")) {
    const parts = input.value.split(":");
    if (way() !== "vary" && parts.length === 3) input.value = parts.slice(0, 2).join(":");
    if (way() === "vary" && parts.length === 2) input.value += ":11";
    input.placeholder = forms();
    arrange(input.closest(".axis"));
  }
}

const forms = () => (study() || way() === "fit" ? "low:high" : way() === "sample" ? "low:high, or normal(mean, deviation), triangular(low, mode, high), …" : "first:last:count, or a, b, c");

const ENDS = [["from", "first value"], ["to", "last value"], ["steps", "number of values"]];

// The parts of a text first:last or first:last:count; null for other texts, such as a list.
function parts(text) {
  const found = text.split(":").map((x) => x.trim());
  return /[(,]/.test(text) || found.length > 3 || (text && found.length < 2) ? null : found;
}

// Shows the range of a row in the row's fields. A range that the fields cannot represent, or that the user wants as text, is shown
// as text.
function arrange(row, asText = false) {
  const values = row.querySelector(".values"), found = asText ? null : parts(values.value);
  row.querySelector(".range").hidden = !found;
  values.hidden = Boolean(found);
  row.querySelector(".text").textContent = found ? "as text" : "as fields";
  row.querySelector(".text").disabled = !found && !parts(values.value);
  row.querySelectorAll(".range input").forEach((input, k) => { input.value = found?.[k] ?? ""; });
  row.querySelector(".range label:last-child").hidden = way() !== "vary";
}

function written(row) {
  const ends = [...row.querySelectorAll(".range label:not([hidden]) input")].map((n) => n.value.trim());
  row.querySelector(".values").value = ends.some(Boolean) ? ends.join(":") : "";
}

// Adds a row for a varied number. The row has the path, the ends of the range or a text, and a note with the present value or a
// problem.
export function axis(path, values, suggested, changed) {
  const id = `axis${Math.random().toString(36).slice(2)}`, about = { "aria-describedby": id, autocomplete: "off" };
  const input = make("input", { class: "path", list: "paths", value: path, "aria-label": "number of the scene", spellcheck: "false", ...about });
  const row = make("div", { class: "axis", role: "group" });
  const range = make("input", { class: "values", value: values, "aria-label": "values of the number", placeholder: forms(), oninput: () => arrange(row, true), ...about });
  const fields = ENDS.map(([name, said]) => make("label", {}, name, make("input", { class: name, "aria-label": said, inputmode: name === "steps" ? "numeric" : null, oninput: () => written(row), ...about })));
  const remove = make("button", { type: "button", class: "remove", "aria-label": `do not vary ${path || "this number"}`, onclick: () => { row.remove(); $("addaxis").focus(); changed(); } }, "×");
  const text = make("button", { type: "button", class: "text", onclick: () => arrange(row, !range.hidden ? false : true) });
  row.append(input, remove, make("span", { class: "range" }, ...fields), range, text, make("p", { class: "now", id }));
  input.addEventListener("change", () => { if (!range.value) { range.value = suggested(input.value).values; arrange(row); } hints(suggested); changed(); });
  $("axes").append(row);
  arrange(row);
  return input;
}

export function hints(suggested) {
  for (const row of $("axes").children) {
    const note = row.querySelector(".now"), path = row.querySelector(".path").value.trim();
    note.dataset.now = suggested(path).now;
    row.querySelector(".remove").setAttribute("aria-label", `do not vary ${path || "this number"}`);
    if (!note.classList.contains("bad")) note.textContent = note.dataset.now;
  }
}

const told = (p) => (p.hint ? `${p.what}: ${p.hint}` : p.what);
const PLACES = { reductions: "reductions", until: "until", label: "label", "sample.count": "samplecount", "sample.seed": "seed", "optimise.cases": "most", "refine.cases": "most", reach: "target" };
const OF_WAYS = ["samplecount", "seed", "most", "target", "goalof", "within"];

// The form field to which a problem belongs. A problem with a reduction can belong to the goal or to a constraint of a study.
function place(p) {
  if (p.where.startsWith("within")) return "within";
  const named = study() && p.where === "reductions" ? ["goalof", "within"].find((id) => p.what.includes(`'${$(id).value.split("=")[0].trim()}'`)) : null;
  return named ?? (p.where === "cases" && study() ? "most" : PLACES[p.where]);
}

// Shows problems at the rows and fields to which they belong.
export function tell(problems) {
  for (const row of $("axes").children) {
    const path = row.querySelector(".path").value.trim(), note = row.querySelector(".now");
    const mine = problems.filter((p) => path && p.where.split(/[.]/).slice(1).join(".").replace(/^(ranges|bounds)[.]/, "") === path);
    note.classList.toggle("bad", mine.length > 0);
    note.textContent = mine.length ? mine.map(told).join("; ") : (note.dataset.now ?? "");
    for (const input of row.querySelectorAll("input")) input.setAttribute("aria-invalid", String(mine.length > 0));
  }
  for (const id of new Set([...Object.values(PLACES), ...OF_WAYS])) $(id).setAttribute("aria-invalid", String(problems.some((p) => place(p) === id)));
  $("waynote").textContent = problems.filter((p) => OF_WAYS.includes(place(p))).map(told).join("; ");
}

const named = () => [...$("axes").children].map((row) => [row.querySelector(".path").value.trim(), row.querySelector(".values").value.trim()]).filter(([p]) => p);
const ends = (text) => { const parts = text.split(":").slice(0, 2).map((x) => x.trim()); return parts.length < 2 ? [...parts, ""] : parts; };

export function request() {
  const rows = named(), body = {
    scene_text: $("scene").value, label: $("label").value,
    reductions: $("reductions").value.split("\n").map((x) => x.trim()).filter(Boolean),
  };
  if ($("until").value) body.until = +$("until").value;
  if (way() === "vary") body.vary = Object.fromEntries(rows.map(([p, v]) => [p, v.includes(":") ? v : v.split(",").map((x) => x.trim())]));
  else if (study()) body[way()] = wanted(rows);
  else if (way() === "fit") Object.assign(body, { reductions: [], until: undefined, fit: { parameters: rows.map(([p]) => p), bounds: Object.fromEntries(rows.filter(([, v]) => v).map(([p, v]) => [p, ends(v)])), runs: measured.runs() } });
  else if (way() === "sample") {
    const ranges = Object.fromEntries(rows.map(([p, v]) => [p, v.includes("(") ? v : ends(v)]));
    body.sample = { ranges, count: +$("samplecount").value, seed: +$("seed").value, method: $("method").value };
  }
  return body;
}

// The request of a study. rows: [path, range].
function wanted(rows) {
  const asked = { bounds: Object.fromEntries(rows.map(([p, v]) => [p, ends(v)])), cases: +$("most").value };
  const of = $("goalof").value.trim();
  if (way() === "refine") return { ...asked, of };
  asked[$("goal").value] = $("goal").value === "reach" ? [of, $("target").value.trim()] : of;
  const kept = $("within").value.split(",").map((x) => x.trim()).filter(Boolean).map((x) => [x.slice(0, x.lastIndexOf("=")).trim(), ends(x.slice(x.lastIndexOf("=") + 1)).map((e) => e || null)]);
  if (kept.length) asked.within = Object.fromEntries(kept);
  return asked;
}

const spread = (v) => (Array.isArray(v) ? v.map((x) => x ?? "").join(":") : String(v));

const varies = (body) => ["vary", "over", "cases"].some((w) => Object.keys(body[w]?.[0] ?? body[w] ?? {}).length);

// Fills the form from the request of a job or from a draft. A list of cases becomes a list of values for each number.
export function put(body, suggested, changed) {
  clear();
  const is = ["sample", "optimise", "refine"].find((w) => body[w]) ?? (varies(body) ? "vary" : "once"), study = body.optimise ?? body.refine;
  document.querySelector(`input[name=way][value=${is}]`).checked = true;
  if (body.sample) { $("samplecount").value = body.sample.count; $("seed").value = body.sample.seed ?? 0; $("method").value = body.sample.method ?? "latin"; }
  if (study) {
    const goal = ["minimise", "maximise", "reach"].find((g) => study[g] != null);
    $("most").value = study.cases ?? 200;
    if (goal) $("goal").value = goal;
    $("goalof").value = goal === "reach" ? study.reach[0] : study[goal] ?? study.of ?? "";
    $("target").value = goal === "reach" ? study.reach[1] : "";
    $("within").value = Object.entries(study.within ?? {}).map(([n, e]) => `${n}=${spread(e)}`).join(SEP);
  }
  $("reductions").value = (body.reductions ?? []).join("\n");
  $("until").value = body.until ?? "";
  $("label").value = body.label ?? "";
  const listed = {};
  for (const one of body.cases ?? []) for (const [p, v] of Object.entries(one)) listed[p] = [...new Set([...(listed[p] ?? []), v])];
  const rows = Object.entries(body.vary ?? body.over ?? body.sample?.ranges ?? study?.bounds ?? listed);
  for (const [path, v] of rows) axis(path, is === "vary" && Array.isArray(v) ? v.join(SEP) : spread(v), suggested, changed);
  switched(null);
}
