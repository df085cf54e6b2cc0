// @ts-check
/** Outcomes of targets in detail, read from the service page by page when they are viewed. */

import { get } from "./api.js";

/** @typedef {import("./types.js").TargetItem} TargetItem */

const PAGE = 100;
/** Reasons whose code does not read as a phrase. @type {Record<string, string>} */
const REASONS = { displaced_by: "displaced by other images" };

/** @param {string} code of a reason */
export function reasonName(code) {
  return REASONS[code] ?? code.replaceAll("_", " ");
}

/** The targets of a job that are left out for one reason. */
export class OutcomeRows {
  /**
   * @param {string} jobPath
   * @param {string} reason
   * @param {string[]} ids of these targets, in the order of the scenario
   */
  constructor(jobPath, reason, ids) {
    this.path = `${jobPath}/targets?${new URLSearchParams({ reason, limit: String(PAGE) })}`;
    this.ids = ids;
    this.length = ids.length;
    /** @type {TargetItem[]} */
    this.rows = [];
    this.next = this.path;
    /** @type {Promise<unknown>} */
    this.turn = Promise.resolve();
  }

  /** @param {string} id */
  indexOf(id) {
    return this.ids.indexOf(id);
  }

  /**
   * @param {number} first
   * @param {number} end
   * @returns {TargetItem[] | Promise<TargetItem[]>}
   */
  load(first, end) {
    if (this.rows.length >= end) return this.rows.slice(first, end);
    // Pages are read one after the other: each names the next.
    const loaded = this.turn.then(async () => {
      while (this.rows.length < end && this.next) await this.readOn();
      return this.rows.slice(first, end);
    });
    this.turn = loaded.catch(() => {});
    return loaded;
  }

  async readOn() {
    /** @type {{items: TargetItem[], next: string | null}} */
    const { items, next } = await get(this.next);
    this.rows.push(...items);
    this.next = next === null ? "" : `${this.path}&cursor=${encodeURIComponent(next)}`;
  }
}

/**
 * Return the outcome of one target.
 * @param {string} jobPath
 * @param {string} targetId
 * @returns {Promise<TargetItem | undefined>}
 */
export async function outcomeOf(jobPath, targetId) {
  /** @type {{items: TargetItem[]}} */
  const { items } = await get(`${jobPath}/targets?${new URLSearchParams({ target_id: targetId })}`);
  return items[0];
}
