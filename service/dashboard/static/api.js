// @ts-check
/** Calls of the HTTP API: with the tab's key, errors as problems, lists page by page. */

import { askForKey, currentKey } from "./key.js";

const PAGE = 500;

/** A refusal by the service (RFC 9457). */
export class Problem extends Error {
  /**
   * @param {number} status
   * @param {{code?: string, title?: string, detail?: string, request_id?: string,
   *   errors?: {pointer: string | null, code: string, row: number | null, detail: string}[]}} body
   */
  constructor(status, body) {
    super(body.detail ?? body.title ?? `The service answered ${status}.`);
    this.status = status;
    this.code = body.code ?? "";
    this.errors = body.errors ?? [];
    this.requestId = body.request_id ?? "";
  }
}

/**
 * Send a request; if a key is needed, ask for one and send it again.
 * @param {string} path
 * @param {RequestInit & {headers?: Record<string, string>}} [options]
 * @returns {Promise<Response>}
 */
export async function call(path, options = {}) {
  for (;;) {
    const key = currentKey();
    const headers = { ...options.headers, ...(key ? { Authorization: `Bearer ${key}` } : {}) };
    const response = await fetch(path, { ...options, headers });
    if (response.ok || response.status === 304) return response;
    const body = await response.json().catch(() => ({}));
    if (response.status !== 401) throw new Problem(response.status, body);
    await askForKey(body.detail ?? "This service needs a key.");
  }
}

/**
 * @template T
 * @param {string} path
 * @returns {Promise<T>}
 */
export async function get(path) {
  return (await call(path)).json();
}

/**
 * @template T
 * @param {string} path
 * @param {unknown} [body] sent as JSON
 * @returns {Promise<T>}
 */
export async function post(path, body) {
  const sent =
    body === undefined
      ? {}
      : { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  return (await call(path, { method: "POST", ...sent })).json();
}

/**
 * Post a file.
 * @template T
 * @param {string} path
 * @param {Blob | string} content
 * @param {string} mediaType
 * @returns {Promise<T>}
 */
export async function upload(path, content, mediaType) {
  const headers = { "Content-Type": mediaType };
  return (await call(path, { method: "POST", headers, body: content })).json();
}

/**
 * Return the items of a list, from all its pages up to a number of items.
 * @template T
 * @param {string} path
 * @param {number} [most]
 * @param {(items: T[]) => void} [onPage] called after each page with all items so far
 * @returns {Promise<{items: T[], isAll: boolean}>}
 */
export async function list(path, most = Infinity, onPage = () => {}) {
  /** @type {T[]} */
  const items = [];
  const url = new URL(path, location.href);
  url.searchParams.set("limit", String(PAGE));
  for (;;) {
    /** @type {{items: T[], next: string | null}} */
    const page = await get(url.pathname + url.search);
    items.push(...page.items);
    onPage(items);
    if (page.next === null) return { items, isAll: true };
    if (items.length >= most) return { items, isAll: false };
    url.searchParams.set("cursor", page.next);
  }
}

export const FINAL = new Set(["succeeded", "failed", "cancelled", "expired"]);

/**
 * Report a job now and at each change, until it is final.
 * @param {string} jobId
 * @param {(job: import("./types.js").JobOut) => void} onChange
 */
export async function follow(jobId, onChange) {
  const path = `/v1/jobs/${encodeURIComponent(jobId)}`;
  let etag = "";
  for (;;) {
    /** @type {Response} */
    let response;
    try {
      response = await call(etag ? `${path}?wait=10` : path, {
        headers: etag ? { "If-None-Match": etag } : {},
        cache: "no-store",
      });
    } catch (error) {
      // Wait for a service that restarts, but not after a refusal.
      if (error instanceof Problem && error.status < 500) throw error;
      if (!(error instanceof Problem) && !(error instanceof TypeError)) throw error;
      await pause(2000);
      continue;
    }
    if (response.status === 304) continue;
    etag = response.headers.get("ETag") ?? "";
    /** @type {import("./types.js").JobOut} */
    const job = await response.json();
    onChange(job);
    if (FINAL.has(job.state)) return;
  }
}

/** @param {number} ms */
export function pause(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
