//! Finds the vertical if neither the calibration nor the deployment gives it. It is estimated from people: from heads and ankles in
//! keypoint files, or from the rotation at which people are found best in pictures.

mod kept;
mod keypoints;

use capture::{Blank, Feed};
use deployment::Deployment;
use failure::{ExitKind, Failure};
use fmp::{Layout, Search};
use footage::{Fill, Size, SourceSpec, Warp};
use geometry::{Camera, Framing, OutSize, Rig, upright_roll};
use kernels::Rgb8View;
use nalgebra::{Matrix3, SymmetricEigen, UnitVector3, Vector3};

/// Number of images per camera that are searched.
const N_PICTURES: u64 = 2;
/// Interval between these images, in frames.
const STEP: u64 = 20;
/// Maximum number of cameras whose images are searched.
const MAX_VIEWS: usize = 4;
/// Maximum length of the longer side of a searched image, in pixels.
const MAX_SIDE_PX: f64 = 480.0;
/// If two rotations of an image differ by less than this angle, in degrees, only one of them is searched.
const SAME_ROLL: f64 = 12.0;
/// A direction within this angle of a world axis, in degrees, is replaced by the axis.
const NEAR_AXIS: f64 = 6.0;
/// If two directions differ by less than this angle, in degrees, only one of them is tried.
const SAME_DIRECTION: f64 = 10.0;
/// Scores that differ by less than this count as equal. Of several directions with equal scores, the first is used. The first direction
/// tried is the one for level cameras.
const SAME_SCORE: f64 = 0.02;

/// The upward direction that was found, and the reason for the choice.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Vertical {
    /// Unit vector that points up in the world.
    pub up: [f64; 3],
    /// Reason for the choice, for the user.
    pub why: String,
}

/// A tried upward direction, and the score of the people found with it.
#[derive(Debug, Clone, Copy)]
struct Hypothesis {
    up: UnitVector3<f64>,
    /// Mean score of the best pose over views and images; `None` if nobody was found.
    score: Option<f64>,
}

/// Finds the vertical of a deployment. Returns `None` if the rig or the deployment gives it, or if frames are not turned upright.
///
/// The search is fast with keypoint files. With pictures it is slow, so its result is stored beside the rig and used again.
///
/// # Errors
///
/// Fails if inputs cannot be read, or there are neither pictures nor keypoints of people that show the upward direction.
pub(crate) fn find(deployment: &Deployment) -> Result<Option<Vertical>, Failure> {
    let rig = inputs::rig_of(deployment)?;
    if rig.up_in_world().is_some() || !deployment.capture.upright {
        return Ok(None);
    }
    let named = deployment.cameras.iter().filter_map(|camera| rig.camera(&camera.name));
    let cameras: Vec<Camera> = named.cloned().collect();
    if let Some(found) = keypoints::find(deployment, &cameras)? {
        return Ok(Some(found));
    }
    if let Some(kept) = kept::read(&deployment.rig, &cameras) {
        return Ok(Some(kept));
    }
    let directions = directions(&cameras);
    let Some(level) = directions.first().copied() else {
        return Ok(None);
    };
    let mut images = Images::new(deployment, &cameras)?;
    if images.views.is_empty() {
        let message = "the upward direction is not known: neither the calibration nor the deployment gives it, the keypoints have no people with \
                       heads and ankles, and there are no pictures";
        let hint = "set `up` in the deployment: the upward direction in the world of the calibration, such as [0, 0, 1]";
        return Err(Failure::new(ExitKind::Config, message).with_hint(hint));
    }
    tracing::warn!(
        "the calibration does not give the upward direction: searching for people in the first pictures of {} cameras, which takes up to half a \
         minute; set `up` in the deployment to avoid this",
        images.views.len()
    );
    let mut tried: Vec<Hypothesis> = Vec::new();
    for (nth, up) in directions.iter().enumerate() {
        let score = images.score(*up);
        tried.push(Hypothesis { up: *up, score });
        let found = score.map_or_else(
            || "nobody".to_owned(),
            |score| format!("people with a score of {score:.2}"),
        );
        tracing::warn!(
            "up = {}, {} of {}: {found}",
            text(up),
            nth + 1,
            directions.len()
        );
    }
    let best = choose(&tried).unwrap_or(Hypothesis {
        up: level,
        score: None,
    });
    let found = Vertical {
        up: best.up.into_inner().into(),
        why: reason(&best, &tried, &cameras),
    };
    if best.score.is_some() {
        kept::write(&deployment.rig, &cameras, &found);
    }
    Ok(Some(found))
}

/// Returns the hypothesis with the highest score; if several have the same score, the first is returned.
fn choose(tried: &[Hypothesis]) -> Option<Hypothesis> {
    let score = |hypothesis: &Hypothesis| hypothesis.score.unwrap_or(f64::NEG_INFINITY);
    let best = tried.iter().map(score).fold(f64::NEG_INFINITY, f64::max);
    tried.iter().find(|hypothesis| score(hypothesis) >= best - SAME_SCORE).copied()
}

fn text(up: &UnitVector3<f64>) -> String {
    format!("[{:.3}, {:.3}, {:.3}]", up.x, up.y, up.z)
}

fn reason(best: &Hypothesis, tried: &[Hypothesis], cameras: &[Camera]) -> String {
    let off = cameras.iter().map(|camera| roll_degrees(camera, &best.up).abs());
    let off = off.fold(0.0, f64::max);
    let others = tried.iter().filter(|tried| tried.up != best.up);
    let next = others.max_by(|a, b| {
        let score = |hypothesis: &Hypothesis| hypothesis.score.unwrap_or(f64::NEG_INFINITY);
        score(a).total_cmp(&score(b))
    });
    let people = match (
        best.score,
        next.and_then(|hypothesis| Some((hypothesis.up, hypothesis.score?))),
    ) {
        (Some(score), Some((up, other))) => format!(
            "people are found with a score of {score:.2}, but with up = {} the score is {other:.2}",
            text(&up)
        ),
        (Some(score), None) => format!("people are found with a score of {score:.2}"),
        (None, _) => "nobody was found in the first pictures".to_owned(),
    };
    format!(
        "the calibration does not give the upward direction; up = {} is used: cameras are level to within {off:.0} degrees, and \
         {people}; set `up` in the deployment if this is wrong, or to start faster",
        text(&best.up)
    )
}

/// Returns the directions to try, in this order: the direction that is up if the cameras are level, the two directions that are up if the
/// cameras are rolled by 90 degrees, the world axes, and the opposite of the first direction.
fn directions(cameras: &[Camera]) -> Vec<UnitVector3<f64>> {
    let axis =
        |camera: &Camera, axis: Vector3<f64>| camera.camera_from_world.rotation.inverse() * axis;
    let all = |along: Vector3<f64>| -> Vec<Vector3<f64>> {
        cameras.iter().map(|camera| axis(camera, along)).collect()
    };
    let (right, down) = (all(Vector3::x()), all(Vector3::y()));
    let level = common_normal(&right, -down.iter().sum::<Vector3<f64>>());
    let upright = common_normal(&down, right.iter().sum());
    let world = world_axes();
    let found = [level, upright].map(|axis| axis.map(snapped));
    let [level, upright] = found;
    let likely = level.into_iter().chain(upright).chain(upright.map(|upright| -upright));
    let opposite = level.map(|level| -level);
    let mut directions: Vec<UnitVector3<f64>> = Vec::new();
    for direction in likely.chain(world).chain(opposite) {
        if directions
            .iter()
            .all(|other| other.angle(&direction).to_degrees() > SAME_DIRECTION)
        {
            directions.push(direction);
        }
    }
    directions
}

fn world_axes() -> [UnitVector3<f64>; 6] {
    let [x, y, z] = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    [z, -z, y, -y, x, -x]
}

/// Returns the world axis close to a direction, or the direction itself if none is close.
fn snapped(direction: UnitVector3<f64>) -> UnitVector3<f64> {
    let is_near = |axis: &UnitVector3<f64>| axis.angle(&direction).to_degrees() < NEAR_AXIS;
    world_axes().into_iter().find(is_near).unwrap_or(direction)
}

/// Returns the direction perpendicular to all given vectors, by least squares with less weight for outliers.
///
/// * `side`: the result is less than 90 degrees from this direction. If the vectors do not determine a plane, the result is `side` itself.
fn common_normal(all: &[Vector3<f64>], side: Vector3<f64>) -> Option<UnitVector3<f64>> {
    let mean = UnitVector3::try_new(side, 1e-6);
    let mut weights = vec![1.0; all.len()];
    let mut found = None;
    for _ in 0..5 {
        let weighted = all.iter().zip(&weights);
        let sum: Matrix3<f64> =
            weighted.map(|(vector, weight)| vector * vector.transpose() * *weight).sum();
        let eigen = SymmetricEigen::new(sum);
        let order = eigen.eigenvalues.iter().enumerate();
        let mut order: Vec<(usize, f64)> = order.map(|(nth, value)| (nth, *value)).collect();
        order.sort_by(|a, b| a.1.total_cmp(&b.1));
        // The vectors are parallel, for example because all cameras look in the same direction or at each other.
        if order[1].1 < 0.02 * order[2].1 {
            return mean;
        }
        let normal: Vector3<f64> = eigen.eigenvectors.column(order[0].0).into_owned();
        let normal = if normal.dot(&side) < 0.0 {
            -normal
        } else {
            normal
        };
        for (weight, it) in weights.iter_mut().zip(all) {
            let off = it.dot(&normal).abs().min(1.0).asin().to_degrees();
            *weight = 1.0 / (1.0 + (off / 5.0).powi(2));
        }
        found = UnitVector3::try_new(normal, 1e-6);
    }
    found
}

/// Returns the roll that turns a camera's image upright, in degrees; 0 if the camera looks along the vertical.
fn roll_degrees(camera: &Camera, up: &UnitVector3<f64>) -> f64 {
    let rig = Rig::new(vec![camera.clone()], Some(*up), "");
    let roll = rig.ok().and_then(|rig| upright_roll(camera, &rig));
    roll.unwrap_or(0.0).to_degrees()
}

/// The first images of some cameras, which are searched for people at several rolls.
struct Images<'a> {
    search: Search,
    views: Vec<View<'a>>,
}

struct View<'a> {
    camera: &'a Camera,
    size: Size,
    offset: Option<[u32; 2]>,
    rgb: Vec<Vec<u8>>,
    /// Rolls that were searched, in degrees, and their mean scores.
    tried: Vec<(f64, Option<f64>)>,
}

impl<'a> Images<'a> {
    fn new(deployment: &Deployment, cameras: &'a [Camera]) -> Result<Self, Failure> {
        let model = inputs::model_or_shipped(deployment.paper.model.as_deref())?;
        // Cameras that have only keypoints have grey pictures, in which nobody can be found.
        let views = deployment.cameras.iter();
        let views = views.filter(|view| !Blank::is_blank(&view.source)).take(MAX_VIEWS);
        let views = views.filter_map(|entry| {
            let camera = cameras.iter().find(|camera| camera.name == entry.name)?;
            View::new(entry, camera, &deployment.capture)
        });
        Ok(Self {
            search: Search::new(model),
            views: views.collect(),
        })
    }

    /// Returns the mean score of the people found with an upward direction; `None` if nobody was found.
    fn score(&mut self, up: UnitVector3<f64>) -> Option<f64> {
        let search = &self.search;
        let scores = self.views.iter_mut().filter_map(|view| view.score(search, up));
        let scores: Vec<f64> = scores.collect();
        let n = scores.len();
        (n > 0).then(|| scores.iter().sum::<f64>() / n as f64)
    }
}

impl<'a> View<'a> {
    /// Reads the images. Returns `None` if the footage cannot be read. The error is reported when the footage is read later.
    fn new(
        entry: &deployment::capture::Camera,
        camera: &'a Camera,
        capture: &deployment::capture::Config,
    ) -> Option<Self> {
        let spec = SourceSpec {
            step: STEP,
            count: Some(N_PICTURES),
            ..crate::cameras::source(entry, capture)
        };
        let mut feed = Feed::open(&spec).ok()?;
        let mut rgb = Vec::new();
        while let Ok(Some(frame)) = feed.next_frame() {
            rgb.push(frame.rgb.to_vec());
        }
        Some(Self {
            camera,
            size: feed.info().size,
            offset: entry.source_offset_px,
            rgb,
            tried: Vec::new(),
        })
    }

    fn score(&mut self, search: &Search, up: UnitVector3<f64>) -> Option<f64> {
        let degrees = roll_degrees(self.camera, &up);
        let difference = |other: f64| ((degrees - other + 540.0).rem_euclid(360.0) - 180.0).abs();
        if let Some((_, score)) = self.tried.iter().find(|tried| difference(tried.0) < SAME_ROLL) {
            return *score;
        }
        let scores: Vec<f64> =
            self.rgb.iter().filter_map(|rgb| self.search_at(search, rgb, degrees)).collect();
        let n = scores.len();
        let score = (n > 0).then(|| scores.iter().sum::<f64>() / n as f64);
        self.tried.push((degrees, score));
        score
    }

    /// Returns the best score in an image rotated by an angle.
    fn search_at(&self, search: &Search, rgb: &[u8], degrees: f64) -> Option<f64> {
        let [width, height] = self.camera.intrinsics.size.map(f64::from);
        // The searched image is a square into which the picture fits at every roll.
        let scale = (MAX_SIDE_PX / width.max(height)).min(1.0);
        let side = (scale * width.max(height)).round() as u32;
        let source = [self.size.width, self.size.height].map(|value| value as u32);
        let roll = degrees.to_radians();
        let out = OutSize::Exact([side; 2]);
        let framing = Framing::new(self.camera, source, self.offset, out, roll).ok()?;
        let output = Size::new(side as usize, side as usize);
        let mut warp = Warp::new(
            self.size,
            output,
            &framing.source_from_output(),
            Fill::Black,
        )
        .ok()?;
        let mut turned = vec![0; output.rgb_bytes()];
        warp.apply(rgb, &mut turned);
        let image = Rgb8View::new(output.width, output.height, &turned).ok()?;
        let layout = Layout::new(&search.model, output.width, output.height).ok()?;
        let best = search.on(image, &layout, |responses| {
            search.solver.best(responses, None)
        });
        best.map(|pose| f64::from(pose.score))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns cameras in a ring, rolled about their axes by some degrees, in a world in which `up` points up.
    pub(super) fn ring(rolls: &[f64], up: UnitVector3<f64>) -> Vec<Camera> {
        let rig = scene::RigChoice::parse(&format!("ring:{}", rolls.len()));
        let rig = rig.unwrap().rig().unwrap();
        let turn = nalgebra::UnitQuaternion::rotation_between(&up, &rig.up_in_world().unwrap());
        let world = nalgebra::Isometry3::rotation(turn.unwrap().scaled_axis());
        let cameras = rig.cameras().iter().zip(rolls).map(|(camera, roll)| {
            let roll = nalgebra::Isometry3::rotation(Vector3::z() * roll.to_radians());
            Camera {
                camera_from_world: roll * camera.camera_from_world * world,
                ..camera.clone()
            }
        });
        cameras.collect()
    }

    fn off_degrees(cameras: &[Camera], up: UnitVector3<f64>, nth: usize) -> f64 {
        directions(cameras)[nth].angle(&up).to_degrees()
    }

    #[test]
    fn level_cameras_determine_the_vertical_even_if_one_is_rolled() {
        let odd = UnitVector3::new_normalize(Vector3::new(0.5, -0.7, 0.4));
        for up in [Vector3::z_axis(), -Vector3::y_axis(), odd] {
            for (rolls, most) in [
                ([0.0; 4], 1.0),
                ([2.0, -1.0, 0.0, 2.0], 4.0),
                ([2.0, -1.0, 0.0, 26.0], 15.0),
            ] {
                let off = off_degrees(&ring(&rolls, up), up, 0);
                assert!(off < most, "{rolls:?}: {off} degrees");
            }
        }
    }

    #[test]
    fn cameras_rotated_by_90_degrees_are_tried_next() {
        let up = UnitVector3::new_normalize(Vector3::new(0.2, 0.9, -0.3));
        for roll in [90.0, -90.0] {
            let cameras = ring(&[roll; 4], up);
            let near = [0, 1, 2].map(|nth| off_degrees(&cameras, up, nth));
            assert!(near.iter().any(|value| *value < 4.0), "{near:?}");
        }
    }

    #[test]
    fn the_better_score_wins_and_level_cameras_win_a_tie() {
        let tried = |score: Option<f64>, up| Hypothesis { up, score };
        let [z, y] = [Vector3::z_axis(), Vector3::y_axis()];
        let up = |level, other| choose(&[tried(level, z), tried(other, y)]).unwrap().up;
        assert_eq!(up(Some(0.5), Some(0.51)), z);
        assert_eq!(up(Some(0.5), Some(0.55)), y);
        assert_eq!(up(Some(-0.95), Some(-0.9)), y);
        assert_eq!(up(Some(0.9), Some(-0.5)), z);
        assert_eq!(up(None, None), z);
        assert_eq!(up(None, Some(0.1)), y);
    }
}
