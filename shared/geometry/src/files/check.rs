//! Whether a rig is plausible: what a reader cannot know but a person would notice.

use std::fmt;

use nalgebra::{Point2, Point3};

use crate::{Camera, Rig, epipolar, upright_roll};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Probably a mistake.
    Warning,
}

/// Something odd about a rig.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// Two cameras are so near or far from each other that the unit is probably wrong.
    Distance {
        /// Names of the two.
        cameras: [String; 2],
        /// How far they are apart.
        metres: f64,
    },
    /// Two cameras have one place and one direction.
    SamePose {
        /// Names of the two.
        cameras: [String; 2],
    },
    /// The principal point is far from the middle of the image: was the image cropped or scaled?
    PrincipalPoint {
        /// Name of the camera.
        camera: String,
        /// Where it is, in parts of width and height.
        fraction: [f64; 2],
    },
    /// Focal lengths along rows and columns differ by more than a tenth.
    Aspect {
        /// Name of the camera.
        camera: String,
        /// fy / fx.
        ratio: f64,
    },
    /// The field of view is that of no usual lens: was the image size changed after calibration?
    FieldOfView {
        /// Name of the camera.
        camera: String,
        /// The wider of both angles, degrees.
        degrees: f64,
    },
    /// The lens model cannot be inverted in a corner of the image.
    LensRange {
        /// Name of the camera.
        camera: String,
    },
    /// The rig does not say which way is up, so that pictures cannot be turned upright.
    UpUnknown,
    /// A camera is upside down, or up is.
    UpsideDown {
        /// Name of the camera.
        camera: String,
        /// The turn that would make it upright, degrees.
        degrees: f64,
    },
    /// A camera does not see the place at which the others look.
    LooksElsewhere {
        /// Name of the camera.
        camera: String,
    },
}

impl Finding {
    /// How bad it is.
    pub fn severity(&self) -> Severity {
        match self {
            Self::UpUnknown | Self::LensRange { .. } | Self::PrincipalPoint { .. } => {
                Severity::Note
            }
            _ => Severity::Warning,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Distance {
                cameras: [a, b],
                metres,
            } => {
                write!(f, "{a} and {b} are {metres:.3} m apart: is the unit right?")
            }
            Self::SamePose { cameras: [a, b] } => write!(f, "{a} and {b} have one pose"),
            Self::PrincipalPoint {
                camera,
                fraction: [x, y],
            } => {
                write!(
                    f,
                    "{camera}: the principal point is at {x:.2} of the width and {y:.2} of the height: was the image cropped or scaled after calibration?"
                )
            }
            Self::Aspect { camera, ratio } => write!(f, "{camera}: fy / fx is {ratio:.3}"),
            Self::FieldOfView { camera, degrees } => {
                write!(
                    f,
                    "{camera}: the field of view is {degrees:.1} degrees: is the image size that of the calibration?"
                )
            }
            Self::LensRange { camera } => {
                write!(
                    f,
                    "{camera}: the lens model cannot be inverted in the corners of the image"
                )
            }
            Self::UpUnknown => write!(
                f,
                "the rig does not say which way is up: frames are not turned upright"
            ),
            Self::UpsideDown { camera, degrees } => {
                write!(
                    f,
                    "{camera} would have to be turned by {degrees:.0} degrees to be upright: is up right?"
                )
            }
            Self::LooksElsewhere { camera } => {
                write!(
                    f,
                    "{camera} does not see the place at which the cameras look: are the poses world to camera?"
                )
            }
        }
    }
}

/// Looks for what is odd about a rig. An empty list says that nothing was found, not that all is right.
pub fn check(rig: &Rig) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (i, a) in rig.cameras().iter().enumerate() {
        inside(a, &mut findings);
        for b in &rig.cameras()[i + 1..] {
            findings.extend(apart(a, b));
        }
    }
    if rig.up_in_world().is_none() {
        findings.push(Finding::UpUnknown);
    }
    for camera in rig.cameras() {
        let degrees = upright_roll(camera, rig)
            .map(f64::to_degrees)
            .filter(|d| d.abs() > 100.0);
        findings.extend(degrees.map(|degrees| Finding::UpsideDown {
            camera: camera.name.clone(),
            degrees,
        }));
        if rig.focus().is_some_and(|focus| !sees(camera, &focus)) {
            findings.push(Finding::LooksElsewhere {
                camera: camera.name.clone(),
            });
        }
    }
    findings
}

fn inside(camera: &Camera, findings: &mut Vec<Finding>) {
    let inside = &camera.intrinsics;
    let name = || camera.name.clone();
    let [width, height] = inside.size.map(f64::from);
    let fraction = [inside.cx / width, inside.cy / height];
    if fraction.iter().any(|part| !(0.3..=0.7).contains(part)) {
        findings.push(Finding::PrincipalPoint {
            camera: name(),
            fraction,
        });
    }
    let ratio = inside.fy / inside.fx;
    if !(0.9..=1.1).contains(&ratio) {
        findings.push(Finding::Aspect {
            camera: name(),
            ratio,
        });
    }
    let angle = |extent: f64, focal: f64| 2.0 * (0.5 * extent / focal).atan().to_degrees();
    let degrees = angle(width, inside.fx).max(angle(height, inside.fy));
    if !(3.0..=150.0).contains(&degrees) {
        findings.push(Finding::FieldOfView {
            camera: name(),
            degrees,
        });
    }
    let corners = [
        (0.0, 0.0),
        (width - 1.0, 0.0),
        (0.0, height - 1.0),
        (width - 1.0, height - 1.0),
    ];
    if corners
        .iter()
        .any(|&(u, v)| camera.undistort(&Point2::new(u, v)).is_none())
    {
        findings.push(Finding::LensRange { camera: name() });
    }
}

fn apart(a: &Camera, b: &Camera) -> Option<Finding> {
    let cameras = [a.name.clone(), b.name.clone()];
    let metres = (a.centre_in_world() - b.centre_in_world()).norm();
    let angle = a
        .camera_from_world
        .rotation
        .angle_to(&b.camera_from_world.rotation);
    if metres < 1e-6 && angle < 1e-6 {
        return Some(Finding::SamePose { cameras });
    }
    (!(0.1..=100.0).contains(&metres)).then_some(Finding::Distance { cameras, metres })
}

fn sees(camera: &Camera, point: &Point3<f64>) -> bool {
    let [width, height] = camera.intrinsics.size.map(f64::from);
    let pixel = camera.project(point);
    pixel.is_some_and(|p| (-0.5..width).contains(&p.x) && (-0.5..height).contains(&p.y))
}

/// How well a pair of cameras agrees on what both have seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairError {
    /// Positions of the two in the rig.
    pub cameras: [usize; 2],
    /// Points that both saw.
    pub n_points: usize,
    /// Median over the points of the distance to the epipolar line, mean of both directions, ideal pixels.
    pub median_px: f64,
}

/// How well a camera agrees with all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraError {
    /// Position in the rig.
    pub camera: usize,
    /// Pairs of observations in which it took part.
    pub n_points: usize,
    /// Median over those, ideal pixels.
    pub median_px: f64,
}

/// How well a rig agrees with correspondences.
#[derive(Debug, Clone, PartialEq)]
pub struct EpipolarReport {
    /// One for each pair that saw a point.
    pub pairs: Vec<PairError>,
    /// One for each camera that saw a point together with another.
    pub cameras: Vec<CameraError>,
}

/// Measures the epipolar error of a rig.
///
/// * `points`: for each point the pixel (recorded, distorted) in every camera of the rig, in its
///   order, `None` where it was not seen. Shorter lists are taken as not seen.
///
/// A camera whose median stands out is the one to calibrate again.
pub fn epipolar_check(rig: &Rig, points: &[Vec<Option<Point2<f64>>>]) -> EpipolarReport {
    let n = rig.cameras().len();
    let mut of_camera = vec![Vec::new(); n];
    let mut pairs = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            let errors = pair_errors(&rig.cameras()[a], &rig.cameras()[b], points, [a, b]);
            of_camera[a].extend_from_slice(&errors);
            of_camera[b].extend_from_slice(&errors);
            let n_points = errors.len();
            pairs.extend(median(errors).map(|median_px| PairError {
                cameras: [a, b],
                n_points,
                median_px,
            }));
        }
    }
    let cameras = of_camera
        .into_iter()
        .enumerate()
        .filter_map(|(camera, errors)| {
            let n_points = errors.len();
            median(errors).map(|median_px| CameraError {
                camera,
                n_points,
                median_px,
            })
        });
    EpipolarReport {
        pairs,
        cameras: cameras.collect(),
    }
}

fn pair_errors(
    a: &Camera,
    b: &Camera,
    points: &[Vec<Option<Point2<f64>>>],
    [i, j]: [usize; 2],
) -> Vec<f64> {
    let fundamental = epipolar::fundamental(a, b);
    let error = |point: &Vec<Option<Point2<f64>>>| {
        let in_a = a.undistorted_px(&(*point.get(i)?)?)?;
        let in_b = b.undistorted_px(&(*point.get(j)?)?)?;
        let [at_a, at_b] = epipolar::symmetric_distance(&fundamental, &in_a, &in_b)?;
        Some(0.5 * (at_a + at_b))
    };
    points.iter().filter_map(error).collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (
        values.get(values.len().checked_sub(1)? / 2)?,
        values.get(values.len() / 2)?,
    );
    Some(0.5 * (low + high))
}
