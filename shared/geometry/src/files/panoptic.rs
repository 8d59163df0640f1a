//! JSON of CMU Panoptic: a list `cameras`, in centimetres, with y down.
//!
//! ```json
//! { "calibDataSource": "...", "cameras": [
//!   { "name": "00_00", "type": "hd", "resolution": [1920, 1080],
//!     "K": [[1400.0, 0, 960.0], [0, 1400.0, 540.0], [0, 0, 1]], "distCoef": [k1, k2, p1, p2, k3],
//!     "R": [[..], [..], [..]], "t": [[x], [y], [z]] } ] }
//! ```
//!
//! `R` and `t` take a point of the world to the camera, as in `OpenCV`. The world's y points down, so that up is -y. `t` may be a column or
//! a plain list. A file of the data set has 31 HD cameras, 480 VGA cameras and 10 Kinects. All of them are read as cameras, and a
//! deployment names those that it uses.

use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;

use super::{ParseError, ReadOptions, Unit, numbers};
use crate::{Camera, Rig};

#[derive(Deserialize)]
struct CalibrationFile {
    cameras: Vec<CameraFile>,
}

#[derive(Deserialize)]
struct CameraFile {
    name: String,
    resolution: [f64; 2],
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    #[serde(rename = "distCoef")]
    distortion: Vec<f64>,
    #[serde(rename = "R")]
    rotation: [[f64; 3]; 3],
    t: Translation,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected three numbers, or three rows of one number"
)]
enum Translation {
    List([f64; 3]),
    Column([[f64; 1]; 3]),
}

/// Returns true if a text is JSON with the keys of these files.
pub(super) fn is_panoptic(text: &str) -> bool {
    let start = text.trim_start_matches('\u{feff}').trim_start();
    start.starts_with('{') && text.contains("\"cameras\"") && text.contains("\"distCoef\"")
}

/// Reads a calibration.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    let text = text.trim_start_matches('\u{feff}');
    let read = serde_json::from_str(text);
    let file: CalibrationFile = read.map_err(|error: serde_json::Error| ParseError::Syntax {
        format: "JSON of a Panoptic calibration",
        source: Box::new(error),
    })?;
    if file.cameras.is_empty() {
        return Err(ParseError::NoCameras {
            expected: "an object with K, R and t for each view, in the list `cameras`",
        });
    }
    let cameras = file.cameras.into_iter().map(|fields| camera(fields, options));
    let cameras = cameras.collect::<Result<Vec<_>, _>>()?;
    let down = UnitVector3::new_unchecked(-Vector3::y());
    Rig::new(cameras, options.up.or(Some(down)), "").map_err(ParseError::Rig)
}

fn camera(file: CameraFile, options: &ReadOptions) -> Result<Camera, ParseError> {
    let field = |key: &str| format!("camera {:?}: {key}", file.name);
    let mut size = [0; 2];
    for (side, value) in size.iter_mut().zip(file.resolution) {
        *side = numbers::pixels(&field("resolution"), value)?;
    }
    let lens = numbers::lens(&field("distCoef"), &file.distortion, false)?;
    let k = numbers::matrix(file.k);
    let intrinsics = numbers::intrinsics(&field("K"), &k, size, lens)?;
    let rotation = numbers::rotation(&field("R"), &numbers::matrix(file.rotation))?;
    let translation = match file.t {
        Translation::List(list) => list,
        Translation::Column(column) => column.map(|[value]| value),
    };
    let unit = options.unit.unwrap_or(Unit::Centimetres);
    let camera_from_world = numbers::pose(&field("t"), rotation, translation, unit)?;
    Ok(Camera {
        name: file.name,
        intrinsics,
        camera_from_world,
    })
}
