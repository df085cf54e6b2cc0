// @ts-check
/** Names beside the marks of a map: they never overlap, and names without room are left out. */

/** @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Pen */

/**
 * @typedef {object} Mark
 * @property {string} name
 * @property {number} x the middle of the mark
 * @property {number} y
 * @property {number} reach half the size of the mark
 * @property {string | undefined} color of the name
 * @property {boolean} [isNamed] false for a mark that only takes up room
 */

/** @typedef {{left: number, top: number, right: number, bottom: number}} Box */
/** @typedef {{mark: Mark, x: number, y: number, box: Box}} Placed */

const GAP_PX = 3;
/** Height of a line of text, in font sizes. */
const LINE = 1.15;
/** Directions in which a name may lie from its mark, best first: right and down. */
const PLACES = [[1, 0], [-1, 0], [0, -1], [0, 1], [1, -1], [1, 1], [-1, -1], [-1, 1]];
/** Extra distances from the mark, in line heights: further away a name could belong to any mark. */
const RINGS = [0, 0.8];

/**
 * Return where names lie. Earlier marks go first; a name that would lie on another name, on another
 * mark or over the edge is left out.
 * @param {Mark[]} marks by rank
 * @param {{width: number, height: number}} area
 * @param {number} size of the font, in pixels
 * @param {(name: string) => number} widthOf
 * @returns {Placed[]}
 */
export function placeNames(marks, area, size, widthOf) {
  /** @type {Placed[]} */
  const placed = [];
  const height = size * LINE;
  const seen = marks.filter(({ x, y }) => x >= 0 && y >= 0 && x <= area.width && y <= area.height);
  const around = seen.map(({ x, y, reach }) => ({ left: x - reach, top: y - reach, right: x + reach, bottom: y + reach }));
  for (const [i, mark] of seen.entries()) {
    if (mark.isNamed === false) continue;
    const width = widthOf(mark.name);
    const box = candidates(mark, width, height).find(
      (one) =>
        one.left >= 0 && one.top >= 0 && one.right <= area.width && one.bottom <= area.height &&
        !placed.some((other) => overlap(one, other.box)) &&
        !around.some((other, j) => j !== i && overlap(one, other)),
    );
    if (box) placed.push({ mark, x: box.left, y: (box.top + box.bottom) / 2, box });
  }
  return placed;
}

/**
 * @param {Mark} mark
 * @param {number} width
 * @param {number} height
 * @returns {Box[]}
 */
function candidates(mark, width, height) {
  return RINGS.flatMap((ring) =>
    PLACES.map(([right, down]) => {
      const away = mark.reach + GAP_PX + ring * height;
      const x = mark.x + Number(right) * (away + width / 2);
      const y = mark.y + Number(down) * (away + height / 2);
      return { left: x - width / 2, top: y - height / 2, right: x + width / 2, bottom: y + height / 2 };
    }),
  );
}

/**
 * @param {Box} a
 * @param {Box} b
 */
function overlap(a, b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

/**
 * Write the names of marks with the pen's font; return how many had room.
 * @param {Pen} pen
 * @param {Mark[]} marks by rank
 * @param {{width: number, height: number}} area
 * @param {number} size of the font, in pixels
 */
export function writeNames(pen, marks, area, size) {
  pen.textBaseline = "middle";
  const placed = placeNames(marks, area, size, (name) => pen.measureText(name).width);
  for (const { mark, x, y } of placed) {
    pen.fillStyle = mark.color ?? "";
    pen.fillText(mark.name, x, y);
  }
  return placed.length;
}
