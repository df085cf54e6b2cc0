// @ts-check
/** Numbers and times as people read them. All times are UTC and say so. */

/**
 * @param {number | string | null | undefined} at in milliseconds, or in the API's format
 * @returns {string} such as `2026-03-01 12:00:05`; the column or label says UTC
 */
export function utc(at) {
  if (at == null) return "";
  return new Date(at).toISOString().replace("T", " ").slice(0, 19);
}

/** @param {number | string | null | undefined} at */
export function utcLabelled(at) {
  return at == null ? "" : `${utc(at)} UTC`;
}

/**
 * @param {number | null | undefined} value
 * @param {number} [digits]
 */
export function number(value, digits = 1) {
  if (value == null || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return digits > 0 ? text.replace(/\.?0+$/, "") : text;
}

/** @param {number | null | undefined} fraction */
export function percent(fraction) {
  return fraction == null ? "–" : `${(fraction * 100).toFixed(1)}%`;
}

/** @param {number | null | undefined} seconds */
export function duration(seconds) {
  if (seconds == null || !Number.isFinite(seconds)) return "–";
  if (seconds < 10) return `${seconds.toFixed(2)} s`;
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  const minutes = Math.floor(seconds / 60);
  if (minutes < 120) return `${minutes} min ${Math.round(seconds - minutes * 60)} s`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/**
 * Seconds between two instants; until now if the later one is missing.
 * @param {string | null} from
 * @param {string | null} to
 */
export function secondsBetween(from, to) {
  if (from === null) return null;
  return ((to === null ? Date.now() : Date.parse(to)) - Date.parse(from)) / 1000;
}

/**
 * The gap between reward and bound, as the timeline defines it.
 * @param {number | null | undefined} reward
 * @param {number | null | undefined} bound
 */
export function gapOf(reward, bound) {
  if (reward == null || bound == null) return null;
  return bound > 0 ? Math.max(0, (bound - reward) / bound) : 0;
}

/**
 * A target in texts: its name if it has one, and its id.
 * @param {string} id
 * @param {string | null | undefined} name
 */
export function targetTitle(id, name) {
  return name && name !== id ? `${name} (${id})` : id;
}

/** A short name for an item without one: the last, random part of its id. @param {string} id */
export function short(id) {
  return id.slice(-8);
}

/**
 * @param {number} count
 * @param {string} noun in the singular
 * @param {string} [nouns] in the plural
 */
export function counted(count, noun, nouns = `${noun}s`) {
  return `${count} ${count === 1 ? noun : nouns}`;
}
