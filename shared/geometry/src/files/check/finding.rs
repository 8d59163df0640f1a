//! Likely faults of a rig, as numbers and as text.

use std::fmt;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The finding is for information.
    Note,
    /// The finding is probably a mistake.
    Warning,
    /// Nothing can be located in space with this rig, and a run does not accept it.
    Error,
}

/// An implausible property of a rig.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// Two cameras are so near or far from each other that the unit is probably wrong.
    Distance {
        /// Names of the two cameras.
        cameras: [String; 2],
        /// Distance between the cameras.
        metres: f64,
    },
    /// All cameras are in the same place, so that nothing can be triangulated.
    OnePlace {
        /// Number of cameras.
        n_cameras: usize,
        /// Largest distance between two cameras.
        metres: f64,
    },
    /// Two cameras have the same position and direction.
    SamePose {
        /// Names of the two cameras.
        cameras: [String; 2],
    },
    /// A camera is so far from the origin of the world that precision is lost.
    FarAway {
        /// Name of the camera.
        camera: String,
        /// Distance from the origin.
        metres: f64,
    },
    /// The principal point is far from the centre of the image, perhaps because the image was cropped or scaled.
    PrincipalPoint {
        /// Name of the camera.
        camera: String,
        /// Position of the principal point, as fractions of width and height.
        fraction: [f64; 2],
    },
    /// Focal lengths along rows and columns differ by more than a tenth.
    Aspect {
        /// Name of the camera.
        camera: String,
        /// Ratio fy / fx.
        ratio: f64,
    },
    /// No usual lens has this field of view, perhaps because the image size was changed after calibration.
    FieldOfView {
        /// Name of the camera.
        camera: String,
        /// The larger of the horizontal and vertical angles, in degrees.
        degrees: f64,
    },
    /// The lens model cannot be inverted in part of the image.
    LensRange {
        /// Name of the camera.
        camera: String,
        /// Fraction of the image, 0 to 1; 0 if only corners are affected.
        share: f64,
    },
    /// The distortion moves the corner of the image further than any real lens would.
    LensStrength {
        /// Name of the camera.
        camera: String,
        /// Angle of the corner to the axis without distortion, in degrees.
        straight_degrees: f64,
        /// Angle of the corner to the axis with distortion, in degrees.
        bent_degrees: f64,
    },
    /// The file has no pose for a camera.
    LeftOut {
        /// Name of the camera.
        camera: String,
        /// Reason why the pose is not known.
        why: &'static str,
    },
    /// The rig has no up direction, so that pictures cannot be turned upright.
    UpUnknown,
    /// A camera is upside down, or the up direction is wrong.
    UpsideDown {
        /// Name of the camera.
        camera: String,
        /// Rotation that would make the camera upright, in degrees.
        degrees: f64,
    },
    /// A camera does not see the point at which the other cameras are aimed.
    LooksElsewhere {
        /// Name of the camera.
        camera: String,
    },
    /// No two cameras see a common region.
    NothingShared {
        /// Number of cameras.
        n_cameras: usize,
    },
}

/// Range of plausible fields of view, in degrees.
const FIELDS_OF_VIEW: core::ops::RangeInclusive<f64> = 0.3..=170.0;

impl Finding {
    /// Returns the severity of the finding.
    pub fn severity(&self) -> Severity {
        let (error, warning) = match self {
            Self::Distance { metres, .. } => (*metres > 100.0, true),
            Self::OnePlace { .. } | Self::NothingShared { .. } => (true, true),
            Self::FieldOfView { degrees, .. } => (!FIELDS_OF_VIEW.contains(degrees), true),
            Self::Aspect { ratio, .. } => (!(0.4..=2.5).contains(ratio), true),
            Self::LensRange { share, .. } => (*share > 0.5, *share > 0.1),
            Self::LensStrength {
                straight_degrees,
                bent_degrees,
                ..
            } => (*bent_degrees < 0.1 * straight_degrees, true),
            Self::PrincipalPoint { fraction, .. } => {
                let is_outside = fraction.iter().any(|part| !(0.0..=1.0).contains(part));
                (false, is_outside)
            }
            Self::UpUnknown | Self::LeftOut { .. } => (false, false),
            Self::SamePose { .. }
            | Self::FarAway { .. }
            | Self::UpsideDown { .. }
            | Self::LooksElsewhere { .. } => (false, true),
        };
        match (error, warning) {
            (true, _) => Severity::Error,
            (false, true) => Severity::Warning,
            (false, false) => Severity::Note,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Distance { .. }
            | Self::OnePlace { .. }
            | Self::SamePose { .. }
            | Self::FarAway { .. } => self.fmt_place(f),
            Self::PrincipalPoint { .. }
            | Self::Aspect { .. }
            | Self::FieldOfView { .. }
            | Self::LensRange { .. }
            | Self::LensStrength { .. } => self.fmt_intrinsics(f),
            Self::LeftOut { camera, why } => write!(f, "{camera} is left out: {why}"),
            Self::UpUnknown => {
                write!(
                    f,
                    "the rig has no up direction, so the up direction must be found"
                )
            }
            Self::UpsideDown { camera, degrees } => write!(
                f,
                "{camera} would have to be rotated by {degrees:.0} degrees to be upright: is the up direction correct?"
            ),
            Self::LooksElsewhere { camera } => write!(
                f,
                "{camera} does not see the place at which the cameras look: do the poses map from the world to the camera?"
            ),
            Self::NothingShared { n_cameras } => write!(
                f,
                "no two of the {n_cameras} cameras see a common place: do the poses map from the world to the camera?"
            ),
        }
    }
}

impl Finding {
    /// Writes the text of a finding about the positions of cameras.
    fn fmt_place(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Distance {
                cameras: [a, b],
                metres,
            } => {
                let metres = Metres(*metres);
                write!(
                    f,
                    "{a} and {b} are {metres} m apart: is the unit right? `unit` is m, cm, mm, ft or in, or the side of a square of the \
                     board, such as 30mm"
                )
            }
            Self::OnePlace { n_cameras, metres } => write!(
                f,
                "the {n_cameras} cameras are in one place (at most {:.1} mm apart), so that nothing can be located in space",
                1000.0 * metres
            ),
            Self::SamePose { cameras: [a, b] } => write!(f, "{a} and {b} have the same pose"),
            Self::FarAway { camera, metres } => write!(
                f,
                "{camera} is {} m from the origin of the world: is the unit right?",
                Metres(*metres)
            ),
            _ => Ok(()),
        }
    }

    /// Writes the text of a finding about the intrinsics of a camera.
    fn fmt_intrinsics(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PrincipalPoint {
                camera,
                fraction: [x, y],
            } => write!(
                f,
                "{camera}: the principal point is at {x:.2} of the width and {y:.2} of the height: was the image cropped or scaled after calibration?"
            ),
            Self::Aspect { camera, ratio } => write!(
                f,
                "{camera}: fy / fx is {ratio:.3}, but it is 1 for square pixels"
            ),
            Self::FieldOfView { camera, degrees } => write!(
                f,
                "{camera}: the field of view is {degrees:.1} degrees: is the image size the same as in the calibration?"
            ),
            Self::LensRange { camera, share } if *share == 0.0 => write!(
                f,
                "{camera}: the lens model cannot be inverted in the corners of the image"
            ),
            Self::LensRange { camera, share } => write!(
                f,
                "{camera}: the lens model cannot be inverted in {:.0} % of the image: are the distortion coefficients right?",
                100.0 * share
            ),
            Self::LensStrength {
                camera,
                straight_degrees,
                bent_degrees,
            } => write!(
                f,
                "{camera}: the distortion moves the corner of the image from {straight_degrees:.1} to {bent_degrees:.1} degrees from the \
                 optical axis: are the distortion coefficients right?"
            ),
            _ => Ok(()),
        }
    }
}

/// A length in metres, written with three digits; from a million on, with a power of ten.
struct Metres(f64);

impl fmt::Display for Metres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let metres = self.0;
        if metres < 1e6 {
            write!(f, "{metres:.3}")
        } else {
            write!(f, "{metres:.1e}")
        }
    }
}
