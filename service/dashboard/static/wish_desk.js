// @ts-check
/** The changes offered for the selected item, as buttons and as a menu. */

import { h } from "./dom.js";
import { utc } from "./format.js";
import { openMenu } from "./menu.js";
import { offersOfContact, offersOfImage, offersOfTarget, weighed } from "./offers.js";
import { askForPriority, installPriorityDialog } from "./priority_dialog.js";

/** @typedef {import("./offers.js").Offer} Offer */
/** @typedef {import("./types.js").Action} Action */

export class WishDesk {
  /**
   * @param {import("./plan.js").Plan} plan
   * @param {import("./selection.js").Selection} selection
   * @param {import("./wishes.js").Wishes} wishes
   * @param {(offer: Offer) => boolean} takes whether the page supports an offer
   */
  constructor(plan, selection, wishes, takes) {
    this.plan = plan;
    this.selection = selection;
    this.wishes = wishes;
    this.takes = takes;
    installPriorityDialog();
  }

  /** The selected collect or contact. @returns {Action | undefined} */
  action() {
    const action = this.plan.actions.get(this.selection.now.actionId ?? "");
    return action?.mode === "collect" || action?.mode === "contact" ? action : undefined;
  }

  /** The selected item in words. */
  title() {
    const action = this.action();
    if (action) return this.words(action);
    const target = this.plan.target.get(this.selection.now.targetId ?? "");
    return target ? `${target.title}: ${target.outcome}${target.why ? `, ${target.why}` : ""}` : "";
  }

  /** @param {Action} action */
  words(action) {
    const target = this.plan.targetTitle(action.target_id ?? "");
    const what = action.mode === "collect" ? `image of ${target}` : `contact with ${action.station_name ?? action.station_id}`;
    return `${utc(action.start)} ${this.plan.satelliteName(this.plan.satelliteOf.get(action.id) ?? "")}: ${what}`;
  }

  /** The changes offered for the selected item. @returns {Offer[]} */
  offers() {
    return this.allOffers().filter(this.takes);
  }

  /** @returns {Offer[]} */
  allOffers() {
    const { targetId } = this.selection.now;
    const action = this.action();
    if (action?.mode === "collect") return offersOfImage(this.plan, action);
    if (action) return offersOfContact(this.plan, action);
    return targetId !== null && this.plan.target.get(targetId)?.actionId === null ? offersOfTarget(this.plan, targetId) : [];
  }

  /** @param {Offer[]} offers */
  buttons(offers) {
    return offers.map((offer) =>
      h("button", { type: "button", class: "quiet", id: `wish-${offer.id}`, onclick: () => this.take(offer) }, offer.text),
    );
  }

  /** @param {import("./selection.js").Anchor} anchor */
  openMenu(anchor) {
    if (document.body.dataset.scope === "read") return;
    const lines = this.offers().map((offer) => ({ id: offer.id, text: offer.text, choose: () => this.take(offer) }));
    if (lines.length > 0) openMenu(this.title(), lines, anchor);
  }

  /** @param {Offer} offer */
  async take({ wish, weigh }) {
    if (wish) this.wishes.add(wish);
    if (weigh === undefined) return;
    const reward = await askForPriority(this.plan.targetTitle(weigh), this.plan.target.get(weigh)?.reward ?? null);
    if (reward !== null) this.wishes.add(weighed(this.plan, weigh, reward));
  }
}
