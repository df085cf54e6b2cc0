// @ts-check
/** Buttons in tables that select an item, and open its menu if the page has one. */

import { h } from "./dom.js";

/**
 * Return a button that selects an action.
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {string} id
 * @param {string} [text] by default its id
 */
export function actionButton(plan, selection, id, text = id) {
  return selecting(text, selection, () => plan.about(id));
}

/**
 * Return a button that selects a target.
 * @param {import("./plan.js").Plan} plan
 * @param {import("./selection.js").Selection} selection
 * @param {string | null} id
 */
export function targetButton(plan, selection, id) {
  return id === null ? "" : selecting(plan.targetTitle(id), selection, () => plan.aboutTarget(id));
}

/**
 * @param {string} text
 * @param {import("./selection.js").Selection} selection
 * @param {() => import("./selection.js").Selected} about
 */
function selecting(text, selection, about) {
  const onclick = (/** @type {MouseEvent} */ event) => {
    selection.select(about());
    selection.open({ element: /** @type {HTMLElement} */ (event.currentTarget) });
  };
  return h("button", { type: "button", class: "link", onclick }, text);
}
