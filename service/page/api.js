// Requests to the server, and small helpers for the page.

export const $ = (id) => document.getElementById(id);

export class Told extends Error {
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
  document.cookie = `trunnion_key=${encodeURIComponent(text)}; path=/; SameSite=Strict`; // for downloads, events and pictures
}

export async function ask(method, path, body, signal) {
  const headers = key() ? { Authorization: `Bearer ${key()}` } : {};
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(path, { method, headers, signal, body: body === undefined ? undefined : JSON.stringify(body) });
  } catch (e) {
    if (e.name === "AbortError") throw e;
    throw new Told({ title: "the server does not answer; is it running?", status: 0 });
  }
  if (answer.ok) return answer.status === 204 ? null : answer.json();
  const problem = await answer.json().catch(() => ({ title: `status ${answer.status}`, status: answer.status }));
  if (answer.status === 401) {
    $("keyform").hidden = false;
    if (!key()) problem.detail = "an API key is needed here";
  }
  throw new Told(problem);
}

export function later(work, wait = 300) {
  let timer = 0, running = null;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      running?.abort();
      running = new AbortController();
      work(running.signal, ...given).catch((e) => { if (e.name !== "AbortError") notice(e.message); });
    }, wait);
  };
}

export function notice(text) {
  $("notice").textContent = text || "";
}

export function problemItem(p, jump) {
  const line = p.line && jump ? make("button", { type: "button", onclick: () => jump(p.line) }, `line ${p.line}`) : null;
  return make("li", {}, line, make("b", {}, p.where), `: ${p.what} `, make("span", { class: "hint" }, p.hint ? `→ ${p.hint}` : ""));
}

const KINDS = [["csv", "CSV"], ["parquet", "Parquet"], ["arrow", "Arrow"], ["json", "JSON"]];

export const downloads = (path) => KINDS.map(([kind, name]) => make("a", { href: `${path}?format=${kind}`, download: true }, name));

export function number(x) {
  return x == null ? "–" : Math.abs(x) >= 1e5 || (x !== 0 && Math.abs(x) < 1e-3) ? x.toExponential(3) : String(+x.toPrecision(6));
}
