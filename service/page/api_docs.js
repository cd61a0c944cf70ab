// Shows the OpenAPI document: operations with parameters and examples. The user can try each operation. The page loads nothing from
// other sites.

import { $, key, make, notice, useKey } from "./basics/requests_and_dom.js";

const LONGEST = 20_000; // largest number of shown characters of a response

async function begin() {
  $("keyform").addEventListener("submit", (e) => { e.preventDefault(); useKey($("key").value.trim()); notice("requests now use this key"); });
  const description = await (await fetch("/openapi.json")).json();
  const groups = new Map();
  for (const [path, item] of Object.entries(description.paths)) {
    for (const [method, operation] of Object.entries(item)) {
      const group = operation.tags?.[0] ?? "other";
      groups.set(group, [...(groups.get(group) ?? []), one(description, method.toUpperCase(), path, operation)]);
    }
  }
  const sections = [...groups].map(([name, operations]) => make("section", { "aria-label": name }, make("h2", {}, name), ...operations));
  $("operations").replaceChildren(make("p", {}, ...prose(description.info.description)), ...sections);
  $("operations").setAttribute("aria-busy", "false");
  if (location.hash) document.getElementById(location.hash.slice(1))?.setAttribute("open", "");
}

// The DOM nodes for a text in which backticks enclose code.
const prose = (text) => text.split("`").map((part, i) => (i % 2 ? make("code", {}, part) : part));

function one(description, method, path, operation) {
  const id = operation.operationId;
  const head = make("summary", {}, make("span", { class: "method" }, method), make("code", {}, path), make("span", { class: "id" }, id));
  const details = make("details", { id }, head);
  details.addEventListener("toggle", () => { if (details.open && details.children.length === 1) details.append(inside(description, method, path, operation)); });
  return details;
}

function inside(description, method, path, operation) {
  const inputs = (operation.parameters ?? []).map((p) => [p, make("input", { "aria-label": p.name, placeholder: p.schema?.default ?? "" })]);
  const row = ([p, input]) => make("tr", {}, make("th", {}, p.name + (p.required ? " *" : "")), make("td", {}, p.in), make("td", {}, input), make("td", {}, ...prose(p.description ?? "")));
  const content = operation.requestBody?.content?.["application/json"];
  const examples = Object.values(content?.examples ?? {});
  const body = content && make("textarea", { rows: 12, spellcheck: "false", "aria-label": "body" });
  const choose = examples.length && make("select", { "aria-label": "example" }, ...examples.map((e, i) => make("option", { value: i }, e.summary)));
  if (choose) choose.addEventListener("change", () => { body.value = JSON.stringify(examples[choose.value].value, null, 2); });
  if (examples.length) body.value = JSON.stringify(examples[0].value, null, 2);
  const answer = make("div", { "aria-live": "polite" });
  const send = make("button", { type: "button", class: "main", onclick: () => sent(method, path, inputs, body, answer) }, "Send");
  const statuses = Object.entries(operation.responses).map(([status, r]) => make("tr", {}, make("th", {}, status), make("td", {}, ...prose(r.description ?? ""))));
  return make("div", {},
    make("p", {}, ...prose(operation.description ?? operation.summary ?? "")),
    inputs.length ? make("table", {}, ...inputs.map(row)) : null,
    choose || null, body || null, make("p", {}, send), answer,
    make("h3", {}, "Answers"), make("table", {}, ...statuses),
    content?.schema?.$ref ? schema(description, content.schema.$ref) : null);
}

function schema(description, ref) {
  const name = ref.split("/").pop();
  const text = JSON.stringify(description.components.schemas[name], null, 2);
  return make("details", {}, make("summary", {}, `Schema of ${name}`), make("pre", {}, text));
}

async function sent(method, path, inputs, body, answer) {
  const query = new URLSearchParams(), headers = key() ? { Authorization: `Bearer ${key()}` } : {};
  for (const [p, input] of inputs) {
    if (!input.value) continue;
    if (p.in === "path") path = path.replace(`{${p.name}}`, encodeURIComponent(input.value));
    if (p.in === "query") for (const value of input.value.split("\n")) query.append(p.name, value);
    if (p.in === "header") headers[p.name] = input.value;
  }
  if (body) headers["Content-Type"] = "application/json";
  const url = path + (query.size ? `?${query}` : "");
  answer.replaceChildren(make("p", {}, "…"));
  try {
    const got = await fetch(url, { method, headers, body: body?.value });
    const text = await got.text();
    const shown = text.length > LONGEST ? `${text.slice(0, LONGEST)} … (${text.length} characters)` : text;
    answer.replaceChildren(make("p", {}, `${method} ${url}: ${got.status} ${got.headers.get("content-type") ?? ""}`), make("pre", {}, pretty(shown)));
  } catch (e) {
    answer.replaceChildren(make("p", {}, `no answer: ${e.message}`));
  }
}

function pretty(text) {
  try {
    return JSON.stringify(JSON.parse(text), null, 2);
  } catch {
    return text;
  }
}

begin().catch((e) => notice(e.message));
