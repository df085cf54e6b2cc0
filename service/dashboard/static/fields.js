// @ts-check
/** Form fields for all figures of a stored item, and the changes made in them. */

import { h } from "./dom.js";

/** @typedef {import("./types.js").Schema} Schema */
/** @typedef {Record<string, any>} Thing */
/**
 * @typedef {{path: string[], before: unknown, input: HTMLInputElement | HTMLSelectElement,
 *   read: (text: string) => unknown}} Field
 */

/** What cannot be changed, or has a call of its own. */
const FIXED = new Set(["id", "created_at", "updated_at", "norad_cat_id", "epoch", "tle", "omm", "oem", "links", "is_built_in", "spacecraft"]);
/** What is only replaced as a whole. */
const WHOLE = new Set(["resources"]);
/** The schema of the API that describes each part of an item. */
const DESCRIBED_BY = { agility: "AgilityIn", sensor: "SensorIn", resources: "OwnResources", "": "GroundStationIn" };

/** @type {Record<string, string>} */
const PARTS = { "": "", agility: "Agility", sensor: "Sensor", resources: "Battery, recorder and downlink" };
/** Longer endings first. @type {[string, string][]} */
const UNITS = [
  ["_deg_s2", "deg/s²"], ["_deg_s", "deg/s"], ["_mbit_s", "Mbit/s"], ["_mbit", "Mbit"], ["_fraction", "0 to 1"],
  ["_deg", "deg"], ["_wh", "Wh"], ["_w", "W"], ["_s", "s"], ["_h", "h"], ["_m", "m"],
];

/**
 * Return a field for each figure; a figure that is set can be changed but not removed.
 * @param {Thing} thing
 * @param {Record<string, Schema>} schemas of the API
 * @param {string[]} [within]
 * @returns {Field[]}
 */
export function fieldsOf(thing, schemas, within = []) {
  return Object.entries(thing).flatMap(([name, value]) => {
    if (within.length === 0 && FIXED.has(name)) return [];
    const path = [...within, name];
    if (typeof value === "object" && value !== null && !Array.isArray(value)) return fieldsOf(value, schemas, path);
    const part = DESCRIBED_BY[/** @type {keyof typeof DESCRIBED_BY} */ (within[0] ?? "")] ?? "";
    const made = inputFor(value, schemas[part]?.properties?.[name] ?? {});
    if (made === null) return [];
    made.input.dataset.path = path.join(".");
    return [{ path, before: value, ...made }];
  });
}

/**
 * @param {unknown} value
 * @param {Schema} schema
 * @returns {Pick<Field, "input" | "read"> | null} null for values without a simple field
 */
function inputFor(value, schema) {
  const options = schema.anyOf ?? [schema];
  const choices = options.flatMap((one) => one.enum ?? []).filter((one) => one !== null);
  if (typeof value === "boolean") return select([true, false], value, (text) => text === "true");
  if (typeof value === "string" && choices.length > 0) return select(choices, value, (text) => text);
  if (typeof value === "string") return typed("text", value, true, (text) => text.trim());
  if (typeof value === "number") return typed("number", value, true, Number);
  if (isKnots(value)) return typed("text", shownKnots(value), value.length > 0, knotsIn);
  const isNumber = options.some((one) => one.type === "number");
  return value === null && isNumber ? typed("number", "", false, (text) => (text === "" ? null : Number(text))) : null;
}

/**
 * @param {unknown[]} choices
 * @param {unknown} value
 * @param {Field["read"]} read
 */
function select(choices, value, read) {
  const words = (/** @type {unknown} */ one) => (one === true ? "yes" : one === false ? "no" : String(one));
  const options = choices.map((one) => h("option", { value: String(one) }, words(one)));
  const input = h("select", {}, ...options);
  input.value = String(value);
  return { input, read };
}

/**
 * @param {"text" | "number"} type
 * @param {string | number} value
 * @param {boolean} required
 * @param {Field["read"]} read
 */
function typed(type, value, required, read) {
  const placeholder = required ? null : "none";
  return { input: h("input", { type, step: type === "number" && "any", value, required, placeholder }), read };
}

/**
 * @param {unknown} value
 * @returns {value is number[][]}
 */
function isKnots(value) {
  return Array.isArray(value) && value.every((one) => Array.isArray(one) && one.length === 2);
}

/** @param {number[][]} knots */
function shownKnots(knots) {
  return knots.map(([at, what]) => `${at}: ${what}`).join(", ");
}

/** @param {string} text */
function knotsIn(text) {
  const parts = text.split(",").filter((one) => one.trim() !== "");
  const knots = parts.map((one) => one.split(":").map(Number));
  if (!knots.every((one) => one.length === 2 && one.every(Number.isFinite))) {
    throw new Error(`${text}: write pairs with a colon, separated by commas, such as 5: 150, 90: 600.`);
  }
  return knots;
}

/**
 * Return the fields part by part, under headings in operators' words.
 * @param {Field[]} fields
 */
export function grouped(fields) {
  return Object.entries(PARTS).flatMap(([part, title]) => {
    const own = fields.filter(({ path }) => (path.length > 1 ? path[0] : "") === part);
    if (own.length === 0) return [];
    const inputs = h("div", { class: "fields" }, ...own.map(labelled));
    return [title === "" ? inputs : h("fieldset", {}, h("legend", {}, title), inputs)];
  });
}

/** @param {Field} field */
function labelled({ path, before, input }) {
  const name = path.at(-1) ?? "";
  const about = isKnots(before) ? h("small", {}, name === "elevation_mask" ? "Azimuth: elevation, in degrees" : "Elevation in degrees: rate") : null;
  return h("p", { class: "field" }, h("label", {}, wordsOf(name), input), about);
}

/**
 * Return a readable name of a figure, with its unit.
 * @param {string} name in the API
 */
export function wordsOf(name) {
  const [ending, unit] = UNITS.find(([one]) => name.endsWith(one)) ?? ["", ""];
  const words = name.slice(0, name.length - ending.length).replaceAll("_", " ");
  const whole = words.replace("off nadir", "off-nadir").replace(/^min (.*)$|^(.*) min$/, "$1$2, at least").replace(/ max$/, ", at most");
  return whole.charAt(0).toUpperCase() + whole.slice(1) + (unit === "" ? "" : `, ${unit}`);
}

/**
 * Return the changes, in the form of a PATCH body.
 * @param {Thing} thing
 * @param {Field[]} fields
 * @returns {Thing}
 */
export function changesIn(thing, fields) {
  /** @type {Thing} */
  const changes = {};
  for (const { path, before, input, read } of fields) {
    const value = read(input.value);
    if (JSON.stringify(value) === JSON.stringify(before)) continue;
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
