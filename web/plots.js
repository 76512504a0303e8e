// Plotting areas of a figure: from its pixels to what its axes say, and back. The server writes them as `rect.plot`
// with data attributes.

const pair = (text) => text.split(" ").map(Number);

function axis(values, pixels, log) {
  const [v0, v1] = log ? pair(values).map(Math.log10) : pair(values);
  const [p0, p1] = pair(pixels);
  return {
    value(pixel) {
      const v = v0 + ((pixel - p0) / (p1 - p0)) * (v1 - v0);
      return log ? 10 ** v : v;
    },
    pixel: (value) => p0 + (((log ? Math.log10(value) : value) - v0) / (v1 - v0)) * (p1 - p0),
    inside: (pixel) => pixel >= Math.min(p0, p1) && pixel <= Math.max(p0, p1),
    within: (pixel) => Math.min(Math.max(p0, p1), Math.max(Math.min(p0, p1), pixel)),
    ends: [Math.min(p0, p1), Math.max(p0, p1)],
  };
}

/** A plotting area: what it is a view of (the fixed part of a brush), and its axes. */
export function plotOf(rect) {
  const data = rect.dataset;
  const of = { view: data.view };
  for (const key of ["camera", "image"]) if (data[key] !== undefined) of[key] = Number(data[key]);
  for (const key of ["against", "component"]) if (data[key] !== undefined) of[key] = data[key];
  return {
    of,
    x: axis(data.x, data.px, data.xlog === "1"),
    y: axis(data.y, data.py, data.ylog === "1"),
    keys: { x: data.xkey, y: data.ykey },
  };
}

/** The plotting areas of a drawing that can be brushed. */
export const plotsOf = (drawing) => [...drawing.querySelectorAll("rect.plot[data-view]")].map(plotOf);

/** Whether a brush was made in such an area. */
export const isOf = (brush, plot) => Object.entries(plot.of).every(([key, value]) => brush[key] === value)
  && (!plot.keys.x || brush[plot.keys.x]);

const sorted = (a, b) => (a <= b ? [a, b] : [b, a]);

/** The brush between two places of a plotting area. Without a key of an axis it takes all of that axis. */
export function brushBetween(plot, [x0, y0], [x1, y1]) {
  const brush = { ...plot.of };
  if (plot.keys.x) brush[plot.keys.x] = sorted(plot.x.value(plot.x.within(x0)), plot.x.value(plot.x.within(x1)));
  if (plot.keys.y) brush[plot.keys.y] = sorted(plot.y.value(plot.y.within(y0)), plot.y.value(plot.y.within(y1)));
  return brush;
}

/** Rectangle of a brush in a plotting area: left, top, right, bottom in the drawing's pixels. */
export function rectangleOf(plot, brush) {
  const along = (which) => {
    const range = brush[plot.keys[which]];
    return plot.keys[which] && range ? sorted(...range.map((value) => plot[which].within(plot[which].pixel(value))))
      : plot[which].ends;
  };
  const [left, right] = along("x");
  const [top, bottom] = along("y");
  return [left, top, right, bottom];
}
