// @ts-check
/** The time span that all panels show, and the ticks of its axis. */

const SHORTEST_MS = 10_000;
const SECOND = 1000;
const MINUTE = 60 * SECOND;
const HOUR = 60 * MINUTE;
const DAY = 24 * HOUR;
const STEPS = [
  SECOND, 5 * SECOND, 10 * SECOND, 30 * SECOND, MINUTE, 2 * MINUTE, 5 * MINUTE, 10 * MINUTE,
  20 * MINUTE, 30 * MINUTE, HOUR, 2 * HOUR, 3 * HOUR, 6 * HOUR, 12 * HOUR, DAY, 2 * DAY, 7 * DAY,
];

export class TimeView {
  /**
   * @param {number} min
   * @param {number} max
   */
  constructor(min, max) {
    this.min = min;
    this.max = max;
    this.start = min;
    this.end = max;
    /** @type {(() => void)[]} */
    this.listeners = [];
  }

  /** @param {() => void} listener */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /**
   * Show a span, kept within the horizon.
   * @param {number} start
   * @param {number} end
   */
  set(start, end) {
    const length = Math.min(Math.max(end - start, SHORTEST_MS), this.max - this.min);
    this.start = Math.min(Math.max(start, this.min), this.max - length);
    this.end = this.start + length;
    for (const listener of this.listeners) listener();
  }

  /** @param {number} ms */
  pan(ms) {
    this.set(this.start + ms, this.end + ms);
  }

  /**
   * @param {number} factor below 1 zooms in
   * @param {number} [at] the instant that stays in place
   */
  zoom(factor, at = (this.start + this.end) / 2) {
    const wanted = Math.min(Math.max((this.end - this.start) * factor, SHORTEST_MS), this.max - this.min);
    const share = (at - this.start) / (this.end - this.start);
    this.set(at - share * wanted, at + (1 - share) * wanted);
  }

  all() {
    this.set(this.min, this.max);
  }

  /**
   * Centre a span, unless all of it is visible already.
   * @param {number} start
   * @param {number} end
   */
  reveal(start, end) {
    if (start >= this.start && end <= this.end) return;
    const length = this.end - this.start;
    const middle = (start + end) / 2;
    this.set(middle - length / 2, middle + length / 2);
  }

  /**
   * Return ticks at round UTC instants, as many as fit.
   * @param {number} width in pixels
   * @returns {{at: number, text: string}[]}
   */
  ticks(width) {
    const least = ((this.end - this.start) * 90) / Math.max(width, 1);
    const step = STEPS.find((one) => one >= least) ?? /** @type {number} */ (STEPS.at(-1));
    const ticks = [];
    for (let at = Math.ceil(this.start / step) * step; at <= this.end; at += step) {
      const text = new Date(at).toISOString();
      const isDay = at % DAY === 0;
      const clock = text.slice(11, step < MINUTE ? 19 : 16);
      ticks.push({ at, text: isDay || ticks.length === 0 ? `${text.slice(5, 10)} ${clock}` : clock });
    }
    return ticks;
  }
}

/**
 * Let a pointer, a wheel and keys move the view: drag, sideways wheel, Ctrl and wheel, arrows, + and -.
 * @param {HTMLCanvasElement} canvas
 * @param {TimeView} view
 * @param {{left: number, right: number}} margin of the time axis within the canvas
 * @param {(x: number, y: number) => void} onClick
 */
export function takeTimeInput(canvas, view, margin, onClick) {
  const width = () => Math.max(canvas.clientWidth - margin.left - margin.right, 1);
  const perPixel = () => (view.end - view.start) / width();
  const at = (/** @type {number} */ x) => view.start + (x - margin.left) * perPixel();
  /** @type {{x: number, start: number, hasMoved: boolean} | null} */
  let grip = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    grip = { x: event.offsetX, start: view.start, hasMoved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (grip === null) return;
    const moved = event.offsetX - grip.x;
    if (Math.abs(moved) < 4 && !grip.hasMoved) return;
    grip.hasMoved = true;
    const start = grip.start - moved * perPixel();
    view.set(start, start + (view.end - view.start));
  });
  canvas.addEventListener("pointerup", (event) => {
    if (grip !== null && !grip.hasMoved) onClick(event.offsetX, event.offsetY);
    grip = null;
  });
  canvas.addEventListener("pointercancel", () => {
    grip = null;
  });
  canvas.addEventListener("dblclick", (event) => view.zoom(0.5, at(event.offsetX)));
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (event.ctrlKey || event.metaKey) view.zoom(2 ** (event.deltaY / 200), at(event.offsetX));
      else if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) view.pan(event.deltaX * perPixel());
      else return; // the page scrolls
      event.preventDefault();
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const step = (view.end - view.start) / 10;
    const moves = /** @type {Record<string, () => void>} */ ({
      ArrowLeft: () => view.pan(-step),
      ArrowRight: () => view.pan(step),
      "+": () => view.zoom(0.7),
      "-": () => view.zoom(1 / 0.7),
      Home: () => view.all(),
    });
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  });
}
