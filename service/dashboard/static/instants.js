// @ts-check
/** Instants as people type them: in UTC, as the pages show them. */

/**
 * Return an instant in the API's format.
 * @param {string} text such as `2026-03-01 12:00:05`, with or without `T` and `Z`
 */
export function instantOf(text) {
  const plain = text.trim().replace(" UTC", "").replace(" ", "T").replace(/Z$/, "");
  const at = Date.parse(`${plain}Z`);
  if (Number.isNaN(at)) throw new Error(`"${text}" is not a time: write it as 2026-03-01 12:00:00.`);
  return new Date(at).toISOString();
}

/**
 * Return the time of day, to the second.
 * @param {string} at in the API's format
 */
export function clockOf(at) {
  return at.slice(11, 19);
}

/**
 * Return a remaining or elapsed time as hours, minutes and seconds.
 * @param {number} ms
 */
export function countdown(ms) {
  const seconds = Math.max(0, Math.floor(ms / 1000));
  const parts = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  return parts.map((part) => String(part).padStart(2, "0")).join(":");
}
