// @ts-check
/** Reward and bound while a job runs, from the moment the page is opened. */

import { Canvas } from "./canvas.js";
import { bar, byId, fill } from "./dom.js";
import { gapOf, number, percent, secondsBetween } from "./format.js";
import { ProgressText } from "./progress_text.js";

/** @typedef {import("./types.js").JobOut} JobOut */

const HEIGHT = 160;
const LEFT = 60;

export class ProgressChart {
  constructor() {
    /** @type {{s: number, reward: number | null, bound: number | null}[]} */
    this.points = [];
    const label = "Reward and bound over the time of the search; the text above says the same.";
    this.canvas = new Canvas(byId("progress-chart"), label, (pen, width, height, colors) =>
      this.draw(pen, width, height, colors),
    );
    this.canvas.setHeight(HEIGHT);
    this.text = new ProgressText(byId("progress-text"));
  }

  /** @param {JobOut} job */
  show(job) {
    const { progress } = job;
    const seconds = secondsBetween(job.started_at, job.finished_at);
    this.text.show(job, textOf(job));
    fill(byId("progress-bar"), progress && bar(progress.fraction, `${progress.phase}, fraction done`));
    if (progress && seconds !== null) {
      this.points.push({ s: seconds, reward: progress.reward, bound: progress.bound });
      this.canvas.element.dataset.points = String(this.points.length);
      this.canvas.redraw();
    }
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} height
   * @param {import("./canvas.js").Colors} colors
   */
  draw(pen, width, height, colors) {
    const values = this.points.flatMap(({ reward, bound }) => [reward ?? 0, bound ?? 0]);
    const top = Math.max(...values, 1) * 1.08;
    const last = Math.max(this.points.at(-1)?.s ?? 1, 1);
    const first = Math.min(this.points[0]?.s ?? 0, last - 1);
    const x = (/** @type {number} */ s) => LEFT + ((s - first) / (last - first)) * (width - LEFT - 70);
    const y = (/** @type {number} */ value) => height - 22 - (value / top) * (height - 40);
    pen.strokeStyle = colors.line ?? "";
    pen.strokeRect(LEFT, 8, width - LEFT - 10, height - 30);
    pen.fillStyle = colors.soft ?? "";
    pen.fillText(number(top / 1.08), 4, y(top / 1.08));
    pen.fillText("0", 4, y(0));
    pen.fillText(`${number(first)} s`, LEFT, height - 8);
    pen.fillText(`${number(last)} s`, width - 60, height - 8);
    this.line(pen, x, y, "bound", colors.bad, [6, 4]);
    this.line(pen, x, y, "reward", colors.collect, []);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {(s: number) => number} x
   * @param {(value: number) => number} y
   * @param {"reward" | "bound"} name
   * @param {string | undefined} color
   * @param {number[]} dash
   */
  line(pen, x, y, name, color, dash) {
    pen.strokeStyle = pen.fillStyle = color ?? "";
    pen.setLineDash(dash);
    pen.lineWidth = 2;
    pen.beginPath();
    let isFirst = true;
    for (const point of this.points) {
      const value = point[name];
      if (value === null) continue;
      if (isFirst) pen.moveTo(x(point.s), y(value));
      else pen.lineTo(x(point.s), y(value));
      isFirst = false;
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.lineWidth = 1;
    const last = this.points.findLast((point) => point[name] !== null);
    if (last) pen.fillText(name, x(last.s) + 6, y(/** @type {number} */ (last[name])));
  }
}

/** @param {JobOut} job */
function textOf({ progress }) {
  if (!progress) return "";
  const parts = [`Phase ${progress.phase}`, `reward ${number(progress.reward)}`];
  parts.push(progress.bound === null ? "no bound yet" : `bound ${number(progress.bound)}`);
  const gap = gapOf(progress.reward, progress.bound);
  if (gap !== null) parts.push(`gap ${percent(gap)}`);
  if (progress.message) parts.push(progress.message);
  return parts.join(", ");
}
