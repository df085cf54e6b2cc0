// @ts-check
/** A small menu at a point or beside a button, by pointer and by keys (ARIA's menu pattern). */

import { h } from "./dom.js";

/** @typedef {import("./selection.js").Anchor} Anchor */
/** @typedef {{id: string, text: string, choose: () => void}} Line */

const EDGE_PX = 8;

/** @type {(() => void) | null} */
let closeOpen = null;

/**
 * Open a menu, and close the one that is open. When it closes, the element that opened it gets the focus back.
 * @param {string} label
 * @param {Line[]} lines
 * @param {Anchor} anchor
 */
export function openMenu(label, lines, anchor) {
  closeOpen?.();
  const buttons = lines.map(({ id, text, choose }) => {
    const onclick = () => {
      close(true);
      choose();
    };
    return h("button", { type: "button", role: "menuitem", tabindex: -1, "data-offer": id, onclick }, text);
  });
  const title = h("p", { class: "menu-title", "aria-hidden": "true" }, label);
  const menu = h("div", { class: "menu", role: "menu", "aria-label": label }, title, ...buttons);
  const onOutside = (/** @type {PointerEvent} */ event) => {
    if (event.target instanceof Node && !menu.contains(event.target)) close(false);
  };
  const close = (/** @type {boolean} */ goesBack) => {
    menu.remove();
    removeEventListener("pointerdown", onOutside, true);
    closeOpen = null;
    if (goesBack && anchor.element.isConnected) anchor.element.focus({ preventScroll: true });
  };
  menu.addEventListener("keydown", (event) => {
    // Elements under the menu have keys of their own.
    event.stopPropagation();
    const at = buttons.findIndex((one) => one === document.activeElement);
    const places = /** @type {Record<string, number>} */ ({ ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 });
    const next = places[event.key];
    if (event.key === "Tab") close(true); // and the focus moves on from there
    else if (event.key === "Escape") close(true);
    else if (next !== undefined) buttons.at(next % buttons.length)?.focus();
    else return;
    if (event.key !== "Tab") event.preventDefault();
  });
  addEventListener("pointerdown", onOutside, true);
  closeOpen = () => close(false);
  document.body.append(menu);
  place(menu, anchor);
  buttons[0]?.focus({ preventScroll: true });
}

/**
 * Put the menu at its anchor, entirely on the screen.
 * @param {HTMLElement} menu
 * @param {Anchor} anchor
 */
function place(menu, { element, x, y }) {
  const box = element.getBoundingClientRect();
  const [left, top] = [box.left + (x ?? 0), y === undefined ? box.bottom : box.top + y];
  const { offsetWidth: width, offsetHeight: height } = menu;
  const inside = (/** @type {number} */ at, /** @type {number} */ size, /** @type {number} */ room) =>
    Math.max(Math.min(at, room - size - EDGE_PX), EDGE_PX);
  menu.style.left = `${inside(left, width, innerWidth) + scrollX}px`;
  menu.style.top = `${inside(top, height, innerHeight) + scrollY}px`;
}
