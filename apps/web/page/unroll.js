// SPDX-License-Identifier: Apache-2.0
// Panoramas: the image of a mirror, unrolled by the grid of pixels that `views.*.unroll` of the telemetry gives.

/** The column of a panorama of unit width that shows a bearing: 0 is +pi (left), 1 is -pi. */
export function bearingShare(bearing_rad) {
  return 0.5 - bearing_rad / (2 * Math.PI);
}

/** The pixel [column, row] of the grid at shares of its width and height, or null where the lens shows nothing. */
export function unrollPlace({ bearings, radii, pixels_px }, across, down) {
  const x = Math.min(Math.max(across, 0), 1) * (bearings - 1), y = Math.min(Math.max(down, 0), 1) * (radii - 1);
  const j = Math.min(Math.floor(x), bearings - 2), i = Math.min(Math.floor(y), radii - 2);
  const place = [0, 0];
  for (const [di, dj] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
    const weight = (di ? y - i : 1 - y + i) * (dj ? x - j : 1 - x + j);
    if (weight === 0) continue;
    const pixel = pixels_px[(i + di) * bearings + j + dj];
    if (!pixel) return null;
    place[0] += weight * pixel[0];
    place[1] += weight * pixel[1];
  }
  return place;
}

/**
 * For each pixel of a panorama of `width` times `height`: the index of the pixel above and left of its place in an
 * image of `image.width` times `image.height` (-1: none), and how far to the right and down the place is, in 1/256 px.
 * `view` gives the size of image that the grid is for; the image itself may be a smaller copy.
 */
export function unrollTable(view, image, width, height) {
  const [right, down] = [new Uint16Array(width * height), new Uint16Array(width * height)];
  const table = { index: new Int32Array(width * height).fill(-1), right, down, stride: image.width };
  const sx = image.width / view.width_px, sy = image.height / view.height_px;
  for (let row = 0; row < height; ++row) {
    for (let column = 0; column < width; ++column) {
      const place = unrollPlace(view.unroll, column / (width - 1), row / (height - 1));
      if (!place) continue;
      const x = Math.min(Math.max((place[0] + 0.5) * sx - 0.5, 0), image.width - 1);
      const y = Math.min(Math.max((place[1] + 0.5) * sy - 0.5, 0), image.height - 1);
      const left = Math.min(Math.floor(x), image.width - 2), top = Math.min(Math.floor(y), image.height - 2);
      const at = row * width + column;
      table.index[at] = top * image.width + left;
      right[at] = Math.round((x - left) * 256);
      down[at] = Math.round((y - top) * 256);
    }
  }
  return table;
}

/** Fills `to` with the unrolled image. Both hold a Uint32 for each pixel; two of its bytes are interpolated at once. */
export function unrollImage({ index, right, down, stride }, from, to) {
  const two = 0xff00ff;
  for (let i = 0; i < index.length; ++i) {
    const at = index[i];
    to[i] = 0;
    if (at < 0) continue;
    const a = from[at], b = from[at + 1], c = from[at + stride], d = from[at + stride + 1];
    const x = right[i], y = down[i], u = 256 - x, v = 256 - y;
    const even = ((((a & two) * u + (b & two) * x) >>> 8) & two) * v +
      ((((c & two) * u + (d & two) * x) >>> 8) & two) * y;
    const odd = (((((a >>> 8) & two) * u + ((b >>> 8) & two) * x) >>> 8) & two) * v +
      (((((c >>> 8) & two) * u + ((d >>> 8) & two) * x) >>> 8) & two) * y;
    to[i] = ((even >>> 8) & two) | (odd & 0xff00ff00);
  }
}
