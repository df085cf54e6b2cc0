// @ts-check
/** The map of the wall: land, night, stations and satellites where they are now. */

import { Canvas } from "./canvas.js";
import { positionAt } from "./geography.js";
import { writeNames } from "./labels.js";

/** @typedef {{geography: import("./geography.js").Geography, satelliteIds: string[]}} Layer */
/** @typedef {{name: string, lon: number, lat: number}} Named */

const RADIANS = Math.PI / 180;
const J2000_MS = Date.UTC(2000, 0, 1, 12);
const DAY_MS = 86_400_000;
const REDRAW_MS = 1000;

/**
 * Return where the sun is overhead, to about a hundredth of a degree (Astronomical Almanac).
 * @param {number} at milliseconds
 */
export function sunOverhead(at) {
  const days = (at - J2000_MS) / DAY_MS;
  const anomaly = (357.528 + 0.9856003 * days) * RADIANS;
  const meanLongitude = 280.46 + 0.9856474 * days;
  const longitude = (meanLongitude + 1.915 * Math.sin(anomaly) + 0.02 * Math.sin(2 * anomaly)) * RADIANS;
  const tilt = (23.439 - 4e-7 * days) * RADIANS;
  const ascension = Math.atan2(Math.cos(tilt) * Math.sin(longitude), Math.cos(longitude)) / RADIANS;
  const lat = Math.asin(Math.sin(tilt) * Math.sin(longitude)) / RADIANS;
  const turned = 280.46062 + 360.98564737 * days;
  return { lat, lon: ((((ascension - turned) % 360) + 540) % 360) - 180 };
}

export class WallMap {
  /**
   * @param {HTMLElement} host
   * @param {number[][]} land
   * @param {() => number} now
   */
  constructor(host, land, now) {
    this.now = now;
    /** @type {Layer[]} */
    this.layers = [];
    this.land = land;
    const label = "Map with land, the night side of the Earth, stations, and satellites where they are now.";
    this.canvas = new Canvas(host, label, (pen, width, height, colors) => this.draw(pen, width, height, colors));
    setInterval(() => this.canvas.redraw(), REDRAW_MS);
  }

  /** @param {Layer[]} layers */
  show(layers) {
    this.layers = layers;
    this.canvas.redraw();
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} height
   * @param {import("./canvas.js").Colors} colors
   */
  draw(pen, width, height, colors) {
    const x = (/** @type {number} */ lon) => ((lon + 180) / 360) * width;
    const y = (/** @type {number} */ lat) => ((90 - lat) / 180) * height;
    pen.fillStyle = colors.sea ?? "";
    pen.fillRect(0, 0, width, height);
    pen.fillStyle = colors.land ?? "";
    pen.beginPath();
    for (const ring of this.land) {
      for (let i = 0; i < ring.length; i += 2) pen.lineTo(x(Number(ring[i])), y(Number(ring[i + 1])));
      pen.closePath();
    }
    pen.fill();
    this.drawNight(pen, x, y, colors);
    const size = Math.max(12, width / 60);
    pen.font = `600 ${size}px system-ui, sans-serif`;
    const markOf = (/** @type {Named} */ { name, lon, lat }, /** @type {string | undefined} */ color) =>
      ({ name, x: x(lon), y: y(lat), reach: size / 2.5, color });
    const satellites = this.satellitesNow().map((one) => markOf(one, colors.ink));
    const stations = this.stations().map((one) => markOf(one, colors.contact));
    pen.fillStyle = colors.contact ?? "";
    for (const one of stations) drawStation(pen, one.x, one.y, one.reach);
    pen.fillStyle = colors.ink ?? "";
    for (const one of satellites) {
      pen.beginPath();
      pen.arc(one.x, one.y, one.reach, 0, 2 * Math.PI);
      pen.fill();
    }
    // Satellites are named first: operators know where their stations are.
    writeNames(pen, [...satellites, ...stations], { width, height }, size);
  }

  /** @returns {import("./geography.js").Place[]} the stations of all plans, each once */
  stations() {
    const all = this.layers.flatMap(({ geography }) => geography.stations);
    return [...new Map(all.map((one) => [one.id, one])).values()];
  }

  /** @returns {Named[]} */
  satellitesNow() {
    return this.layers.flatMap(({ geography, satelliteIds }) =>
      geography.tracks
        .filter((track) => satelliteIds.includes(track.satelliteId))
        .flatMap((track) => {
          const at = positionAt(track, this.now());
          return at === null ? [] : [{ name: track.name, ...at }];
        }),
    );
  }

  /**
   * Shade where the sun is below the horizon.
   * @param {CanvasRenderingContext2D} pen
   * @param {(lon: number) => number} x
   * @param {(lat: number) => number} y
   * @param {import("./canvas.js").Colors} colors
   */
  drawNight(pen, x, y, colors) {
    const sun = sunOverhead(this.now());
    // At the equinox the terminator is a meridian: a sun slightly off the equator avoids a division by zero.
    const tangent = Math.tan((Math.abs(sun.lat) < 0.01 ? 0.01 : sun.lat) * RADIANS);
    pen.fillStyle = colors.eclipse ?? "";
    pen.beginPath();
    for (let lon = -180; lon <= 180; lon += 1) {
      const lat = Math.atan(-Math.cos((lon - sun.lon) * RADIANS) / tangent) / RADIANS;
      pen.lineTo(x(lon), y(lat));
    }
    const dark = tangent > 0 ? -90 : 90;
    pen.lineTo(x(180), y(dark));
    pen.lineTo(x(-180), y(dark));
    pen.closePath();
    pen.fill();
  }
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number} x
 * @param {number} y
 * @param {number} reach
 */
function drawStation(pen, x, y, reach) {
  pen.beginPath();
  pen.moveTo(x, y - reach);
  pen.lineTo(x + reach, y + reach);
  pen.lineTo(x - reach, y + reach);
  pen.fill();
}
