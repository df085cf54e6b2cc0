// @ts-check
/** The dialog for a target's priority: what its image earns from now on. */

import { byId, h } from "./dom.js";

/** Put the dialog on the page. */
export function installPriorityDialog() {
  const close = h("button", { type: "button", id: "priority-close", class: "quiet" }, "Close");
  const form = h(
    "form",
    { id: "priority-form", method: "dialog" },
    h("h2", { id: "priority-title" }, "Priority"),
    h("p", {},
      h("label", { for: "priority-input" }, "What its image earns from now on "),
      h("input", { id: "priority-input", type: "number", min: 0, step: "any", required: true })),
    h("p", { class: "buttons" }, h("button", { type: "submit" }, "Use it"), " ", close),
  );
  const dialog = h("dialog", { id: "priority-dialog", "aria-labelledby": "priority-title" }, form);
  // The page's policy forbids sending forms; this one only closes its dialog.
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    dialog.close("use");
  });
  close.addEventListener("click", () => dialog.close("close"));
  document.body.append(dialog);
}

/**
 * Ask for the priority; return null if none is given.
 * @param {string} title of the target
 * @param {number | null} reward the current priority
 * @returns {Promise<number | null>}
 */
export async function askForPriority(title, reward) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("priority-dialog"));
  const input = /** @type {HTMLInputElement} */ (byId("priority-input"));
  byId("priority-title").textContent = `Priority of ${title}`;
  input.value = reward === null ? "" : String(reward);
  dialog.returnValue = "";
  dialog.showModal();
  input.select();
  await new Promise((resolve) => dialog.addEventListener("close", resolve, { once: true }));
  return dialog.returnValue === "use" && input.value !== "" ? input.valueAsNumber : null;
}
