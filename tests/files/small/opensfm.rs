//! OpenSfM: two images and a point.

pub const RECONSTRUCTION: &str = r#"[{"cameras": {"cam": {"projection_type": "brown", "width": 4000, "height": 3000, "focal_x": 0.75, "focal_y": 0.75,
    "c_x": 0.01, "c_y": -0.02, "k1": -0.1, "k2": 0.05, "k3": 0.0, "p1": 0.001, "p2": -0.002}},
 "shots": {"a/1.jpg": {"camera": "cam", "rotation": [0, 0, 0], "translation": [0, 0, 0], "capture_time": 5.5, "gps_position": [0, 0, 1], "gps_dop": 2.0},
           "b/1.jpg": {"camera": "cam", "rotation": [0, 0, 1.5707963267948966], "translation": [1, 2, 3], "capture_time": 7.0, "gps_position": [1, 0, 3]}},
 "points": {"7": {"coordinates": [1, 2, 30]}}, "reference_lla": {"latitude": 48.0, "longitude": 2.0, "altitude": 100.0}}]"#;

pub const ROWS: [&str; 3] = [
    "a/1.jpg\t7\t0\t0\t0\t1\t2\t3\nb/1.jpg\t7\t1\t0.25\t-0.125\t1\t2\t3\n",
    "OPENSFM_TRACKS_VERSION_v1\na/1.jpg\t7\t0\t0\t0\t0.01\t1\t2\t3\nb/1.jpg\t7\t1\t0.25\t-0.125\t0.01\t1\t2\t3\n",
    "OPENSFM_TRACKS_VERSION_v2\na/1.jpg\t7\t0\t0\t0\t0.01\t1\t2\t3\t-1\t-1\nb/1.jpg\t7\t1\t0.25\t-0.125\t0.01\t1\t2\t3\t-1\t-1\n",
];

/// `gcp_list.txt`.
pub const LIST: &str = "WGS84\n2.0 48.0 100 10 20 b/1.jpg p\n";
/// `ground_control_points.json`.
pub const CONTROL: &str = r#"{"points": [{"id": "p", "position": {"latitude": 48.0, "longitude": 2.0, "altitude": 100.0}, "role": "metrics_only",
    "observations": [{"shot_id": "a/1.jpg", "projection": [0.01, -0.02]}, {"shot_id": "b/1.jpg", "projection": [0.1, 0.2]}]}]}"#;
