// @ts-check
/** A job's progress in words, with a clock that moves even while nothing else does. */

import { FINAL } from "./api.js";
import { fill, h } from "./dom.js";
import { countdown } from "./instants.js";

/** @typedef {import("./types.js").JobOut} JobOut */

export class ProgressText {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.words = h("span");
    // Screen readers do not read a timer aloud every second, even inside a status.
    this.clock = h("span", { role: "timer" });
    /** @type {JobOut | null} */
    this.job = null;
    this.shownAt = performance.now();
    fill(place, this.words, this.clock);
    const ticking = setInterval(() => {
      this.tick();
      if (this.job && FINAL.has(this.job.state)) clearInterval(ticking);
    }, 1000);
  }

  /**
   * @param {JobOut} job
   * @param {string} words its progress; "" if unknown
   */
  show(job, words) {
    this.job = job;
    const text = words || (job.state === "queued" ? "Waiting for a worker" : job.state);
    if (this.words.textContent !== text) this.words.textContent = text;
    this.tick();
  }

  tick() {
    if (this.job === null || FINAL.has(this.job.state)) {
      this.clock.textContent = "";
      return;
    }
    const since = Date.parse(this.job.started_at ?? this.job.created_at);
    // If this clock is behind the service's, count from when the page began to watch.
    const elapsed = Math.max(Date.now() - since, performance.now() - this.shownAt);
    this.clock.textContent = `, for ${countdown(elapsed)}${ending(this.job, elapsed)}`;
  }
}

/**
 * Return when the search ends at the latest, as far as that is known.
 * @param {JobOut} job
 * @param {number} elapsed milliseconds
 */
function ending(job, elapsed) {
  if (job.started_at === null) return "";
  if (job.progress?.phase === "verify") return ": the search is over, the plan is being checked";
  const left = job.limits.time_s * 1000 - elapsed;
  return left > 0 ? `; the search ends within ${countdown(left)}` : "; the search is ending";
}
