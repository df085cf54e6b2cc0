// @ts-check
/** The map: land, stations with their circles, tracks, targets by outcome. Plate carree. */

import { Canvas } from "./canvas.js";
import { h } from "./dom.js";
import { utcLabelled } from "./format.js";
import { firstAbove } from "./plan.js";
import { positionAt } from "./geography.js";
import { writeNames } from "./labels.js";
import { takeMapInput } from "./map_input.js";
import { symbolOf } from "./symbols.js";

/** @typedef {import("./geography.js").Geography} Geography */
/** @typedef {import("./geography.js").Place} Place */
/** @typedef {import("./geography.js").TargetPlace} TargetPlace */
/** @typedef {import("./canvas.js").Colors} Colors */
/** @typedef {import("./labels.js").Mark} Mark */

/** @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Pen */

const REACH_PX = 8;
const FONT_PX = 12;
/** The height of the line at the bottom that says which instant is shown. */
const STATUS_PX = 20;
const TRACK_MS = 50 * 60_000;
/** If there are many satellites, except for the chosen one. */
const SHORT_TRACK_MS = 6 * 60_000;
/** Long tracks of more satellites would cover the map. */
const FEW = 10;
/** More targets are drawn smaller. */
const FEW_TARGETS = 2000;
/** Of targets with the same outcome that lie this close together, only one is drawn. */
const CELL_PX = 1.5;
const OUTCOMES = ["excluded", "unscheduled", "collected", "downlinked"];

export class WorldMap {
  /**
   * @param {HTMLElement} host
   * @param {Geography} geography
   * @param {number[][]} land
   * @param {import("./plan.js").Plan} plan
   * @param {import("./time_view.js").TimeView} view
   * @param {import("./selection.js").Selection} selection
   */
  constructor(host, geography, land, plan, view, selection) {
    this.geography = geography;
    this.plan = plan;
    this.view = view;
    this.selection = selection;
    this.zoom = 1;
    this.center = { lon: 0, lat: 0 };
    /** @type {{told: string, picture: OffscreenCanvas} | null} */
    this.drawnGround = null;
    // Rare outcomes are drawn on top.
    this.byOutcome = OUTCOMES.map((outcome) => ({
      outcome,
      targets: geography.targets.filter((target) => target.outcome === outcome),
    })).sort((a, b) => b.targets.length - a.targets.length);
    this.coast = new Path2D();
    for (const ring of land) {
      for (let i = 0; i < ring.length; i += 2) {
        this.coast.lineTo(/** @type {number} */ (ring[i]), /** @type {number} */ (ring[i + 1]));
      }
      this.coast.closePath();
    }
    /** The canvas in pixels: reading it anew for each point would cost more than everything else. */
    this.size = { width: 0, height: 0 };
    const label =
      "Map of targets by outcome, ground tracks around the chosen time, and stations with the " +
      "circles in which they see a satellite. Arrow keys move, plus and minus zoom, Enter selects the " +
      "next target; the table of targets holds the same data.";
    this.canvas = new Canvas(host, label, (pen, width, height, colors) => this.draw(pen, width, height, colors));
    this.tip = h("div", { class: "tip", hidden: true });
    host.append(this.tip);
    view.onChange(() => this.canvas.redraw());
    selection.onChange(() => this.canvas.redraw());
    takeMapInput(this);
  }

  /** The instant at which satellites are shown: the selected action's, else now, else the view's middle. */
  cursor() {
    const action = this.plan.actions.get(this.selection.now.actionId ?? "");
    if (action) return (Date.parse(action.start) + Date.parse(action.end)) / 2;
    const now = Date.now();
    if (now >= this.view.start && now <= this.view.end) return now;
    return (this.view.start + this.view.end) / 2;
  }

  scale() {
    return (this.size.width / 360) * this.zoom;
  }

  measure() {
    const { clientWidth: width, clientHeight: height } = this.canvas.element;
    this.size = { width, height };
  }

  /**
   * @param {number} lon
   * @param {number} lat
   * @returns {[number, number]}
   */
  xy(lon, lat) {
    const { width, height } = this.size;
    const scale = this.scale();
    return [width / 2 + (lon - this.center.lon) * scale, height / 2 - (lat - this.center.lat) * scale];
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} height
   * @param {Colors} colors
   */
  draw(pen, width, height, colors) {
    this.size = { width, height };
    pen.drawImage(this.ground(width, height, colors), 0, 0, width, height);
    const t = this.cursor();
    const satellites = this.geography.tracks.flatMap((track) => this.drawTrack(pen, track, t, colors) ?? []);
    const selected = this.drawSelected(pen, colors);
    const stations = this.geography.stations.map((station) => this.markOf(station, 6, colors.ink));
    const isChosen = (/** @type {Mark} */ mark) => mark.color === colors.chosen;
    // The chosen item is named before all others, and only once.
    const others = stations.filter(({ name }) => !selected.some((one) => one.name === name));
    const marks = [...selected, ...satellites.filter(isChosen), ...satellites.filter((one) => !isChosen(one)), ...others];
    writeNames(pen, marks, { width, height: height - STATUS_PX }, FONT_PX);
    pen.fillStyle = colors.ink ?? "";
    pen.fillText(`Satellites at ${utcLabelled(t)}`, 8, height - 10);
  }

  /**
   * Return a picture of everything that does not depend on time or selection, redrawn when the map is moved or zoomed.
   * @param {number} width
   * @param {number} height
   * @param {Colors} colors
   */
  ground(width, height, colors) {
    const { lon, lat } = this.center;
    const told = [width, height, devicePixelRatio, this.zoom, lon, lat, colors.sea].join();
    if (this.drawnGround?.told === told) return this.drawnGround.picture;
    const picture = new OffscreenCanvas(width * devicePixelRatio, height * devicePixelRatio);
    const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (picture.getContext("2d"));
    pen.scale(devicePixelRatio, devicePixelRatio);
    pen.font = this.canvas.pen.font;
    pen.fillStyle = colors.sea ?? "";
    pen.fillRect(0, 0, width, height);
    this.drawLand(pen, colors);
    this.drawCircles(pen, colors);
    const least = this.geography.targets.length > FEW_TARGETS ? 0.7 : 2.2;
    const size = Math.min(least + this.zoom / 2, 5);
    for (const { outcome, targets } of this.byOutcome) this.drawTargets(pen, outcome, targets, size, colors);
    for (const station of this.geography.stations) this.drawStation(pen, station, colors);
    this.drawnGround = { told, picture };
    return picture;
  }

  /**
   * @param {Pen} pen
   * @param {Colors} colors
   */
  drawLand(pen, colors) {
    const scale = this.scale();
    pen.save();
    pen.translate(...this.xy(0, 0));
    pen.scale(scale, -scale);
    pen.fillStyle = colors.land ?? "";
    pen.fill(this.coast, "evenodd");
    pen.restore();
    pen.strokeStyle = colors.line ?? "";
    pen.lineWidth = 0.5;
    pen.beginPath();
    for (let lon = -180; lon <= 180; lon += 30) {
      pen.moveTo(...this.xy(lon, -90));
      pen.lineTo(...this.xy(lon, 90));
    }
    for (let lat = -90; lat <= 90; lat += 30) {
      pen.moveTo(...this.xy(-180, lat));
      pen.lineTo(...this.xy(180, lat));
    }
    pen.stroke();
  }

  /**
   * @param {Pen} pen
   * @param {Colors} colors
   */
  drawCircles(pen, colors) {
    pen.strokeStyle = colors.contact ?? "";
    pen.lineWidth = 1;
    pen.setLineDash([3, 3]);
    for (const { rings } of this.geography.circles) {
      for (const ring of rings) {
        pen.beginPath();
        ring.forEach(([lon, lat], i) => (i === 0 ? pen.moveTo(...this.xy(lon, lat)) : pen.lineTo(...this.xy(lon, lat))));
        pen.stroke();
      }
    }
    pen.setLineDash([]);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {import("./geography.js").Track} track
   * @param {number} t
   * @param {Colors} colors
   * @returns {Mark | null} the satellite's mark at t; null outside its track
   */
  drawTrack(pen, track, t, colors) {
    const isChosen = track.satelliteId === this.selection.now.satelliteId;
    const isOneOfFew = this.geography.tracks.length <= FEW;
    const reach = isChosen || isOneOfFew ? TRACK_MS : SHORT_TRACK_MS;
    pen.strokeStyle = (isChosen ? colors.chosen : colors.soft) ?? "";
    pen.lineWidth = isChosen ? 2 : 1;
    pen.beginPath();
    for (const { time, lon, lat } of track.pieces) {
      const first = Math.max(firstAbove(time, t - reach) - 1, 0);
      for (let i = first; i < time.length && /** @type {number} */ (time[i]) <= t + reach; i++) {
        const [x, y] = this.xy(/** @type {number} */ (lon[i]), /** @type {number} */ (lat[i]));
        if (i === first) pen.moveTo(x, y);
        else pen.lineTo(x, y);
      }
    }
    pen.stroke();
    const at = positionAt(track, t);
    if (at === null) return null;
    const mark = this.markOf({ name: track.name, ...at }, 4, isChosen ? colors.chosen : colors.ink);
    pen.fillStyle = mark.color ?? "";
    pen.beginPath();
    pen.arc(mark.x, mark.y, mark.reach, 0, 2 * Math.PI);
    pen.fill();
    return mark;
  }

  /**
   * @param {{name: string, lon: number, lat: number}} place
   * @param {number} reach
   * @param {string | undefined} color
   * @returns {Mark}
   */
  markOf({ name, lon, lat }, reach, color) {
    const [x, y] = this.xy(lon, lat);
    return { name, x, y, reach, color };
  }

  /**
   * Draw the targets of an outcome, as many as can be told apart.
   * @param {Pen} pen
   * @param {string} outcome
   * @param {TargetPlace[]} targets
   * @param {number} size
   * @param {Colors} colors
   */
  drawTargets(pen, outcome, targets, size, colors) {
    const { width, height } = this.size;
    const columns = Math.ceil((width + 18) / CELL_PX);
    const taken = new Uint8Array(columns * Math.ceil((height + 18) / CELL_PX));
    const symbol = symbolOf(outcome, size, colors[outcome] ?? "");
    const half = symbol.width / devicePixelRatio / 2;
    for (const { lon, lat } of targets) {
      const [x, y] = this.xy(lon, lat);
      if (x < -9 || y < -9 || x > width + 9 || y > height + 9) continue;
      const cell = Math.floor((y + 9) / CELL_PX) * columns + Math.floor((x + 9) / CELL_PX);
      if (taken[cell]) continue;
      taken[cell] = 1;
      pen.drawImage(symbol, x - half, y - half, 2 * half, 2 * half);
    }
  }

  /**
   * @param {Pen} pen
   * @param {Place} station
   * @param {Colors} colors
   */
  drawStation(pen, station, colors) {
    const [x, y] = this.xy(station.lon, station.lat);
    pen.fillStyle = colors.contact ?? "";
    pen.beginPath();
    pen.moveTo(x, y - 6);
    pen.lineTo(x + 5.5, y + 4);
    pen.lineTo(x - 5.5, y + 4);
    pen.fill();
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {Colors} colors
   * @returns {Mark[]} the selected target or station, if any
   */
  drawSelected(pen, colors) {
    const { targetId, actionId } = this.selection.now;
    const stationId = this.plan.actions.get(actionId ?? "")?.station_id ?? null;
    const chosen =
      this.plan.target.get(targetId ?? "") ??
      this.geography.stations.find((place) => place.id === stationId);
    if (!chosen) return [];
    const mark = this.markOf(chosen, 10, colors.ink);
    pen.strokeStyle = colors.chosen ?? "";
    pen.lineWidth = 3;
    pen.beginPath();
    pen.arc(mark.x, mark.y, mark.reach, 0, 2 * Math.PI);
    pen.stroke();
    return [mark];
  }

  /**
   * @param {number} x
   * @param {number} y
   * @returns {TargetPlace | null}
   */
  targetAt(x, y) {
    this.measure();
    let best = null;
    let least = REACH_PX;
    for (const target of this.geography.targets) {
      const [tx, ty] = this.xy(target.lon, target.lat);
      const away = Math.hypot(tx - x, ty - y);
      if (away < least) [best, least] = [target, away];
    }
    return best;
  }

  /**
   * @param {number} factor
   * @param {number} [x] the point that stays in place
   * @param {number} [y]
   */
  zoomBy(factor, x = this.size.width / 2, y = this.size.height / 2) {
    const { width, height } = this.size;
    const before = this.scale();
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), 40);
    const shrink = 1 / before - 1 / this.scale();
    this.center.lon += (x - width / 2) * shrink;
    this.center.lat -= (y - height / 2) * shrink;
    this.keepInside();
  }

  keepInside() {
    const half = 180 / this.zoom;
    this.center.lon = Math.min(Math.max(this.center.lon, half - 180), 180 - half);
    this.center.lat = Math.min(Math.max(this.center.lat, half / 2 - 90), 90 - half / 2);
    this.canvas.redraw();
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  hover(x, y) {
    const target = this.targetAt(x, y);
    this.tip.hidden = target === null;
    this.tip.textContent = target && `${target.title}: ${target.outcome}`;
    this.tip.style.left = `${Math.min(x + 12, this.canvas.element.clientWidth - 200)}px`;
    this.tip.style.top = `${y + 14}px`;
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  click(x, y) {
    const target = this.targetAt(x, y);
    if (target) {
      this.selection.select(this.plan.aboutTarget(target.id));
      this.selection.open({ element: this.canvas.element, x, y });
    } else this.selection.clear();
  }
}
