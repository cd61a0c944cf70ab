// Labels with units for columns and scene numbers, on axes and in legends.

import { ask } from "./requests_and_dom.js";

let schema = null;

export const learn = async () => { schema ??= await ask("GET", "/v1/schema").catch(() => null); };

export const unit = (u) => (!u || u === "1" ? "" : u.replaceAll("*", "·").replace(/\^2\b/g, "²").replace(/\^3\b/g, "³"));
const withUnit = (text, u) => (unit(u) ? `${text} (${unit(u)})` : text);

// The first clause of a description in the schema, without parentheses. "Coefficient of (sliding) friction (laws …). …" gives
// "Coefficient of friction".
const clause = (text) => text.replace(/\([^)]*\)/g, "").split(/[.;:]/)[0].replace(/,.*$/, "").replace(/\s+/g, " ").trim();
const lower = (text) => (/^[A-Z][a-z]/.test(text) ? text[0].toLowerCase() + text.slice(1) : text);
const resolved = (node) => {
  const ref = node?.$ref ?? node?.anyOf?.find((x) => x.$ref)?.$ref ?? node?.oneOf?.find((x) => x.$ref)?.$ref;
  return ref ? schema.$defs[ref.split("/").pop()] : node;
};

// The label of a path: "joints.ball.friction.mu" gives "coefficient of friction of ball".
function ofPath(path) {
  if (!schema) return path;
  const parts = path.split("."), names = [];
  let node = schema, said = "", index = "";
  for (const part of parts) {
    const [, key, at] = part.match(/^([^[]*)(\[.*)?$/);
    const group = resolved(node), next = group?.properties?.[key];
    if (next) said = clause(next.description ?? "") || key.replaceAll("_", " ");
    else names.push(key);
    index = at ?? "";
    node = next ?? group?.additionalProperties;
  }
  const last = parts.at(-1).replace(/\[.*/, "").replaceAll("_", " ");
  if (parts[0] === "parameters") return names.join(".");
  const words = said.length > 3 && said.length <= 44 ? lower(said) : last;
  return `${words}${index ? " " + index : ""}${names.length ? " of " + names.join(" ") : ""}`;
}

// The label of a table column {name, unit, description}.
export function words(c) {
  if (c.description === "varied") return ofPath(c.name);
  if (c.name === "case") return "case";
  const at = c.name.match(/\[(\d+)\]$/);
  return at && !c.description.includes(` ${at[1]}`) ? `${c.description}, component ${at[1]}` : c.description || c.name;
}

export const title = (c) => withUnit(words(c), c.unit);

function broken(text, most) {
  const out = [""];
  for (const word of text.split(" ")) {
    if (out.at(-1) && out.at(-1).length + word.length > most) out.push(word);
    else out[out.length - 1] += (out.at(-1) ? " " : "") + word;
  }
  return out;
}

// The text with Plotly's line breaks. The lines have at most `most` characters and about equal length.
export function lines(text, most = 42) {
  const fewest = broken(text, most).length;
  let room = most;
  while (room > 1 && broken(text, room - 1).length === fewest) room--;
  return broken(text, room).join("<br>");
}

// Joins notes to one text. Each note begins with a capital letter and ends with a full stop.
export const sentences = (notes) => [...new Set(notes.filter(Boolean))].map((n) => n[0].toUpperCase() + n.slice(1) + (/[.!?]$/.test(n) ? "" : ".")).join(" ");

// A short name for each path: its last n parts. n is the smallest number that makes all short names different.
export function short(paths) {
  for (let n = 1; ; n++) {
    const cut = paths.map((p) => p.split(".").slice(-n).join("."));
    if (new Set(cut).size === cut.length || cut.every((c, i) => c === paths[i])) return new Map(paths.map((p, i) => [p, cut[i]]));
  }
}
