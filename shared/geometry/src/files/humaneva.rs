//! `.cal` files of `HumanEva`: 22 numbers for one camera, in millimetres.
//!
//! The numbers are separated by blanks or line breaks, in this order: fc (2), cc (2), alpha (1), kc (5: k1 k2 p1 p2 k3), R (9, row by row,
//! world to camera), T (3, mm). Pixels are counted from the centre of the first pixel, as in Bouguet's toolbox. The file has neither the
//! name of its camera nor the image size, which is 640x480 for the colour cameras unless [`ReadOptions::size`] gives another size. The
//! world of `HumanEva` has z up; the caller must set [`ReadOptions::up`].

use super::{ParseError, ReadOptions, Unit, UnwritableRig, numbers};
use crate::{Camera, LensModel, Rig};

/// Image size of the colour cameras.
const SIZE: [u32; 2] = [640, 480];

/// Reads a camera and gives it the name `name`.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(name: &str, text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    let numbers = numbers::blank_separated(text)?;
    let &[fx, fy, cx, cy, alpha, ref rest @ ..] = numbers.as_slice() else {
        return Err(count(numbers.len()));
    };
    let (Some((kc, rest)), true) = (rest.split_first_chunk::<5>(), numbers.len() == 22) else {
        return Err(count(numbers.len()));
    };
    let Some((r, &[tx, ty, tz])) = rest.split_first_chunk::<9>() else {
        return Err(count(numbers.len()));
    };
    let k = nalgebra::Matrix3::new(fx, alpha * fx, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
    let lens = numbers::lens("kc", kc, false)?;
    let intrinsics = numbers::intrinsics(
        "fc, cc and alpha as a matrix",
        &k,
        options.size.unwrap_or(SIZE),
        lens,
    )?;
    let rotation = numbers::rotation("R", &numbers::matrix_of_nine(r))?;
    let unit = options.unit.unwrap_or(Unit::Millimetres);
    let camera_from_world = numbers::pose("T", rotation, [tx, ty, tz], unit)?;
    let camera = Camera {
        name: name.to_owned(),
        intrinsics,
        camera_from_world,
    };
    Rig::new(vec![camera], options.up, "").map_err(ParseError::Rig)
}

fn count(found: usize) -> ParseError {
    ParseError::Shape {
        field: "the file".to_owned(),
        expected: "22 numbers: fc (2), cc (2), alpha, kc (5), R (9), T (3)",
        found: format!("{found} numbers"),
    }
}

/// Writes a camera, in millimetres. Its name, the image size and the up direction are lost.
///
/// # Errors
///
/// Fails with [`UnwritableRig::Lens`] for a fisheye or a rational lens.
pub fn write(camera: &Camera) -> Result<String, UnwritableRig> {
    let intrinsics = &camera.intrinsics;
    let kc = match *intrinsics.lens.model() {
        LensModel::Pinhole => [0.0; 5],
        LensModel::BrownConrady {
            k: [k1, k2, k3, 0.0, 0.0, 0.0],
            p: [p1, p2],
        } => [k1, k2, p1, p2, k3],
        ref lens => {
            let (camera, lens) = (camera.name.clone(), lens.to_string());
            return Err(UnwritableRig::Lens {
                camera,
                format: "HumanEva",
                lens,
            });
        }
    };
    let pose = &camera.camera_from_world;
    let rotation = numbers::rows(pose.rotation.to_rotation_matrix().matrix());
    let millimetres = pose.translation.vector * Unit::Millimetres.per_metre();
    let head = [
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx,
        intrinsics.cy,
        0.0,
    ];
    let all = head.iter().chain(&kc).chain(rotation.as_flattened()).chain(millimetres.iter());
    Ok(numbers::joined(all, "\n") + "\n")
}
