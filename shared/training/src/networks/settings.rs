//! Settings common to all training runs.

use serde::{Deserialize, Serialize};

/// Library that computes networks and gradients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// Rust; needs no installation.
    #[default]
    BuiltIn,
    /// `LibTorch`, on the processor.
    #[cfg(feature = "libtorch")]
    #[serde(rename = "libtorch")]
    LibTorch,
}

/// Precision of the maps between layers. Weights and their gradients are always in single precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Half as many bits (bfloat16); only available with `LibTorch`. It is faster if the processor has instructions for it (`avx512_bf16`),
    /// and much slower otherwise.
    Bf16,
}

/// A setting with an invalid value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{setting} is {got}, expected {expected}")]
pub struct SettingsError {
    /// Name of the setting.
    pub setting: &'static str,
    /// Value of the setting.
    pub got: String,
    /// Accepted values.
    pub expected: String,
}

/// A numeric setting with its largest accepted value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounded<T> {
    pub(crate) setting: &'static str,
    pub(crate) value: T,
    pub(crate) most: T,
}

/// A setting of at least 0.
pub(crate) fn from_zero(setting: &'static str, value: f32, most: f32) -> Bounded<f32> {
    Bounded {
        setting,
        value,
        most,
    }
}

/// A count of at least 1.
pub(crate) fn count(setting: &'static str, value: usize, most: usize) -> Bounded<usize> {
    Bounded {
        setting,
        value,
        most,
    }
}

/// Checks that settings are at least 0, counts are at least 1, and all are within their limits.
pub(crate) fn check(
    numbers: &[Bounded<f32>],
    counts: &[Bounded<usize>],
) -> Result<(), SettingsError> {
    let refused = |setting: &'static str, got: String, expected: String| SettingsError {
        setting,
        got,
        expected,
    };
    for number in numbers {
        if !(0.0..=number.most).contains(&number.value) {
            let expected = format!("0 to {}", number.most);
            return Err(refused(number.setting, number.value.to_string(), expected));
        }
    }
    for count in counts {
        if !(1..=count.most).contains(&count.value) {
            let expected = format!("1 to {}", count.most);
            return Err(refused(count.setting, count.value.to_string(), expected));
        }
    }
    Ok(())
}
