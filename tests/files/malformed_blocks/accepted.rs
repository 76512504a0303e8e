//! What is no fault: other forms of the same block, and what is of no use in it.

use crate::malformed_blocks::block::{BLOCK, Files};

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
