//! Parallax's own rig file: TOML, metres, world to camera.
//!
//! ```toml
//! format = "parallax-rig"            # identifies the format
//! source = "refined on detections"   # free text; may be left out
//! up = [0.0, 0.0, 1.0]               # against gravity, in the world; left out where unknown
//!
//! [[camera]]                         # one for each view; the order is kept
//! name = "cam01"
//! size_px = [1088, 1920]             # width, height
//! focal_px = [1681.2, 1681.1]        # fx, fy
//! principal_point_px = [533.0, 948.1] # the centre of the top-left pixel is (0, 0)
//! lens = "brown-conrady"             # or "pinhole" (if left out) or "kannala-brandt" (fisheye)
//! radial = [-0.0462, 0.14]           # k1 to k6, or k1 to k4 of the fisheye; missing ones are 0
//! tangential = [0.0006, 0.0007]      # p1, p2; not for the fisheye
//! rotation_rad = [1.69, 1.05, -0.42] # Rodrigues, world to camera; or `rotation`, three rows of three
//! translation_metres = [0.32, 0.96, 2.89] # both left out where only the lens is known
//! ```
//!
//! A point X of the world has the camera coordinates `R X + t`. The camera looks along +z with y down (`OpenCV`).

use std::fmt::Debug;

use serde::Deserialize;

use super::{ParseError, ReadOptions, Unit, entry::Entry, numbers};
use crate::{Camera, LensModel, Rig};

const FORMAT: &str = "parallax-rig";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    format: String,
    source: Option<String>,
    up: Option<[f64; 3]>,
    #[serde(default)]
    camera: Vec<CameraFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    name: String,
    size_px: [u32; 2],
    focal_px: [f64; 2],
    principal_point_px: [f64; 2],
    #[serde(default)]
    lens: LensKind,
    radial: Option<Vec<f64>>,
    tangential: Option<[f64; 2]>,
    rotation_rad: Option<[f64; 3]>,
    rotation: Option<[[f64; 3]; 3]>,
    translation_metres: Option<[f64; 3]>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum LensKind {
    #[default]
    Pinhole,
    BrownConrady,
    KannalaBrandt,
}

/// Returns true if a text is a rig file of this format.
pub(super) fn is_own(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|table| table.get("format").and_then(toml::Value::as_str) == Some(FORMAT))
        || text.lines().any(|line| line.starts_with("format = \"parallax-rig\""))
}

/// Reads a rig file. The image size of `options` is ignored, because the file has it. A unit in `options` replaces metres, for a file that
/// was written in the wrong unit.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    let file: RigFile = toml::from_str(text).map_err(|error| ParseError::Syntax {
        format: "Parallax rig",
        source: Box::new(error),
    })?;
    if file.format != FORMAT {
        return Err(ParseError::Shape {
            field: "format".to_owned(),
            expected: "\"parallax-rig\"",
            found: format!("{:?}", file.format),
        });
    }
    if file.camera.is_empty() {
        return Err(ParseError::NoCameras {
            expected: "a [[camera]] table for each view",
        });
    }
    let up = file.up.map(|up| numbers::direction("up", up)).transpose()?.or(options.up);
    let cameras = file
        .camera
        .into_iter()
        .map(|fields| camera(fields, options.unit.unwrap_or(Unit::Metres)))
        .collect::<Result<_, _>>()?;
    super::entry::rig(cameras, up, &file.source.unwrap_or_default(), options)
}

fn camera(file: CameraFile, unit: Unit) -> Result<Entry, ParseError> {
    let field = |key: &str| format!("camera {:?}: {key}", file.name);
    let lens = lens(&file, &field)?;
    let ([fx, fy], [cx, cy]) = (file.focal_px, file.principal_point_px);
    let k = nalgebra::Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
    let intrinsics = numbers::intrinsics(&field("focal_px"), &k, file.size_px, lens)?;
    let rotation = match (file.rotation_rad, file.rotation) {
        (Some(vector), None) => numbers::rodrigues(&field("rotation_rad"), vector)?,
        (None, Some(rows)) => numbers::rotation(&field("rotation"), &numbers::matrix(rows))?,
        (None, None) if file.translation_metres.is_none() => {
            return Ok(Entry::lens(&file.name, intrinsics));
        }
        (None, None) => {
            return Err(ParseError::Missing {
                field: field("rotation_rad"),
            });
        }
        (Some(_), Some(_)) => {
            return Err(ParseError::Shape {
                field: field("rotation"),
                expected: "either rotation or rotation_rad",
                found: "both".to_owned(),
            });
        }
    };
    let place = field("translation_metres");
    let translation = file.translation_metres;
    let translation = translation.ok_or_else(|| ParseError::Missing {
        field: place.clone(),
    })?;
    let pose = numbers::pose(&place, rotation, translation, unit)?;
    Ok(Entry::Placed(Camera {
        name: file.name,
        intrinsics,
        camera_from_world: pose,
    }))
}

fn lens(file: &CameraFile, field: &dyn Fn(&str) -> String) -> Result<LensModel, ParseError> {
    let radial = file.radial.as_deref().unwrap_or_default();
    let shape = |key: &str, expected: &'static str, found: usize| ParseError::Shape {
        field: field(key),
        expected,
        found: format!("{found} numbers"),
    };
    if file.lens != LensKind::BrownConrady && file.tangential.is_some() {
        return Err(shape(
            "tangential",
            "no value, because the lens is not brown-conrady",
            2,
        ));
    }
    match file.lens {
        LensKind::Pinhole if radial.is_empty() => Ok(LensModel::Pinhole),
        LensKind::Pinhole => Err(shape(
            "radial",
            "no value, because the lens is a pinhole",
            radial.len(),
        )),
        LensKind::BrownConrady => {
            let k =
                padded(radial).ok_or_else(|| shape("radial", "k1 to at most k6", radial.len()))?;
            Ok(LensModel::BrownConrady {
                k,
                p: file.tangential.unwrap_or_default(),
            })
        }
        LensKind::KannalaBrandt => {
            let k =
                padded(radial).ok_or_else(|| shape("radial", "k1 to at most k4", radial.len()))?;
            Ok(LensModel::KannalaBrandt { k })
        }
    }
}

fn padded<const N: usize>(list: &[f64]) -> Option<[f64; N]> {
    (list.len() <= N).then(|| std::array::from_fn(|i| list.get(i).copied().unwrap_or(0.0)))
}

/// Writes a rig file.
pub fn write(rig: &Rig) -> String {
    let quoted = |s: &str| toml::Value::from(s).to_string();
    let mut lines = vec![format!("format = \"{FORMAT}\"")];
    if !rig.source().is_empty() {
        lines.push(format!("source = {}", quoted(rig.source())));
    }
    if let Some(up) = rig.up_in_world() {
        lines.push(format!("up = {}", list(up.iter())));
    }
    for camera in rig.cameras() {
        let intrinsics = &camera.intrinsics;
        lines.extend([
            "\n[[camera]]".to_owned(),
            format!("name = {}", quoted(&camera.name)),
            format!("size_px = {:?}", intrinsics.size),
            format!("focal_px = {}", list([intrinsics.fx, intrinsics.fy])),
            format!(
                "principal_point_px = {}",
                list([intrinsics.cx, intrinsics.cy])
            ),
        ]);
        match intrinsics.lens.model() {
            LensModel::Pinhole => {}
            LensModel::BrownConrady { k, p } => lines.extend([
                "lens = \"brown-conrady\"".to_owned(),
                format!("radial = {}", list(k)),
                format!("tangential = {}", list(p)),
            ]),
            LensModel::KannalaBrandt { k } => lines.extend([
                "lens = \"kannala-brandt\"".to_owned(),
                format!("radial = {}", list(k)),
            ]),
        }
        if rig.left_out().iter().any(|left_out| left_out.camera == camera.name) {
            continue;
        }
        let pose = &camera.camera_from_world;
        lines.extend([
            format!(
                "rotation_rad = {}",
                list(pose.rotation.scaled_axis().iter())
            ),
            format!(
                "translation_metres = {}",
                list(pose.translation.vector.iter())
            ),
        ]);
    }
    lines.join("\n") + "\n"
}

fn list(numbers: impl IntoIterator<Item = impl Debug>) -> String {
    format!("[{}]", numbers::joined(numbers, ", "))
}
