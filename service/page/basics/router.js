// Shows the view for the address: / for a new run, /jobs for the list, /jobs/ID for a job, /compare?jobs=… for a comparison.

import { $ } from "./requests_and_dom.js";

const VIEWS = ["compose", "list", "job", "compare", "missing"];
let enter = {}, at = "", leave = () => {};

export function begin(views) {
  enter = views;
  document.addEventListener("click", (e) => {
    const link = e.target.closest?.("a[data-route]");
    if (!link || e.ctrlKey || e.metaKey || e.shiftKey || e.button) return;
    e.preventDefault();
    go(link.getAttribute("href"));
  });
  window.addEventListener("popstate", () => shown(false));
  return shown(false);
}

export function go(address, focus = true) {
  if (address !== location.pathname + location.search) history.pushState(null, "", address);
  return shown(focus);
}

// Stores the state of the view in the address, without a new entry in the history.
export function remember(query) {
  const text = new URLSearchParams(query).toString();
  history.replaceState(null, "", location.pathname + (text ? `?${text}` : ""));
}

function found() {
  const path = location.pathname.replace(/\/+$/, "") || "/", query = new URLSearchParams(location.search);
  if (path === "/") return ["compose", query];
  if (path === "/jobs") return ["list", query];
  if (path === "/compare") return ["compare", query];
  const job = path.match(/^\/jobs\/([0-9a-z]{24})$/);
  return job ? ["job", query, job[1]] : ["missing", query];
}

async function shown(focus) {
  const [view, query, job] = found();
  leave();
  at = view;
  for (const v of VIEWS) $(v).hidden = v !== view;
  for (const a of document.querySelectorAll("nav a[data-route]")) {
    const here = a.getAttribute("href") === (view === "compose" ? "/" : "/jobs");
    if (here) a.setAttribute("aria-current", "page"); else a.removeAttribute("aria-current");
  }
  document.title = { compose: "New run", list: "Jobs", job: "Job", compare: "Comparing jobs", missing: "No such page" }[view] + " · Trunnion";
  if (focus) { window.scrollTo(0, 0); $(view).querySelector("h1").focus({ preventScroll: true }); }
  leave = (await enter[view]?.(query, job)) || (() => {});
}

export const here = () => at;
