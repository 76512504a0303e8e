//! A small effect of each stage: what a template begins with.

use crate::effects::Stage;

/// A small effect, the same in C++ and in Rust but for the body.
pub(super) struct Sketch {
    /// What `in` and `out` are.
    pub values: &'static str,
    /// What happens.
    pub summary: &'static str,
    /// The formula.
    pub formula: &'static str,
    /// Estimated parameters: name, unit, typical size, largest plausible size.
    pub estimated: &'static [(&'static str, &'static str, f64, f64)],
    /// Given parameters: name, unit, default.
    pub given: &'static [(&'static str, &'static str, f64)],
    /// What it is, what to do about it, and what would tell it from its like.
    pub words: [&'static str; 3],
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
            values: "in: x, y (the predicted image point, px), f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2; out: x, y",
            summary: "The columns of the sensor are displaced by a wave, as where it was exposed in steps.",
            formula: "x += a sin(2 pi x / wavelength) + b cos(2 pi x / wavelength)",
            estimated: &[("a", "px", 0.2, 2.0), ("b", "px", 0.2, 2.0)],
            given: &[("wavelength", "px", 400.0)],
            words: [
                "The columns of the sensor are displaced in a wave that repeats. \
                 Points jump by a fraction of a pixel from one column to another.",
                "Model it, or calibrate the sensor.",
                "images turned by 90 degrees",
            ],
            needs: &[],
            cpp: "\
    using std::cos;
    using std::sin;
    constexpr double kTurn = 6.283185307179586;
    const T phase = kTurn * in[0] / theta[2];
    out[0] = in[0] + theta[0] * sin(phase) + theta[1] * cos(phase);
    out[1] = in[1];
    return true;
",
            rust: "\
        let phase = input[0] * std::f64::consts::TAU / theta[2];
        out[0] = input[0] + theta[0] * phase.sin() + theta[1] * phase.cos();
        out[1] = input[1];
        true
",
        },
        Stage::Interior => Sketch {
            values: "in: f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2, then the rotation vector of the image (3); out: the first twelve",
            summary: "The focal length grows from the first image of each flight on.",
            formula: "f += a t, t the minutes since the first image of the flight",
            estimated: &[("a", "px/min", 1.0, 20.0)],
            given: &[],
            words: [
                "The focal length grows during each flight, as that of a lens does which warms up. \
                 Images from the end of a flight then have another scale.",
                "Let the camera warm up before the flight, or model it.",
                "a recorded temperature, or a flight with a warm camera",
            ],
            needs: &["Time"],
            cpp: "\
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0] * (context.flight_time_s / 60.0);
    return true;
",
            rust: "\
        out.copy_from_slice(&input[..12]);
        out[0] = input[0] + theta[0] * (context.flight_time_s / 60.0);
        true
",
        },
        Stage::Exposure => Sketch {
            values: "in, out: rotation vector of R (world to camera; 3), projection centre C (m; 3)",
            summary: "The shutter opens later than the camera says, and the platform has moved on.",
            formula: "C += v a",
            estimated: &[("a", "s", 0.01, 0.2)],
            given: &[],
            words: [
                "The camera notes a time, and opens its shutter later. By then it has moved on along its track.",
                "Have the delay calibrated, or model it.",
                "flight lines at another speed",
            ],
            needs: &["Velocity"],
            cpp: "\
    for (int k = 0; k < 3; ++k) out[k] = in[k];
    for (int k = 0; k < 3; ++k) out[3 + k] = in[3 + k] + theta[0] * context.velocity[k];
    return true;
",
            rust: "\
        out[..3].copy_from_slice(&input[..3]);
        for k in 0..3 {
            out[3 + k] = input[3 + k] + theta[0] * context.velocity[k];
        }
        true
",
        },
        Stage::Ray => Sketch {
            values: "in: rotation vector of R (3), projection centre C (m; 3), point P (m; 3); out: P as the straight ray sees it (m; 3)",
            summary: "Rays bend: what is far to the side is seen higher than it is.",
            formula: "P_z += a d^2, d the horizontal distance from the camera",
            estimated: &[("a", "1/m", 1e-6, 1e-5)],
            given: &[],
            words: [
                "Rays are bent on their way through the air. \
                 Points at the side of an image are seen higher than they are.",
                "Model it, or fly lower.",
                "images from two heights",
            ],
            needs: &[],
            cpp: "\
    const T dx = in[6] - in[3], dy = in[7] - in[4];
    out[0] = in[6];
    out[1] = in[7];
    out[2] = in[8] + theta[0] * (dx * dx + dy * dy);
    return true;
",
            rust: "\
        let (dx, dy) = (input[6] - input[3], input[7] - input[4]);
        out[0] = input[6];
        out[1] = input[7];
        out[2] = input[8] + theta[0] * (dx * dx + dy * dy);
        true
",
        },
        Stage::Position => Sketch {
            values: "in: rotation vector of R (3), projection centre C (m; 3); out: antenna (m; 3)",
            summary: "The antenna stands above the camera.",
            formula: "antenna = C + (0, 0, a)",
            estimated: &[("a", "m", 0.05, 0.5)],
            given: &[],
            words: [
                "The GNSS antenna is not at the lens. Positions are those of the antenna, above the camera.",
                "Measure the offset, or model it.",
                "images with the camera turned about its axis",
            ],
            needs: &["Gnss"],
            cpp: "\
    for (int k = 0; k < 3; ++k) out[k] = in[3 + k];
    out[2] += theta[0];
    return true;
",
            rust: "\
        out.copy_from_slice(&input[3..]);
        out[2] = input[5] + theta[0];
        true
",
        },
        Stage::Control => Sketch {
            values: "in: point P (m; 3); out: its surveyed coordinates (m; 3)",
            summary: "The targets of the survey are thicker than was thought.",
            formula: "z += a",
            estimated: &[("a", "m", 0.01, 0.1)],
            given: &[],
            words: [
                "The survey measured the ground, and the images see the top of the target. \
                 Control points are then too low by its thickness.",
                "Measure the thickness of a target, or model it.",
                "a target measured once more with a level",
            ],
            needs: &["Control"],
            cpp: "\
    for (int k = 0; k < 3; ++k) out[k] = in[k];
    out[2] += theta[0];
    return true;
",
            rust: "\
        out.copy_from_slice(input);
        out[2] = input[2] + theta[0];
        true
",
        },
        Stage::Frame => Sketch {
            values: "in, out: a coordinate in the system of the survey (m; 3), of points and of antennas (context.surveyed_kind)",
            summary: "The survey's heights are tilted from west to east.",
            formula: "z += a (x - x0), x0 the survey's centre",
            estimated: &[("a", "1", 1e-4, 0.01)],
            given: &[],
            words: [
                "The heights of the survey are tilted against the images. \
                 The block then leans to the east or the west.",
                "Check the heights of the control points, or model it.",
                "control points of another survey",
            ],
            needs: &["Vertical"],
            cpp: "\
    for (int k = 0; k < 3; ++k) out[k] = in[k];
    out[2] += theta[0] * (in[0] - context.survey_mean[0]);
    return true;
",
            rust: "\
        out.copy_from_slice(input);
        out[2] = input[2] + theta[0] * (input[0] - context.survey_mean[0]);
        true
",
        },
    }
}
