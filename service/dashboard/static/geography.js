// @ts-check
/** What the map shows: land, and the timeline as GeoJSON, prepared for drawing. */

import { call } from "./api.js";
import { targetTitle } from "./format.js";
import { firstAbove } from "./plan.js";

/**
 * @typedef {object} Place
 * @property {string} id
 * @property {string} name
 * @property {number} lon
 * @property {number} lat
 */

/**
 * @typedef {object} TargetPlace
 * @property {string} id
 * @property {string} name for pictures; the id if it has none
 * @property {string} title for texts: its name and its id
 * @property {number} lon
 * @property {number} lat
 * @property {string} outcome
 * @property {string | null} reason code of the reason if it is left out
 * @property {string | null} why
 * @property {string | null} actionId
 * @property {string | null} satelliteId
 * @property {number} reward what its image earns at best
 */

/**
 * @typedef {object} Track
 * @property {string} satelliteId
 * @property {string} name
 * @property {{time: Float64Array, lon: Float64Array, lat: Float64Array}[]} pieces
 */

/**
 * @typedef {object} Geography
 * @property {TargetPlace[]} targets
 * @property {Place[]} stations
 * @property {{stationId: string, rings: [number, number][][]}[]} circles
 * @property {Track[]} tracks
 */

/** @returns {Promise<{credit: string, rings: number[][]}>} */
export async function loadLand() {
  // Beside this file, under the version of the page.
  return (await fetch(new URL("land.json", import.meta.url))).json();
}

/**
 * @param {string} path of a job or a plan
 * @returns {Promise<Geography>}
 */
export async function loadGeography(path) {
  const { features } = await (await call(`${path}/timeline.geojson`)).json();
  /** @type {Geography} */
  const found = { targets: [], stations: [], circles: [], tracks: [] };
  for (const { geometry, properties } of features) {
    const { kind } = properties;
    if (kind === "target") {
      found.targets.push({
        ...place(geometry, properties.target_id, properties.target_name ?? properties.target_id),
        title: targetTitle(properties.target_id, properties.target_name),
        outcome: properties.outcome,
        reason: properties.reason,
        why: properties.reason_detail,
        actionId: properties.action_id,
        satelliteId: properties.satellite_id,
        reward: properties.reward,
      });
    } else if (kind === "station") {
      found.stations.push(place(geometry, properties.station_id, properties.name));
    } else if (kind === "visibility") {
      const polygons = geometry.type === "Polygon" ? [geometry.coordinates] : geometry.coordinates;
      found.circles.push({ stationId: properties.station_id, rings: polygons.flat() });
    } else if (kind === "track") {
      found.tracks.push(trackOf(geometry, properties));
    }
  }
  return found;
}

/**
 * @param {{coordinates: [number, number]}} geometry
 * @param {string} id
 * @param {string} name
 * @returns {Place}
 */
function place({ coordinates: [lon, lat] }, id, name) {
  return { id, name, lon, lat };
}

/**
 * @param {any} geometry
 * @param {any} properties
 * @returns {Track}
 */
function trackOf(geometry, properties) {
  const isOne = geometry.type === "LineString";
  /** @type {[number, number][][]} */
  const lines = isOne ? [geometry.coordinates] : geometry.coordinates;
  /** @type {string[][]} */
  const times = isOne ? [properties.times] : properties.times;
  const pieces = lines.map((line, i) => ({
    time: Float64Array.from(times[i] ?? [], (at) => Date.parse(at)),
    lon: Float64Array.from(line, (at) => at[0]),
    lat: Float64Array.from(line, (at) => at[1]),
  }));
  return { satelliteId: properties.satellite_id, name: properties.name, pieces };
}

/**
 * Return where a satellite is above the ground, or null outside its track.
 * @param {Track} track
 * @param {number} t
 * @returns {{lon: number, lat: number} | null}
 */
export function positionAt(track, t) {
  for (const { time, lon, lat } of track.pieces) {
    const i = firstAbove(time, t);
    if (i === 0 || i >= time.length) continue;
    const [from, to] = [/** @type {number} */ (time[i - 1]), /** @type {number} */ (time[i])];
    const share = (t - from) / (to - from);
    const between = (/** @type {Float64Array} */ values) =>
      /** @type {number} */ (values[i - 1]) * (1 - share) + /** @type {number} */ (values[i]) * share;
    return { lon: between(lon), lat: between(lat) };
  }
  return null;
}
