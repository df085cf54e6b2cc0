// @ts-check
/** Figures for the wall, from a plan at an instant. */

import { percent, utc } from "./format.js";
import { firstAbove } from "./plan.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Row} Row */
/** @typedef {import("./types.js").PlanChangesOut} PlanChangesOut */

/**
 * Return battery and recorder at an instant, interpolated between the knots of their curves.
 * @param {Row} row
 * @param {number} at
 */
export function resourcesAt(row, at) {
  const curves = row.curves;
  if (curves === null || curves.time.length === 0) return null;
  const last = curves.time.length - 1;
  const i = firstAbove(curves.time, at);
  if (i === 0 || i > last) {
    const edge = i === 0 ? 0 : last;
    return { battery: Number(curves.battery[edge]), recorder: Number(curves.recorder[edge]) };
  }
  const [from, to] = [Number(curves.time[i - 1]), Number(curves.time[i])];
  const share = (at - from) / (to - from);
  const between = (/** @type {number[]} */ values) => Number(values[i - 1]) * (1 - share) + Number(values[i]) * share;
  return { battery: between(curves.battery), recorder: between(curves.recorder) };
}

/**
 * Return how many images are on board according to the plan, and the age of the oldest.
 * @param {Plan} plan
 * @param {Row} row
 * @param {number} at
 * @returns {{count: number, oldest_s: number | null}}
 */
export function onBoard(plan, row, at) {
  const taken = row.collects.of
    .filter((one) => Date.parse(one.end) <= at)
    .filter((one) => one.delivered_at == null || Date.parse(one.delivered_at) > at)
    .map((one) => (at - Date.parse(one.end)) / 1000);
  return { count: taken.length, oldest_s: taken.length > 0 ? Math.max(...taken) : null };
}

/**
 * Return an age in whole minutes: nobody reads seconds from four metres away.
 * @param {number} seconds
 */
export function age(seconds) {
  const minutes = Math.floor(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")}`;
}

/**
 * @param {import("./types.js").PlanOut} plan
 * @param {PlanChangesOut} changes
 */
export function telling(plan, changes) {
  return `${plan.name ?? "Replan"}: ${percent(changes.changed_share)} changed after ${utc(changes.freeze_until)} UTC`;
}

/**
 * @param {PlanChangesOut["items"][number]} item
 * @param {Plan | undefined} plan
 * @param {(stationId: string) => string} stationOf
 */
export function changeLine(item, plan, stationOf) {
  const about = item.action ?? item.parent_action;
  if (about === null) return item.change;
  const where = about.target_name ?? about.target_id ?? stationOf(about.station_id ?? "");
  const name = plan?.satelliteName(about.satellite_id) ?? about.satellite_id;
  return `${item.change}: ${name}, ${about.mode} ${where}, ${utc(about.start).slice(11)}`;
}
