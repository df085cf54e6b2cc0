// @ts-check
/** One plan: its states, its passes, what happens to it, and its replans. */

import { get, Problem } from "./api.js";
import { changesTable } from "./changes.js";
import { ActionDesk } from "./action_desk.js";
import { byId, fill, h } from "./dom.js";
import { short, utc, utcLabelled } from "./format.js";
import { Gantt } from "./gantt.js";
import { loadGeography, loadLand } from "./geography.js";
import { instantOf } from "./instants.js";
import { WorldMap } from "./map.js";
import { startPage, whileBusy } from "./page.js";
import { showPasses } from "./passes.js";
import { showTables } from "./plain_tables.js";
import { Plan } from "./plan.js";
import { move, nextInstant } from "./plan_steps.js";
import { installReplan } from "./replan.js";
import { Selection } from "./selection.js";
import { stateBadge } from "./state.js";
import { TimeView } from "./time_view.js";
import { Wishes } from "./wishes.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */

const planId = decodeURIComponent(location.pathname.split("/").pop() ?? "");
const planPath = `/v1/plans/${encodeURIComponent(planId)}`;
/** @type {Record<string, string>} */
const STEPS = { approved: "Approve", published: "Publish", withdrawn: "Withdraw" };

startPage(async () => {
  /** @type {PlanOut} */
  const plan = await get(planPath);
  const asked = Promise.all([loadGeography(planPath), loadLand()]);
  asked.catch(() => {}); // reported where it is awaited
  const changes = plan.parent_id === null ? null : await get(`${planPath}/changes`);
  showLife(plan, changes?.freeze_until ?? null);
  const drawn = new Plan(/** @type {any} */ (await get(`${planPath}/timeline.json`)));
  if (changes) {
    byId("changes-card").hidden = false;
    fill(byId("changes"), ...changesTable(changes));
  }
  const selection = new Selection();
  const wishes = new Wishes();
  const view = new TimeView(drawn.start, drawn.end);
  new Gantt(byId("gantt"), drawn, view, selection);
  await new ActionDesk(plan, drawn, selection, wishes).load();
  const stations = await showPlaces(asked, drawn, view, selection);
  installReplan(plan, stations, wishes);
  await showHistory();
  await showPasses(plan, stations, nextInstant(plan));
});

/**
 * Show all targets, also those without an image, on the map and in tables.
 * @param {Promise<[import("./geography.js").Geography, {credit: string, rings: number[][]}]>} asked
 * @param {Plan} drawn
 * @param {TimeView} view
 * @param {Selection} selection
 * @returns {Promise<{id: string, name: string}[]>} all stations, by name
 */
async function showPlaces(asked, drawn, view, selection) {
  const [geography, land] = await asked;
  drawn.setTargets(geography.targets);
  byId("map-credit").textContent = land.credit;
  new WorldMap(byId("map"), geography, land.rings, drawn, view, selection);
  showTables(drawn, selection);
  return [...geography.stations].sort((a, b) => a.name.localeCompare(b.name));
}

/**
 * @param {PlanOut} plan
 * @param {string | null} freezeUntil
 */
function showLife(plan, freezeUntil) {
  document.title = `${plan.name ?? short(plan.id)} - Slewline`;
  byId("plan-title").textContent = plan.name ?? `Plan ${short(plan.id)}`;
  fill(byId("plan-state"), stateBadge(plan));
  fill(
    byId("plan-about"),
    `${utc(plan.horizon.start)} to ${utcLabelled(plan.horizon.end)}, `,
    h("a", { href: `/jobs/${plan.job_id}` }, "its job"),
    plan.parent_id && ", replan of ",
    plan.parent_id && h("a", { href: `/plans/${plan.parent_id}` }, short(plan.parent_id)),
  );
  byId("violations-card").hidden = plan.violations.length === 0;
  fill(byId("plan-violations"), ...plan.violations.map((one) => h("li", {}, one.detail)));
  byId("from-place").hidden = !plan.allowed.includes("published");
  byId("replan-card").hidden = plan.state === "withdrawn" || plan.state === "superseded";
  const from = /** @type {HTMLInputElement} */ (byId("step-from"));
  from.value = utc(freezeUntil ?? nextInstant(plan));
  byId("plan-steps").addEventListener("submit", (event) => event.preventDefault());
  fill(
    byId("step-buttons"),
    ...plan.allowed.map((to) => {
      const button = h("button", { type: "button", id: `step-${to}`, class: to === "withdrawn" ? "quiet" : "" }, STEPS[to] ?? to);
      button.addEventListener("click", () =>
        whileBusy(button, byId("plan-error"), async () => {
          const reason = /** @type {HTMLInputElement} */ (byId("step-reason")).value.trim();
          await move(plan, to, reason, to === "published" ? instantOf(from.value) : null);
          location.reload();
        }),
      );
      return button;
    }),
  );
}

async function showHistory() {
  /** @type {{items: import("./types.js").PlanEventOut[]}} */
  const { items } = await get(`${planPath}/history`).catch((error) => {
    if (error instanceof Problem) return { items: [] };
    throw error;
  });
  fill(
    byId("history"),
    ...items.map((one) =>
      h("li", {}, `${utc(one.at)} UTC: ${one.to_state} by ${one.key_name ?? one.owner}`, one.reason && `: ${one.reason}`),
    ),
  );
}
