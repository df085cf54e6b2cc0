// @ts-check
/** The list of jobs, updated live. */

import { FINAL, get, list, pause, post } from "./api.js";
import { bar, byId, fill, h } from "./dom.js";
import { duration, gapOf, number, percent, secondsBetween, short, utc } from "./format.js";
import { showError, startPage } from "./page.js";
import { nameOf } from "./scenarios.js";
import { stateBadge } from "./state.js";

/** @typedef {import("./types.js").JobOut} JobOut */
/** @typedef {import("./types.js").ComparisonOut} ComparisonOut */

const PAGE = 50;
const MOST_OFFERED = 2000;
const WHILE_ACTIVE_MS = 1000;
const WHILE_QUIET_MS = 5000;

/** @type {Map<string, {told: string, row: HTMLTableRowElement}>} */
const rows = new Map();
let numWanted = PAGE;

startPage(async () => {
  const solvers = await get("/v1/solvers");
  for (const solver of solvers.items) byId("filter-solver").append(h("option", {}, solver.name));
  await Promise.all([offer("satellite_id", "/v1/satellites"), offer("station_id", "/v1/ground-stations")]);
  byId("filters").addEventListener("change", refresh);
  byId("more-jobs").addEventListener("click", () => {
    numWanted += PAGE;
    return refresh();
  });
  for (;;) {
    const isActive = await refresh().catch((error) => {
      if (rows.size === 0) showError(error);
      return false;
    });
    await pause(isActive ? WHILE_ACTIVE_MS : WHILE_QUIET_MS);
    while (document.hidden) await pause(WHILE_ACTIVE_MS);
  }
});

/**
 * Offer the stored items in a filter, by name.
 * @param {string} name of the filter
 * @param {string} path
 */
async function offer(name, path) {
  const { items } = await list(path, MOST_OFFERED);
  items.sort((/** @type {{name: string}} */ a, b) => a.name.localeCompare(b.name));
  byId(`filter-${name}`).append(...items.map((one) => h("option", { value: one.id }, one.name)));
}

/** @returns {Promise<boolean>} whether a job is in progress */
async function refresh() {
  const query = new URLSearchParams({ limit: String(Math.min(numWanted, 500)) });
  for (const name of ["state", "solver", "satellite_id", "station_id"]) {
    const { value } = /** @type {HTMLSelectElement} */ (byId(`filter-${name}`));
    if (value) query.set(name, value);
  }
  /** @type {{items: JobOut[], next: string | null}} */
  const page = await get(`/v1/jobs?${query}`);
  const lines = await Promise.all(page.items.map(rowOf));
  const body = byId("jobs").querySelector("tbody");
  if (body) place(body, lines);
  byId("jobs-empty").hidden = page.items.length > 0;
  byId("more-jobs").hidden = page.next === null || numWanted >= 500;
  await showComparisons();
  return page.items.some((job) => !FINAL.has(job.state));
}

/**
 * Show rows in this order, without touching those in place already: focus stays.
 * @param {HTMLElement} body
 * @param {HTMLElement[]} lines
 */
function place(body, lines) {
  lines.forEach((line, at) => {
    if (body.children[at] !== line) body.insertBefore(line, body.children[at] ?? null);
  });
  while (body.children.length > lines.length) body.lastElementChild?.remove();
}

/** @param {JobOut} job */
async function rowOf(job) {
  const told = JSON.stringify(job);
  const before = rows.get(job.id);
  const isTicking = job.state === "running";
  if (before && before.told === told && !isTicking) return before.row;
  const row = before?.row ?? h("tr", { "data-job": job.id });
  const hadFocus = row.contains(document.activeElement);
  fill(row, ...(await cellsOf(job)));
  if (hadFocus) row.querySelector("a")?.focus();
  rows.set(job.id, { told, row });
  return row;
}

/** @param {JobOut} job */
async function cellsOf(job) {
  const { progress } = job;
  const seconds = secondsBetween(job.started_at, job.finished_at);
  const cells = [
    h("td", {}, stateBadge(job)),
    h("th", { scope: "row" }, h("a", { href: `/jobs/${job.id}` }, job.label ?? short(job.id))),
    h("td", {}, job.solver),
    h("td", {}, await nameOf(job.scenario.id)),
    h("td", {}, ...progressOf(job)),
    h("td", { class: "number" }, number(progress?.reward)),
    h("td", { class: "number" }, number(progress?.bound)),
    h("td", { class: "number" }, percent(gapOf(progress?.reward, progress?.bound))),
    h("td", {}, utc(job.created_at)),
    h("td", { class: "number" }, duration(seconds)),
    h("td", {}, !FINAL.has(job.state) && job.state !== "cancelling" && cancelButton(job)),
  ];
  return cells;
}

/** @param {JobOut} job */
function progressOf(job) {
  if (job.error) return [job.error.detail];
  if (job.state === "running" && job.progress) {
    const { phase, fraction } = job.progress;
    return [bar(fraction, `${phase}, fraction done`), ` ${phase}`];
  }
  return [job.termination?.replaceAll("_", " ")];
}

/** @param {JobOut} job */
function cancelButton(job) {
  const onclick = async () => {
    await post(`/v1/jobs/${job.id}/cancel`);
    await refresh();
  };
  const label = `Cancel job ${job.label ?? short(job.id)}`;
  const attributes = { type: "button", class: "quiet needs-submit", "aria-label": label, onclick };
  return h("button", attributes, "Cancel");
}

async function showComparisons() {
  /** @type {{items: ComparisonOut[]}} */
  const { items } = await get("/v1/comparisons?limit=20");
  byId("comparisons-section").hidden = items.length === 0;
  const body = byId("comparisons").querySelector("tbody");
  if (body) fill(body, ...(await Promise.all(items.map(comparisonRow))));
}

/** @param {ComparisonOut} one */
async function comparisonRow(one) {
  const rewards = one.runs.map((run) => run.reward ?? -Infinity);
  const best = Math.max(...rewards);
  const link = h("a", { href: `/comparisons/${one.id}` }, one.label ?? short(one.id));
  return h(
    "tr",
    {},
    h("td", {}, h("span", { class: `state ${one.state}` }, one.state)),
    h("th", { scope: "row" }, link),
    h("td", {}, await nameOf(one.scenario.id)),
    h("td", {}, one.runs.map((run) => run.solver).join(", ")),
    h("td", { class: "number" }, number(best)),
    h("td", {}, utc(one.created_at)),
  );
}
