//! Fields that may be null but not missing, and numbers that are null if they are not finite.

use serde::{Deserialize, Deserializer};

/// Reads a field that may be null. Without this function, serde treats a missing field as null.
pub(crate) fn nullable<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Option::deserialize(deserializer)
}

/// Reads numbers, some of which may be null. JSON writes numbers that are not finite as null, so they become NaN.
pub(crate) fn numbers<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [Option<f64>; N]: Deserialize<'de>,
{
    let numbers = <[Option<f64>; N]>::deserialize(deserializer)?;
    Ok(numbers.map(|number| number.unwrap_or(f64::NAN)))
}
