// The image behind one image's residuals, faint, where the figure has the sensor.

import { svg } from "./dom.js";
import { copyOf, hasPhoto } from "./photos.js";
import { plotsOf } from "./plots.js";
import { state } from "./state.js";

/** Lays a copy of the image under a drawing of its residuals; where it cannot be drawn, the reason stands at the
 * drawing. */
export async function layPhoto(drawing, image) {
  if (!hasPhoto(image)) return;
  const { width_px, height_px } = state.block.cameras[state.block.images[image].camera];
  const plot = plotsOf(drawing)[0];
  if (!plot) return;
  const [x0, x1] = [0, width_px].map(plot.x.pixel);
  const [y0, y1] = [0, height_px].map(plot.y.pixel);
  const box = { x: Math.min(x0, x1), y: Math.min(y0, y1), width: Math.abs(x1 - x0), height: Math.abs(y1 - y0) };
  // Above the paper, below everything that is drawn on it.
  const paper = drawing.querySelector("rect");
  try {
    const href = await copyOf(image);
    paper.after(svg("image", { ...box, href, preserveAspectRatio: "none", class: "photo" }));
  } catch (error) {
    paper.after(svg("text", { x: box.x + 8, y: box.y + 18, "font-size": 12, fill: "#767676" }, error.message));
  }
}
