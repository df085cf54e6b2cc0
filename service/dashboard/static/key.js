// @ts-check
/** The key of this tab: from a link's fragment, or asked for; only ever sent in a header. */

import { byId, notice } from "./dom.js";

const STORED = "slewline-key";

/** @type {Promise<void> | null} */
let asking = null;

/** @returns {string | null} */
export function currentKey() {
  return sessionStorage.getItem(STORED);
}

/**
 * Move a key from the address into the tab's storage, so that it is neither seen nor shared.
 * @returns {boolean} whether there was one
 */
export function adoptKeyFromLink() {
  const fragment = new URLSearchParams(location.hash.slice(1));
  const key = fragment.get("key");
  if (!key) return false;
  sessionStorage.setItem(STORED, key);
  fragment.delete("key");
  const rest = fragment.size > 0 ? `#${fragment}` : "";
  history.replaceState(null, "", location.pathname + location.search + rest);
  return true;
}

/**
 * Ask for a key; simultaneous calls share one dialog.
 * @param {string} why
 */
export function askForKey(why) {
  asking ??= openDialog(why).finally(() => {
    asking = null;
  });
  return asking;
}

/** @param {string} why */
async function openDialog(why) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("key-dialog"));
  const input = /** @type {HTMLInputElement} */ (byId("key-input"));
  byId("key-message").textContent = why;
  input.value = "";
  dialog.returnValue = "";
  dialog.showModal();
  await new Promise((resolve) => dialog.addEventListener("close", resolve, { once: true }));
  if (dialog.returnValue === "use" && input.value.trim()) {
    sessionStorage.setItem(STORED, input.value.trim());
  } else if (dialog.returnValue !== "use") {
    throw new Error("No key was given.");
  }
}

/** Let the header's button show and change the key. */
export function installKeyDialog() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("key-dialog"));
  const form = byId("key-form");
  // The page's policy forbids sending forms; this one only closes its dialog.
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    dialog.close("use");
  });
  byId("key-close").addEventListener("click", () => dialog.close("close"));
  byId("key-forget").addEventListener("click", () => {
    sessionStorage.removeItem(STORED);
    location.reload();
  });
  byId("key-button").addEventListener("click", () => {
    askForKey("Use another key in this tab.").then(
      () => location.reload(),
      () => {},
    );
  });
}

/**
 * Show whose key the page uses, and warn if a key from a link can change things.
 * @param {import("./types.js").CallerOut} me
 * @param {boolean} cameByLink
 */
export function showCaller(me, cameByLink) {
  document.body.dataset.scope = me.scope;
  const name = me.key_name ?? me.owner;
  byId("key-button").textContent = me.key_id === null ? "Give a key" : `${name}: ${me.scope}`;
  if (cameByLink && me.scope !== "read") {
    notice(
      "warn",
      `This link contains a key with scope ${me.scope}: anyone who has the link can change things. `,
      "For a wall display, create a key with --scope read.",
    );
  }
}
