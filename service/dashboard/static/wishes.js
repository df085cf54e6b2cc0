// @ts-check
/** Requested changes to a plan: collected one by one, then sent together. */

import { byId, fill, h } from "./dom.js";

/**
 * @typedef {object} Wish
 * @property {string} text for people
 * @property {"keep" | "skip" | "promise" | "drop" | "reward" | "outage" | "setting"} kind
 * @property {any} value an action, a target's id, target and reward, an outage, or settings in the form of `relax`
 * @property {Record<string, string>} [stances] what it says about each subject: a later wish that contradicts it replaces it
 */

/** The list of wishes, shown as lines that can be removed. */
export class Wishes {
  constructor() {
    /** @type {Wish[]} */
    this.all = [];
  }

  /** @param {Wish} wish */
  add(wish) {
    const told = JSON.stringify(wish);
    if (this.all.some((one) => JSON.stringify(one) === told)) return;
    this.all = [...this.all.filter((one) => !clash(one, wish)), wish];
    this.show();
  }

  show() {
    byId("no-wishes").hidden = this.all.length > 0;
    fill(byId("wishes"), ...this.all.map((wish) => h("li", {}, `${wish.text} `, this.removal(wish))));
  }

  /** @param {Wish} wish */
  removal(wish) {
    const onclick = () => {
      const at = this.all.indexOf(wish);
      this.all = this.all.filter((one) => one !== wish);
      this.show();
      // Keyboard users keep their place in the list.
      const left = byId("wishes").querySelectorAll("button");
      (left[Math.min(at, left.length - 1)] ?? byId("wishes-title")).focus();
    };
    return h("button", { type: "button", class: "link", "aria-label": `Remove: ${wish.text}`, onclick }, "remove");
  }
}

/**
 * Return the fields of a replan's body.
 * @param {Wish[]} wishes
 * @returns {Record<string, unknown>}
 */
export function replanOf(wishes) {
  const rewards = Object.fromEntries(valuesOf(wishes, "reward"));
  return {
    keep: valuesOf(wishes, "keep"),
    skip: valuesOf(wishes, "skip"),
    promises: valuesOf(wishes, "promise").map((target_id) => ({ target_id })),
    drop_targets: valuesOf(wishes, "drop"),
    outages: valuesOf(wishes, "outage"),
    ...(Object.keys(rewards).length > 0 ? { rewards } : {}),
  };
}

/**
 * Return the fields of a what-if's body.
 * @param {Wish[]} wishes
 * @returns {Record<string, unknown>}
 */
export function whatIfOf(wishes) {
  const rewards = valuesOf(wishes, "reward").map(([id, reward]) => ({ targets: { [id]: { reward } } }));
  return {
    force: [...valuesOf(wishes, "keep"), ...valuesOf(wishes, "promise")],
    forbid: [...valuesOf(wishes, "skip"), ...valuesOf(wishes, "drop")],
    relax: [...valuesOf(wishes, "setting"), ...rewards].reduce(joined, {}),
  };
}

/**
 * @param {Wish[]} wishes
 * @param {Wish["kind"]} kind
 * @returns {any[]}
 */
function valuesOf(wishes, kind) {
  return wishes.filter((one) => one.kind === kind).map((one) => one.value);
}

/**
 * Return settings with more added: those of a satellite under its id, those of targets under theirs.
 * @param {Record<string, any>} relax
 * @param {Record<string, any>} more
 * @returns {Record<string, any>}
 */
function joined(relax, more) {
  const { satellite_id, targets, drop_actions, horizon_end, opportunity_id, ...settings } = more;
  const found = { ...relax };
  if (horizon_end) found.horizon_end = horizon_end;
  if (drop_actions) found.drop_actions = [...new Set([...(relax.drop_actions ?? []), ...drop_actions])];
  if (targets) found.targets = merged(relax.targets, targets);
  if (satellite_id === undefined || satellite_id === null) return { ...found, ...settings };
  if (Object.keys(settings).length > 0) found.satellites = merged(relax.satellites, { [satellite_id]: settings });
  return found;
}

/**
 * @param {Record<string, object> | undefined} known
 * @param {Record<string, object>} more
 */
function merged(known, more) {
  const found = { ...known };
  for (const [id, own] of Object.entries(more)) found[id] = { ...found[id], ...own };
  return found;
}

/**
 * Return whether two wishes contradict each other.
 * @param {Wish} one
 * @param {Wish} other
 */
function clash(one, other) {
  const [mine, theirs] = [one.stances ?? {}, other.stances ?? {}];
  return Object.keys(mine).some((what) => what in theirs && mine[what] !== theirs[what]);
}
