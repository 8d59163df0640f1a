//! Reader of MATLAB level 5 files: numbers, structs and cells, compressed or not, as needed for models and annotations.
//!
//! This crate has its own reader because published readers panic on damaged files. Memory is never allocated for a declared count: every
//! array borrows bytes of the file.
//!
//! ```
//! let file = include_bytes!("../examples/points.mat");
//! let variables = formats::mat5::variables(file)?;
//! let (name, value) = formats::mat5::variable(&variables[0])?;
//! assert_eq!(name, "points");
//! if let formats::mat5::Value::Numbers(numbers) = value {
//!     assert_eq!(numbers.sizes(), [2, 3]);
//!     // Column by column.
//!     assert_eq!(numbers.values(), [1.0, 2.0, 3.0, 4.5, 5.5, 6.5]);
//! }
//! # Ok::<(), formats::mat5::ContainerError>(())
//! ```

mod error;

use std::io::Read as _;

use flate2::read::ZlibDecoder;

pub use error::ContainerError;

/// A value in a file; arrays borrow the file's bytes.
#[derive(Debug, Clone, PartialEq)]
pub enum Value<'a> {
    /// Real numbers, column-major.
    Numbers(Numbers<'a>),
    /// An array of structs.
    Structs(Structs<'a>),
    /// An array of values of any kind.
    Cell(Vec<Self>),
    /// A value that is not supported: text, sparse or complex numbers, or objects.
    Other,
}

/// An array of real numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers<'a> {
    sizes: Vec<usize>,
    storage: u32,
    bytes: &'a [u8],
}

/// An array of structs.
#[derive(Debug, Clone, PartialEq)]
pub struct Structs<'a> {
    fields: Vec<String>,
    /// Values, as `[element][field]`.
    elements: Vec<Vec<Value<'a>>>,
}

impl Structs<'_> {
    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Returns true if there are no elements.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }
}

impl<'a> Structs<'a> {
    /// Returns a field of an element (from 0); `None` if the element or the field does not exist.
    pub fn get(&self, element: usize, field: &str) -> Option<&Value<'a>> {
        let field = self.fields.iter().position(|name| name == field)?;
        self.elements.get(element)?.get(field)
    }
}

impl Numbers<'_> {
    /// Returns the sizes, rows first; there are at least two.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Returns the number of values, which is the product of the sizes.
    pub fn n_values(&self) -> usize {
        self.sizes.iter().product()
    }

    /// Returns the values, column-major.
    pub fn values(&self) -> Vec<f64> {
        match self.storage {
            MI_INT8 => self.each(|[byte]: [u8; 1]| f64::from(byte as i8)),
            MI_UINT8 => self.each(|[byte]: [u8; 1]| f64::from(byte)),
            MI_INT16 => self.each(|bytes| f64::from(i16::from_le_bytes(bytes))),
            MI_UINT16 => self.each(|bytes| f64::from(u16::from_le_bytes(bytes))),
            MI_INT32 => self.each(|bytes| f64::from(i32::from_le_bytes(bytes))),
            MI_UINT32 => self.each(|bytes| f64::from(u32::from_le_bytes(bytes))),
            MI_SINGLE => self.each(|bytes| f64::from(f32::from_le_bytes(bytes))),
            MI_INT64 => self.each(|bytes| i64::from_le_bytes(bytes) as f64),
            MI_UINT64 => self.each(|bytes| u64::from_le_bytes(bytes) as f64),
            _ => self.each(f64::from_le_bytes),
        }
    }

    fn each<const N: usize>(&self, value: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        self.bytes.as_chunks().0.iter().map(|&bytes| value(bytes)).collect()
    }
}

/// Returns the bytes of each variable, decompressed.
///
/// # Errors
///
/// Fails with [`ContainerError`] if the file is not valid.
pub fn variables(file: &[u8]) -> Result<Vec<Vec<u8>>, ContainerError> {
    if file.starts_with(b"MATLAB 7.3") {
        return Err(ContainerError::Version73);
    }
    let mut rest = Bytes(file);
    let header = rest.take(HEADER_BYTES, "the header")?;
    let endian = &header[HEADER_BYTES - 2..];
    if endian != b"IM" {
        return Err(ContainerError::Endian {
            got: String::from_utf8_lossy(endian).into_owned(),
        });
    }
    let mut variables = Vec::new();
    let mut n_bytes = 0;
    while !rest.0.is_empty() {
        let start = rest.0;
        let (kind, data) = rest.element("a variable")?;
        let variable = match kind {
            MI_COMPRESSED => inflate(data, MAX_BYTES - n_bytes)?,
            MI_MATRIX => start[..start.len() - rest.0.len()].to_vec(),
            got => {
                return Err(ContainerError::Type {
                    what: "a variable",
                    got,
                    expected: "14 (matrix) or 15 (compressed)",
                });
            }
        };
        n_bytes = (n_bytes + variable.len()).min(MAX_BYTES);
        variables.push(variable);
    }
    Ok(variables)
}

/// Reads the name and the value of a variable.
///
/// * `bytes`: one of [`variables`].
///
/// # Errors
///
/// Fails with [`ContainerError`] if the variable is not valid.
pub fn variable(bytes: &[u8]) -> Result<(String, Value<'_>), ContainerError> {
    let mut budget = MAX_VALUES;
    let (kind, data) = Bytes(bytes).element("a variable")?;
    expect_type("a variable", kind, &[MI_MATRIX], "14 (matrix)")?;
    matrix(data, MAX_DEPTH, &mut budget)
}

const HEADER_BYTES: usize = 128;
/// Maximum total size of the decompressed variables, in bytes. The largest accepted model needs less, at 4 bytes per weight.
const MAX_BYTES: usize = 64 << 20;
const MAX_VALUES: usize = 1 << 20;
const MAX_DEPTH: usize = 8;

const MI_INT8: u32 = 1;
const MI_UINT8: u32 = 2;
const MI_INT16: u32 = 3;
const MI_UINT16: u32 = 4;
const MI_INT32: u32 = 5;
const MI_UINT32: u32 = 6;
const MI_SINGLE: u32 = 7;
const MI_DOUBLE: u32 = 9;
const MI_INT64: u32 = 12;
const MI_UINT64: u32 = 13;
const MI_MATRIX: u32 = 14;
const MI_COMPRESSED: u32 = 15;

const MX_CELL: u8 = 1;
const MX_STRUCT: u8 = 2;
const MX_DOUBLE: u8 = 6;
const MX_UINT64: u8 = 15;
const COMPLEX: u8 = 1 << 3;

fn inflate(data: &[u8], limit: usize) -> Result<Vec<u8>, ContainerError> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(data)
        .take(limit as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(ContainerError::Inflate)?;
    if bytes.len() > limit {
        return Err(ContainerError::TooMuch {
            what: "bytes",
            limit: MAX_BYTES,
        });
    }
    Ok(bytes)
}

fn matrix<'a>(
    data: &'a [u8],
    depth: usize,
    budget: &mut usize,
) -> Result<(String, Value<'a>), ContainerError> {
    if data.is_empty() {
        let nothing = Numbers {
            sizes: vec![0, 0],
            storage: MI_DOUBLE,
            bytes: &[],
        };
        return Ok((String::new(), Value::Numbers(nothing)));
    }
    let mut rest = Bytes(data);
    let flags = rest.typed("an array's flags", &[MI_UINT32], "6 (uint32)")?;
    let [class, flags] = match flags {
        [class, flags, ..] => [*class, *flags],
        _ => {
            return Err(ContainerError::Ended {
                what: "an array's flags",
                got: flags.len(),
                expected: 8,
            });
        }
    };
    if !matches!(class, MX_CELL | MX_STRUCT | MX_DOUBLE..=MX_UINT64) || flags & COMPLEX != 0 {
        return Ok((String::new(), Value::Other));
    }
    let sizes = rest.typed("an array's sizes", &[MI_INT32], "5 (int32)")?;
    let sizes: Vec<i32> =
        sizes.as_chunks().0.iter().map(|&bytes| i32::from_le_bytes(bytes)).collect();
    let name = rest.typed("an array's name", &[MI_INT8], "1 (int8)")?;
    let name = String::from_utf8_lossy(name).into_owned();
    let value = match class {
        MX_CELL => Value::Cell(cells(&mut rest, &sizes, depth, budget)?),
        MX_STRUCT => Value::Structs(structs(&mut rest, &sizes, depth, budget)?),
        _ => Value::Numbers(numbers(&mut rest, &sizes)?),
    };
    Ok((name, value))
}

fn numbers<'a>(rest: &mut Bytes<'a>, sizes: &[i32]) -> Result<Numbers<'a>, ContainerError> {
    let (storage, bytes) = rest.element("an array's values")?;
    let width = match storage {
        MI_INT8 | MI_UINT8 => 1,
        MI_INT16 | MI_UINT16 => 2,
        MI_INT32 | MI_UINT32 | MI_SINGLE => 4,
        MI_DOUBLE | MI_INT64 | MI_UINT64 => 8,
        got => {
            return Err(ContainerError::Type {
                what: "an array's values",
                got,
                expected: "a type of numbers",
            });
        }
    };
    let n_values = bytes.len() / width;
    if sizes.len() < 2 || bytes.len() % width != 0 || product(sizes) != Some(n_values) {
        return Err(ContainerError::Size {
            sizes: sizes.to_vec(),
            got: n_values,
        });
    }
    Ok(Numbers {
        sizes: sizes.iter().map(|&size| size as usize).collect(),
        storage,
        bytes,
    })
}

fn cells<'a>(
    rest: &mut Bytes<'a>,
    sizes: &[i32],
    depth: usize,
    budget: &mut usize,
) -> Result<Vec<Value<'a>>, ContainerError> {
    let n_values = product(sizes).ok_or_else(|| ContainerError::Size {
        sizes: sizes.to_vec(),
        got: 0,
    })?;
    let Some(depth) = depth.checked_sub(1) else {
        return Err(ContainerError::TooMuch {
            what: "levels of structs and cells",
            limit: MAX_DEPTH,
        });
    };
    let mut values = Vec::new();
    for _ in 0..n_values {
        *budget = budget.checked_sub(1).ok_or(ContainerError::TooMuch {
            what: "values",
            limit: MAX_VALUES,
        })?;
        let data = rest.typed("a value", &[MI_MATRIX], "14 (matrix)")?;
        values.push(matrix(data, depth, budget)?.1);
    }
    Ok(values)
}

fn structs<'a>(
    rest: &mut Bytes<'a>,
    sizes: &[i32],
    depth: usize,
    budget: &mut usize,
) -> Result<Structs<'a>, ContainerError> {
    const WHAT: &str = "a struct's field names";
    let length = rest.typed(WHAT, &[MI_INT32], "5 (int32)")?;
    let names = rest.typed(WHAT, &[MI_INT8], "1 (int8)")?;
    let length = match length.first_chunk() {
        Some(&bytes) => i32::from_le_bytes(bytes),
        None => 0,
    };
    let wrong = || ContainerError::Size {
        sizes: vec![length],
        got: names.len(),
    };
    let length = usize::try_from(length).ok().filter(|&value| value > 0);
    let length = length.ok_or_else(wrong)?;
    let fields: Vec<String> = names
        .chunks(length)
        .map(|name| {
            let end = name.iter().position(|&byte| byte == 0).unwrap_or(name.len());
            String::from_utf8_lossy(&name[..end]).into_owned()
        })
        .collect();
    let n_fields = i32::try_from(fields.len()).map_err(|_too_many| wrong())?;
    if n_fields == 0 {
        return Ok(Structs {
            fields,
            elements: Vec::new(),
        });
    }
    let all: Vec<i32> = sizes.iter().copied().chain([n_fields]).collect();
    let mut values = cells(rest, &all, depth, budget)?.into_iter();
    let mut elements = Vec::new();
    while values.len() > 0 {
        elements.push(values.by_ref().take(fields.len()).collect());
    }
    Ok(Structs { fields, elements })
}

fn product(sizes: &[i32]) -> Option<usize> {
    sizes.iter().try_fold(1_usize, |product, &size| {
        product.checked_mul(usize::try_from(size).ok()?)
    })
}

fn expect_type(
    what: &'static str,
    got: u32,
    accepted: &[u32],
    expected: &'static str,
) -> Result<(), ContainerError> {
    if accepted.contains(&got) {
        Ok(())
    } else {
        Err(ContainerError::Type {
            what,
            got,
            expected,
        })
    }
}

/// Bytes that remain to be read.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n_bytes: usize, what: &'static str) -> Result<&'a [u8], ContainerError> {
        let (taken, rest) = self.0.split_at_checked(n_bytes).ok_or(ContainerError::Ended {
            what,
            got: self.0.len(),
            expected: n_bytes,
        })?;
        self.0 = rest;
        Ok(taken)
    }

    fn word(&mut self, what: &'static str) -> Result<u32, ContainerError> {
        let bytes = self.take(4, what)?;
        Ok(bytes.first_chunk().map_or(0, |&first_chunk| u32::from_le_bytes(first_chunk)))
    }

    /// Reads the next element, and returns its type and its bytes; skips the padding.
    fn element(&mut self, what: &'static str) -> Result<(u32, &'a [u8]), ContainerError> {
        let tag = self.word(what)?;
        let small = (tag >> 16) as usize;
        if small > 0 {
            let data = self.take(4, what)?;
            let data = data.get(..small).ok_or(ContainerError::Ended {
                what,
                got: 4,
                expected: small,
            })?;
            return Ok((tag & 0xffff, data));
        }
        let n_bytes = self.word(what)? as usize;
        let data = self.take(n_bytes, what)?;
        if tag != MI_COMPRESSED {
            let padding = n_bytes.wrapping_neg() % 8;
            self.take(padding.min(self.0.len()), what)?;
        }
        Ok((tag, data))
    }

    fn typed(
        &mut self,
        what: &'static str,
        accepted: &[u32],
        expected: &'static str,
    ) -> Result<&'a [u8], ContainerError> {
        let (kind, data) = self.element(what)?;
        expect_type(what, kind, accepted, expected)?;
        Ok(data)
    }
}

#[cfg(test)]
mod tests;
