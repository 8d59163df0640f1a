//! Mapping from the frames of a source to the frames of the pipeline.

use nalgebra::{Matrix2, Point3, Rotation2, UnitQuaternion, Vector2, Vector3};

use crate::{Camera, Lens, Rig};

/// Maximum width and height of the output, in pixels.
const LARGEST: f64 = 32768.0;

/// Size of the output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutSize {
    /// An exact width and height, in pixels. The whole calibrated image is fitted in the centre with its aspect ratio; the rest is padding.
    Exact([u32; 2]),
    /// A factor on the calibrated size. The result is rounded to whole pixels, which crops or pads less than a pixel.
    Scale(f64),
}

/// Reason why a source cannot be framed for a camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FramingError {
    /// The source does not have the size for which the camera was calibrated.
    #[error("the source is {}x{} px, but the camera is calibrated for {}x{} px", .source_size[0], .source_size[1], .calibrated[0], .calibrated[1])]
    SourceSize {
        /// Width and height of the source's frames.
        source_size: [u32; 2],
        /// Width and height of the calibrated image.
        calibrated: [u32; 2],
    },
    /// The source, placed at its offset in the calibrated image, extends beyond this image.
    #[error("a source of {}x{} px at offset ({}, {}) extends beyond the {}x{} px for which the camera is calibrated", .source_size[0], .source_size[1], .offset_px[0], .offset_px[1], .calibrated[0], .calibrated[1])]
    SourceOffset {
        /// Width and height of the source's frames.
        source_size: [u32; 2],
        /// Position of the source's top-left pixel in the calibrated image.
        offset_px: [u32; 2],
        /// Width and height of the calibrated image.
        calibrated: [u32; 2],
    },
    /// The output would have no pixels, or far too many.
    #[error("the output is {width} x {height} px, but each side must be 1 to {LARGEST} px")]
    OutSize {
        /// Requested width, before rounding.
        width: f64,
        /// Requested height, before rounding.
        height: f64,
    },
    /// The roll is not a finite number.
    #[error("the roll is {roll} rad, but must be a finite number")]
    Roll {
        /// Roll angle, in radians.
        roll: f64,
    },
}

/// Mapping from a source's frame to the pipeline's frame: rotation, resizing, cropping and padding.
///
/// Without roll, the calibrated image is scaled uniformly. Pixel edges are mapped to pixel edges, so `u_out = (u + 0.5) s - 0.5` if the
/// sizes are divisible. With roll, the image also rotates about its principal point, and different focal lengths become equal: `f_out = s
/// √(fx fy)`. In both cases, [`camera`](Self::camera) describes the warped picture exactly, including the lens. The caller must fill output
/// pixels that are outside the source.
#[derive(Debug, Clone, PartialEq)]
pub struct Framing {
    camera: Camera,
    source_from_output: [[f64; 3]; 2],
    roll: f64,
}

impl Framing {
    /// Computes the mapping.
    ///
    /// * `source_size`: width and height of the source's frames, in pixels.
    /// * `source_offset_px`: position of the source's top-left pixel in the calibrated image, for a source that is a part of this image. If
    ///   it is `None`, the sizes must be equal.
    /// * `roll`: angle by which the picture is rotated clockwise, in radians; see [`upright_roll`].
    ///
    /// # Errors
    ///
    /// Returns a [`FramingError`] if an argument is invalid. A source whose size differs from the calibrated size is an error, unless an
    /// offset is given.
    pub fn new(
        camera: &Camera,
        source_size: [u32; 2],
        source_offset_px: Option<[u32; 2]>,
        out_size: OutSize,
        roll: f64,
    ) -> Result<Self, FramingError> {
        let offset = source_offset(camera.intrinsics.size, source_size, source_offset_px)?;
        if !roll.is_finite() {
            return Err(FramingError::Roll { roll });
        }
        let intrinsics = &camera.intrinsics;
        let (size, scale) = output(intrinsics.size, out_size)?;
        let full = Vector2::from(intrinsics.size.map(f64::from));
        let out = Vector2::from(size.map(f64::from));
        let half = Vector2::repeat(0.5);
        let centre = Vector2::new(intrinsics.cx, intrinsics.cy);
        let out_centre = (centre + half - full / 2.0) * scale + out / 2.0 - half;

        let (focal, linear, constant);
        if roll == 0.0 {
            focal = Vector2::new(intrinsics.fx, intrinsics.fy) * scale;
            linear = Matrix2::from_diagonal_element(1.0 / scale);
            // This form does not contain the principal point, so that a plain copy is exactly the identity.
            constant = (half - out / 2.0) / scale + full / 2.0 - half;
        } else {
            focal = Vector2::repeat((intrinsics.fx * intrinsics.fy).sqrt() * scale);
            let calibrated_focal =
                Matrix2::from_diagonal(&Vector2::new(intrinsics.fx, intrinsics.fy));
            linear = calibrated_focal * Rotation2::new(-roll).matrix() / focal.x;
            constant = centre - linear * out_centre;
        }
        let constant = constant - offset;

        let mut framed = camera.clone();
        framed.intrinsics.size = size;
        [framed.intrinsics.fx, framed.intrinsics.fy] = focal.into();
        [framed.intrinsics.cx, framed.intrinsics.cy] = out_centre.into();
        if roll != 0.0 {
            framed.intrinsics.lens = Lens::new(intrinsics.lens.model().rotated(roll));
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
            framed.camera_from_world = turn * camera.camera_from_world;
        }
        let row = |r: usize| [linear[(r, 0)], linear[(r, 1)], constant[r]];
        Ok(Self {
            camera: framed,
            source_from_output: [row(0), row(1)],
            roll,
        })
    }

    /// Returns the map from an output pixel (u, v) to the source: `m[0][0] u + m[0][1] v + m[0][2]` is the column, and `m[1]` gives the
    /// row. Both are counted from the centre of the top-left pixel.
    pub fn source_from_output(&self) -> [[f64; 3]; 2] {
        self.source_from_output
    }

    /// Returns the map from a source pixel to the output; the inverse of [`Self::source_from_output`].
    pub fn output_from_source(&self) -> [[f64; 3]; 2] {
        let [[a, b, c], [d, e, f]] = self.source_from_output;
        // The matrix is a rotation with a scale other than 0.
        let determinant = a * e - b * d;
        let [[a, b], [d, e]] = [
            [e / determinant, -b / determinant],
            [-d / determinant, a / determinant],
        ];
        [[a, b, -(a * c + b * f)], [d, e, -(d * c + e * f)]]
    }

    /// Returns the camera of the output image, with the output's size.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the width and height of the output, in pixels.
    pub fn out_size(&self) -> [u32; 2] {
        self.camera.intrinsics.size
    }

    /// Returns the angle by which the picture is rotated clockwise, in radians.
    pub fn roll(&self) -> f64 {
        self.roll
    }
}

fn source_offset(
    calibrated: [u32; 2],
    source_size: [u32; 2],
    offset: Option<[u32; 2]>,
) -> Result<Vector2<f64>, FramingError> {
    let Some(offset_px) = offset else {
        if source_size == calibrated {
            return Ok(Vector2::zeros());
        }
        return Err(FramingError::SourceSize {
            source_size,
            calibrated,
        });
    };
    let ends = [0, 1].map(|i| u64::from(source_size[i]) + u64::from(offset_px[i]));
    if source_size.contains(&0) || (0..2).any(|i| ends[i] > u64::from(calibrated[i])) {
        return Err(FramingError::SourceOffset {
            source_size,
            offset_px,
            calibrated,
        });
    }
    Ok(Vector2::from(offset_px.map(f64::from)))
}

/// Returns the size and scale of the output.
fn output(calibrated: [u32; 2], wanted: OutSize) -> Result<([u32; 2], f64), FramingError> {
    let full = calibrated.map(f64::from);
    let [width, height] = match wanted {
        OutSize::Exact(size) => size.map(f64::from),
        OutSize::Scale(scale) => full.map(|extent| extent * scale),
    };
    let rounded = [width, height].map(f64::round);
    if !rounded.iter().all(|extent| (1.0..=LARGEST).contains(extent)) {
        return Err(FramingError::OutSize { width, height });
    }
    let scale = match wanted {
        OutSize::Exact(_) => (width / full[0]).min(height / full[1]),
        OutSize::Scale(scale) => scale,
    };
    Ok((rounded.map(|extent| extent as u32), scale))
}

/// Returns the roll with which the world's up direction points up in the picture, at the focus of the rig.
///
/// The vector from half a metre below to half a metre above the rig's focus is projected with the lens. A [`Framing`] with the returned
/// angle shows this vector as vertical. If the focus is not in view, a point on the camera's own axis is used. The angle is in radians in
/// (-π, π], clockwise.
///
/// Returns `None` if the rig has no up direction, or if the camera looks straight up or down.
pub fn upright_roll(camera: &Camera, rig: &Rig) -> Option<f64> {
    let up = rig.up_in_world()?.into_inner();
    let on_axis = camera.centre_in_world() + camera.axis_in_world().into_inner() * 4.0;
    let towards = |middle: Point3<f64>| {
        let [low, high] = [-0.5, 0.5].map(|metres| camera.project(&(middle + up * metres)));
        let intrinsics = &camera.intrinsics;
        Some(intrinsics.normalised(&high?) - intrinsics.normalised(&low?))
    };
    let direction = rig.focus().and_then(towards).or_else(|| towards(on_axis))?;
    if direction.norm() < 1e-6 {
        return None;
    }
    // The up direction of the picture is (0, -1). The result is the angle from `direction` to (0, -1).
    Some((-direction.x).atan2(-direction.y))
}

#[cfg(test)]
mod tests;
