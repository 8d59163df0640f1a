//! Which way is up, where neither calibration nor deployment says it: from how cameras are held, and from people.

use capture::Feed;
use deployment::Deployment;
use fmp::{Layout, Search};
use footage::{Fill, Size, SourceSpec, Warp};
use geometry::{Camera, Framing, OutSize, Rig, upright_roll};
use kernels::Rgb8View;
use nalgebra::{Matrix3, SymmetricEigen, UnitVector3, Vector3};
use runtime::Failure;

use crate::inputs;

/// Pictures of a camera that are searched, and the frames between them.
const N_PICTURES: u64 = 2;
const STEP: u64 = 20;
/// Most cameras whose pictures are searched.
const MOST_VIEWS: usize = 4;
/// The longer side of a picture that is searched, at most.
const LONGEST_PX: f64 = 480.0;
/// Turns of a picture that differ by less are one, degrees.
const SAME_TURN: f64 = 12.0;
/// An axis of the world so near, degrees, is what is meant.
const NEAR_AXIS: f64 = 6.0;
/// Directions nearer to each other are not tried both, degrees.
const SAME_WAY: f64 = 10.0;
/// By so much, and by such a share, the score must be higher for another direction than that of cameras held level.
const LEAST_GAIN: f64 = 0.1;
const LEAST_SHARE: f64 = 0.2;

/// A direction against gravity, and why.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// The direction.
    pub up: [f64; 3],
    /// For people.
    pub why: String,
}

/// A direction that is tried, and how well people are found with it.
#[derive(Debug, Clone, Copy)]
struct Tried {
    up: UnitVector3<f64>,
    /// Mean over views and pictures of the best pose's score; none where nothing was found.
    score: Option<f64>,
}

/// Finds the vertical of a deployment that does not say it; none where it does, or where frames are not turned.
pub(crate) fn find(deployment: &Deployment) -> Result<Option<Found>, Failure> {
    let rig = inputs::rig_of(deployment)?;
    if rig.up_in_world().is_some() || !deployment.capture.upright {
        return Ok(None);
    }
    let named = deployment
        .cameras
        .iter()
        .filter_map(|it| rig.camera(&it.name));
    let cameras: Vec<Camera> = named.cloned().collect();
    let ways = ways(&cameras);
    let Some(level) = ways.first().copied() else {
        return Ok(None);
    };
    let mut pictures = Pictures::new(deployment, &cameras)?;
    let tried: Vec<Tried> = ways
        .iter()
        .map(|up| Tried {
            up: *up,
            score: pictures.score(*up),
        })
        .collect();
    let best = choose(&tried).unwrap_or(Tried {
        up: level,
        score: None,
    });
    Ok(Some(Found {
        up: best.up.into_inner().into(),
        why: why(&best, &tried, &cameras),
    }))
}

/// The direction with which people are found best; that of cameras held level if no other is clearly better.
fn choose(tried: &[Tried]) -> Option<Tried> {
    let level = tried.first()?;
    let score = |it: &Tried| it.score.unwrap_or(f64::NEG_INFINITY);
    let best = tried.iter().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    let gain = LEAST_GAIN + LEAST_SHARE * level.score.unwrap_or(0.0).abs();
    let is_clear = score(best) > score(level) + gain;
    Some(if is_clear { *best } else { *level })
}

fn why(best: &Tried, tried: &[Tried], cameras: &[Camera]) -> String {
    let text = |up: &UnitVector3<f64>| format!("[{:.3}, {:.3}, {:.3}]", up.x, up.y, up.z);
    let off = cameras.iter().map(|it| roll_degrees(it, &best.up).abs());
    let off = off.fold(0.0, f64::max);
    let others = tried.iter().filter(|it| it.up != best.up);
    let next = others.max_by(|a, b| {
        let score = |it: &Tried| it.score.unwrap_or(f64::NEG_INFINITY);
        score(a).total_cmp(&score(b))
    });
    let people = match (best.score, next.and_then(|it| Some((it.up, it.score?)))) {
        (Some(score), Some((up, other))) => format!(
            "people are found with a score of {score:.2}, with up = {} of {other:.2}",
            text(&up)
        ),
        (Some(score), None) => format!("people are found with a score of {score:.2}"),
        (None, _) => "nobody was found in the first pictures".to_owned(),
    };
    format!(
        "the calibration does not say which way is up; taken is up = {}: cameras are held within {off:.0} degrees of level, and \
         {people}; give `up` in the deployment if it is wrong, or to begin sooner",
        text(&best.up)
    )
}

/// Directions that may be up, the most likely first: that of cameras held level, the axes of the world, that of
/// cameras held upright, and the opposite ones.
fn ways(cameras: &[Camera]) -> Vec<UnitVector3<f64>> {
    let axis =
        |camera: &Camera, axis: Vector3<f64>| camera.camera_from_world.rotation.inverse() * axis;
    let all = |along: Vector3<f64>| -> Vec<Vector3<f64>> {
        cameras.iter().map(|it| axis(it, along)).collect()
    };
    let (right, down) = (all(Vector3::x()), all(Vector3::y()));
    let level = across(&right, -down.iter().sum::<Vector3<f64>>());
    let upright = across(&down, right.iter().sum());
    let world = [
        Vector3::z_axis(),
        -Vector3::z_axis(),
        Vector3::y_axis(),
        -Vector3::y_axis(),
        Vector3::x_axis(),
        -Vector3::x_axis(),
    ];
    let near = |it: UnitVector3<f64>| {
        let near = world
            .iter()
            .find(|axis| axis.angle(&it).to_degrees() < NEAR_AXIS);
        near.copied().unwrap_or(it)
    };
    let found = [level, upright].map(|it| it.map(near));
    let [level, upright] = found;
    let likely = level
        .into_iter()
        .chain(upright)
        .chain(upright.map(|it| -it));
    let opposite = level.map(|it| -it);
    let mut ways: Vec<UnitVector3<f64>> = Vec::new();
    for it in likely.chain(world).chain(opposite) {
        if ways
            .iter()
            .all(|other| other.angle(&it).to_degrees() > SAME_WAY)
        {
            ways.push(it);
        }
    }
    ways
}

/// The direction across to all of some, on the side of another: least squares, with less weight for those that are off.
fn across(all: &[Vector3<f64>], side: Vector3<f64>) -> Option<UnitVector3<f64>> {
    let mean = UnitVector3::try_new(side, 1e-6);
    let mut weights = vec![1.0; all.len()];
    let mut found = None;
    for _ in 0..5 {
        let weighted = all.iter().zip(&weights);
        let sum: Matrix3<f64> = weighted
            .map(|(it, weight)| it * it.transpose() * *weight)
            .sum();
        let eigen = SymmetricEigen::new(sum);
        let order = eigen.eigenvalues.iter().enumerate();
        let mut order: Vec<(usize, f64)> = order.map(|(nth, it)| (nth, *it)).collect();
        order.sort_by(|a, b| a.1.total_cmp(&b.1));
        // Of cameras that all look the same way, or at each other, any direction across to that will do.
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

/// The turn that makes a camera's picture upright, degrees; 0 where it looks along the vertical.
fn roll_degrees(camera: &Camera, up: &UnitVector3<f64>) -> f64 {
    let rig = Rig::new(vec![camera.clone()], Some(*up), "");
    let roll = rig.ok().and_then(|it| upright_roll(camera, &it));
    roll.unwrap_or(0.0).to_degrees()
}

/// The first pictures of some cameras, searched for people at one turn after the other.
struct Pictures<'a> {
    search: Search,
    views: Vec<View<'a>>,
}

struct View<'a> {
    camera: &'a Camera,
    size: Size,
    offset: Option<[u32; 2]>,
    rgb: Vec<Vec<u8>>,
    /// What was tried: the turn, degrees, and the mean score.
    tried: Vec<(f64, Option<f64>)>,
}

impl<'a> Pictures<'a> {
    fn new(deployment: &Deployment, cameras: &'a [Camera]) -> Result<Self, Failure> {
        let model = inputs::model_or_shipped(deployment.model.as_deref())?;
        let views = deployment.cameras.iter().take(MOST_VIEWS);
        let views = views.filter_map(|entry| {
            let camera = cameras.iter().find(|it| it.name == entry.name)?;
            View::new(entry, camera, &deployment.capture)
        });
        Ok(Self {
            search: Search::new(model),
            views: views.collect(),
        })
    }

    /// How well people are found with a direction as up.
    fn score(&mut self, up: UnitVector3<f64>) -> Option<f64> {
        let search = &self.search;
        let scores = self.views.iter_mut().filter_map(|it| it.score(search, up));
        let scores: Vec<f64> = scores.collect();
        let n = scores.len();
        (n > 0).then(|| scores.iter().sum::<f64>() / n as f64)
    }
}

impl<'a> View<'a> {
    /// What cannot be read is said by who reads it later.
    fn new(
        entry: &deployment::capture::Camera,
        camera: &'a Camera,
        capture: &deployment::capture::Config,
    ) -> Option<Self> {
        let spec = SourceSpec {
            start: capture.start_frame,
            step: STEP,
            count: Some(N_PICTURES),
            ..SourceSpec::new(entry.source.clone())
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
        let apart = |other: f64| ((degrees - other + 540.0).rem_euclid(360.0) - 180.0).abs();
        if let Some((_, score)) = self.tried.iter().find(|it| apart(it.0) < SAME_TURN) {
            return *score;
        }
        let scores: Vec<f64> = self
            .rgb
            .iter()
            .filter_map(|it| self.search_at(search, it, degrees))
            .collect();
        let n = scores.len();
        let score = (n > 0).then(|| scores.iter().sum::<f64>() / n as f64);
        self.tried.push((degrees, score));
        score
    }

    /// The best score in a picture that is turned.
    fn search_at(&self, search: &Search, rgb: &[u8], degrees: f64) -> Option<f64> {
        let [width, height] = self.camera.intrinsics.size.map(f64::from);
        // As large a frame as either way of holding the camera needs.
        let scale = (LONGEST_PX / width.max(height)).min(1.0);
        let side = (scale * width.max(height)).round() as u32;
        let source = [self.size.width, self.size.height].map(|it| it as u32);
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
        let best = search.on(image, &layout, |it| search.solver.best(it, None));
        best.map(|it| f64::from(it.score))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cameras of a ring, held with a turn about their axes, degrees, in a world whose up is `up`.
    fn ring(rolls: &[f64], up: UnitVector3<f64>) -> Vec<Camera> {
        let rig = scene::RigChoice::parse(&format!("ring:{}", rolls.len()));
        let rig = rig.unwrap().rig().unwrap();
        let turn = nalgebra::UnitQuaternion::rotation_between(&up, &rig.up_in_world().unwrap());
        let world = nalgebra::Isometry3::rotation(turn.unwrap().scaled_axis());
        let cameras = rig.cameras().iter().zip(rolls).map(|(it, roll)| {
            let roll = nalgebra::Isometry3::rotation(Vector3::z() * roll.to_radians());
            Camera {
                camera_from_world: roll * it.camera_from_world * world,
                ..it.clone()
            }
        });
        cameras.collect()
    }

    fn off_degrees(cameras: &[Camera], up: UnitVector3<f64>, nth: usize) -> f64 {
        ways(cameras)[nth].angle(&up).to_degrees()
    }

    #[test]
    fn cameras_held_level_say_which_way_is_up_even_if_one_is_not() {
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
    fn cameras_that_stand_on_their_sides_are_tried_next() {
        let up = UnitVector3::new_normalize(Vector3::new(0.2, 0.9, -0.3));
        for roll in [90.0, -90.0] {
            let cameras = ring(&[roll; 4], up);
            let near = [0, 1, 2].map(|nth| off_degrees(&cameras, up, nth));
            assert!(near.iter().any(|it| *it < 4.0), "{near:?}");
        }
    }

    #[test]
    fn people_overrule_cameras_only_if_they_are_found_clearly_better() {
        let tried = |score: Option<f64>, up| Tried { up, score };
        let [z, y] = [Vector3::z_axis(), Vector3::y_axis()];
        let up = |level, other| choose(&[tried(level, z), tried(other, y)]).unwrap().up;
        assert_eq!(up(Some(0.5), Some(0.55)), z);
        assert_eq!(up(Some(-0.5), Some(0.9)), y);
        assert_eq!(up(None, None), z);
        assert_eq!(up(None, Some(0.1)), y);
    }
}
