// @ts-check
/** What has happened to a plan and what is wanted of the next one, until a replan is asked for. */

import { byId, fill, h } from "./dom.js";

/**
 * @typedef {object} Wish
 * @property {string} text for people
 * @property {"outages" | "promises" | "drop_targets"} field of the replan's body
 * @property {unknown} value
 */

export class Wishes {
  constructor() {
    /** @type {Wish[]} */
    this.all = [];
  }

  /** @param {Wish} wish */
  add(wish) {
    const told = JSON.stringify(wish);
    if (!this.all.some((one) => JSON.stringify(one) === told)) this.all.push(wish);
    this.show();
  }

  show() {
    byId("no-wishes").hidden = this.all.length > 0;
    fill(byId("wishes"), ...this.all.map((wish) => h("li", {}, `${wish.text} `, this.removal(wish))));
  }

  /** @param {Wish} wish */
  removal(wish) {
    const onclick = () => {
      this.all = this.all.filter((one) => one !== wish);
      this.show();
    };
    return h("button", { type: "button", class: "link", "aria-label": `Remove: ${wish.text}`, onclick }, "remove");
  }

  /** Return the lists of a replan's body. @returns {Record<string, unknown[]>} */
  lists() {
    /** @type {Record<string, unknown[]>} */
    const found = {};
    for (const { field, value } of this.all) (found[field] ??= []).push(value);
    return found;
  }
}
