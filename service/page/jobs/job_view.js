// The view of one job: stages, outcomes, problems, downloads, follow-up jobs.

import { $, ENDED, ask, dated, downloads, few, make, many, notice, problemItem, wrong } from "../basics/requests_and_dom.js";
import * as cases from "./case_curves.js";
import * as charts from "../plots/plotly.js";
import * as outcomes from "../basics/outcome_colours.js";
import * as over from "./all_cases_plot.js";
import * as questions from "./sample_study_fit_results.js";
import * as router from "../basics/router.js";
import { onReturn } from "../basics/server_status.js";
import { Table } from "../basics/result_rows.js";
import { learn } from "../basics/axis_labels.js";

const GROW = 400, GROW_LARGE = 2000; // shortest time between two updates of a running job's rows, ms
const STAGES = [["waiting", "Waiting"], ["starting", "Starting"], ["deriving", "Deriving"], ["compiling", "Compiling"], ["running", "Running"], ["ended", "Done"]];
let job = null, request = null, source = null, table = null, next = 0, seen = new Set();
const unsent = new Set(); // ids of jobs whose cancellation did not reach the server

export function begin() {
  over.begin();
  questions.begin();
  cases.begin(over.played);
  $("cancel").addEventListener("click", () => cancel(job.id));
  $("edit").addEventListener("click", () => router.go(`/?from=${job.id}`));
  $("rerun").addEventListener("click", () => ask("POST", `/v1/jobs/${job.id}/rerun`, {}).then((j) => router.go(`/jobs/${j.id}`)).catch(wrong));
  $("remove").addEventListener("click", () => { if (confirm("Delete this job with all its results?")) ask("DELETE", `/v1/jobs/${job.id}?purge=true`).then(() => router.go("/jobs")).catch(wrong); });
  charts.onScheme(() => { if (table) update(job); });
  onReturn(() => { for (const id of unsent) cancel(id); });
  onReturn(() => { if (router.here() === "job" && job) reload().catch(wrong); });
}

// Cancels a job. If the server does not answer, the request is repeated when the server answers again.
async function cancel(id) {
  unsent.delete(id);
  try {
    const now = await ask("DELETE", `/v1/jobs/${id}`);
    if (id === job?.id) { $("trouble").textContent = ""; update(now); }
  } catch (e) {
    if (e.status) { wrong(e); return; }
    unsent.add(id);
    if (id === job?.id) $("trouble").textContent = "The job will be cancelled as soon as the server answers.";
  }
}

export async function enter(query, id) {
  [job, table, seen, next] = [{ id }, null, new Set(), 0];
  over.clear();
  questions.clear();
  cases.clear();
  notice("");
  for (const part of ["over", "closer", "pending", "motion"]) $(part).hidden = true;
  for (const box of ["stages", "outcomes", "jobproblems", "downloads", "jobabout", "trouble"]) $(box).replaceChildren();
  $("jobtitle").textContent = "…";
  $("state").textContent = "";
  try {
    await learn();
    await reload(query);
  } catch (e) {
    $("jobtitle").textContent = e.status === 404 ? "There is no such job" : "This job cannot be shown now";
    if (e.status === 404) $("state").replaceChildren("It may have been deleted. ", make("a", { href: "/jobs", "data-route": true }, "Look through the jobs"));
    $("jobtools").hidden = $("bar").hidden = true;
    if (e.status !== 404) wrong(e);
  }
  return () => { source?.close(); source = null; cases.clear(); };
}

async function reload(query) {
  const id = job.id, [now, body] = await Promise.all([ask("GET", `/v1/jobs/${id}`), ask("GET", `/v1/jobs/${id}/request`)]);
  if (id !== job.id) return;
  request = body;
  update(now);
  const name = now.label || now.scene, asked = make("a", { href: `/v1/jobs/${id}/request`, target: "_blank", rel: "noopener" }, "the request");
  $("jobtools").hidden = false;
  $("jobtitle").textContent = name;
  document.title = `${name} · Trunnion`;
  $("jobabout").replaceChildren(...[now.label ? now.scene : null, few(now.cases, "case"), dated(now.created), `job ${id.slice(0, 8)}`, ...now.tags].filter(Boolean).flatMap((x, i) => (i ? [" · ", x] : [x])));
  $("downloads").replaceChildren("The table:", ...downloads(`/v1/jobs/${id}/results`), asked);
  await rows(query ?? new URLSearchParams(location.search));
  if (!ENDED.includes(now.state)) follow(id);
}

// Draws the present rows of the job in all plots.
async function rows(query) {
  const id = job.id, now = new Table(job, request), some = await now.fetch();
  if (id !== job.id) return;
  table = now;
  for (const part of ["over", "closer"]) $(part).hidden = !some || now.fits;
  $("motion").hidden = now.fits;
  $("pending").hidden = some || ENDED.includes(job.state);
  $("edit").hidden = now.fits; // the form of a new run cannot edit a fit
  if (!some) { if (!now.fits) cases.start(job, request.scene, ENDED.includes(job.state)).catch(wrong); return; }
  const asked = ENDED.includes(job.state) || now.fits ? questions.changed(job, table) : null;
  Promise.all([asked, now.fits ? null : cases.changed(job, table, query)]).catch(wrong); // no await: a slow animation must not delay the plots
  if (!now.fits) await over.changed(table);
}

function follow(id) {
  source?.close();
  const mine = source = new EventSource(`/v1/jobs/${id}/events`);
  mine.addEventListener("progress", (e) => {
    if (id !== job.id) return;
    update(JSON.parse(e.data));
    if (job.done && !ENDED.includes(job.state)) grown().catch(wrong);
  });
  for (const kind of ENDED) {
    mine.addEventListener(kind, () => {
      mine.close();
      if (id === job.id) ask("GET", `/v1/jobs/${id}`).then((now) => { if (id === job.id) { update(now); return rows(); } return null; }).catch(wrong);
    });
  }
  for (const kind of ["chunk_retried", "chunk_failed"]) {
    mine.addEventListener(kind, (e) => {
      const { error, first_case: first, last_case: last } = JSON.parse(e.data);
      if (id === job.id) $("trouble").textContent = `Cases ${many(first)} to ${many(last)} ${kind === "chunk_failed" ? "could not be run" : "are tried again"}: ${error}`;
    });
  }
  mine.addEventListener("error", () => { ask("GET", `/v1/jobs/${id}`).catch(() => {}); }); // if this request fails, the page reports the lost server
}

async function grown() {
  if (Date.now() < next) return;
  next = Infinity;
  const began = Date.now(), before = table?.rows?.length;
  try {
    if (!table || table.large || before < job.done) await rows();
  } finally {
    next = Date.now() + Math.max(table?.large ? GROW_LARGE : GROW, 3 * (Date.now() - began));
  }
}

function update(now) {
  job = now;
  if (table) table.job = now;
  seen.add(now.stage);
  const going = !ENDED.includes(now.state);
  staged(going);
  if (!going) $("trouble").textContent = ""; // the list of problems contains the text of the problems
  $("bar").value = now.progress;
  $("bar").hidden = !going;
  const left = now.state === "running" && now.eta_seconds != null ? `, about ${few(Math.ceil(now.eta_seconds), "second")} to go` : "";
  const took = now.finished && now.started ? ` in ${lasted((new Date(now.finished) - new Date(now.started)) / 1000)}` : "";
  const at = now.stage.includes(":") ? `, ${now.stage}` : ""; // the stage of a fit states its progress
  const early = outcomes.earlyText(now);
  $("state").textContent = `${now.state}: ${many(now.done)} of ${many(now.cases)}${at}${left}${going ? "" : took}${early ? `, ${early}` : ""}`;
  $("state").className = early ? "early" : "";
  $("outcomes").replaceChildren(...outcomes.chips({ ...now.outcomes, ...(now.lost ? { "could not be run": now.lost } : {}) }));
  $("cancel").hidden = !going;
  $("rerun").hidden = going || table?.fits || !(now.lost || Object.keys(now.outcomes).some((o) => o !== "done"));
  $("remove").hidden = going;
  $("jobproblems").replaceChildren(...now.problems.map((p) => problemItem(p)));
  $("jobproblems").hidden = !now.problems.length;
}

const lasted = (s) => (s < 90 ? `${s < 10 ? s.toFixed(1) : Math.round(s)} s` : s < 5400 ? `${Math.round(s / 60)} min` : `${(s / 3600).toFixed(1)} h`);

// Shows the stages. The first worker reports deriving and compiling. A scene made of precompiled parts skips these two stages.
function staged(going) {
  const at = !going ? "ended" : job.stage.startsWith("fitting") ? "running" : job.stage, i = Math.max(0, STAGES.findIndex(([s]) => s === at));
  const built = job.build_seconds > 0.05 || seen.has("compiling") || seen.has("deriving");
  $("stages").replaceChildren(...STAGES.map(([s, name], k) => {
    const skipped = (s === "deriving" || s === "compiling") && k < i && !built;
    const word = s === "ended" && !going && job.state !== "done" ? job.state[0].toUpperCase() + job.state.slice(1) : name;
    const item = make("li", { class: k < i || (k === i && !going) ? (skipped ? "skipped" : "past") : k === i ? "now" : "" }, word);
    if (s === "ended" && !going) item.className = job.state !== "done" ? job.state : outcomes.early(job) ? "early" : "past";
    if (k === i && going) item.setAttribute("aria-current", "step");
    if (skipped) item.append(make("small", {}, "not needed"));
    return item;
  }));
}
