//! A small example of each stage, one parameter times a plain change, that the author of an effect replaces.

use crate::effects::Stage;

/// A small effect, the same in C++ and in Rust but for the body.
pub(super) struct Sketch {
    /// What `in` and `out` are.
    pub values: &'static str,
    /// What the example does.
    pub example: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// Its parameter: name, unit, typical size, largest plausible size.
    pub estimated: (&'static str, &'static str, f64, f64),
    /// Names of the needs, without the `k`.
    pub needs: &'static [&'static str],
    /// Statements of C++.
    pub cpp: &'static str,
    /// Statements of Rust.
    pub rust: &'static str,
}

/// The sketch of a stage.
pub(super) fn sketch(stage: Stage) -> Sketch {
    match stage {
        Stage::Image => Sketch {
            values: "in: x, y (the predicted image point, px), f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2; out: \
                     x, y",
            example: "columns move by the product of both coordinates",
            formula: "x += a u v, (u, v) = (x - ppx, y - ppy) / f",
            estimated: ("a", "px", 0.2, 2.0),
            needs: &[],
            cpp: "    const T u = (in[0] - in[3]) / in[2];
    const T v = (in[1] - in[4]) / in[2];
    out[0] = in[0] + theta[0] * u * v;
    out[1] = in[1];
    return true;
",
            rust: "        let u = (input[0] - input[3]) / input[2];
        let v = (input[1] - input[4]) / input[2];
        out[0] = input[0] + theta[0] * u * v;
        out[1] = input[1];
        true
",
        },
        Stage::Interior => Sketch {
            values: "in: f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2, then the rotation vector of the image (3); \
                     out: the first twelve",
            example: "the focal length grows from the first image of each flight on",
            formula: "f += a t, t the minutes since the first image of the flight",
            estimated: ("a", "px/min", 1.0, 20.0),
            needs: &["Time"],
            cpp: "    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0] * (context.flight_time_s / 60.0);
    return true;
",
            rust: "        out.copy_from_slice(&input[..12]);
        out[0] = input[0] + theta[0] * (context.flight_time_s / 60.0);
        true
",
        },
        Stage::Exposure => Sketch {
            values: "in, out: rotation vector of R (world to camera; 3), projection centre C (m; 3)",
            example: "the shutter opens late, and the platform has moved on",
            formula: "C += v a",
            estimated: ("a", "s", 0.01, 0.2),
            needs: &["Velocity"],
            cpp: "    for (int k = 0; k < 3; ++k) out[k] = in[k];
    for (int k = 0; k < 3; ++k) out[3 + k] = in[3 + k] + theta[0] * context.velocity[k];
    return true;
",
            rust: "        out[..3].copy_from_slice(&input[..3]);
        for k in 0..3 {
            out[3 + k] = input[3 + k] + theta[0] * context.velocity[k];
        }
        true
",
        },
        Stage::Ray => Sketch {
            values: "in: rotation vector of R (3), projection centre C (m; 3), point P (m; 3); out: P as the straight \
                     ray sees it (m; 3)",
            example: "rays bend, and points far to the side are seen too high",
            formula: "P_z += a d^2, d the horizontal distance from the camera",
            estimated: ("a", "1/m", 1e-6, 1e-5),
            needs: &[],
            cpp: "    const T dx = in[6] - in[3], dy = in[7] - in[4];
    out[0] = in[6];
    out[1] = in[7];
    out[2] = in[8] + theta[0] * (dx * dx + dy * dy);
    return true;
",
            rust: "        let (dx, dy) = (input[6] - input[3], input[7] - input[4]);
        out[0] = input[6];
        out[1] = input[7];
        out[2] = input[8] + theta[0] * (dx * dx + dy * dy);
        true
",
        },
        Stage::Position => Sketch {
            values: "in: rotation vector of R (3), projection centre C (m; 3); out: antenna (m; 3)",
            example: "the antenna stands above the camera",
            formula: "antenna = C + (0, 0, a)",
            estimated: ("a", "m", 0.05, 0.5),
            needs: &["Gnss"],
            cpp: "    for (int k = 0; k < 3; ++k) out[k] = in[3 + k];
    out[2] += theta[0];
    return true;
",
            rust: "        out.copy_from_slice(&input[3..]);
        out[2] = input[5] + theta[0];
        true
",
        },
        Stage::Control => Sketch {
            values: "in: point P (m; 3); out: its surveyed coordinates (m; 3)",
            example: "the targets are thicker than the survey knows",
            formula: "z += a",
            estimated: ("a", "m", 0.01, 0.1),
            needs: &["Control"],
            cpp: "    for (int k = 0; k < 3; ++k) out[k] = in[k];
    out[2] += theta[0];
    return true;
",
            rust: "        out.copy_from_slice(input);
        out[2] = input[2] + theta[0];
        true
",
        },
        Stage::Frame => Sketch {
            values: "in, out: a coordinate in the system of the survey (m; 3), of points and of antennas \
                     (context.surveyed_kind)",
            example: "the survey's heights are tilted from west to east",
            formula: "z += a (x - x0), x0 the survey's centre",
            estimated: ("a", "1", 1e-4, 0.01),
            needs: &["Vertical"],
            cpp: "    for (int k = 0; k < 3; ++k) out[k] = in[k];
    out[2] += theta[0] * (in[0] - context.survey_mean[0]);
    return true;
",
            rust: "        out.copy_from_slice(input);
        out[2] = input[2] + theta[0] * (input[0] - context.survey_mean[0]);
        true
",
        },
    }
}
