// @ts-check
/** Asks for a target's priority: what its image earns from now on. */

import { byId } from "./dom.js";

/** Let the dialog's buttons close it. */
export function installPriorityDialog() {
  const dialog = dialogOf();
  // The policy lets no form send itself; a dialog's form need not.
  byId("priority-form").addEventListener("submit", (event) => {
    event.preventDefault();
    dialog.close("use");
  });
  byId("priority-close").addEventListener("click", () => dialog.close("close"));
}

/**
 * Ask for the priority; null where nobody gives one.
 * @param {string} targetId
 * @param {number | null} reward what it is
 * @returns {Promise<number | null>}
 */
export async function askForPriority(targetId, reward) {
  const dialog = dialogOf();
  const input = /** @type {HTMLInputElement} */ (byId("priority-input"));
  byId("priority-title").textContent = `Priority of ${targetId}`;
  input.value = reward === null ? "" : String(reward);
  dialog.returnValue = "";
  dialog.showModal();
  input.select();
  await new Promise((resolve) => dialog.addEventListener("close", resolve, { once: true }));
  return dialog.returnValue === "use" && input.value !== "" ? input.valueAsNumber : null;
}

function dialogOf() {
  return /** @type {HTMLDialogElement} */ (byId("priority-dialog"));
}
