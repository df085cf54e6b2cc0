// @ts-check
/** One satellite entered by hand: its TLE, and whatever differs from the defaults. */

import { get, post } from "./api.js";
import { byId, h } from "./dom.js";
import { whileBusy } from "./page.js";
import { SchemaForm } from "./schema_form.js";

/** @typedef {import("./types.js").Schema} Schema */

/**
 * Put the form in its place.
 * @param {(id: string) => Promise<void>} onStored
 */
export async function installSatelliteForm(onStored) {
  /** @type {{components: {schemas: Record<string, Schema>}}} */
  const { components } = await get("/openapi.json");
  const part = (/** @type {string} */ name) => new SchemaForm(`one-${name}`, components.schemas[name] ?? {});
  const agility = part("AgilityIn");
  const sensor = part("SensorIn");
  const own = part("ResourcesIn");
  const name = h("input", { id: "one-name", maxlength: 200 });
  const tle = h("textarea", { id: "one-tle", rows: 3, spellcheck: "false" });
  const preset = h(
    "select",
    { id: "one-preset" },
    h("option", { value: "paper" }, "those of the paper"),
    h("option", { value: "paper_code" }, "those of the paper's code"),
    h("option", { value: "own" }, "own figures"),
  );
  const figures = h("div", { hidden: true }, own.element);
  preset.addEventListener("change", () => {
    figures.hidden = preset.value !== "own";
  });
  const outcome = h("div", { role: "status" });
  const button = h("button", { type: "button", class: "needs-submit" }, "Store this satellite");
  button.addEventListener("click", () =>
    whileBusy(button, outcome, async () => {
      const body = {
        name: name.value.trim() || nameIn(tle.value),
        tle: linesOf(tle.value),
        agility: agility.values(),
        sensor: sensor.values(),
        resources: preset.value === "own" ? own.values() : preset.value,
      };
      /** @type {{id: string}} */
      const stored = await post("/v1/satellites", body);
      await onStored(stored.id);
    }),
  );
  byId("satellite-form").append(
    field("one-name", "Name", name),
    field("one-tle", "TLE: line 1 and line 2", tle),
    h("h3", {}, "Agility"),
    agility.element,
    h("h3", {}, "Sensor"),
    sensor.element,
    h("h3", {}, "Battery and recorder"),
    field("one-preset", "Figures", preset),
    figures,
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
