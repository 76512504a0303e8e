// The figures that the page can show. All but `space` are drawn by the server, the same as in the report.

export const VIEWS = [
  { id: "sensor", short: "Sensor", title: "Mean residuals over the sensor" },
  { id: "plan", short: "Plan", title: "Errors of check and control points in plan" },
  { id: "height", short: "Height", title: "Errors of check and control points in height" },
  { id: "flights", short: "Flights", title: "Cameras and points in plan and profile" },
  { id: "profile", short: "Profile", title: "Mean residual against a recorded quantity" },
  { id: "images", short: "Images", title: "RMS of each image" },
  { id: "image", short: "One image", title: "All residuals of one image" },
  { id: "histogram", short: "Histogram", title: "How the residuals are distributed" },
  { id: "checks", short: "Checks", title: "How the errors of check points are distributed" },
  { id: "space", short: "3D", title: "Cameras, points and their errors in space" },
];
