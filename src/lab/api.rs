//! What the page and the server say to each other.
//!
//! The page is `/?token=TOKEN`. Everything under `/api/` needs the token: as the header `x-token`, or (figures, events,
//! downloads) as the query parameter `token`. `Host` must be `127.0.0.1:PORT` or `localhost:PORT`, `Origin`, where
//! there is one, `http://` with the same; no other origin is answered. Whatever changes something is a POST with a JSON
//! body (`content-type: application/json`). Numbers that are not known are `null`. Lengths are metres unless a key ends
//! in `_mm`, image lengths pixels. An error is an HTTP status and `{"error": "what, where, what was expected"}`: 400 a
//! bad parameter, 401 no or a wrong token, 403 another host or origin, 404 nothing of that name, 409 not yet (a step
//! that is not done), 500 a computation that failed.
//!
//! A node's `id` is a whole number from 1; its folder is `FOLDER/step-0001`.
//!
//! # `GET /api/tree`
//!
//! ```json
//! { "block": "received-1", "folder": "/home/me/received-1.lab", "simulated": false,
//!   "nodes": [ { "id": 2, "parent": 1, "state": "done",
//!     "change": { "kind": "add", "effect": "rolling-shutter" }, "words": "+ rolling-shutter",
//!     "figures": { "tie_rms_px": 0.241, "heldout_px": 0.331, "check_rms_m": 0.00438, "check_height_rms_m": 0.0033,
//!                  "gnss_rms_m": 0.051, "sigma0": 0.888, "unknowns": 1234, "observations": 4567, "outliers": 38 },
//!     "delta_words": "check points 17.1 → 4.4 mm, tie points 0.274 → 0.241 px",
//!     "moved": "Rolling shutter (19.2 ms) moved your points by 17.2 mm (4 check points, 3D RMS).",
//!     "verdict": "missing", "agree": true, "one_derivation": null, "mistake": null, "error": null,
//!     "seconds": 4.2 } ] }
//! ```
//!
//! `seconds` is what a step took, or, of one that runs, what it has taken so far. `state` is `waiting`, `running`,
//! `done`, `failed` (with `error`) or `cancelled`; of any but `done` the keys from `figures` to `mistake` are null,
//! except that a `running` one has `figures` and `delta_words` as soon as both solvers are done: what is left is tested
//! after that. `moved` says what the effects of the model did to the points, in the sentences of the report; null
//! without any. What failed or was cancelled is in the tree until the server ends, without a folder. `verdict` is
//! `mistake` where something is recorded wrongly (`mistake` says what, in a sentence), `missing` where a candidate is
//! significant, `unexplained` where structure is left and no candidate is, else `adequate`. `agree` says whether the
//! two solvers do (null where one ran), `one_derivation` what has to be said with it where the model has a plug-in.
//!
//! # `GET /api/longest`
//!
//! `{ "sensor": [0.31], "plan": 41.0, "height": 22.5, "gnss_plan": 0.08, "gnss_height": 0.13 }`: the longest arrows of
//! all steps that are done, by camera in px, of points in mm, of GNSS positions in m. Figures that are drawn with
//! `longest=` of it have one scale that fits every step: that is how scales are locked.
//!
//! # `GET /api/block`
//!
//! ```json
//! { "name": "received-1", "crs": "", "origin": [0, 0, 0],
//!   "cameras": [ { "id": "cam", "width_px": 5120, "height_px": 3840, "images": 113 } ],
//!   "parameters": [ { "name": "f", "unit": "px" } ], "groups": [ { "name": "pp", "parameters": ["ppx", "ppy"] } ],
//!   "flights": ["nadir50"],
//!   "images": [ { "name": "a.jpg", "photo": false, "camera": 0, "flight": 0, "time_s": 12.5, "temperature_c": null,
//!     "e": 1.0,
//!                 "n": 2.0, "h": 50.0 } ],
//!   "surveyed": [ { "name": "G1", "role": "control", "e": 1.0, "n": 2.0, "h": 3.0 } ],
//!   "quantities": [ { "id": "time", "label": "time", "unit": "s" } ],
//!   "views": ["sensor", "image", "images", "plan", "height", "flights", "gnss", "profile", "histogram", "checks",
//!             "ledger"],
//!   "datums": ["free", "control", "gnss", "all"], "losses": ["none", "huber", "cauchy"],
//!   "tie_weights": ["unit", "multi", "pairs"],
//!   "effects": [ { "id": "rolling-shutter", "about": "The sensor is read out row by row.", "kind": "physical" } ] }
//! ```
//!
//! `photo` says whether `GET /api/photos/NAME` has the image itself (opened with `--images FOLDER`; 404 otherwise).
//! Image and flight are indices from 0 everywhere (`images[k]`). Coordinates are about `origin`; add it for those of
//! the survey.
//!
//! # `GET /api/nodes/ID/figures/NAME.svg` and `GET /api/nodes/ID/predicted/EFFECT/figures/NAME.svg`
//!
//! | name | shows | also takes |
//! |---|---|---|
//! | `sensor` | mean residual in cells of the sensor, with their counts, significant ones marked | `camera=INDEX` (default 0) |
//! | `image` | every residual of one image, outliers marked | `image=INDEX` |
//! | `images` | RMS of each image | |
//! | `plan` | check and control points: error in plan as arrows | |
//! | `height` | the same in height | |
//! | `flights` | cameras, control and check points, brushed images stand out | |
//! | `profile` | mean residual in bins of a quantity | `against=QUANTITY` (default the first), `component=LIST` |
//! | `gnss` | GNSS positions: computed minus measured | `show=plan`, `height`, `time` or `heading` (default `plan`) |
//! | `histogram` | residuals in x and y | |
//! | `checks` | errors of check points | |
//! | `ledger` | the figures of every step from the root to the node | |
//!
//! Components are `x`, `y`, `radial`, `tangential`, `along` and `across` (default `x,y`). `views` of a block lacks
//! `gnss` where the block has no GNSS positions.
//!
//! All take `brush=JSON`, `scale=NUMBER` (arrows: figure pixels per unit; as in the `data-scale` of another figure),
//! `longest=NUMBER` (in place of a scale: an arrow of that length, in the unit of the figure, has to fit, too),
//! `y=LOW,HIGH` (charts: the range of the vertical axis at least) and `width=PX` (of the drawing; text keeps its size).
//! `plan`, `height` and `checks` take `role=check|control` (default: check points where there are any). The root
//! element has `data-scale` where arrows are drawn. Each plotting area is a transparent element behind nothing, drawn
//! last:
//!
//! ```text
//! <rect class="plot" x y width height fill="none"
//!       data-view="sensor" data-camera="0" data-against="time" data-image="3" data-component="x"
//!       data-x="v0 v1" data-px="left right" data-xkey="x" data-xlog="0"
//!       data-y="v0 v1" data-py="top bottom" data-ykey="y" data-ylog="0"/>
//! ```
//!
//! `data-x` has the values at the pixels of `data-px`. `data-view` and the keys are those of a brush; without
//! `data-ykey` a brush is a band over the full height; without `data-view` the area cannot be brushed. Bars of images
//! carry `data-image="INDEX"`. Colours are the literal attributes of `report/style.rs`, in capitals; the page's style
//! sheet overrides them by attribute selectors.
//!
//! Predicted figures are of the residuals that the null model expects with the effect in the model, before any refit.
//! `GET /api/nodes/ID/predicted/EFFECT` gives `{ "effect", "tie_rms_px", "check_rms_m", "words" }`.
//!
//! # Brush
//!
//! One object or several; of several, what is in all of them. A measurement is in
//!
//! ```json
//! { "view": "sensor", "camera": 0, "x": [0, 500], "y": [0, 400] }
//! { "view": "image", "image": 3, "x": [0, 500], "y": [0, 400] }
//! { "view": "images", "ids": [0, 5, 6] }
//! { "view": "images", "range": [0, 6] }
//! { "view": "profile", "against": "time", "range": [10.0, 20.0] }
//! { "view": "plan", "e": [0, 10], "n": [0, 20] }
//! { "view": "flights", "e": [0, 10], "n": [0, 20] }
//! { "view": "space", "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 10], "x": [-1, 0], "y": [0, 1] }
//! { "view": "histogram", "component": "x", "range": [-1, 1] }
//! ```
//!
//! `plan` and `height` choose by where the measured point lies, `flights` by where the camera stands; both in the
//! coordinates of the figure. `space` chooses the points in a rectangle of the picture: `matrix` takes metres about
//! `origin` to clip coordinates, column by column, `x` and `y` run from -1 to 1, right and up. A list `[{...}, {...}]`
//! is the intersection.
//!
//! # `GET /api/nodes/ID/measurements?brush=..&offset=0&limit=100&sort=size|image`
//!
//! ```json
//! { "total": 2400, "n": 120, "rms_px": 0.27, "marks": { "n": 12, "rms_px": 0.4 }, "mean_px": [0.01, -0.02],
//!   "images": [ { "image": 3, "n": 20, "rms_px": 0.3 } ],
//!   "rows": [ { "image": 3, "image_name": "a.jpg", "point": "t17", "kind": "tie", "x": 1.0, "y": 2.0, "rx": 0.1,
//!               "ry": 0.2, "sigma": 0.3, "normalised": 1.1, "set_aside": false } ] }
//! ```
//!
//! `rms_px` is of the tie points alone, `marks` of the marks. Rows with `set_aside: true` are outliers of the node,
//! with the reason in `reason`; they are in no mean. Without a brush `n` is `total`.
//!
//! # `GET /api/nodes/ID/model`
//!
//! ```json
//! { "cameras": [ { "id": "cam", "parameters": [ { "name": "f", "unit": "px", "value": 5511.8, "sigma": 0.1,
//!                                                  "free": true } ] } ],
//!   "effects": [ { "id": "rolling-shutter", "parameters": [ { "name": "t", "unit": "s", "value": 0.0194,
//!                                                              "sigma": 0.0004 } ] } ],
//!   "free": ["f", "ppx"], "tied": false, "datum": "all", "loss": "none", "tie_weights": "unit",
//!   "sigma_factors": { "image": 0.5 },
//!   "outliers": { "n": 38, "rows": [ { "image": "a.jpg", "point": "t17", "kind": "tie", "reason": "..." } ] } }
//! ```
//!
//! # `GET /api/nodes/ID/space` (binary, little endian)
//!
//! `u32` length of a JSON header in bytes, the header (padded with spaces to a multiple of 4), then `f32` arrays in the
//! order of the header, row by row, coordinates about `origin`:
//!
//! ```json
//! { "origin": [0, 0, 0], "ties": { "rows": 14000, "brushed": 0 }, "arrays": [
//!   { "name": "stations", "columns": ["x", "y", "z", "ax", "ay", "az", "ux", "uy", "uz", "flight"], "rows": 113,
//!     "ids": ["a.jpg"] },
//!   { "name": "ties", "columns": ["x", "y", "z", "rms_px"], "rows": 14000 },
//!   { "name": "checks", "columns": ["x", "y", "z", "dx", "dy", "dz"], "rows": 40, "ids": ["C1"] },
//!   { "name": "control", "columns": ["x", "y", "z", "dx", "dy", "dz"], "rows": 10, "ids": ["G1"] } ] }
//! ```
//!
//! With `?brush=..` ties, checks and control have a last column `brushed`: how many measurements of the tie point are,
//! and whether a mark of the surveyed point is. At most 50 000 tie points are sent, always the same ones, and of the
//! others some that are brushed; `ties` of the header counts all of them. `a` is the viewing direction, `u` points up
//! in the image; `d` is computed minus surveyed (m), NaN where it is not compared.
//!
//! # `GET /api/nodes/ID/points`
//!
//! ```json
//! { "points": [ { "point": "G1", "role": "control", "e": 1.0, "n": 2.0, "h": 3.0, "dx_mm": 4.1, "dy_mm": -2.0,
//!     "dz_mm": 9.5, "size_mm": 10.5, "marks": [ { "image": 3, "x": 1201.5, "y": 877.2, "rx": 0.12, "ry": -0.4,
//!     "set_aside": false } ] } ] }
//! ```
//!
//! Surveyed points, the largest error first, coordinates as in the figures; of each its marks (px, residuals observed
//! minus computed, null where there are none).
//!
//! # `GET /api/nodes/ID/candidates`
//!
//! ```json
//! { "verdict": "missing", "sentence": "...", "left": ["..."], "recommended": ["rolling-shutter"],
//!   "next": "rolling-shutter",
//!   "mistakes": [ { "kind": "scale", "subject": "control", "names": [], "value": 3.28084, "sigma": null, "unit": "1",
//!       "drop": 5123.4, "ln_p": -2550.1, "sentence": "...", "remedy": "...",
//!       "mend": [ { "file": "control.csv", "...": "..." } ] } ],
//!   "candidates": [ { "effect": "rolling-shutter", "rank": 1, "kind": "physical", "tested": true,
//!   "significant": true, "plausible": true,
//!       "p_value": 0.0, "ln_p_value": -780.1, "statistic": 1797.8, "dof": 1, "predicted_drop": 1416.3,
//!       "size_px": 0.15,
//!       "estimate": { "t": { "value": 0.0192, "sigma": 0.00045, "unit": "s" } }, "impact_mm": 17.4,
//!       "impact_height_mm": 5.1,
//!       "impact_surveyed": true, "inseparable_from": [], "needs": [], "detectable": null,
//!       "sentences": ["The sensor is read out row by row ...", "To tell: ..."] } ],
//!   "found": [ { "effect": "...", "...": "as a candidate, of what the steps added", "drop": 1416.5 } ],
//!   "structure": [ { "against": "row", "p_value": 1e-9, "family_p_value": 1e-8, "description": "..." } ] }
//! ```
//!
//! `next` is the effect that the objective adds next, null where nothing is missing any more (`recommended` then names
//! what the steps added). Candidates come strongest impact first among the significant, then the others by rank, then
//! those that cannot be tested, with what they need. `mistakes` has the keys that `diagnosis.json` has; `mend` is
//! absent where a person has to look.
//!
//! # Steps
//!
//! `POST /api/steps` with `{ "parent": 1, "change": {...} }` gives `{ "id": 2 }` at once;
//! [`Change`](super::change::Change) is one of
//!
//! ```json
//! { "kind": "add", "effect": "rolling-shutter", "values": { "t": 0.02 } }
//! { "kind": "remove", "effect": "rolling-shutter" }
//! { "kind": "free", "parameters": ["f", "pp", "radial"] }
//! { "kind": "tie_centre", "tied": true }
//! { "kind": "datum", "datum": "control" }
//! { "kind": "loss", "loss": "huber" }
//! { "kind": "weights", "tie_weights": "multi", "factors": { "image": 2.0 } }
//! { "kind": "estimate_weights" }
//! { "kind": "set_aside", "measurements": [ { "image": "a.jpg", "point": "t17", "kind": "tie" } ] }
//! { "kind": "set_aside_brush", "brush": { "view": "images", "ids": [3] } }
//! { "kind": "take_back", "measurements": [ { "image": "a.jpg", "point": "t17", "kind": "tie" } ] }
//! { "kind": "search_outliers" }
//! { "kind": "mend", "only": ["scale"] }
//! { "kind": "improve" }
//! ```
//!
//! `values` of `add`, the keys of `weights` and `kind` of a measurement (then `tie`) may be left out. `free` names
//! every camera parameter or group that is free after the step, the others are held. An empirical field is added like
//! any effect. `mend` undoes the mistakes of the kinds in `only` (left out: of all kinds) that have edits: the block of
//! that step, and of all steps beneath it, is the edited one, and its adjustment begins anew with the model of its
//! parent. No file is changed. `improve` makes one node per step of the loop, each the child of the one before; its
//! `id` is the first. `POST /api/steps/ID/cancel` with `{}` stops a step at its next iteration, or takes it out of the
//! queue; `POST /api/steps/ID/dismiss` with `{}` takes one that failed or was cancelled out of the tree. An `improve`
//! that finds nothing to do is no step: it is taken out of the tree, with the event `nothing`.
//!
//! # `GET /api/events` (server-sent events)
//!
//! ```text
//! event: progress   data: { "node": 2, "phase": "solving", "text": "adding rolling-shutter", "solver": "native",
//!   "iteration": 3, "cost": 1234.5 }
//! event: tree       data: {}
//! event: failed     data: { "node": 2, "error": "..." }
//! event: done       data: { "node": 2 }
//! event: nothing    data: { "node": 2, "text": "..." }
//! ```
//!
//! `solver`, `iteration` and `cost` are null in a progress that only says what is done. After `tree` the page asks for
//! the tree again.
//!
//! # Export
//!
//! `GET /api/nodes/ID/report.html`, `model.toml`, `outliers.csv`; `GET /api/nodes/ID/commands` gives `{ "commands":
//! ["misclosure adjust ..."] }`, which reproduce the node from the shell; below a step that mends they begin with
//! `misclosure mend`. A line that begins with `#` says what they cannot repeat.
//!
//! # With `--simulate`
//!
//! `GET /api/causes` gives `{ "preset": "dike", "errors": ["noise:px=0.3"], "mistakes": [], "seed": 1, "causes": [ {
//! "id": "rolling-shutter", "about": "...", "parameters": [ { "name": "readout", "unit": "s", "kind": "number",
//! "default": 0.03, "without": null, "min": 0, "max": 0.1, "choices": null, "about": "..." } ] } ] }` (404 without
//! `--simulate`). `kind` is `number`, `flag` (0 or 1), `choice` (of `choices`), or, where it may be left out and
//! `without` says what then holds, `optional` (a number), `name` (of `choices`) or `list` (numbers separated by `/`).
//!
//! `POST /api/simulate` with `{ "errors": ["rolling-shutter:readout=0.02"], "seed": 1 }` measures the block anew as a
//! new root node and gives its `id`; parameters that do not go together are refused at once.
//!
//! `GET /api/truth/ID` compares a node with the truth: `{ "rows": [ { "what": "f (cam)", "truth": 5500.0, "reason":
//! null, "estimate": 5501.2, "sigma": 0.8, "unit": "px" } ], "errors": ["rolling-shutter:readout=0.02"], "mistakes":
//! [], "point_rms_mm": 3.1 }`. `reason` says why a row has no `truth`. `mistakes` are those of `--mistake`; every
//! measurement has them.
//!
//! # A plan on sliders
//!
//! `misclosure lab --plan SCENARIO` serves another page. It answers two requests, and none of those above.
//!
//! `GET /api/dials`:
//!
//! ```json
//! { "scenario": "mapping", "datum": null,
//!   "dials": [ { "name": "height_m", "about": "flying height of the nadir strips", "min": 20, "max": 500,
//!                "whole": false, "value": 80 } ] }
//! ```
//!
//! `POST /api/plan` with `{ "values": { "height_m": 70 }, "datum": "control", "draft": true }`, all of it optional,
//! answers with the plan of the turned scenario: `plan` (as `misclosure plan --json`), `flights` (the overlaps that
//! result), `minutes` (from the first image to the last), `tie_points` and `check` of the whole block, `draft` (the tie
//! points that stood for them, null where all did), `map` and `ellipses` (drawings; a draft has no ellipses), `command`
//! (the same in a shell) and `seconds` (what it took).
