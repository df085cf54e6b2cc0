// @ts-check
/** The steps from one state of a plan to the next. */

import { post } from "./api.js";

/** @typedef {import("./types.js").PlanOut} PlanOut */

/**
 * Take a step; approval waives each violation with the reason.
 * @param {PlanOut} plan
 * @param {string} to
 * @param {string} reason
 * @param {string | null} effectiveFrom for `published`
 * @returns {Promise<PlanOut>}
 */
export function move(plan, to, reason, effectiveFrom) {
  /** @type {Record<string, unknown>} */
  const body = { to };
  if (reason) body.reason = reason;
  if (effectiveFrom) body.effective_from = effectiveFrom;
  if (to === "approved" && plan.violations.length > 0) {
    if (!reason) throw new Error("Enter a reason why this plan may break limits.");
    body.waivers = plan.violations.map((_, i) => ({ violation: `/violations/${i}`, reason }));
  }
  return post(`/v1/plans/${encodeURIComponent(plan.id)}/transitions`, body);
}

/** Now if the plan's horizon contains it, else the horizon's start: when work on it begins. @param {PlanOut} plan */
export function nextInstant(plan) {
  const [start, end, now] = [Date.parse(plan.horizon.start), Date.parse(plan.horizon.end), Date.now()];
  return now > start && now < end ? now : start;
}
