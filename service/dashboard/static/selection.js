// @ts-check
/** What is selected, for all panels of a page alike. */

/** @typedef {{actionId: string | null, targetId: string | null, satelliteId: string | null}} Selected */

const NOTHING = Object.freeze({ actionId: null, targetId: null, satelliteId: null });

export class Selection {
  constructor() {
    /** @type {Selected} */
    this.now = NOTHING;
    /** @type {((selected: Selected) => void)[]} */
    this.listeners = [];
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

  clear() {
    this.select(NOTHING);
  }
}
