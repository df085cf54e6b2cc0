// @ts-check
/** Replans: requested, looked at, and only then taken. */

import { follow, get, post } from "./api.js";
import { changesTable } from "./changes.js";
import { byId, fill, h } from "./dom.js";
import { utc } from "./format.js";
import { instantOf } from "./instants.js";
import { whileBusy } from "./page.js";
import { move, nextInstant } from "./plan_steps.js";
import { ProgressText } from "./progress_text.js";
import { replanOf } from "./wishes.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */
/** @typedef {import("./types.js").JobOut} JobOut */
/** @typedef {import("./wishes.js").Wishes} Wishes */

const HOUR_MS = 3_600_000;

/**
 * @param {PlanOut} plan
 * @param {{id: string, name: string}[]} stations
 * @param {Wishes} wishes
 */
export function installReplan(plan, stations, wishes) {
  field("freeze-until").value = utc(nextInstant(plan));
  installOutages(plan, stations, wishes);
  const button = /** @type {HTMLButtonElement} */ (byId("replan"));
  /** @type {PlanOut | null} */
  let proposal = null;
  byId("replan-form").addEventListener("submit", (event) => {
    event.preventDefault();
    whileBusy(button, byId("replan-error"), async () => {
      byId("proposal").hidden = true;
      proposal = await propose(plan, wishes);
      const changes = await get(`/v1/plans/${proposal.id}/changes`);
      fill(byId("proposal-changes"), ...changesTable(changes));
      byId("proposal").hidden = false;
      byId("take-proposal").focus();
    });
  });
  byId("take-proposal").addEventListener("click", () => {
    if (proposal) location.assign(`/plans/${proposal.id}`);
  });
  const drop = /** @type {HTMLButtonElement} */ (byId("drop-proposal"));
  drop.addEventListener("click", () =>
    whileBusy(drop, byId("replan-error"), async () => {
      if (proposal) await move(proposal, "withdrawn", "Not taken.", null);
      proposal = null;
      byId("proposal").hidden = true;
      byId("replan-progress").textContent = "The proposal is withdrawn.";
    }),
  );
}

/** @param {string} id */
function field(id) {
  return /** @type {HTMLInputElement} */ (byId(id));
}

/**
 * @param {PlanOut} plan
 * @param {{id: string, name: string}[]} stations
 * @param {Wishes} wishes
 */
function installOutages(plan, stations, wishes) {
  const choice = field("outage-of");
  choice.append(
    ...stations.map(({ id, name }) => h("option", { value: `station_id ${id}` }, `station ${name}`)),
    ...plan.satellites.map((one) => h("option", { value: `satellite_id ${one.satellite_id}` }, `satellite ${one.satellite_name}`)),
  );
  field("outage-start").value = utc(nextInstant(plan));
  const form = byId("outage-form");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const button = /** @type {HTMLButtonElement} */ (form.querySelector("button"));
    whileBusy(button, byId("replan-error"), async () => {
      const at = choice.value.indexOf(" ");
      const start = instantOf(field("outage-start").value);
      const end = new Date(Date.parse(start) + Number(field("outage-hours").value) * HOUR_MS).toISOString();
      const name = /** @type {HTMLSelectElement} */ (/** @type {unknown} */ (choice)).selectedOptions[0]?.text;
      wishes.add({
        text: `Outage: ${name}, ${utc(start)} to ${utc(end)} UTC.`,
        kind: "outage",
        value: { [choice.value.slice(0, at)]: choice.value.slice(at + 1), start, end },
      });
    });
  });
}

/**
 * Request a replan; return its draft once the job has ended.
 * @param {PlanOut} plan
 * @param {Wishes} wishes
 * @returns {Promise<PlanOut>}
 */
async function propose(plan, wishes) {
  const freeze = instantOf(field("freeze-until").value);
  const isUnderWay = Date.now() > Date.parse(plan.horizon.start) && Date.now() < Date.parse(plan.horizon.end);
  const body = {
    freeze_until: freeze,
    // A plan for another day is replanned as if now were the end of the freeze.
    ...(isUnderWay ? {} : { now: freeze }),
    ...replanOf(wishes.all),
    limits: { time_s: Number(field("replan-time").value) },
  };
  /** @type {JobOut & {links: Record<string, string>}} */
  const job = await post(`/v1/plans/${encodeURIComponent(plan.id)}/replans`, body);
  /** @type {JobOut} */
  let last = job;
  const progress = new ProgressText(byId("replan-progress"));
  await follow(job.id, (told) => {
    last = told;
    progress.show(told, `Replan: ${told.state}${told.progress ? `, ${told.progress.phase}` : ""}`);
  });
  if (last.state !== "succeeded") throw new Error(last.error?.detail ?? `The replan ended in state ${last.state}.`);
  return get(job.links.plan ?? "");
}
