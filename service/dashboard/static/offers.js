// @ts-check
/** What can be wished of an action or a target of a plan: the lines of its menu, and its buttons. */

import { utc } from "./format.js";

/** @typedef {import("./types.js").PlanActionOut} PlanActionOut */
/** @typedef {import("./geography.js").TargetPlace} TargetPlace */
/** @typedef {import("./wishes.js").Wish} Wish */

/**
 * @typedef {object} Offer
 * @property {string} id
 * @property {string} text
 * @property {Wish} [wish]
 * @property {{id: string, reward: number | null}} [weigh] the target whose priority is asked for first
 */

/** @typedef {{satelliteOf: (id: string) => string, stationOf: (action: PlanActionOut) => string}} Names */

/**
 * @param {PlanActionOut} action
 * @param {TargetPlace | null} target
 * @param {Names} names
 * @returns {Offer[]}
 */
export function offersOfImage(action, target, names) {
  const id = action.target_id ?? "";
  const what = `image of ${id} by ${names.satelliteOf(action.satellite_id)} at ${utc(action.start)} UTC`;
  return [
    pin("keep", "Keep (pin)", `Kept: ${what}.`, action, { [`action ${action.id}`]: "keep", [`target ${id}`]: "wanted" }),
    pin("skip", "Skip this image", `Skipped: ${what}.`, action, { [`action ${action.id}`]: "skip" }),
    promise(id),
    {
      id: "drop",
      text: "Forbid its target",
      wish: { text: `Forbidden: ${id} is no longer wanted.`, field: "drop_targets", value: id, stances: { [`target ${id}`]: "dropped" } },
    },
    priority(id, target),
  ];
}

/**
 * @param {PlanActionOut} action
 * @param {Names} names
 * @returns {Offer[]}
 */
export function offersOfContact(action, names) {
  const { satellite_id, station_id, start, end } = action;
  const station = names.stationOf(action);
  const over = `${names.satelliteOf(satellite_id)} over ${station} at ${utc(start)} UTC`;
  const stance = (/** @type {string} */ said) => ({ [`action ${action.id}`]: said });
  return [
    pin("keep", "Keep (pin)", `Kept: ${over}.`, action, stance("keep")),
    {
      id: "lose",
      text: "The pass is lost",
      wish: {
        text: `Lost: ${over}.`,
        field: "outages",
        value: { satellite_id, start, end, modes: ["contact"], reason: "Lost pass." },
        stances: stance("lost"),
      },
    },
    pin("skip", "Skip this pass", `Skipped: ${over}.`, action, stance("skip")),
    {
      id: "station-out",
      text: "The station is out",
      wish: {
        text: `${station} is out from ${utc(start)} to ${utc(end)} UTC.`,
        field: "outages",
        value: { station_id, start, end },
        stances: stance("out"),
      },
    },
  ];
}

/**
 * @param {TargetPlace} target that has no image
 * @returns {Offer[]}
 */
export function offersOfTarget(target) {
  return [promise(target.id), priority(target.id, target)];
}

/**
 * Return the wish that an image earns so much from now on.
 * @param {string} id
 * @param {number} reward
 * @returns {Wish}
 */
export function weighed(id, reward) {
  return {
    text: `Priority of ${id}: ${reward}.`,
    field: "rewards",
    value: [id, reward],
    stances: { [`reward ${id}`]: String(reward), [`target ${id}`]: "wanted" },
  };
}

/**
 * @param {"keep" | "skip"} field
 * @param {string} text
 * @param {string} told
 * @param {PlanActionOut} action
 * @param {Record<string, string>} stances
 * @returns {Offer}
 */
function pin(field, text, told, { satellite_id, target_id, station_id, start, end }, stances) {
  const value = { satellite_id, ...(target_id === null ? { station_id } : { target_id }), start, end };
  return { id: field, text, wish: { text: told, field, value, stances } };
}

/**
 * @param {string} id
 * @returns {Offer}
 */
function promise(id) {
  const wish = { text: `Promised: ${id} is imaged.`, field: /** @type {const} */ ("promises"), value: { target_id: id } };
  return { id: "promise", text: "Promise its image", wish: { ...wish, stances: { [`target ${id}`]: "wanted" } } };
}

/**
 * @param {string} id
 * @param {TargetPlace | null} target
 * @returns {Offer}
 */
function priority(id, target) {
  return { id: "priority", text: "Priority …", weigh: { id, reward: target?.reward ?? null } };
}
