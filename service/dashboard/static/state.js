// @ts-check
/** The state of a job or a plan in a word and a colour: never green if the plan breaks limits. */

import { h } from "./dom.js";

/** @type {Record<string, string>} */
const WORDS = { violations: "breaks limits", inherited: "began beyond limits" };

/** @param {{state: string, validity?: string | null}} one */
export function stateBadge(one) {
  const trouble = WORDS[one.validity ?? ""];
  if (!trouble) return h("span", { class: `state ${one.state}` }, one.state);
  return h("span", { class: `state ${one.validity}` }, `${one.state}, ${trouble}`);
}
