// @ts-check
/** Fields for all figures of a stored thing, and what was changed in them. */

import { h } from "./dom.js";

/** @typedef {{path: string[], before: string | number, input: HTMLInputElement}} Field */
/** @typedef {Record<string, any>} Thing */

/** What no change can touch, or what has a call of its own. */
const FIXED = new Set(["id", "created_at", "updated_at", "norad_cat_id", "epoch", "tle", "omm", "links", "is_built_in", "spacecraft"]);
/** What a change replaces as a whole. */
const WHOLE = new Set(["resources"]);

/**
 * Return a field for each text and number; lists and what is not set are left to the API.
 * @param {Thing} thing
 * @param {string[]} [within]
 * @returns {Field[]}
 */
export function fieldsOf(thing, within = []) {
  return Object.entries(thing).flatMap(([name, value]) => {
    if (within.length === 0 && FIXED.has(name)) return [];
    const path = [...within, name];
    if (typeof value === "object" && value !== null && !Array.isArray(value)) return fieldsOf(value, path);
    if (typeof value !== "number" && typeof value !== "string") return [];
    const isNumber = typeof value === "number";
    const input = h("input", { type: isNumber ? "number" : "text", step: isNumber && "any", value, required: true });
    input.dataset.path = path.join(".");
    return [{ path, before: value, input }];
  });
}

/** @param {Field} field */
export function labelled({ path, input }) {
  const words = path.join(": ").replaceAll("_", " ");
  return h("p", { class: "field" }, h("label", {}, words, input));
}

/**
 * Return what was changed, as a PATCH takes it.
 * @param {Thing} thing
 * @param {Field[]} fields
 * @returns {Thing}
 */
export function changesIn(thing, fields) {
  /** @type {Thing} */
  const changes = {};
  for (const { path, before, input } of fields) {
    const value = typeof before === "number" ? Number(input.value) : input.value.trim();
    if (value === before) continue;
    const [first, ...rest] = path;
    if (first === undefined) continue;
    if (rest.length === 0) {
      changes[first] = value;
      continue;
    }
    changes[first] ??= WHOLE.has(first) ? structuredClone(thing[first]) : {};
    let inner = changes[first];
    for (const name of rest.slice(0, -1)) inner = inner[name] ??= {};
    inner[/** @type {string} */ (rest.at(-1))] = value;
  }
  return changes;
}
