//! Calibration files of Qualisys (`.qca.txt`, XML): millimetres, and pixels in 64ths.
//!
//! The conventions were determined from a file whose cameras are also known in the conventions of `OpenCV`:
//!
//! - `x y z` is the centre of the camera.
//! - `r11..r33`, row by row, takes the world to coordinates with x to the right, y up and z backward, so y and z change sign.
//! - Focal lengths and the principal point are in 1/64 px from the top-left of the sensor. `fov_video` is the part of the sensor in the
//!   image.
//! - The distortion coefficients are those of `OpenCV`, without division. Pose2Sim divides them by 64 as well, so files that it converted
//!   have lost their distortion.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::{ParseError, ReadOptions, Unit, entry::Entry, numbers};
use crate::{Camera, Rig};

/// Number of file units per pixel.
const SUBPIXELS: f64 = 64.0;

/// Reads a calibration. A camera that was not calibrated is left out.
///
/// # Errors
///
/// See [`ParseError`]. A camera that is rotated in the viewer (`viewrotation`) is refused, because its pixel convention is not documented.
pub fn parse(text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    // Files of older versions start with a byte order mark.
    let document = Document::parse(text.trim_start_matches('\u{feff}')).map_err(|error| {
        ParseError::Syntax {
            format: "XML",
            source: Box::new(error),
        }
    })?;
    let cameras = document
        .descendants()
        .filter(|node| node.has_tag_name("camera") && node.attribute("active") != Some("0"))
        .map(|node| camera(node, options))
        .collect::<Result<Vec<_>, _>>()?;
    if cameras.is_empty() {
        return Err(ParseError::NoCameras {
            expected: "an active <camera> element for each view",
        });
    }
    super::entry::rig(cameras, options.up, "", options)
}

fn camera(node: Node<'_, '_>, options: &ReadOptions) -> Result<Entry, ParseError> {
    let serial = node.attribute("serial");
    let name = serial.ok_or_else(|| ParseError::Missing {
        field: "camera serial".to_owned(),
    })?;
    let calibrated = node.attribute("calibrated").unwrap_or("true");
    if ["false", "0"].contains(&&*calibrated.trim().to_ascii_lowercase()) {
        return Ok(Entry::name(
            name,
            "its file says that the camera was not calibrated",
        ));
    }
    let child = |tag: &str| {
        let found = node.children().find(|child| child.has_tag_name(tag));
        let field = format!("camera {name:?}: {tag}");
        let node = found.ok_or_else(|| ParseError::Missing {
            field: field.clone(),
        })?;
        Ok(Element { node, field })
    };
    let turned = Element {
        node,
        field: format!("camera {name:?}"),
    };
    turned.zero_if_present(
        "viewrotation",
        "a rotated view is not supported: the rotation must be 0",
    )?;
    let intrinsics = intrinsics(&child("intrinsic")?, &child("fov_video")?)?;
    let camera_from_world = pose(
        &child("transform")?,
        options.unit.unwrap_or(Unit::Millimetres),
    )?;
    Ok(Entry::Placed(Camera {
        name: name.to_owned(),
        intrinsics,
        camera_from_world,
    }))
}

fn intrinsics(
    inside: &Element<'_, '_>,
    video: &Element<'_, '_>,
) -> Result<crate::Intrinsics, ParseError> {
    inside.zero_if_present("skew", "skew is not supported: the skew must be 0")?;
    let (left, top) = (video.number("left")?, video.number("top")?);
    let size = [
        numbers::pixels(&video.field, video.number("right")? - left + 1.0)?,
        numbers::pixels(&video.field, video.number("bottom")? - top + 1.0)?,
    ];
    let subpixels = |key: &str| Ok::<_, ParseError>(inside.number(key)? / SUBPIXELS);
    let k = Matrix3::new(
        subpixels("focalLengthU")?,
        0.0,
        subpixels("centerPointU")? - left,
        0.0,
        subpixels("focalLengthV")?,
        subpixels("centerPointV")? - top,
        0.0,
        0.0,
        1.0,
    );
    let [k1, k2, k3] = [
        "radialDistortion1",
        "radialDistortion2",
        "radialDistortion3",
    ]
    .map(|key| inside.number(key));
    // The files use this spelling.
    let [p1, p2] = ["tangentalDistortion1", "tangentalDistortion2"].map(|key| inside.number(key));
    let lens = numbers::lens(&inside.field, &[k1?, k2?, p1?, p2?, k3?], false)?;
    numbers::intrinsics(&inside.field, &k, size, lens)
}

fn pose(transform: &Element<'_, '_>, unit: Unit) -> Result<nalgebra::Isometry3<f64>, ParseError> {
    let mut r = [[0.0; 3]; 3];
    for (row, i) in r.iter_mut().zip(1..) {
        for (entry, j) in row.iter_mut().zip(1..) {
            *entry = transform.number(&format!("r{i}{j}"))?;
        }
    }
    let upright = numbers::rotation(
        &format!("{} r11 to r33", transform.field),
        &numbers::matrix(r),
    )?;
    let opencv_from_qualisys =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let rotation = opencv_from_qualisys * upright;
    let [x, y, z] = ["x", "y", "z"].map(|key| transform.number(key));
    let centre = Point3::new(x?, y?, z?);
    numbers::pose(
        &transform.field,
        rotation,
        (rotation * -centre.coords).into(),
        unit,
    )
}

/// An element, and its name in errors.
struct Element<'a, 'input> {
    node: Node<'a, 'input>,
    field: String,
}

impl Element<'_, '_> {
    fn number(&self, key: &str) -> Result<f64, ParseError> {
        let field = format!("{} {key}", self.field);
        let Some(text) = self.node.attribute(key) else {
            return Err(ParseError::Missing { field });
        };
        match text.trim().parse() {
            Ok(value) => numbers::finite(&field, value),
            Err(_) => Err(ParseError::Shape {
                field,
                expected: "a number",
                found: format!("{text:?}"),
            }),
        }
    }

    fn zero_if_present(&self, key: &str, requirement: &'static str) -> Result<(), ParseError> {
        if !self.node.has_attribute(key) {
            return Ok(());
        }
        let value = self.number(key)?;
        if value == 0.0 {
            return Ok(());
        }
        Err(ParseError::Value {
            field: format!("{} {key}", self.field),
            value,
            requirement,
        })
    }
}
