//! A small valid block as text, to be altered.

use misclosure::io::block::{Loaded, read_block};
use std::collections::BTreeMap;
use std::path::Path;

pub const BLOCK: &str = r#"format = 1
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

pub const IMAGES: &str = "\
image,camera,flight,time_s,x,y,z,qw,qx,qy,qz,gnss_x,gnss_y,gnss_z,gnss_sigma_xy,vx,vy,vz,exposure_s,focus_m,remark
i0,cam,f1,0,0,0,50,0,1,0,0,0,0,50.2,0.02,5,0,0,0.001,80,first
i1,cam,f1,2,10,0,50,0,1,0,0,10,0,50.2,,5,0,0,0.001,80,
i2,cam,f2,9,20,0,50,0,0.6,0.8,0,,,,,,,,,,\"a, b\"
";

pub const TIES: &str = "\
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
pub struct Files(pub BTreeMap<&'static str, Vec<u8>>);

impl Files {
    pub fn valid() -> Self {
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

    pub fn set(&mut self, file: &'static str, content: impl AsRef<[u8]>) {
        self.0.insert(file, content.as_ref().to_vec());
    }

    pub fn remove(&mut self, file: &str) {
        self.0.remove(file).expect("the file is there");
    }

    /// Replaces the first `from`, which must be there.
    pub fn replace(&mut self, file: &'static str, from: &str, to: &str) {
        let text = String::from_utf8(self.0[file].clone()).expect("UTF-8");
        assert!(text.contains(from), "{from:?} is not in {file}");
        self.set(file, text.replacen(from, to, 1));
    }

    /// Makes the first `at` no UTF-8.
    pub fn spoil(&mut self, file: &'static str, at: &str) {
        let content = self.0.get_mut(file).expect("the file is there");
        let place = content.windows(at.len()).position(|part| part == at.as_bytes()).expect("the text is there");
        content[place] = 0xff;
    }

    pub fn append(&mut self, file: &'static str, text: &str) {
        self.0.get_mut(file).expect("the file is there").extend_from_slice(text.as_bytes());
    }

    pub fn read(&self) -> Result<Loaded, String> {
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
