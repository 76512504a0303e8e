//! What is published: numbers of "Simulation and analysis of photogrammetric UAV image blocks: influence of camera
//! calibration error".

/// S0: RMS of the reprojection, px.
pub const S0_REPROJECTION_PX: f64 = 0.006;
/// S0: RMS at the check points, m.
pub const S0_CHECK_M: f64 = 3.1e-9;

/// Focal length, principal point and centre of distortion of the camera, px.
pub const CAMERA: [f64; 5] = [5510.09, 2539.75, 1945.80, 2537.97, 1955.92];
/// Table 2, homothety about the principal point: the same after the adjustment.
pub const S2_ABOUT_PP: [f64; 5] = [5537.64, 2539.75, 1945.80, 2537.96, 1955.96];
/// Table 2, homothety about the centre of distortion.
pub const S2_ABOUT_DC: [f64; 5] = [5537.64, 2539.76, 1945.75, 2537.97, 1955.92];
/// Largest error of the homothety about the principal point, px.
pub const S2_LARGEST_PX: f64 = 16.15;
/// Reprojection RMS, px.
pub const S2_REPROJECTION_PX: f64 = 0.01;
/// Table 3: least, largest, mean, standard deviation of the change of the distortion correction, px.
pub const S2_CHANGE_ABOUT_PP: [f64; 4] = [0.02, 14.85, 8.49, 3.21];
/// Table 3, about the centre of distortion.
pub const S2_CHANGE_ABOUT_DC: [f64; 4] = [0.02, 14.86, 8.49, 3.21];

/// S3: focal length of the first and the last image, and the estimated one, px.
pub const S3_FOCAL_PX: [f64; 3] = [5510.26, 5516.43, 5512.27];
/// Table 4: mean and standard deviation in plan, height, space, mm.
pub const S3_CHECK_MM: [[f64; 2]; 3] = [[0.26, 0.19], [0.92, 0.77], [1.0, 0.74]];

/// Table 5: least, largest, mean, standard deviation of the change of the distortion correction, px.
pub const S4_CHANGE: [f64; 4] = [0.0056, 0.5784, 0.1932, 0.0996];
/// Table 6: mean and standard deviation in plan, height, space, mm.
pub const S4_CHECK_MM: [[f64; 2]; 3] = [[0.89, 0.82], [1.1, 1.5], [1.5, 1.6]];

/// Table 1: flight, images, height (m), strips, ground pixel (mm).
pub const FLIGHTS: [(&str, usize, f64, usize, f64); 4] = [
    ("oblique50", 44, 50.0, 3, 10.0),
    ("nadir50", 42, 50.0, 3, 10.0),
    ("nadir30", 12, 30.0, 1, 6.0),
    ("nadir70", 15, 70.0, 1, 14.0),
];
