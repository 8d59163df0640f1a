//! Errors of C3D files.

/// Why a C3D file was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum C3dError {
    /// The file ends before required or declared data.
    #[error("the file has {got} bytes, {what} would end at byte {needed}")]
    Short {
        /// Item that is cut off.
        what: &'static str,
        /// Where it would end.
        needed: u64,
        /// Bytes of the file.
        got: u64,
    },
    /// The second byte is not the mark of the format.
    #[error("not a C3D file: its second byte is {got:#04x}, not 0x50")]
    NotC3d {
        /// The byte.
        got: u8,
    },
    /// The processor type is not one of the three.
    #[error("processor {code} is not 84 (Intel), 85 (DEC) or 86 (MIPS)")]
    Processor {
        /// The code in the file.
        code: u8,
    },
    /// A parameter cannot be read.
    #[error("byte {at}: {what}")]
    Parameter {
        /// Where it begins.
        at: usize,
        /// Reason why the parameter is wrong.
        what: &'static str,
    },
    /// The scale is zero or not a number.
    #[error("the scale of the points is {value}")]
    Scale {
        /// The scale.
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
