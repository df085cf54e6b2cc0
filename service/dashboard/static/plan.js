// @ts-check
/** A timeline prepared for drawing: times as numbers, actions by lane and in order. */

import { targetTitle } from "./format.js";

/** @typedef {import("./types.js").Timeline} Timeline */
/** @typedef {import("./types.js").Action} Action */
/** @typedef {import("./geography.js").TargetPlace} TargetPlace */

/**
 * Spans in order of time.
 * @template T
 */
export class Lane {
  /** @param {{start: number, end: number, of: T}[]} spans */
  constructor(spans) {
    spans.sort((a, b) => a.start - b.start);
    this.start = Float64Array.from(spans, (span) => span.start);
    this.end = Float64Array.from(spans, (span) => span.end);
    this.of = spans.map((span) => span.of);
    // Spans of a plan that breaks limits may overlap: searches use the latest end so far, which never falls.
    this.lastEnd = Float64Array.from(this.end);
    for (let i = 1; i < this.lastEnd.length; i++) {
      this.lastEnd[i] = Math.max(/** @type {number} */ (this.lastEnd[i]), /** @type {number} */ (this.lastEnd[i - 1]));
    }
  }

  /**
   * Return the index of the first span that may end after an instant.
   * @param {number} t
   */
  firstPast(t) {
    return firstAbove(this.lastEnd, t);
  }

  /**
   * Return the item at an instant, or the nearest one within a reach.
   * @param {number} t
   * @param {number} reach
   * @returns {T | null}
   */
  nearest(t, reach) {
    let best = null;
    let least = reach;
    for (let i = this.firstPast(t - reach); i < this.start.length; i++) {
      const start = /** @type {number} */ (this.start[i]);
      if (start > t + reach) break;
      const away = Math.max(start - t, t - /** @type {number} */ (this.end[i]), 0);
      if (away <= least && (best === null || away < least)) {
        least = away;
        best = /** @type {T} */ (this.of[i]);
      }
    }
    return best;
  }
}

/**
 * Index of the first value above a limit, in an ascending array.
 * @param {ArrayLike<number>} values
 * @param {number} limit
 */
export function firstAbove(values, limit) {
  let low = 0;
  let high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (/** @type {number} */ (values[middle]) > limit) high = middle;
    else low = middle + 1;
  }
  return low;
}

/**
 * @typedef {object} Row
 * @property {string} id
 * @property {string} name
 * @property {Lane<Action>} collects
 * @property {Lane<Action>} contacts
 * @property {Lane<Action>} sunpoints
 * @property {Lane<Action>} slews
 * @property {Lane<null>} eclipses
 * @property {Curves | null} curves
 */

/**
 * @typedef {object} Curves
 * @property {Float64Array} time
 * @property {number[]} battery
 * @property {number[]} recorder
 * @property {number} batteryMin
 * @property {number} recorderMax
 */

/** A plan judged by the referee; its targets are added later. */
export class Plan {
  /** @param {Timeline} timeline */
  constructor(timeline) {
    this.timeline = timeline;
    this.start = Date.parse(timeline.horizon.start);
    this.end = Date.parse(timeline.horizon.end);
    /** @type {Map<string, Action>} */
    this.actions = new Map();
    /** @type {Map<string, string>} */
    this.satelliteOf = new Map();
    /** @type {Map<string, string[]>} */
    this.actionsOf = new Map();
    /** @type {TargetPlace[]} */
    this.targets = [];
    /** @type {Map<string, TargetPlace>} */
    this.target = new Map();
    /** @type {Map<string, string>} names of targets in texts */
    this.titles = new Map();
    this.names = new Map(timeline.satellites.map(({ id, name }) => [id, name]));
    this.rows = timeline.satellites.map((satellite) => this.row(satellite));
  }

  /** @param {TargetPlace[]} targets */
  setTargets(targets) {
    this.targets = targets;
    this.target = new Map(targets.map((one) => [one.id, one]));
    for (const { id, title } of targets) this.titles.set(id, title);
  }

  /**
   * @param {import("./types.js").TimelineSatellite} satellite
   * @returns {Row}
   */
  row(satellite) {
    for (const action of satellite.actions) {
      this.actions.set(action.id, action);
      this.satelliteOf.set(action.id, satellite.id);
      if (action.target_id !== null) {
        this.titles.set(action.target_id, targetTitle(action.target_id, action.target_name));
        const known = this.actionsOf.get(action.target_id) ?? [];
        this.actionsOf.set(action.target_id, [...known, action.id]);
      }
    }
    const lane = (/** @type {string} */ mode) =>
      new Lane(satellite.actions.filter((action) => action.mode === mode).map(spanOf));
    const turning = satellite.actions.filter((action) => action.slew && action.slew.needed_s > 0);
    return {
      id: satellite.id,
      name: satellite.name,
      collects: lane("collect"),
      contacts: lane("contact"),
      sunpoints: lane("sunpoint"),
      slews: new Lane(
        [...turning.map(slewOf), ...satellite.actions.flatMap(sunTurnsOf)].sort((a, b) => a.start - b.start),
      ),
      eclipses: new Lane(
        (satellite.eclipses ?? []).map(({ start, end }) => ({ start: Date.parse(start), end: Date.parse(end), of: null })),
      ),
      curves: curvesOf(satellite.resources),
    };
  }

  /**
   * Return the selection of an action: the action, its target, its satellite.
   * @param {string} actionId
   */
  about(actionId) {
    const action = this.actions.get(actionId);
    return {
      actionId,
      targetId: action?.target_id ?? null,
      satelliteId: this.satelliteOf.get(actionId) ?? null,
    };
  }

  /** @param {string} targetId */
  aboutTarget(targetId) {
    const known = this.target.get(targetId);
    const actionId = known?.actionId ?? this.actionsOf.get(targetId)?.[0] ?? null;
    return { actionId, targetId, satelliteId: known?.satelliteId ?? null };
  }

  /**
   * Return an action in words, with its id.
   * @param {string} id
   */
  actionTitle(id) {
    const action = this.actions.get(id);
    if (action?.mode === "collect") return `image of ${this.targetTitle(action.target_id ?? "")} (${id})`;
    if (action?.mode === "contact") return `contact with ${action.station_name ?? action.station_id} (${id})`;
    return id;
  }

  /** @param {string} id */
  targetTitle(id) {
    return this.titles.get(id) ?? id;
  }

  /** @param {string} id */
  satelliteName(id) {
    return this.names.get(id) ?? id;
  }
}

/** @param {Action} action */
export function spanOf(action) {
  return { start: Date.parse(action.start), end: Date.parse(action.end), of: action };
}

/** The turn is shown as late as possible. @param {Action} action */
function slewOf(action) {
  const end = Date.parse(action.start);
  return { start: end - (action.slew?.needed_s ?? 0) * 1000, end, of: action };
}

/** The turns to the sun and back. @param {Action} action */
function sunTurnsOf(action) {
  const { start, end } = spanOf(action);
  const [to, back] = [(action.turn_to_s ?? 0) * 1000, (action.turn_back_s ?? 0) * 1000];
  const turns = [
    { start: start - to, end: start, of: action },
    { start: end, end: end + back, of: action },
  ];
  return turns.filter((turn) => turn.end > turn.start);
}

/**
 * @param {import("./types.js").ResourceCurves | null} resources
 * @returns {Curves | null}
 */
function curvesOf(resources) {
  if (resources === null) return null;
  return {
    time: Float64Array.from(resources.time, (at) => Date.parse(at)),
    battery: resources.battery_fraction,
    recorder: resources.recorder_fraction,
    batteryMin: resources.battery_min_fraction,
    recorderMax: resources.recorder_max_fraction,
  };
}
