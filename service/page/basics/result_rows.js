// The rows of a job. The browser fetches all rows of a small job. For a large job, the server counts the cases in bins.

import { ask } from "./requests_and_dom.js";

export const MOST = 5000;
const enc = encodeURIComponent;

export class Table {
  constructor(job, request) {
    this.job = job;
    this.request = request;
    this.columns = [];
    this.rows = null;
  }

  get large() { return this.job.cases > MOST; }

  // Fetches the present rows. Returns whether the job has rows.
  async fetch() {
    const got = await ask("GET", `/v1/jobs/${this.job.id}/results?format=json&count=${this.large ? 1 : MOST}`);
    this.columns = got.columns;
    this.rows = this.large ? null : got.rows;
    return this.large ? this.job.done > 0 : got.rows.length > 0;
  }

  // Whether the rows are fits. Fits are not plotted.
  get fits() { return this.at("answer") >= 0; }

  at(name) { return this.columns.findIndex((c) => c.name === name); }

  column(name) { return this.columns[this.at(name)]; }

  get paths() { return this.columns.slice(1, this.at("outcome")); }

  get results() {
    const kept = this.columns.slice(this.at("steps") + 1);
    return [...kept, ...["outcome.time", "audit.energy", "steps"].map((name) => this.column(name)).filter(Boolean)];
  }

  // Counts all cases in bins. within: Map of column to [low, high].
  bins(x, y = "", of = "", { nx = 60, ny = 60, within = new Map(), words = [] } = {}) {
    const conditions = [...within].map(([name, [low, high]]) => `${name}=${low ?? ""}:${high ?? ""}`).concat(words);
    const query = `x=${enc(x)}${y ? `&y=${enc(y)}` : ""}${of ? `&of=${enc(of)}` : ""}&nx=${nx}&ny=${ny}` + conditions.map((w) => `&within=${enc(w)}`).join("");
    return ask("GET", `/v1/jobs/${this.job.id}/bins?${query}`);
  }

  // The answer of a study so far; null for other jobs.
  async answer() {
    if (!this.request.optimise && !this.request.refine) return null;
    this.told ??= ask("GET", `/v1/jobs/${this.job.id}/answer`);
    return (await this.told).answer;
  }

  async row(n) {
    const there = this.rows?.find((r) => r[0] === n);
    return there ?? (await ask("GET", `/v1/jobs/${this.job.id}/results?format=json&first=${n}&count=1`)).rows[0] ?? null;
  }
}

export const middles = (axis) => axis.values ?? axis.edges.slice(1).map((e, i) => (e + axis.edges[i]) / 2);
