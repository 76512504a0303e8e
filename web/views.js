// The figures that the page can show. All but `space` are drawn by the server, the same as in the report.

import { set, state } from "./state.js";

export const VIEWS = [
  { key: "1", id: "sensor", short: "Sensor", title: "Mean residuals over the sensor" },
  { key: "2", id: "plan", short: "Plan", title: "Errors of check and control points in plan", surveyed: true },
  { key: "3", id: "height", short: "Height", title: "Errors of check and control points in height", surveyed: true },
  { key: "4", id: "flights", short: "Flights", title: "Cameras and points in plan and profile" },
  { key: "g", id: "gnss", short: "GNSS",
    title: "Errors of the GNSS positions in plan, in height, against time and heading" },
  { key: "5", id: "profile", short: "Profile", title: "Mean residual against a recorded quantity" },
  { key: "6", id: "images", short: "Images", title: "RMS of each image" },
  { key: "7", id: "image", short: "One image", title: "All residuals of one image" },
  { key: "8", id: "histogram", short: "Histogram", title: "How the residuals are distributed" },
  { key: "9", id: "checks", short: "Checks", title: "How the errors of check points are distributed", surveyed: true },
  { key: "0", id: "space", short: "3D", title: "Cameras, points and their errors in space" },
];

/** Whether the block has what a figure shows: without control and check points, or GNSS, some are empty. */
export function isThere(id) {
  const view = VIEWS.find((one) => one.id === id);
  return id === "space" || (state.block.views.includes(id) && (!view?.surveyed || state.block.surveyed.length > 0));
}

/** The figures that are shown; in place of those that the block has nothing for, its GNSS positions, else where its
 * cameras are. */
export function shownViews() {
  const views = state.views.filter(isThere);
  return views.length < state.views.length ? inOrder([...new Set([...views, isThere("gnss") ? "gnss" : "flights"])])
    : views;
}

/** Chooses an image, and shows its figure. */
export const showImage = (image) => set({ image, views: inOrder([...new Set([...shownViews(), "image"])]) });

/** One figure takes all the room, or gives it back. */
export const enlarge = (view) => set({ large: state.large === view ? null : view });

/** As they stand in the bar. */
export const inOrder = (views) => VIEWS.map((view) => view.id).filter((id) => views.includes(id));
