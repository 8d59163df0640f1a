//! Flaws of cameras: noise, blur, exposure, clock offsets, dropped frames, calibration errors. All are 0 by default.

use footage::Size;
use geometry::{Camera, Rig, RigError};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::colour::srgb;
use crate::random::Random;

/// The flaws of the cameras.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flaws {
    /// Standard deviation of the noise of every value of a pixel, in grey levels.
    pub noise: f64,
    /// Standard deviation of the Gaussian blur, in pixels.
    pub blur_px: f64,
    /// Exposure in stops (doublings of the light); negative is darker.
    pub exposure_stops: f64,
    /// Maximum clock offset of a camera in either direction, in seconds; the first camera has no offset.
    pub desync_s: f64,
    /// Probability that a camera drops a frame.
    pub drop: f64,
    /// Angle by which every camera is rotated in the rig file that is written, about a random axis, in degrees.
    pub calibration_degrees: f64,
    /// Distance by which every camera is moved in the rig file that is written, in a random direction, in millimetres.
    pub calibration_mm: f64,
}

/// The error for a flaw that is out of range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {got}, expected {low} to {high}")]
pub struct FlawError {
    /// Name of the flaw.
    pub what: &'static str,
    /// The given value.
    pub got: f64,
    /// Minimum accepted value.
    pub low: f64,
    /// Maximum accepted value.
    pub high: f64,
}

impl Flaws {
    /// Names of the flaws as used in settings, in the order of the fields.
    pub const NAMES: [&'static str; 7] = [
        "noise",
        "blur",
        "exposure",
        "desync",
        "drop",
        "calibration-degrees",
        "calibration-mm",
    ];

    /// Returns the flaw with that name.
    pub fn by_name_mut(&mut self, name: &str) -> Option<&mut f64> {
        let all = [
            &mut self.noise,
            &mut self.blur_px,
            &mut self.exposure_stops,
            &mut self.desync_s,
            &mut self.drop,
            &mut self.calibration_degrees,
            &mut self.calibration_mm,
        ];
        Self::NAMES.iter().zip(all).find(|flaw| *flaw.0 == name).map(|flaw| flaw.1)
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// [`FlawError`] for the first value out of range.
    pub fn check(mut self) -> Result<(), FlawError> {
        let limits = [
            (0.0, 128.0),
            (0.0, 20.0),
            (-8.0, 8.0),
            (0.0, 10.0),
            (0.0, 0.95),
            (0.0, 45.0),
            (0.0, 2000.0),
        ];
        for (what, (low, high)) in Self::NAMES.into_iter().zip(limits) {
            let got = self.by_name_mut(what).map_or(0.0, |value| *value);
            if !(low..=high).contains(&got) {
                return Err(FlawError {
                    what,
                    got,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }

    /// Returns true if a camera's frame is dropped. The first frame is never dropped.
    pub(crate) fn drops(&self, random: Random, camera: usize, frame: u64) -> bool {
        frame > 0 && random.fork("drop").nth(camera as u64).nth(frame).chance(self.drop)
    }

    /// Returns the clock offset of a camera, in seconds.
    pub(crate) fn late_s(&self, random: Random, camera: usize) -> f64 {
        if camera == 0 {
            return 0.0;
        }
        self.desync_s * random.fork("desync").nth(camera as u64).range(-1.0, 1.0)
    }

    /// Applies the calibration error to the rig that is written.
    pub(crate) fn written(&self, rig: &Rig, random: Random) -> Result<Rig, RigError> {
        let wrong = |(nth, camera): (usize, &Camera)| {
            let mut random = random.fork("calibration").nth(nth as u64);
            let mut direction = || {
                let vector = Vector3::from_fn(|_, _| random.normal());
                vector.try_normalize(1e-6).unwrap_or(Vector3::x())
            };
            let turn = UnitQuaternion::new(direction() * self.calibration_degrees.to_radians());
            let step = direction() * (self.calibration_mm * 1e-3);
            let off = Isometry3::from_parts(Translation3::from(step), turn);
            Camera {
                camera_from_world: off * camera.camera_from_world,
                ..camera.clone()
            }
        };
        let is_right = self.calibration_degrees == 0.0 && self.calibration_mm == 0.0;
        if is_right {
            return Ok(rig.clone());
        }
        let cameras = rig.cameras().iter().enumerate().map(wrong).collect();
        Rig::new(cameras, rig.up_in_world(), rig.source())
    }

    /// Applies the flaws to a picture: exposure, then blur, then noise.
    pub(crate) fn degrade(&self, random: Random, size: Size, rgb: &mut [u8]) {
        if self.exposure_stops != 0.0 {
            expose(self.exposure_stops.exp2() as f32, rgb);
        }
        if self.blur_px > 0.0 {
            blur(self.blur_px as f32, size, rgb);
        }
        if self.noise > 0.0 {
            let mut random = random.fork("noise");
            for value in rgb {
                // The sum of four bytes, scaled to mean 0 and standard deviation 1.
                let bits = random.bits().to_le_bytes();
                let sum: i32 = bits[..4].iter().map(|bit| i32::from(*bit)).sum();
                let deviate = (f64::from(sum) - 510.0) / 147.8;
                *value = (f64::from(*value) + self.noise * deviate).round().clamp(0.0, 255.0) as u8;
            }
        }
    }
}

fn expose(gain: f32, rgb: &mut [u8]) {
    let curve: [u8; 256] = core::array::from_fn(|i| {
        let light = srgb([i as u8; 3]).x * gain;
        (255.0 * crate::colour::written(light.min(1.0)) + 0.5) as u8
    });
    for value in rgb {
        *value = curve[usize::from(*value)];
    }
}

/// A Gaussian blur over rows, then over columns; border pixels are repeated.
fn blur(deviation: f32, size: Size, rgb: &mut [u8]) {
    let reach = (3.0 * deviation).ceil() as usize;
    let weights: Vec<f32> = (0..=2 * reach)
        .map(|i| (-0.5 * ((i as f32 - reach as f32) / deviation).powi(2)).exp())
        .collect();
    let sum: f32 = weights.iter().sum();
    let Size { width, height } = size;
    let mut pass = |n: usize, step: usize, start: usize| {
        let line: Vec<f32> = (0..n).map(|i| f32::from(rgb[start + i * step])).collect();
        for at in 0..n {
            let value: f32 = weights
                .iter()
                .enumerate()
                .map(|(tap, weight)| weight * line[(at + tap).saturating_sub(reach).min(n - 1)])
                .sum();
            rgb[start + at * step] = (value / sum + 0.5) as u8;
        }
    };
    for row in 0..height {
        (0..3).for_each(|i| pass(width, 3, 3 * row * width + i));
    }
    for column in 0..width {
        (0..3).for_each(|i| pass(height, 3 * width, 3 * column + i));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size::new(40, 30);

    fn degraded(flaws: Flaws) -> Vec<u8> {
        let mut rgb: Vec<u8> = (0..SIZE.rgb_bytes()).map(|i| (i / 3 % 40 * 6) as u8).collect();
        flaws.degrade(Random::new(1), SIZE, &mut rgb);
        rgb
    }

    #[test]
    fn every_flaw_has_the_requested_size_and_without_flaws_nothing_changes() {
        let plain = degraded(Flaws::default());
        let mean =
            |rgb: &[u8]| rgb.iter().map(|rgb| f64::from(*rgb)).sum::<f64>() / rgb.len() as f64;
        let noisy = degraded(Flaws {
            noise: 5.0,
            ..Flaws::default()
        });
        let off = plain.iter().zip(&noisy).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        let deviation = (off.sum::<f64>() / plain.len() as f64).sqrt();
        assert!((deviation - 5.0).abs() < 0.5, "{deviation}");
        assert!((mean(&noisy) - mean(&plain)).abs() < 0.7);
        let bright = degraded(Flaws {
            exposure_stops: 1.0,
            ..Flaws::default()
        });
        let dark = degraded(Flaws {
            exposure_stops: -1.0,
            ..Flaws::default()
        });
        assert!(mean(&bright) > mean(&plain) + 15.0 && mean(&dark) < mean(&plain) - 15.0);
        let soft = degraded(Flaws {
            blur_px: 2.0,
            ..Flaws::default()
        });
        assert!((mean(&soft) - mean(&plain)).abs() < 1.0);
        assert_eq!(
            soft[3 * (15 * 40 + 20)],
            plain[3 * (15 * 40 + 20)],
            "a ramp stays a ramp"
        );
        assert_ne!(soft, plain, "but not at its border");
    }

    #[test]
    fn the_calibration_error_has_the_requested_size() {
        let rig = crate::rigs::humaneva().unwrap();
        let flaws = Flaws {
            calibration_degrees: 2.0,
            calibration_mm: 30.0,
            ..Flaws::default()
        };
        let written = flaws.written(&rig, Random::new(5)).unwrap();
        for (a, b) in rig.cameras().iter().zip(written.cameras()) {
            let off = b.camera_from_world * a.camera_from_world.inverse();
            assert!((off.rotation.angle().to_degrees() - 2.0).abs() < 1e-9);
            assert!((off.translation.vector.norm() - 0.03).abs() < 1e-9);
        }
        assert_eq!(Flaws::default().written(&rig, Random::new(5)).unwrap(), rig);
    }

    #[test]
    fn frames_are_dropped_with_the_requested_probability_but_never_the_first() {
        let flaws = Flaws {
            drop: 0.2,
            ..Flaws::default()
        };
        let n = (0..2000).filter(|i| flaws.drops(Random::new(3), 1, *i)).count();
        assert!((330..470).contains(&n), "{n}");
        assert!(!(0..50).any(|seed| flaws.drops(Random::new(seed), 1, 0)));
    }

    #[test]
    fn flaws_out_of_range_are_refused_by_name() {
        assert_eq!(Flaws::default().check(), Ok(()));
        for name in Flaws::NAMES {
            for wrong in [f64::NAN, 1e9, -9.0] {
                let mut flaws = Flaws::default();
                *flaws.by_name_mut(name).unwrap() = wrong;
                assert_eq!(flaws.check().unwrap_err().what, name);
            }
        }
    }
}
