// @ts-check
/** Changes of settings that the service proposes, in operators' words. */

import { number, utc } from "./format.js";

/** @type {Record<string, (value: any) => string>} */
const SAID = {
  off_nadir_max_deg: (value) => `off-nadir up to ${number(value)}°`,
  off_nadir_min_deg: (value) => `off-nadir from ${number(value)}°`,
  min_elevation_deg: (value) => `elevation from ${number(value)}°`,
  sun_elevation_min_deg: (value) => `sun elevation from ${number(value)}°`,
  sun_elevation_max_deg: (value) => `sun elevation up to ${number(value)}°`,
  sun_exclusion_deg: (value) => `sun exclusion ${number(value)}°`,
  look_side: (value) => (value === "any" ? "either look side" : `look side ${value}`),
  orbit_direction: (value) => (value === "any" ? "either orbit direction" : `orbit direction ${value}`),
  collect_s: (value) => `image duration ${number(value)} s`,
  release: (value) => `wanted from ${utc(value)} UTC`,
  due: (value) => `wanted until ${utc(value)} UTC`,
  sensor_type: (value) => (value === null ? "any type of sensor" : `sensor type ${value}`),
  horizon_end: (value) => `planning until ${utc(value)} UTC`,
};

/**
 * Return a change in words, whatever fields it has.
 * @param {import("./plan.js").Plan} plan
 * @param {Record<string, unknown> | null} change in the form of a what-if's `relax`
 */
export function changeOf(plan, change) {
  if (change === null) return "";
  return [...partsOf(plan, change)].join(", ");
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {Record<string, unknown>} change
 * @returns {Iterable<string>}
 */
function* partsOf(plan, change) {
  /** @type {Set<string>} */
  const said = new Set();
  for (const [name, value] of settingsOf(change)) {
    const told = name === "drop_actions" ? withoutActions(plan, /** @type {string[]} */ (value)) : SAID[name]?.(value);
    const words = told ?? `${name.replaceAll("_", " ")} ${typeof value === "object" ? JSON.stringify(value) : value}`;
    // The target and the sensor may have the same limit: it is named once.
    if (!said.has(words)) yield words;
    said.add(words);
  }
  if (change.satellite_id) yield `on ${plan.satelliteName(String(change.satellite_id))}`;
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {string[]} ids
 */
function withoutActions(plan, ids) {
  return `without ${ids.map((id) => plan.actionTitle(id)).join(", ")}`;
}

/**
 * @param {Record<string, unknown>} change
 * @returns {Iterable<[string, unknown]>}
 */
function* settingsOf(change) {
  for (const [name, value] of Object.entries(change)) {
    if (name === "opportunity_id" || name === "satellite_id") continue;
    if (name === "targets") {
      for (const own of Object.values(/** @type {Record<string, object>} */ (value))) yield* Object.entries(own);
    } else if (value !== null) yield [name, value];
  }
}
