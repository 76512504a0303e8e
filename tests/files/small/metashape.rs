//! Metashape: one camera, three images of which one is not aligned, three markers; a project in one and in several zip
//! files.

/// One camera with everything, two images, two markers with one location each that nobody pinned.
pub fn document(calibration: &str, markers: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<document version=\"1.5.0\"><chunk label=\"c\" enabled=\"true\">\n\
         <sensors><sensor id=\"7\" label=\"cam\" type=\"frame\"><resolution width=\"4000\" height=\"3000\"/>\n\
         <calibration type=\"frame\" class=\"adjusted\"><resolution width=\"4000\" \
         height=\"3000\"/>{calibration}</calibration></sensor></sensors>\n\
         <cameras><group id=\"0\" label=\"morning\" type=\"folder\">\n\
         <camera id=\"3\" sensor_id=\"7\" label=\"a.jpg\"><transform>1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 \
         1</transform></camera></group>\n\
         <camera id=\"4\" sensor_id=\"7\" label=\"b.jpg\"><transform>0 -1 0 2  1 0 0 0  0 0 1 0  0 0 0 \
         1</transform></camera>\n\
         <camera id=\"5\" sensor_id=\"7\" label=\"lost.jpg\"/></cameras>\n\
         <transform><rotation>1 0 0 0 0 1 0 -1 0</rotation><translation>10 20 \
         30</translation><scale>2</scale></transform>\n\
         {markers}</chunk></document>"
    )
}

pub const MARKERS: &str = "<markers><marker id=\"0\" label=\"G1\"><reference x=\"10\" y=\"30\" z=\"30\" sx=\"0.3\" \
                           sy=\"0.4\" sz=\"0.1\" enabled=\"true\"/></marker>\
    <marker id=\"1\" label=\"K1\"><reference x=\"11\" y=\"31\" z=\"30\" enabled=\"0\"/></marker>\
    <marker id=\"2\" label=\"T1\"/></markers>\
    <frames><frame id=\"0\"><markers>\
    <marker marker_id=\"0\"><location camera_id=\"3\" pinned=\"true\" x=\"2000.5\" y=\"1500\"/><location \
    camera_id=\"4\" pinned=\"0\" x=\"9\" y=\"9\"/></marker>\
    <marker marker_id=\"1\"><location camera_id=\"4\" pinned=\"1\" x=\"5\" y=\"6\"/></marker>\
    <marker marker_id=\"2\"><location camera_id=\"3\" x=\"7\" y=\"8\"/><location camera_id=\"4\" x=\"17\" \
    y=\"18\"/></marker>\
    </markers></frame></frames>";
pub const RELATIVE: &str = "<f>2500</f><cx>3</cx><cy>-4</cy><k1>-0.1</k1><k2>0.05</k2><p1>0.001</p1><p2>-0.002</p2>";

/// The same camera on a rig with a second one, turned by a quarter about its own axis and a unit to the right; of a
/// third one nothing is known. Of the images `c.jpg` and `d.jpg` a.jpg and b.jpg are the masters.
pub fn rig() -> String {
    let sensor = |id: u32, offset: &str| {
        format!(
            "<sensor id=\"{id}\" label=\"slave {id}\" type=\"frame\" master_id=\"7\">\
             <resolution width=\"4000\" height=\"3000\"/><property name=\"layer_index\" value=\"1\"/>\
             <calibration type=\"frame\" class=\"adjusted\">{RELATIVE}</calibration>\
             {offset}</sensor>"
        )
    };
    let known = sensor(8, "<rotation>0 -1 0 1 0 0 0 0 1</rotation><location>1 0 0</location>");
    let unknown = sensor(9, "<rotation fixed=\"true\"/><location fixed=\"true\"/>");
    let slave = |id: u32, sensor: u32, master: u32, label: &str| {
        format!("<camera id=\"{id}\" sensor_id=\"{sensor}\" master_id=\"{master}\" label=\"{label}\"/>")
    };
    let slaves =
        [slave(13, 8, 3, "c.jpg"), slave(14, 8, 4, "d.jpg"), slave(15, 8, 5, "lost c.jpg"), slave(16, 9, 3, "e.jpg")];
    document(RELATIVE, MARKERS)
        .replace("</sensors>", &format!("{known}{unknown}</sensors>"))
        .replace("</cameras>", &format!("{}</cameras>", slaves.concat()))
}

/// What a project in several zip files has in them.
pub struct Project {
    pub project: Vec<u8>,
    pub chunk: Vec<u8>,
    pub frame: Vec<u8>,
    pub cloud: Vec<u8>,
    pub points: Vec<u8>,
    /// Of the cameras 3 and 4.
    pub projections: [Vec<u8>; 2],
}

/// What leads to them.
pub const POINTER: &str = "<document version=\"1.2.0\" path=\"{projectname}.files/project.zip\"/>";

/// A marker and a tie point, and another point without coordinates.
pub fn project() -> Project {
    let chunk = document(
        RELATIVE,
        "<markers><marker id=\"0\" label=\"G1\"><reference x=\"10\" y=\"30\" z=\"30\"/></marker></markers>",
    );
    let chunk = chunk.split_once("<chunk").unwrap().1.replace("</chunk></document>", "");
    let frame = "<frame><markers><marker marker_id=\"0\"><location camera_id=\"3\" pinned=\"1\" x=\"2003\" \
                 y=\"1496\"/></marker></markers>\
                 <point_cloud path=\"point_cloud/point_cloud.zip\"/></frame>";
    let cloud = "<point_cloud><points path=\"points0.ply\"/><projections camera_id=\"3\" path=\"p3.ply\"/><projections \
                 camera_id=\"4\" path=\"p4.ply\"/></point_cloud>";
    let projections = [[100.0, 200.0, 2.0, 8.0], [300.0, 400.0, 2.0, 8.0]].map(|seen| {
        ply("float x\nproperty float y\nproperty float size\nproperty int id", &[seen, [1.0, 1.0, 1.0, 9.0]])
    });
    Project {
        project: b"<document><chunks><chunk id=\"0\" path=\"0/chunk.zip\"/></chunks></document>".into(),
        chunk: format!("<chunk{chunk}<frames><frame id=\"0\" path=\"0/frame.zip\"/></frames></chunk>").into(),
        frame: frame.into(),
        cloud: cloud.into(),
        points: ply("float x\nproperty float y\nproperty float z\nproperty uint id", &[[0.0, 0.0, 5.0, 8.0]]),
        projections,
    }
}

/// The same in one zip file: its document.
pub fn whole() -> String {
    let Project { chunk, frame, cloud, .. } = project();
    let [chunk, frame, cloud] = [chunk, frame, cloud].map(|text| String::from_utf8(text).unwrap());
    let frame = frame.replace("<point_cloud path=\"point_cloud/point_cloud.zip\"/>", &cloud);
    let chunk = chunk.replace("<frame id=\"0\" path=\"0/frame.zip\"/>", &frame);
    format!("<document version=\"1.2.0\">{chunk}</document>")
}

/// Three 32-bit floating-point numbers and an integer each.
pub fn ply(properties: &str, rows: &[[f32; 4]]) -> Vec<u8> {
    let count = rows.len();
    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty {properties}\nend_header\n")
            .into_bytes();
    for [x, y, z, id] in rows {
        for value in [x, y, z] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend((*id as u32).to_le_bytes());
    }
    bytes
}
