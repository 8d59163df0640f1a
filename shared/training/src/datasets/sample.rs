//! One person with the pixels of the image, and augmentation by rotation and mirroring.

use footage::{Affine, Fill, FootageError, Size, Warp, WarpError};

use crate::datasets::{Person, Picture};

/// One annotated person with the image.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The image.
    pub image: Picture,
    /// The joints, `[x, y]` in pixels of the image, with the centre of the top-left pixel at `(0, 0)`.
    pub joints: Vec<[f64; 2]>,
}

impl Sample {
    /// Decodes the image of a person.
    ///
    /// # Errors
    ///
    /// Fails with [`FootageError`], which names the file.
    pub fn read(person: &Person) -> Result<Self, FootageError> {
        Ok(Self {
            image: Picture::read(&person.image)?,
            joints: person.joints.clone(),
        })
    }

    /// The mirror image: `x` becomes `width - 1 - x`, and left and right joints are swapped.
    ///
    /// * `joint_mirror`: for every joint, the joint on the other side, see
    ///   [`SkeletonTable::joint_mirror`](crate::datasets::SkeletonTable::joint_mirror).
    ///
    /// # Panics
    ///
    /// Panics if `joint_mirror` does not have one entry per joint, or has an index out of range.
    #[must_use]
    pub fn mirrored(&self, joint_mirror: &[usize]) -> Self {
        assert_eq!(
            joint_mirror.len(),
            self.joints.len(),
            "the mirror must have one entry for each joint"
        );
        let mut image = self.image.clone();
        let size = image.size();
        for row in image.rgb_mut().chunks_exact_mut(3 * size.width.max(1)) {
            row.as_chunks_mut::<3>().0.reverse();
        }
        let last = size.width as f64 - 1.0;
        let joints = joint_mirror
            .iter()
            .map(|&joint_mirror| {
                [
                    last - self.joints[joint_mirror][0],
                    self.joints[joint_mirror][1],
                ]
            })
            .collect();
        Self { image, joints }
    }

    /// Rotates the sample about the centre of the image, anticlockwise as seen (like MATLAB's `imrotate`).
    ///
    /// The canvas is enlarged so that no pixel is lost: `width |cos| + height |sin|`, rounded up. Pixels are
    /// bilinear samples of the source, which is centred on the canvas. The joints are rotated by
    /// the same map. `Fill::Black` fills the corners as `imrotate` does. `Fill::Replicate` makes no
    /// edges there that a detector could learn.
    ///
    /// # Errors
    ///
    /// Fails with [`WarpError`] if the image has no pixels or the angle is not a number.
    pub fn rotated(&self, degrees: f64, fill: Fill) -> Result<Self, WarpError> {
        let source = self.image.size();
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Removes the rounding error of a sine or cosine of 0, so that rotations by multiples of 90 degrees are exact.
        let [sin, cos] = [sin, cos].map(|value| if value.abs() < 1e-12 { 0.0 } else { value });
        let [width, height] = [source.width, source.height].map(|value| value as f64);
        let grown = |value: f64| (value - 1e-6).ceil().max(1.0) as usize;
        let output = Size::new(
            grown(width * cos.abs() + height * sin.abs()),
            grown(width * sin.abs() + height * cos.abs()),
        );
        let centre = |value: usize| (value as f64 - 1.0) / 2.0;
        let from = [centre(source.width), centre(source.height)];
        let to = [centre(output.width), centre(output.height)];
        // The rows point down, so (cos, -sin; sin, cos) rotates a point of the output clockwise. That is the inverse rotation.
        let source_from_output: Affine = [
            [cos, -sin, from[0] - cos * to[0] + sin * to[1]],
            [sin, cos, from[1] - sin * to[0] - cos * to[1]],
        ];
        let mut rgb = vec![0; output.rgb_bytes()];
        Warp::new(source, output, &source_from_output, fill)?.apply(self.image.rgb(), &mut rgb);
        let mut image = Picture::filled(output, [0; 3]);
        image.rgb_mut().copy_from_slice(&rgb);
        let turned = |joint: &[f64; 2]| {
            let [x, y] = [joint[0] - from[0], joint[1] - from[1]];
            [to[0] + cos * x + sin * y, to[1] - sin * x + cos * y]
        };
        Ok(Self {
            image,
            joints: self.joints.iter().map(turned).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MIRROR: [usize; 3] = [1, 0, 2];

    /// A grey image with a round dot at the last joint. The dot is smooth, so that sampling does not move it.
    fn sample_with_dot(size: Size, joint: [usize; 2]) -> Sample {
        let mut image = Picture::filled(size, [64; 3]);
        for (at, pixel) in image.rgb_mut().as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let [x, y] = [at % size.width, at / size.width];
            let squared = x.abs_diff(joint[0]).pow(2) + y.abs_diff(joint[1]).pow(2);
            *pixel = [64 + (190.0 * (squared as f64 / -4.5).exp()).round() as u8; 3];
        }
        Sample {
            image,
            joints: vec![[3.25, 4.5], [7.0, 1.0], joint.map(|joint| joint as f64)],
        }
    }

    /// Centre of the dot.
    fn dot(sample: &Sample) -> [f64; 2] {
        let width = sample.image.size().width;
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        for (at, pixel) in sample.image.rgb().as_chunks::<3>().0.iter().enumerate() {
            let weight = f64::from(pixel[0].saturating_sub(64));
            sum[0] += weight * (at % width) as f64;
            sum[1] += weight * (at / width) as f64;
            weights += weight;
        }
        sum.map(|sum| sum / weights)
    }

    /// Distance of the dot from the last joint.
    fn error(sample: &Sample) -> f64 {
        let ([x, y], [u, v]) = (dot(sample), sample.joints[2]);
        (x - u).hypot(y - v)
    }

    #[test]
    fn the_mirror_image_swaps_left_and_right() {
        let sample = sample_with_dot(Size::new(30, 20), [8, 10]);
        let mirrored = sample.mirrored(&MIRROR);
        assert_eq!(
            mirrored.joints,
            [[22.0, 1.0], [25.75, 4.5], [21.0, 10.0]],
            "29 - x, the first two exchanged"
        );
    }

    #[test]
    fn a_quarter_turn_is_anticlockwise_and_exact() {
        let sample = sample_with_dot(Size::new(30, 20), [8, 10]);
        let turned = sample.rotated(90.0, Fill::Black).unwrap();
        assert_eq!(turned.image.size(), Size::new(20, 30));
        assert_eq!(turned.joints[2], [10.0, 21.0]);
        assert_eq!(error(&turned), 0.0);
        let back = turned.rotated(-90.0, Fill::Black).unwrap();
        assert_eq!(back, sample);
    }

    #[test]
    fn a_rotation_by_0_or_360_degrees_changes_nothing() {
        let sample = sample_with_dot(Size::new(31, 20), [8, 10]);
        assert_eq!(sample.rotated(0.0, Fill::Replicate).unwrap(), sample);
        assert_eq!(sample.rotated(360.0, Fill::Replicate).unwrap(), sample);
    }

    #[test]
    fn an_angle_of_nan_is_refused() {
        let sample = sample_with_dot(Size::new(31, 20), [8, 10]);
        assert!(matches!(
            sample.rotated(f64::NAN, Fill::Black).unwrap_err(),
            WarpError::BadMap { .. }
        ));
    }

    #[test]
    fn a_replicated_border_has_no_black_corners() {
        let sample = sample_with_dot(Size::new(40, 30), [20, 15]);
        let turned = sample.rotated(30.0, Fill::Replicate).unwrap();
        assert!(turned.image.rgb().iter().all(|&value| value >= 63));
        let turned = sample.rotated(30.0, Fill::Black).unwrap();
        assert_eq!(turned.image.rgb()[0], 0);
    }

    proptest! {
        #[test]
        fn joints_move_with_the_pixels(
            width in 30_usize..60, height in 30_usize..60,
            x in 0.0..1.0, y in 0.0..1.0, degrees in -180.0..180.0,
        ) {
            let joint = [
                7 + (x * (width - 15) as f64) as usize,
                7 + (y * (height - 15) as f64) as usize,
            ];
            let sample = sample_with_dot(Size::new(width, height), joint);
            prop_assert!(error(&sample.mirrored(&MIRROR)) < 1e-9);
            let turned = sample.rotated(degrees, Fill::Replicate).unwrap();
            prop_assert!(error(&turned) < 0.05, "{} px", error(&turned));
            let both = turned.mirrored(&MIRROR);
            prop_assert!(error(&both) < 0.05);
        }

        #[test]
        fn mirroring_twice_is_the_identity(width in 1_usize..9, height in 1_usize..9, seed: u64) {
            let size = Size::new(width, height);
            let bytes = (0..size.rgb_bytes() as u64).map(|i| (i.wrapping_mul(seed) >> 7) as u8);
            let sample = Sample {
                image: Picture::new(size, bytes.collect()).unwrap(),
                joints: vec![[0.5, 1.0], [2.0, 3.0], [4.0, 5.0]],
            };
            prop_assert_eq!(sample.mirrored(&MIRROR).mirrored(&MIRROR), sample);
        }

        #[test]
        fn rotation_keeps_distances_and_all_corners(degrees in -400.0..400.0) {
            let sample = sample_with_dot(Size::new(33, 21), [8, 10]);
            let turned = sample.rotated(degrees, Fill::Black).unwrap();
            let distance = |sample: &Sample| {
                let [a, b] = [sample.joints[0], sample.joints[2]];
                (a[0] - b[0]).hypot(a[1] - b[1])
            };
            prop_assert!((distance(&turned) - distance(&sample)).abs() < 1e-9);
            let corners = Sample {
                image: sample.image,
                joints: vec![[0.0, 0.0], [32.0, 0.0], [0.0, 20.0], [32.0, 20.0]],
            };
            let turned = corners.rotated(degrees, Fill::Black).unwrap();
            let size = turned.image.size();
            for [x, y] in turned.joints {
                prop_assert!((-0.5..=size.width as f64 - 0.5).contains(&x));
                prop_assert!((-0.5..=size.height as f64 - 0.5).contains(&y));
            }
        }
    }
}
