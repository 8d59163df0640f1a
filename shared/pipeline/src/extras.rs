//! Triangulates extra keypoints: points on the face, feet or hands that some networks find in addition to the joints of the skeleton.
//!
//! The tree model does not contain them, so each is triangulated separately. Only the views that found the keypoint on the person chosen
//! by fusion are used.

use geometry::{Camera, Observation, Settings, Triangulated};
use keypoints::mirrored;
use nalgebra::Point2;
use skeleton::{PARSE14, SIDES};

use crate::bodies::NoJoint;
use crate::fused_view::FusedView;
use crate::motion::Motion;
use crate::sighting::ViewSightings;
use crate::skeleton_step::Skeleton;
use crate::space::by_view;
use crate::view_result::ExtraKeypoint;

/// Maximum median distance between the joints of a candidate and of the fused pose, as a fraction of the longer side of the fused pose. A
/// candidate farther away is taken for another person.
const SAME: f64 = 0.1;
/// A view is left out if its point is more than this many standard deviations away.
const MOST_SIGMAS: f64 = 3.0;
/// A view is only left out if its point is at least this far away, as a fraction of the longer side of the fused pose.
const LEAST_REACH: f64 = 0.02;
/// Maximum distance of a keypoint from the nearest joint of its person, in metres.
const MOST_FROM_JOINTS_M: f64 = 0.5;

/// Pairs of left and right joints of `skeleton::PARSE14` that show which side a view labels as left: knees and ankles, elbows and wrists,
/// hips and shoulders.
const LEGS: [[usize; 2]; 2] = [SIDES[0], SIDES[1]];
const ARMS: [[usize; 2]; 2] = [SIDES[3], SIDES[4]];
const TRUNK: [[usize; 2]; 2] = [SIDES[2], SIDES[5]];

/// An extra keypoint.
#[derive(Debug)]
struct Extra {
    /// Index of the same keypoint on the other side of the body; the keypoint's own index if it has no side.
    mirror: usize,
    /// The joint pairs that determine whether this keypoint is on the left or on the right.
    sides: [[usize; 2]; 2],
}

/// Triangulates the extra keypoints of a rig.
#[derive(Debug)]
pub struct ExtrasStep {
    cameras: Vec<Camera>,
    extras: Vec<Extra>,
    triangulation: Settings,
}

/// The person's candidate in a view.
struct Match {
    /// Time since the network ran on the person, in seconds.
    age_s: f64,
    view: usize,
    /// The extra keypoints, moved to the instant of the frame.
    extras: Vec<ExtraKeypoint>,
    /// Positions of the joints in the candidate and after fusion, in pixels of the frame.
    joints: [Vec<[f64; 2]>; 2],
    /// Longer side of the fused pose, in pixels of the frame.
    longer_px: f64,
}

impl ExtrasStep {
    /// Prepares the step.
    ///
    /// * `names`: names of the keypoints, in the order used by every view.
    pub fn new(names: &[String], cameras: Vec<Camera>, triangulation: Settings) -> Self {
        let number = |name: &String| names.iter().position(|known| known == name);
        let extra = |(own, name): (usize, &String)| Extra {
            mirror: mirrored(name).and_then(|mirror| number(&mirror)).unwrap_or(own),
            sides: sides_of(name),
        };
        Self {
            extras: names.iter().enumerate().map(extra).collect(),
            cameras,
            triangulation,
        }
    }

    /// Returns the number of extra keypoints of a person.
    pub fn n_keypoints(&self) -> usize {
        self.extras.len()
    }

    /// Triangulates the extra keypoints of a frame.
    ///
    /// * `views`: in the rig's order; `None` for a view without a result.
    /// * `motion`: motion of the extra keypoints, after [`Motion::begin`]; used to move them to the instant of the frame.
    /// * Returns one entry for every name.
    pub fn run(
        &self,
        skeleton: &Skeleton,
        views: &[Option<ViewSightings>],
        motion: &mut Motion,
    ) -> Vec<Result<Triangulated, NoJoint>> {
        let each = views.iter().zip(&skeleton.views).enumerate();
        let matches: Vec<Match> = each
            .filter_map(|(view, (found, fused))| {
                let found = found.as_ref()?;
                let mut it = self.person(view, found, fused.as_ref()?)?;
                it.move_to_instant(found.skew_s - it.age_s, motion);
                Some(it)
            })
            .collect();
        let of_extra = |extra: usize| {
            let found = self.triangulate(extra, &matches)?;
            let mut known = skeleton.joints.iter().flatten();
            let is_near =
                known.any(|joint| (joint.in_world - found.in_world).norm() < MOST_FROM_JOINTS_M);
            is_near.then_some(found).ok_or(NoJoint::Implausible)
        };
        (0..self.extras.len()).map(of_extra).collect()
    }

    /// Returns the candidate of a view that shows the person.
    fn person(&self, view: usize, found: &ViewSightings, fused: &FusedView) -> Option<Match> {
        if fused.pose.centres_px.len() != skeleton::N_PARTS {
            return None;
        }
        let joints = PARSE14.from_parts(&fused.pose.centres_px);
        let known = joints.iter().copied().filter(|joint| joint[0].is_finite());
        let longer_px = geometry::longer_side(known)?;
        // The last people in the list may have no extra keypoints.
        let told = found.people.iter();
        let told = told.filter(|sighting| sighting.extras.len() == self.extras.len());
        let of_candidate = told.map(|sighting| {
            let own = sighting.places(false).to_vec();
            (middle_distance(&own, &joints), own, sighting)
        });
        let nearest = of_candidate.min_by(|a, b| a.0.total_cmp(&b.0));
        let (distance, own, sighting) = nearest?;
        (distance < SAME * longer_px).then_some(Match {
            view,
            extras: sighting.extras.clone(),
            age_s: sighting.age_s.into(),
            joints: [own, joints],
            longer_px,
        })
    }

    fn triangulate(&self, extra: usize, matches: &[Match]) -> Result<Triangulated, NoJoint> {
        let Extra { mirror, sides } = &self.extras[extra];
        let mut views = Vec::with_capacity(matches.len());
        let mut observations = Vec::with_capacity(matches.len());
        let mut reach: f64 = 0.0;
        for it in matches {
            let named = if it.is_exchanged(sides) {
                *mirror
            } else {
                extra
            };
            let Some((at, sigma_px)) = it.extras[named] else {
                continue;
            };
            reach = reach.max((MOST_SIGMAS * sigma_px).max(LEAST_REACH * it.longer_px));
            views.push(it.view);
            observations.push(Observation {
                camera: &self.cameras[it.view],
                point_px: Point2::from(at),
                sigma_px,
            });
        }
        let most = self.triangulation.max_reprojection_px.unwrap_or(reach);
        let settings = Settings {
            max_reprojection_px: Some(most.min(reach)),
            ..self.triangulation
        };
        let found = geometry::triangulate(&observations, &settings)?;
        Ok(by_view(found, views.into_iter()))
    }
}

impl Match {
    /// Moves the keypoints of a picture taken at another time to the instant of the frame.
    fn move_to_instant(&mut self, skew_s: f64, motion: &mut Motion) {
        let points = self.extras.iter();
        let points = points.map(|point| point.map(|found| Point2::from(found.0))).collect();
        let moved = motion.since_instant(self.view, [skew_s; 2], points);
        for (extra, by) in self.extras.iter_mut().zip(moved.into_iter().flatten()) {
            if let Some((at, _)) = extra {
                *at = [at[0] - by.x, at[1] - by.y];
            }
        }
    }

    /// Returns true if the view labels the person's right side as left, judged by two pairs of joints.
    fn is_exchanged(&self, sides: &[[usize; 2]; 2]) -> bool {
        let [own, fused] = &self.joints;
        let distance = |a: usize, b: usize| distance(own[a], fused[b]);
        let each = sides.iter();
        let same: f64 = each.map(|&[r, l]| distance(r, r) + distance(l, l)).sum();
        let each = sides.iter();
        let other: f64 = each.map(|&[r, l]| distance(r, l) + distance(l, r)).sum();
        other < same
    }
}

/// Returns the joint pairs that determine whether a keypoint is on the left or on the right.
fn sides_of(name: &str) -> [[usize; 2]; 2] {
    let has = |words: &[&str]| words.iter().any(|word| name.contains(word));
    if has(&["toe", "heel", "foot", "ankle", "knee"]) {
        LEGS
    } else if has(&["hand", "finger", "thumb", "index", "pinky", "palm", "wrist"]) {
        ARMS
    } else {
        TRUNK
    }
}

/// Returns the median distance of the joints; left and right of each pair may be swapped.
fn middle_distance(own: &[[f64; 2]], fused: &[[f64; 2]]) -> f64 {
    let mirror = |joint: usize| {
        let pair = SIDES.iter().find(|side| side.contains(&joint));
        pair.map_or(joint, |&[right, left]| right + left - joint)
    };
    let each = (0..own.len()).map(|joint| {
        let direct = distance(own[joint], fused[joint]);
        direct.min(distance(own[joint], fused[mirror(joint)]))
    });
    let seen = each.filter(|distance| distance.is_finite());
    let middle = statistics::Sorted::new(seen.collect::<Vec<f64>>()).upper_median();
    middle.unwrap_or(f64::INFINITY)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests;
