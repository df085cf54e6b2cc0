// @ts-check
/** The clear-sky forecast that a scenario includes, and the upload of one. */

import { list, upload } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { describe } from "./page.js";

/** @typedef {import("./types.js").ForecastOut} ForecastOut */

const SHOWN = 500;
const NETCDF = new Set(["nc", "nc4", "cdf", "netcdf", "h5"]);

/** Fill the choice, and accept files. */
export async function installForecasts() {
  const input = /** @type {HTMLInputElement} */ (byId("forecast-file"));
  input.addEventListener("change", () => take(input));
  await refresh("");
}

/** @returns {string | null} the id of the forecast to plan with */
export function chosenForecast() {
  return choice().value || null;
}

function choice() {
  return /** @type {HTMLSelectElement} */ (byId("forecast-choice"));
}

/** @param {string} id of the forecast to choose */
async function refresh(id) {
  /** @type {{items: ForecastOut[]}} */
  const { items } = await list("/v1/forecasts", SHOWN);
  const none = h("option", { value: "" }, "none: every sky counts as clear");
  fill(choice(), none, ...items.map((one) => h("option", { value: one.id }, `${one.name}: ${spanOf(one)}`)));
  choice().value = id;
}

/** @param {ForecastOut} one */
function spanOf(one) {
  return `${utc(one.first)} to ${utc(one.last)} UTC`;
}

/** @param {HTMLInputElement} input */
async function take(input) {
  const [file] = input.files ?? [];
  if (!file) return;
  const outcome = byId("forecast-outcome");
  fill(outcome, `Sending ${file.name} ...`);
  try {
    const one = await send(file);
    await refresh(one.id);
    const what = one.num_targets === null ? `A grid of ${one.num_values} values` : `${one.num_values} values of ${one.num_targets} targets`;
    const told = [`${what} accepted, ${spanOf(one)}.`, ...one.notes].join(" ");
    fill(outcome, h("div", { class: "notice good" }, h("div", {}, told)));
  } catch (error) {
    fill(outcome, h("div", { class: "notice bad", role: "alert" }, h("div", {}, ...describe(error))));
  } finally {
    // So that the same file can be chosen again once it is corrected.
    input.value = "";
  }
}

/**
 * @param {File} file
 * @returns {Promise<ForecastOut>}
 */
function send(file) {
  const parts = file.name.split(".");
  const ending = (parts.length > 1 ? parts.pop() : "") ?? "";
  const query = new URLSearchParams({ name: parts.join(".") || "Forecast" });
  const otherwise = /** @type {HTMLInputElement} */ (byId("forecast-otherwise"));
  if (!otherwise.checkValidity()) throw new Error(`Clear-sky probability: ${otherwise.validationMessage}`);
  if (otherwise.value !== "") query.set("default_clear_probability", otherwise.value);
  const mediaType = NETCDF.has(ending.toLowerCase()) ? "application/netcdf" : "text/csv";
  return upload(`/v1/forecasts?${query}`, file, mediaType);
}
