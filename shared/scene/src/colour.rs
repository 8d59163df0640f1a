//! Colours: computed as linear light, and converted to sRGB for output.

use nalgebra::Vector3;

/// Red, green and blue as linear light.
pub(crate) type Linear = Vector3<f32>;

/// Converts an sRGB colour `[r, g, b]`, 0 to 255, to linear light.
pub(crate) fn srgb(bytes: [u8; 3]) -> Linear {
    Vector3::from(bytes.map(|byte| {
        let share = f32::from(byte) / 255.0;
        if share <= 0.04045 {
            share / 12.92
        } else {
            ((share + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Table that converts linear light to sRGB bytes, with an error of at most one grey level (checked by a test).
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    table: Vec<u8>,
}

/// Number of entries of the table. The index is the square root of the light, so that dark values get more entries.
const N_ENTRIES: usize = 4096;

impl Curve {
    pub(crate) fn new() -> Self {
        let byte = |entry: usize| {
            let root = (entry as f32 + 0.5) / N_ENTRIES as f32;
            (255.0 * written(root * root) + 0.5) as u8
        };
        Self {
            table: (0..N_ENTRIES).map(byte).collect(),
        }
    }

    pub(crate) fn bytes(&self, colour: &Linear) -> [u8; 3] {
        let byte = |share: f32| {
            let entry = (share.max(0.0).sqrt() * N_ENTRIES as f32) as usize;
            self.table[entry.min(N_ENTRIES - 1)]
        };
        [byte(colour.x), byte(colour.y), byte(colour.z)]
    }
}

/// Returns the sRGB transfer curve (IEC 61966-2-1), from and to 0..1.
pub(crate) fn written(share: f32) -> f32 {
    if share <= 0.003_130_8 {
        12.92 * share
    } else {
        1.055 * share.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn converting_to_linear_light_and_back_gives_the_same_byte() {
        let curve = Curve::new();
        for byte in 0..=255 {
            let [got, ..] = curve.bytes(&srgb([byte; 3]));
            assert!(got.abs_diff(byte) <= 1, "{byte} became {got}");
        }
        assert_eq!(curve.bytes(&Linear::new(-1.0, 7.0, f32::NAN)), [0, 255, 0]);
    }
}
