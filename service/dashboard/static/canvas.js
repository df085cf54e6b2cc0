// @ts-check
/** Canvases that adapt to their width, the screen's resolution and the colours of the page. */

import { h } from "./dom.js";

const DARK = matchMedia("(prefers-color-scheme: dark)");

/** @typedef {Record<string, string>} Colors */

/** @returns {Colors} the page's custom properties, by name without dashes */
function readColors() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "ink", "soft", "line", "paper", "collect", "contact", "sunpoint", "slew", "eclipse", "chosen",
    "bad", "land", "sea", "downlinked", "collected", "unscheduled", "excluded", "battery", "recorder",
  ];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** A canvas that is drawn at most once per frame. */
export class Canvas {
  /**
   * @param {HTMLElement} host
   * @param {string} label what the picture shows, for screen readers
   * @param {(pen: CanvasRenderingContext2D, width: number, height: number, colors: Colors) => void} draw
   */
  constructor(host, label, draw) {
    this.element = h("canvas", { tabindex: 0, role: "img", "aria-label": label });
    const pen = this.element.getContext("2d");
    if (pen === null) throw new Error("This browser does not support canvases.");
    this.pen = pen;
    this.draw = draw;
    this.colors = readColors();
    this.isDue = false;
    this.numDrawn = 0;
    host.append(this.element);
    new ResizeObserver(() => this.redraw()).observe(this.element);
    DARK.addEventListener("change", () => {
      this.colors = readColors();
      this.redraw();
    });
  }

  /** @param {number} height */
  setHeight(height) {
    this.element.style.height = `${height}px`;
    this.redraw();
  }

  redraw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.paint();
    });
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    const scale = devicePixelRatio;
    const pixels = [Math.round(width * scale), Math.round(height * scale)];
    if (this.element.width !== pixels[0] || this.element.height !== pixels[1]) {
      [this.element.width, this.element.height] = /** @type {[number, number]} */ (pixels);
    }
    this.pen.setTransform(scale, 0, 0, scale, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.pen.font = "12px system-ui, sans-serif";
    this.pen.textBaseline = "middle";
    this.draw(this.pen, width, height, this.colors);
    this.numDrawn += 1;
    this.element.dataset.drawn = String(this.numDrawn);
  }
}

/**
 * Shorten a text to a width.
 * @param {CanvasRenderingContext2D} pen
 * @param {string} text
 * @param {number} width
 */
export function fitted(pen, text, width) {
  if (pen.measureText(text).width <= width) return text;
  let length = text.length;
  while (length > 1 && pen.measureText(`${text.slice(0, length)}…`).width > width) length -= 1;
  return `${text.slice(0, length)}…`;
}
