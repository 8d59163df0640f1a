//! Conversion of input values to the network's number type.

use inference::Values;
use keypoints::Numbers;

/// Converts the values of an input to the number type of the network.
///
/// * `memory`: reused from picture to picture; not used for [`Numbers::F32`].
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
