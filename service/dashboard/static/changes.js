// @ts-check
/** What a replan changes, and why. */

import { h } from "./dom.js";
import { percent, targetTitle, utc } from "./format.js";

/** @typedef {import("./types.js").PlanChangesOut} PlanChangesOut */
/** @typedef {import("./types.js").PlanActionOut} PlanActionOut */

/** @type {Record<string, string>} */
const CAUSES = {
  lost: "lost to an outage, a failure or a dropped target",
  displaced_by: "another action took its time",
  resource: "because of battery, recorder or a contact",
  gain: "because of what it earns",
};

/**
 * Return the changes as elements: the shares, then a row for each change.
 * @param {PlanChangesOut} changes
 */
export function changesTable(changes) {
  const { items } = changes;
  const shares =
    `${percent(changes.changed_share)} of the plan after ${utc(changes.freeze_until)} UTC moved or removed; ` +
    `${percent(changes.forced_share)} would be lost in any case.`;
  if (items.length === 0) return [h("p", {}, "Nothing changes.")];
  const rows = items.map((item) => {
    const about = /** @type {PlanActionOut} */ (item.action ?? item.parent_action);
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, item.change),
      h("td", {}, about.mode),
      h("td", {}, about.target_id === null ? (about.station_name ?? about.station_id) : targetTitle(about.target_id, about.target_name)),
      h("td", {}, about.satellite_name ?? about.satellite_id),
      h("td", {}, utc(item.parent_action?.start)),
      h("td", {}, utc(item.action?.start)),
      h("td", {}, CAUSES[item.cause] ?? item.cause),
    );
  });
  const heads = ["Change", "Mode", "Target or station", "Satellite", "Was (UTC)", "Is (UTC)", "Why"];
  const head = h("tr", {}, ...heads.map((text) => h("th", { scope: "col" }, text)));
  return [
    h("p", {}, shares),
    h("div", { class: "scroll changes" }, h("table", {}, h("thead", {}, head), h("tbody", {}, ...rows))),
  ];
}
