//! The images themselves, where somebody named their folder: what lies behind the residuals.
//!
//! Only files that lie in that folder and are called as an image of the block are ever opened, and none that a link
//! leads out of it.

use anyhow::{Context, Result, bail};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What a browser can draw, by the ending of the file.
const TYPES: [(&str, &str); 4] =
    [("jpg", "image/jpeg"), ("jpeg", "image/jpeg"), ("png", "image/png"), ("webp", "image/webp")];

/// Endings that the names of a block may have, whose files a browser cannot draw.
const ENDINGS: [&str; 3] = ["tif", "tiff", "dng"];

/// A folder with the images of a block.
#[derive(Debug, Clone)]
pub struct Photos {
    folder: PathBuf,
    /// File of each image of the block, where there is one.
    files: Vec<Option<PathBuf>>,
}

impl Photos {
    /// Finds the files of a block's `images`, by name, in a folder: of the same name, else of the same name but for
    /// capitals and the ending.
    ///
    /// # Errors
    /// A folder that cannot be read, or that has no image of the block.
    pub fn find(folder: &Path, images: &[&str]) -> Result<Self> {
        let cannot = || format!("{}: cannot read the folder of images", folder.display());
        let folder_found = folder.canonicalize().with_context(cannot)?;
        let (mut exact, mut alike): (HashMap<String, PathBuf>, HashMap<String, PathBuf>) = Default::default();
        let entries: std::io::Result<Vec<PathBuf>> =
            fs::read_dir(&folder_found).with_context(cannot)?.map(|entry| Ok(entry?.path())).collect();
        let mut paths = entries.with_context(cannot)?;
        // The first of two that are alike is the same wherever the folder lies.
        paths.sort();
        for path in paths {
            // A link that leads out of the folder is no file of it.
            let inside = path.canonicalize().is_ok_and(|real| real.parent() == Some(folder_found.as_path()));
            if content_type(&path).is_none() || !inside {
                continue;
            }
            let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
            alike.entry(stem(name)).or_insert_with(|| path.clone());
            exact.insert(name.to_string(), path.clone());
        }
        let file = |name: &&str| exact.get(*name).or_else(|| alike.get(&stem(name))).cloned();
        let files: Vec<_> = images.iter().map(file).collect();
        if files.iter().all(Option::is_none) {
            let first = images.first().copied().unwrap_or_default();
            let endings = TYPES.map(|(ending, _)| ending).join(", ");
            bail!(
                "{}: no image of the block lies here; expected files called as its images, {first:?} say, with one of \
                 the endings {endings}",
                folder.display()
            );
        }
        Ok(Self { folder: folder_found, files })
    }

    /// How many images of the block there are.
    pub fn count(&self) -> usize {
        self.files.iter().flatten().count()
    }

    /// Is there a file of an image?
    pub fn has(&self, image: usize) -> bool {
        self.files.get(image).is_some_and(Option::is_some)
    }

    /// Type and bytes of the file of an image; `None` where there is none.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not in the folder.
    pub fn read(&self, image: usize) -> Result<Option<(&'static str, Vec<u8>)>> {
        let Some(Some(path)) = self.files.get(image) else { return Ok(None) };
        let Some(content_type) = content_type(path) else { return Ok(None) };
        // Looked up anew: a link may have come in the place of a file.
        let real = path.canonicalize().with_context(|| format!("{}: cannot read", path.display()))?;
        if real.parent() != Some(self.folder.as_path()) {
            bail!("{}: leads out of the folder of images, and is not opened", path.display());
        }
        let bytes = crate::files::read(&real).with_context(|| format!("{}: cannot read", path.display()))?;
        Ok(Some((content_type, bytes)))
    }
}

fn content_type(path: &Path) -> Option<&'static str> {
    let ending = path.extension()?.to_str()?.to_lowercase();
    TYPES.iter().find(|(own, _)| *own == ending).map(|(_, kind)| *kind)
}

/// A name in small letters without the ending of an image.
fn stem(name: &str) -> String {
    let name = name.to_lowercase();
    let is_ending = |ending: &str| TYPES.iter().any(|(own, _)| *own == ending) || ENDINGS.contains(&ending);
    match name.rsplit_once('.') {
        Some((stem, ending)) if is_ending(ending) => stem.to_string(),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_name_and_no_other_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("images");
        fs::create_dir(&inside).unwrap();
        fs::write(folder.path().join("secret.jpg"), "secret").unwrap();
        fs::write(inside.join("a.jpg"), "a").unwrap();
        fs::write(inside.join("B.JPG"), "b").unwrap();
        fs::write(inside.join("c.txt"), "c").unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret.jpg"), inside.join("link.jpg")).unwrap();
        let photos = Photos::find(&inside, &["a.jpg", "b.tif", "c.txt", "../secret.jpg", "link.jpg"]).unwrap();
        let read = |k: usize| photos.read(k).unwrap().map(|(_, bytes)| String::from_utf8(bytes).unwrap());
        assert_eq!([read(0).as_deref(), read(1).as_deref()], [Some("a"), Some("b")]);
        assert_eq!([read(2), read(3), read(4), read(9)], [None, None, None, None]);
        assert_eq!((photos.count(), photos.has(0), photos.has(2)), (2, true, false));
        // A link that comes in the place of a file later.
        fs::remove_file(inside.join("a.jpg")).unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret.jpg"), inside.join("a.jpg")).unwrap();
        let refused = photos.read(0).unwrap_err().to_string();
        assert!(refused.contains("leads out of the folder"), "{refused}");
    }

    #[test]
    fn a_folder_without_images_of_the_block_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = Photos::find(folder.path(), &["a.jpg"]).unwrap_err().to_string();
        assert!(refused.contains("no image of the block") && refused.contains("a.jpg"), "{refused}");
        assert!(Photos::find(&folder.path().join("nowhere"), &["a.jpg"]).is_err());
    }
}
