// @ts-check
/** Makes elements without markup in strings, which the page's policy forbids. */

/** @typedef {Node | string | number | null | undefined | false} Child */

/**
 * Return a new element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, string | number | boolean | null | undefined | ((event: any) => void)>} [attributes]
 *   `on…` are listeners; true stands for an attribute without value, false and null for no attribute.
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, String(value));
  }
  append(element, children);
  return element;
}

/**
 * @param {Element} parent
 * @param {Child[]} children
 */
function append(parent, children) {
  for (const child of children) {
    if (child != null && child !== false) parent.append(child instanceof Node ? child : String(child));
  }
}

/**
 * Replace an element's children.
 * @param {Element} parent
 * @param {...Child} children
 */
export function fill(parent, ...children) {
  parent.replaceChildren();
  append(parent, children);
}

/**
 * Return the element with an id, which the page must have.
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
export function byId(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`no element #${id}`);
  return /** @type {T} */ (element);
}

/**
 * Show a message at the top of the page.
 * @param {"good" | "warn" | "bad"} kind
 * @param {...Child} text
 */
export function notice(kind, ...text) {
  const close = h("button", { type: "button", class: "quiet", "aria-label": "Dismiss" }, "×");
  const element = h("div", { class: `notice ${kind}` }, h("div", {}, ...text), close);
  close.addEventListener("click", () => element.remove());
  byId("notices").prepend(element);
}

/**
 * Return a progress bar.
 * @param {number} fraction
 * @param {string} label
 */
export function bar(fraction, label) {
  const part = Math.min(Math.max(fraction, 0), 1);
  return h("progress", { max: 1, value: part, "aria-label": label }, `${Math.round(part * 100)}%`);
}
