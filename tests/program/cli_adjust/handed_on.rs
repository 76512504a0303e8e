//! The report as a surveyor hands it on: the finding first, names, places on the globe, and pages that no table leaves.

use super::Scene;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Longer than any column: names of points and images come from elsewhere.
const LONG_NAME: &str = "GCP_2026-01-31_pillar-at-the-northern-abutment_remeasured_0001";
/// The block lies here: latitude, longitude.
const PLACE: [f64; 2] = [48.25, 16.5];
/// The map of the surveyor: zone 33, whose central meridian is 15 degrees east.
const SURVEY: &str = "EPSG:32633";
/// A4 less its margins, at 96 px an inch.
const PRINTED_PX: u32 = 680;

#[test]
fn a_report_is_handed_on() {
    let scene = Scene::new();
    let run = improved(&scene);
    let page = fs::read_to_string(run.join("report.html")).expect("a page");
    the_finding_stands_first(&run, &page);
    every_arrow_has_a_name(&run);
    places_are_on_the_globe(&run);
    coordinates_are_those_of_the_survey(&run);
    without_chromium_the_command_says_what_to_install(&scene, &run);
    let Some(chromium) = installed("chromium") else {
        eprintln!("SKIPPED: no chromium in PATH: widths of tables and printed pages are not tested");
        return;
    };
    pages_are_printed(&scene, &run);
    for (width, media) in [(PRINTED_PX, "print"), (1024, "screen"), (390, "screen")] {
        no_table_leaves_its_page(&chromium, &run, &page, width, media);
    }
}

/// A block with a rolling shutter, a place and a long name, improved.
fn improved(scene: &Scene) -> PathBuf {
    let (clean, block, run) = (scene.path("block"), scene.path("shaken"), scene.path("run"));
    let errors = ["--error", "rolling-shutter:readout=0.03", "--error", "noise:px=0.3"];
    let (code, stderr) = scene.run(&[&["inject", &clean, "-o", &block], &errors[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    // The truth knows no such name: it is given after the errors are made.
    for file in ["control.csv", "marks.csv"] {
        let path = Path::new(&block).join(file);
        let text = fs::read_to_string(&path).expect(file);
        assert!(text.contains("gcp0001"), "{file}");
        fs::write(&path, text.replace("gcp0001", LONG_NAME)).expect(file);
    }
    let toml = Path::new(&block).join("block.toml");
    let [latitude, longitude] = PLACE;
    let crs = format!("local east, north, up at latitude {latitude}, longitude {longitude}, height 180 m (WGS84)");
    let text = fs::read_to_string(&toml).expect("block.toml");
    assert!(text.contains("crs = \"local\""), "{text}");
    let systems = format!("crs = \"{crs}\"\nsurvey_crs = \"{SURVEY}\"");
    fs::write(&toml, text.replace("crs = \"local\"", &systems)).expect("block.toml");
    let (code, stderr) = scene.run(&["improve", &block, "-o", &run]);
    assert_eq!(code, 0, "{stderr}");
    run.into()
}

fn the_finding_stands_first(run: &Path, page: &str) {
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text} is not on the page"));
    let points = format!("({} points, 3D RMS)", super::summary(run)["check"]["n"]);
    let first = ["Rolling shutter (", "falls from", &points, "What to do", "What remains", "What could hide"];
    let places: Vec<usize> = first.map(at).to_vec();
    assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{places:?}");
    let provenance = at("· misclosure --quiet improve ");
    assert!(places[5] < provenance);
    assert!(provenance < at("<nav") && at("<nav") < at("<h2"), "the contents stand beside, the sections below");
    for text in ["coordinate system local east", "<dt>typical point</dt>", "1 sigma, 3D", "E (m)", "N (m)"] {
        at(text);
    }
    assert!(!page.contains("v&#39;Pv"), "terms are those of the glossary");
}

fn every_arrow_has_a_name(run: &Path) {
    for (figure, prefix) in
        [("check-plan", "chk"), ("check-height", "chk"), ("control-plan", "gcp"), ("gnss-plan", "oblique50")]
    {
        let svg = fs::read_to_string(run.join(format!("figures/{figure}.svg"))).expect(figure);
        assert!(svg.contains(&format!("<title>{prefix}")), "{figure}");
        // Nameless arrows would be one path of their colour, beside those of the legend, which are short.
        let nameless = svg.split("<path ").filter(|path| {
            let end = path.find('>').expect("a tag");
            path[..end].contains("stroke=\"#0072B2\"") && path[..end].matches('M').count() > 2
        });
        assert_eq!(nameless.count(), 0, "{figure}");
    }
    let flights = fs::read_to_string(run.join("figures/flights.svg")).expect("flights");
    assert!(
        flights.contains("<title>oblique50_0001</title>") && flights.contains(&format!("<title>{LONG_NAME}</title>"))
    );
}

fn places_are_on_the_globe(run: &Path) {
    let rows = &super::summary(run)["rows"];
    for (file, n) in [("points.geojson", &rows["checks"]), ("cameras.geojson", &rows["images"])] {
        let n = n.as_u64().expect("a count") as usize;
        let text = fs::read_to_string(run.join(file)).expect(file);
        let all: Value = serde_json::from_str(&text).expect("JSON");
        let features = all["features"].as_array().expect("features");
        assert_eq!(features.len(), n, "{file}");
        for feature in features {
            let at = |k: usize| feature["geometry"]["coordinates"][k].as_f64().expect("a number");
            // Some 200 m about the origin.
            assert!((at(0) - PLACE[1]).abs() < 0.004 && (at(1) - PLACE[0]).abs() < 0.004, "{feature}");
        }
        match installed("ogrinfo") {
            None => eprintln!("SKIPPED: no ogrinfo in PATH (Debian: gdal-bin): GDAL does not read {file}"),
            Some(ogrinfo) => {
                let output = Command::new(ogrinfo).args(["-so", "-al"]).arg(run.join(file)).output().expect("it runs");
                let said = String::from_utf8_lossy(&output.stdout).into_owned();
                assert!(said.contains(&format!("Feature Count: {n}")) && said.contains("WGS 84"), "{said}");
                let extent = said.lines().find(|line| line.starts_with("Extent:")).expect("an extent");
                assert!(extent.contains("16.") && extent.contains("48."), "{extent}");
            }
        }
    }
}

/// Easting and northing lie where the zone has the place, at its scale, and heights above the ellipsoid.
fn coordinates_are_those_of_the_survey(run: &Path) {
    for file in ["checks.csv", "points.csv", "images.csv"] {
        let (header, rows) = super::table(run, file);
        let column =
            |name: &str| header.iter().position(|other| other == name).unwrap_or_else(|| panic!("{file}: {name}"));
        let places = [["x", "y", "z"], ["easting", "northing", "height"]].map(|names| names.map(column));
        let at = |row: &[String], columns: [usize; 3]| columns.map(|k| row[k].parse::<f64>().expect("a number"));
        let [first, last] = [&rows[0], &rows[rows.len() - 1]];
        let [[a, b], [c, d]] = places.map(|columns| [at(first, columns), at(last, columns)]);
        let length = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
        // 1.5 degrees from the central meridian: 111 km east of it, where the scale is
        // 0.9996 + (111 / 9020)^2 ... 0.99976.
        assert!((c[0] - 611_400.0).abs() < 1000.0 && (c[1] - 5_345_000.0).abs() < 3000.0, "{file}: {c:?}");
        assert!((length(c, d) / length(a, b) - 0.99973).abs() < 1e-4, "{file}: {a:?} {b:?} {c:?} {d:?}");
        assert!((c[2] - a[2] - 180.0).abs() < 0.05, "{file}: {a:?} {c:?}");
    }
}

fn without_chromium_the_command_says_what_to_install(scene: &Scene, run: &Path) {
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(["--quiet", "report"])
        .arg(run)
        .args(["--pdf", &scene.path("none.pdf")])
        .env("PATH", scene.path("nothing"))
        .env_remove("CHROMIUM")
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("apt install chromium"), "{stderr}");
}

/// Opens the page in a frame of this width, with the rules of a medium, and measures every table, and the page itself:
/// the text of a cell may leave a table that does not leave the page.
fn no_table_leaves_its_page(chromium: &Path, run: &Path, page: &str, width: u32, media: &str) {
    let page = match media {
        "print" => page.replace("@media screen", "@media speech").replace("@media print", "@media all"),
        _ => page.to_string(),
    };
    const MEASURE: &str = "<script>document.querySelectorAll('details').forEach(d => d.open = true);
        const tables = [...document.querySelectorAll('table')].filter(t => t.offsetParent);
        const wide = tables.filter(t => t.getBoundingClientRect().right > document.documentElement.clientWidth + 1);
        const text = t => t.innerText.slice(0, 60).replaceAll('\\n', ' ');
        const said = wide.map(t => text(t) + ' ' + t.getBoundingClientRect().right);
        const { scrollWidth, clientWidth } = document.documentElement;
        if (scrollWidth > clientWidth + 1) said.push('the page ' + scrollWidth);
        parent.postMessage(tables.length + ' tables; wide: ' + said.join(' | '), '*');</script></body>";
    let framed = run.join("framed.html");
    fs::write(&framed, page.replace("</body>", MEASURE)).expect("written");
    let frame = format!(
        "<iframe src=\"framed.html\" style=\"width: {width}px; height: 900px; border: 0\"></iframe><p id=\"said\"></p>
         <script>onmessage = event => {{ document.getElementById('said').textContent = event.data; }}</script>"
    );
    let outer = run.join("frame.html");
    fs::write(&outer, frame).expect("written");
    let output = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--virtual-time-budget=5000",
            "--window-size=1400,1000",
            "--dump-dom",
        ])
        .arg(format!("file://{}", outer.display()))
        .output()
        .expect("chromium runs");
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let said =
        dom.split("<p id=\"said\">").nth(1).and_then(|rest| rest.split("</p>").next()).expect("what was measured");
    let (tables, wide) = said.split_once(" tables; wide: ").unwrap_or_else(|| panic!("{media} at {width}: {said:?}"));
    assert!(tables.parse::<usize>().expect("a count") >= 10, "{media} at {width}: {said}");
    assert_eq!(wide, "", "{media} at {width} px");
    fs::remove_file(framed).and(fs::remove_file(outer)).expect("removed");
}

fn pages_are_printed(scene: &Scene, run: &Path) {
    let run = run.to_str().expect("UTF-8");
    let (whole, one) = (scene.path("whole.pdf"), scene.path("one.pdf"));
    let (code, stderr) = scene.run(&["report", run, "--pdf", &whole]);
    assert_eq!(code, 0, "{stderr}");
    let (code, stderr) = scene.run(&["report", run, "--client", "--pdf", &one]);
    assert_eq!(code, 0, "{stderr}");
    let pages = |file: &str| {
        let bytes = fs::read(file).expect("a PDF");
        assert!(bytes.starts_with(b"%PDF-"), "{file}");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        text.matches("/Type /Page").count() - text.matches("/Type /Pages").count()
    };
    assert_eq!(pages(&one), 1, "a client gets one page");
    assert!(pages(&whole) > 5, "{}", pages(&whole));
    words_are_within_their_pages(&whole);
    let file = scene.path("block/block.toml");
    let before = fs::read(&file).expect("a file");
    let (code, stderr) = scene.run(&["report", run, "--pdf", &file]);
    assert!(code != 0 && stderr.contains("is no PDF"), "{stderr}");
    assert_eq!(fs::read(&file).expect("a file"), before);
}

fn words_are_within_their_pages(pdf: &str) {
    let Some(pdftotext) = installed("pdftotext") else {
        eprintln!("SKIPPED: no pdftotext in PATH (Debian: poppler-utils): words of the PDF are not measured");
        return;
    };
    let output = Command::new(pdftotext).args(["-bbox", pdf, "-"]).output().expect("pdftotext runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let number = |line: &str, key: &str| -> f64 {
        let value = line.split(&format!("{key}=\"")).nth(1).and_then(|rest| rest.split('"').next());
        value.and_then(|value| value.parse().ok()).unwrap_or_else(|| panic!("{key} in {line}"))
    };
    let (mut page, mut words) = (0.0, 0);
    for line in text.lines() {
        if line.contains("<page ") {
            page = number(line, "width");
            assert!((page - 595.0).abs() < 2.0, "A4 upright: {line}");
        } else if line.contains("<word ") {
            words += 1;
            assert!(number(line, "xMin") > 0.0 && number(line, "xMax") < page, "{line}");
        }
    }
    assert!(words > 1000, "{words} words");
    for whole in ["page", "Glossary", "significant"] {
        assert!(text.contains(&format!(">{whole}</word>")), "{whole}");
    }
}

/// A program of this machine.
fn installed(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}
