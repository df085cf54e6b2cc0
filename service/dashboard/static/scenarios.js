// @ts-check
/** Names of scenarios, each read once. */

import { get, Problem } from "./api.js";
import { counted, short, utc } from "./format.js";

/** @type {Map<string, Promise<import("./types.js").ScenarioOut | null>>} */
const known = new Map();

/** @param {string} id */
export function scenario(id) {
  let found = known.get(id);
  if (!found) {
    found = get(`/v1/scenarios/${encodeURIComponent(id)}`).catch((error) => {
      if (error instanceof Problem) return null;
      throw error;
    });
    known.set(id, /** @type {Promise<any>} */ (found));
  }
  return /** @type {Promise<import("./types.js").ScenarioOut | null>} */ (found);
}

/** @param {import("./types.js").ScenarioOut} one */
export function titleOf(one) {
  return one.name ?? `Scenario ${short(one.id)}`;
}

/** @param {import("./types.js").ScenarioOut} one */
export function aboutOf(one) {
  const { satellites, targets, ground_stations: stations } = one.counts;
  const span = `${utc(one.horizon.start)} to ${utc(one.horizon.end)} UTC`;
  const counts = [counted(satellites, "satellite"), counted(targets, "target"), counted(stations, "station")];
  return `${counts.join(", ")}; ${span}`;
}

/** @param {string} id */
export async function nameOf(id) {
  const one = await scenario(id);
  return one === null ? short(id) : titleOf(one);
}
