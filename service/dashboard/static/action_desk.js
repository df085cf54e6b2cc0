// @ts-check
/** What can be done with what is selected: actions are reported, wishes of the next plan are made. */

import { list, post } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { openMenu } from "./menu.js";
import { offersOfContact, offersOfImage, offersOfTarget, weighed } from "./offers.js";
import { describe } from "./page.js";
import { askForPriority, installPriorityDialog } from "./priority_dialog.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */
/** @typedef {import("./types.js").PlanActionOut} PlanActionOut */

export class ActionDesk {
  /**
   * @param {PlanOut} plan
   * @param {import("./plan.js").Plan} drawn
   * @param {import("./selection.js").Selection} selection
   * @param {import("./wishes.js").Wishes} wishes
   */
  constructor(plan, drawn, selection, wishes) {
    this.plan = plan;
    this.path = `/v1/plans/${encodeURIComponent(plan.id)}`;
    this.drawn = drawn;
    this.selection = selection;
    this.wishes = wishes;
    /** @type {Map<string, PlanActionOut>} */
    this.actions = new Map();
    this.choice = /** @type {HTMLSelectElement} */ (byId("action-choice"));
    this.choice.addEventListener("change", () => {
      if (this.choice.value) selection.select(drawn.about(this.choice.value));
      else selection.clear();
    });
    selection.onChange(({ actionId }) => {
      this.choice.value = actionId !== null && this.actions.has(actionId) ? actionId : "";
      this.show();
    });
    selection.onOpen((anchor) => this.openMenu(anchor));
    installPriorityDialog();
  }

  async load() {
    /** @type {{items: PlanActionOut[]}} */
    const { items } = await list(`${this.path}/actions`);
    items.sort((a, b) => (a.start < b.start ? -1 : 1));
    this.actions = new Map(items.map((one) => [one.id, one]));
    const chosen = this.choice.value;
    fill(this.choice, h("option", { value: "" }, "none"), ...items.map((one) => h("option", { value: one.id }, this.words(one))));
    this.choice.value = chosen;
    this.show();
  }

  /** @param {PlanActionOut} one */
  words(one) {
    const what = one.mode === "collect" ? `image of ${one.target_id}` : `contact with ${this.station(one)}`;
    const outcome = one.outcome ? `, ${one.outcome}` : "";
    return `${utc(one.start)} ${this.drawn.satelliteName(one.satellite_id)}: ${what}${outcome}`;
  }

  /** @param {PlanActionOut} one */
  station(one) {
    return this.drawn.actions.get(one.id)?.station_name ?? one.station_id ?? "";
  }

  show() {
    const place = byId("chosen-action");
    const { actionId, targetId } = this.selection.now;
    const action = this.actions.get(actionId ?? "");
    const target = this.drawn.target.get(targetId ?? "");
    const reports = action ? this.reports(action) : [];
    const wishes = this.offers().map((offer) =>
      h("button", { type: "button", class: "quiet", id: `wish-${offer.id}`, onclick: () => this.take(offer) }, offer.text),
    );
    if (!action && !target) fill(place);
    else fill(place, h("p", {}, this.title()), h("p", { class: "buttons needs-submit" }, ...reports, ...wishes));
  }

  /** What is selected, in words. */
  title() {
    const { actionId, targetId } = this.selection.now;
    const action = this.actions.get(actionId ?? "");
    if (action) return this.words(action);
    const target = this.drawn.target.get(targetId ?? "");
    return target ? `${target.id}: ${target.outcome}${target.why ? `, ${target.why}` : ""}` : "";
  }

  /** What can be wished of what is selected. @returns {import("./offers.js").Offer[]} */
  offers() {
    // Nobody goes on from a plan that is withdrawn or superseded.
    if (byId("replan-card").hidden) return [];
    const { actionId, targetId } = this.selection.now;
    const action = this.actions.get(actionId ?? "");
    const target = this.drawn.target.get(targetId ?? "") ?? null;
    const names = {
      satelliteOf: (/** @type {string} */ id) => this.drawn.satelliteName(id),
      stationOf: (/** @type {PlanActionOut} */ one) => this.station(one),
    };
    if (action?.mode === "collect") return offersOfImage(action, target, names);
    if (action) return offersOfContact(action, names);
    return target && target.actionId === null ? offersOfTarget(target) : [];
  }

  /** @param {import("./selection.js").Anchor} anchor */
  openMenu(anchor) {
    if (document.body.dataset.scope === "read") return;
    const lines = this.offers().map((offer) => ({ id: offer.id, text: offer.text, choose: () => this.take(offer) }));
    if (lines.length > 0) openMenu(this.title(), lines, anchor);
  }

  /** @param {import("./offers.js").Offer} offer */
  async take({ wish, weigh }) {
    if (wish) this.wishes.add(wish);
    if (!weigh) return;
    const reward = await askForPriority(weigh.id, weigh.reward);
    if (reward !== null) this.wishes.add(weighed(weigh.id, reward));
  }

  /** @param {PlanActionOut} action */
  reports(action) {
    if (this.plan.state === "draft" || this.plan.state === "approved") return [];
    return ["executed", "failed", "skipped"].map((outcome) =>
      h("button", { type: "button", id: `report-${outcome}`, onclick: () => this.report(action, outcome) }, `Report ${outcome}`),
    );
  }

  /**
   * @param {PlanActionOut} action
   * @param {string} outcome
   */
  async report(action, outcome) {
    try {
      await post(`${this.path}/executions`, [{ action_id: action.id, outcome }]);
      await this.load();
    } catch (error) {
      byId("chosen-action").append(h("div", { class: "notice bad", role: "alert" }, h("div", {}, ...describe(error))));
    }
  }
}
