//! Numbers of the type that a network takes.

use inference::Values;
use keypoints::Numbers;

/// The values of an input as numbers of the type that the network takes.
///
/// * `memory`: used again from picture to picture; not touched for [`Numbers::F32`].
pub(crate) fn as_taken<'a>(
    numbers: Numbers,
    values: &'a [f32],
    (whole, bytes): (&'a mut Vec<i32>, &'a mut Vec<u8>),
) -> Values<'a> {
    match numbers {
        Numbers::F32 => Values::F32(values),
        Numbers::I32 => {
            whole.clear();
            whole.extend(values.iter().map(|value| value.round() as i32));
            Values::I32(whole)
        }
        Numbers::U8 => {
            bytes.clear();
            bytes.extend(values.iter().map(|value| value.round() as u8));
            Values::U8(bytes)
        }
    }
}
