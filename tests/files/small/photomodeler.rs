//! PhotoModeler: two photos, a control and an object point.

pub const HEAD: &str =
    "PhotoModeler x\n 0.1 20 200 100\n 1 1 1 1 1 1 1 1 1\n 10 1 0.5 2 1 0 0 0 0 0\n 0 0 0 0 0 0 0 0 0 0\n";
pub const PHOTOS: &str = " 0 a.jpg\n 0 0 0 5 0 0 0\n 0 0 0 0 0 0 0\n\n 0 10 1 0.5 2 1 0 0 0 0 0\n 0 0 0 0 0 0 0 0 0 0 \
                          0\n 1 b.jpg\n 1 1 0 5 0 0 0\n 1 0 0 0 0 0 0\n\n 1 10 1 0.5 2 1 0 0 0 0 0\n 1 0 0 0 0 0 0 0 0 \
                          0 0\n\n";
pub const LISTS: &str = "9 0 0 0 0.1 0.1 0.2\n\n7 0 0 0\n\n0 7 50 50 0.1 0.1\n1 7 60 50 0.1 0.1\n0 9 70 20 0.1 0.1\n\n";

/// The file.
pub fn file() -> String {
    format!("{HEAD}{PHOTOS}{LISTS}")
}
