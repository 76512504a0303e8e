//! Pix4D: two images and their tie points.

/// Two images that look down; the second is turned by a quarter.
pub const CAMERAS: &str = "fileName imageWidth imageHeight\ncamera matrix K [3x3]\nradial distortion [3x1]\n\n\
    a.jpg 4000 3000\n2500 0 2010\n0 2500 1490\n0 0 1\n-0.1 0.05 0.01\n0.001 -0.002\n1 2 50\n1 0 0\n0 -1 0\n0 0 -1\n\
    b.jpg 4000 3000\n2500 0 2010\n0 2500 1490\n0 0 1\n-0.1 0.05 0.01\n0.001 -0.002\n11 2 50\n0 1 0\n1 0 0\n0 0 -1\n";
pub const EXTERNAL: &str = "imageName X Y Z Omega Phi Kappa\na.jpg 1001 2002 50 0 0 0\nb.jpg 1011 2002 50 0 0 90\n";
pub const TIES: &str = "a\n7 100.5 200.25 1.5 0.1\n8 5 6 1\n-99\nb.jpg\n7 300 400 1\n-99\nc\n7 1 1 1\n-99\n";
pub const BINGO: &str = "a H_8.0_6.0\n7 -4.0 3.0\n-99\nb H_8.0_6.0\n7 2.0 -1.5\n-99\n";

pub const FILES: [(&str, &str); 4] = [
    ("p_calibrated_camera_parameters.txt", CAMERAS),
    ("p_calibrated_external_camera_parameters.txt", EXTERNAL),
    ("p_tp_pix4d.txt", TIES),
    ("p_offset.xyz", "1000 2000 0\n"),
];
