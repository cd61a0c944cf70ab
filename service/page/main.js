// Starts all parts of the page.

import { $, notice, useKey, wrong } from "./basics/requests_and_dom.js";
import * as compare from "./jobs/job_comparison.js";
import * as editor from "./new_run/scene_editor.js";
import * as form from "./new_run/run_form.js";
import * as job from "./jobs/job_view.js";
import * as jobs from "./jobs/job_lists.js";
import * as preview from "./new_run/mechanism_preview.js";
import * as router from "./basics/router.js";
import * as server from "./basics/server_status.js";

async function begin() {
  notice("");
  server.begin();
  editor.begin(form.typed);
  preview.begin(form.moved);
  job.begin();
  jobs.begin();
  compare.begin();
  form.begin();
  await router.begin({ compose: form.enter, list: jobs.enter, job: job.enter, compare: compare.enter });
  document.body.dataset.ready = "true";
}

$("keyform").addEventListener("submit", (e) => {
  e.preventDefault();
  useKey($("key").value.trim());
  location.reload();
});
begin().catch(wrong);
