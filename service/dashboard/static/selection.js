// @ts-check
/** The selection that all panels of a page share. */

/** @typedef {{actionId: string | null, targetId: string | null, satelliteId: string | null}} Selected */

/** @typedef {{element: HTMLElement, x?: number, y?: number}} Anchor where a menu opens: at an element, or at a point of it */

const NOTHING = Object.freeze({ actionId: null, targetId: null, satelliteId: null });

export class Selection {
  constructor() {
    /** @type {Selected} */
    this.now = NOTHING;
    /** @type {((selected: Selected) => void)[]} */
    this.listeners = [];
    /** @type {((anchor: Anchor) => void)[]} */
    this.openers = [];
  }

  /** @param {(selected: Selected) => void} listener */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** @param {Partial<Selected>} what */
  select(what) {
    this.now = { ...NOTHING, ...what };
    for (const listener of this.listeners) listener(this.now);
  }

  /**
   * Call a function when the user wants to work on the selected item.
   * @param {(anchor: Anchor) => void} opener
   */
  onOpen(opener) {
    this.openers.push(opener);
  }

  /** @param {Anchor} anchor */
  open(anchor) {
    for (const opener of this.openers) opener(anchor);
  }

  clear() {
    this.select(NOTHING);
  }
}
