// @ts-check
/** The passes of a plan: a shift of them as a table, as files and on paper. */

import { call, list } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { number, utc } from "./format.js";
import { clockOf, instantOf } from "./instants.js";
import { whileBusy } from "./page.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */
/** @typedef {import("./types.js").PassOut} PassOut */
/** @typedef {{id: string, name: string}} Named */

const HOUR_MS = 3_600_000;
/** If there are more, only the planned ones are printed: a shift fits on two pages. */
const MOST_ON_PAPER = 100;

/**
 * @param {PlanOut} plan
 * @param {Named[]} stations
 * @param {number} from when the shift begins
 */
export async function showPasses(plan, stations, from) {
  field("passes-from").value = utc(from);
  byId("passes-station").append(...stations.map(({ id, name }) => h("option", { value: id }, name)));
  byId("passes-satellite").append(
    ...plan.satellites.map((one) => h("option", { value: one.satellite_id }, one.satellite_name)),
  );
  const path = `/v1/plans/${encodeURIComponent(plan.id)}/passes`;
  const form = byId("pass-filters");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const button = /** @type {HTMLButtonElement} */ (form.querySelector("button[type=submit]"));
    whileBusy(button, byId("passes-error"), () => show(plan, path));
  });
  byId("print-passes").addEventListener("click", () => printPasses());
  for (const suffix of ["csv", "ics"]) {
    const button = /** @type {HTMLButtonElement} */ (byId(`passes-${suffix}`));
    button.addEventListener("click", () =>
      whileBusy(button, byId("passes-error"), () => save(`${path}.${suffix}?${query()}`, `passes.${suffix}`)),
    );
  }
  await show(plan, path);
}

/** @param {string} id */
function field(id) {
  return /** @type {HTMLInputElement} */ (byId(id));
}

function query() {
  const from = instantOf(field("passes-from").value);
  const to = new Date(Date.parse(from) + Number(field("passes-hours").value) * HOUR_MS).toISOString();
  const wanted = new URLSearchParams({ from, to });
  for (const name of ["station", "satellite"]) {
    const { value } = field(`passes-${name}`);
    if (value) wanted.set(`${name}_id`, value);
  }
  if (field("passes-planned").checked) wanted.set("planned", "true");
  return wanted;
}

/**
 * @param {PlanOut} plan
 * @param {string} path
 */
async function show(plan, path) {
  const wanted = query();
  /** @type {{items: PassOut[]}} */
  const { items } = await list(`${path}?${wanted}`);
  const planned = items.filter((one) => one.planned).length;
  const isLong = items.length > MOST_ON_PAPER;
  byId("passes").classList.toggle("long", isLong);
  fill(
    byId("passes-caption"),
    `${plan.name ?? "Plan"} (${plan.state}): ${items.length} passes, ${planned} planned, ` +
      `${utc(wanted.get("from"))} to ${utc(wanted.get("to"))} UTC`,
    isLong && h("span", { class: "on-paper" }, "; only the planned ones are printed"),
  );
  const body = byId("passes").querySelector("tbody");
  if (body) fill(body, ...items.map(rowOf));
}

/** @param {PassOut} one */
function rowOf(one) {
  return h(
    "tr",
    { class: one.planned ? "planned" : "" },
    h("th", { scope: "row" }, utc(one.aos), one.aos_cut && " or before"),
    h("td", {}, clockOf(one.tca)),
    h("td", {}, clockOf(one.los), one.los_cut && " or after"),
    h("td", {}, one.station_name),
    h("td", {}, one.satellite_name),
    h("td", { class: "number" }, `${number(one.max_elevation_deg)}°`),
    h("td", {}, one.planned ? "yes" : ""),
    h("td", { class: "number" }, one.volume_mbit === null ? "" : `${number(one.volume_mbit, 0)} Mbit`),
    h("td", {}, ...conflictsOf(one)),
  );
}

/**
 * Return the passes that overlap this one; on paper only planned ones are named.
 * @param {PassOut} one
 */
function conflictsOf(one) {
  const planned = one.conflicts.filter((other) => other.planned).map((other) => `${other.satellite_name} (planned)`);
  const others = one.conflicts.filter((other) => !other.planned).map((other) => other.satellite_name);
  const comma = planned.length > 0 && others.length > 0 && ", ";
  return [
    planned.join(", "),
    h("span", { class: "on-screen" }, comma, others.join(", ")),
    h("span", { class: "on-paper" }, comma, others.length > 0 && `${others.length} not planned`),
  ];
}

function printPasses() {
  document.body.classList.add("print-passes");
  addEventListener("afterprint", () => document.body.classList.remove("print-passes"), { once: true });
  print();
}

/**
 * Save a response as a file. It is fetched rather than linked to, since a link cannot carry the key.
 * @param {string} path
 * @param {string} name
 */
async function save(path, name) {
  const url = URL.createObjectURL(await (await call(path)).blob());
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
