// @ts-check
/** Targets of a catalogue: the state of each, and its priority, which can be changed. */

import { call, list } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { counted, targetTitle, utc } from "./format.js";
import { startPage, whileBusy } from "./page.js";
import { PagedTable } from "./table.js";

/** @typedef {import("./types.js").TargetLifeOut} TargetLifeOut */
/** @typedef {import("./types.js").TargetCatalogOut} TargetCatalogOut */

const MOST_CATALOGS = 500;
const MOST_TARGETS = 10_000;

/** @type {PagedTable<TargetLifeOut>} */
let table;
/** @type {TargetLifeOut[]} */
let lives = [];
let etag = "";
/** @type {Map<string, number>} priorities typed but not yet saved, by target */
const edited = new Map();

startPage(async () => {
  /** @type {{items: TargetCatalogOut[]}} */
  const { items } = await list("/v1/target-catalogs", MOST_CATALOGS);
  byId("targets-empty").hidden = items.length > 0;
  byId("priorities-form").hidden = items.length === 0;
  if (items.length === 0) return;
  fill(field("catalog"), ...items.map((one) => h("option", { value: one.id }, `${one.name} (${one.num_targets}), stored ${utc(one.created_at)} UTC`)));
  table = tableOf();
  fill(byId("targets"), table.element);
  for (const id of ["catalog", "state"]) field(id).addEventListener("change", () => read());
  field("find").addEventListener("input", narrow);
  byId("target-filters").addEventListener("submit", (event) => event.preventDefault());
  byId("priorities-form").addEventListener("submit", (event) => {
    event.preventDefault();
    whileBusy(/** @type {HTMLButtonElement} */ (byId("save-priorities")), byId("targets-error"), save);
  });
  await read();
});

/** @param {string} id */
function field(id) {
  return /** @type {HTMLInputElement} */ (byId(id));
}

function catalogPath() {
  return `/v1/target-catalogs/${encodeURIComponent(field("catalog").value)}`;
}

async function read() {
  edited.clear();
  const [catalog, state] = [field("catalog").value, field("state").value];
  const query = new URLSearchParams({ catalog_id: catalog, ...(state ? { state } : {}) });
  // Read before the targets, so that changes made in between are not overwritten.
  const response = await call(catalogPath(), { cache: "no-store" });
  const found = await list(`/v1/targets?${query}`, MOST_TARGETS);
  if (catalog !== field("catalog").value || state !== field("state").value) return;
  etag = response.headers.get("ETag") ?? "";
  lives = /** @type {TargetLifeOut[]} */ (found.items);
  byId("priorities-status").textContent = found.isAll ? "" : `Only the first ${lives.length} are shown.`;
  narrow();
}

function narrow() {
  const text = field("find").value.trim().toLowerCase();
  const found = lives.filter(({ target }) => targetTitle(target.id, target.name).toLowerCase().includes(text));
  byId("count").textContent = `${found.length} of ${counted(lives.length, "target")}`;
  table.show(found);
}

/** @returns {PagedTable<TargetLifeOut>} */
function tableOf() {
  return new PagedTable(
    "Targets, and the image that each state is based on",
    [
      { title: "Target", cell: ({ target }) => targetTitle(target.id, target.name) },
      { title: "State", cell: ({ state }) => state },
      { title: "Satellite", cell: ({ collect }) => collect?.satellite_name },
      {
        title: "Image (UTC)",
        cell: ({ collect }) => collect && h("a", { href: `/plans/${encodeURIComponent(collect.plan_id)}` }, utc(collect.start)),
      },
      { title: "Wanted until (UTC)", cell: ({ target }) => utc(target.due) },
      { title: "Priority", cell: ({ target }) => priorityOf(target) },
    ],
    ({ target }) => target.id,
  );
}

/** @param {TargetLifeOut["target"]} target */
function priorityOf(target) {
  const label = `Priority of ${targetTitle(target.id, target.name)}`;
  const value = edited.get(target.id) ?? target.reward;
  const input = h("input", { type: "number", min: 0, step: "any", required: true, value, "aria-label": label, form: "priorities-form", class: "priority" });
  input.addEventListener("input", () => {
    if (!input.validity.valid || input.valueAsNumber === target.reward) edited.delete(target.id);
    else edited.set(target.id, input.valueAsNumber);
    byId("priorities-status").textContent = edited.size > 0 ? `${counted(edited.size, "change")} not saved yet.` : "";
  });
  return input;
}

async function save() {
  const count = edited.size;
  if (count === 0) {
    byId("priorities-status").textContent = "Nothing to save.";
    return;
  }
  const body = JSON.stringify({ rewards: Object.fromEntries(edited) });
  const headers = { "Content-Type": "application/json", "If-Match": etag };
  await call(catalogPath(), { method: "PATCH", headers, body });
  await read();
  byId("priorities-status").textContent = `${counted(count, "priority", "priorities")} saved.`;
}
