// @ts-check
/** What if: the job's question with one change, and what would come of it. */

import { follow, get, post } from "./api.js";
import { fill, h } from "./dom.js";
import { number, utc } from "./format.js";
import { whileBusy } from "./page.js";

/** @typedef {import("./types.js").JobOut} JobOut */
/** @typedef {import("./types.js").DiffOut} DiffOut */
/** @typedef {import("./types.js").PlannedOut} PlannedOut */

const MOST_ROWS = 100;

/**
 * Return a button that tries a change, and shows below it what that comes to.
 * @param {JobOut} job
 * @param {string} text
 * @param {Record<string, unknown>} change the body of a what-if
 * @param {HTMLElement} place
 */
export function whatIfButton(job, text, change, place) {
  const button = h("button", { type: "button", class: "what-if" }, text);
  button.addEventListener("click", () =>
    whileBusy(button, place, async () => {
      const path = `/v1/jobs/${encodeURIComponent(job.id)}`;
      /** @type {JobOut} */
      let last = await post(`${path}/what-if`, { ...change, label: text.slice(0, 64) });
      await follow(last.id, (told) => {
        last = told;
        fill(place, h("p", { class: "hint" }, `${text}: ${told.state}${told.progress ? `, ${told.progress.phase}` : ""}`));
      });
      if (last.state !== "succeeded") throw new Error(last.error?.detail ?? `The search ended as ${last.state}.`);
      /** @type {DiffOut} */
      const diff = await get(`${path}/diff/${encodeURIComponent(last.id)}`);
      fill(place, ...told(text, last, diff));
    }),
  );
  return button;
}

/**
 * @param {string} text
 * @param {JobOut} job
 * @param {DiffOut} diff
 */
function told(text, job, diff) {
  const rows = [
    ...diff.removed.map((one) => row("removed", one, one.start, null)),
    ...diff.moved.map(({ before, after }) => row("moved", after, before.start, after.start)),
    ...diff.added.map((one) => row("added", one, null, one.start)),
  ];
  const heads = ["Change", "Target or station", "Satellite", "Is (UTC)", "Would be (UTC)"];
  const head = h("tr", {}, ...heads.map((title) => h("th", { scope: "col" }, title)));
  const more = rows.length > MOST_ROWS ? `, the first ${MOST_ROWS}` : "";
  const caption = h("caption", {}, `${text}: ${rows.length} changes${more}`);
  const reward = diff.totals.reward;
  return [
    h("p", { class: "what-if-outcome" }, reward ? `Reward ${number(reward.before)} → ${number(reward.after)}. ` : "The reward stays as it is. ",
      h("a", { href: `/jobs/${encodeURIComponent(job.id)}` }, "Open that plan")),
    rows.length > 0 &&
      h("div", { class: "scroll changes", tabindex: 0, role: "region", "aria-label": `${text}: changes` },
        h("table", {}, caption, h("thead", {}, head), h("tbody", {}, ...rows.slice(0, MOST_ROWS)))),
  ];
}

/**
 * @param {string} change
 * @param {PlannedOut} one
 * @param {string | null} was
 * @param {string | null} is
 */
function row(change, one, was, is) {
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, change),
    h("td", {}, one.target_id ?? one.station_name ?? one.station_id),
    h("td", {}, one.satellite_name ?? one.satellite_id),
    h("td", {}, was && utc(was)),
    h("td", {}, is && utc(is), was && is && shift(was, is)),
  );
}

/**
 * Say by how much a start moves, where instants to the second would not show it.
 * @param {string} was
 * @param {string} is
 */
function shift(was, is) {
  const shift_s = (Date.parse(is) - Date.parse(was)) / 1000;
  return Math.abs(shift_s) < 60 ? ` (${shift_s > 0 ? "+" : ""}${number(shift_s)} s)` : "";
}
