//! The page, embedded in the program: a table of what there is. No path that a user names is ever looked up on the disk.

include!(concat!(env!("OUT_DIR"), "/assets.rs"));

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub struct Asset {
    /// Its type.
    pub content_type: &'static str,
    /// What is in it.
    pub bytes: &'static [u8],
}

/// The file at a path, which begins with `/`; the page itself at `/`.
pub fn asset(path: &str) -> Option<Asset> {
    let name = match path {
        "/" => "index.html",
        path => path.strip_prefix('/')?,
    };
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
        assert!(asset("/").is_some_and(|page| page.content_type.starts_with("text/html")));
        for path in [
            "",
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
    fn what_is_embedded_is_small() {
        let bytes: usize = ASSETS.iter().map(|(_, bytes)| bytes.len()).sum();
        assert!(bytes < 2_500_000, "{bytes} bytes");
    }
}
