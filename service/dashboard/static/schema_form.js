// @ts-check
/** A form made from the JSON Schema that describes parameters. */

import { h } from "./dom.js";

/** @typedef {import("./types.js").Schema} Schema */

/**
 * Fields for the simple properties of an object. Empty fields are left out of the values, so
 * that the service's own defaults apply.
 */
export class SchemaForm {
  /**
   * @param {string} prefix of the ids of its fields
   * @param {Schema} schema
   */
  constructor(prefix, schema) {
    /** @type {{name: string, kind: Kind, input: HTMLInputElement | HTMLSelectElement}[]} */
    this.fields = [];
    const required = new Set(schema.required ?? []);
    const lines = [];
    for (const [name, property] of Object.entries(schema.properties ?? {})) {
      const kind = kindOf(property);
      if (kind === null) continue;
      const input = inputFor(`${prefix}-${name}`, kind, property, required.has(name));
      this.fields.push({ name, kind, input });
      const about = h("small", { id: `${input.id}-about` }, aboutOf(property, kind));
      lines.push(h("p", { class: "field" }, h("label", { for: input.id }, name), input, about));
      input.setAttribute("aria-describedby", about.id);
    }
    this.element = h("div", { class: "fields" }, ...lines);
  }

  /** @returns {Record<string, unknown>} the values that were entered */
  values() {
    /** @type {Record<string, unknown>} */
    const found = {};
    for (const { name, kind, input } of this.fields) {
      if (!input.checkValidity()) {
        input.reportValidity();
        throw new Error(`${name}: ${input.validationMessage}`);
      }
      if (input.value !== "") found[name] = valueOf(kind, input.value);
    }
    return found;
  }
}

/**
 * @typedef {{type: "number" | "integer" | "boolean" | "string" | "choice", choices: unknown[],
 *   isNullable: boolean, limits: Schema}} Kind
 */

/**
 * @param {Schema} property
 * @returns {Kind | null} null for properties without a simple field
 */
function kindOf(property) {
  const options = property.anyOf ?? [property];
  const types = options.flatMap((option) => option.type ?? []);
  const isNullable = types.includes("null");
  const choices = property.enum ?? options.flatMap((option) => option.enum ?? []);
  const limits = options.find((option) => option.type !== "null") ?? property;
  if (choices.length > 0) {
    const left = choices.filter((choice) => choice !== null);
    return { type: "choice", choices: left, isNullable, limits };
  }
  for (const type of /** @type {const} */ (["number", "integer", "boolean", "string"])) {
    if (types.includes(type)) return { type, choices: [], isNullable, limits };
  }
  return null;
}

/**
 * @param {string} id
 * @param {Kind} kind
 * @param {Schema} property
 * @param {boolean} isRequired
 */
function inputFor(id, kind, property, isRequired) {
  if (kind.type === "choice" || kind.type === "boolean") {
    const choices = kind.type === "boolean" ? [true, false] : kind.choices;
    const options = choices.map((choice) => h("option", { value: JSON.stringify(choice) }, String(choice)));
    const first = h("option", { value: "" }, `default: ${shown(property.default)}`);
    return h("select", { id }, first, ...options);
  }
  if (kind.type === "string") return h("input", { id, placeholder: shown(property.default) });
  const { minimum, maximum } = kind.limits;
  return h("input", {
    id,
    type: "number",
    step: kind.type === "integer" ? 1 : "any",
    min: minimum ?? kind.limits.exclusiveMinimum,
    max: maximum,
    required: isRequired,
    placeholder: property.default === undefined ? "" : shown(property.default),
  });
}

/**
 * @param {Kind} kind
 * @param {string} text
 */
function valueOf(kind, text) {
  if (kind.type === "choice" || kind.type === "boolean") return JSON.parse(text);
  return kind.type === "string" ? text : Number(text);
}

/** @param {unknown} value */
function shown(value) {
  return value === null || value === undefined ? "none" : String(value);
}

/**
 * @param {Schema} property
 * @param {Kind} kind
 */
function aboutOf(property, kind) {
  const { minimum, exclusiveMinimum, maximum } = kind.limits;
  const limits = [];
  if (minimum !== undefined) limits.push(`at least ${minimum}`);
  if (exclusiveMinimum !== undefined) limits.push(`more than ${exclusiveMinimum}`);
  if (maximum !== undefined) limits.push(`at most ${maximum}`);
  const text = property.description ?? "";
  return [text, limits.length > 0 && `(${limits.join(", ")})`].filter(Boolean).join(" ");
}
