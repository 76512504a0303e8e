//! A page printed as PDF, by an installed Chromium: what it shows on a screen it prints as well, and no library that
//! draws HTML comes near it.

use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::fs;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Names under which systems have it.
const NAMES: [&str; 5] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];
/// Names a program that is to be taken instead.
const VARIABLE: &str = "CHROMIUM";
/// A page of a large block takes seconds.
const LONGEST: Duration = Duration::from_secs(180);
/// How a PDF begins.
const MAGIC: &[u8] = b"%PDF-";

/// Prints the page `html` into `file`.
///
/// # Errors
/// No Chromium; a Chromium that fails; a file of another kind in the place of the PDF.
pub(super) fn print(html: &Path, file: &Path) -> Result<()> {
    let chromium = find()?;
    if file.exists() && !begins_as_pdf(file) {
        bail!("--pdf {}: the file exists and is no PDF; name another one", file.display());
    }
    let folder = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = tempfile::Builder::new().prefix(".misclosure-pdf-").tempdir_in(folder);
    let beside = beside.with_context(|| format!("--pdf {}: cannot write there", file.display()))?;
    let printed = beside.path().canonicalize()?.join("printed.pdf");
    let page = html.canonicalize().with_context(|| format!("cannot read {}", html.display()))?;
    // Its sandbox needs rights that root and containers lack; the page is our own and loads nothing.
    let said = match run(&chromium, &page, &printed, beside.path(), &[])? {
        None => None,
        Some(_) => run(&chromium, &page, &printed, beside.path(), &["--no-sandbox"])?,
    };
    if !begins_as_pdf(&printed) {
        let said = said.unwrap_or_default();
        let last: Vec<&str> = said.lines().rev().take(3).collect();
        bail!("--pdf {}: {} printed nothing: {}", file.display(), chromium.display(), last.join("; "));
    }
    fs::rename(&printed, file).with_context(|| format!("--pdf {}: cannot write", file.display()))
}

fn find() -> Result<PathBuf> {
    if let Some(named) = std::env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
        return Ok(named.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let candidates = std::env::split_paths(&path).flat_map(|folder| NAMES.map(|name| folder.join(name)));
    candidates.into_iter().find(|candidate| candidate.is_file()).with_context(|| {
        format!(
            "--pdf needs Chromium or Google Chrome, and PATH has none of {}. Install it (Debian, Ubuntu: apt install \
             chromium), set {VARIABLE} to its program, or print report.html from any browser",
            NAMES.join(", ")
        )
    })
}

fn begins_as_pdf(file: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    fs::File::open(file).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == MAGIC
}

/// What Chromium says where it printed nothing.
fn run(chromium: &Path, page: &Path, printed: &Path, folder: &Path, more: &[&str]) -> Result<Option<String>> {
    let option = |name: &str, path: &Path| {
        let mut option = OsString::from(name);
        option.push(path);
        option
    };
    let log = folder.join("log");
    let mut child = Command::new(chromium)
        .args(["--headless", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"])
        .args(more)
        .arg(option("--user-data-dir=", &folder.join("profile")))
        .arg(option("--print-to-pdf=", printed))
        .arg(url(page))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(&log)?)
        .spawn()
        .with_context(|| format!("--pdf: cannot start {}", chromium.display()))?;
    let begun = Instant::now();
    while child.try_wait()?.is_none() {
        if begun.elapsed() > LONGEST {
            child.kill()?;
            child.wait()?;
            bail!("--pdf: {} did not end within {} s", chromium.display(), LONGEST.as_secs());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    match begins_as_pdf(printed) {
        true => Ok(None),
        false => Ok(Some(String::from_utf8_lossy(&fs::read(&log)?).into_owned())),
    }
}

/// `file://`, with everything in the path encoded that has a meaning in a URL.
fn url(path: &Path) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_./~".contains(&byte);
    let encoded = path.as_os_str().as_bytes().iter().map(|byte| match plain(*byte) {
        true => char::from(*byte).to_string(),
        false => format!("%{byte:02X}"),
    });
    format!("file://{}", encoded.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_no_query() {
        assert_eq!(url(Path::new("/a b/50%#1?.html")), "file:///a%20b/50%25%231%3F.html");
    }
}
