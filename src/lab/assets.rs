//! The page, embedded in the program: a table of what there is. No path that a user names is ever looked up on the
//! disk.

/// Declares the table: the files of `web`, by their path below it.
macro_rules! page {
    ($($name:literal)*) => {
        /// Every file of the page.
        static ASSETS: &[(&str, &[u8])] = &[
            $(($name, include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/web/", $name)))),*
        ];
    };
}

page! {
    "api.js"
    "bar.js"
    "base.css"
    "brush.js"
    "candidates.js"
    "causes.js"
    "dom.js"
    "done.js"
    "edits.js"
    "export.js"
    "fields.js"
    "figure.js"
    "figures.css"
    "headline.js"
    "help.js"
    "icon.svg"
    "index.html"
    "judge.js"
    "keyboard.js"
    "lanes.js"
    "layout.css"
    "main.js"
    "marks.js"
    "mistakes.js"
    "model.js"
    "names.js"
    "notice.js"
    "numbers.js"
    "orbit.js"
    "panel.js"
    "panels.js"
    "parts.css"
    "photos.js"
    "plan.css"
    "plan.html"
    "plan.js"
    "plan_answer.js"
    "plan_dials.js"
    "plots.js"
    "points.js"
    "print.css"
    "progress.js"
    "save.js"
    "scales.js"
    "selection.js"
    "side.css"
    "side.js"
    "space.js"
    "space_brush.js"
    "space_data.js"
    "space_panel.js"
    "state.js"
    "steps.js"
    "timing.js"
    "tree.js"
    "underlay.js"
    "vendor/three.LICENSE.txt"
    "vendor/three.core.min.js"
    "vendor/three.module.min.js"
    "viewer.js"
    "views.js"
    "worst.js"
}

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub struct Asset {
    /// Its type.
    pub content_type: &'static str,
    /// What is in it.
    pub bytes: &'static [u8],
}

/// The file at a path, which begins with `/`.
pub fn asset(path: &str) -> Option<Asset> {
    let name = path.strip_prefix('/')?;
    let (name, bytes) = ASSETS.iter().find(|(own, _)| *own == name)?;
    let content_type = match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("json") => "application/json",
        Some("png") => "image/png",
        _ => "text/plain; charset=utf-8",
    };
    Some(Asset { content_type, bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_there_and_nothing_else_of_the_disk() {
        assert!(asset("/index.html").is_some_and(|page| page.content_type.starts_with("text/html")));
        for path in [
            "",
            "/",
            "index.html",
            "//index.html",
            "/../Cargo.toml",
            "/vendor/../index.html",
            "/etc/passwd",
            "/%2e%2e/Cargo.toml",
        ] {
            assert!(asset(path).is_none(), "{path}");
        }
    }

    #[test]
    fn every_file_of_the_page_is_embedded() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        let mut folders = vec![root.clone()];
        while let Some(folder) = folders.pop() {
            for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                let name = path.strip_prefix(&root).unwrap().to_string_lossy().into_owned();
                if path.is_dir() {
                    folders.push(path);
                } else if !name.ends_with(".md") {
                    assert!(asset(&format!("/{name}")).is_some(), "web/{name} is not in the table");
                }
            }
        }
    }

    #[test]
    fn what_is_embedded_is_small() {
        let bytes: usize = ASSETS.iter().map(|(_, bytes)| bytes.len()).sum();
        assert!(bytes < 2_500_000, "{bytes} bytes");
    }
}
