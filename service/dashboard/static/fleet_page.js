// @ts-check
/** Satellites, stations and spacecraft types as they are now, and outages. */

import { call, get, list, post } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { changesIn, fieldsOf, grouped } from "./fields.js";
import { utc } from "./format.js";
import { instantOf } from "./instants.js";
import { startPage, whileBusy } from "./page.js";
import { fillSpacecraft } from "./spacecraft_choice.js";

/** @typedef {{id: string, name: string, is_built_in?: boolean}} Named */
/** @typedef {import("./types.js").OutageOut} OutageOut */

const KINDS = { satellites: "satellite", "ground-stations": "station", spacecraft: "type" };
const MOST = 1000;
const HOUR_MS = 3_600_000;

/** @type {{thing: Record<string, any>, etag: string, fields: import("./fields.js").Field[]} | null} */
let open = null;
/** @type {Record<string, import("./types.js").Schema>} */
let schemas = {};

startPage(async () => {
  schemas = (await get("/openapi.json")).components.schemas;
  const [satellites, stations, types] = await Promise.all(Object.keys(KINDS).map(read));
  for (const [i, [kind, word]] of Object.entries(KINDS).entries()) {
    const own = [satellites, stations, types][i] ?? [];
    byId("thing").append(...own.filter((one) => !one.is_built_in).map((one) => optionOf(kind, word, one)));
  }
  byId("outage-of").append(
    ...(stations ?? []).map(({ id, name }) => h("option", { value: `station_id ${id}` }, `station ${name}`)),
    ...(satellites ?? []).map(({ id, name }) => h("option", { value: `satellite_id ${id}` }, `satellite ${name}`)),
  );
  field("outage-start").value = utc(Date.now());
  byId("thing").addEventListener("change", () => edit());
  installForms();
  await Promise.all([fillSpacecraft(/** @type {HTMLSelectElement} */ (byId("type-base"))), showOutages()]);
});

/**
 * @param {string} kind
 * @param {string} word
 * @param {Named} one
 */
function optionOf(kind, word, { id, name }) {
  return h("option", { value: `/v1/${kind}/${encodeURIComponent(id)}` }, `${word} ${name}`);
}

/** @param {string} kind @returns {Promise<Named[]>} */
async function read(kind) {
  return (await list(`/v1/${kind}`, MOST)).items;
}

/** @param {string} id */
function field(id) {
  return /** @type {HTMLInputElement} */ (byId(id));
}

async function edit() {
  const path = field("thing").value;
  byId("edit-form").hidden = path === "";
  byId("edit-status").textContent = "";
  fill(byId("edit-error"));
  if (path === "") return;
  const response = await call(path, { cache: "no-store" });
  const thing = await response.json();
  open = { thing, etag: response.headers.get("ETag") ?? "", fields: fieldsOf(thing, schemas) };
  fill(byId("edit-fields"), ...grouped(open.fields));
}

function installForms() {
  onSubmit("edit-form", "edit-error", async () => {
    if (open === null) return;
    const changes = changesIn(open.thing, open.fields);
    if (Object.keys(changes).length === 0) {
      byId("edit-status").textContent = "Nothing to save.";
      return;
    }
    // Changes that somebody else made in the meantime are not overwritten.
    const headers = { "Content-Type": "application/json", "If-Match": open.etag };
    await call(field("thing").value, { method: "PATCH", headers, body: JSON.stringify(changes) });
    const name = changes.name;
    const option = byId("thing").querySelector("option:checked");
    if (name && option) option.textContent = `${option.textContent?.split(" ", 1)[0]} ${name}`;
    await edit();
    byId("edit-status").textContent = "Saved.";
  });
  onSubmit("type-form", "type-error", async () => {
    const { agility, sensor, resources } = await get(`/v1/spacecraft/${encodeURIComponent(field("type-base").value)}`);
    const name = field("type-name").value.trim();
    /** @type {Named} */
    const made = await post("/v1/spacecraft", { name, agility, sensor, resources });
    const option = optionOf("spacecraft", KINDS.spacecraft, made);
    byId("thing").append(option);
    field("thing").value = option.value;
    field("type-name").value = "";
    await Promise.all([fillSpacecraft(/** @type {HTMLSelectElement} */ (byId("type-base"))), edit()]);
    byId("edit-status").textContent = "Added: now change its figures.";
  });
  onSubmit("outage-form", "outage-error", async () => {
    const of = field("outage-of").value;
    const at = of.indexOf(" ");
    const start = instantOf(field("outage-start").value);
    const end = new Date(Date.parse(start) + Number(field("outage-hours").value) * HOUR_MS).toISOString();
    const reason = field("outage-reason").value.trim();
    await post("/v1/outages", { [of.slice(0, at)]: of.slice(at + 1), start, end, ...(reason ? { reason } : {}) });
    await showOutages();
  });
}

/**
 * @param {string} form
 * @param {string} place
 * @param {() => Promise<void>} work
 */
function onSubmit(form, place, work) {
  byId(form).addEventListener("submit", (event) => {
    event.preventDefault();
    const button = /** @type {HTMLButtonElement} */ (byId(form).querySelector("button[type=submit]"));
    whileBusy(button, byId(place), work);
  });
}

async function showOutages() {
  /** @type {{items: OutageOut[]}} */
  const { items } = await list("/v1/outages", MOST);
  const body = byId("outages").querySelector("tbody");
  if (body) fill(body, ...items.map(rowOf));
}

/** @param {OutageOut} one */
function rowOf(one) {
  const what = one.station_name ?? one.satellite_name ?? one.station_id ?? one.satellite_id;
  const onclick = async () => {
    await call(`/v1/outages/${encodeURIComponent(one.id)}`, { method: "DELETE" });
    await showOutages();
  };
  const label = `Delete the outage of ${what}`;
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, what),
    h("td", {}, utc(one.start)),
    h("td", {}, utc(one.end)),
    h("td", {}, one.reason),
    h("td", {}, h("button", { type: "button", class: "quiet needs-submit", "aria-label": label, onclick }, "Delete")),
  );
}
