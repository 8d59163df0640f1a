//! Cameras around the stage: those of public data sets, rings of n cameras, or the cameras of a rig file.

use std::path::PathBuf;

use geometry::files::{ParseError, ReadOptions, RigFileError};
use geometry::{Camera, Intrinsics, Lens, LensModel, Rig, RigError};
use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3,
};

/// The choice of the cameras.
#[derive(Debug, Clone, PartialEq)]
pub enum RigChoice {
    /// The three colour cameras of HumanEva-I, in their positions for subject S1; 640x480.
    HumanEva,
    /// The four cameras of UMPM; 644x486.
    Umpm,
    /// `n` cameras of 640x480, spaced evenly around the stage.
    Ring {
        /// Number of cameras.
        n: usize,
        /// Distance from the middle, in metres.
        radius: f64,
        /// Height above the floor, in metres.
        height: f64,
    },
    /// A rig file of any format that `geometry::files` reads.
    File(PathBuf),
}

/// Reason why a rig could not be created.
#[derive(Debug, thiserror::Error)]
pub enum RigChoiceError {
    /// The text has none of the accepted forms.
    #[error(
        "{text:?} is not a rig: expected humaneva, umpm, ring:N[:RADIUS[:HEIGHT]] or a rig file"
    )]
    Form {
        /// The given text.
        text: String,
    },
    /// The file of a built-in rig cannot be read.
    #[error("a preset cannot be read")]
    Preset(#[from] ParseError),
    /// The rig file cannot be read.
    #[error("the rig file cannot be read")]
    File(#[from] RigFileError),
    /// The cameras do not form a valid rig.
    #[error("the cameras do not form a valid rig")]
    Rig(#[from] RigError),
    /// The rig has no up direction, so the position of the floor is unknown.
    #[error("the rig has no up direction")]
    NoUp,
}

const MAX_RING_CAMERAS: usize = 64;

impl RigChoice {
    /// Parses `humaneva`, `umpm`, `ring:N[:RADIUS[:HEIGHT]]`, or the path of a file.
    ///
    /// # Errors
    ///
    /// [`RigChoiceError::Form`] for any other text without a dot or a slash.
    pub fn parse(text: &str) -> Result<Self, RigChoiceError> {
        let wrong = || RigChoiceError::Form {
            text: text.to_owned(),
        };
        match text {
            "humaneva" => return Ok(Self::HumanEva),
            "umpm" => return Ok(Self::Umpm),
            _ => {}
        }
        let Some(rest) = text.strip_prefix("ring:") else {
            let is_file = text.contains(['.', '/']);
            return if is_file {
                Ok(Self::File(text.into()))
            } else {
                Err(wrong())
            };
        };
        let mut fields = rest.split(':');
        let n = fields.next().and_then(|field| field.parse().ok());
        let n = n.filter(|n| (1..=MAX_RING_CAMERAS).contains(n)).ok_or_else(wrong)?;
        let mut metres = |default: f64, least: f64| match fields.next() {
            None => Ok(default),
            Some(text) => {
                let value: Option<f64> = text.parse().ok();
                value.filter(|value| (least..=50.0).contains(value)).ok_or_else(wrong)
            }
        };
        let ring = Self::Ring {
            n,
            radius: metres(4.2, 2.0)?,
            height: metres(1.5, 0.1)?,
        };
        if fields.next().is_some() {
            Err(wrong())
        } else {
            Ok(ring)
        }
    }

    /// Loads or creates the cameras.
    ///
    /// # Errors
    ///
    /// [`RigChoiceError`] for a file that cannot be read.
    pub fn rig(&self) -> Result<Rig, RigChoiceError> {
        match self {
            Self::HumanEva => humaneva(),
            Self::Umpm => umpm(),
            Self::Ring { n, radius, height } => Ok(ring(*n, *radius, *height)?),
            Self::File(path) => Ok(geometry::files::read(path, &ReadOptions::default())?),
        }
    }
}

impl std::fmt::Display for RigChoice {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::HumanEva => out.write_str("humaneva"),
            Self::Umpm => out.write_str("umpm"),
            Self::Ring { n, radius, height } => write!(out, "ring:{n}:{radius}:{height}"),
            Self::File(path) => write!(out, "{}", path.display()),
        }
    }
}

/// Returns the cameras of HumanEva-I; the file documents which lenses are published and which are estimated.
pub(crate) fn humaneva() -> Result<Rig, RigChoiceError> {
    let text = include_str!("../../../configs/rigs/humaneva-s1.toml");
    Ok(geometry::files::own::parse(text, &ReadOptions::default())?)
}

/// Assumed height above the floor of the point at which the cameras of UMPM look, in metres.
const UMPM_FOCUS: f64 = 0.95;

/// Returns the cameras of UMPM, rotated so that z is up and the floor is at 0.
///
/// The calibration of these cameras has no up direction, so the rows of the pictures are assumed to be horizontal.
fn umpm() -> Result<Rig, RigChoiceError> {
    let text = include_str!("../../../configs/rigs/umpm-triangle.toml");
    let rig = geometry::files::own::parse(text, &ReadOptions::default())?;
    let mut rows = Matrix3::zeros();
    for camera in rig.cameras() {
        let row = camera.camera_from_world.rotation.inverse() * Vector3::x();
        rows += row * row.transpose();
    }
    let eigen = rows.symmetric_eigen();
    let up: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let first = rig.cameras()[0].camera_from_world.rotation.inverse();
    // y points down in pictures.
    let up = if (first * Vector3::y()).dot(&up) > 0.0 {
        -up
    } else {
        up
    };
    let up = UnitVector3::new_normalize(up);
    let focus = rig.focus().ok_or(RigChoiceError::NoUp)?;
    let old_from_new = Isometry3::from_parts(
        Translation3::from(focus - up.into_inner() * UMPM_FOCUS),
        upright(&up),
    );
    let cameras = rig.cameras().iter().map(|camera| Camera {
        camera_from_world: camera.camera_from_world * old_from_new,
        ..camera.clone()
    });
    Ok(Rig::new(
        cameras.collect(),
        Some(Vector3::z_axis()),
        rig.source(),
    )?)
}

/// Returns the rotation that maps z to `up`.
fn upright(up: &UnitVector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), up).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI)
    })
}

/// Creates cameras `c1`, `c2`, ..., spaced evenly around the origin, that look at a point 0.9 m above the floor.
fn ring(n: usize, radius: f64, height: f64) -> Result<Rig, RigError> {
    let target = Point3::new(0.0, 0.0, 0.9);
    let camera = |nth: usize| {
        let angle = core::f64::consts::TAU * nth as f64 / n as f64;
        let eye = Point3::new(radius * angle.cos(), radius * angle.sin(), height);
        let forward = (target - eye).normalize_or_x();
        let right = forward.cross(&Vector3::z()).normalize_or_x();
        let down = forward.cross(&right);
        let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
        Camera {
            name: format!("c{}", nth + 1),
            intrinsics: Intrinsics {
                fx: 620.0,
                fy: 620.0,
                cx: 319.5,
                cy: 239.5,
                size: [640, 480],
                lens: Lens::new(LensModel::BrownConrady {
                    k: [-0.18, 0.06, 0.0, 0.0, 0.0, 0.0],
                    p: [0.0005, -0.0005],
                }),
            },
            camera_from_world: Isometry3::from_parts(Translation3::from(turn * -eye.coords), turn),
        }
    };
    let source = format!("ring of {n}, {radius} m from the middle");
    Rig::new(
        (0..n).map(camera).collect(),
        Some(Vector3::z_axis()),
        source,
    )
}

trait OrX {
    fn normalize_or_x(self) -> Self;
}

impl OrX for Vector3<f64> {
    /// Returns a unit vector; x for a zero vector.
    fn normalize_or_x(self) -> Self {
        self.try_normalize(1e-9).unwrap_or(Self::x())
    }
}

/// Returns the pose of the stage: the frame with its origin on the floor, z up.
///
/// The floor is at height 0 if the world's z axis points up and the point at which the cameras look is at most 2 m above 0. Otherwise, the
/// floor is 0.95 m below that point.
///
/// # Errors
///
/// [`RigChoiceError::NoUp`].
pub(crate) fn world_from_stage(rig: &Rig) -> Result<Isometry3<f64>, RigChoiceError> {
    let up = rig.up_in_world().ok_or(RigChoiceError::NoUp)?;
    let single = || {
        let camera = rig.cameras().first()?;
        Some(camera.centre_in_world() + camera.axis_in_world().into_inner() * 4.0)
    };
    let focus = rig.focus().or_else(single).ok_or(RigChoiceError::NoUp)?;
    let on_floor = if up.z > 0.999_999 && (0.3..2.0).contains(&focus.z) {
        Point3::new(focus.x, focus.y, 0.0)
    } else {
        focus - up.into_inner() * UMPM_FOCUS
    };
    Ok(Isometry3::from_parts(
        Translation3::from(on_floor),
        upright(&up),
    ))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn angle_between(rig: &Rig, a: usize, b: usize) -> f64 {
        let axis = |i: usize| rig.cameras()[i].axis_in_world().into_inner();
        axis(a).xy().angle(&axis(b).xy()).to_degrees()
    }

    #[test]
    fn presets_have_the_number_of_cameras_in_their_names() {
        let rig = RigChoice::HumanEva.rig().unwrap();
        assert_eq!(rig.cameras().len(), 3);
        assert!(rig.cameras().iter().all(|camera| camera.intrinsics.size == [640, 480]));
        for (a, b) in [(0, 1), (0, 2)] {
            assert!((angle_between(&rig, a, b) - 90.0).abs() < 25.0);
        }
        let rig = RigChoice::Umpm.rig().unwrap();
        assert_eq!(rig.cameras().len(), 4);
        for camera in rig.cameras() {
            assert_eq!(camera.intrinsics.size, [644, 486]);
            let row = camera.camera_from_world.rotation.inverse() * Vector3::x();
            assert!(row.z.abs() < 0.03, "{}: rows are level", camera.name);
            assert!(
                (1.0..4.0).contains(&camera.centre_in_world().z),
                "above the floor"
            );
        }
        let rig = RigChoice::parse("ring:8:5:2").unwrap().rig().unwrap();
        assert_eq!(rig.cameras().len(), 8);
        assert!((angle_between(&rig, 0, 1) - 45.0).abs() < 1e-9);
    }

    #[test]
    fn every_camera_sees_the_middle_of_the_stage() {
        for choice in ["humaneva", "umpm", "ring:1", "ring:5:4:0.5"] {
            let rig = RigChoice::parse(choice).unwrap().rig().unwrap();
            let stage = world_from_stage(&rig).unwrap();
            for camera in rig.cameras() {
                let pixel = camera.project(&(stage * Point3::new(0.0, 0.0, 0.9))).unwrap();
                let [width, height] = camera.intrinsics.size.map(f64::from);
                let share = [pixel.x / width, pixel.y / height];
                assert!(
                    share.iter().all(|share| (0.25..0.75).contains(share)),
                    "{choice}: {share:?}"
                );
            }
        }
    }

    #[test]
    fn invalid_texts_are_refused() {
        for text in [
            "",
            "ring",
            "ring:",
            "ring:0",
            "ring:65",
            "ring:3:x",
            "ring:3:nan",
            "ring:3:4:1:2",
            "human",
        ] {
            assert!(RigChoice::parse(text).is_err(), "{text}");
        }
    }

    proptest! {
        /// The strategy generates only valid texts, because otherwise the assertion would not be reached.
        #[test]
        fn a_parsed_choice_is_written_and_parsed_to_the_same(
            text in "humaneva|umpm|ring:[1-9](:[2-9](\\.[0-9]{1,6})?(:[1-9](\\.[0-9]{1,6})?)?)?|\\PC{0,9}[./]\\PC{0,9}",
        ) {
            prop_assume!(!text.starts_with("ring:") || text.is_ascii());
            let choice = RigChoice::parse(&text).unwrap();
            prop_assert_eq!(RigChoice::parse(&choice.to_string()).unwrap(), choice);
        }

        #[test]
        fn no_text_panics(text: String) {
            drop(RigChoice::parse(&text));
        }
    }
}
