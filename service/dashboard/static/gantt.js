// @ts-check
/** The Gantt chart: a row for each satellite, with a lane for each kind of action. */

import { Canvas, fitted } from "./canvas.js";
import { h } from "./dom.js";
import { number, utc } from "./format.js";
import { Lane } from "./plan.js";
import { takeTimeInput } from "./time_view.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Row} Row */
/** @typedef {import("./types.js").Action} Action */
/** @typedef {import("./types.js").OpportunityOut} OpportunityOut */

export const MARGIN = { left: 120, right: 12 };
const AXIS = 24;
const REACH_PX = 4;

/** With more rows the lower axis may be off the screen: there is a second one above. */
const FEW_ROWS = 8;

/** @typedef {Record<"collects" | "slews" | "opportunities" | "contacts" | "sunpoints", [number, number]>} Lanes */

/**
 * Lanes of a row, as shares of its height from the top.
 * @type {Lanes}
 */
const LANES = {
  collects: [0.08, 0.36],
  slews: [0.16, 0.28],
  opportunities: [0.4, 0.52],
  contacts: [0.56, 0.78],
  sunpoints: [0.86, 0.92],
};

/**
 * The same for plans that only take images.
 * @type {Lanes}
 */
const IMAGING_LANES = { ...LANES, collects: [0.1, 0.6], slews: [0.24, 0.46], opportunities: [0.68, 0.9] };

export class Gantt {
  /**
   * @param {HTMLElement} host
   * @param {Plan} plan
   * @param {import("./time_view.js").TimeView} view
   * @param {import("./selection.js").Selection} selection
   */
  constructor(host, plan, view, selection) {
    this.plan = plan;
    this.view = view;
    this.selection = selection;
    /** @type {Map<string, Lane<OpportunityOut>>} unused opportunities by satellite */
    this.opportunities = new Map();
    /** @type {Map<string, Lane<OpportunityOut>>} those of the selected target, by satellite */
    this.ofTarget = new Map();
    /** @type {Set<string>} */
    this.blocking = new Set();
    const isFull = plan.rows.some((row) => row.contacts.start.length > 0 || row.sunpoints.start.length > 0);
    this.lanes = isFull ? LANES : IMAGING_LANES;
    this.heights = isFull ? [88, 56, 40] : [56, 36, 24];
    this.top = plan.rows.length > FEW_ROWS ? AXIS : 0;
    const label =
      "Gantt chart: collects, contacts, slews, sun-pointing and eclipses of each satellite. " +
      "Arrow keys move, plus and minus zoom, Enter selects the next action; the tables below hold the same data.";
    this.canvas = new Canvas(host, label, (pen, width, height, colors) => this.draw(pen, width, height, colors));
    this.canvas.setHeight(this.top + plan.rows.length * this.rowHeight() + AXIS);
    this.tip = h("div", { class: "tip", hidden: true });
    host.append(this.tip);
    view.onChange(() => this.canvas.redraw());
    selection.onChange(() => this.canvas.redraw());
    setInterval(() => this.canvas.redraw(), 30_000); // the line that marks now moves
    const element = this.canvas.element;
    takeTimeInput(element, view, MARGIN, (x, y) => this.click(x, y));
    element.addEventListener("pointermove", (event) => this.hover(event.offsetX, event.offsetY));
    element.addEventListener("pointerleave", () => {
      this.tip.hidden = true;
    });
    element.addEventListener("keydown", (event) => {
      if (event.key === "Escape") selection.clear();
      if (event.key === "Enter") this.step(event.shiftKey ? -1 : 1);
      if (event.key === " ") this.openByKey(event);
    });
  }

  /**
   * Select the action after or before the selected one, or the first visible action if that one is not visible.
   * @param {1 | -1} by
   */
  step(by) {
    const actions = [...this.plan.actions.values()].sort((a, b) => Date.parse(a.start) - Date.parse(b.start));
    const { start, end } = this.view;
    const isInSight = (/** @type {Action} */ one) => Date.parse(one.end) > start && Date.parse(one.start) < end;
    const now = actions.findIndex((one) => one.id === this.selection.now.actionId);
    const chosen = actions[now];
    const next = chosen && isInSight(chosen) ? actions[now + by] : actions.find(isInSight);
    if (next) this.selection.select(this.plan.about(next.id));
  }

  rowHeight() {
    const { length } = this.plan.rows;
    return /** @type {number} */ (this.heights[length > 16 ? 2 : length > 4 ? 1 : 0]);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} height
   * @param {import("./canvas.js").Colors} colors
   */
  draw(pen, width, height, colors) {
    const { view } = this;
    const span = width - MARGIN.left - MARGIN.right;
    const bottom = height - AXIS;
    drawAxis(pen, view, width, bottom, colors, this.top);
    let numBars = 0;
    this.plan.rows.forEach((row, index) => {
      const top = this.top + index * this.rowHeight();
      pen.fillStyle = colors.ink ?? "";
      pen.fillText(fitted(pen, row.name, MARGIN.left - 12), 4, top + this.rowHeight() / 2);
      pen.save();
      pen.beginPath();
      pen.rect(MARGIN.left, top, span, this.rowHeight());
      pen.clip();
      numBars += this.drawRow(pen, row, top, span, colors);
      pen.restore();
      pen.fillStyle = colors.line ?? "";
      pen.fillRect(0, top + this.rowHeight() - 1, width, 1);
    });
    drawNow(pen, view, width, bottom, colors);
    // Tests check that the work depends on pixels, not on the number of actions.
    this.canvas.element.dataset.bars = String(numBars);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {Row} row
   * @param {number} top
   * @param {number} span
   * @param {import("./canvas.js").Colors} colors
   */
  drawRow(pen, row, top, span, colors) {
    const height = this.rowHeight();
    const painter = new LanePainter(pen, this.view, span);
    const place = (/** @type {keyof Lanes} */ lane) => {
      const [from, to] = this.lanes[lane];
      return /** @type {[number, number]} */ ([top + from * height, (to - from) * height]);
    };
    painter.fill(row.eclipses, [top, height], colors.eclipse);
    painter.fill(row.sunpoints, place("sunpoints"), colors.sunpoint);
    painter.fill(row.slews, place("slews"), colors.slew);
    painter.fill(row.collects, place("collects"), colors.collect);
    painter.fill(row.contacts, place("contacts"), colors.contact);
    const unused = this.opportunities.get(row.id);
    if (unused) painter.outline(unused, place("opportunities"), { color: colors.soft, width: 1 }, () => true);
    const ofTarget = this.ofTarget.get(row.id);
    if (ofTarget) painter.outline(ofTarget, place("opportunities"), { color: colors.chosen, width: 2 }, () => true);
    const { actionId, targetId } = this.selection.now;
    const isChosen = (/** @type {Action} */ a) => a.id === actionId || (targetId !== null && a.target_id === targetId);
    const isBlocking = (/** @type {Action} */ a) => this.blocking.has(a.id);
    for (const lane of /** @type {const} */ (["collects", "contacts", "sunpoints"])) {
      const blocks = { color: colors.bad, width: 1.5, dash: [4, 3] };
      if (this.blocking.size > 0) painter.outline(row[lane], place(lane), blocks, isBlocking);
      const chosen = { color: colors.chosen, width: 2.5 };
      if (actionId !== null || targetId !== null) painter.outline(row[lane], place(lane), chosen, isChosen);
    }
    return painter.numBars;
  }

  /**
   * Return the row under a point, the instant, the pointer's reach in milliseconds, and how far down the row (0 to 1).
   * @param {number} x
   * @param {number} y
   */
  locate(x, y) {
    const span = this.canvas.element.clientWidth - MARGIN.left - MARGIN.right;
    const perPixel = (this.view.end - this.view.start) / span;
    const down = (y - this.top) / this.rowHeight();
    const row = this.plan.rows[Math.floor(down)];
    const isInside = x >= MARGIN.left && x <= MARGIN.left + span;
    if (!row || !isInside) return null;
    return { row, t: this.view.start + (x - MARGIN.left) * perPixel, reach: REACH_PX * perPixel, y: down % 1 };
  }

  /**
   * @param {number} x
   * @param {number} y
   * @returns {Action | null}
   */
  actionAt(x, y) {
    const found = this.locate(x, y);
    if (!found) return null;
    const { row, t, reach } = found;
    const isLow = found.y > this.lanes.opportunities[1];
    const lanes = isLow ? [row.contacts, row.collects] : [row.collects, row.contacts];
    const near = lanes.map((lane) => lane.nearest(t, reach)).find((action) => action !== null);
    return near ?? row.sunpoints.nearest(t, 0);
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  click(x, y) {
    const action = this.actionAt(x, y);
    if (action) {
      this.selection.select(this.plan.about(action.id));
      this.selection.open({ element: this.canvas.element, x, y });
    } else this.selection.clear();
  }

  /**
   * Open the menu of the selected action at its position.
   * @param {KeyboardEvent} event
   */
  openByKey(event) {
    event.preventDefault(); // the page would scroll
    const { actionId, satelliteId } = this.selection.now;
    const action = this.plan.actions.get(actionId ?? "");
    const row = this.plan.rows.findIndex(({ id }) => id === satelliteId);
    if (!action || row < 0) return;
    const element = this.canvas.element;
    const span = element.clientWidth - MARGIN.left - MARGIN.right;
    const share = (Date.parse(action.start) - this.view.start) / (this.view.end - this.view.start);
    const x = MARGIN.left + Math.min(Math.max(share, 0), 1) * span;
    this.selection.open({ element, x, y: this.top + (row + 0.5) * this.rowHeight() });
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  hover(x, y) {
    const found = this.locate(x, y);
    const lanes = found ? [this.ofTarget.get(found.row.id), this.opportunities.get(found.row.id)] : [];
    const unused = found && lanes.map((lane) => lane?.nearest(found.t, found.reach)).find((one) => one);
    const isOnUnused = found && found.y >= this.lanes.opportunities[0] && found.y <= this.lanes.opportunities[1];
    const action = this.actionAt(x, y);
    const text = isOnUnused && unused ? tellOpportunity(unused) : action && tellAction(action);
    this.tip.hidden = !text;
    this.tip.textContent = text;
    this.tip.style.left = `${Math.min(x + 12, this.canvas.element.clientWidth - 260)}px`;
    this.tip.style.top = `${y + 16}px`;
  }
}

/** Draws spans as bars; skips those on pixels that are painted already. */
class LanePainter {
  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {import("./time_view.js").TimeView} view
   * @param {number} span
   */
  constructor(pen, view, span) {
    this.pen = pen;
    this.view = view;
    this.scale = span / (view.end - view.start);
    this.numBars = 0;
  }

  /** @param {number} t */
  x(t) {
    return MARGIN.left + (t - this.view.start) * this.scale;
  }

  /**
   * @param {Lane<any>} lane
   * @param {[number, number]} place top and height
   * @param {string | undefined} color
   */
  fill(lane, [top, height], color) {
    this.pen.fillStyle = color ?? "";
    const onePixel = 1 / this.scale;
    for (let i = lane.firstPast(this.view.start); i < lane.start.length; ) {
      const start = /** @type {number} */ (lane.start[i]);
      if (start > this.view.end) break;
      const end = Math.max(/** @type {number} */ (lane.end[i]), start + onePixel);
      // Half a pixel less than the span, so that narrow gaps stay visible.
      this.pen.fillRect(this.x(start), top, Math.max((end - start) * this.scale - 0.5, 1), height);
      this.numBars += 1;
      i = Math.max(i + 1, end - start <= onePixel ? lane.firstPast(end) : i + 1);
    }
  }

  /**
   * @template T
   * @param {Lane<T>} lane
   * @param {[number, number]} place
   * @param {{color: string | undefined, width: number, dash?: number[]}} line
   * @param {(of: T) => boolean} isWanted
   */
  outline(lane, [top, height], line, isWanted) {
    this.pen.strokeStyle = line.color ?? "";
    this.pen.lineWidth = line.width;
    this.pen.setLineDash(line.dash ?? []);
    let painted = -Infinity;
    for (let i = lane.firstPast(this.view.start); i < lane.start.length; i++) {
      const start = /** @type {number} */ (lane.start[i]);
      if (start > this.view.end) break;
      if (!isWanted(/** @type {T} */ (lane.of[i]))) continue;
      const left = this.x(start);
      const right = Math.max(this.x(/** @type {number} */ (lane.end[i])), left + 2);
      if (right < painted + 1) continue;
      this.pen.strokeRect(left, top, right - left, height);
      painted = right;
      this.numBars += 1;
    }
    this.pen.setLineDash([]);
  }
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {import("./time_view.js").TimeView} view
 * @param {number} width
 * @param {number} bottom where the plot ends
 * @param {import("./canvas.js").Colors} colors
 * @param {number} [top] height above the plot for instants there too; 0 for none
 */
export function drawAxis(pen, view, width, bottom, colors, top = 0) {
  const span = width - MARGIN.left - MARGIN.right;
  for (const { at, text } of view.ticks(span)) {
    const x = MARGIN.left + ((at - view.start) / (view.end - view.start)) * span;
    pen.fillStyle = colors.line ?? "";
    pen.fillRect(x, 0, 1, bottom + 4);
    pen.fillStyle = colors.soft ?? "";
    if (x + 3 + pen.measureText(text).width > width) continue;
    pen.fillText(text, x + 3, bottom + 13);
    if (top > 0) pen.fillText(text, x + 3, top - 11);
  }
  pen.fillStyle = colors.soft ?? "";
  pen.fillText("UTC", 4, bottom + 13);
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {import("./time_view.js").TimeView} view
 * @param {number} width
 * @param {number} bottom
 * @param {import("./canvas.js").Colors} colors
 */
export function drawNow(pen, view, width, bottom, colors) {
  const now = Date.now();
  if (now < view.start || now > view.end) return;
  const span = width - MARGIN.left - MARGIN.right;
  const x = MARGIN.left + ((now - view.start) / (view.end - view.start)) * span;
  pen.fillStyle = colors.bad ?? "";
  pen.fillRect(x - 1, 0, 2, bottom);
  pen.fillText("now", x + 4, 8);
}

/** @param {Action} action */
export function tellAction(action) {
  const what = action.target_name ?? action.target_id ?? action.station_name ?? action.station_id ?? "";
  const angle = action.off_nadir_deg === null ? "" : `, ${number(action.off_nadir_deg)}° off nadir`;
  return `${action.mode} ${what}: ${utc(action.start)} to ${utc(action.end).slice(11)} UTC${angle}`;
}

/** @param {OpportunityOut} one */
function tellOpportunity(one) {
  const what = one.target_name ?? one.target_id ?? one.station_name ?? one.station_id ?? "";
  return `opportunity, ${one.kind} ${what}: ${utc(one.start)} to ${utc(one.end).slice(11)} UTC, ${number(one.off_nadir_deg)}° off nadir`;
}
