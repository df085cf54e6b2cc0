// @ts-check
/** The form for a new plan: makes a scenario of the inputs, and sends a job with the chosen solver. */

import { get, list, post } from "./api.js";
import { byId, fill, h, notice } from "./dom.js";
import { chosenForecast, installForecasts } from "./forecast_choice.js";
import { utc } from "./format.js";
import { startPage, whileBusy } from "./page.js";
import { installSatelliteForm } from "./satellite_form.js";
import { aboutOf, titleOf } from "./scenarios.js";
import { SchemaForm } from "./schema_form.js";
import { fillSpacecraft } from "./spacecraft_choice.js";
import { allChoices } from "./uploads.js";

/** @typedef {import("./types.js").ScenarioOut} ScenarioOut */
/** @typedef {import("./types.js").SolverOut} SolverOut */

const HOUR_MS = 3_600_000;
const FRESH_MS = 5 * 24 * HOUR_MS;
const FIRST_CHOICE = "certified";

const choices = allChoices();
/** @type {SolverOut[]} */
let solvers = [];
let params = new SchemaForm("param", {});
let hasOwnStart = false;

/** @param {string} id */
const input = (id) => /** @type {HTMLInputElement} */ (byId(id));

startPage(async () => {
  choices.satellites.onChange = suggestStart;
  input("horizon-start").addEventListener("input", () => {
    hasOwnStart = true;
  });
  for (const radio of document.getElementsByName("source")) radio.addEventListener("change", showSource);
  const { items } = await get("/v1/solvers");
  solvers = items;
  const options = solvers.map((solver) => h("option", { value: solver.name }, solver.name));
  fill(byId("solver"), ...options);
  input("solver").value = solvers.some((solver) => solver.name === FIRST_CHOICE) ? FIRST_CHOICE : solvers[0]?.name ?? "";
  input("solver").addEventListener("change", showSolver);
  showSolver();
  const send = /** @type {HTMLButtonElement} */ (byId("send"));
  send.addEventListener("click", () => whileBusy(send, byId("send-outcome"), sendJob));
  const compare = /** @type {HTMLButtonElement} */ (byId("compare"));
  compare.addEventListener("click", () => whileBusy(compare, byId("send-outcome"), sendComparison));
  await Promise.all([
    ...Object.values(choices).map((choice) => choice.refresh()),
    installSatelliteForm((id) => choices.satellites.add([id])),
    fillSpacecraft(/** @type {HTMLSelectElement} */ (byId("satellites-type"))),
    installForecasts(),
    showScenarios(),
  ]);
});

/** Suggest a start near the orbits' epochs: elements are good for days, not for months. */
function suggestStart() {
  if (hasOwnStart) return;
  const epochs = choices.satellites.chosen().map((one) => Date.parse(one.epoch));
  const newest = Math.max(...epochs);
  const isFresh = epochs.length === 0 || Math.abs(Date.now() - newest) < FRESH_MS;
  const start = Math.ceil((isFresh ? Date.now() : newest) / HOUR_MS) * HOUR_MS;
  input("horizon-start").value = utc(start);
  byId("horizon-about").textContent = isFresh
    ? "The next full hour."
    : "Near the epoch of the newest chosen orbit.";
}

async function showScenarios() {
  /** @type {{items: ScenarioOut[]}} */
  const { items } = await list("/v1/scenarios", 500);
  const choice = input("scenario-choice");
  fill(choice, ...items.map((one) => h("option", { value: one.id }, titleOf(one))));
  const tell = () => {
    const one = items.find((item) => item.id === choice.value);
    byId("scenario-about").textContent = one ? aboutOf(one) : "None stored yet.";
  };
  choice.addEventListener("change", tell);
  const asked = new URLSearchParams(location.hash.slice(1)).get("scenario");
  if (asked && items.some((one) => one.id === asked)) {
    choice.value = asked;
    for (const radio of document.getElementsByName("source")) {
      const box = /** @type {HTMLInputElement} */ (radio);
      box.checked = box.value === "stored";
    }
  }
  tell();
  showSource();
}

function isStored() {
  const chosen = document.querySelector("input[name=source]:checked");
  return /** @type {HTMLInputElement | null} */ (chosen)?.value === "stored";
}

function showSource() {
  byId("stored-scenario").hidden = !isStored();
  byId("new-scenario").hidden = isStored();
}

function showSolver() {
  const solver = solvers.find((one) => one.name === input("solver").value);
  if (!solver) return;
  byId("solver-about").textContent = `${solver.title}: ${solver.description}`;
  params = new SchemaForm("param", solver.params_schema);
  fill(byId("params"), params.element);
}

/** @returns {Promise<string>} the id of the scenario to plan */
async function scenarioId() {
  if (isStored()) {
    const id = input("scenario-choice").value;
    if (!id) throw new Error("No scenario is stored yet: make a new one.");
    return id;
  }
  const chosen = {
    satellite_ids: choices.satellites.chosen().map((one) => one.id),
    target_catalog_ids: choices.targets.chosen().map((one) => one.id),
    ground_station_ids: choices.stations.chosen().map((one) => one.id),
  };
  if (chosen.satellite_ids.length === 0) throw new Error("Choose or upload at least one satellite.");
  if (chosen.target_catalog_ids.length === 0) throw new Error("Choose or upload at least one target catalogue.");
  const start = instantOf(input("horizon-start").value);
  const length = Number(input("horizon-hours").value) * HOUR_MS;
  if (!Number.isFinite(start)) throw new Error("Start: write it as 2026-03-01 00:00:00, in UTC.");
  if (!(length > 0)) throw new Error("Length: enter a number of hours.");
  /** @type {ScenarioOut} */
  const made = await post("/v1/scenarios", {
    name: input("scenario-name").value.trim() || null,
    horizon: { start: new Date(start).toISOString(), end: new Date(start + length).toISOString() },
    ...chosen,
    use_resources: input("use-resources").checked,
    allow_old_elements: input("allow-old").checked,
    collect_spacing_s: spacing(),
    continuous_starts: input("continuous-starts").checked,
    forecast_id: chosenForecast(),
  });
  for (const warning of made.warnings) notice("warn", warning);
  return made.id;
}

/**
 * Parse a UTC instant. A browser's own date field would follow the reader's locale.
 * @param {string} text
 */
function instantOf(text) {
  const parts = /^(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d(?::\d\d(?:\.\d+)?)?) ?(?:Z|UTC)?$/.exec(text.trim());
  return parts === null ? NaN : Date.parse(`${parts[1]}T${parts[2]}Z`);
}

function spacing() {
  const text = input("collect-spacing").value.trim();
  if (text === "") return null;
  if (!(Number(text) > 0)) throw new Error("Seconds between collect starts: enter a positive number, or nothing.");
  return Number(text);
}

function question() {
  const time_s = Number(input("time-s").value);
  return {
    limits: time_s > 0 ? { time_s } : {},
    label: input("label").value.trim() || null,
  };
}

async function sendJob() {
  const solver = { solver: input("solver").value, params: params.values(), seed: Number(input("seed").value) };
  const scenario_id = await scenarioId();
  /** @type {{id: string}} */
  const job = await post("/v1/jobs", { scenario_id, ...question(), ...solver });
  location.assign(`/jobs/${job.id}`);
}

async function sendComparison() {
  const scenario_id = await scenarioId();
  const runs = solvers.map((solver) => ({ solver: solver.name, seed: Number(input("seed").value) }));
  /** @type {{id: string}} */
  const made = await post("/v1/comparisons", { scenario_id, runs, ...question() });
  location.assign(`/comparisons/${made.id}`);
}
