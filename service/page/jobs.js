// The list of jobs, and the one looked at: its progress as it goes, its problems, its downloads.

import { $, ask, downloads, make, notice, problemItem } from "./api.js";

const ENDED = ["done", "failed", "cancelled"];
let shown = null, source = null, cursor = null, changed = () => {}, grown = () => {};
const known = new Map();

export async function begin(onChanged, onGrown) {
  [changed, grown] = [onChanged, onGrown];
  $("cancel").addEventListener("click", () => ask("DELETE", `/v1/jobs/${shown}`).then(update).catch((e) => notice(e.message)));
  $("older").addEventListener("click", () => more().catch((e) => notice(e.message)));
  $("joblist").addEventListener("keydown", arrows);
  await more();
  const first = known.keys().next().value;
  if (first) await show(known.get(first), false);
}

async function more() {
  const page = await ask("GET", "/v1/jobs?limit=30" + (cursor ? `&cursor=${encodeURIComponent(cursor)}` : ""));
  for (const job of page.jobs) known.set(job.id, job);
  cursor = page.next;
  $("older").hidden = !cursor;
  list();
}

// Arrow keys move along the list.
function arrows(e) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
  if (!step) return;
  const buttons = [...$("joblist").querySelectorAll("button")], at = buttons.indexOf(document.activeElement);
  buttons[Math.min(buttons.length - 1, Math.max(0, at + step))]?.focus();
  e.preventDefault();
}

function list() {
  const focused = document.activeElement?.dataset?.job;
  const rows = [...known.values()].sort((a, b) => (a.created < b.created ? 1 : -1)).map((job) => {
    const when = new Date(job.created).toLocaleTimeString();
    const words = make("span", {}, `${job.label || job.scene} · ${job.cases.toLocaleString("en")} case${job.cases === 1 ? "" : "s"}`);
    const state = make("span", { class: job.state === "failed" ? "failed" : "" }, `${job.state} · ${when}`);
    const meter = make("meter", { min: 0, max: 1, value: job.progress, "aria-hidden": "true" });
    const button = make("button", { type: "button", "data-job": job.id, "aria-current": String(job.id === shown) }, words, state, meter);
    button.addEventListener("click", () => show(job, true).catch((e) => notice(e.message)));
    return make("li", {}, button);
  });
  $("joblist").replaceChildren(...(rows.length ? rows : [make("li", { class: "hint" }, "none yet")]));
  if (focused) $("joblist").querySelector(`[data-job="${focused}"]`)?.focus();
}

export async function show(job, focus) {
  shown = job.id;
  known.set(job.id, job);
  source?.close();
  $("job").hidden = false;
  $("jobtitle").textContent = `${job.label || job.scene} (${job.id.slice(0, 8)})`;
  const asked = make("a", { href: `/v1/jobs/${job.id}/request`, target: "_blank", rel: "noopener" }, "what was asked");
  $("downloads").replaceChildren("Download the table:", ...downloads(`/v1/jobs/${job.id}/results`), asked);
  update(job);
  if (focus) $("jobtitle").focus();
  await changed(job, true);
  if (!ENDED.includes(job.state)) follow(job.id);
}

function follow(id) {
  source = new EventSource(`/v1/jobs/${id}/events`);
  const mine = source;
  source.addEventListener("progress", (e) => {
    const job = JSON.parse(e.data);
    update(job);
    if (id === shown && job.done && !ENDED.includes(job.state)) grown(job).catch((x) => notice(x.message));
  });
  for (const kind of ENDED) {
    source.addEventListener(kind, () => {
      mine.close();
      ask("GET", `/v1/jobs/${id}`).then((job) => { update(job); if (id === shown) return changed(job, false); }).catch((e) => notice(e.message));
    });
  }
}

function update(job) {
  known.set(job.id, job);
  list();
  if (job.id !== shown) return;
  $("bar").value = job.progress;
  const outcomes = Object.entries(job.outcomes).map(([name, n]) => `${n.toLocaleString("en")} ${name.replace(/_/g, " ")}`).join(", ");
  const left = job.state === "running" && job.eta_seconds != null ? `, about ${Math.ceil(job.eta_seconds)} s to go` : "";
  $("state").textContent = `${job.state}: ${job.done.toLocaleString("en")} of ${job.cases.toLocaleString("en")}${outcomes ? ` (${outcomes})` : ""}${left}`;
  $("cancel").hidden = ENDED.includes(job.state);
  $("jobproblems").replaceChildren(...job.problems.map((p) => problemItem(p)));
}
