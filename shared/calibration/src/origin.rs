//! Origin and up direction of the world: from a board on the floor, from three points, or from people who stand.
//!
//! The new world has z up and z = 0 on the floor.

use geometry::{Camera, Observation, Rig, RigError, Settings, TriangulateError, triangulate};
use nalgebra::{
    Isometry3, Matrix3, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector3,
};

use crate::board::{Sight, standing_board};
use crate::people::Floor;

/// Minimum sine of the angle at the origin of three points. A flatter triangle does not determine the floor.
const FLATTEST: f64 = 0.05;

/// Reason why no new origin was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OriginError {
    /// A point was seen by fewer than two cameras.
    #[error("point {point} is given in {views} cameras, but at least 2 are needed")]
    TooFewViews {
        /// Number of the point, counted from 1.
        point: usize,
        /// Number of cameras that saw the point.
        views: usize,
    },
    /// The rays from the cameras to a point do not meet.
    #[error(
        "the rays to point {point} miss each other by {rms_px:.1} px: was the same point marked in all cameras?"
    )]
    Apart {
        /// Number of the point, counted from 1.
        point: usize,
        /// Root mean square of the point's residuals, in pixels.
        rms_px: f64,
    },
    /// A point cannot be triangulated.
    #[error("point {point}")]
    Point {
        /// Number of the point, counted from 1.
        point: usize,
        /// Reason why the triangulation failed.
        source: TriangulateError,
    },
    /// The three points are on a line.
    #[error("the three points are on one line, or two of them are the same")]
    OnALine,
    /// No camera sees the board.
    #[error("no camera sees enough of the board")]
    NoBoard,
    /// Different cameras give different positions of the board.
    #[error(
        "the cameras disagree about the board by {rms_px:.1} px: did the board lie still, and is it the right board?"
    )]
    BoardApart {
        /// Root mean square of the residuals, in pixels.
        rms_px: f64,
    },
    /// The cameras are not valid in the new world.
    #[error("the rig is not valid in the new world frame")]
    Rig(#[from] RigError),
}

/// Index of a camera, and a pixel in its picture.
pub type Click = (usize, Point2<f64>);

/// Largest accepted residual, in pixels: of a clicked point, and of a board.
const CLICK_PX: f64 = 15.0;
const BOARD_PX: f64 = 5.0;

/// Finds the new world from three points on the floor: the origin, a point on the x axis, and any other point. The cameras must be
/// above the floor.
///
/// * `clicks`: the pixels of each point in the cameras that see it.
/// * Returns `new_from_old`.
///
/// # Errors
///
/// Fails with [`OriginError`].
pub fn from_points(rig: &Rig, clicks: &[Vec<Click>; 3]) -> Result<Isometry3<f64>, OriginError> {
    let mut points = [Point3::origin(); 3];
    for (nth, (point, clicks)) in points.iter_mut().zip(clicks).enumerate() {
        *point = place(rig, clicks, nth + 1)?;
    }
    let [origin, along, other] = points;
    let normal = (along - origin).cross(&(other - origin));
    let sides = (along - origin).norm() * (other - origin).norm();
    let height = normal.norm();
    if height.is_nan() || height <= FLATTEST * sides {
        return Err(OriginError::OnALine);
    }
    let above = mean_centre(rig) - origin;
    let up = normal * normal.dot(&above).signum();
    Ok(frame(origin, along - origin, up))
}

fn place(rig: &Rig, clicks: &[Click], point: usize) -> Result<Point3<f64>, OriginError> {
    if clicks.len() < 2 {
        let views = clicks.len();
        return Err(OriginError::TooFewViews { point, views });
    }
    let seen: Vec<Observation<'_>> = clicks
        .iter()
        .map(|(camera, at)| Observation {
            camera: &rig.cameras()[*camera],
            point_px: *at,
            sigma_px: 1.0,
        })
        .collect();
    let found = triangulate(&seen, &Settings::default());
    let found = found.map_err(|source| OriginError::Point { point, source })?;
    let squares = seen.iter().map(|seen| {
        let image = seen.camera.project(&found.in_world);
        image.map_or(1e6, |image| (image - seen.point_px).norm_squared())
    });
    let rms_px = (squares.sum::<f64>() / clicks.len() as f64).sqrt();
    if rms_px > CLICK_PX {
        return Err(OriginError::Apart { point, rms_px });
    }
    Ok(found.in_world)
}

/// Finds the new world from a board that lies on the floor with the printed side up. The origin is the upper left corner of the board. The
/// x axis points along its rows; the y axis points against its columns.
///
/// # Errors
///
/// Fails with [`OriginError`].
pub fn from_board(
    rig: &Rig,
    board: &[Point2<f64>],
    sights: &[Sight],
) -> Result<Isometry3<f64>, OriginError> {
    let (world_from_board, rms_px) =
        standing_board(rig.cameras(), board, sights).ok_or(OriginError::NoBoard)?;
    if rms_px.is_nan() || rms_px > BOARD_PX {
        return Err(OriginError::BoardApart { rms_px });
    }
    let along = world_from_board * Vector3::x();
    let up = world_from_board * -Vector3::z();
    Ok(frame(world_from_board * Point3::origin(), along, up))
}

/// Finds the new world from the floor that people stood on. The origin is the centre of their positions, and the x axis is as near as
/// possible to the x axis of the old world.
pub fn from_floor(floor: &Floor) -> Isometry3<f64> {
    let along = match floor.up.x.abs() {
        x if x < 0.9 => Vector3::x(),
        _ => Vector3::y(),
    };
    frame(floor.middle, along, floor.up.into_inner())
}

/// Returns the transformation `new_from_old` to a world with the given origin. Its z axis is `up`, and its x axis is as near as possible to
/// `along`.
fn frame(origin: Point3<f64>, along: Vector3<f64>, up: Vector3<f64>) -> Isometry3<f64> {
    let z = up.scale(1.0 / up.norm());
    let flat = along - z * z.dot(&along);
    let x = flat.scale(1.0 / flat.norm());
    let rows = Matrix3::from_columns(&[x, z.cross(&x), z]).transpose();
    let rotation = Rotation3::from_matrix_unchecked(rows);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Isometry3::from_parts(Translation3::from(rotation * -origin.coords), rotation)
}

fn mean_centre(rig: &Rig) -> Point3<f64> {
    let cameras = rig.cameras();
    let sum: Vector3<f64> = cameras.iter().map(|camera| camera.centre_in_world().coords).sum();
    Point3::from(sum / cameras.len() as f64)
}

/// Returns the rig in the new world, with z up.
///
/// # Errors
///
/// Fails with [`OriginError::Rig`].
pub fn rebased(rig: &Rig, new_from_old: &Isometry3<f64>, source: &str) -> Result<Rig, OriginError> {
    let old_from_new = new_from_old.inverse();
    let cameras = rig.cameras().iter().map(|camera| Camera {
        camera_from_world: camera.camera_from_world * old_from_new,
        ..camera.clone()
    });
    let text = match rig.source() {
        "" => source.to_owned(),
        before => format!("{before}; {source}"),
    };
    Ok(Rig::new(cameras.collect(), Some(Vector3::z_axis()), text)?)
}

#[cfg(test)]
mod tests {
    use geometry::{Intrinsics, Lens};

    use super::*;

    fn rig() -> Rig {
        let camera = |name: &str, at: Point3<f64>| {
            let rotation = UnitQuaternion::look_at_rh(&(Point3::origin() - at), &Vector3::z());
            let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
            let rotation = flip * rotation;
            Camera {
                name: name.to_owned(),
                intrinsics: Intrinsics {
                    fx: 800.0,
                    fy: 800.0,
                    cx: 640.0,
                    cy: 360.0,
                    size: [1280, 720],
                    lens: Lens::default(),
                },
                camera_from_world: Isometry3::from_parts(
                    Translation3::from(rotation * -at.coords),
                    rotation,
                ),
            }
        };
        let cameras = vec![
            camera("a", Point3::new(3.0, -2.0, 1.8)),
            camera("b", Point3::new(-3.0, -2.0, 1.6)),
            camera("c", Point3::new(0.0, 3.0, 2.1)),
        ];
        Rig::new(cameras, None, "given").unwrap()
    }

    /// Returns a rig in its own world, and the same rig in a different world.
    fn moved() -> (Rig, Rig) {
        let truth = rig();
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
        let away = Isometry3::from_parts(Translation3::new(4.0, 1.0, -2.0), rotation);
        let cameras = truth.cameras().iter().map(|camera| Camera {
            camera_from_world: camera.camera_from_world * away.inverse(),
            ..camera.clone()
        });
        let moved = Rig::new(cameras.collect(), None, "moved").unwrap();
        (truth, moved)
    }

    fn is_same(found: &Rig, truth: &Rig) {
        for (found, truth) in found.cameras().iter().zip(truth.cameras()) {
            let off = (found.centre_in_world() - truth.centre_in_world()).norm();
            assert!(off < 1e-6, "{off}");
        }
        assert_eq!(found.up_in_world(), Some(Vector3::z_axis()));
    }

    #[test]
    fn three_points_on_the_floor_in_any_order_define_the_floor_of_the_rig() {
        let (truth, moved) = moved();
        for other in [[0.2, 1.0], [0.5, -1.2]] {
            let points = [[0.0, 0.0], [1.0, 0.0], other];
            let clicks = points.map(|[x, y]| -> Vec<Click> {
                let at = |nth: usize| truth.cameras()[nth].project(&Point3::new(x, y, 0.0));
                [0, 2].into_iter().filter_map(|nth| Some((nth, at(nth)?))).collect()
            });
            let found = from_points(&moved, &clicks).unwrap();
            is_same(&rebased(&moved, &found, "three points").unwrap(), &truth);
            let mut line = clicks.clone();
            line[2] = line[1].clone();
            assert_eq!(from_points(&moved, &line), Err(OriginError::OnALine));
            line[2].truncate(1);
            assert!(matches!(
                from_points(&moved, &line),
                Err(OriginError::TooFewViews { .. })
            ));
        }
    }

    #[test]
    fn a_board_on_the_floor_defines_the_floor_of_the_rig() {
        let (truth, moved) = moved();
        let board: Vec<Point2<f64>> = (0..20)
            .map(|nth| Point2::new(0.1 * f64::from(nth % 5), 0.1 * f64::from(nth / 5)))
            .collect();
        let sights: Vec<Sight> = (0..3)
            .map(|nth| {
                let corners = board.iter().enumerate().filter_map(|(id, it)| {
                    let on_floor = Point3::new(it.x, -it.y, 0.0);
                    Some((id, truth.cameras()[nth].project(&on_floor)?))
                });
                Sight::new(nth, 0, corners, &board)
            })
            .collect();
        let found = from_board(&moved, &board, &sights).unwrap();
        is_same(&rebased(&moved, &found, "a board").unwrap(), &truth);
        assert_eq!(from_board(&moved, &board, &[]), Err(OriginError::NoBoard));
    }
}
