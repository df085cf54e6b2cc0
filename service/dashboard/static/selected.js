// @ts-check
/** All details of the selected item. */

import { get, pause, Problem } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { number, percent, utc, utcLabelled } from "./format.js";
import { blockersOf } from "./left_out.js";
import { lanesOf, opportunitiesOf } from "./opportunities.js";
import { outcomeOf, reasonName } from "./outcomes.js";
import { showError } from "./page.js";
import { offerOfChange } from "./offers.js";
import { changeOf } from "./settings.js";

/** @typedef {import("./types.js").OpportunityOut} OpportunityOut */
/** @typedef {import("./types.js").ExplanationOut} ExplanationOut */

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {import("./types.js").JobOut} job
 * @param {import("./gantt.js").Gantt} gantt
 * @param {import("./wish_desk.js").WishDesk} desk
 */
export function watchSelection(plan, selection, job, gantt, desk) {
  let asked = 0;
  selection.onChange(({ actionId, targetId, satelliteId }) => {
    asked += 1;
    const action = plan.actions.get(actionId ?? "");
    const known = plan.target.get(targetId ?? "");
    gantt.blocking = new Set();
    gantt.ofTarget = new Map();
    if (!action && !known) {
      fill(byId("selected"), h("p", { class: "hint" }, "Nothing selected."));
      return;
    }
    const list = factsOf([...(known ? targetFacts(known) : []), ...(action ? actionFacts(plan, action, satelliteId) : [])]);
    const more = h("div", {});
    const tries = h("div", { class: "needs-submit" }, h("p", { class: "buttons" }, ...desk.buttons(desk.offers())));
    const place = h("div", {});
    fill(byId("selected"), list, more, tries, place);
    const mine = asked;
    if (known && known.reason !== null) {
      outcomeOf(`/v1/jobs/${encodeURIComponent(job.id)}`, known.id)
        .then((item) => {
          if (mine !== asked || !item?.reason) return;
          gantt.blocking = new Set(item.reason.blocking_actions);
          gantt.canvas.redraw();
          fill(more, factsOf(reasonFacts(plan, selection, item.reason)));
          const { change } = item.reason;
          if (change !== null) tries.append(h("p", { class: "buttons" }, ...desk.buttons([offerOfChange(plan, change, "change")])));
        })
        .catch(showError);
    }
    if (known) {
      if (known.reason === "no_access") offerAccess(plan, job, known.id, desk, tries, () => mine === asked).catch(showError);
      opportunitiesOf(job.scenario.id, { target_id: known.id })
        .then(({ items }) => {
          if (mine !== asked) return;
          gantt.ofTarget = lanesOf(items);
          gantt.canvas.redraw();
          tellOpportunities(plan, known.id, items, place);
        })
        .catch(showError);
    }
    if (action) gantt.view.reveal(Date.parse(action.start), Date.parse(action.end));
  });
}

/**
 * Offer the settings that would give a target an access.
 * @param {import("./plan.js").Plan} plan
 * @param {import("./types.js").JobOut} job
 * @param {string} targetId
 * @param {import("./wish_desk.js").WishDesk} desk
 * @param {HTMLElement} place
 * @param {() => boolean} isWanted
 */
async function offerAccess(plan, job, targetId, desk, place, isWanted) {
  const hint = h("p", { class: "hint" }, "Searching for changes that would give it an access …");
  place.append(hint);
  const told = await explanationOf(job.id, targetId, isWanted);
  hint.remove();
  if (!told || !isWanted()) return;
  if (told.access_changes.length === 0) {
    place.append(h("p", {}, "No single limit, if lifted, would give it an access."));
    return;
  }
  const offers = told.access_changes.map((change, i) => offerOfChange(plan, change, `access-${i}`));
  const lines = desk.buttons(offers).map((button) => h("li", {}, button));
  place.append(h("p", {}, "Each of these would give it an access:"), h("ul", { class: "access-changes" }, ...lines));
}

/**
 * Return the service's explanation of a target, or null once it is no longer wanted.
 * @param {string} jobId
 * @param {string} targetId
 * @param {() => boolean} isWanted
 * @returns {Promise<ExplanationOut | null>}
 */
async function explanationOf(jobId, targetId, isWanted) {
  const path = `/v1/jobs/${encodeURIComponent(jobId)}/targets/${encodeURIComponent(targetId)}/explanation`;
  while (isWanted()) {
    try {
      return await get(path);
    } catch (error) {
      // It is still being computed.
      if (!(error instanceof Problem && error.status === 503)) throw error;
      await pause(1000);
    }
  }
  return null;
}

/** @param {[string, import("./dom.js").Child][]} facts */
function factsOf(facts) {
  return h("dl", { class: "facts" }, ...facts.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
}

/**
 * @param {import("./geography.js").TargetPlace} known
 * @returns {[string, import("./dom.js").Child][]}
 */
function targetFacts({ title, outcome, reason, why }) {
  /** @type {[string, import("./dom.js").Child][]} */
  const facts = [["Target", h("strong", { id: "selected-target" }, title)], ["Outcome", outcome]];
  if (reason !== null) facts.push(["Reason", reasonName(reason)], ["Why", why]);
  return facts;
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {import("./types.js").Reason} reason
 * @returns {[string, import("./dom.js").Child][]}
 */
function reasonFacts(plan, selection, reason) {
  /** @type {[string, import("./dom.js").Child][]} */
  const facts = [["Certainty", reason.certainty]];
  if (reason.at !== null) facts.push(["At", utcLabelled(reason.at)]);
  if (reason.blocking_actions.length > 0) facts.push(["Blocked by", blockersOf(plan, selection, reason)]);
  if (reason.change !== null) facts.push(["Would let it in", changeOf(plan, reason.change)]);
  return facts;
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./types.js").Action} action
 * @param {string | null} satelliteId
 * @returns {[string, import("./dom.js").Child][]}
 */
function actionFacts(plan, action, satelliteId) {
  const { slew } = action;
  return [
    ["Action", h("strong", { id: "selected-action" }, `${action.id}, ${action.mode}`)],
    ["Satellite", satelliteId && plan.satelliteName(satelliteId)],
    ...(action.station_id ? [/** @type {[string, string]} */ (["Station", action.station_name ?? action.station_id])] : []),
    ["Start", utcLabelled(action.start)],
    ["End", utcLabelled(action.end)],
    ["Pointing", action.off_nadir_deg === null ? "at the sun" : `${number(action.off_nadir_deg)}° off nadir, azimuth ${number(action.azimuth_deg)}°`],
    ["Slew before it", slew ? `${number(slew.angle_deg)}°: ${number(slew.needed_s)} s needed, ${number(slew.available_s)} s available` : "none"],
    ["Reward", number(action.reward)],
    ["Battery after it", percent(action.battery_fraction_end)],
    ["Recorder after it", percent(action.recorder_fraction_end)],
  ];
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {string} targetId
 * @param {OpportunityOut[]} items
 * @param {HTMLElement} place
 */
function tellOpportunities(plan, targetId, items, place) {
  const used = new Set((plan.actionsOf.get(targetId) ?? []).map((id) => plan.actions.get(id)?.opportunity_id));
  const rows = items.slice(0, 100).map((one) =>
    h(
      "tr",
      { class: used.has(one.id) ? "marked" : "" },
      h("td", {}, used.has(one.id) ? "taken" : "unused"),
      h("td", {}, plan.satelliteName(one.satellite_id)),
      h("td", {}, utc(one.start)),
      h("td", {}, utc(one.end)),
      h("td", { class: "number" }, number(one.off_nadir_deg)),
      h("td", { class: "number" }, number(one.sun_elevation_deg)),
      h("td", {}, one.eclipse ? "eclipse" : ""),
    ),
  );
  const heads = ["", "Satellite", "Start (UTC)", "End (UTC)", "Off nadir, °", "Sun, °", "Light"];
  const caption = `Opportunities of ${plan.targetTitle(targetId)}: ${items.length}${items.length > 100 ? ", the first 100 shown" : ""}`;
  fill(
    place,
    h(
      "div",
      { class: "scroll", tabindex: 0, role: "region", "aria-label": caption },
      h("table", {}, h("caption", {}, caption), h("thead", {}, h("tr", {}, ...heads.map((text) => h("th", { scope: "col" }, text)))), h("tbody", {}, ...rows)),
    ),
  );
}
