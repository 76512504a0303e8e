//! AICON: three images of five points, as the formula of the format sees them.

use nalgebra::{Matrix3, Vector3};

/// Every term of the camera is there: at the corner they move an image point by 30 px and more.
pub const INTERIOR: &str = "# camera\n 1 -999 -28.5 0.02 0.05 -1.1e-004 1.5e-007 13.5\n -2e-11\n 6e-6 -9e-6\n -7e-5 \
                            -3e-5\n 36.0 24.0 6000 4000\n";
pub const C: f64 = -28.5;
pub const X0: f64 = 0.02;
pub const Y0: f64 = 0.05;
pub const A: [f64; 3] = [-1.1e-4, 1.5e-7, -2e-11];
pub const R0: f64 = 13.5;
pub const B1: f64 = 6e-6;
pub const B2: f64 = -9e-6;
pub const C1: f64 = -7e-5;
pub const C2: f64 = -3e-5;

/// Image, projection centre (mm), omega, phi, kappa.
pub const POSES: [(&str, [f64; 3], [f64; 3]); 3] = [
    ("1", [100.0, -50.0, 1500.0], [0.02, -0.05, 0.3]),
    ("2", [400.0, 900.0, 1200.0], [-0.6, 0.2, -2.8]),
    ("7", [-700.0, 100.0, 1300.0], [0.05, -0.5, 1.5]),
];
/// Point and coordinates, mm.
pub const POINTS: [(&str, [f64; 3]); 5] = [
    ("11", [0.0, 0.0, 0.0]),
    ("12", [500.0, 100.0, 30.0]),
    ("13", [-300.0, 250.0, -40.0]),
    ("A", [250.0, -300.0, 10.0]),
    ("B", [-150.0, -200.0, 60.0]),
];

/// AICON's formula, as the reader's documentation has it: mm from the middle of the image, y up.
pub fn seen(centre: [f64; 3], [omega, phi, kappa]: [f64; 3], point: [f64; 3]) -> [f64; 2] {
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, omega.cos(), -omega.sin(), 0.0, omega.sin(), omega.cos());
    let about_y = Matrix3::new(phi.cos(), 0.0, phi.sin(), 0.0, 1.0, 0.0, -phi.sin(), 0.0, phi.cos());
    let about_z = Matrix3::new(kappa.cos(), -kappa.sin(), 0.0, kappa.sin(), kappa.cos(), 0.0, 0.0, 0.0, 1.0);
    let d = (about_x * about_y * about_z).transpose() * (Vector3::from(point) - Vector3::from(centre));
    let (x, y) = (C * d.x / d.z, C * d.y / d.z);
    let r = x.hypot(y);
    let radial: f64 = A.iter().zip([2, 4, 6]).map(|(a, n)| a * (r.powi(n) - R0.powi(n))).sum();
    let r2 = r * r;
    [
        X0 + x + x * radial + B1 * (r2 + 2.0 * x * x) + 2.0 * B2 * x * y + C1 * x + C2 * y,
        Y0 + y + y * radial + B2 * (r2 + 2.0 * y * y) + 2.0 * B1 * x * y,
    ]
}

/// The files of a small project: B is no new point, image 8 is not oriented, point 99 is not used and 50 has no
/// coordinates.
pub fn files() -> [(&'static str, String); 4] {
    let mut exterior = String::new();
    let mut measured = String::new();
    for (image, centre, angles) in POSES {
        let ([x, y, z], [omega, phi, kappa]) = (centre, angles);
        exterior += &format!("{image} 1 {x} {y} {z} {omega} {phi} {kappa} 0 307 3\n");
        for (point, position) in POINTS {
            let [x, y] = seen(centre, angles, position);
            measured += &format!("{image} {point} {x:.15} {y:.15} 0.0003 0.0004 0 0 1 1 1\n");
        }
    }
    exterior += "8 1 0 0 0 0 0 0 0 307 1\n";
    measured += "1 50 1 1 1e-4 1e-4 0 0 1 1 1\n2 50 1 1 1e-4 1e-4 0 0 1 1 1\n8 11 1 1 1e-4 1e-4 0 0 1 1 1\n";
    measured += "1 99 1 1 1e-4 1e-4 0 0 1 1 1\n7 50 1 1 1e-4 1e-4 0 0 1 0 1\n";
    let mut object = String::new();
    for (name, [x, y, z]) in POINTS {
        object += &format!("{name} {x} {y} {z} 3 4 5 3 1 {} 0\n", u32::from(name != "B"));
    }
    object += "99 1 2 3 0 0 0 0 0 1 0\n";
    [("p.ior", INTERIOR.into()), ("p.eor", exterior), ("p.obc", object), ("p.phc", measured)]
}
