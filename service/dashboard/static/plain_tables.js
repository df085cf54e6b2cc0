// @ts-check
/** The data of all pictures as tables, for keyboards and screen readers; open ones are printed. */

import { actionButton, targetButton } from "./buttons.js";
import { byId, fill, h } from "./dom.js";
import { number, percent, utc } from "./format.js";
import { reasonName } from "./outcomes.js";
import { spanOf } from "./plan.js";
import { PagedTable } from "./table.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Row} Row */
/** @typedef {import("./selection.js").Selection} Selection */
/** @typedef {import("./types.js").Action} Action */
/** @typedef {import("./geography.js").TargetPlace} TargetPlace */

/**
 * @param {Plan} plan
 * @param {Selection} selection
 */
export function showTables(plan, selection) {
  const satellites = plan.timeline.satellites.map((satellite) => {
    const about = `Actions of ${satellite.name}`;
    return section(about, satellite.actions.length, () => {
      const table = actionTable(plan, selection, about);
      table.show(satellite.actions);
      markSelected(table, selection, ({ actionId }) => actionId);
      return table.element;
    });
  });
  const curves = plan.rows.filter((row) => row.curves !== null).map(curveSection);
  const eclipses = plan.rows.filter((row) => row.eclipses.start.length > 0).map(eclipseSection);
  const targets = section("All targets", plan.targets.length, () => targetTable(plan, selection));
  fill(
    byId("tables"),
    targets,
    group("Actions", satellites),
    group("Battery and recorder", curves),
    group("Eclipses", eclipses),
  );
}

/**
 * @param {string} title
 * @param {HTMLElement[]} sections
 */
function group(title, sections) {
  if (sections.length < 2) return sections[0];
  const about = `${title} of ${sections.length} satellites`;
  return h("details", { class: "group" }, h("summary", {}, about), ...sections);
}

/**
 * Return a folded section whose table is made when it is opened.
 * @param {string} title
 * @param {number} count
 * @param {() => HTMLElement} make
 */
function section(title, count, make) {
  const details = h("details", {}, h("summary", {}, `${title} (${count})`));
  let isMade = false;
  details.addEventListener("toggle", () => {
    if (!isMade) details.append(make());
    isMade = true;
  });
  return details;
}

/**
 * @param {Plan} plan
 * @param {Selection} selection
 * @param {string} caption
 * @returns {PagedTable<Action>}
 */
function actionTable(plan, selection, caption) {
  return new PagedTable(
    caption,
    [
      { title: "Action", cell: (a) => actionButton(plan, selection, a.id) },
      { title: "Mode", cell: (a) => a.mode },
      { title: "Start (UTC)", cell: (a) => utc(a.start) },
      { title: "End (UTC)", cell: (a) => utc(a.end) },
      { title: "Length, s", cell: (a) => number((spanOf(a).end - spanOf(a).start) / 1000), isNumber: true },
      { title: "Target or station", cell: (a) => targetButton(plan, selection, a.target_id) || (a.station_name ?? a.station_id) },
      { title: "Off nadir, °", cell: (a) => number(a.off_nadir_deg), isNumber: true },
      { title: "Slew, °", cell: (a) => number(a.slew?.angle_deg), isNumber: true },
      { title: "Slew needed, s", cell: (a) => number(a.slew?.needed_s), isNumber: true },
      { title: "Slew available, s", cell: (a) => number(a.slew?.available_s), isNumber: true },
      { title: "Reward", cell: (a) => number(a.reward), isNumber: true },
      { title: "Battery after", cell: (a) => percent(a.battery_fraction_end), isNumber: true },
      { title: "Recorder after", cell: (a) => percent(a.recorder_fraction_end), isNumber: true },
    ],
    (/** @type {Action} */ action) => action.id,
  );
}

/**
 * @param {Plan} plan
 * @param {Selection} selection
 */
function targetTable(plan, selection) {
  const table = new PagedTable(
    "All targets of the scenario",
    [
      { title: "Target", cell: (one) => targetButton(plan, selection, one.id) },
      { title: "Outcome", cell: (one) => one.outcome },
      { title: "Satellite", cell: (one) => one.satelliteId && plan.satelliteName(one.satelliteId) },
      { title: "Action", cell: (one) => one.actionId && actionButton(plan, selection, one.actionId) },
      { title: "Start (UTC)", cell: (one) => utc(plan.actions.get(one.actionId ?? "")?.start) },
      { title: "Reason", cell: (one) => one.reason && reasonName(one.reason) },
      { title: "Why", cell: (one) => one.why },
    ],
    (/** @type {TargetPlace} */ one) => one.id,
  );
  table.show(plan.targets);
  markSelected(table, selection, ({ targetId }) => targetId);
  return h("div", {}, targetFilter(plan, table), table.element);
}

/**
 * Return fields that filter the table of targets.
 * @param {Plan} plan
 * @param {PagedTable<TargetPlace>} table
 */
function targetFilter(plan, table) {
  const find = h("input", { type: "search", id: "target-find" });
  const outcome = choiceOf("outcome", plan.targets.map((one) => one.outcome));
  const reason = choiceOf("reason", plan.targets.map((one) => one.reason));
  const count = h("span", { role: "status", id: "target-count" });
  find.addEventListener("keydown", (event) => {
    if (event.key === "Enter") /** @type {HTMLElement | null} */ (table.body.querySelector("button"))?.click();
  });
  const narrow = () => {
    const text = find.value.trim().toLowerCase();
    const found = plan.targets.filter(
      (one) =>
        (!text || one.title.toLowerCase().includes(text)) &&
        (!outcome.value || one.outcome === outcome.value) &&
        (!reason.value || one.reason === reason.value),
    );
    table.show(found);
    count.textContent = `${found.length} of ${plan.targets.length}`;
  };
  for (const field of [find, outcome, reason]) field.addEventListener("input", narrow);
  return h(
    "div",
    { class: "row tools" },
    h("label", {}, "Name or id ", find),
    h("label", {}, "Outcome ", outcome),
    h("label", {}, "Reason ", reason),
    count,
  );
}

/**
 * @param {string} what
 * @param {(string | null)[]} values
 */
function choiceOf(what, values) {
  const known = [...new Set(values.filter((value) => value !== null))].sort();
  const options = known.map((value) => h("option", { value }, reasonName(value)));
  return h("select", { id: `target-${what}` }, h("option", { value: "" }, "any"), ...options);
}

/**
 * Keep the selected row marked, also if it was selected before the table was made.
 * @param {PagedTable<any>} table
 * @param {Selection} selection
 * @param {(selected: import("./selection.js").Selected) => string | null} keyOf
 */
function markSelected(table, selection, keyOf) {
  const mark = (/** @type {import("./selection.js").Selected} */ selected) => {
    const key = keyOf(selected);
    table.mark(new Set(key === null ? [] : [key]));
  };
  selection.onChange(mark);
  mark(selection.now);
}

/** @param {Row} row */
function curveSection(row) {
  const { curves } = row;
  const count = curves?.time.length ?? 0;
  return section(`Battery and recorder of ${row.name}`, count, () => {
    const table = new PagedTable(
      `Battery and recorder of ${row.name}; limits ${percent(curves?.batteryMin)} and ${percent(curves?.recorderMax)}`,
      [
        { title: "Time (UTC)", cell: (i) => utc(curves?.time[i]) },
        { title: "Battery", cell: (i) => percent(curves?.battery[i]), isNumber: true },
        { title: "Recorder", cell: (i) => percent(curves?.recorder[i]), isNumber: true },
      ],
      (/** @type {number} */ i) => String(i),
    );
    table.show(Array.from({ length: count }, (_, i) => i));
    return table.element;
  });
}

/** @param {Row} row */
function eclipseSection(row) {
  const { start, end } = row.eclipses;
  return section(`Eclipses of ${row.name}`, start.length, () => {
    const table = new PagedTable(
      `Eclipses of ${row.name}`,
      [
        { title: "Start (UTC)", cell: (i) => utc(start[i]) },
        { title: "End (UTC)", cell: (i) => utc(end[i]) },
      ],
      (/** @type {number} */ i) => String(i),
    );
    table.show(Array.from({ length: start.length }, (_, i) => i));
    return table.element;
  });
}
