// @ts-check
/** Battery and recorder of one satellite over time, with their limits. */

import { Canvas } from "./canvas.js";
import { percent, utc } from "./format.js";
import { drawAxis, drawNow, MARGIN } from "./gantt.js";
import { firstAbove } from "./plan.js";
import { takeTimeInput } from "./time_view.js";

/** @typedef {import("./plan.js").Curves} Curves */
/** @typedef {import("./canvas.js").Colors} Colors */

const PLOT = 110;
const GAP = 18;
const AXIS = 24;

export class CurveChart {
  /**
   * @param {HTMLElement} host
   * @param {import("./plan.js").Plan} plan
   * @param {import("./time_view.js").TimeView} view
   * @param {import("./selection.js").Selection} selection
   */
  constructor(host, plan, view, selection) {
    this.plan = plan;
    this.view = view;
    this.selection = selection;
    this.row = 0;
    const label =
      "Battery and recorder of the chosen satellite over time, with their limits; the table " +
      "of battery and recorder holds the same data.";
    this.canvas = new Canvas(host, label, (pen, width, height, colors) => this.draw(pen, width, height, colors));
    this.canvas.setHeight(2 * PLOT + 2 * GAP + AXIS);
    view.onChange(() => this.canvas.redraw());
    selection.onChange(() => this.canvas.redraw());
    takeTimeInput(this.canvas.element, view, MARGIN, () => {});
  }

  /** @param {number} row */
  choose(row) {
    this.row = row;
    this.canvas.redraw();
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} height
   * @param {Colors} colors
   */
  draw(pen, width, height, colors) {
    const bottom = height - AXIS;
    drawAxis(pen, this.view, width, bottom, colors);
    const curves = this.plan.rows[this.row]?.curves;
    if (!curves) return;
    const { batteryMin, recorderMax, time } = curves;
    this.plot(pen, width, GAP, time, curves.battery, { name: "Battery", limit: batteryMin, isFloor: true, color: colors.battery }, colors);
    this.plot(pen, width, PLOT + 2 * GAP, time, curves.recorder, { name: "Recorder", limit: recorderMax, isFloor: false, color: colors.recorder }, colors);
    drawNow(pen, this.view, width, bottom, colors);
    this.markSelected(pen, width, bottom, colors);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} top
   * @param {Float64Array} time
   * @param {number[]} values
   * @param {{name: string, limit: number, isFloor: boolean, color: string | undefined}} what
   * @param {Colors} colors
   */
  plot(pen, width, top, time, values, what, colors) {
    const y = (/** @type {number} */ value) => top + PLOT * (1 - value);
    const span = width - MARGIN.left - MARGIN.right;
    pen.strokeStyle = colors.line ?? "";
    pen.strokeRect(MARGIN.left, top, span, PLOT);
    pen.fillStyle = colors.ink ?? "";
    pen.fillText(what.name, 4, top + PLOT / 2 - 8);
    pen.fillStyle = colors.soft ?? "";
    pen.fillText("fraction", 4, top + PLOT / 2 + 8);
    pen.textAlign = "right";
    for (const value of [0, 0.5, 1]) pen.fillText(String(value), MARGIN.left - 6, y(value));
    pen.textAlign = "left";
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, top - 2, span, PLOT + 4);
    pen.clip();
    pen.strokeStyle = colors.bad ?? "";
    pen.setLineDash([6, 4]);
    pen.beginPath();
    pen.moveTo(MARGIN.left, y(what.limit));
    pen.lineTo(width - MARGIN.right, y(what.limit));
    pen.stroke();
    pen.setLineDash([]);
    pen.strokeStyle = what.color ?? "";
    pen.lineWidth = 1.8;
    this.trace(pen, span, time, values, y);
    pen.lineWidth = 1;
    pen.restore();
    const side = what.isFloor ? "minimum" : "maximum";
    pen.fillStyle = colors.bad ?? "";
    pen.fillText(`${side} ${percent(what.limit)}`, MARGIN.left + 6, y(what.limit) + (what.isFloor ? 9 : -9));
    pen.fillStyle = colors.soft ?? "";
    // On the right, since the text of a high limit on the left may reach up to here.
    pen.textAlign = "right";
    pen.fillText(`${what.name}: ${extreme(time, values, what.isFloor)}`, width - MARGIN.right, top - 8);
    pen.textAlign = "left";
  }

  /**
   * Draw a curve; within a column of pixels, values between those already drawn are skipped.
   * @param {CanvasRenderingContext2D} pen
   * @param {number} span
   * @param {Float64Array} time
   * @param {number[]} values
   * @param {(value: number) => number} y
   */
  trace(pen, span, time, values, y) {
    const scale = span / (this.view.end - this.view.start);
    const first = Math.max(firstAbove(time, this.view.start) - 1, 0);
    let column = -Infinity;
    let low = Infinity;
    let high = -Infinity;
    pen.beginPath();
    for (let i = first; i < time.length; i++) {
      const x = MARGIN.left + (/** @type {number} */ (time[i]) - this.view.start) * scale;
      const value = /** @type {number} */ (values[i]);
      if (Math.floor(x) === column && value >= low && value <= high) continue;
      if (Math.floor(x) !== column) [column, low, high] = [Math.floor(x), value, value];
      low = Math.min(low, value);
      high = Math.max(high, value);
      if (i === first) pen.moveTo(x, y(value));
      else pen.lineTo(x, y(value));
      if (/** @type {number} */ (time[i]) > this.view.end) break;
    }
    pen.stroke();
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} bottom
   * @param {Colors} colors
   */
  markSelected(pen, width, bottom, colors) {
    const action = this.plan.actions.get(this.selection.now.actionId ?? "");
    if (!action) return;
    const scale = (width - MARGIN.left - MARGIN.right) / (this.view.end - this.view.start);
    const x = (/** @type {string} */ at) => MARGIN.left + (Date.parse(at) - this.view.start) * scale;
    const left = Math.max(x(action.start), MARGIN.left);
    const right = Math.min(x(action.end), width - MARGIN.right);
    if (right < left) return;
    pen.strokeStyle = colors.chosen ?? "";
    pen.lineWidth = 2;
    pen.strokeRect(left, 2, Math.max(right - left, 2), bottom - 4);
    pen.lineWidth = 1;
  }
}

/**
 * @param {Float64Array} time
 * @param {number[]} values
 * @param {boolean} isLowest
 */
function extreme(time, values, isLowest) {
  let at = 0;
  for (let i = 1; i < values.length; i++) {
    const [now, best] = [/** @type {number} */ (values[i]), /** @type {number} */ (values[at])];
    if (isLowest ? now < best : now > best) at = i;
  }
  const word = isLowest ? "lowest" : "highest";
  return `${word} ${percent(values[at])} at ${utc(time[at])} UTC`;
}
