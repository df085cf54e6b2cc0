// @ts-check
/** Stored satellites, target catalogues and stations, to be ticked; and uploads of new ones. */

import { list, upload } from "./api.js";
import { byId, fill, h } from "./dom.js";
import { counted, utc } from "./format.js";
import { describe } from "./page.js";

const SHOWN = 500;

/**
 * One kind of input: checkboxes for the stored items, and an upload.
 * @template {{id: string}} T
 */
export class Choices {
  /**
   * @param {string} id of the fieldset
   * @param {string} path of the collection
   * @param {(thing: T) => string} titleOf
   * @param {(file: File) => Promise<{told: (HTMLElement | string)[], ids: string[]}>} send
   */
  constructor(id, path, titleOf, send) {
    this.fieldset = byId(id);
    this.path = path;
    this.titleOf = titleOf;
    /** @type {Map<string, T>} */
    this.things = new Map();
    /** @type {Set<string>} */
    this.ticked = new Set();
    this.onChange = () => {};
    const input = /** @type {HTMLInputElement} */ (byId(`${id}-file`));
    input.addEventListener("change", () => this.take(input, send));
  }

  /** Read the stored items. */
  async refresh() {
    const { items, isAll } = await list(this.path, SHOWN);
    this.things = new Map(/** @type {T[]} */ (items).map((thing) => [thing.id, thing]));
    for (const id of this.ticked) if (!this.things.has(id)) this.ticked.delete(id);
    this.draw(isAll);
    this.onChange();
  }

  /** @returns {T[]} the ticked items */
  chosen() {
    return [...this.things.values()].filter((thing) => this.ticked.has(thing.id));
  }

  /**
   * Tick more items.
   * @param {string[]} ids
   */
  async add(ids) {
    for (const id of ids) this.ticked.add(id);
    await this.refresh();
  }

  /** @param {boolean} isAll */
  draw(isAll) {
    const boxes = [...this.things.values()].map((thing) => {
      const box = h("input", { type: "checkbox", value: thing.id });
      box.checked = this.ticked.has(thing.id);
      box.addEventListener("change", () => {
        if (box.checked) this.ticked.add(thing.id);
        else this.ticked.delete(thing.id);
        this.onChange();
      });
      return h("label", {}, box, ` ${this.titleOf(thing)}`);
    });
    const all = h("button", { type: "button", class: "quiet", onclick: () => this.tickAll(isAll) }, "All or none");
    const note = isAll ? null : h("small", {}, `Only the newest ${boxes.length} are listed.`);
    fill(this.place(".choices"), boxes.length > 0 ? all : "None stored yet.", ...boxes, note);
  }

  /** @param {boolean} isAll */
  tickAll(isAll) {
    const isFull = this.ticked.size === this.things.size;
    this.ticked = new Set(isFull ? [] : this.things.keys());
    this.draw(isAll);
    this.onChange();
  }

  /**
   * @param {HTMLInputElement} input
   * @param {(file: File) => Promise<{told: (HTMLElement | string)[], ids: string[]}>} send
   */
  async take(input, send) {
    const [file] = input.files ?? [];
    if (!file) return;
    const outcome = this.place(".outcome");
    fill(outcome, `Sending ${file.name} ...`);
    try {
      const { told, ids } = await send(file);
      await this.add(ids);
      fill(outcome, h("div", { class: "notice good" }, h("div", {}, ...told)));
    } catch (error) {
      fill(outcome, h("div", { class: "notice bad", role: "alert" }, h("div", {}, ...describe(error))));
    } finally {
      // So that the same file can be chosen again once it is corrected.
      input.value = "";
    }
  }

  /** @param {string} selector */
  place(selector) {
    return /** @type {HTMLElement} */ (this.fieldset.querySelector(selector));
  }
}

/** @typedef {{row: number | null, code: string, detail: string}} Rejected */

const MEANT_AS_REWARD = new Set(["priority", "weight", "value", "score", "importance"]);

/**
 * @param {{accepted: number, rejected: number, errors: Rejected[]}} answer
 * @param {string} noun
 */
function told(answer, noun) {
  /** @type {(HTMLElement | string)[]} */
  const parts = [`${counted(answer.accepted, noun)} accepted, ${answer.rejected} rejected.`];
  const lines = answer.errors.slice(0, 20).map((error) =>
    h("li", {}, `${error.row === null ? "" : `Line ${error.row}: `}${error.detail}`),
  );
  if (lines.length > 0) parts.push(h("ul", {}, ...lines));
  return parts;
}

/** @param {File} file */
function endingOf(file) {
  return file.name.toLowerCase().split(".").pop() ?? "";
}

/** @param {File} file */
async function isJson(file) {
  return /^\s*[[{]/.test((await file.slice(0, 200).text()).replace(/^\uFEFF/, ""));
}

/** @param {File} file */
async function sendSatellites(file) {
  const types = { csv: "text/csv", xml: "application/xml" };
  const byEnding = types[/** @type {"csv" | "xml"} */ (endingOf(file))] ?? "text/plain";
  const mediaType = (await isJson(file)) ? "application/json" : byEnding;
  const type = /** @type {HTMLSelectElement} */ (byId("satellites-type"));
  const query = new URLSearchParams(type.value ? { spacecraft: type.value } : {});
  /** @type {any} */
  const answer = await upload(`/v1/satellites/import?${query}`, file, mediaType);
  const ids = answer.items.map((/** @type {{id: string}} */ item) => item.id);
  const parts = told(answer, "satellite");
  const named = type.selectedOptions[0]?.textContent ?? "generic_optical";
  parts.push(` New satellites have the figures of the type ${named}: change them under Fleet.`);
  return { told: parts, ids };
}

/** @param {File} file */
async function sendStations(file) {
  const mediaType = (await isJson(file)) ? "application/geo+json" : "text/csv";
  /** @type {any} */
  const answer = await upload("/v1/ground-stations/import", file, mediaType);
  const ids = answer.items.map((/** @type {{id: string}} */ item) => item.id);
  return { told: told(answer, "station"), ids };
}

/** @param {File} file */
async function sendTargets(file) {
  const name = encodeURIComponent(file.name.replace(/\.[^.]*$/, "") || "Targets");
  const path = `/v1/target-catalogs?name=${name}`;
  /** @type {any} */
  const answer = await upload(path, file, await mediaTypeOfTargets(file));
  const ignored = answer.ignored_columns;
  const meansReward = ignored.some((/** @type {string} */ name) => MEANT_AS_REWARD.has(name.toLowerCase()));
  const parts = [
    `${counted(answer.num_targets, "target")} accepted.`,
    ignored.length > 0 && ` Not used: ${ignored.join(", ")}.`,
    meansReward && " What an image earns is read from the column reward.",
  ].filter((part) => part !== false);
  return { told: parts, ids: [answer.id] };
}

/** @param {File} file */
async function mediaTypeOfTargets(file) {
  if (!(await isJson(file))) return "text/csv";
  const isGeo = (await file.text()).includes("FeatureCollection");
  return isGeo ? "application/geo+json" : "application/json";
}

/** Return the page's three kinds of input. */
export function allChoices() {
  return {
    satellites: new Choices(
      "satellites",
      "/v1/satellites",
      (/** @type {import("./types.js").SatelliteOut} */ one) =>
        `${one.name} (${one.norad_cat_id}), orbit of ${utc(one.epoch)} UTC`,
      sendSatellites,
    ),
    targets: new Choices(
      "targets",
      "/v1/target-catalogs",
      (/** @type {import("./types.js").TargetCatalogOut} */ one) =>
        `${one.name}: ${one.num_targets} targets, stored ${utc(one.created_at)} UTC`,
      sendTargets,
    ),
    stations: new Choices(
      "stations",
      "/v1/ground-stations",
      (/** @type {import("./types.js").GroundStationOut} */ one) =>
        `${one.name} (${one.lat_deg.toFixed(2)}, ${one.lon_deg.toFixed(2)}), elevation from ${one.min_elevation_deg}°`,
      sendStations,
    ),
  };
}
