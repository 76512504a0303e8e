//! Binary PLY files, as far as Metashape writes them: one element `vertex` with scalar properties, little endian.

use super::super::super::error::{Error, Place, shown};

/// Longest header, bytes; the real ones have some hundred.
const MOST_HEADER_BYTES: usize = 64 * 1024;

/// Type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value at the beginning of `bytes`, which has at least [`Self::bytes`].
    fn value(self, bytes: &[u8]) -> f64 {
        let mut eight = [0; 8];
        eight[..self.bytes()].copy_from_slice(&bytes[..self.bytes()]);
        let [a, b, c, d, ..] = eight;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(eight),
        }
    }
}

/// The vertices of a file: of each, the properties of the given names. Coordinates of this kind are 32-bit: they have
/// 0.0005 px in an image of 8000 px.
///
/// # Errors
/// When `bytes` is no such file, lacks a property, or a value is not finite.
pub(super) fn vertices<const N: usize>(file: &str, bytes: &[u8], names: [&str; N]) -> Result<Vec<[f64; N]>, Error> {
    let refuse = |place, problem: String| Error::content(file, place, problem);
    let mut header = Header::default();
    let mut rest = bytes;
    for line in 1.. {
        let end = rest.iter().take(MOST_HEADER_BYTES).position(|byte| *byte == b'\n');
        let Some(end) = end else {
            return Err(refuse(Place::Line(line), "expected a PLY header that ends with end_header".into()));
        };
        let text = String::from_utf8_lossy(&rest[..end]).trim_end().to_owned();
        rest = &rest[end + 1..];
        if text == "end_header" {
            break;
        }
        header.take(&text, line == 1).map_err(|expected| {
            let found = shown(text.as_bytes());
            refuse(Place::Line(line), format!("expected {expected}, found {found}"))
        })?;
    }
    let row = header.properties.iter().map(|(_, scalar)| scalar.bytes()).sum::<usize>();
    if header.count.checked_mul(row) != Some(rest.len()) {
        let (count, found) = (header.count, rest.len());
        return Err(refuse(Place::File, format!("expected {count} vertices of {row} bytes, found {found} bytes")));
    }
    let mut places = [(Scalar::U8, 0); N];
    for (place, name) in places.iter_mut().zip(names) {
        let position = header.properties.iter().position(|(other, _)| other == name);
        let position = position.ok_or_else(|| refuse(Place::File, format!("the vertices have no property {name}")))?;
        let before = header.properties[..position].iter().map(|(_, scalar)| scalar.bytes()).sum();
        *place = (header.properties[position].1, before);
    }
    let mut vertices = Vec::with_capacity(header.count);
    for (number, row) in rest.chunks_exact(row.max(1)).enumerate() {
        let vertex = places.map(|(scalar, offset)| scalar.value(&row[offset..]));
        if let Some(k) = vertex.iter().position(|value| !value.is_finite()) {
            let problem = format!("vertex {number}, {}: expected a finite number, found {}", names[k], vertex[k]);
            return Err(refuse(Place::File, problem));
        }
        vertices.push(vertex);
    }
    Ok(vertices)
}

#[derive(Default)]
struct Header {
    count: usize,
    has_vertices: bool,
    properties: Vec<(String, Scalar)>,
}

impl Header {
    /// Takes a line; an error says what was expected.
    fn take(&mut self, line: &str, is_first: bool) -> Result<(), &'static str> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match (is_first, &words[..]) {
            (true, ["ply"]) | (false, ["comment" | "obj_info", ..] | ["format", "binary_little_endian", _]) => Ok(()),
            (true, _) => Err("ply"),
            (false, ["format", ..]) => Err("format binary_little_endian"),
            (false, ["element", "vertex", count]) if !self.has_vertices => {
                self.has_vertices = true;
                self.count = count.parse().map_err(|_| "the number of vertices")?;
                Ok(())
            }
            (false, ["property", scalar, name]) if self.has_vertices => {
                let scalar = Scalar::named(scalar).ok_or("a scalar property")?;
                self.properties.push(((*name).to_owned(), scalar));
                Ok(())
            }
            _ => Err("one element vertex with scalar properties"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(properties: &str, count: usize, body: &[u8]) -> Vec<u8> {
        let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}end_header\n");
        [header.as_bytes(), body].concat()
    }

    #[test]
    fn properties_are_found_by_name_whatever_their_type_and_place() {
        let body: Vec<u8> = [&[7u8][..], &2.5f32.to_le_bytes(), &(-3i16).to_le_bytes()].concat();
        let bytes = file("property uchar a\nproperty float x\nproperty short id\n", 1, &body);
        assert_eq!(vertices("f", &bytes, ["id", "x"]).unwrap(), [[-3.0, 2.5]]);
    }

    #[test]
    fn what_is_missing_is_said() {
        let message = |bytes: &[u8]| vertices("f", bytes, ["x"]).unwrap_err().to_string();
        assert_eq!(message(b"plx\n"), r#"f:1: expected ply, found "plx""#);
        assert_eq!(message(b"ply\nelement"), "f:2: expected a PLY header that ends with end_header");
        let short = file("property float x\n", 2, &[0; 4]);
        assert_eq!(message(&short), "f: expected 2 vertices of 4 bytes, found 4 bytes");
        let nan = file("property float x\n", 1, &f32::NAN.to_le_bytes());
        assert_eq!(message(&nan), "f: vertex 0, x: expected a finite number, found NaN");
        assert_eq!(message(&file("property float y\n", 0, &[])), "f: the vertices have no property x");
    }
}
