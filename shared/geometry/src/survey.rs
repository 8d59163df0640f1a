//! Measures of a rig to compare with a tape measure: heights, distances, the shared space, and the expected accuracy.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::{Camera, Rig};

/// Spacing of the points that are tried for the shared space, in metres.
const STEP_M: f64 = 0.2;
/// Maximum distance from the focus at which points are tried, in metres.
const REACH_M: f64 = 4.0;

/// Measures of a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Cameras in the order of the rig.
    pub cameras: Vec<Place>,
    /// Smallest and largest distance between two cameras, in metres.
    pub apart_m: Option<[f64; 2]>,
    /// Point nearest to all optical axes, in the world.
    pub focus: Option<Point3<f64>>,
    /// The space that all cameras see; `None` if there is none.
    pub shared: Option<Shared>,
    /// Expected error of a point at the focus, in millimetres: the square root of the sum of the variances along the three axes. Every view
    /// that sees the point is assumed to have an error of one pixel (standard deviation, in x and y).
    pub error_mm: Option<f64>,
}

/// Position of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name of the camera.
    pub name: String,
    /// Height above the origin of the world, in metres; `None` if the rig has no up direction.
    pub height_m: Option<f64>,
    /// Distance to the focus, in metres.
    pub distance_m: Option<f64>,
}

/// Space around the focus that all cameras see, up to four metres away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shared {
    /// Sides of the box around the space, along the axes of the world, in metres.
    pub sides_m: [f64; 3],
    /// Volume of the space, in cubic metres.
    pub volume_m3: f64,
}

/// Measures a rig.
pub fn survey(rig: &Rig) -> Survey {
    let focus = rig.focus();
    let cameras = rig.cameras();
    let places = cameras.iter().map(|camera| {
        let centre = camera.centre_in_world();
        Place {
            name: camera.name.clone(),
            height_m: rig.up_in_world().map(|up| up.dot(&centre.coords)),
            distance_m: focus.map(|focus| (centre - focus).norm()),
        }
    });
    let pairs = cameras.iter().enumerate().flat_map(|(nth, one)| {
        let others = cameras[nth + 1..].iter();
        others.map(|other| (one.centre_in_world() - other.centre_in_world()).norm())
    });
    Survey {
        cameras: places.collect(),
        apart_m: pairs
            .map(|metres| [metres; 2])
            .reduce(|[least, most], [metres, _]| [least.min(metres), most.max(metres)]),
        focus,
        shared: focus.and_then(|focus| shared(cameras, &focus)),
        error_mm: focus.and_then(|focus| error_mm(cameras, &focus)),
    }
}

fn sees(camera: &Camera, point: &Point3<f64>) -> bool {
    let pixel = camera.project(point);
    pixel.is_some_and(|pixel| {
        let [width, height] = camera.intrinsics.size.map(f64::from);
        (-0.5..width - 0.5).contains(&pixel.x) && (-0.5..height - 0.5).contains(&pixel.y)
    })
}

fn shared(cameras: &[Camera], focus: &Point3<f64>) -> Option<Shared> {
    let n = (REACH_M / STEP_M) as i32;
    let along = move || -n..=n;
    let steps =
        along().flat_map(move |x| along().flat_map(move |y| along().map(move |z| [x, y, z])));
    let offsets = steps.map(|step| Vector3::from(step.map(f64::from)) * STEP_M);
    let (mut n_points, mut corners) = (0_u32, None);
    for offset in
        offsets.filter(|offset| cameras.iter().all(|camera| sees(camera, &(focus + offset))))
    {
        n_points += 1;
        let [low, high] = corners.unwrap_or([offset; 2]);
        corners = Some([low.inf(&offset), high.sup(&offset)]);
    }
    let [low, high] = corners?;
    Some(Shared {
        sides_m: (high - low).add_scalar(STEP_M).into(),
        volume_m3: f64::from(n_points) * STEP_M.powi(3),
    })
}

fn error_mm(cameras: &[Camera], focus: &Point3<f64>) -> Option<f64> {
    let seeing = cameras.iter().filter(|camera| sees(camera, focus));
    let derivatives = seeing.filter_map(|camera| camera.project_with_jacobian(focus));
    let information = derivatives.fold(Matrix3::zeros(), |sum, (_, by_point)| {
        sum + by_point.transpose() * by_point
    });
    let covariance = information.try_inverse()?;
    let variance = covariance.trace();
    (variance.is_finite() && variance > 0.0).then(|| 1000.0 * variance.sqrt())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitVector3};

    use super::*;
    use crate::{Intrinsics, Lens};

    /// Returns four cameras in a square of 4 m, 1.5 m high, looking at its centre at that height.
    fn square() -> Rig {
        let cameras = [[2.0, 2.0], [-2.0, 2.0], [-2.0, -2.0], [2.0, -2.0]];
        let cameras = cameras.iter().enumerate().map(|(nth, [x, y])| {
            let eye = Point3::new(*x, *y, 1.5);
            let target = Point3::new(0.0, 0.0, 1.5);
            // The camera looks along +z with y down.
            let camera_from_world = Isometry3::look_at_lh(&eye, &target, &-Vector3::z());
            Camera {
                name: format!("c{nth}"),
                intrinsics: Intrinsics {
                    size: [640, 480],
                    fx: 500.0,
                    fy: 500.0,
                    cx: 319.5,
                    cy: 239.5,
                    lens: Lens::default(),
                },
                camera_from_world,
            }
        });
        let up = UnitVector3::new_normalize(Vector3::z());
        Rig::new(cameras.collect(), Some(up), "test".to_owned()).unwrap()
    }

    #[test]
    fn the_survey_of_a_square_of_cameras_gives_its_dimensions() {
        let survey = survey(&square());
        let close = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-9, "{got}");
        for place in &survey.cameras {
            close(place.height_m.unwrap(), 1.5);
            close(place.distance_m.unwrap(), 8.0_f64.sqrt());
        }
        let [least, most] = survey.apart_m.unwrap();
        close(least, 4.0);
        close(most, 32.0_f64.sqrt());
        // Across each axis, a pixel is 2.83 m / 500 px = 5.66 mm. Four views determine the height; two views determine each other axis.
        let pixel_mm = 1000.0 * 8.0_f64.sqrt() / 500.0;
        close(
            survey.error_mm.unwrap(),
            pixel_mm * (0.25 + 0.5 + 0.5_f64).sqrt(),
        );
    }

    #[test]
    fn the_shared_space_is_the_space_that_all_cameras_see() {
        let shared = survey(&square()).shared.unwrap();
        // At the centre a view is 3.6 m wide and 2.7 m high.
        assert!((1.5..=3.0).contains(&shared.sides_m[2]), "{shared:?}");
        let [x, y, _] = shared.sides_m;
        assert!(
            (x - y).abs() < 1e-9 && (2.0..4.5).contains(&x),
            "{shared:?}"
        );
        assert!((4.0..30.0).contains(&shared.volume_m3), "{shared:?}");
    }
}
