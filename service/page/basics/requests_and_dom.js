// Requests to the server, and small helper functions for the page.

export const $ = (id) => document.getElementById(id);
export const ENDED = ["done", "failed", "cancelled"];
const heard = new Set();

// Adds a listener. After each request, the listener is called with true if the server responded, else with false.
export const onAnswer = (tell) => heard.add(tell);

class ProblemError extends Error {
  constructor(document) {
    super(document.detail || document.title);
    this.problems = document.problems || [];
    this.status = document.status;
  }
}

export function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((c) => c != null));
  return node;
}

export const key = () => sessionStorage.getItem("key") || "";

export function useKey(text) {
  sessionStorage.setItem("key", text);
  document.cookie = `trunnion_key=${encodeURIComponent(text)}; path=/; SameSite=Strict`; // downloads, event streams and frames can only send cookies
}

async function sent(method, path, body, signal, more) {
  const headers = { ...(key() ? { Authorization: `Bearer ${key()}` } : {}), ...more };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(path, { method, headers, signal, body: body === undefined ? undefined : JSON.stringify(body) });
  } catch (e) {
    if (e.name === "AbortError") throw e;
    heard.forEach((tell) => tell(false));
    throw new ProblemError({ title: "the server does not answer", status: 0 });
  }
  heard.forEach((tell) => tell(true));
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({ title: `status ${answer.status}`, status: answer.status }));
  if (answer.status === 401 && $("keyform")) {
    $("keyform").hidden = false;
    if ($("locked") && !document.body.dataset.locked) {
      document.body.dataset.locked = "true";
      $("locked").hidden = false;
      $("key").focus();
    }
    if (!key()) problem.detail = "an API key is required";
  }
  throw new ProblemError(problem);
}

export async function ask(method, path, body, signal, more) {
  const answer = await sent(method, path, body, signal, more);
  return answer.status === 204 ? null : answer.json();
}

export const askText = async (method, path, body, signal) => (await sent(method, path, body, signal)).text();

// Debounces a function: `work` starts when no call came for `wait` ms. A new start aborts earlier work that still runs.
export function later(work, wait = 300) {
  let timer = 0, running = null;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      running?.abort();
      running = new AbortController();
      work(running.signal, ...given).catch(wrong);
    }, wait);
  };
}

export function notice(text) {
  const box = $("notice");
  box.hidden = !text;
  box.replaceChildren(...(text ? [text, " ", make("button", { type: "button", "aria-label": "dismiss", onclick: () => notice("") }, "×")] : []));
}

// Shows an unhandled error at the top of the page. A lost server is not shown, because the banner reports a lost server.
export function wrong(e) {
  if (e.name !== "AbortError" && e.status !== 0) notice(e.problems?.length ? e.problems.map((p) => `${p.where}: ${p.what}`).join("; ") : e.message);
}

export function problemItem(p, jump) {
  const line = p.line && jump ? make("button", { type: "button", onclick: () => jump(p.line) }, `line ${p.line}`) : null;
  return make("li", {}, line, make("b", {}, p.where), `: ${p.what} `, make("span", { class: "hint" }, p.hint ? `→ ${p.hint}` : ""));
}

// A list of problems. The list can have the focus, so that the keyboard can scroll it.
export const problemList = (problems, jump) => make("ul", { class: "problems", tabindex: "0", "aria-label": "problems" }, ...problems.map((p) => problemItem(p, jump)));

// The nodes of a path or column name, in which line breaks are allowed after dots and colons.
export const breaking = (text) => text.split(/(?<=[.:])(?!\d)/).flatMap((part, i) => (i ? [make("wbr"), part] : [part]));

const headed = (heads) => make("tr", {}, ...heads.map((x) => (x ? make("th", { scope: "col" }, ...breaking(x)) : make("td"))));

// Fills a table element. The first cell of each row is its heading.
export function fill(table, heads, rows) {
  table.tHead.replaceChildren(headed(heads));
  table.tBodies[0].replaceChildren(...rows.map(([first, ...rest]) => make("tr", {}, make("th", { scope: "row" }, ...breaking(first)), ...rest.map((x, i) => make("td", { "data-head": heads[i + 1] }, x)))));
}

const KINDS = [["csv", "CSV"], ["parquet", "Parquet"], ["arrow", "Arrow"], ["json", "JSON"]];

export const downloads = (path) => KINDS.map(([kind, name]) => make("a", { href: `${path}?format=${kind}`, download: true }, name));

export function number(x) {
  return x == null ? "–" : Math.abs(x) >= 1e5 || (x !== 0 && Math.abs(x) < 1e-3) ? x.toExponential(3) : String(+x.toPrecision(6));
}

export const many = (n) => n.toLocaleString("en");
export const few = (n, one, more = `${one}s`) => `${many(n)} ${n === 1 ? one : more}`;

// Sets the options of a select element. The selected option stays selected if the new options contain it.
export function choices(select, options, first) {
  const before = select.value;
  select.replaceChildren(...options.map(([value, text, title]) => make("option", { value, title }, text ?? value)));
  const values = options.map((o) => o[0]);
  select.value = values.includes(before) ? before : values.includes(first) ? first : values[0] ?? "";
}

// A <time> element with a short text: "today" and the hour, or the day and the hour. Its title has the full time.
export function dated(text) {
  const at = new Date(text), now = new Date(), today = at.toDateString() === now.toDateString();
  const day = { day: "numeric", month: "short", ...(at.getFullYear() === now.getFullYear() ? {} : { year: "numeric" }) };
  const hour = at.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return make("time", { datetime: text, title: at.toString() }, today ? `today ${hour}` : `${at.toLocaleDateString("en-GB", day)}, ${hour}`);
}
