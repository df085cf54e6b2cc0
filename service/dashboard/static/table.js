// @ts-check
/** Tables of any length: a page of rows at a time, all of them for print. */

import { fill, h } from "./dom.js";

const ROWS = 100;

/**
 * @template T
 * @typedef {object} Column
 * @property {string} title
 * @property {(row: T) => import("./dom.js").Child} cell
 * @property {boolean} [isNumber]
 */

/**
 * A table that shows its rows page by page.
 * @template T
 */
export class PagedTable {
  /**
   * @param {string} caption
   * @param {Column<T>[]} columns
   * @param {(row: T) => string} keyOf names a row, to mark it
   */
  constructor(caption, columns, keyOf) {
    this.columns = columns;
    this.keyOf = keyOf;
    /** @type {T[]} */
    this.rows = [];
    this.first = 0;
    this.size = ROWS;
    /** @type {Set<string>} */
    this.marked = new Set();
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
    this.rows = rows;
    this.first = 0;
    this.draw();
  }

  /**
   * Mark rows; turn to the page of the first one if none is in sight.
   * @param {Set<string>} keys
   */
  mark(keys) {
    this.marked = keys;
    if (keys.size > 0) {
      const at = this.rows.findIndex((row) => keys.has(this.keyOf(row)));
      const isInSight = at >= this.first && at < this.first + this.size;
      if (at >= 0 && !isInSight) this.first = Math.floor(at / this.size) * this.size;
    }
    this.draw();
  }

  draw() {
    const shown = this.rows.slice(this.first, this.first + this.size);
    fill(this.body, ...shown.map((row) => this.line(row)));
    const { length } = this.rows;
    if (length <= this.size) {
      fill(this.footer, length > ROWS ? `${length} rows.` : "");
      return;
    }
    const last = Math.min(this.first + this.size, length);
    fill(
      this.footer,
      `Rows ${this.first + 1} to ${last} of ${length}. `,
      this.button("Earlier", this.first > 0, () => (this.first -= this.size)),
      this.button("Later", last < length, () => (this.first += this.size)),
      this.button("All", true, () => {
        this.first = 0;
        this.size = length;
      }),
    );
  }

  /** @param {T} row */
  line(row) {
    const cells = this.columns.map((column) =>
      h("td", { class: column.isNumber ? "number" : "" }, column.cell(row)),
    );
    return h("tr", { class: this.marked.has(this.keyOf(row)) ? "marked" : "" }, ...cells);
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
