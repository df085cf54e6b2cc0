// @ts-check
/** Opportunities of a scenario, requested when the user wants to see them. */

import { list, pause, Problem } from "./api.js";
import { Lane } from "./plan.js";

/** @typedef {import("./types.js").OpportunityOut} OpportunityOut */

const MOST = 20_000;

/**
 * Return the opportunities of a target or of a satellite, in order of start.
 * @param {string} scenarioId
 * @param {{target_id: string} | {satellite_id: string}} of
 * @param {(count: number) => void} [onPage]
 * @returns {Promise<{items: OpportunityOut[], isAll: boolean}>}
 */
export async function opportunitiesOf(scenarioId, of, onPage = () => {}) {
  const path = `/v1/scenarios/${encodeURIComponent(scenarioId)}/opportunities?${new URLSearchParams(of)}`;
  for (;;) {
    try {
      return await list(path, MOST, (items) => onPage(items.length));
    } catch (error) {
      // They may still have to be computed.
      if (!(error instanceof Problem) || error.code !== "still_computing") throw error;
      await pause(5000);
    }
  }
}

/**
 * Return opportunities as lanes of a chart.
 * @param {OpportunityOut[]} items
 * @returns {Map<string, Lane<OpportunityOut>>} by satellite
 */
export function lanesOf(items) {
  const ids = new Set(items.map((one) => one.satellite_id));
  const spansOf = (/** @type {string} */ id) =>
    items
      .filter((one) => one.satellite_id === id)
      .map((one) => ({ start: Date.parse(one.start), end: Date.parse(one.end), of: one }));
  return new Map([...ids].map((id) => [id, new Lane(spansOf(id))]));
}
