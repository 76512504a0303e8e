//! Faults of `block.toml`.

use crate::malformed_blocks::Case;
use crate::malformed_blocks::block::BLOCK;

pub const CASES: &[Case] = &[
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
        "block.toml:3:1: unknown key \"projection\" in block.toml; known: \"format\", \"name\", \"crs\", \
         \"survey_crs\", \"sigma\", \"camera\"",
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
];
