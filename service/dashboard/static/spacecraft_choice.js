// @ts-check
/** A choice of spacecraft types: the user's own first, then the built-in ones. */

import { list } from "./api.js";
import { fill, h } from "./dom.js";

const MOST = 1000;
const USUAL = "generic_optical";

/**
 * @param {HTMLSelectElement} choice
 */
export async function fillSpacecraft(choice) {
  const chosen = choice.value || USUAL;
  /** @type {{items: {id: string, name: string}[]}} */
  const { items } = await list("/v1/spacecraft", MOST);
  fill(choice, ...items.map((one) => h("option", { value: one.id }, one.name)));
  choice.value = chosen;
}
