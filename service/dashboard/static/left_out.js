// @ts-check
/** Targets that the plan leaves out, by reason, and what would let them in. */

import { actionButton, targetButton } from "./buttons.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { OutcomeRows, reasonName } from "./outcomes.js";
import { changeOf } from "./settings.js";
import { PagedTable } from "./table.js";

/** @typedef {import("./types.js").TargetItem} TargetItem */
/** @typedef {import("./types.js").Reason} Reason */

/** @type {Record<string, string>} */
const MEANINGS = {
  no_access: "no satellite can image them within this horizon",
  excluded: "the request itself rules them out",
  outage: "outages take all their opportunities",
  slew_conflict: "not enough time to slew between them and the planned actions",
  displaced_by: "the planned actions in their place earn as much or more",
  battery: "the battery would fall below its limit",
  recorder: "the recorder would rise above its limit",
  not_considered: "the search did not consider them",
  not_delivered: "they could be imaged, but not downlinked in time",
  solver_limit: "there is room for them, but the solver did not find it",
};

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {string} jobPath
 */
export function showLeftOut(plan, selection, jobPath) {
  /** @type {Map<string, string[]>} */
  const groups = new Map();
  for (const { id, reason } of plan.targets) {
    if (reason === null) continue;
    const known = groups.get(reason);
    if (known) known.push(id);
    else groups.set(reason, [id]);
  }
  const ordered = [...groups].sort((a, b) => b[1].length - a[1].length);
  if (ordered.length === 0) {
    fill(byId("left-out"), "None: every target is collected.");
    return;
  }
  fill(byId("left-out"), ...ordered.map(([code, ids]) => group(plan, selection, code, new OutcomeRows(jobPath, code, ids))));
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {string} code
 * @param {OutcomeRows} source
 */
function group(plan, selection, code, source) {
  const table = new PagedTable(
    `Left out: ${MEANINGS[code] ?? reasonName(code)}`,
    [
      { title: "Target", cell: (item) => targetButton(plan, selection, item.target_id) },
      { title: "Certainty", cell: (item) => item.reason?.certainty },
      { title: "Why", cell: (item) => whyOf(item.reason) },
      { title: "Blocking actions", cell: (item) => blockersOf(plan, selection, item.reason) },
      { title: "What would let it in", cell: (item) => changeOf(plan, item.reason?.change ?? null) },
    ],
    (/** @type {TargetItem} */ item) => item.target_id,
  );
  const summary = h(
    "summary",
    {},
    h("strong", {}, reasonName(code)),
    ` ${source.length}`,
    MEANINGS[code] && h("small", {}, ` ${MEANINGS[code]}`),
  );
  const details = h("details", { "data-reason": code }, summary, table.element);
  // Its first page is loaded before it is opened.
  table.showFrom(source);
  selection.onChange(({ targetId }) => {
    const isHere = targetId !== null && plan.target.get(targetId)?.reason === code;
    if (isHere) details.open = true;
    table.mark(new Set(isHere && targetId ? [targetId] : []));
  });
  return details;
}

/** @param {Reason | null} reason */
function whyOf(reason) {
  if (reason === null) return "";
  return reason.at === null ? reason.detail : `${reason.detail} (at ${utc(reason.at)} UTC)`;
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {Reason | null} reason
 */
export function blockersOf(plan, selection, reason) {
  const ids = reason?.blocking_actions ?? [];
  return h("span", {}, ...ids.flatMap((id, i) => [i > 0 && ", ", actionButton(plan, selection, id, plan.actionTitle(id))]));
}
