// @ts-check
/** Pointer, wheel and key input of the map. */

/** @typedef {import("./map.js").WorldMap} WorldMap */

/** @param {WorldMap} map */
export function takeMapInput(map) {
  const { element } = map.canvas;
  /** @type {{x: number, y: number, hasMoved: boolean} | null} */
  let grip = null;
  element.addEventListener("pointerdown", (event) => {
    grip = { x: event.offsetX, y: event.offsetY, hasMoved: false };
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    if (grip === null) {
      map.hover(event.offsetX, event.offsetY);
      return;
    }
    const [dx, dy] = [event.offsetX - grip.x, event.offsetY - grip.y];
    if (!grip.hasMoved && Math.hypot(dx, dy) < 4) return;
    grip = { x: event.offsetX, y: event.offsetY, hasMoved: true };
    map.center.lon -= dx / map.scale();
    map.center.lat += dy / map.scale();
    map.keepInside();
  });
  element.addEventListener("pointerup", (event) => {
    if (grip && !grip.hasMoved) map.click(event.offsetX, event.offsetY);
    grip = null;
  });
  element.addEventListener("pointerleave", () => {
    map.tip.hidden = true;
  });
  element.addEventListener("dblclick", (event) => map.zoomBy(2, event.offsetX, event.offsetY));
  element.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // the page scrolls
      event.preventDefault();
      map.zoomBy(2 ** (-event.deltaY / 200), event.offsetX, event.offsetY);
    },
    { passive: false },
  );
  element.addEventListener("keydown", (event) => key(map, event));
}

/**
 * @param {WorldMap} map
 * @param {KeyboardEvent} event
 */
function key(map, event) {
  const step = 30 / map.zoom;
  const moves = /** @type {Record<string, () => void>} */ ({
    ArrowLeft: () => (map.center.lon -= step),
    ArrowRight: () => (map.center.lon += step),
    ArrowUp: () => (map.center.lat += step),
    ArrowDown: () => (map.center.lat -= step),
    "+": () => map.zoomBy(1.5),
    "-": () => map.zoomBy(1 / 1.5),
    Enter: () => selectNext(map, event.shiftKey ? -1 : 1),
    Escape: () => map.selection.clear(),
    " ": () => openSelected(map),
  });
  const move = moves[event.key];
  if (!move) return;
  event.preventDefault();
  move();
  map.keepInside();
}

/**
 * Select the visible target after or before the selected one, or the first visible target if that one is not visible.
 * @param {WorldMap} map
 * @param {1 | -1} by
 */
function selectNext(map, by) {
  map.measure();
  const seen = map.geography.targets.filter((target) => isInSight(map, target));
  const now = seen.findIndex(({ id }) => id === map.selection.now.targetId);
  const next = now < 0 ? seen[0] : seen[now + by];
  if (next) map.selection.select(map.plan.aboutTarget(next.id));
}

/** Open the menu of the selected target at its position. @param {WorldMap} map */
function openSelected(map) {
  map.measure();
  const target = map.plan.target.get(map.selection.now.targetId ?? "");
  if (!target || !isInSight(map, target)) return;
  const [x, y] = map.xy(target.lon, target.lat);
  map.selection.open({ element: map.canvas.element, x, y });
}

/**
 * @param {WorldMap} map
 * @param {import("./geography.js").Place} place
 */
function isInSight(map, { lon, lat }) {
  const [x, y] = map.xy(lon, lat);
  return x >= 0 && y >= 0 && x <= map.size.width && y <= map.size.height;
}
