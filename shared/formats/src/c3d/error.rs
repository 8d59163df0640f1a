//! Errors of C3D files.

/// Reason why a C3D file was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum C3dError {
    /// The file ends before data that is required or declared.
    #[error("the file has {got} bytes, but {what} would end at byte {needed}")]
    Short {
        /// Name of the item that is cut off.
        what: &'static str,
        /// Position in the file at which the item would end, in bytes.
        needed: u64,
        /// Number of bytes in the file.
        got: u64,
    },
    /// The second byte is not the mark of the format.
    #[error("the file is not a C3D file: the second byte is {got:#04x}, expected 0x50")]
    NotC3d {
        /// Value of the second byte.
        got: u8,
    },
    /// The processor type is not one of the three known types.
    #[error("processor {code} is not 84 (Intel), 85 (DEC) or 86 (MIPS)")]
    Processor {
        /// The code in the file.
        code: u8,
    },
    /// A parameter cannot be read.
    #[error("byte {at}: {what}")]
    Parameter {
        /// Position at which the parameter begins.
        at: usize,
        /// Reason why the parameter is wrong.
        what: &'static str,
    },
    /// The scale is zero or NaN.
    #[error("the scale of the points is {value}, expected a number other than 0")]
    Scale {
        /// Value of the scale.
        value: f64,
    },
    /// The last frame is before the first.
    #[error("the range of frames {first} to {last} is empty")]
    Frames {
        /// Number of the first frame.
        first: u32,
        /// Number of the last frame.
        last: u32,
    },
}
