//! Blocks with one fault each, and the whole message that names it; and that no file, whatever is in it, makes the reader panic.

use misclosure::io::block::{Loaded, read_block};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

const BLOCK: &str = r#"format = 1
name = "small"
crs = "local"

[sigma]
tie_px = 0.5
mark_px = 0.5
control_xy_m = 0.005
control_z_m = 0.005
gnss_xy_m = 0.03
gnss_z_m = 0.05

[[camera]]
id = "cam"
width_px = 4000
height_px = 3000
pixel_um = 2.4
model = "fraser"
f = 3600.0
ppx = 2000.0
ppy = 1500.0
dcx = 2000.0
dcy = 1500.0
k1 = 0.0
k2 = 0.0
k3 = 0.0
p1 = 0.0
p2 = 0.0
b1 = 0.0
b2 = 0.0
"#;

const IMAGES: &str = "\
image,camera,flight,time_s,x,y,z,qw,qx,qy,qz,gnss_x,gnss_y,gnss_z,gnss_sigma_xy,vx,vy,vz,exposure_s,focus_m,remark
i0,cam,f1,0,0,0,50,0,1,0,0,0,0,50.2,0.02,5,0,0,0.001,80,first
i1,cam,f1,2,10,0,50,0,1,0,0,10,0,50.2,,5,0,0,0.001,80,
i2,cam,f2,9,20,0,50,0,0.6,0.8,0,,,,,,,,,,\"a, b\"
";

const TIES: &str = "\
image,point,x,y,sigma
i0,p0,1000,900,
i1,p0,800.5,900,0.4
i2,p0,600,900,
i0,p1,2000,2900,
i1,p1,1800,2900,
";

const POINTS: &str = "point,x,y,z\np0,-10,8,0.5\np1,3,-20,0\n";

const CONTROL: &str = "\
point,x,y,z,role,sigma_xy,sigma_z
c0,1,2,0.25,control,0.01,
c1,4,5,0.5,check,,
";

const MARKS: &str = "image,point,x,y\ni0,c0,2100,1400\ni1,c0,1400,1400\ni0,c1,2300,1100\n";

/// Files of a block: name and content.
struct Files(BTreeMap<&'static str, Vec<u8>>);

impl Files {
    fn valid() -> Self {
        let texts = [
            ("block.toml", BLOCK),
            ("images.csv", IMAGES),
            ("ties.csv", TIES),
            ("points.csv", POINTS),
            ("control.csv", CONTROL),
            ("marks.csv", MARKS),
        ];
        Self(texts.into_iter().map(|(name, text)| (name, text.as_bytes().to_vec())).collect())
    }

    fn set(&mut self, file: &'static str, content: impl AsRef<[u8]>) {
        self.0.insert(file, content.as_ref().to_vec());
    }

    fn remove(&mut self, file: &str) {
        self.0.remove(file).expect("the file is there");
    }

    /// Replaces the first `from`, which must be there.
    fn replace(&mut self, file: &'static str, from: &str, to: &str) {
        let text = String::from_utf8(self.0[file].clone()).expect("UTF-8");
        assert!(text.contains(from), "{from:?} is not in {file}");
        self.set(file, text.replacen(from, to, 1));
    }

    fn append(&mut self, file: &'static str, text: &str) {
        self.0.get_mut(file).expect("the file is there").extend_from_slice(text.as_bytes());
    }

    fn read(&self) -> Result<Loaded, String> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        self.write(folder.path());
        read_block(folder.path()).map_err(|error| error.to_string())
    }

    fn write(&self, folder: &Path) {
        for (name, content) in &self.0 {
            std::fs::write(folder.join(name), content).expect("a file");
        }
    }
}

type Case = (&'static str, fn(&mut Files), &'static str);

const MALFORMED: &[Case] = &[
    // Files.
    (
        "no block.toml",
        |b| b.remove("block.toml"),
        "block.toml: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "no images.csv",
        |b| b.remove("images.csv"),
        "images.csv: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "no ties.csv",
        |b| b.remove("ties.csv"),
        "ties.csv: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "control without marks.csv",
        |b| b.remove("marks.csv"),
        "marks.csv: the file is missing, but control.csv has points; they need image measurements",
    ),
    (
        "marks without control.csv",
        |b| b.remove("control.csv"),
        "control.csv: the file is missing, but marks.csv measures its points",
    ),
    // block.toml.
    (
        "not TOML",
        |b| b.replace("block.toml", "name = \"small\"", "name = small"),
        "block.toml:2:8: not TOML: string values must be quoted, expected literal string",
    ),
    ("TOML key twice", |b| b.replace("block.toml", "k1 = 0.0", "f = 1.0"), "block.toml:24:1: not TOML: duplicate key"),
    (
        "block.toml not UTF-8",
        |b| b.set("block.toml", b"format = 1\nname = \"d\xe9j\xe0\"\n"),
        "block.toml:2: the text is not UTF-8; save the file as UTF-8",
    ),
    ("empty block.toml", |b| b.set("block.toml", ""), "block.toml:1:1: key format is missing in block.toml"),
    (
        "format 2",
        |b| b.replace("block.toml", "format = 1", "format = 2"),
        "block.toml:1:10: key format: expected 1, the one this program reads, found 2",
    ),
    (
        "format as text",
        |b| b.replace("block.toml", "format = 1", "format = \"1\""),
        "block.toml:1:10: key format: expected 1, the one this program reads, found \"1\"",
    ),
    (
        "no name",
        |b| b.replace("block.toml", "name = \"small\"\n", ""),
        "block.toml:1:1: key name is missing in block.toml",
    ),
    (
        "no crs",
        |b| b.replace("block.toml", "crs = \"local\"\n", ""),
        "block.toml:1:1: key crs is missing in block.toml",
    ),
    (
        "crs as number",
        |b| b.replace("block.toml", "\"local\"", "2154"),
        "block.toml:3:7: key crs: expected a text in quotes, found 2154",
    ),
    (
        "unknown key",
        |b| b.replace("block.toml", "crs =", "csr ="),
        "block.toml:3:1: unknown key \"csr\" in block.toml; did you mean \"crs\"?",
    ),
    (
        "unknown key far from any",
        |b| b.replace("block.toml", "crs =", "projection ="),
        "block.toml:3:1: unknown key \"projection\" in block.toml; known: \"format\", \"name\", \"crs\", \"sigma\", \"camera\"",
    ),
    (
        "unknown sigma",
        |b| b.replace("block.toml", "tie_px", "tie_pix"),
        "block.toml:6:1: unknown key \"tie_pix\" in [sigma]; did you mean \"tie_px\"?",
    ),
    (
        "unknown camera key",
        |b| b.replace("block.toml", "width_px", "widht_px"),
        "block.toml:15:1: unknown key \"widht_px\" in [[camera]]; did you mean \"width_px\"?",
    ),
    (
        "sigma is no table",
        |b| b.set("block.toml", "format = 1\nname = \"a\"\ncrs = \"\"\nsigma = 0.5\n"),
        "block.toml:4:9: key sigma: expected a table, found 0.5",
    ),
    (
        "zero sigma",
        |b| b.replace("block.toml", "mark_px = 0.5", "mark_px = 0"),
        "block.toml:7:11: key mark_px: expected a number above zero, found 0",
    ),
    (
        "negative sigma",
        |b| b.replace("block.toml", "gnss_z_m = 0.05", "gnss_z_m = -0.05"),
        "block.toml:11:12: key gnss_z_m: expected a number above zero, found -0.05",
    ),
    (
        "infinite sigma",
        |b| b.replace("block.toml", "gnss_z_m = 0.05", "gnss_z_m = inf"),
        "block.toml:11:12: key gnss_z_m: expected a finite number, found inf",
    ),
    (
        "no camera",
        |b| b.set("block.toml", "format = 1\nname = \"a\"\ncrs = \"\"\n"),
        "block.toml:1:1: there is no [[camera]]; a block has at least one",
    ),
    (
        "camera is no array",
        |b| b.replace("block.toml", "[[camera]]", "[camera]"),
        "block.toml:13:1: key camera: expected tables [[camera]], found [camera]",
    ),
    (
        "camera without f",
        |b| b.replace("block.toml", "f = 3600.0\n", ""),
        "block.toml:13:1: key f is missing in [[camera]]",
    ),
    (
        "camera without id",
        |b| b.replace("block.toml", "id = \"cam\"\n", ""),
        "block.toml:13:1: key id is missing in [[camera]]",
    ),
    (
        "camera with empty id",
        |b| b.replace("block.toml", "id = \"cam\"", "id = \"\""),
        "block.toml:14:6: key id: expected a name, found \"\"",
    ),
    (
        "negative focal length",
        |b| b.replace("block.toml", "f = 3600.0", "f = -3600.0"),
        "block.toml:19:5: key f: expected a number above zero, found -3600.0",
    ),
    (
        "NaN in the camera",
        |b| b.replace("block.toml", "k2 = 0.0", "k2 = nan"),
        "block.toml:25:6: key k2: expected a finite number, found nan",
    ),
    (
        "text in the camera",
        |b| b.replace("block.toml", "k2 = 0.0", "k2 = \"0\""),
        "block.toml:25:6: key k2: expected a finite number, found \"0\"",
    ),
    (
        "zero width",
        |b| b.replace("block.toml", "4000", "0"),
        "block.toml:15:12: key width_px: expected a whole number above zero, found 0",
    ),
    (
        "broken width",
        |b| b.replace("block.toml", "4000", "4000.5"),
        "block.toml:15:12: key width_px: expected a whole number above zero, found 4000.5",
    ),
    (
        "huge width",
        |b| b.replace("block.toml", "4000", "40000000000"),
        "block.toml:15:12: key width_px: expected a whole number above zero, found 40000000000",
    ),
    (
        "zero pixel size",
        |b| b.replace("block.toml", "pixel_um = 2.4", "pixel_um = 0.0"),
        "block.toml:17:12: key pixel_um: expected a number above zero, found 0.0",
    ),
    (
        "unknown model",
        |b| b.replace("block.toml", "\"fraser\"", "\"brown\""),
        "block.toml:18:9: key model: expected \"fraser\", the one there is, found \"brown\"",
    ),
    (
        "camera twice",
        |b| {
            let camera = &BLOCK[BLOCK.find("[[camera]]").unwrap()..];
            b.append("block.toml", camera);
        },
        "block.toml:31:1: camera \"cam\" stands twice; ids are unique",
    ),
    // images.csv.
    ("empty images.csv", |b| b.set("images.csv", ""), "images.csv:1: column image is missing; the file is empty"),
    (
        "no image",
        |b| b.set("images.csv", IMAGES.lines().next().unwrap()),
        "images.csv: there is no image; the table has a header and no row",
    ),
    (
        "column missing",
        |b| b.replace("images.csv", "qw", "q0"),
        "images.csv:1: column qw is missing; the header has \"image\", \"camera\", \"flight\", \"time_s\", \"x\", \"y\", \"z\", \"q0\", \"qx\", \"qy\", \"qz\", \"gnss_x\", \"gnss_y\", \"gnss_z\", \"gnss_sigma_xy\", \"vx\", \"vy\", \"vz\", \"exposure_s\", \"focus_m\", \"remark\"",
    ),
    ("column twice", |b| b.replace("images.csv", "remark", "x"), "images.csv:1: column \"x\" stands twice; keep one"),
    (
        "unknown column twice",
        |b| b.replace("images.csv", "time_s", "remark"),
        "images.csv:1: column \"remark\" stands twice; keep one",
    ),
    (
        "column name not UTF-8",
        |b| {
            let mut t = IMAGES.as_bytes().to_vec();
            t[1] = 0xff;
            b.set("images.csv", t);
        },
        "images.csv:1: column name \"i\u{fffd}age\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "cell too few",
        |b| b.replace("images.csv", "80,first", "80"),
        "images.csv:2: number of cells 20, expected 21 as in the header",
    ),
    (
        "cell too many",
        |b| b.replace("images.csv", "80,first", "80,fir,st"),
        "images.csv:2: number of cells 22, expected 21 as in the header",
    ),
    (
        "image twice",
        |b| b.replace("images.csv", "i2,", "i0,"),
        "images.csv:4: column image: image \"i0\" stands twice, first in line 2",
    ),
    (
        "image without name",
        |b| b.replace("images.csv", "i1,cam", ",cam"),
        "images.csv:3: column image: expected a name, found an empty cell",
    ),
    (
        "image not UTF-8",
        |b| {
            let at = IMAGES.find("i1").unwrap();
            let mut t = IMAGES.as_bytes().to_vec();
            t[at] = 0xff;
            b.set("images.csv", t);
        },
        "images.csv:3: column image: \"\u{fffd}1\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "remark not UTF-8",
        |b| {
            let at = IMAGES.find("first").unwrap();
            let mut t = IMAGES.as_bytes().to_vec();
            t[at] = 0xff;
            b.set("images.csv", t);
        },
        "images.csv:2: column remark: \"\u{fffd}irst\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "unknown camera",
        |b| b.replace("images.csv", "i1,cam", "i1,can"),
        "images.csv:3: column camera: \"can\" is not a camera of block.toml; did you mean \"cam\"?",
    ),
    (
        "no flight",
        |b| b.replace("images.csv", "i1,cam,f1", "i1,cam,"),
        "images.csv:3: column flight: expected a name, found an empty cell",
    ),
    (
        "coordinate empty",
        |b| b.replace("images.csv", "10,0,50", "10,,50"),
        "images.csv:3: column y: expected a finite number, found an empty cell",
    ),
    (
        "coordinate NaN",
        |b| b.replace("images.csv", "10,0,50", "10,NaN,50"),
        "images.csv:3: column y: expected a finite number, found \"NaN\"",
    ),
    (
        "coordinate infinite",
        |b| b.replace("images.csv", "10,0,50", "-inf,0,50"),
        "images.csv:3: column x: expected a finite number, found \"-inf\"",
    ),
    (
        "coordinate overflows",
        |b| b.replace("images.csv", "10,0,50", "1e999,0,50"),
        "images.csv:3: column x: expected a finite number, found \"1e999\"",
    ),
    (
        "coordinate with comma",
        |b| b.replace("images.csv", "10,0,50", "\"10,5\",0,50"),
        "images.csv:3: column x: expected a finite number, found \"10,5\"",
    ),
    (
        "coordinate with blank",
        |b| b.replace("images.csv", "10,0,50", " 10,0,50"),
        "images.csv:3: column x: expected a finite number, found \" 10\"",
    ),
    (
        "time is text",
        |b| b.replace("images.csv", "f1,2,", "f1,12:30:01,"),
        "images.csv:3: column time_s: expected a finite number, found \"12:30:01\"",
    ),
    (
        "quaternion of length 0.9",
        |b| b.replace("images.csv", "2,10,0,50,0,1,0,0", "2,10,0,50,0,0.9,0,0"),
        "images.csv:3: column qw: the quaternion has length 0.9, expected 1 within 1e-6",
    ),
    (
        "zero quaternion",
        |b| b.replace("images.csv", "2,10,0,50,0,1,0,0", "2,10,0,50,0,0,0,0"),
        "images.csv:3: column qw: the quaternion has length 0, expected 1 within 1e-6",
    ),
    (
        "gnss column missing",
        |b| b.replace("images.csv", "gnss_y", "gnss_north"),
        "images.csv:1: column gnss_y is missing; gnss_x, gnss_y, gnss_z come together or not at all",
    ),
    (
        "velocity column missing",
        |b| b.replace("images.csv", "vx", "speed"),
        "images.csv:1: column vx is missing; vx, vy, vz come together or not at all",
    ),
    (
        "gnss cell missing",
        |b| b.replace("images.csv", "10,0,50.2", "10,,50.2"),
        "images.csv:3: column gnss_y: the cell is empty; gnss_x, gnss_y, gnss_z are given together or not at all",
    ),
    (
        "velocity cell missing",
        |b| b.replace("images.csv", "0.02,5,0,0", "0.02,5,0,"),
        "images.csv:2: column vz: the cell is empty; vx, vy, vz are given together or not at all",
    ),
    (
        "gnss sigma zero",
        |b| b.replace("images.csv", "0.02", "0"),
        "images.csv:2: column gnss_sigma_xy: expected a number above zero, found \"0\"",
    ),
    (
        "gnss without precision",
        |b| b.replace("block.toml", "gnss_z_m = 0.05\n", ""),
        "images.csv:2: a GNSS position without standard deviation; give gnss_sigma_z here or gnss_z_m in block.toml, [sigma]",
    ),
    (
        "exposure negative",
        |b| b.replace("images.csv", "0.001", "-0.001"),
        "images.csv:2: column exposure_s: expected a number above zero, found \"-0.001\"",
    ),
    (
        "focus zero",
        |b| b.replace("images.csv", ",80,first", ",0,first"),
        "images.csv:2: column focus_m: expected a number above zero, found \"0\"",
    ),
    // points.csv.
    (
        "points without z",
        |b| b.replace("points.csv", "x,y,z", "x,y,h"),
        "points.csv:1: column z is missing; the header has \"point\", \"x\", \"y\", \"h\"",
    ),
    (
        "point twice",
        |b| b.append("points.csv", "p0,1,2,3\n"),
        "points.csv:4: column point: point \"p0\" stands twice, first in line 2",
    ),
    (
        "point without name",
        |b| b.append("points.csv", ",1,2,3\n"),
        "points.csv:4: column point: expected a name, found an empty cell",
    ),
    (
        "point with empty coordinate",
        |b| b.append("points.csv", "p7,1,,3\n"),
        "points.csv:4: column y: expected a finite number, found an empty cell",
    ),
    // ties.csv.
    ("empty ties.csv", |b| b.set("ties.csv", ""), "ties.csv:1: column image is missing; the file is empty"),
    (
        "ties without x",
        |b| b.replace("ties.csv", "x,y", "u,v"),
        "ties.csv:1: column x is missing; the header has \"image\", \"point\", \"u\", \"v\", \"sigma\"",
    ),
    (
        "unknown image",
        |b| b.replace("ties.csv", "i2,p0", "i3,p0"),
        "ties.csv:4: column image: \"i3\" is not an image of images.csv",
    ),
    (
        "tie without point",
        |b| b.replace("ties.csv", "i2,p0", "i2,"),
        "ties.csv:4: column point: expected a name, found an empty cell",
    ),
    (
        "tie point not UTF-8",
        |b| {
            let at = TIES.find("p1").unwrap();
            let mut t = TIES.as_bytes().to_vec();
            t[at] = 0xff;
            b.set("ties.csv", t);
        },
        "ties.csv:5: column point: \"\u{fffd}1\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "measurement is text",
        |b| b.replace("ties.csv", "800.5", "8OO.5"),
        "ties.csv:3: column x: expected a finite number, found \"8OO.5\"",
    ),
    (
        "measurement left of the sensor",
        |b| b.replace("ties.csv", "800.5", "-400.5"),
        "ties.csv:3: column x: -400.5 is outside the sensor, 0 to 4000 px, by more than 400 px",
    ),
    (
        "measurement below the sensor",
        |b| b.replace("ties.csv", "i0,p1,2000,2900", "i0,p1,2000,3401"),
        "ties.csv:5: column y: 3401 is outside the sensor, 0 to 3000 px, by more than 400 px",
    ),
    (
        "tie sigma zero",
        |b| b.replace("ties.csv", "0.4", "0"),
        "ties.csv:3: column sigma: expected a number above zero, found \"0\"",
    ),
    (
        "tie without precision",
        |b| b.replace("block.toml", "tie_px = 0.5\n", ""),
        "ties.csv:2: no standard deviation; give sigma here or tie_px in block.toml, [sigma]",
    ),
    (
        "measured twice",
        |b| b.append("ties.csv", "i1,p1,1801,2900,\n"),
        "ties.csv:7: point \"p1\" is measured twice in image \"i1\", first in line 6; keep one",
    ),
    (
        "nothing measured twice",
        |b| {
            b.remove("control.csv");
            b.remove("marks.csv");
            b.set("ties.csv", "image,point,x,y\ni0,p0,1,1\ni1,p1,1,1\n");
        },
        "ties.csv: no tie point is measured in two images, and there are no marks; nothing can be adjusted",
    ),
    (
        "unclosed quote",
        |b| b.replace("ties.csv", "i1,p0,800.5", "\"i1,p0,800.5"),
        "ties.csv:3: number of cells 1, expected 5 as in the header; is a quote not closed?",
    ),
    // control.csv and marks.csv.
    (
        "control without role",
        |b| b.replace("control.csv", "role", "rule"),
        "control.csv:1: column role is missing; the header has \"point\", \"x\", \"y\", \"z\", \"rule\", \"sigma_xy\", \"sigma_z\"",
    ),
    (
        "unknown role",
        |b| b.replace("control.csv", "check", "chek"),
        "control.csv:3: column role: expected control or check, found \"chek\"; did you mean \"check\"?",
    ),
    (
        "surveyed twice",
        |b| b.append("control.csv", "c0,1,2,3,check,,\n"),
        "control.csv:4: column point: point \"c0\" stands twice, first in line 2",
    ),
    (
        "control sigma negative",
        |b| b.replace("control.csv", "0.01", "-0.01"),
        "control.csv:2: column sigma_xy: expected a number above zero, found \"-0.01\"",
    ),
    (
        "control without precision",
        |b| b.replace("block.toml", "control_z_m = 0.005\n", ""),
        "control.csv:2: control without standard deviation; give sigma_z here or control_z_m in block.toml, [sigma]",
    ),
    (
        "control point without mark",
        |b| b.append("control.csv", "c2,1,2,3,control,,\n"),
        "control.csv:4: control point \"c2\" has no mark; measure it in marks.csv or take its row out",
    ),
    (
        "marks empty",
        |b| b.set("marks.csv", "image,point,x,y\n"),
        "control.csv:2: control point \"c0\" has no mark; measure it in marks.csv or take its row out",
    ),
    (
        "mark of an unknown point",
        |b| b.replace("marks.csv", "i1,c0", "i1,p0"),
        "marks.csv:3: column point: unknown point \"p0\"; marks measure the points of control.csv",
    ),
    (
        "mark in an unknown image",
        |b| b.replace("marks.csv", "i1,c0", "j1,c0"),
        "marks.csv:3: column image: \"j1\" is not an image of images.csv",
    ),
    (
        "mark outside the sensor",
        |b| b.replace("marks.csv", "1400,1400", "4400.5,1400"),
        "marks.csv:3: column x: 4400.5 is outside the sensor, 0 to 4000 px, by more than 400 px",
    ),
    (
        "marked twice",
        |b| b.append("marks.csv", "i0,c1,2300,1101\n"),
        "marks.csv:5: point \"c1\" is measured twice in image \"i0\", first in line 4; keep one",
    ),
    (
        "mark without precision",
        |b| b.replace("block.toml", "mark_px = 0.5\n", ""),
        "marks.csv:2: no standard deviation; give sigma here or mark_px in block.toml, [sigma]",
    ),
    // The line is that of an editor, whatever the line ends are.
    (
        "fault after blank lines",
        |b| b.replace("ties.csv", "i2,p0,600", "\n\ni2,p0,x"),
        "ties.csv:6: column x: expected a finite number, found \"x\"",
    ),
    (
        "fault after a quoted line end",
        |b| {
            b.replace("images.csv", "first", "\"fi\nrst\"");
            b.replace("images.csv", "i2,cam", "i2,c");
        },
        "images.csv:5: column camera: \"c\" is not a camera of block.toml; known: \"cam\"",
    ),
    (
        "fault with CRLF",
        |b| {
            let t = TIES.replace('\n', "\r\n").replace("600", "6oo");
            b.set("ties.csv", t);
        },
        "ties.csv:4: column x: expected a finite number, found \"6oo\"",
    ),
];

#[test]
fn the_valid_block_reads() {
    let loaded = Files::valid().read().expect("valid");
    assert!(loaded.set_aside.is_empty());
    assert_eq!(loaded.set_aside.to_string(), "nothing");
    let block = loaded.block;
    assert_eq!((block.images.len(), block.tie_points.len(), block.ties.len()), (3, 2, 5));
    assert_eq!((block.surveyed.len(), block.marks.len(), block.flights.len()), (2, 3, 2));
    assert_eq!(block.extra_image_columns, [("remark".to_owned(), ["first", "", "a, b"].map(str::to_owned).to_vec())]);
}

#[test]
fn every_fault_is_named() {
    let mut wrong = Vec::new();
    for (name, alter, expected) in MALFORMED {
        let mut files = Files::valid();
        alter(&mut files);
        let message = match files.read() {
            Ok(_) => "read without an error".to_owned(),
            Err(message) => message,
        };
        if message != *expected {
            wrong.push(format!("{name}\n  expected {expected}\n  found    {message}"));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), MALFORMED.len(), wrong.join("\n"));
}

/// Nesting as deep as the file is long must not exhaust the stack.
#[test]
fn deep_nesting_is_refused() {
    let mut files = Files::valid();
    files.set("block.toml", format!("format = 1\nname = {}", "[".repeat(100_000)));
    let message = files.read().expect_err("too deep");
    assert!(message.starts_with("block.toml:2:"), "{message}");
    assert!(message.contains("not TOML"), "{message}");
}

#[test]
fn no_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("none");
    let message = read_block(&path).expect_err("there is none").to_string();
    let expected =
        format!("{}: this is not a folder; every block has block.toml, images.csv and ties.csv", path.display());
    assert_eq!(message, expected);
}

/// A table may be in any of these dress forms.
#[test]
fn byte_order_marks_crlf_and_column_order_do_not_matter() {
    let plain = Files::valid().read().expect("valid");
    let mut files = Files::valid();
    for content in files.0.values_mut() {
        let text = String::from_utf8(content.clone()).expect("UTF-8");
        *content = format!("\u{feff}{}", text.replace('\n', "\r\n")).into_bytes();
    }
    files.set("points.csv", "z,unknown,point,y,x\n0.5,?,p0,8,-10\n0,,p1,-20,3\n");
    assert_eq!(files.read().expect("valid"), plain);
}

#[test]
fn what_is_useless_is_left_out_and_counted() {
    let plain = Files::valid().read().expect("valid");
    let mut files = Files::valid();
    files.append("ties.csv", "i2,lonely,5,5,\ni1,lonely2,5,5,\n");
    files.append("points.csv", "lonely,1,2,3\nunseen,1,2,3\n");
    files.append("control.csv", "unmarked,1,2,3,check,,\n");
    files.append("block.toml", &BLOCK[BLOCK.find("[[camera]]").expect("camera")..].replace("cam\"", "spare\""));
    files.replace("images.csv", "0.8,0,,,,,", "0.8,0,,,,0.02,");
    let loaded = files.read().expect("valid");
    assert_eq!(
        loaded.set_aside.to_string(),
        "2 tie points with one ray, 1 row of points.csv without a measurement, 1 check point without a mark, \
         1 camera without an image, 1 GNSS standard deviation without a position"
    );
    assert_eq!(loaded.block, plain.block);
}

#[test]
fn six_decimals_of_a_quaternion_are_normalised() {
    let mut files = Files::valid();
    files.replace("images.csv", "0,0.6,0.8,0", "0.182574,0.365148,0.547723,0.730297");
    let loaded = files.read().expect("within the tolerance");
    let norm = loaded.block.images[2].pose.rotation.quaternion().norm();
    assert!((norm - 1.0).abs() < 1e-15, "{norm}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the bytes are, reading ends with a block or a message.
    #[test]
    fn arbitrary_bytes_do_not_panic(file in 0..6usize, content in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut files = Files::valid();
        let name = *files.0.keys().nth(file).expect("six files");
        files.set(name, content);
        if let Err(message) = files.read() {
            prop_assert!(message.contains(".csv") || message.contains(".toml"), "{}", message);
        }
    }

    /// A valid file with a few bytes changed, taken out or put in: most faults of real files are near to valid ones.
    #[test]
    fn damaged_files_do_not_panic(
        file in 0..6usize,
        damages in prop::collection::vec((any::<prop::sample::Index>(), 0..3u8, prop::sample::select(b"\",\n\r=[]{}#.-e0917 \\\xff\x00naif".to_vec())), 1..6),
    ) {
        let mut files = Files::valid();
        let name = *files.0.keys().nth(file).expect("six files");
        let mut content = files.0[name].clone();
        for (at, kind, byte) in damages {
            let at = at.index(content.len());
            match kind {
                0 => content[at] = byte,
                1 => drop(content.remove(at)),
                _ => content.insert(at, byte),
            }
        }
        files.set(name, content);
        if let Err(message) = files.read() {
            prop_assert!(message.contains(".csv") || message.contains(".toml"), "{}", message);
        }
    }
}
