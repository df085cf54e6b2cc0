// @ts-check
/** Symbols of targets on a map, drawn once and copied for each target. */

/**
 * Return the symbol of an outcome. Shapes differ as well as colours: disc, square, ring, cross.
 * @param {string} outcome
 * @param {number} size
 * @param {string} color
 */
export function symbolOf(outcome, size, color) {
  const half = Math.ceil(size + 1);
  const symbol = new OffscreenCanvas(2 * half * devicePixelRatio, 2 * half * devicePixelRatio);
  const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (symbol.getContext("2d"));
  pen.scale(devicePixelRatio, devicePixelRatio);
  pen.translate(half, half);
  pen.fillStyle = color;
  pen.strokeStyle = color;
  pen.lineWidth = 1.2;
  pen.beginPath();
  if (outcome === "collected") {
    pen.fillRect(-size * 0.9, -size * 0.9, size * 1.8, size * 1.8);
  } else if (outcome === "excluded") {
    pen.moveTo(-size, -size);
    pen.lineTo(size, size);
    pen.moveTo(-size, size);
    pen.lineTo(size, -size);
    pen.stroke();
  } else {
    pen.arc(0, 0, size, 0, 2 * Math.PI);
    if (outcome === "downlinked") pen.fill();
    else pen.stroke();
  }
  return symbol;
}
