// @ts-check
/** Targets that the plan leaves out, by reason, and what would let them in. */

import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { actionButton, targetButton } from "./summary.js";
import { PagedTable } from "./table.js";

/** @typedef {import("./types.js").TargetItem} TargetItem */
/** @typedef {import("./types.js").Reason} Reason */

/** @type {Record<string, string>} */
const MEANINGS = {
  no_access: "no satellite can take them in this horizon",
  excluded: "the request itself rules them out",
  slew_conflict: "no time to turn between them and what is planned",
  displaced_by: "what is planned instead earns as much or more",
  battery: "the battery would fall below its limit",
  recorder: "the recorder would rise above its limit",
  not_considered: "the search did not look at them",
  solver_limit: "there is room, but the solver did not find it",
  duplicate: "taken already",
};

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 */
export function showLeftOut(plan, selection) {
  /** @type {Map<string, TargetItem[]>} */
  const groups = new Map();
  for (const item of plan.targets) {
    if (item.reason === null) continue;
    groups.set(item.reason.code, [...(groups.get(item.reason.code) ?? []), item]);
  }
  const ordered = [...groups].sort((a, b) => b[1].length - a[1].length);
  if (ordered.length === 0) {
    fill(byId("left-out"), "None: every target is collected.");
    return;
  }
  fill(byId("left-out"), ...ordered.map(([code, items]) => group(plan, selection, code, items)));
}

/**
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {string} code
 * @param {TargetItem[]} items
 */
function group(plan, selection, code, items) {
  const table = new PagedTable(
    `Targets left out for ${code.replaceAll("_", " ")}`,
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
    h("strong", {}, code.replaceAll("_", " ")),
    ` ${items.length}`,
    MEANINGS[code] && h("small", {}, ` ${MEANINGS[code]}`),
  );
  const details = h("details", { "data-reason": code }, summary, table.element);
  let isFilled = false;
  const open = () => {
    if (!isFilled) table.show(items);
    isFilled = true;
  };
  details.addEventListener("toggle", open);
  addEventListener("beforeprint", open);
  selection.onChange(({ targetId }) => {
    const isHere = targetId !== null && plan.target.get(targetId)?.reason?.code === code;
    if (isHere) {
      open();
      details.open = true;
    }
    if (isFilled) table.mark(new Set(isHere && targetId ? [targetId] : []));
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
  return h("span", {}, ...ids.flatMap((id) => [actionButton(plan, selection, id), " "]));
}

/**
 * Say a change in words, whatever fields it has.
 * @param {import("./plan.js").Plan} plan
 * @param {Record<string, unknown> | null} change
 */
export function changeOf(plan, change) {
  if (change === null) return "";
  const parts = [];
  for (const [name, value] of Object.entries(change)) {
    if (value === null || name === "opportunity_id") continue;
    if (name === "satellite_id") parts.push(`on ${plan.satelliteName(String(value))}`);
    else if (name === "drop_actions") parts.push(`drop ${/** @type {string[]} */ (value).join(", ")}`);
    else if (typeof value !== "object") parts.push(`${name} = ${value}`);
    else parts.push(`${name}: ${JSON.stringify(value)}`);
  }
  return parts.join(", ");
}
