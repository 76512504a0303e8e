//! Pipes and devices in place of a text or a library; files made to fill memory or time.

use super::place::Place;
use std::fs;
use std::io::Write;
use std::process::Command;

/// Processor seconds: a refusal takes far less, reading the file far more.
const AT_ONCE: &str = "ulimit -t 20;";

#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let place = Place::new();
    assert!(Command::new("mkfifo").arg(place.at("pipe")).status().expect("mkfifo").success());
    assert!(Command::new("mkfifo").arg(place.at("pipe.toml")).status().expect("mkfifo").success());
    for name in ["package", "nist", "lab"] {
        fs::create_dir(place.at(name)).unwrap();
    }
    for link in ["package/Cargo.toml", "nist/Misra1a.dat"] {
        std::os::unix::fs::symlink("/dev/zero", place.at(link)).unwrap();
    }
    std::os::unix::fs::symlink("/dev/zero", place.at("zero.toml")).unwrap();
    for command in [
        "simulate FILE -o out",
        "inject FILE.toml -o out",
        "inject truth -o out --error x:a=1 --plugin FILE",
        "adjust block -o out --model FILE",
        "adjust block -o out --plugin FILE",
        "effects check FILE",
        "effects build FILE -o lib.so",
        "import blocks-exchange FILE -o out",
        "import aicon FILE -o out",
        "import FILE -o out",
        "import gcp FILE --into block",
        "import mrk FILE --into block",
        "import exif FILE --into block",
        "import geo FILE --into block",
    ] {
        for (file, toml) in [("pipe", "pipe"), ("/dev/zero", "zero")] {
            let line = command.replace("FILE.toml", &format!("{toml}.toml")).replace("FILE", file);
            let ended = place.run_under(&format!("{AT_ONCE} ulimit -v 4000000;"), line.split(' '));
            assert!(matches!(ended.code, Some(1 | 2)), "{line}: {ended:?}");
            assert!(!ended.errors.contains("panicked"), "{line}: {ended:?}");
        }
    }
    for line in ["effects build package -o lib.so", "validate --nist nist"] {
        place.run(line.split(' ')).expect(2, "this is no regular file");
    }
}

/// Writes a zip file with one member.
fn zip(path: &std::path::Path, member: &str, write: impl FnOnce(&mut dyn Write)) {
    let mut zip = zip::ZipWriter::new(fs::File::create(path).unwrap());
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    zip.start_file(member, options).unwrap();
    write(&mut zip);
    zip.finish().unwrap();
}

#[test]
fn projects_made_to_fill_memory_or_time_are_refused_at_once() {
    let place = Place::new();
    let refused = |file: &str, memory_kb: u32, what: &str| {
        let ended =
            place.run_under(&format!("{AT_ONCE} ulimit -v {memory_kb};"), ["import", "metashape", file, "-o", "out"]);
        ended.expect(2, what);
    };
    // Sixty million elements in a quarter of a megabyte.
    zip(&place.at("nodes.psz"), "doc.xml", |file| {
        let many = "<a/>".repeat(1_000_000);
        file.write_all(b"<document>").unwrap();
        (0..60).for_each(|_| file.write_all(many.as_bytes()).unwrap());
        file.write_all(b"</document>").unwrap();
    });
    refused("nodes.psz", 3_000_000, "nodes.psz, doc.xml: is packed to");
    // The same document unpacked is refused by the number of its tags.
    fs::write(place.at("nodes.xml"), format!("<document>\n{}</document>", "<a/>".repeat(12_000_000))).unwrap();
    refused("nodes.xml", 3_000_000, "nodes.xml:2:");
    let attributes: String = (0..200_000).map(|k| format!("k{k}=\"1\" ")).collect();
    zip(&place.at("attrs.psz"), "doc.xml", |file| write!(file, "<document>\n<a {attributes}/></document>").unwrap());
    refused("attrs.psz", 3_000_000, "doc.xml:2:1: expected at most 1000 attributes");
    // Half a gigabyte: to pack four would take minutes.
    zip(&place.at("zeros.psz"), "doc.xml", |file| {
        let zeros = vec![b' '; 1 << 20];
        (0..512).for_each(|_| file.write_all(&zeros).unwrap());
    });
    refused("zeros.psz", 400_000, "zeros.psz, doc.xml: is packed to");
}

#[test]
fn a_table_of_a_hundred_thousand_columns_is_read_in_linear_time() {
    let place = Place::new();
    let text = fs::read_to_string(place.at("block/images.csv")).unwrap();
    let extra: String = (0..100_000).map(|k| format!(",c{k}")).collect();
    let wide: String = text
        .lines()
        .enumerate()
        .map(|(k, line)| match k {
            0 => format!("{line}{extra}\n"),
            _ => format!("{line}{}\n", ",".repeat(100_000)),
        })
        .collect();
    fs::write(place.at("block/images.csv"), wide).unwrap();
    place.run_under(AT_ONCE, ["check", "block"]).expect(0, "");
}
