// The figures that the page can show. All but `space` are drawn by the server, the same as in the report.

import { set, state } from "./state.js";

export const VIEWS = [
  { id: "sensor", short: "Sensor", title: "Mean residuals over the sensor" },
  { id: "plan", short: "Plan", title: "Errors of check and control points in plan", surveyed: true },
  { id: "height", short: "Height", title: "Errors of check and control points in height", surveyed: true },
  { id: "flights", short: "Flights", title: "Cameras and points in plan and profile" },
  { id: "profile", short: "Profile", title: "Mean residual against a recorded quantity" },
  { id: "images", short: "Images", title: "RMS of each image" },
  { id: "image", short: "One image", title: "All residuals of one image" },
  { id: "histogram", short: "Histogram", title: "How the residuals are distributed" },
  { id: "checks", short: "Checks", title: "How the errors of check points are distributed", surveyed: true },
  { id: "space", short: "3D", title: "Cameras, points and their errors in space" },
];

/** Whether the block has what a figure shows: without control and check points some are empty. */
export const isThere = (id) => state.block.surveyed.length > 0 || !VIEWS.find((view) => view.id === id)?.surveyed;

/** The figures that are shown; of a block that has none of the chosen ones, where its cameras are. */
export function shownViews() {
  const views = state.views.filter(isThere);
  return views.length < state.views.length ? inOrder([...new Set([...views, "flights"])]) : views;
}

/** Chooses an image, and shows its figure. */
export const showImage = (image) => set({ image, views: inOrder([...new Set([...shownViews(), "image"])]) });

/** As they stand in the bar. */
export const inOrder = (views) => VIEWS.map((view) => view.id).filter((id) => views.includes(id));
