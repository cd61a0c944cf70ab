// Puts the page together.

import { $, notice, useKey } from "./api.js";
import * as form from "./form.js";
import * as jobs from "./jobs.js";
import * as plots from "./plots.js";

async function begin() {
  notice("");
  plots.begin();
  await form.begin((job) => jobs.show(job, true));
  await jobs.begin(plots.changed, plots.grown);
  document.body.dataset.ready = "true";
}

$("keyform").addEventListener("submit", (e) => {
  e.preventDefault();
  useKey($("key").value.trim());
  location.reload();
});
begin().catch((e) => notice(e.message));
