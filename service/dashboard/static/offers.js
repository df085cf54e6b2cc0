// @ts-check
/** The changes offered for an action or a target of a plan: the entries of its menu, and its buttons. */

import { utc } from "./format.js";
import { changeOf } from "./settings.js";

/** @typedef {import("./types.js").Action} Action */
/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./wishes.js").Wish} Wish */

/**
 * @typedef {object} Offer
 * @property {string} id
 * @property {string} text
 * @property {Wish} [wish]
 * @property {string} [weigh] the target whose priority the user has to enter first
 */

/**
 * Return the changes offered for a collect.
 * @param {Plan} plan
 * @param {Action} action
 * @returns {Offer[]}
 */
export function offersOfImage(plan, action) {
  const id = action.target_id ?? "";
  const what = `image of ${plan.targetTitle(id)} by ${satelliteOf(plan, action)} at ${utc(action.start)} UTC`;
  return [
    pin(plan, "keep", "Keep (pin)", `Kept: ${what}.`, action, { [`action ${action.id}`]: "keep", [`target ${id}`]: "wanted" }),
    pin(plan, "skip", "Skip this image", `Skipped: ${what}.`, action, { [`action ${action.id}`]: "skip" }),
    promise(plan, id),
    {
      id: "drop",
      text: "Forbid its target",
      wish: {
        text: `Forbidden: ${plan.targetTitle(id)} is no longer wanted.`,
        kind: "drop",
        value: id,
        stances: { [`target ${id}`]: "dropped" },
      },
    },
    priority(id),
  ];
}

/**
 * Return the changes offered for a contact.
 * @param {Plan} plan
 * @param {Action} action
 * @returns {Offer[]}
 */
export function offersOfContact(plan, action) {
  const { station_id, start, end } = action;
  const station = action.station_name ?? station_id ?? "";
  const over = `${satelliteOf(plan, action)} over ${station} at ${utc(start)} UTC`;
  const stance = (/** @type {string} */ said) => ({ [`action ${action.id}`]: said });
  return [
    pin(plan, "keep", "Keep (pin)", `Kept: ${over}.`, action, stance("keep")),
    {
      id: "lose",
      text: "The pass is lost",
      wish: {
        text: `Lost: ${over}.`,
        kind: "outage",
        value: { satellite_id: plan.satelliteOf.get(action.id), start, end, modes: ["contact"], reason: "Lost pass." },
        stances: stance("lost"),
      },
    },
    pin(plan, "skip", "Skip this pass", `Skipped: ${over}.`, action, stance("skip")),
    {
      id: "station-out",
      text: "The station is out",
      wish: {
        text: `${station} is out from ${utc(start)} to ${utc(end)} UTC.`,
        kind: "outage",
        value: { station_id, start, end },
        stances: stance("out"),
      },
    },
  ];
}

/**
 * Return the changes offered for a target that has no image.
 * @param {Plan} plan
 * @param {string} id
 * @returns {Offer[]}
 */
export function offersOfTarget(plan, id) {
  return [promise(plan, id), priority(id)];
}

/**
 * Return the offer to try settings that the service proposes, which would let a target in.
 * @param {Plan} plan
 * @param {Record<string, unknown>} change
 * @param {string} id of the offer
 * @returns {Offer}
 */
export function offerOfChange(plan, change, id) {
  const text = changeOf(plan, change);
  const { opportunity_id, ...value } = change;
  return { id, text: `Try ${text}`, wish: { text: `Settings: ${text}.`, kind: "setting", value } };
}

/**
 * Return the wish that an image of a target earns a given reward from now on.
 * @param {Plan} plan
 * @param {string} id
 * @param {number} reward
 * @returns {Wish}
 */
export function weighed(plan, id, reward) {
  return {
    text: `Priority of ${plan.targetTitle(id)}: ${reward}.`,
    kind: "reward",
    value: [id, reward],
    stances: { [`reward ${id}`]: String(reward), [`target ${id}`]: "wanted" },
  };
}

/**
 * @param {Plan} plan
 * @param {Action} action
 */
function satelliteOf(plan, action) {
  return plan.satelliteName(plan.satelliteOf.get(action.id) ?? "");
}

/**
 * @param {Plan} plan
 * @param {"keep" | "skip"} kind
 * @param {string} text
 * @param {string} told
 * @param {Action} action
 * @param {Record<string, string>} stances
 * @returns {Offer}
 */
function pin(plan, kind, text, told, { id, target_id, station_id, start, end }, stances) {
  const place = target_id === null ? { station_id } : { target_id };
  const value = { satellite_id: plan.satelliteOf.get(id), ...place, start, end };
  return { id: kind, text, wish: { text: told, kind, value, stances } };
}

/**
 * @param {Plan} plan
 * @param {string} id
 * @returns {Offer}
 */
function promise(plan, id) {
  const text = `Promised: ${plan.targetTitle(id)} will be imaged.`;
  return { id: "promise", text: "Promise its image", wish: { text, kind: "promise", value: id, stances: { [`target ${id}`]: "wanted" } } };
}

/**
 * @param {string} id
 * @returns {Offer}
 */
function priority(id) {
  return { id: "priority", text: "Priority …", weigh: id };
}
