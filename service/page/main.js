// Puts the page together.

import { $, notice, useKey, wrong } from "./api.js";
import * as compare from "./compare.js";
import * as editor from "./editor.js";
import * as form from "./form.js";
import * as job from "./job.js";
import * as jobs from "./jobs.js";
import * as preview from "./preview.js";
import * as router from "./router.js";
import * as server from "./server.js";

async function begin() {
  notice("");
  server.begin();
  editor.begin(form.typed);
  preview.begin();
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
