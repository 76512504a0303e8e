// The images themselves (misclosure lab --images): parts of them, and how a place in the block's pixels lies in the
// file.

import { binary } from "./api.js";
import { state } from "./state.js";

const REMEMBERED = 8;
const files = new Map();

export const hasPhoto = (image) => Boolean(state.block.images[image]?.photo);
export const hasPhotos = () => state.block.images.some((image) => image.photo);

/** File of an image, read once. */
function file(image) {
  const { name } = state.block.images[image];
  if (!files.has(name)) {
    files.set(name, read(name).catch((error) => {
      files.delete(name);
      throw error;
    }));
    if (files.size > REMEMBERED) files.delete(files.keys().next().value);
  }
  return files.get(name);
}

async function read(name) {
  const blob = new Blob([await binary(`photos/${encodeURIComponent(name)}`)]);
  const bitmap = await createImageBitmap(blob).catch(() => { throw new Error(
    `${name}: the browser cannot draw this file.`); });
  const size = [bitmap.width, bitmap.height];
  bitmap.close();
  return { blob, size };
}

/** File of an image with its pixels per pixel of the block: a smaller copy is as good, another shape is another image.
 * */
async function sized(image) {
  const { blob, size } = await file(image);
  const { width_px, height_px } = state.block.cameras[state.block.images[image].camera];
  const [x, y] = [size[0] / width_px, size[1] / height_px];
  if (Math.abs(x - y) > 0.01 * x) throw new Error(`The file measures ${size.join(" × ")} px, the camera ${width_px} `
    + `× ${height_px}: turned or cropped, so that places in it are not those of the block.`);
  return { blob, size, scale: x };
}

/** The whole of an image as a bitmap, with the pixels of the file per pixel of the block. */
export async function whole(image) {
  const { blob, scale } = await sized(image);
  return { bitmap: await createImageBitmap(blob), scale };
}

/** An address of a copy `width` pixels wide. */
const copies = new Map();
export async function copyOf(image, width = 1200) {
  if (copies.has(image)) return copies.get(image);
  const { blob, size } = await sized(image);
  const by = Math.min(1, width / size[0]);
  const bitmap = await createImageBitmap(blob, { resizeWidth: Math.round(size[0] * by),
    resizeHeight: Math.round(size[1] * by), resizeQuality: "medium" });
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
  bitmap.close();
  const address = URL.createObjectURL(await new Promise((done) => canvas.toBlob(done, "image/jpeg", 0.85)));
  copies.set(image, address);
  if (copies.size > REMEMBERED) {
    const [oldest, gone] = copies.entries().next().value;
    copies.delete(oldest);
    URL.revokeObjectURL(gone);
  }
  return address;
}

/** Paints the part of an image about a place (px of the block), `side` wide, over a whole canvas. */
export async function paintPatch(canvas, image, [x, y], side) {
  const { blob, scale } = await sized(image);
  const [left, top, wide] = [(x - side / 2) * scale, (y - side / 2) * scale, side * scale];
  // What lies beyond the edge of the image stays empty.
  const patch = await createImageBitmap(blob, Math.round(left), Math.round(top), Math.max(1, Math.round(wide)),
    Math.max(1, Math.round(wide)));
  const context = canvas.getContext("2d");
  context.imageSmoothingEnabled = wide > canvas.width;
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.drawImage(patch, 0, 0, canvas.width, canvas.height);
  patch.close();
}
