// @ts-check
/** What can be done with the selected item: actions are reported, wishes for the next replan are made. */

import { list, post } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { describe } from "./page.js";
import { WishDesk } from "./wish_desk.js";

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
    // A withdrawn or superseded plan is not replanned.
    this.desk = new WishDesk(drawn, selection, wishes, () => !byId("replan-card").hidden);
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
    selection.onOpen((anchor) => this.desk.openMenu(anchor));
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
    const action = this.drawn.actions.get(one.id);
    const outcome = one.outcome ? `, ${one.outcome}` : "";
    return `${action ? this.desk.words(action) : one.id}${outcome}`;
  }

  show() {
    const place = byId("chosen-action");
    const action = this.actions.get(this.selection.now.actionId ?? "");
    const title = action ? this.words(action) : this.desk.title();
    const wishes = this.desk.buttons(this.desk.offers());
    fill(
      place,
      title && h("p", {}, title),
      wishes.length > 0 && h("p", { class: "buttons needs-submit" }, ...wishes),
      action && this.isReported() && this.reports(action),
    );
  }

  /** Whether actions can be reported: the plan is being flown, or was. */
  isReported() {
    return this.plan.state !== "draft" && this.plan.state !== "approved";
  }

  /** @param {PlanActionOut} action */
  reports(action) {
    const mbit = h("input", { type: "number", id: "report-mbit", min: 0, step: "any" });
    const detail = h("input", { id: "report-detail", autocomplete: "off", maxlength: 1000 });
    const told = () => ({
      ...(mbit.value === "" ? {} : { mbit: mbit.valueAsNumber }),
      ...(detail.value.trim() === "" ? {} : { detail: detail.value.trim() }),
    });
    const buttons = ["executed", "partial", "failed", "skipped"].map((outcome) => {
      const onclick = () => this.report(action, { outcome, ...told() });
      return h("button", { type: "button", id: `report-${outcome}`, onclick }, `Report ${outcome}`);
    });
    return h(
      "div",
      { class: "row needs-submit", role: "group", "aria-label": "Report" },
      h("label", {}, "Data volume, Mbit ", mbit),
      h("label", {}, "Remark ", detail),
      ...buttons,
    );
  }

  /**
   * @param {PlanActionOut} action
   * @param {{outcome: string, mbit?: number, detail?: string}} told
   */
  async report(action, told) {
    try {
      await post(`${this.path}/executions`, [{ action_id: action.id, ...told }]);
      await this.load();
    } catch (error) {
      byId("chosen-action").append(h("div", { class: "notice bad", role: "alert" }, h("div", {}, ...describe(error))));
    }
  }
}
