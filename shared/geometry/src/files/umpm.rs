//! `.ini` files of UMPM (not in INI syntax): 19 numbers on 6 lines for one camera, in millimetres.
//!
//! The numbers are three rows of K, then k1 k2 p1 p2, then the Rodrigues vector and the translation, both world to camera. Line breaks do
//! not matter. The file has neither the name of its camera nor the image size, which is 644x486 unless [`ReadOptions::size`] gives another
//! size.

use super::{ParseError, ReadOptions, Unit, UnwritableRig, numbers};
use crate::{Camera, LensModel, Rig};

/// Image size of the data set.
const SIZE: [u32; 2] = [644, 486];

/// Reads a camera and gives it the name `name`.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(name: &str, text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    let numbers = numbers::blank_separated(text)?;
    let Some((k, &[k1, k2, p1, p2, rx, ry, rz, tx, ty, tz])) = numbers.split_first_chunk::<9>()
    else {
        return Err(ParseError::Shape {
            field: "the file".to_owned(),
            expected: "19 numbers: K (9), distortion (4), rotation (3), translation (3)",
            found: format!("{} numbers", numbers.len()),
        });
    };
    let lens = numbers::lens("distortion", &[k1, k2, p1, p2], false)?;
    let size = options.size.unwrap_or(SIZE);
    let intrinsics = numbers::intrinsics("K", &numbers::matrix_of_nine(k), size, lens)?;
    let rotation = numbers::rodrigues("rotation", [rx, ry, rz])?;
    let unit = options.unit.unwrap_or(Unit::Millimetres);
    let camera_from_world = numbers::pose("translation", rotation, [tx, ty, tz], unit)?;
    let camera = Camera {
        name: name.to_owned(),
        intrinsics,
        camera_from_world,
    };
    Rig::new(vec![camera], options.up, "").map_err(ParseError::Rig)
}

/// Writes a camera, in millimetres. Its name, the image size and the up direction are lost.
///
/// # Errors
///
/// Fails with [`UnwritableRig::Lens`] for any lens with coefficients other than k1 k2 p1 p2.
pub fn write(camera: &Camera) -> Result<String, UnwritableRig> {
    let intrinsics = &camera.intrinsics;
    let distortion = match *intrinsics.lens.model() {
        LensModel::Pinhole => [0.0; 4],
        LensModel::BrownConrady {
            k: [k1, k2, 0.0, 0.0, 0.0, 0.0],
            p: [p1, p2],
        } => [k1, k2, p1, p2],
        ref lens => {
            let (camera, lens) = (camera.name.clone(), lens.to_string());
            return Err(UnwritableRig::Lens {
                camera,
                format: "UMPM",
                lens,
            });
        }
    };
    let pose = &camera.camera_from_world;
    let mut lines: Vec<Vec<f64>> =
        numbers::rows(&intrinsics.matrix()).map(|row| row.to_vec()).into();
    lines.push(distortion.to_vec());
    lines.push(pose.rotation.scaled_axis().iter().copied().collect());
    lines.push(
        (pose.translation.vector * Unit::Millimetres.per_metre())
            .iter()
            .copied()
            .collect(),
    );
    Ok(lines.iter().map(|line| numbers::joined(line, " ") + "\n").collect())
}
