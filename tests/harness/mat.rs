//! Writes MATLAB level 5 files.

use std::io::Read as _;

use flate2::Compression;
use flate2::read::ZlibEncoder;

/// A value to write.
#[derive(Debug, Clone)]
pub enum Mat {
    /// Sizes of the dimensions, and the numbers in column-major order (the first index changes fastest).
    Numbers(Vec<usize>, Vec<f64>),
    /// One row of structs: the names of the fields, and all values, element by element.
    Structs(Vec<&'static str>, Vec<Self>),
    /// One row of cells.
    Cell(Vec<Self>),
}

/// Returns the bytes of a file with one variable.
pub fn file(name: &str, value: &Mat, compressed: bool) -> Vec<u8> {
    let variable = matrix(name, value);
    if compressed {
        compressed_file(&variable)
    } else {
        [header(), variable].concat()
    }
}

/// Returns the bytes of a file with one compressed variable, which decompresses to `variable`.
///
/// # Panics
///
/// Never panics, because bytes in memory can be read.
#[expect(clippy::expect_used, reason = "bytes in memory can be read")]
pub fn compressed_file(variable: &[u8]) -> Vec<u8> {
    let mut deflated = Vec::new();
    ZlibEncoder::new(variable, Compression::default())
        .read_to_end(&mut deflated)
        .expect("bytes in memory can be read");
    let tag = [15, deflated.len() as u32].map(u32::to_le_bytes).concat();
    [header(), tag, deflated].concat()
}

fn header() -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file, planted".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes
}

/// Returns a scalar.
pub fn number(value: f64) -> Mat {
    row(vec![value])
}

/// Returns a row vector.
pub fn row(values: Vec<f64>) -> Mat {
    Mat::Numbers(vec![1, values.len()], values)
}

fn matrix(name: &str, value: &Mat) -> Vec<u8> {
    let (class, sizes) = match value {
        Mat::Cell(values) => (1, vec![1, values.len()]),
        Mat::Structs(fields, values) => (2, vec![1, values.len() / fields.len()]),
        Mat::Numbers(sizes, _) => (6, sizes.clone()),
    };
    let sizes: Vec<u8> = sizes.iter().flat_map(|&size| (size as i32).to_le_bytes()).collect();
    let mut body = element(6, &[class, 0, 0, 0, 0, 0, 0, 0]);
    body.extend(element(5, &sizes));
    body.extend(element(1, name.as_bytes()));
    match value {
        Mat::Cell(values) => body.extend(values.iter().flat_map(|value| matrix("", value))),
        Mat::Structs(fields, values) => {
            body.extend(element(5, &32_i32.to_le_bytes()));
            let padded = |name: &&str| format!("{name:\0<32}").into_bytes();
            body.extend(element(
                1,
                &fields.iter().flat_map(padded).collect::<Vec<_>>(),
            ));
            body.extend(values.iter().flat_map(|value| matrix("", value)));
        }
        Mat::Numbers(_, values) if values.iter().all(|&value| f64::from(value as u8) == value) => {
            // MATLAB stores numbers in the narrowest type that can represent them.
            let bytes: Vec<u8> = values.iter().map(|&value| value as u8).collect();
            body.extend(element(2, &bytes));
        }
        Mat::Numbers(_, values) => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            body.extend(element(9, &bytes));
        }
    }
    element(14, &body)
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    if (1..=4).contains(&data.len()) {
        let mut bytes = (kind | (data.len() as u32) << 16).to_le_bytes().to_vec();
        bytes.extend(data);
        bytes.resize(8, 0);
        return bytes;
    }
    let mut bytes = [kind, data.len() as u32].map(u32::to_le_bytes).concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}
