// The form of a new run, with scene, varied numbers and reductions. The form checks all fields while the user types, and submits
// the job.

import { $, ask, askText, few, later, make, notice, number, problemList, wrong } from "../basics/requests_and_dom.js";
import * as asked from "./request_fields.js";
import * as browser from "./webassembly_runs.js";
import * as curve from "./motion_curve.js";
import * as editor from "./scene_editor.js";
import * as jobs from "../jobs/job_lists.js";
import * as measured from "./measured_curves.js";
import * as points from "./point_drag.js";
import * as preview from "./mechanism_preview.js";
import * as router from "../basics/router.js";
import * as sliders from "./number_sliders.js";
import { learn, words } from "../basics/axis_labels.js";
import { onReturn } from "../basics/server_status.js";

const DRAFT = "draft", BUSY = 3000;
const FIRST = [".friction.mu", ".friction.", ".start."];
let facts = null, shown = null, models = null, ready = false, sendKey = "";

export function begin() {
  const follow = () => preview.follow(editor.text), release = () => { editor.settle(); typed(); };
  sliders.begin(follow, () => { release(); browser.prepare().catch(wrong); });
  points.begin(follow, release);
  measured.begin(changed);
  $("model").addEventListener("change", () => load().catch(wrong));
  for (const button of document.querySelectorAll("#tour button")) button.addEventListener("click", () => touch(button.dataset).catch(wrong));
  $("addaxis").addEventListener("click", () => { asked.axis("", "", suggested, changed).focus(); changed(); });
  for (const input of [$("sweep"), $("reductions"), $("until"), $("label")]) input.addEventListener("input", changed);
  for (const way of [...document.getElementsByName("way"), $("goal")]) way.addEventListener("change", () => { asked.switched(facts); changed(); });
  $("sweep").addEventListener("submit", (e) => { e.preventDefault(); submit().catch(wrong); });
  for (const id of ["reductions", "until", "label"]) $(id).addEventListener("keydown", (e) => { if (e.key === "Enter" && (id !== "reductions" || e.ctrlKey)) { e.preventDefault(); $("sweep").requestSubmit(); } });
  onReturn(() => { if (router.here() === "compose") start().catch(wrong); });
}

// Opens the view with the request of a job (?from=ID), else with the draft of this tab, else with a bundled model.
export async function enter(query) {
  const from = query.get("from");
  await start(from).catch(wrong);
  if (from) router.remember({});
  const timer = setInterval(() => { if (!document.hidden) jobs.recent().catch(() => {}); }, BUSY);
  return () => clearInterval(timer);
}

async function start(from) {
  jobs.recent().catch(wrong);
  if (!models) {
    await learn();
    models = await ask("GET", "/v1/models");
    $("model").replaceChildren(...models.map((m) => make("option", { value: m.name }, m.title || m.name)), make("option", { value: "", hidden: true }, "a scene of your own"));
    $("model").value = "spherical_pendulum";
  }
  if (from) { await take(from); return; }
  if (ready) { await check(); return; }
  const draft = JSON.parse(sessionStorage.getItem(DRAFT) || "null");
  if (!draft) { await load(); return; }
  $("model").value = draft.model;
  editor.put(draft.scene);
  asked.put(draft.body, suggested, changed);
  ready = true;
  await check();
}

async function load() {
  const model = await ask("GET", `/v1/models/${$("model").value}`);
  editor.put(model.text);
  asked.clear();
  ready = true;
  await check();
}

// Shows one of the mechanisms for new users, with the focus on the slider that they should drag.
async function touch({ model, number: path, curve: name }) {
  $("model").value = model;
  curve.prefer(name);
  await load();
  $(`slide-${path}`)?.focus();
}

// Fills the form from the request of a job.
async function take(id) {
  const [body, scene] = await Promise.all([ask("GET", `/v1/jobs/${id}/request`), askText("GET", `/v1/jobs/${id}/scene`)]);
  $("model").value = "";
  editor.put(scene);
  asked.put(body, suggested, changed);
  ready = true;
  await check();
  notice("");
}

// Called with the data of each run that the preview shows.
export function moved(data) {
  shown = data;
  if (facts) points.put(facts.parameters, data);
}

export const typed = () => { keep(); checkScene(); };

function changed() { keep(); checkJob(); }

// Stores a draft, so that a reload of the page keeps the text.
function keep() {
  try {
    sessionStorage.setItem(DRAFT, JSON.stringify({ model: $("model").value, scene: editor.text(), body: asked.request() }));
  } catch { /* the storage is full: no draft is stored */ }
}

function suggested(path) {
  const found = facts?.parameters.find((p) => p.path === path);
  if (!found) return { values: "", now: "" };
  const [low, high] = found.value ? [found.value / 2, found.value * 1.5].sort((a, b) => a - b) : [0, 1];
  const now = `${words({ name: path, description: "varied" })}: now ${number(found.value)} ${found.unit === "1" ? "" : found.unit.replaceAll("*", "·")}`.trim();
  return { values: `${+low.toPrecision(4)}:${+high.toPrecision(4)}` + (asked.way() === "vary" ? ":21" : ""), now };
}

const checkScene = later((signal) => check(signal));

async function check(signal) {
  const box = $("verdict"), text = editor.text();
  try {
    const found = await awaited(ask("POST", "/v1/scenes/check", { scene_text: text }, signal), signal, $("verdict"), $("jobverdict"));
    if (text !== editor.text()) return; // a later check follows
    facts = found;
  } catch (e) {
    if (e.name === "AbortError") throw e;
    if (e.status === 0) return unanswered(GONE, $("verdict"), $("jobverdict"));
    facts = null;
    const problems = refused(e, "scene", box, editor.toLine);
    editor.tell(problems);
    $("facts").textContent = few(problems.length, "problem");
    $("facts").className = "bad";
    preview.stale([]);
    $("count").textContent = "";
    $("jobverdict").className = "verdict";
    $("jobverdict").textContent = "Correct the problems of the scene first.";
    return;
  }
  editor.tell([]);
  box.className = facts.notes.length ? "verdict note" : "verdict good";
  box.replaceChildren(facts.notes.length ? make("ul", {}, ...facts.notes.map((n) => make("li", {}, n))) : "No problems.");
  $("facts").className = "";
  $("facts").textContent = [few(facts.bodies.length, "body", "bodies"), few(Object.keys(facts.joints).length, "joint"), facts.loops ? few(facts.loops, "loop") : ""].filter(Boolean).join(" · ");
  preview.run(editor.text(), $("model").value);
  sliders.put(facts.parameters);
  points.put(facts.parameters, shown);
  $("paths").replaceChildren(...facts.parameters.map((p) => make("option", { value: p.path }, `${number(p.value)} ${p.unit === "1" ? "" : p.unit}`)));
  $("results").replaceChildren(...["outcome", ...facts.reductions].map((r) => make("option", { value: r })));
  if (!$("axes").children.length) {
    const path = FIRST.map((f) => facts.parameters.find((p) => p.path.includes(f))).find(Boolean)?.path ?? facts.parameters[0].path;
    asked.axis(path, suggested(path).values, suggested, changed);
  }
  asked.hints(suggested);
  asked.proposed(facts);
  if (!$("reductions").value) $("reductions").value = facts.reductions.slice(0, 8).join("\n");
  if (!$("until").value) $("until").value = facts.until;
  await checkRequest(signal);
}

// Shows and returns the problems of a refused request. While the form has problems, the user cannot submit it.
function refused(e, where, box, jump) {
  const problems = e.problems?.length ? e.problems : [{ where, what: e.message }];
  box.className = "verdict bad";
  box.replaceChildren(problemList(problems, jump));
  $("submit").disabled = true;
  return problems;
}

// Removes the results of the check of an earlier text until the new text is checked.
const SLOW = 400, GONE = "Not checked: the server does not answer."; // ms

function unanswered(why, ...boxes) {
  for (const box of boxes) {
    box.className = "verdict";
    box.textContent = why;
  }
  $("count").textContent = "";
}

async function awaited(answer, signal, ...boxes) {
  const slow = setTimeout(() => { if (!signal?.aborted) unanswered("Checking …", ...boxes); }, SLOW);
  try { return await answer; } finally { clearTimeout(slow); }
}

const checkJob = later((signal) => (facts ? checkRequest(signal) : Promise.resolve()));

async function checkRequest(signal) {
  const box = $("jobverdict");
  sendKey = crypto.getRandomValues(new Uint32Array(4)).join("-");
  try {
    const found = await awaited(ask("POST", "/v1/jobs/check", asked.request(), signal), signal, $("jobverdict"));
    asked.tell([]);
    box.className = "verdict good";
    const cases = (["optimise", "refine"].includes(asked.way()) ? "at most " : "") + few(found.cases, "case");
    box.textContent = cases;
    $("count").textContent = cases;
    $("count").className = "";
    $("submit").disabled = false;
  } catch (e) {
    if (e.name === "AbortError") throw e;
    if (e.status === 0) return unanswered(GONE, $("jobverdict"));
    const problems = refused(e, "job", box);
    asked.tell(problems);
    $("count").textContent = `${few(problems.length, "problem")} below`;
    $("count").className = "bad";
  }
}

// Submits the job. The idempotency key changes only with the form. Therefore a repeated submission after a lost response creates no
// second job.
async function submit() {
  if (!facts || $("submit").disabled) return;
  notice("");
  $("submit").disabled = true;
  $("submit").textContent = "Sending …";
  try {
    const body = asked.request();
    if (facts.name === "scene" && !body.label) body.label = $("model").value; // the scene has no name
    const job = await ask("POST", "/v1/jobs", body, undefined, { "Idempotency-Key": sendKey });
    sendKey = crypto.getRandomValues(new Uint32Array(4)).join("-");
    await router.go(`/jobs/${job.id}`);
  } finally {
    $("submit").textContent = "Run";
    $("submit").disabled = false;
  }
}

