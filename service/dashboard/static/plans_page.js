// @ts-check
/** The list of plans, updated live. */

import { list, pause } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { short, utc } from "./format.js";
import { startPage } from "./page.js";
import { stateBadge } from "./state.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */

const MOST = 200;
const EVERY_MS = 5000;

startPage(async () => {
  byId("plan-state").addEventListener("change", () => show());
  for (;;) {
    await show().catch(() => {});
    await pause(EVERY_MS);
    while (document.hidden) await pause(EVERY_MS);
  }
});

let told = "";

async function show() {
  const { value } = /** @type {HTMLSelectElement} */ (byId("plan-state"));
  const query = value ? `?state=${value}` : "";
  /** @type {{items: PlanOut[]}} */
  const { items } = await list(`/v1/plans${query}`, MOST);
  byId("plans-empty").hidden = items.length > 0;
  const now = JSON.stringify(items);
  if (now === told) return; // focus stays
  told = now;
  const body = byId("plans").querySelector("tbody");
  if (body) fill(body, ...items.map(rowOf));
}

/** @param {PlanOut} plan */
function rowOf(plan) {
  const names = plan.satellites.map((one) => one.satellite_name);
  const parent = plan.parent_id;
  return h(
    "tr",
    { "data-plan": plan.id },
    h("td", {}, stateBadge(plan)),
    h("th", { scope: "row" }, h("a", { href: `/plans/${plan.id}` }, plan.name ?? short(plan.id))),
    h("td", {}, names.length > 4 ? `${names.slice(0, 4).join(", ")} and ${names.length - 4} more` : names.join(", ")),
    h("td", {}, utc(plan.horizon.start)),
    h("td", {}, utc(plan.horizon.end)),
    h("td", {}, parent && h("a", { href: `/plans/${parent}` }, short(parent))),
    h("td", {}, utc(plan.created_at)),
  );
}
