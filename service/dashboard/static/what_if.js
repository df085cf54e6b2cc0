// @ts-check
/** What if: plans the job's scenario with some changes, and shows what would change. */

import { follow, get, post } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { number, targetTitle, utc } from "./format.js";
import { whileBusy } from "./page.js";
import { ProgressText } from "./progress_text.js";
import { whatIfOf } from "./wishes.js";

/** @typedef {import("./types.js").JobOut} JobOut */
/** @typedef {import("./types.js").DiffOut} DiffOut */
/** @typedef {import("./types.js").PlannedOut} PlannedOut */

const MOST_ROWS = 100;
/** The length limit of a job's label. */
const MOST_LETTERS = 200;

/**
 * Let the collected changes be tried together.
 * @param {JobOut} job
 * @param {import("./wishes.js").Wishes} wishes
 */
export function installWhatIf(job, wishes) {
  const button = /** @type {HTMLButtonElement} */ (byId("try"));
  const place = byId("what-if-outcomes");
  byId("what-if-form").addEventListener("submit", (event) => {
    event.preventDefault();
    whileBusy(button, place, async () => {
      if (wishes.all.length === 0) throw new Error("There are no changes yet: choose an action or a target first.");
      const text = wishes.all.map((wish) => wish.text).join(" ");
      const { varied, diff } = await tried(job, { ...whatIfOf(wishes.all), label: `What if: ${text}`.slice(0, MOST_LETTERS) }, place);
      fill(place, ...told(text, varied, diff));
    });
  });
}

/**
 * @param {JobOut} job
 * @param {Record<string, unknown>} change the body of a what-if
 * @param {HTMLElement} place where its progress is shown
 * @returns {Promise<{varied: JobOut, diff: DiffOut}>}
 */
async function tried(job, change, place) {
  const path = `/v1/jobs/${encodeURIComponent(job.id)}`;
  /** @type {JobOut} */
  let varied = await post(`${path}/what-if`, change);
  const progress = new ProgressText(place);
  await follow(varied.id, (now) => {
    varied = now;
    progress.show(now, `What if: ${now.state}${now.progress ? `, ${now.progress.phase}` : ""}`);
  });
  if (varied.state !== "succeeded") throw new Error(varied.error?.detail ?? `The search ended in state ${varied.state}.`);
  return { varied, diff: await get(`${path}/diff/${encodeURIComponent(varied.id)}`) };
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
  const more = rows.length > MOST_ROWS ? `, the first ${MOST_ROWS} shown` : "";
  const caption = h("caption", {}, `${rows.length} changes${more}`);
  const reward = diff.totals.reward;
  return [
    h("p", { class: "hint" }, text),
    h("p", { class: "what-if-outcome" }, reward ? `Reward ${number(reward.before)} → ${number(reward.after)}. ` : "The reward does not change. ",
      h("a", { href: `/jobs/${encodeURIComponent(job.id)}` }, "Open that plan")),
    rows.length > 0 &&
      h("div", { class: "scroll changes", tabindex: 0, role: "region", "aria-label": "What would change" },
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
    h("td", {}, one.target_id === null ? (one.station_name ?? one.station_id) : targetTitle(one.target_id, one.target_name)),
    h("td", {}, one.satellite_name ?? one.satellite_id),
    h("td", {}, was && utc(was)),
    h("td", {}, is && utc(is), was && is && shift(was, is)),
  );
}

/**
 * Return by how much a start moves if that is less than a minute, else "": instants to the second would hardly show it.
 * @param {string} was
 * @param {string} is
 */
function shift(was, is) {
  const shift_s = (Date.parse(is) - Date.parse(was)) / 1000;
  return Math.abs(shift_s) < 60 ? ` (${shift_s > 0 ? "+" : ""}${number(shift_s)} s)` : "";
}
