//! Arrays in numpy's file format.

use std::path::Path;

/// An array of numbers, converted from any type in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of every axis.
    pub shape: Vec<usize>,
    /// Numbers in row-major order (the last index changes fastest).
    pub values: Vec<f64>,
}

/// Reason why an array could not be read.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    /// The file could not be read.
    #[error("cannot read {path}")]
    Io {
        /// The file.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
    /// The file has an unsupported form.
    #[error("{path}: {what}")]
    Format {
        /// The file.
        path: String,
        /// Description of the problem.
        what: String,
    },
}

impl Array {
    /// Reads little-endian `f8`, `f4`, `i4` or `u1` numbers in either order.
    ///
    /// # Errors
    ///
    /// Fails with [`NpyError`] if the file cannot be read, or contains something else.
    pub fn read(path: &Path) -> Result<Self, NpyError> {
        let shown = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| NpyError::Io {
            path: shown.clone(),
            source,
        })?;
        parse(&bytes).map_err(|what| NpyError::Format { path: shown, what })
    }

    /// Returns the number at an index.
    ///
    /// # Panics
    ///
    /// Panics if the index is out of range or has another number of axes.
    pub fn at(&self, index: &[usize]) -> f64 {
        assert_eq!(index.len(), self.shape.len(), "one index per axis");
        let flat = index.iter().zip(&self.shape).fold(0, |flat, (at, length)| {
            assert!(at < length, "index {index:?} of {:?}", self.shape);
            flat * length + at
        });
        self.values[flat]
    }
}

fn parse(bytes: &[u8]) -> Result<Array, String> {
    let version = bytes.get(6).filter(|_| bytes.starts_with(b"\x93NUMPY"));
    let (start, length) = match version {
        Some(1) => (10, usize::from(u16::from_le_bytes(fixed(bytes, 8)?))),
        Some(2 | 3) => (12, u32::from_le_bytes(fixed(bytes, 8)?) as usize),
        _ => return Err("not a numpy array".to_owned()),
    };
    let header = bytes.get(start..start + length).ok_or("truncated header")?;
    let header = String::from_utf8_lossy(header);
    let shape = field(&header, "'shape': (", ")")?;
    let shape: Vec<usize> = shape
        .split(',')
        .map(str::trim)
        .filter(|length| !length.is_empty())
        .map(|length| length.parse().map_err(|_error| format!("shape ({shape})")))
        .collect::<Result<_, _>>()?;
    let data = &bytes[start + length..];
    let values: Vec<f64> = match field(&header, "'descr': '", "'")? {
        "<f8" => numbers(data, f64::from_le_bytes),
        "<f4" => numbers(data, |bytes| f64::from(f32::from_le_bytes(bytes))),
        "<i4" => numbers(data, |bytes| f64::from(i32::from_le_bytes(bytes))),
        "|u1" => numbers(data, |[byte]| f64::from(byte)),
        other => return Err(format!("numbers of type {other}")),
    };
    if values.len() != shape.iter().product::<usize>() {
        return Err(format!("{} numbers for shape {shape:?}", values.len()));
    }
    if header.contains("'fortran_order': True") {
        return Ok(Array {
            values: last_axis_fastest(&shape, &values),
            shape,
        });
    }
    Ok(Array { shape, values })
}

fn fixed<const N: usize>(bytes: &[u8], at: usize) -> Result<[u8; N], String> {
    let found = bytes.get(at..at + N).and_then(|byte| byte.try_into().ok());
    found.ok_or_else(|| "truncated header".to_owned())
}

fn field<'a>(header: &'a str, before: &str, after: &str) -> Result<&'a str, String> {
    let rest = header.split_once(before).map(|parts| parts.1);
    let found = rest.and_then(|rest| rest.split_once(after)).map(|parts| parts.0);
    found.ok_or_else(|| format!("no {before} in the header"))
}

fn numbers<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let (chunks, _) = data.as_chunks::<N>();
    chunks.iter().map(|chunk| number(*chunk)).collect()
}

fn last_axis_fastest(shape: &[usize], first_axis_fastest: &[f64]) -> Vec<f64> {
    let value = |flat: usize| {
        let (mut rest, mut at, mut step) = (flat, 0, first_axis_fastest.len());
        for &length in shape.iter().rev() {
            step /= length;
            at += (rest % length) * step;
            rest /= length;
        }
        first_axis_fastest[at]
    };
    (0..first_axis_fastest.len()).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn row_and_column_order_give_the_same_array() {
        let c = file(
            "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3), }",
            &[1, 2, 3, 4, 5, 6],
        );
        let fortran = file(
            "{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3), }",
            &[1, 4, 2, 5, 3, 6],
        );
        let array = parse(&c).unwrap();
        assert_eq!(array, parse(&fortran).unwrap());
        assert_eq!(array.at(&[1, 0]), 4.0);
    }

    #[test]
    fn refuses_unknown_npy_formats() {
        let shape = "'fortran_order': False, 'shape': (2,), }";
        let complex = file(&format!("{{'descr': '<c8', {shape}"), &[0; 16]);
        assert_eq!(parse(&complex).unwrap_err(), "numbers of type <c8");
        let short = file(&format!("{{'descr': '<f8', {shape}"), &[0; 8]);
        assert_eq!(parse(&short).unwrap_err(), "1 numbers for shape [2]");
        assert_eq!(parse(b"PNG").unwrap_err(), "not a numpy array");
        assert_eq!(
            parse(b"\x93NUMPY\x01\x00\xff").unwrap_err(),
            "truncated header"
        );
    }
}
