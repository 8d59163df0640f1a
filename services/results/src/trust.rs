//! Judges how far the results can be trusted, from the results for the followed person, frame by frame.

use std::collections::BTreeMap;

use messages::{Sides, SkeletonMessage, Status};
use nalgebra::Vector3;
use runfiles::{Doubt, Trust};

use crate::height::height_px;
use crate::pose3d::is_placed;

/// Width of a bin of the histogram of bone lengths, in metres.
const LENGTH_STEP_M: f64 = 0.001;
/// Upper end of the histogram of bone lengths, in metres. Longer bones are counted in the last bin.
const LONGEST_M: f64 = 1.0;
/// Movement of the middle of a body that is always accepted between two results, in metres.
const FARTHEST_M: f64 = 0.5;
/// Speed up to which a larger movement between two results is accepted, in metres per second.
const FASTEST_M_S: f64 = 6.0;
/// Distance by which a joint must leave its path to count as jumping, in metres, and acceleration above which it must do so, in metres per
/// second squared. Chosen from the runs in docs/guide/run.md.
const OFF_PATH_M: f64 = 0.15;
const LEAST_M_S2: f64 = 500.0;
/// Maximum time from the first to the last of the three results with which a path is judged, in seconds.
const PATH_S: f64 = 0.2;
/// Ratio of the standard deviation to the median absolute deviation, for normally distributed errors.
const SD_PER_MAD: f64 = 1.4826;

/// Width of a bin of the histogram of body deviations, in standard deviations.
const STEP: f64 = 0.05;
/// Width of a bin of the histogram of reprojection errors, as a fraction of the person's height.
const ERROR_STEP: f64 = 0.001;

/// The joints at the time of a result.
#[derive(Debug)]
struct Instant {
    time_s: f64,
    joints: Vec<Option<Vector3<f64>>>,
}

/// Collects evidence for and against the results.
#[derive(Debug, Default)]
pub(crate) struct Trusted {
    frames: u64,
    n_implausible: u64,
    n_decided: u64,
    n_unsure: u64,
    n_joints: u64,
    n_joints_implausible: u64,
    /// For each deviation, in units of [`STEP`], the number of bodies with this deviation.
    deviations: BTreeMap<u32, u64>,
    /// For each reprojection error, in units of [`ERROR_STEP`], the number of joints with this error.
    errors: BTreeMap<u32, u64>,
    /// Sum of the distances of the views' joints from the result, in metres, and number of distances.
    distances: (f64, u64),
    /// For each bone, the number of results by its length, in units of [`LENGTH_STEP_M`].
    lengths: BTreeMap<(usize, usize), Vec<u32>>,
    /// Time of the last result in seconds, and position of its body.
    last: Option<(f64, Vector3<f64>)>,
    n_jumps: u64,
    /// The last two results: time in seconds, and positions of the joints.
    path: [Option<Instant>; 2],
    n_limb_jumps: u64,
    warned: Vec<Doubt>,
}

impl Trusted {
    /// Adds the person who is followed in a result. Warns once for each reason not to trust the results.
    ///
    /// The arguments are as for [`Trusted::count`].
    pub(crate) fn add(
        &mut self,
        person: Option<&SkeletonMessage>,
        limbs: &[(usize, usize)],
        seen: (Option<f64>, &[f64]),
    ) {
        let Some(pose) = person else {
            return;
        };
        if !self.count(pose, limbs, seen) {
            return;
        }
        for doubt in self.trust().doubts() {
            if !self.warned.iter().any(|known| known.is_like(&doubt)) {
                tracing::warn!("the results may be wrong: {doubt}");
                self.warned.push(doubt);
            }
        }
    }

    /// Adds a person in a result. Returns false for skeletons of something other than people, which are not judged.
    ///
    /// * `limbs`: pairs of joints that are connected by a bone.
    /// * `time_s`: time of the frame in seconds, if it is known.
    /// * `distances_m`: distances of the views' joints from the result, in metres.
    pub(crate) fn count(
        &mut self,
        pose: &SkeletonMessage,
        limbs: &[(usize, usize)],
        (time_s, distances_m): (Option<f64>, &[f64]),
    ) -> bool {
        let is_nobody = pose.status == Status::IMPLAUSIBLE;
        let is_body = pose.status == Status::OK && pose.stature_m > 0.0;
        if !is_body && !is_nobody {
            return false;
        }
        self.frames += 1;
        self.n_implausible += u64::from(is_nobody);
        if !is_nobody {
            self.skeleton(pose);
            self.bones(pose, limbs);
            self.moved(pose, time_s);
            self.distances.0 += distances_m.iter().sum::<f64>();
            self.distances.1 += distances_m.len() as u64;
        }
        true
    }

    fn skeleton(&mut self, pose: &SkeletonMessage) {
        self.n_decided += u64::from(pose.sides != Sides::AS_SEEN);
        self.n_unsure += u64::from(pose.sides == Sides::UNSURE);
        if pose.body_deviation.is_finite() {
            let step = (pose.body_deviation / STEP).round() as u32;
            *self.deviations.entry(step).or_default() += 1;
        }
        let height_px = mean_height_px(pose);
        for joint in pose.listed_joints() {
            self.n_joints += 1;
            self.n_joints_implausible += u64::from(joint.status == Status::IMPLAUSIBLE);
            if let Some(height_px) = height_px.filter(|_| joint.status == Status::OK)
                && joint.reprojection_px.is_finite()
            {
                let step = (joint.reprojection_px / height_px / ERROR_STEP).round() as u32;
                *self.errors.entry(step).or_default() += 1;
            }
        }
    }

    fn bones(&mut self, pose: &SkeletonMessage, limbs: &[(usize, usize)]) {
        for bone in limbs {
            if let (Some(one), Some(other)) = (place(pose, bone.0), place(pose, bone.1)) {
                let step = (one - other).norm().min(LONGEST_M) / LENGTH_STEP_M;
                let n_steps = (LONGEST_M / LENGTH_STEP_M) as usize + 1;
                let counts = self.lengths.entry(*bone).or_insert_with(|| vec![0; n_steps]);
                counts[(step as usize).min(n_steps - 1)] += 1;
            }
        }
    }

    fn moved(&mut self, pose: &SkeletonMessage, time_s: Option<f64>) {
        let places = (0..pose.n_joints as usize).filter_map(|joint| place(pose, joint));
        let (sum, n) = places.fold((Vector3::zeros(), 0), |(sum, n), at| (sum + at, n + 1));
        let Some(now_s) = time_s.filter(|_| n > 0) else {
            return;
        };
        self.limbs_moved(pose, now_s);
        let middle = sum / f64::from(n);
        if let Some((before_s, before)) = self.last {
            let farthest = FARTHEST_M.max(FASTEST_M_S * (now_s - before_s));
            self.n_jumps += u64::from((middle - before).norm() > farthest);
        }
        self.last = Some((now_s, middle));
    }

    /// Counts a result if a joint of the result before it is off the path between its neighbours.
    fn limbs_moved(&mut self, pose: &SkeletonMessage, time_s: f64) {
        let joints = (0..pose.n_joints as usize).map(|joint| place(pose, joint)).collect();
        let now = Instant { time_s, joints };
        if let [Some(first), Some(middle)] = &self.path
            && (f64::EPSILON..PATH_S).contains(&(time_s - first.time_s))
        {
            let share = (middle.time_s - first.time_s) / (time_s - first.time_s);
            let half_s2 = (middle.time_s - first.time_s) * (time_s - middle.time_s) / 2.0;
            let limit_m = OFF_PATH_M.max(LEAST_M_S2 * half_s2);
            let joints = first.joints.iter().zip(&middle.joints).zip(&now.joints);
            let mut is_off = joints.filter_map(|((first, middle), last)| {
                let between = first.as_ref()?.lerp(last.as_ref()?, share);
                Some((middle.as_ref()? - between).norm() > limit_m)
            });
            self.n_limb_jumps += u64::from(is_off.any(|is_off| is_off));
        }
        self.path = [self.path[1].take(), Some(now)];
    }

    /// Returns the scatter (standard deviation) of the bone lengths, in metres.
    fn bone_scatter_m(&self) -> Option<f64> {
        let scatters: Vec<f64> =
            self.lengths.values().filter_map(|value| scatter_m(value)).collect();
        (!scatters.is_empty()).then(|| scatters.iter().sum::<f64>() / scatters.len() as f64)
    }

    /// Returns the verdict so far.
    pub(crate) fn trust(&self) -> Trust {
        let share = |n: u64, of: u64| n as f64 / of.max(1) as f64;
        Trust {
            body_deviation: median(&self.deviations).map(|median| f64::from(median) * STEP),
            bone_scatter_m: self.bone_scatter_m(),
            disagreement_m: (self.distances.1 > 0)
                .then(|| self.distances.0 / self.distances.1 as f64),
            frames: self.frames,
            jumps: share(self.n_jumps, self.frames),
            limb_jumps: share(self.n_limb_jumps, self.frames),
            implausible: share(self.n_implausible, self.frames),
            joints_implausible: share(self.n_joints_implausible, self.n_joints),
            reprojection: median(&self.errors).map(|median| f64::from(median) * ERROR_STEP),
            sides_unsure: share(self.n_unsure, self.n_decided),
        }
    }
}

/// Returns the median of counted values; `None` if there are none.
fn median(counts: &BTreeMap<u32, u64>) -> Option<u32> {
    let half = counts.values().sum::<u64>().div_ceil(2);
    let mut counted = 0;
    let median = counts.iter().find(|(_, n)| {
        counted += *n;
        counted >= half
    });
    median.map(|(value, _)| *value)
}

fn place(pose: &SkeletonMessage, joint: usize) -> Option<Vector3<f64>> {
    let joint = pose.joints.get(joint).filter(|joint| is_placed(joint))?;
    Some(joint.in_world.into())
}

/// Returns the median absolute deviation of counted lengths from their median, converted to a standard deviation, in metres. Returns `None`
/// for fewer than two lengths.
fn scatter_m(counts: &[u32]) -> Option<f64> {
    let n: u32 = counts.iter().sum();
    if n < 2 {
        return None;
    }
    let middle = |counts: &[u32]| {
        let mut sum = 0;
        counts.iter().position(|n_here| {
            sum += n_here;
            sum >= n.div_ceil(2)
        })
    };
    let median = middle(counts)?;
    let away = |by: usize| {
        let below = median.checked_sub(by).filter(|_| by > 0);
        let each = [below, Some(median + by)].into_iter().flatten();
        each.filter_map(|at| counts.get(at)).sum::<u32>()
    };
    let deviation = middle(&(0..counts.len()).map(away).collect::<Vec<u32>>())?;
    Some(SD_PER_MAD * deviation as f64 * LENGTH_STEP_M)
}

/// Returns the mean height of the person over the used views, in pixels of their frames.
fn mean_height_px(pose: &SkeletonMessage) -> Option<f64> {
    let views = pose.listed_views().iter().enumerate();
    let used = views.filter(|(view, _)| pose.views_used >> view & 1 == 1);
    let heights: Vec<f64> = used.filter_map(|(_, fused)| height_px(fused)).collect();
    let mean = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
    (mean > 0.0).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(sides: Sides) -> SkeletonMessage {
        let mut pose = SkeletonMessage {
            status: Status::OK,
            n_joints: 2,
            n_views: 1,
            views_used: 1,
            sides,
            stature_m: 1.7,
            body_deviation: 0.8,
            ..SkeletonMessage::default()
        };
        pose.views[0].status = Status::OK;
        pose.views[0].n_parts = 2;
        pose.views[0].centres_px[1] = [0.0, 200.0];
        pose.joints[0].reprojection_px = 4.0;
        pose.joints[1].status = Status::IMPLAUSIBLE;
        pose
    }

    #[test]
    fn fractions_are_relative_to_the_joints_that_were_found() {
        let mut trusted = Trusted::default();
        let mut add = |pose: &SkeletonMessage| trusted.add(Some(pose), &[(0, 1)], (Some(0.0), &[]));
        add(&result(Sides::SURE));
        add(&result(Sides::UNSURE));
        let mut nobody = result(Sides::SURE);
        nobody.status = Status::IMPLAUSIBLE;
        add(&nobody);
        let mut nothing = result(Sides::SURE);
        nothing.status = Status::TOO_FEW_VIEWS;
        add(&nothing);
        let got = trusted.trust();
        assert_eq!((got.frames, got.sides_unsure), (3, 0.5));
        assert_eq!((got.implausible, got.joints_implausible), (1.0 / 3.0, 0.5));
        assert!((got.reprojection.unwrap() - 0.02).abs() < 1e-9);
        assert!((got.body_deviation.unwrap() - 0.8).abs() < 1e-9);
    }

    #[test]
    fn joints_that_are_hidden_in_some_results_do_not_change_the_reprojection_error() {
        let mut trusted = Trusted::default();
        for nth in 0..20 {
            let mut pose = result(Sides::SURE);
            pose.joints[0].reprojection_px = if nth % 3 == 0 { 90.0 } else { 6.0 };
            trusted.add(Some(&pose), &[], (None, &[]));
        }
        let got = trusted.trust();
        assert!((got.reprojection.unwrap() - 0.03).abs() < 1e-9);
    }

    #[test]
    fn bones_that_change_and_a_person_who_jumps_are_counted() {
        let mut trusted = Trusted::default();
        for nth in 0..20 {
            let mut pose = result(Sides::SURE);
            pose.joints[1].status = Status::OK;
            // Every fourth bone is 20 cm too long. The person walks, and is at another position in two results.
            let long = if nth % 4 == 0 {
                0.2
            } else {
                0.01 * f64::from(nth % 3)
            };
            let away = if nth == 10 {
                2.0
            } else {
                0.05 * f64::from(nth)
            };
            pose.joints[0].in_world = [away, 0.0, 0.0];
            pose.joints[1].in_world = [away, 0.0, 0.4 + long];
            let time_s = Some(0.1 * f64::from(nth));
            trusted.add(Some(&pose), &[(0, 1)], (time_s, &[0.02, 0.04]));
        }
        let got = trusted.trust();
        assert_eq!(got.jumps, 0.1);
        let scatter = got.bone_scatter_m.unwrap();
        assert!((0.01..0.03).contains(&scatter), "{scatter}");
        assert!((got.disagreement_m.unwrap() - 0.03).abs() < 1e-9);
    }

    #[test]
    fn a_joint_that_jumps_out_of_its_path_is_counted_and_a_fast_one_is_not() {
        let limb_jumps = |off_m: f64, rate_hz: f64| {
            let mut trusted = Trusted::default();
            for nth in 0..20 {
                let mut pose = result(Sides::SURE);
                let off_m = if nth == 10 { off_m } else { 0.0 };
                // 20 m/s on a straight line.
                let time_s = f64::from(nth) / rate_hz;
                pose.joints[0].in_world = [20.0 * time_s, off_m, 0.0];
                trusted.add(Some(&pose), &[(0, 1)], (Some(time_s), &[]));
            }
            trusted.trust().limb_jumps
        };
        assert_eq!(limb_jumps(0.0, 60.0), 0.0);
        assert_eq!(limb_jumps(0.2, 60.0), 0.05);
        // At a lower rate, a limb can do that. The neighbours of a joint that is farther off are off their paths, too.
        assert_eq!(limb_jumps(0.2, 25.0), 0.0);
        assert_eq!(limb_jumps(0.9, 25.0), 0.15);
    }
}
