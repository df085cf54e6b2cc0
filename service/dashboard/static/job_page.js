// @ts-check
/** One job: followed while it runs, then its answer in linked panels. */

import { call, FINAL, follow, get, post } from "./api.js";
import { CurveChart } from "./curves.js";
import { byId, fill, h } from "./dom.js";
import { duration, gapOf, number, percent, secondsBetween, short, utc, utcLabelled } from "./format.js";
import { Gantt } from "./gantt.js";
import { loadGeography, loadLand } from "./geography.js";
import { showLeftOut } from "./left_out.js";
import { WorldMap } from "./map.js";
import { lanesOf, opportunitiesOf } from "./opportunities.js";
import { showError, startPage } from "./page.js";
import { Plan } from "./plan.js";
import { showTables } from "./plain_tables.js";
import { ProgressChart } from "./progress_chart.js";
import { aboutOf, scenario, titleOf } from "./scenarios.js";
import { Selection } from "./selection.js";
import { watchSelection } from "./selected.js";
import { stateBadge } from "./state.js";
import { showSummary } from "./summary.js";
import { TimeView } from "./time_view.js";
import { installWhatIf } from "./what_if.js";
import { WishDesk } from "./wish_desk.js";
import { Wishes } from "./wishes.js";

/** @typedef {import("./types.js").JobOut} JobOut */

const jobId = decodeURIComponent(location.pathname.split("/").pop() ?? "");
const jobPath = `/v1/jobs/${encodeURIComponent(jobId)}`;

startPage(async () => {
  /** @type {ProgressChart | null} */
  let chart = null;
  /** @type {JobOut | null} */
  let last = null;
  installButtons();
  await follow(jobId, (job) => {
    if (last === null) showQuestion(job);
    last = job;
    showState(job);
    byId("progress-card").hidden = FINAL.has(job.state) && chart === null;
    if (!byId("progress-card").hidden) {
      chart ??= new ProgressChart();
      chart.show(job);
      // A job that ended at once has no progress to show.
      if (FINAL.has(job.state)) byId("progress-card").hidden = chart.points.length < 3;
    }
  });
  const job = /** @type {JobOut | null} */ (last);
  // A cancelled job has an answer if its search had begun: it then has a termination.
  if (job && job.termination !== null) await showAnswer(job);
  if (job) await showOthers(job);
});

function installButtons() {
  byId("cancel").addEventListener("click", () => post(`${jobPath}/cancel`).catch(showError));
  byId("take").addEventListener("click", async () => {
    /** @type {import("./types.js").PlanOut} */
    const plan = await post("/v1/plans", { job_id: jobId });
    location.assign(`/plans/${plan.id}`);
  });
  byId("rerun").addEventListener("click", async () => {
    /** @type {JobOut} */
    const again = await post(`${jobPath}/rerun`);
    location.assign(`/jobs/${again.id}`);
  });
}

/** @param {JobOut} job */
async function showQuestion(job) {
  document.title = `${job.label ?? short(job.id)} - Slewline`;
  byId("job-title").textContent = `${job.label ?? `Job ${short(job.id)}`}: ${job.solver}`;
  byId("compare").addEventListener("click", async () => {
    const { items } = await get("/v1/solvers");
    const runs = items.map((/** @type {{name: string}} */ solver) => ({ solver: solver.name, seed: job.seed }));
    /** @type {{id: string}} */
    const made = await post("/v1/comparisons", { scenario_id: job.scenario.id, runs });
    location.assign(`/comparisons/${made.id}`);
  });
  const question = await scenario(job.scenario.id);
  if (question) byId("job-about").textContent = `${titleOf(question)}: ${aboutOf(question)}`;
}

/** @param {JobOut} job */
function showState(job) {
  const isFinal = FINAL.has(job.state);
  fill(
    byId("job-state"),
    stateBadge(job),
    h("small", {}, ` since ${utcLabelled(job.finished_at ?? job.started_at ?? job.created_at)}`),
    job.attempt > 1 && h("small", {}, ` attempt ${job.attempt}`),
    job.error && h("p", { class: "notice bad", role: "alert" }, job.error.detail),
  );
  byId("cancel").hidden = isFinal || job.state === "cancelling";
  byId("rerun").hidden = !isFinal;
  // Another solver, parameters or time limit for the same scenario: after a search ran out of time, for example.
  byId("other-settings").hidden = !isFinal;
  byId("other-settings").setAttribute("href", `/new#scenario=${encodeURIComponent(job.scenario.id)}`);
  byId("take").hidden = job.state !== "succeeded";
  byId("compare").hidden = !isFinal;
}

/** @param {JobOut} job */
async function showAnswer(job) {
  // Each document is requested once: the tables use the map's targets too.
  const asked = Promise.all([loadGeography(jobPath), loadLand()]);
  asked.catch(() => {}); // reported where it is awaited
  const plan = new Plan(/** @type {any} */ (await get(`${jobPath}/timeline.json`)));
  const view = new TimeView(plan.start, plan.end);
  const selection = new Selection();
  byId("answer").hidden = false;
  const gantt = new Gantt(byId("gantt"), plan, view, selection);
  showCurves(plan, view, selection);
  installTools(view, plan);
  installUnused(plan, job, gantt);
  showSummary(plan, selection);
  const wishes = new Wishes();
  const desk = new WishDesk(plan, selection, wishes, (offer) => isTried(offer, selection));
  watchSelection(plan, selection, job, gantt, desk);
  installWhatIf(job, wishes);
  const [geography, land] = await asked;
  plan.setTargets(geography.targets);
  await frame();
  byId("map-credit").textContent = `${land.credit}. Drag to move, Ctrl and wheel or + and - to zoom.`;
  new WorldMap(byId("map"), geography, land.rings, plan, view, selection);
  await frame();
  showLeftOut(plan, selection, jobPath);
  showTables(plan, selection);
  installDownload();
}

/**
 * Return whether a what-if supports an offer: outages need a replan, and an image in the plan is promised by its pin.
 * @param {import("./offers.js").Offer} offer
 * @param {Selection} selection
 */
function isTried({ wish }, selection) {
  return wish?.kind !== "outage" && !(wish?.kind === "promise" && selection.now.actionId !== null);
}

/** Let the browser draw and handle events between two pieces of work. */
function frame() {
  return new Promise((resolve) => setTimeout(resolve));
}

/**
 * @param {Plan} plan
 * @param {TimeView} view
 * @param {Selection} selection
 */
function showCurves(plan, view, selection) {
  const hasCurves = plan.rows.some((row) => row.curves !== null);
  byId("curves-place").hidden = !hasCurves;
  if (!hasCurves) return;
  const chart = new CurveChart(byId("curves"), plan, view, selection);
  const choice = /** @type {HTMLSelectElement} */ (byId("curves-satellite"));
  fill(choice, ...plan.rows.map((row, i) => h("option", { value: i }, row.name)));
  choice.addEventListener("change", () => chart.choose(Number(choice.value)));
  selection.onChange(({ satelliteId }) => {
    const row = plan.rows.findIndex((one) => one.id === satelliteId);
    if (row < 0) return;
    choice.value = String(row);
    chart.choose(row);
  });
}

/**
 * @param {TimeView} view
 * @param {Plan} plan
 */
function installTools(view, plan) {
  byId("zoom-in").addEventListener("click", () => view.zoom(0.5));
  byId("zoom-out").addEventListener("click", () => view.zoom(2));
  byId("zoom-all").addEventListener("click", () => view.all());
  const now = byId("go-now");
  now.hidden = Date.now() < plan.start || Date.now() > plan.end;
  now.addEventListener("click", () => view.set(Date.now() - 3_600_000, Date.now() + 7_200_000));
  const tell = () => {
    byId("view-span").textContent = `Shown: ${utc(view.start)} to ${utc(view.end)} UTC`;
  };
  view.onChange(tell);
  tell();
}

/**
 * @param {Plan} plan
 * @param {JobOut} job
 * @param {Gantt} gantt
 */
function installUnused(plan, job, gantt) {
  const choice = /** @type {HTMLSelectElement} */ (byId("unused"));
  const status = byId("unused-status");
  choice.append(...plan.rows.map((row) => h("option", { value: row.id }, row.name)));
  choice.addEventListener("change", async () => {
    const { value } = choice;
    gantt.opportunities.clear();
    gantt.canvas.redraw();
    status.textContent = "";
    if (!value) return;
    const tell = (/** @type {number} */ count) => {
      status.textContent = `${count} loaded`;
    };
    const { items, isAll } = await opportunitiesOf(job.scenario.id, { satellite_id: value }, tell);
    if (choice.value !== value) return;
    const used = new Set([...plan.actions.values()].map((action) => action.opportunity_id));
    const unused = items.filter((one) => !used.has(one.id));
    gantt.opportunities = lanesOf(unused);
    gantt.canvas.redraw();
    status.textContent = `${unused.length} unused${isAll ? "" : ` among the first ${items.length}`}`;
  });
}

async function installDownload() {
  const choice = /** @type {HTMLSelectElement} */ (byId("download-form"));
  fill(choice, ...(await forms()).map((form) => h("option", { value: form }, form)));
  byId("download-place").hidden = false;
  byId("download").addEventListener("click", async () => {
    // Fetched rather than linked to, since a link cannot carry the key.
    const response = await call(`${jobPath}/timeline.${choice.value}`);
    const url = URL.createObjectURL(await response.blob());
    h("a", { href: url, download: `timeline-${short(jobId)}.${choice.value}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  });
}

/** @returns {Promise<string[]>} the formats in which the service offers timelines */
async function forms() {
  /** @type {{paths: Record<string, {get: {parameters: {name: string, schema: {examples?: string[]}}[]}}>}} */
  const document = await get("/openapi.json");
  const parameters = document.paths["/v1/jobs/{job_id}/timeline.{suffix}"]?.get.parameters ?? [];
  return parameters.find((one) => one.name === "suffix")?.schema.examples ?? ["json"];
}

/** @param {JobOut} job */
async function showOthers(job) {
  /** @type {{items: JobOut[]}} */
  const { items } = await get(`/v1/jobs?scenario_id=${encodeURIComponent(job.scenario.id)}&limit=50`);
  byId("answer").hidden = false;
  const heads = ["Job", "Solver", "State", "Reward", "Bound", "Gap", "Time"];
  const rows = items.map((one) => {
    const { progress } = one;
    const isThis = one.id === job.id;
    return h(
      "tr",
      { class: isThis ? "marked" : "" },
      h("th", { scope: "row" }, isThis ? "this one" : h("a", { href: `/jobs/${one.id}` }, one.label ?? short(one.id))),
      h("td", {}, one.solver),
      h("td", {}, stateBadge(one)),
      h("td", { class: "number" }, number(progress?.reward)),
      h("td", { class: "number" }, number(progress?.bound)),
      h("td", { class: "number" }, percent(gapOf(progress?.reward, progress?.bound))),
      h("td", { class: "number" }, duration(secondsBetween(one.started_at, one.finished_at))),
    );
  });
  fill(
    byId("others"),
    h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((text) => h("th", { scope: "col" }, text)))), h("tbody", {}, ...rows))),
  );
}
