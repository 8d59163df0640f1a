//! YAML storage of `OpenCV`, and the pair `intri.yml` + `extri.yml` of `EasyMocap`.
//!
//! A file with one camera has `camera_matrix`, `distortion_coefficients`, `image_width`, `image_height`, `R` (matrix or Rodrigues) and `T`.
//! The calibration program of `OpenCV` and ROS's `camera_info` leave out `R` and `T`; the camera then has a lens but no pose. Fisheye
//! lenses have `fisheye_model: 1` (`OpenCV`'s program) or `distortion_model: equidistant` (ROS).
//!
//! A file with several cameras has the form of `EasyMocap`: a list `names`, and for each name `K_n`, `dist_n`, `Rot_n` (or `R_n`,
//! Rodrigues) and `T_n`. The sizes are `W_n` and `H_n`. `EasyMocap` itself may leave them out, and [`ReadOptions::size`] must then give
//! them.
//!
//! Lengths are in metres, unless [`ReadOptions::unit`] gives another unit.

use nalgebra::UnitQuaternion;

use super::{ParseError, ReadOptions, Unit, UnwritableRig, entry::Entry as RigEntry, numbers};
use crate::{Camera, LensModel, Rig};

mod storage;

use storage::Storage;

/// Reads cameras from one or more files. Each file has a name, which is used for a camera without one.
///
/// Files in the form of `EasyMocap` are read together; every other file describes one camera.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(files: &[(&str, &str)], options: &ReadOptions) -> Result<Rig, ParseError> {
    let mut shared = Storage::default();
    let mut cameras = Vec::new();
    for (name, text) in files {
        let storage = Storage::parse(text)?;
        if storage.names().is_some() || storage.has_suffixed() {
            shared.extend(storage);
        } else {
            cameras.push(camera(name, &storage, &single(), options)?);
        }
    }
    for name in shared.camera_names()? {
        cameras.push(camera(&name, &shared, &suffixed(&name), options)?);
    }
    if cameras.is_empty() {
        return Err(ParseError::NoCameras {
            expected: "the entry camera_matrix, or the entries names and K_<name>",
        });
    }
    super::entry::rig(cameras, options.up, "", options)
}

/// Possible names of the entries of a camera.
struct Keys {
    matrix: Vec<String>,
    distortion: Vec<String>,
    fisheye: [String; 2],
    model: String,
    width: Vec<String>,
    height: Vec<String>,
    rotation: Vec<String>,
    translation: Vec<String>,
}

fn single() -> Keys {
    let keys = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    Keys {
        matrix: keys(&[
            "camera_matrix",
            "cameraMatrix",
            "Camera_Matrix",
            "K",
            "k",
            "mtx",
        ]),
        distortion: keys(&[
            "distortion_coefficients",
            "Distortion_Coefficients",
            "distCoeffs",
            "dist_coeffs",
            "dist_coeff",
            "dist",
            "D",
            "d",
        ]),
        fisheye: ["fisheye".to_owned(), "fisheye_model".to_owned()],
        model: "distortion_model".to_owned(),
        width: keys(&["image_width", "image_Width", "width"]),
        height: keys(&["image_height", "image_Height", "height"]),
        rotation: keys(&["R", "rotation", "Rot", "rvec"]),
        translation: keys(&["T", "translation", "tvec"]),
    }
}

fn suffixed(name: &str) -> Keys {
    let keys = |stems: &[&str]| stems.iter().map(|stem| format!("{stem}_{name}")).collect();
    Keys {
        matrix: keys(&["K"]),
        distortion: keys(&["dist", "D"]),
        fisheye: [format!("fisheye_{name}"), format!("fisheye_model_{name}")],
        model: format!("distortion_model_{name}"),
        width: keys(&["W"]),
        height: keys(&["H"]),
        rotation: keys(&["Rot", "R"]),
        translation: keys(&["T"]),
    }
}

fn camera(
    name: &str,
    storage: &Storage,
    keys: &Keys,
    options: &ReadOptions,
) -> Result<RigEntry, ParseError> {
    let (matrix_key, k) = storage.numbers(&keys.matrix)?;
    let k: [f64; 9] = sized(matrix_key, k, "9 numbers")?;
    let lens = match storage.find(&keys.distortion) {
        None => LensModel::Pinhole,
        Some((key, entry)) => numbers::lens(key, &entry.numbers(key)?, is_fisheye(storage, keys)?)?,
    };
    let size = size(storage, keys, options)?;
    let intrinsics = numbers::intrinsics(matrix_key, &numbers::matrix_of_nine(&k), size, lens)?;
    // The `R` of ROS's `camera_info` rectifies stereo pictures, and occurs together with `P`.
    let is_rectification = storage.find(&keys.translation).is_none()
        && ["P", "p", "projection_matrix"]
            .iter()
            .any(|key| storage.find(&[(*key).to_owned()]).is_some());
    let has_no_place = storage.find(&keys.translation).is_none()
        && (is_rectification || storage.find(&keys.rotation).is_none());
    if has_no_place {
        return Ok(RigEntry::lens(name, intrinsics));
    }
    let rotation = rotation(storage, keys)?;
    let (key, translation) = storage.numbers(&keys.translation)?;
    let translation = sized(key, translation, "3 numbers")?;
    let unit = options.unit.unwrap_or(Unit::Metres);
    let camera_from_world = numbers::pose(key, rotation, translation, unit)?;
    Ok(RigEntry::Placed(Camera {
        name: name.to_owned(),
        intrinsics,
        camera_from_world,
    }))
}

/// Returns true if the distortion is that of a fisheye lens.
///
/// # Errors
///
/// Fails if the file names an unknown model.
fn is_fisheye(storage: &Storage, keys: &Keys) -> Result<bool, ParseError> {
    for key in &keys.fisheye {
        if storage.number(key)?.is_some_and(|flag| flag != 0.0) {
            return Ok(true);
        }
    }
    match storage.text(&keys.model) {
        None | Some("plumb_bob" | "rational_polynomial" | "radtan" | "") => Ok(false),
        Some("equidistant" | "fisheye" | "kannala_brandt" | "kannala_brandt4") => Ok(true),
        Some(other) => Err(ParseError::Shape {
            field: keys.model.clone(),
            expected: "plumb_bob, rational_polynomial or equidistant",
            found: format!("{other:?}"),
        }),
    }
}

fn size(storage: &Storage, keys: &Keys, options: &ReadOptions) -> Result<[u32; 2], ParseError> {
    let side = |names: &[String]| {
        let Some((key, entry)) = storage.find(names) else {
            return Ok(None);
        };
        numbers::pixels(key, entry.number(key)?).map(Some)
    };
    match (side(&keys.width)?, side(&keys.height)?, options.size) {
        (Some(width), Some(height), _) => Ok([width, height]),
        (None, None, Some(size)) => Ok(size),
        (None, ..) => Err(ParseError::Missing {
            field: keys.width.join(" or "),
        }),
        (_, None, _) => Err(ParseError::Missing {
            field: keys.height.join(" or "),
        }),
    }
}

fn rotation(storage: &Storage, keys: &Keys) -> Result<UnitQuaternion<f64>, ParseError> {
    let (key, list) = storage.numbers(&keys.rotation)?;
    if let Ok(nine) = <[f64; 9]>::try_from(list.as_slice()) {
        return numbers::rotation(key, &numbers::matrix_of_nine(&nine));
    }
    numbers::rodrigues(key, sized(key, list, "a rotation of 9 or 3 numbers")?)
}

fn sized<const N: usize>(
    key: &str,
    list: Vec<f64>,
    expected: &'static str,
) -> Result<[f64; N], ParseError> {
    list.try_into().map_err(|list: Vec<f64>| ParseError::Shape {
        field: key.to_owned(),
        expected,
        found: format!("{} numbers", list.len()),
    })
}

/// Writes all cameras into one storage with the names of `EasyMocap`, in metres.
///
/// The up direction and the source of the rig are lost.
///
/// # Errors
///
/// Fails with [`UnwritableRig::Name`] for a name with characters other than letters, digits, `_` and `-`, because names are part of the
/// keys.
pub fn write(rig: &Rig) -> Result<String, UnwritableRig> {
    let mut lines = vec![
        "%YAML:1.0".to_owned(),
        "---".to_owned(),
        "names:".to_owned(),
    ];
    for camera in rig.cameras() {
        let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'-';
        if !camera.name.bytes().all(plain) {
            return Err(UnwritableRig::Name {
                camera: camera.name.clone(),
                format: "OpenCV",
            });
        }
        lines.push(format!("   - \"{}\"", camera.name));
    }
    for camera in rig.cameras() {
        let name = &camera.name;
        let intrinsics = &camera.intrinsics;
        let pose = &camera.camera_from_world;
        let (coefficients, fisheye) = numbers::distortion(intrinsics.lens.model());
        let k = numbers::rows(&intrinsics.matrix());
        let rotation = numbers::rows(pose.rotation.to_rotation_matrix().matrix());
        lines.extend([
            format!("W_{name}: {}", intrinsics.size[0]),
            format!("H_{name}: {}", intrinsics.size[1]),
            matrix(&format!("K_{name}"), 3, 3, k.as_flattened()),
            matrix(
                &format!("dist_{name}"),
                1,
                coefficients.len(),
                &coefficients,
            ),
            format!("fisheye_{name}: {}", u8::from(fisheye)),
            matrix(
                &format!("R_{name}"),
                3,
                1,
                pose.rotation.scaled_axis().as_slice(),
            ),
            matrix(&format!("Rot_{name}"), 3, 3, rotation.as_flattened()),
            matrix(
                &format!("T_{name}"),
                3,
                1,
                pose.translation.vector.as_slice(),
            ),
        ]);
    }
    Ok(lines.join("\n") + "\n")
}

fn matrix(key: &str, rows: usize, columns: usize, data: &[f64]) -> String {
    let data = numbers::joined(data, ", ");
    format!(
        "{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]"
    )
}
