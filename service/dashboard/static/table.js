// @ts-check
/** Tables of any length: a page of rows at a time, or all rows of a table that is not too long. */

import { fill, h } from "./dom.js";
import { showError } from "./page.js";

const ROWS = 100;
/** More rows on one page would make it slow; the downloads have them all. */
const MOST_ROWS = 1000;
/** Rows made per frame. */
const AT_ONCE = 100;

/**
 * @template T
 * @typedef {object} Column
 * @property {string} title
 * @property {(row: T) => import("./dom.js").Child} cell
 * @property {boolean} [isNumber]
 */

/**
 * Rows in memory, or loaded when they are needed.
 * @template T
 * @typedef {object} Source
 * @property {number} length
 * @property {(key: string) => number} indexOf the index of the row with a key; -1 for none
 * @property {(first: number, end: number) => T[] | Promise<T[]>} load
 */

/**
 * A table that shows its rows page by page.
 * @template T
 */
export class PagedTable {
  /**
   * @param {string} caption
   * @param {Column<T>[]} columns
   * @param {(row: T) => string} keyOf identifies a row, to mark it
   */
  constructor(caption, columns, keyOf) {
    this.columns = columns;
    this.keyOf = keyOf;
    /** @type {Source<T>} */
    this.source = { length: 0, indexOf: () => -1, load: () => [] };
    this.first = 0;
    this.size = ROWS;
    this.numDrawn = 0;
    /** @type {Set<string>} */
    this.marked = new Set();
    /** @type {Map<string, HTMLTableRowElement>} the lines in the document, by key */
    this.lines = new Map();
    this.body = h("tbody");
    this.footer = h("p", { class: "pager" });
    const heads = columns.map((c) => h("th", { scope: "col", class: c.isNumber ? "number" : "" }, c.title));
    this.element = h(
      "div",
      {},
      h(
        "div",
        { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
        h("table", {}, h("caption", {}, caption), h("thead", {}, h("tr", {}, ...heads)), this.body),
      ),
      this.footer,
    );
  }

  /** @param {T[]} rows */
  show(rows) {
    this.showFrom({
      length: rows.length,
      indexOf: (key) => rows.findIndex((row) => this.keyOf(row) === key),
      load: (first, end) => rows.slice(first, end),
    });
  }

  /** @param {Source<T>} source */
  showFrom(source) {
    this.source = source;
    this.first = 0;
    this.size = ROWS;
    this.draw();
  }

  /**
   * Mark rows; turn to the page of the first one if it is not shown.
   * @param {Set<string>} keys
   */
  mark(keys) {
    this.marked = keys;
    const [key] = keys;
    const at = key === undefined || this.lines.has(key) ? -1 : this.source.indexOf(key);
    const isInSight = at >= this.first && at < this.first + this.size;
    if (at >= 0 && !isInSight) {
      this.first = Math.floor(at / this.size) * this.size;
      this.draw();
      return;
    }
    for (const [own, line] of this.lines) line.classList.toggle("marked", keys.has(own));
  }

  draw() {
    this.numDrawn += 1;
    const mine = this.numDrawn;
    const end = Math.min(this.first + this.size, this.source.length);
    const found = this.source.load(this.first, end);
    this.drawFooter(end);
    if (!(found instanceof Promise)) {
      this.fill(found);
      return;
    }
    this.element.setAttribute("aria-busy", "true");
    found
      .then((rows) => {
        if (mine === this.numDrawn) this.fill(rows);
      })
      .catch(showError)
      .finally(() => this.element.removeAttribute("aria-busy"));
  }

  /** @param {T[]} rows */
  fill(rows) {
    fill(this.body);
    this.lines.clear();
    this.append(rows, 0, this.numDrawn);
  }

  /**
   * Append rows from an index on, some now and the rest in the next frames.
   * @param {T[]} rows
   * @param {number} from
   * @param {number} mine the number of the drawing that the rows belong to
   */
  append(rows, from, mine) {
    if (mine !== this.numDrawn) return;
    const some = rows.slice(from, from + AT_ONCE);
    this.body.append(...some.map((row) => this.line(row)));
    if (from + AT_ONCE < rows.length) requestAnimationFrame(() => this.append(rows, from + AT_ONCE, mine));
  }

  /** @param {number} end */
  drawFooter(end) {
    const { length } = this.source;
    if (length <= this.size) {
      fill(this.footer, length > ROWS ? `${length} rows.` : "");
      return;
    }
    const last = Math.floor((length - 1) / this.size) * this.size;
    fill(
      this.footer,
      `Rows ${this.first + 1} to ${end} of ${length}. `,
      this.button("First", this.first > 0, () => (this.first = 0)),
      this.button("Earlier", this.first > 0, () => (this.first -= this.size)),
      this.button("Later", end < length, () => (this.first += this.size)),
      this.button("Last", end < length, () => (this.first = last)),
      length <= MOST_ROWS &&
        this.button("All", true, () => {
          this.first = 0;
          this.size = length;
        }),
    );
  }

  /** @param {T} row */
  line(row) {
    const key = this.keyOf(row);
    const cells = this.columns.map((column) =>
      h("td", { class: column.isNumber ? "number" : "" }, column.cell(row)),
    );
    const line = h("tr", { class: this.marked.has(key) ? "marked" : "" }, ...cells);
    this.lines.set(key, line);
    return line;
  }

  /**
   * @param {string} text
   * @param {boolean} isPossible
   * @param {() => void} change
   */
  button(text, isPossible, change) {
    const onclick = () => {
      change();
      this.draw();
    };
    return h("button", { type: "button", class: "quiet", disabled: !isPossible, onclick }, text);
  }
}
