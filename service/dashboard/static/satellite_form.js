// @ts-check
/** One satellite entered by hand: its TLE, and whatever differs from the defaults. */

import { get, post } from "./api.js";
import { byId, h } from "./dom.js";
import { whileBusy } from "./page.js";
import { SchemaForm } from "./schema_form.js";
import { fillSpacecraft } from "./spacecraft_choice.js";

/** @typedef {import("./types.js").Schema} Schema */

/**
 * Put the form in its place.
 * @param {(id: string) => Promise<void>} onStored
 */
export async function installSatelliteForm(onStored) {
  /** @type {{components: {schemas: Record<string, Schema>}}} */
  const { components } = await get("/openapi.json");
  const part = (/** @type {string} */ name) =>
    new SchemaForm(`one-${name}`, withoutDefaults(components.schemas[name] ?? {}));
  const agility = part("AgilityIn");
  const sensor = part("SensorIn");
  const own = part("OwnResources");
  const name = h("input", { id: "one-name", maxlength: 200 });
  const tle = h("textarea", { id: "one-tle", rows: 3, spellcheck: "false" });
  const type = h("select", { id: "one-type" });
  await fillSpacecraft(type);
  const outcome = h("div", { role: "status" });
  const button = h("button", { type: "button", class: "needs-submit" }, "Store this satellite");
  button.addEventListener("click", () =>
    whileBusy(button, outcome, async () => {
      const body = {
        name: name.value.trim() || nameIn(tle.value),
        tle: linesOf(tle.value),
        ...differing("agility", agility.values()),
        ...differing("sensor", sensor.values()),
        spacecraft: type.value,
        ...differing("resources", own.values()),
      };
      /** @type {{id: string}} */
      const stored = await post("/v1/satellites", body);
      await onStored(stored.id);
    }),
  );
  byId("satellite-form").append(
    field("one-name", "Name", name),
    field("one-tle", "TLE: line 1 and line 2", tle),
    field("one-type", "Spacecraft type: its figures apply to empty fields", type),
    h("h3", {}, "Agility"),
    agility.element,
    h("h3", {}, "Sensor"),
    sensor.element,
    h("h3", {}, "Battery and recorder"),
    own.element,
    outcome,
    h("p", {}, button),
  );
}

/**
 * @param {string} id
 * @param {string} text
 * @param {HTMLElement} input
 */
function field(id, text, input) {
  return h("p", { class: "field" }, h("label", { for: id }, text), input);
}

/**
 * Show that empty fields take the type's values: the schema's defaults are those of the paper's satellite.
 * @param {Schema} schema
 * @returns {Schema}
 */
function withoutDefaults(schema) {
  const named = Object.entries(schema.properties ?? {});
  const properties = named.map(([name, one]) => [name, { ...one, default: "from the type" }]);
  return { ...schema, properties: Object.fromEntries(properties) };
}

/**
 * @param {string} part
 * @param {Record<string, unknown>} values
 */
function differing(part, values) {
  return Object.keys(values).length > 0 ? { [part]: values } : {};
}

/** @param {string} text */
function linesOf(text) {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() !== "");
  return lines.length === 3 ? lines.slice(1) : lines;
}

/** @param {string} text */
function nameIn(text) {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() !== "");
  return lines.length === 3 ? (lines[0] ?? "").replace(/^0 /, "").trim() : "Satellite";
}
