//! The headers of the contract, as this program was built with them: a plug-in compiled against them fits it.

use std::io;
use std::path::Path;

/// File names and texts: the contract, what it includes, and what formulas may use.
pub const HEADERS: [(&str, &str); 5] = [
    ("effect.h", include_str!("../../cpp/effect.h")),
    ("rotation.h", include_str!("../../cpp/rotation.h")),
    ("surveyed.h", include_str!("../../cpp/surveyed.h")),
    ("bspline.h", include_str!("../../cpp/bspline.h")),
    ("effect_test.h", include_str!("../../cpp/effect_test.h")),
];

/// Writes them into a folder that is there.
///
/// # Errors
/// What cannot be written.
pub fn write(folder: &Path) -> io::Result<()> {
    HEADERS.iter().try_for_each(|(name, text)| std::fs::write(folder.join(name), text))
}
