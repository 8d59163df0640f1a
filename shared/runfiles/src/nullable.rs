//! Fields that may be null and may not be missing, and numbers that are null where they are not finite.

use serde::{Deserialize, Deserializer};

/// A field that may be null. Without this, serde takes a missing field for null.
pub(crate) fn nullable<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Option::deserialize(deserializer)
}

/// Numbers of which some may be null, which is how JSON writes one that is not finite: those are NaN.
pub(crate) fn numbers<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [Option<f64>; N]: Deserialize<'de>,
{
    let numbers = <[Option<f64>; N]>::deserialize(deserializer)?;
    Ok(numbers.map(|number| number.unwrap_or(f64::NAN)))
}
