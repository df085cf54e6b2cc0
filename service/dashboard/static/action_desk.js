// @ts-check
/** What can be done with the chosen action: report it, promise it, drop it, forbid its pass. */

import { list, post } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { describe } from "./page.js";

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
    const action = this.actions.get(this.selection.now.actionId ?? "");
    const place = byId("chosen-action");
    if (!action) {
      fill(place);
      return;
    }
    const wishes = action.mode === "collect" ? this.imageWishes(action) : this.contactWishes(action);
    fill(place, h("p", {}, this.words(action)), h("p", { class: "buttons needs-submit" }, ...this.reports(action), ...wishes));
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

  /** @param {PlanActionOut} action */
  imageWishes(action) {
    const target = action.target_id;
    const keep = { text: `Promised: ${target} is imaged.`, field: /** @type {const} */ ("promises"), value: { target_id: target } };
    const drop = { text: `Skipped: ${target} is no longer wanted.`, field: /** @type {const} */ ("drop_targets"), value: target };
    return [this.button("promise", "Promise it", keep), this.button("drop", "Skip its target", drop)];
  }

  /** @param {PlanActionOut} action */
  contactWishes(action) {
    const { satellite_id, station_id, start, end } = action;
    const over = `${this.drawn.satelliteName(satellite_id)} over ${this.station(action)} at ${utc(start)} UTC`;
    const forbid = {
      text: `Lost: ${over}.`,
      field: /** @type {const} */ ("outages"),
      value: { satellite_id, start, end, modes: ["contact"], reason: "Lost pass." },
    };
    const out = {
      text: `${this.station(action)} is out from ${utc(start)} to ${utc(end)} UTC.`,
      field: /** @type {const} */ ("outages"),
      value: { station_id, start, end },
    };
    return [this.button("lose", "The pass is lost", forbid), this.button("station-out", "The station is out", out)];
  }

  /**
   * @param {string} id
   * @param {string} text
   * @param {import("./wishes.js").Wish} wish
   */
  button(id, text, wish) {
    return h("button", { type: "button", class: "quiet", id: `wish-${id}`, onclick: () => this.wishes.add(wish) }, text);
  }
}
