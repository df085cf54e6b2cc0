// @ts-check
/** What every page does: key, clock, state of the service, uncaught errors. */

import { get, Problem } from "./api.js";
import { byId, fill, h, notice } from "./dom.js";
import { counted, utcLabelled } from "./format.js";
import { adoptKeyFromLink, installKeyDialog, showCaller } from "./key.js";

const ASK_HEALTH_MS = 15_000;

/**
 * Start a page; show its error if it fails.
 * @param {() => Promise<void>} show
 */
export async function startPage(show) {
  installKeyDialog();
  const cameByLink = adoptKeyFromLink();
  addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    showError(event.reason);
  });
  addEventListener("keydown", tickByEnter);
  tick();
  setInterval(tick, 1000);
  try {
    showCaller(await get("/v1/me"), cameByLink);
    watchHealth();
    await show();
  } catch (error) {
    showError(error);
  }
}

/**
 * Let Enter tick a box as Space does, instead of sending the form.
 * @param {KeyboardEvent} event
 */
function tickByEnter(event) {
  if (event.key !== "Enter" || !(event.target instanceof HTMLInputElement)) return;
  if (event.target.type !== "checkbox" && event.target.type !== "radio") return;
  event.preventDefault();
  event.target.click();
}

function tick() {
  const clock = byId("clock");
  clock.textContent = utcLabelled(Date.now());
  clock.setAttribute("datetime", new Date().toISOString());
}

async function watchHealth() {
  const status = byId("service-status");
  for (;;) {
    const text = await get("/health/ready").then(
      (/** @type {{workers: number}} */ ready) => `Service: ready, ${counted(ready.workers, "worker")}`,
      (error) => (error instanceof Problem ? `Service: ${error.message}` : "Service: no answer"),
    );
    status.textContent = text;
    status.classList.toggle("bad", !text.includes("ready,"));
    await new Promise((resolve) => setTimeout(resolve, ASK_HEALTH_MS));
  }
}

/** @param {unknown} error */
export function showError(error) {
  notice("bad", ...describe(error));
}

/**
 * Return an error as elements: what is wrong, and where in the file or form.
 * @param {unknown} error
 * @returns {(HTMLElement | string)[]}
 */
export function describe(error) {
  if (!(error instanceof Problem)) {
    return [error instanceof Error ? error.message : String(error)];
  }
  const parts = [h("strong", {}, error.message)];
  const faults = error.errors.filter((fault) => fault.detail !== error.message || fault.row);
  if (faults.length > 0) {
    const shown = faults.slice(0, 20).map((fault) => {
      const place = fault.row ? `Line ${fault.row}: ` : fault.pointer ? `${fault.pointer}: ` : "";
      return h("li", {}, place + fault.detail);
    });
    if (faults.length > 20) shown.push(h("li", {}, `and ${faults.length - 20} more`));
    parts.push(h("ul", {}, ...shown));
  }
  const why = h("a", { href: `/problems/${error.code}` }, error.code);
  parts.push(h("small", {}, "Code ", why, `, request ${error.requestId}`));
  return parts;
}

/**
 * Do a button's work; meanwhile the button is disabled, and an error is shown.
 * @param {HTMLButtonElement} button
 * @param {HTMLElement} place where errors are shown
 * @param {() => Promise<void>} work
 */
export async function whileBusy(button, place, work) {
  button.disabled = true;
  fill(place);
  try {
    await work();
  } catch (error) {
    fill(place, h("div", { class: "notice bad", role: "alert" }, h("div", {}, ...describe(error))));
  } finally {
    button.disabled = false;
  }
}
