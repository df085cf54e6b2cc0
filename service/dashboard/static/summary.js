// @ts-check
/** What a plan is worth: its violations first, then its figures. */

import { actionButton } from "./buttons.js";
import { bar, byId, fill, h } from "./dom.js";
import { counted, duration, number, percent, utc } from "./format.js";

/** @typedef {import("./plan.js").Plan} Plan */

/**
 * @param {Plan} plan
 * @param {import("./selection.js").Selection} selection
 */
export function showSummary(plan, selection) {
  const { timeline } = plan;
  const { totals, runtime_s: runtime } = timeline;
  showViolations(plan, selection);
  const seconds = Object.values(runtime).reduce((sum, part) => sum + part, 0);
  const parts = Object.entries(runtime).map(([phase, part]) => `${phase} ${number(part, 2)}`);
  const { targets } = totals;
  const figures = [
    ["Reward", number(totals.reward), ""],
    ["Bound", number(totals.bound), totals.bound === null ? "none proven" : "proven: no plan earns more"],
    ["Gap", percent(totals.gap), totals.gap === null ? "no bound" : bar(1 - totals.gap, "Reward as a share of the bound")],
    ["Validity", timeline.validity, "by the referee, not by the solver"],
    ["Targets", `${totals.collects} collected`, `${targets.downlinked} on the ground, ${targets.unscheduled} left out, ${targets.excluded} excluded`],
    ["Contacts", String(totals.contacts), downOf(totals)],
    ["Battery, lowest", percent(totals.battery_min_fraction), ""],
    ["Recorder, highest", percent(totals.recorder_max_fraction), ""],
    ["Runtime", duration(seconds), `${parts.join(", ")} s`],
    ["Ended", timeline.termination.replaceAll("_", " "), `plan ${timeline.plan_sha256.slice(0, 12)}`],
  ];
  const items = figures.flatMap(([name, value, note]) => [
    h("div", {}, h("dt", {}, name), h("dd", { "data-figure": String(name).toLowerCase() }, h("strong", {}, value), note && h("small", {}, note))),
  ]);
  fill(byId("summary"), ...items);
  showWarnings(timeline.warnings);
}

/** @param {string[]} warnings */
function showWarnings(warnings) {
  if (warnings.length === 0) return;
  const items = h("ul", {}, ...warnings.map((text) => h("li", {}, text)));
  const title = h("summary", {}, counted(warnings.length, "warning"), ": ", warnings[0]);
  const isShort = warnings.length === 1;
  fill(byId("warnings"), h("div", { class: "notice warn" }, isShort ? warnings[0] : h("details", {}, title, items)));
}

/** @param {import("./types.js").Totals} totals */
function downOf(totals) {
  if (totals.downlinked_mbit !== null) return `${number(totals.downlinked_mbit, 0)} Mbit down`;
  if (totals.downlinked_fraction === null) return "";
  return `${number(totals.downlinked_fraction, 2)} times the recorder's capacity downlinked`;
}

/**
 * @param {Plan} plan
 * @param {import("./selection.js").Selection} selection
 */
function showViolations(plan, selection) {
  const { violations } = plan.timeline;
  if (violations.length === 0) return;
  const rows = violations.slice(0, 200).map((one) =>
    h(
      "tr",
      {},
      h("td", {}, one.code),
      h("td", {}, plan.satelliteName(one.satellite_id)),
      h("td", {}, utc(one.at)),
      h("td", { class: "number" }, number(one.needed, 3)),
      h("td", { class: "number" }, number(one.available, 3)),
      h("td", {}, one.detail, " ", ...one.actions.map((id) => actionButton(plan, selection, id))),
    ),
  );
  const heads = ["Violation", "Satellite", "At (UTC)", "Needed", "Available", "What"];
  const { validity } = plan.timeline;
  /** @type {Record<string, string>} */
  const titles = { valid: "Remarks", inherited: "Limits were broken before this plan began" };
  const title = titles[validity] ?? "This plan breaks limits";
  fill(
    byId("violations"),
    h(
      "div",
      { class: validity in titles ? "notice warn" : "notice bad", role: "alert" },
      h(
        "div",
        { class: "scroll" },
        h("strong", {}, `${title}: ${violations.length}`),
        h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((text) => h("th", { scope: "col" }, text)))), h("tbody", {}, ...rows)),
      ),
    ),
  );
}
