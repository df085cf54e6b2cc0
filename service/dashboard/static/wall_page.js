// @ts-check
/** The wall: a display for the shift, without interaction. It retries until the service answers. */

import { get, list, pause } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { loadGeography, loadLand } from "./geography.js";
import { clockOf, countdown } from "./instants.js";
import { startPage } from "./page.js";
import { Plan } from "./plan.js";
import { age, changeLine, onBoard, resourcesAt, telling } from "./wall_figures.js";
import { WallMap } from "./wall_map.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */
/** @typedef {import("./types.js").PassOut} PassOut */
/** @typedef {{plan: PlanOut, drawn: Plan, geography: import("./geography.js").Geography}} Shown */

const EVERY_MS = 10_000;
const PASSES_EVERY_MS = 600_000;
const AHEAD_MS = 14 * 3_600_000;
const MOST_CHANGES = 6;
const FEW_ROWS = 7;

/** `#at=2026-03-01T06:00:00Z` shows another time than now, for plans of other days. */
const fragment = new URLSearchParams(location.hash.slice(1));
const shift = fragment.has("at") ? Date.parse(fragment.get("at") ?? "") - Date.now() : 0;
const now = () => Date.now() + (Number.isNaN(shift) ? 0 : shift);

/** @type {Map<string, Shown>} */
const shown = new Map();
/** @type {PassOut[]} */
let passes = [];
let passesOf = "";
let passesAt = -Infinity;

startPage(async () => {
  document.body.classList.add("wall");
  const { rings } = await forever(loadLand);
  const map = new WallMap(byId("wall-map"), rings, now);
  setInterval(tick, 1000);
  for (;;) {
    try {
      await refresh(map);
      tell("");
    } catch (error) {
      tell(`No answer since ${utc(Date.now())} UTC; retrying.`);
    }
    await pause(EVERY_MS);
  }
});

let silentSince = "";

/** @param {string} trouble "" for none; the first one since the last answer is shown */
function tell(trouble) {
  silentSince = trouble === "" ? "" : silentSince || trouble;
  const at = shift === 0 ? "" : `As of ${utc(now())} UTC. `;
  const lack = lackOfPlans();
  byId("wall-status").textContent = at + (silentSince || lack);
  byId("wall-status").classList.toggle("bad", silentSince !== "" || lack !== "");
}

/** Return a message if no plan in force covers this time, else "". */
function lackOfPlans() {
  if (shown.size === 0) return "No plan is in force.";
  const end = Math.max(...[...shown.values()].map(({ drawn }) => drawn.end));
  return end > now() ? "" : `All plans in force have ended, the last at ${utc(end)} UTC.`;
}

/**
 * Retry until it works: a wall may be switched on before the service.
 * @template T
 * @param {() => Promise<T>} work
 * @returns {Promise<T>}
 */
async function forever(work) {
  for (;;) {
    try {
      return await work();
    } catch {
      await pause(EVERY_MS);
    }
  }
}

/** @param {WallMap} map */
async function refresh(map) {
  const at = new Date(now()).toISOString();
  /** @type {{items: PlanOut[]}} */
  const { items } = await list(`/v1/plans?state=published&at=${at}`);
  const inForce = items.filter((plan) => satellitesInForce(plan).length > 0);
  for (const id of [...shown.keys()]) if (!inForce.some((plan) => plan.id === id)) shown.delete(id);
  for (const plan of inForce) {
    const before = shown.get(plan.id);
    shown.set(plan.id, before ? { ...before, plan } : await read(plan));
  }
  await refreshPasses(inForce);
  await showChanges(inForce);
  map.show([...shown.values()].map((one) => ({ geography: one.geography, satelliteIds: satellitesInForce(one.plan) })));
  tick();
}

/** @param {PlanOut} plan */
function satellitesInForce(plan) {
  return plan.satellites
    .filter(
      (one) =>
        one.in_force_from !== null &&
        Date.parse(one.in_force_from) <= now() &&
        (one.in_force_until === null || Date.parse(one.in_force_until) > now()),
    )
    .map((one) => one.satellite_id);
}

/**
 * @param {PlanOut} plan
 * @returns {Promise<Shown>}
 */
async function read(plan) {
  const [timeline, geography] = await Promise.all([
    get(`/v1/plans/${encodeURIComponent(plan.id)}/timeline.json`),
    loadGeography(`/v1/plans/${encodeURIComponent(plan.id)}`),
  ]);
  return { plan, drawn: new Plan(/** @type {any} */ (timeline)), geography };
}

/** @param {PlanOut[]} inForce */
async function refreshPasses(inForce) {
  const told = JSON.stringify(inForce.map((plan) => [plan.id, satellitesInForce(plan)]));
  if (told === passesOf && now() - passesAt < PASSES_EVERY_MS) return;
  const [from, to] = [now(), now() + AHEAD_MS].map((at) => new Date(at).toISOString());
  const found = await Promise.all(
    inForce.map(async (plan) => {
      /** @type {{items: PassOut[]}} */
      const { items } = await list(`/v1/plans/${encodeURIComponent(plan.id)}/passes?from=${from}&to=${to}`);
      const own = new Set(satellitesInForce(plan));
      return items.filter((one) => own.has(one.satellite_id));
    }),
  );
  passes = found.flat().sort((a, b) => (a.aos < b.aos ? -1 : 1));
  [passesOf, passesAt] = [told, now()];
}

/** @param {PlanOut[]} inForce */
async function showChanges(inForce) {
  const replan = inForce.filter((plan) => plan.parent_id !== null).sort((a, b) => (a.created_at < b.created_at ? 1 : -1))[0];
  const place = byId("wall-changes");
  if (place.dataset.plan === (replan?.id ?? "none")) return;
  if (!replan) {
    fill(place, h("p", {}, "No plan in force is a replan."));
  } else {
    /** @type {import("./types.js").PlanChangesOut} */
    const changes = await get(`/v1/plans/${encodeURIComponent(replan.id)}/changes`);
    const known = shown.get(replan.id);
    const stationOf = (/** @type {string} */ id) => known?.geography.stations.find((one) => one.id === id)?.name ?? id;
    const lines = changes.items.slice(0, MOST_CHANGES).map((item) => h("li", {}, changeLine(item, known?.drawn, stationOf)));
    const more = changes.items.length - lines.length;
    fill(place, h("p", {}, telling(replan, changes)), h("ul", {}, ...lines, more > 0 && h("li", {}, `and ${more} more`)));
  }
  place.dataset.plan = replan?.id ?? "none";
}

function tick() {
  const at = now();
  const next = nextOfStations(at);
  const body = byId("wall-passes").querySelector("tbody");
  if (body) fill(body, ...next.map((one) => passRow(one, at)));
  const rows = [...shown.values()].flatMap(({ plan, drawn }) => {
    const own = new Set(satellitesInForce(plan));
    return drawn.rows.filter((row) => own.has(row.id)).map((row) => satelliteRow(drawn, row, at));
  });
  const satellites = byId("wall-satellites").querySelector("tbody");
  if (satellites) fill(satellites, ...rows);
  // Nobody scrolls a wall: the longer table decides how large letters can be.
  const most = Math.max(next.length, rows.length);
  document.body.classList.toggle("crowded", most > FEW_ROWS);
  document.body.style.setProperty("--rows", String(most));
}

/**
 * Return the current pass of each station, or else its next one; planned passes are preferred.
 * @param {number} at
 */
function nextOfStations(at) {
  /** @type {Map<string, PassOut>} */
  const next = new Map();
  for (const one of passes) {
    if (Date.parse(one.los) <= at) continue;
    const known = next.get(one.station_id);
    if (!known || (!known.planned && one.planned)) next.set(one.station_id, one);
  }
  return [...next.values()].sort((a, b) => (a.aos < b.aos ? -1 : 1));
}

/**
 * @param {PassOut} one
 * @param {number} at
 */
function passRow(one, at) {
  const [aos, los] = [Date.parse(one.aos), Date.parse(one.los)];
  const isOn = aos <= at;
  return h(
    "tr",
    { class: `${isOn ? "on" : ""} ${one.planned ? "" : "unplanned"}`, "data-station": one.station_id },
    h("th", { scope: "row" }, one.station_name),
    h("td", {}, one.planned ? "" : "○ ", one.satellite_name, !one.planned && h("span", { class: "hidden-text" }, ", not planned")),
    h("td", { class: "number countdown" }, `${isOn ? "LOS" : "AOS"} ${countdown((isOn ? los : aos) - at)}`),
    h("td", { class: "number" }, clockOf(isOn ? one.los : one.aos)),
  );
}

/**
 * @param {Plan} drawn
 * @param {import("./plan.js").Row} row
 * @param {number} at
 */
function satelliteRow(drawn, row, at) {
  const levels = resourcesAt(row, at);
  const images = onBoard(drawn, row, at);
  return h(
    "tr",
    { "data-satellite": row.id },
    h("th", { scope: "row" }, row.name),
    h("td", { class: levels && levels.battery <= (row.curves?.batteryMin ?? 0) ? "bad" : "" }, ...gauge("Battery", levels?.battery)),
    h("td", { class: levels && levels.recorder >= (row.curves?.recorderMax ?? 1) ? "bad" : "" }, ...gauge("Recorder", levels?.recorder)),
    h("td", { class: "number" }, images.count),
    h("td", { class: "number" }, images.oldest_s === null ? "" : age(images.oldest_s)),
  );
}

/**
 * @param {string} what
 * @param {number | undefined} fraction
 */
function gauge(what, fraction) {
  if (fraction === undefined) return ["–"];
  const text = `${Math.round(fraction * 100)} %`;
  return [h("meter", { min: 0, max: 1, value: fraction, "aria-label": `${what} ${text}` }), ` ${text}`];
}
