//! Settings that all trainings have in common.

use serde::{Deserialize, Serialize};

/// Library that computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// Rust: nothing has to be installed.
    #[default]
    BuiltIn,
    /// `LibTorch`, on the processor.
    #[cfg(feature = "libtorch")]
    #[serde(rename = "libtorch")]
    LibTorch,
}

/// The numbers of the maps between layers. Weights, and what is learned of them, are single precision always.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Half as many bits, on `LibTorch` alone: faster where the processor has instructions for it (`avx512_bf16`), much slower
    /// elsewhere.
    Bf16,
}

/// A setting that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{setting} is {got}, expected {expected}")]
pub struct SettingsError {
    /// Its name.
    pub setting: &'static str,
    /// Its value.
    pub got: String,
    /// Accepted values.
    pub expected: String,
}

/// A setting that is a number, and the largest that is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounded<T> {
    pub(crate) setting: &'static str,
    pub(crate) value: T,
    pub(crate) most: T,
}

/// A setting from 0 up.
pub(crate) fn from_zero(setting: &'static str, value: f32, most: f32) -> Bounded<f32> {
    Bounded {
        setting,
        value,
        most,
    }
}

/// A count from 1 up.
pub(crate) fn count(setting: &'static str, value: usize, most: usize) -> Bounded<usize> {
    Bounded {
        setting,
        value,
        most,
    }
}

/// Checks that settings are 0 or more, and counts 1 or more, and none more than its most.
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
