// The left side: a scene, checked as it is typed; the sweep over its numbers, checked as well; and its submission.

import { $, ask, later, make, notice, number, problemItem } from "./api.js";

let facts = null;
let submitted = () => {};
const FIRST = [".friction.mu", ".friction.", ".start."];

export async function begin(onSubmitted) {
  submitted = onSubmitted;
  const models = await ask("GET", "/v1/models");
  $("model").replaceChildren(...models.map((m) => make("option", { value: m.name }, m.title || m.name)));
  $("model").value = "spherical_pendulum";
  $("model").addEventListener("change", () => load().catch((e) => notice(e.message)));
  $("scene").addEventListener("input", checkScene);
  $("addaxis").addEventListener("click", () => { axis("", "").focus(); });
  $("sweep").addEventListener("input", checkJob);
  for (const way of [...document.getElementsByName("way"), $("goal")]) way.addEventListener("change", switched);
  $("sweep").addEventListener("submit", (e) => { e.preventDefault(); submit().catch((x) => notice(x.message)); });
  await load();
}

async function load() {
  const model = await ask("GET", `/v1/models/${$("model").value}`);
  $("scene").value = model.text;
  $("axes").tBodies[0].replaceChildren();
  $("reductions").value = "";
  $("until").value = "";
  await check();
}

const way = () => document.querySelector("input[name=way]:checked").value;

function switched() {
  const study = way() === "optimise" || way() === "refine";
  $("sampling").hidden = way() !== "sample";
  $("study").hidden = !study;
  $("goallabel").hidden = $("withinlabel").hidden = way() !== "optimise";
  $("targetlabel").hidden = way() !== "optimise" || $("goal").value !== "reach";
  if (study && (!$("goalof").value || $("goalof").value === "outcome")) $("goalof").value = way() === "refine" ? "outcome" : (facts?.reductions[0] ?? "");
  $("valueshead").textContent = study ? "low:high" : way() === "sample" ? "low:high, or normal(mean, deviation), triangular(low, mode, high), …" : "first:last:count, or a, b, c";
  for (const input of document.querySelectorAll(".values")) {
    const parts = input.value.split(":");
    if (way() !== "over" && parts.length === 3) input.value = parts.slice(0, 2).join(":");
    if (way() === "over" && parts.length === 2) input.value += ":11";
  }
  checkJob();
}

function axis(path, values) {
  const input = make("input", { class: "path", list: "paths", value: path, "aria-label": "number of the scene" });
  const range = make("input", { class: "values", value: values, "aria-label": "its values" });
  const row = make("tr", {}, make("td", {}, input), make("td", {}, range));
  const remove = () => { row.remove(); $("addaxis").focus(); checkJob(); };
  row.append(make("td", {}, make("button", { type: "button", title: "remove", "aria-label": "remove", onclick: remove }, "×")));
  input.addEventListener("change", () => { if (!range.value) range.value = suggested(input.value); });
  $("axes").tBodies[0].append(row);
  return input;
}

function suggested(path) {
  const found = facts?.parameters.find((p) => p.path === path);
  if (!found) return "";
  const [low, high] = found.value ? [found.value / 2, found.value * 1.5].sort((a, b) => a - b) : [0, 1];
  return `${+low.toPrecision(4)}:${+high.toPrecision(4)}` + (way() === "over" ? ":21" : "");
}

const checkScene = later((signal) => check(signal));

async function check(signal) {
  const box = $("verdict");
  try {
    facts = await ask("POST", "/v1/scenes/check", { scene_text: $("scene").value }, signal);
  } catch (e) {
    if (e.name === "AbortError") throw e;
    facts = null;
    box.className = "verdict bad";
    box.replaceChildren(make("ul", {}, ...(e.problems?.length ? e.problems : [{ where: "scene", what: e.message }]).map((p) => problemItem(p, toLine))));
    $("submit").disabled = true;
    $("jobverdict").className = "verdict";
    $("jobverdict").textContent = "The scene has to be right first.";
    return;
  }
  const few = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
  const bodies = few(facts.bodies.length, "bod").replace(/bod$/, "body").replace(/bods$/, "bodies");
  box.className = "verdict good";
  box.replaceChildren(`No problems: ${bodies}, ${few(Object.keys(facts.joints).length, "joint")}, ${few(facts.loops, "loop")}, ` +
    `${few(facts.parameters.length, "number")}, ${few(facts.columns.length, "column")}.`);
  $("paths").replaceChildren(...facts.parameters.map((p) => make("option", { value: p.path }, `${number(p.value)} ${p.unit === "1" ? "" : p.unit}`)));
  if (!$("axes").tBodies[0].rows.length) {
    const path = FIRST.map((f) => facts.parameters.find((p) => p.path.includes(f))).find(Boolean)?.path ?? facts.parameters[0].path;
    axis(path, suggested(path));
  }
  if (!$("reductions").value) $("reductions").value = facts.reductions.slice(0, 8).join("\n");
  if (!$("until").value) $("until").value = facts.until;
  $("results").replaceChildren(...["outcome", ...facts.reductions].map((r) => make("option", { value: r })));
  await checkRequest(signal);
}

function toLine(line) {
  const text = $("scene").value.split("\n"), at = text.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  $("scene").focus();
  $("scene").setSelectionRange(at, at + (text[line - 1] || "").length);
  $("scene").scrollTop = Math.max(0, (line - 5) * 18);
}

export function request() {
  const rows = [...$("axes").tBodies[0].rows].map((r) => [r.querySelector(".path").value.trim(), r.querySelector(".values").value.trim()]);
  const named = rows.filter(([path]) => path);
  const body = {
    scene_text: $("scene").value, label: $("label").value,
    reductions: $("reductions").value.split("\n").map((x) => x.trim()).filter(Boolean),
  };
  if ($("until").value) body.until = +$("until").value;
  if (way() === "over") body.over = Object.fromEntries(named.map(([p, v]) => [p, v.includes(":") ? v : v.split(",").map((x) => x.trim())]));
  else if (way() === "optimise" || way() === "refine") body[way()] = study(named);
  else {
    const ranges = Object.fromEntries(named.map(([p, v]) => [p, v.includes("(") ? v : v.split(":").slice(0, 2).map((x) => x.trim())]));
    for (const p of Object.keys(ranges)) if (Array.isArray(ranges[p]) && ranges[p].length < 2) ranges[p].push("");
    body.sample = { ranges, count: +$("count").value, seed: +$("seed").value, method: $("method").value };
  }
  return body;
}

const ends = (text) => { const parts = text.split(":").slice(0, 2).map((x) => x.trim()); return parts.length < 2 ? [...parts, ""] : parts; };

// What is asked of a study.
function study(named) {
  const asked = { bounds: Object.fromEntries(named.map(([p, v]) => [p, ends(v)])), cases: +$("most").value };
  const of = $("goalof").value.trim();
  if (way() === "refine") return { ...asked, of };
  asked[$("goal").value] = $("goal").value === "reach" ? [of, $("target").value.trim()] : of;
  const kept = $("within").value.split(",").map((x) => x.trim()).filter(Boolean).map((x) => [x.slice(0, x.lastIndexOf("=")).trim(), ends(x.slice(x.lastIndexOf("=") + 1)).map((e) => e || null)]);
  if (kept.length) asked.within = Object.fromEntries(kept);
  return asked;
}

const checkJob = later((signal) => (facts ? checkRequest(signal) : Promise.resolve()));

async function checkRequest(signal) {
  const box = $("jobverdict");
  try {
    const found = await ask("POST", "/v1/jobs/check", request(), signal);
    box.className = "verdict good";
    box.textContent = `${["optimise", "refine"].includes(way()) ? "at most " : ""}${found.cases.toLocaleString("en")} case${found.cases === 1 ? "" : "s"}`;
    $("submit").disabled = false;
  } catch (e) {
    if (e.name === "AbortError") throw e;
    box.className = "verdict bad";
    box.replaceChildren(make("ul", {}, ...(e.problems?.length ? e.problems : [{ where: "job", what: e.message }]).map((p) => problemItem(p))));
    $("submit").disabled = true;
  }
}

async function submit() {
  notice("");
  $("submit").disabled = true;
  try {
    const job = await ask("POST", "/v1/jobs", request());
    await submitted(job);
  } finally {
    $("submit").disabled = false;
  }
}
