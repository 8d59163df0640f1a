//! Adjustment of all cameras, time offsets, bones and joints at once.

use geometry::Camera;
use geometry::bundle::{Cameras, Loss, Problem, Step, Term};
use nalgebra::{Point2, Point3, Vector2, Vector3};
use skeleton::body::{BONES, Kind, N_BONES};
use statistics::Sorted;

use super::bias::Biases;
use super::instant::{Instant, Seen, WIDTH, instant};
use super::sightings::Sightings;

/// Two positions of a joint count as the same place if their distance is below this fraction of the person's size.
const PLACE: f64 = 0.04;
/// Standard deviation of a bone's length over time, as a fraction of its length.
const BONE_SPREAD: f64 = 0.06;

/// Prior on the pose of a camera.
#[derive(Debug, Clone)]
pub(crate) struct PosePrior {
    pub(crate) camera: Camera,
    /// Standard deviations, in radians and metres.
    pub(crate) sd: [f64; 2],
}

/// Terms of the adjustment that do not come from observations.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beliefs {
    /// Two cameras and the distance between them, which fixes the scale. Its uncertainty is negligible.
    pub(crate) baseline: Option<(usize, usize, f64)>,
    /// Prior poses, by camera.
    pub(crate) poses: Vec<Option<PosePrior>>,
    /// Standard deviation of a time offset about its current value, in seconds; `None` if offsets are fixed.
    pub(crate) offset_sd_s: Option<f64>,
    /// Standard deviation of focal lengths about the given values, as a fraction.
    pub(crate) focal_sd: f64,
    /// Standard deviation of the constant error of a joint in a camera, in pixels, by camera; `None` if joints have no constant error.
    pub(crate) bias_sd_px: Option<Vec<f64>>,
}

/// Distance between the predicted and the seen position of a joint, in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    pub(crate) camera: usize,
    pub(crate) joint: usize,
    /// Predicted position minus seen position.
    pub(crate) whole: Vector2<f64>,
    /// The same difference after subtracting the constant error of the joint in this camera.
    pub(crate) own: Vector2<f64>,
    /// Position where the joint is seen.
    pub(crate) at: Point2<f64>,
}

/// The problem for [`geometry::bundle`].
#[derive(Debug, Clone)]
pub(crate) struct Adjustment {
    cameras: Cameras,
    given_focal: Vec<f64>,
    /// Parameter of each camera's offset, and the change of the offset, in seconds.
    offsets: Vec<(Option<usize>, f64)>,
    /// Parameter of each kind of bone.
    bones: [Option<usize>; N_BONES],
    lengths: Vec<f64>,
    first_bone: usize,
    biases: Biases,
    beliefs: Beliefs,
    instants: Vec<Instant>,
    n_instants: usize,
}

/// Returns true if a bone of this kind has the same length in every posture.
fn is_stiff(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::UpperArm | Kind::LowerArm | Kind::UpperLeg | Kind::LowerLeg | Kind::HipWidth
    )
}

impl Adjustment {
    /// Creates the problem.
    ///
    /// * `sigmas_px`: expected error of every joint in every camera, in pixels.
    pub(crate) fn new(
        cameras: Cameras,
        sightings: &Sightings,
        sigmas_px: &[Vec<f64>],
        beliefs: Beliefs,
    ) -> Self {
        let n = cameras.cameras().len();
        let instants = (0..sightings.times_s.len())
            .map(|i| Instant {
                nth: i,
                ..instant(cameras.cameras(), &sightings.seen[i], sigmas_px)
            })
            .filter(|instant| !instant.points.is_empty())
            .collect();
        let mut next = cameras.n_parameters();
        let mut offsets = vec![(None, 0.0); n];
        if beliefs.offset_sd_s.is_some() {
            // The clock of the first camera is the common clock.
            for (parameter, _) in offsets.iter_mut().skip(1) {
                *parameter = Some(next);
                next += 1;
            }
        }
        let given_focal = cameras.cameras().iter().map(|camera| camera.intrinsics.fx).collect();
        let mut it = Self {
            cameras,
            given_focal,
            offsets,
            bones: [None; N_BONES],
            lengths: Vec::new(),
            first_bone: next,
            biases: Biases::default(),
            beliefs,
            instants,
            n_instants: sightings.times_s.len(),
        };
        it.find_bones();
        it.find_shares();
        if let Some(sd_px) = &it.beliefs.bias_sd_px {
            let first = it.first_bone + it.lengths.len();
            it.biases = Biases::new(first, sd_px, &it.instants);
        }
        it
    }

    /// Finds the weights of joints. The error of a joint is the same while the joint stays in one place, so all these instants together
    /// count as one.
    fn find_shares(&mut self) {
        let sizes: Vec<f64> = self.instants.iter().map(Instant::size).collect();
        let near = PLACE * Sorted::new(sizes).upper_median().unwrap_or(0.0);
        let n_joints = self.instants.iter().flat_map(|instant| &instant.joints).max();
        for joint in 0..n_joints.map_or(0, |value| value + 1) {
            let each = self.instants.iter().enumerate();
            let places: Vec<(usize, usize, Point3<f64>)> = each
                .filter_map(|(nth, it)| {
                    let point = it.place(joint)?;
                    Some((nth, point, it.points[point]))
                })
                .collect();
            for (nth, point, at) in &places {
                let alike = places.iter().filter(|place| (place.2 - at).norm() < near);
                self.instants[*nth].shares[*point] = 1.0 / alike.count().max(1) as f64;
            }
        }
    }

    /// Finds the initial lengths of bones: medians over the bones of both sides of the body.
    fn find_bones(&mut self) {
        let mut kinds: Vec<(Kind, usize)> = Vec::new();
        for (nth, bone) in BONES.iter().enumerate() {
            if !is_stiff(bone.kind) {
                continue;
            }
            if let Some((_, parameter)) = kinds.iter().find(|kind| kind.0 == bone.kind) {
                self.bones[nth] = Some(*parameter);
                continue;
            }
            let alike = BONES.iter().filter(|other| other.kind == bone.kind);
            let ends: Vec<[usize; 2]> = alike.map(|alike| [alike.from[0], alike.to]).collect();
            let mut all: Vec<f64> = Vec::new();
            for instant in &self.instants {
                let each = ends.iter().filter_map(|[a, b]| instant.distance(*a, *b));
                all.extend(each.filter(|value| *value > 0.0));
            }
            all.sort_by(f64::total_cmp);
            if let Some(length) = all.get(all.len() / 2).filter(|_| all.len() >= 6) {
                let parameter = self.first_bone + self.lengths.len();
                self.lengths.push(*length);
                kinds.push((bone.kind, parameter));
                self.bones[nth] = Some(parameter);
            }
        }
    }

    /// Returns the same problem with stronger priors on the poses, by the factor `times`. This has the same effect as giving the joints
    /// less weight.
    pub(crate) fn believing(&self, times: f64) -> Self {
        let mut it = self.clone();
        for prior in it.beliefs.poses.iter_mut().flatten() {
            prior.sd = prior.sd.map(|sd| sd / times);
        }
        it
    }

    pub(crate) fn cameras(&self) -> &Cameras {
        &self.cameras
    }

    /// Returns the change of each camera's offset, in seconds.
    pub(crate) fn offset_steps_s(&self) -> Vec<f64> {
        self.offsets.iter().map(|offset| offset.1).collect()
    }

    /// Returns the parameter of a camera's offset.
    pub(crate) fn offset_parameter(&self, camera: usize) -> Option<usize> {
        self.offsets[camera].0
    }

    /// Returns the index of the instant of each local block.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = usize> {
        self.instants.iter().map(|instant| instant.nth)
    }

    /// Returns the number of points over all instants.
    pub(crate) fn n_points(&self) -> usize {
        self.instants.iter().map(|instant| instant.points.len()).sum()
    }

    /// Calls `take` for every visible joint.
    pub(crate) fn residuals(&self, take: &mut dyn FnMut(Residual)) {
        for instant in &self.instants {
            for seen in &instant.seen {
                let camera = &self.cameras.cameras()[seen.camera];
                let at = seen.at - seen.speed * self.offsets[seen.camera].1;
                let joint = instant.joints[seen.point];
                if let Some(image) = camera.project(&instant.points[seen.point]) {
                    take(Residual {
                        camera: seen.camera,
                        joint,
                        whole: image - at,
                        own: image - at + self.biases.of(seen.camera, joint),
                        at,
                    });
                }
            }
        }
    }

    fn observation(&self, instant: &Instant, seen: &Seen, term: &mut Term) {
        let (parameter, step) = self.offsets[seen.camera];
        let joint = instant.joints[seen.point];
        let at = seen.at - seen.speed * step - self.biases.of(seen.camera, joint);
        let point = &instant.points[seen.point];
        let what = (at, seen.sigma_px);
        let observed = self.cameras.observe(seen.camera, point, what, Loss::Cauchy(WIDTH), term);
        term.counts(instant.shares[seen.point]);
        for axis in 0..3 {
            let column = observed.by_point.column(axis);
            term.by_local(3 * seen.point + axis, column.as_slice());
        }
        if let Some(parameter) = parameter.filter(|_| observed.has_image) {
            let by = seen.speed / seen.sigma_px;
            term.by_shared(parameter, by.as_slice());
        }
        if observed.has_image {
            self.biases.observed((seen.camera, joint), seen.sigma_px, term);
        }
    }

    fn bone(&self, instant: &Instant, nth: usize, term: &mut Term) -> bool {
        let Some(parameter) = self.bones[nth] else {
            return false;
        };
        let ends = [BONES[nth].from[0], BONES[nth].to];
        let [Some(a), Some(b)] = ends.map(|end| instant.place(end)) else {
            return false;
        };
        let length = self.lengths[parameter - self.first_bone];
        let sigma = BONE_SPREAD * length.abs().max(1e-6);
        let way = instant.points[b] - instant.points[a];
        let distance = way.norm().max(1e-12);
        let ratio = distance / sigma;
        term.begin(&[ratio - length / sigma], Loss::Cauchy(WIDTH));
        term.counts(instant.shares[a].max(instant.shares[b]));
        for axis in 0..3 {
            let by = way[axis] / distance / sigma;
            term.by_local(3 * a + axis, &[-by]);
            term.by_local(3 * b + axis, &[by]);
        }
        // The standard deviation is a fraction of the length, which is itself a parameter.
        term.by_shared(parameter, &[-ratio / length]);
        true
    }

    fn pose_prior(&self, camera: usize, take: &mut dyn FnMut(&Term)) {
        let Some(Some(prior)) = self.beliefs.poses.get(camera) else {
            return;
        };
        let Some(parameters) = self.cameras.pose_parameters(camera) else {
            return;
        };
        let now = &self.cameras.cameras()[camera];
        let turn =
            now.camera_from_world.rotation * prior.camera.camera_from_world.rotation.inverse();
        let way = now.centre_in_world() - prior.camera.centre_in_world();
        let turn = turn.scaled_axis() / prior.sd[0];
        let way = way / prior.sd[1];
        // Rotation and position share one loss, because a moved camera differs in both.
        let all = [turn.x, turn.y, turn.z, way.x, way.y, way.z];
        let mut term = Term::default();
        term.begin(&all, Loss::Cauchy(WIDTH));
        for (nth, parameter) in parameters.into_iter().enumerate() {
            let mut column = [0.0; 6];
            // Derivatives to first order in the rotation, which is small while the prior matters.
            column[nth] = 1.0 / prior.sd[usize::from(nth >= 3)];
            term.by_shared(parameter, &column);
        }
        take(&term);
    }
}

impl Problem for Adjustment {
    fn n_shared(&self) -> usize {
        self.first_bone + self.lengths.len() + self.biases.n_parameters()
    }

    fn name(&self, parameter: usize) -> String {
        if parameter < self.cameras.n_parameters() {
            return self.cameras.name(parameter);
        }
        let camera = self.offsets.iter().position(|offset| offset.0 == Some(parameter));
        if let Some(camera) = camera {
            return format!("{}: time offset", self.cameras.cameras()[camera].name);
        }
        let bone = self.bones.iter().position(|bone| *bone == Some(parameter));
        bone.map_or_else(
            || "the constant error of a joint".to_owned(),
            |bone| format!("the length of the {}", BONES[bone].name),
        )
    }

    fn locals(&self) -> Vec<usize> {
        self.instants.iter().map(|instant| 3 * instant.points.len()).collect()
    }

    fn terms_of(&self, local: usize, take: &mut dyn FnMut(&Term)) {
        let instant = &self.instants[local];
        let mut term = Term::default();
        for seen in &instant.seen {
            self.observation(instant, seen, &mut term);
            take(&term);
        }
        for nth in 0..N_BONES {
            if self.bone(instant, nth, &mut term) {
                take(&term);
            }
        }
    }

    fn priors(&self, take: &mut dyn FnMut(&Term)) {
        let mut term = Term::default();
        if let Some((a, b, wanted)) = self.beliefs.baseline {
            let [from, to] = [a, b].map(|i| self.cameras.cameras()[i].centre_in_world());
            let way = to - from;
            let sigma = 1e-4 * wanted;
            term.begin(&[(way.norm() - wanted) / sigma], Loss::Square);
            for (camera, sign) in [(a, -1.0), (b, 1.0)] {
                let Some(pose) = self.cameras.pose_parameters(camera) else {
                    continue;
                };
                for axis in 0..3 {
                    let by = sign * way[axis] / way.norm() / sigma;
                    term.by_shared(pose[3 + axis], &[by]);
                }
            }
            take(&term);
        }
        if let Some(sd) = self.beliefs.offset_sd_s {
            for (parameter, step) in &self.offsets {
                let Some(parameter) = *parameter else {
                    continue;
                };
                term.begin(&[step / sd], Loss::Square);
                term.by_shared(parameter, &[1.0 / sd]);
                take(&term);
            }
        }
        self.biases.priors(take);
        for camera in 0..self.given_focal.len() {
            self.pose_prior(camera, take);
            if let Some(parameter) = self.cameras.focal_parameter(camera) {
                let given = self.given_focal[camera];
                let sd = self.beliefs.focal_sd * given;
                let now = self.cameras.cameras()[camera].intrinsics.fx;
                term.begin(&[(now - given) / sd], Loss::Square);
                term.by_shared(parameter, &[1.0 / sd]);
                take(&term);
            }
        }
    }

    fn moved(&self, step: &Step) -> Self {
        let mut moved = self.clone();
        moved.cameras = self.cameras.moved(&step.shared);
        for (parameter, offset) in &mut moved.offsets {
            *offset += parameter.map_or(0.0, |parameter| step.shared[parameter]);
        }
        moved.biases.step(&step.shared);
        for (nth, length) in moved.lengths.iter_mut().enumerate() {
            *length += step.shared[self.first_bone + nth];
        }
        for (instant, by) in moved.instants.iter_mut().zip(&step.locals) {
            for (point, by) in instant.points.iter_mut().zip(by.chunks_exact(3)) {
                *point += Vector3::from_column_slice(by);
            }
        }
        moved
    }
}

/// Returns the joints of all instants, by instant and joint.
pub(crate) fn skeletons(it: &Adjustment, n_joints: usize) -> Vec<Vec<Option<Point3<f64>>>> {
    let mut all = vec![vec![None; n_joints]; it.n_instants];
    for instant in &it.instants {
        for (joint, point) in instant.joints.iter().zip(&instant.points) {
            all[instant.nth][*joint] = Some(*point);
        }
    }
    all
}
