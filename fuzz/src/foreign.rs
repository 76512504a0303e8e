//! The readers of other programs' files: what they take is written and read back, or is refused.

use super::folder::{said, with_files};
use misclosure::block::{Block, FlightId};
use misclosure::io::Error;
use misclosure::io::block::read_block;
use misclosure::io::foreign::{ExportOptions, ImportOptions, additions, registry, write_imported};
use misclosure::scenario::{Scenario, simulate};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Files that one reader takes together.
pub struct Case {
    /// Of a format or of an addition.
    pub name: &'static str,
    /// In the order in which an input has them; `ZIP!MEMBER` stands for a member of a zip file.
    pub files: &'static [&'static str],
    /// What of them is named to the reader; nothing stands for their folder.
    pub named: &'static str,
}

const fn folder(name: &'static str, files: &'static [&'static str]) -> Case {
    Case { name, files, named: "" }
}

const fn file(name: &'static str, files: &'static [&'static str]) -> Case {
    Case { name, files, named: files[0] }
}

/// The first byte of an input is the number of one of these.
pub const CASES: [Case; 26] = [
    folder("colmap", &["cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "verification.csv"]),
    folder("colmap-text", &["cameras.txt", "images.txt", "points3D.txt", "rigs.txt", "verification.csv"]),
    file("bundler", &["bundle.out", "list.txt", "verification.csv"]),
    file("bal", &["problem.txt", "list.txt", "verification.csv"]),
    file("blocks-exchange", &["blocks.xml", "verification.csv"]),
    file("metashape", &["cameras.xml", "verification.csv"]),
    Case {
        name: "metashape",
        files: &["p.psz!doc.xml", "p.psz!points0.ply", "p.psz!p3.ply", "p.psz!p4.ply"],
        named: "p.psz",
    },
    file(
        "metashape",
        &[
            "p.psx",
            "p.files/project.zip!doc.xml",
            "p.files/0/chunk.zip!doc.xml",
            "p.files/0/0/frame.zip!doc.xml",
            "p.files/0/0/point_cloud/point_cloud.zip!doc.xml",
            "p.files/0/0/point_cloud/point_cloud.zip!points0.ply",
            "p.files/0/0/point_cloud/point_cloud.zip!p3.ply",
            "p.files/0/0/point_cloud/point_cloud.zip!p4.ply",
        ],
    ),
    folder("opensfm", &["reconstruction.json", "tracks.csv", "ground_control_points.json"]),
    folder("opensfm", &["reconstruction.json", "tracks.csv", "gcp_list.txt"]),
    folder(
        "micmac",
        &[
            "Ori-A/AutoCal.xml",
            "Ori-A/Orientation-a.jpg.xml",
            "Ori-A/Orientation-b.jpg.xml",
            "Homol/PMul.txt",
            "Ground.xml",
            "Marks.xml",
            "verification.csv",
        ],
    ),
    folder("micmac", &[MICMAC[0], MICMAC[1], MICMAC[2], "Homol/PMul.dat"]),
    folder("micmac", &[MICMAC[0], MICMAC[1], MICMAC[2], "Homol/Pastisa.jpg/b.jpg.txt", "Homol/Pastisb.jpg/a.jpg.txt"]),
    folder("micmac", &[MICMAC[0], MICMAC[1], MICMAC[2], "Homol/Pastisa.jpg/b.jpg.dat"]),
    folder("micmac", &["Calib-A.xml", "Ori-a.xml", "Ori-b.xml", "MesGCP.xml", "MesIm-a.xml", "Homol/PMul.txt"]),
    folder("pix4d", &[PIX4D[0], PIX4D[1], PIX4D[2], "p_tp_pix4d.txt"]),
    folder("pix4d", &[PIX4D[0], PIX4D[1], PIX4D[2], "p_tp_bingo.txt"]),
    file("photomodeler", &["x.txt"]),
    folder("aicon", &["p.ior", "p.eor", "p.obc", "p.phc"]),
    file("gcp", &["gcp_list.txt"]),
    file("gcp", &["ground_control_points.json"]),
    file("gcp", &["table.csv"]),
    file("mrk", &["100_0001_Timestamp.MRK"]),
    file("exif", &["a.jpg"]),
    file("geo", &["geo.txt"]),
    folder("opensfm", &["reconstruction.json", "tracks.csv"]),
];
const MICMAC: [&str; 3] = ["Ori-A/AutoCal.xml", "Ori-A/Orientation-a.jpg.xml", "Ori-A/Orientation-b.jpg.xml"];
const PIX4D: [&str; 3] =
    ["p_calibrated_camera_parameters.txt", "p_calibrated_external_camera_parameters.txt", "p_offset.xyz"];
/// Stands between a zip file and a member of it.
const MEMBER: char = '!';

/// What is added to: a simulated block whose first images have the names that the additions look for.
static BLOCK: LazyLock<Block> = LazyLock::new(|| {
    let scenario = Scenario::from_toml(include_str!("small.toml"), "small.toml").expect("a scenario");
    let mut block = simulate(&scenario, 1).expect("a block").block;
    block.crs = "local east, north, up at latitude 48, longitude 2, height 0 m (WGS84)".into();
    block.flights = vec!["flight".into()];
    for image in &mut block.images {
        (image.flight, image.time_s, image.gnss) = (FlightId(0), None, None);
    }
    for (image, name) in block.images.iter_mut().zip(["a.jpg", "100_0001_0001.JPG", "100_0001_0002.JPG"]) {
        image.name = name.into();
    }
    block
});

/// One input.
pub fn run(data: &[u8]) {
    if let Err(error) = take(data) {
        said(error);
    }
}

/// One input: the error of its reader, if it does not take it.
pub fn take(data: &[u8]) -> Result<(), Error> {
    let Some((case, files)) = data.split_first() else { return Ok(()) };
    let case = &CASES[usize::from(*case) % CASES.len()];
    let mut taken = Ok(());
    with_files(case.files, files, |folder| {
        pack(folder, case.files);
        taken = read(case, &[folder.join(case.named)], folder);
    });
    taken
}

fn read(case: &Case, paths: &[PathBuf], folder: &Path) -> Result<(), Error> {
    let options = ImportOptions { approximate: true, ..ImportOptions::default() };
    if let Some(addition) = additions().iter().find(|addition| addition.name() == case.name) {
        return addition.add(&mut BLOCK.clone(), paths, &options).map(drop);
    }
    let format = registry().iter().find(|format| format.name() == case.name).expect("a format");
    format.recognises(&paths[0]);
    let imported = format.import(paths, &options)?;
    let [copy, back] = ["copy", "back"].map(|name| folder.join(name));
    if let Err(error) = write_imported(&imported, &copy) {
        said(error);
    } else if let Err(error) = read_block(&copy) {
        said(error);
    }
    if let Some(exporter) = format.exporter() {
        std::fs::create_dir(&back).expect("a folder in a temporary folder");
        if let Err(error) = exporter.export(&imported.block, &back, &ExportOptions { approximate: true }) {
            said(error);
        }
    }
    Ok(())
}

/// Makes zip files of the files that stand for their members; none where an input ends before them.
fn pack(folder: &Path, files: &[&str]) {
    let members = || files.iter().filter_map(|file| file.split_once(MEMBER));
    let content = |zip: &str, member: &str| std::fs::read(folder.join(format!("{zip}{MEMBER}{member}"))).ok();
    let mut zips: Vec<&str> = members().map(|(zip, _)| zip).collect();
    zips.dedup();
    for path in zips {
        let inside = members().filter(|(zip, _)| *zip == path);
        let inside: Vec<_> = inside.filter_map(|(zip, member)| Some((member, content(zip, member)?))).collect();
        if inside.is_empty() {
            continue;
        }
        let file = std::fs::File::create(folder.join(path)).expect("a file in a temporary folder");
        let mut zip = zip::ZipWriter::new(file);
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        for (member, bytes) in inside {
            zip.start_file(member, options).and_then(|()| Ok(zip.write_all(&bytes)?)).expect("a member of a zip file");
        }
        zip.finish().expect("a zip file");
    }
}
