// Lists of jobs: the recent jobs below a new run, and all jobs with search and comparison.

import { $, ENDED, ask, dated, few, later, make, many, wrong } from "../basics/requests_and_dom.js";
import * as outcomes from "../basics/outcome_colours.js";
import * as router from "../basics/router.js";
import { onReturn } from "../basics/server_status.js";

const PAGE = 30, LOOK = 2500, MOST = 6;
let known = new Map(), cursor = null, chosen = new Set();

export function begin() {
  $("older").addEventListener("click", () => more().catch(wrong));
  $("search").addEventListener("input", later(() => anew()));
  $("comparechosen").addEventListener("click", () => router.go(`/compare?jobs=${[...chosen].join(",")}`));
  $("joblist").addEventListener("keydown", arrows);
  onReturn(() => { if (router.here() === "list") anew().catch(wrong); });
}

export async function enter() {
  await anew().catch(wrong);
  const timer = setInterval(() => {
    if (!document.hidden && [...known.values()].some((j) => !ENDED.includes(j.state))) fresh().catch(() => {});
  }, LOOK);
  return () => clearInterval(timer);
}

async function anew() {
  [known, cursor] = [new Map(), null];
  await more();
}

// Fetches a page of jobs. Returns null if a newer search has started in the meantime.
async function answer(from) {
  const list = known, page = await ask("GET", asking(from));
  if (list !== known) return null;
  for (const job of page.jobs) known.set(job.id, job);
  return page;
}

const asking = (from) => "/v1/jobs?" + new URLSearchParams({ limit: PAGE, ...($("search").value ? { search: $("search").value } : {}), ...(from ? { cursor: from } : {}) });

async function more() {
  const page = await answer(cursor);
  if (!page) return;
  cursor = page.next;
  $("older").hidden = !cursor;
  list();
}

async function fresh() {
  if (await answer(null)) list();
}

export async function recent() {
  const { jobs } = await ask("GET", "/v1/jobs?limit=5");
  fill($("recent"), jobs, false);
  if (!jobs.length) $("recent").replaceChildren(make("li", { class: "empty" }, "None yet. Press Run: the first sweep of a model takes a few seconds."));
}

function list() {
  const rows = [...known.values()].sort((a, b) => (a.created < b.created ? 1 : -1));
  fill($("joblist"), rows, true);
  if (!rows.length) $("joblist").replaceChildren(make("li", { class: "empty" }, $("search").value ? "No job has this text in its label, tags, scene or id." : "No jobs yet: begin a new run."));
  picked();
}

// Replaces the rows of a list. The focus stays on the same element of the same job.
function fill(box, jobs, choosing) {
  const focused = box.contains(document.activeElement) ? [document.activeElement.tagName, document.activeElement.dataset.job] : null;
  box.replaceChildren(...jobs.map((job) => row(job, choosing)));
  if (focused) [...box.querySelectorAll(focused[0])].find((n) => n.dataset.job === focused[1])?.focus();
}

function row(job, choosing) {
  const name = job.label || job.scene, going = !ENDED.includes(job.state);
  const early = outcomes.earlyText(job), amber = early && job.state === "done";
  const told = [job.label && job.label !== job.scene ? job.scene : "", few(job.cases, "case"), amber ? "" : early, job.lost ? `${many(job.lost)} could not be run` : "", job.tags.join(" ")].filter(Boolean).join(" · ");
  const box = choosing ? make("input", { type: "checkbox", "data-job": job.id, "aria-label": `compare ${name} ${job.id.slice(0, 8)}`, onchange: (e) => { if (e.target.checked) chosen.add(job.id); else chosen.delete(job.id); picked(); } }) : null;
  if (box) box.checked = chosen.has(job.id);
  const link = make("a", { href: `/jobs/${job.id}`, "data-route": true, "data-job": job.id }, name);
  const meter = going ? make("progress", { max: 1, value: job.progress, "aria-label": `progress of ${name}` }) : null;
  return make("li", { class: "jobrow" }, box, make("span", { class: "what" }, link, make("small", {}, told)), make("span", { class: `pill ${amber ? "early" : job.state}` }, going ? job.stage : amber ? early : job.state), meter, make("span", { class: "when" }, dated(job.created)));
}

function picked() {
  for (const id of [...chosen]) if (!known.has(id)) chosen.delete(id);
  $("comparechosen").disabled = chosen.size < 2 || chosen.size > MOST;
  $("comparechosen").textContent = chosen.size ? `Compare ${chosen.size}` : "Compare";
}

// Moves the focus through the list by arrow keys.
function arrows(e) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
  if (!step) return;
  const links = [...$("joblist").querySelectorAll("a")], at = links.findIndex((a) => a.closest("li") === document.activeElement.closest("li"));
  links[Math.min(links.length - 1, Math.max(0, at + step))]?.focus();
  e.preventDefault();
}
