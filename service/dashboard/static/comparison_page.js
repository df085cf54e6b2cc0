// @ts-check
/** Several solvers on one scenario, in a table that fills as they finish. */

import { get, pause } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { number, percent, short } from "./format.js";
import { startPage } from "./page.js";
import { aboutOf, scenario, titleOf } from "./scenarios.js";
import { stateBadge } from "./state.js";

/** @typedef {import("./types.js").ComparisonOut} ComparisonOut */
/** @typedef {import("./types.js").ComparedRun} ComparedRun */

const ASK_MS = 1000;

startPage(async () => {
  const id = location.pathname.split("/").pop() ?? "";
  for (let isFirst = true; ; isFirst = false) {
    /** @type {ComparisonOut} */
    const one = await get(`/v1/comparisons/${encodeURIComponent(id)}`);
    if (isFirst) await showScenario(one);
    show(one);
    if (one.state === "finished") return;
    await pause(ASK_MS);
  }
});

/** @param {ComparisonOut} one */
async function showScenario(one) {
  byId("comparison-title").textContent = `Comparison ${one.label ?? short(one.id)}`;
  const question = await scenario(one.scenario.id);
  const text = question ? `${titleOf(question)}: ${aboutOf(question)}` : "";
  fill(byId("comparison-about"), text, " ", h("a", { href: `/new#scenario=${one.scenario.id}` }, "Plan it again"));
}

/** @param {ComparisonOut} one */
function show(one) {
  const largest = Math.max(...one.runs.map((run) => boundOf(run) ?? rewardOf(run) ?? 0), 1e-9);
  const body = byId("runs").querySelector("tbody");
  if (body) fill(body, ...one.runs.map((run) => line(run, largest)));
  byId("runs").dataset.state = one.state;
}

/** @param {ComparedRun} run */
function rewardOf(run) {
  return run.reward ?? run.progress?.reward ?? null;
}

/** @param {ComparedRun} run */
function boundOf(run) {
  return run.bound ?? run.progress?.bound ?? null;
}

/**
 * @param {ComparedRun} run
 * @param {number} largest
 */
function line(run, largest) {
  const reward = rewardOf(run);
  const numeric = (/** @type {string} */ text) => h("td", { class: "number" }, text);
  const label = `${run.solver}: reward ${number(reward)}`;
  const meter = h("meter", { min: 0, max: largest, value: reward ?? 0, "aria-label": label });
  const validity = run.validity === null ? (run.error?.detail ?? "") : run.validity;
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, run.solver),
    h("td", {}, stateBadge(run)),
    h("td", {}, meter),
    numeric(number(reward)),
    numeric(number(boundOf(run))),
    numeric(percent(run.gap)),
    numeric(number(run.collects, 0)),
    numeric(number(run.contacts, 0)),
    numeric(number(run.downlinked_mbit, 0)),
    numeric(number(run.downlinked_fraction, 2)),
    numeric(number(run.solve_s, 2)),
    numeric(number(run.runtime_s, 2)),
    h("td", {}, validity),
    h("td", {}, h("a", { href: `/jobs/${run.job_id}` }, "Open")),
  );
}
