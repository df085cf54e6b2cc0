// @ts-check
/** What has happened to a plan and what is wanted of the next one, until a replan is asked for. */

import { byId, fill, h } from "./dom.js";

/**
 * @typedef {object} Wish
 * @property {string} text for people
 * @property {"outages" | "promises" | "drop_targets" | "keep" | "skip" | "rewards"} field of the replan's body
 * @property {unknown} value of `rewards` target and reward
 * @property {Record<string, string>} [stances] what it says of what: a later wish that says otherwise takes its place
 */

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
      // Whoever goes by keyboard stays where they are.
      const left = byId("wishes").querySelectorAll("button");
      (left[Math.min(at, left.length - 1)] ?? byId("wishes-title")).focus();
    };
    return h("button", { type: "button", class: "link", "aria-label": `Remove: ${wish.text}`, onclick }, "remove");
  }

  /** Return the fields of a replan's body. @returns {Record<string, unknown>} */
  fields() {
    /** @type {Record<string, unknown[]>} */
    const found = {};
    for (const { field, value } of this.all) (found[field] ??= []).push(value);
    const { rewards, ...lists } = found;
    if (rewards === undefined) return lists;
    return { ...lists, rewards: Object.fromEntries(/** @type {[string, number][]} */ (rewards)) };
  }
}

/**
 * Return whether two wishes cannot both be had.
 * @param {Wish} one
 * @param {Wish} other
 */
function clash(one, other) {
  const [mine, theirs] = [one.stances ?? {}, other.stances ?? {}];
  return Object.keys(mine).some((what) => what in theirs && mine[what] !== theirs[what]);
}
