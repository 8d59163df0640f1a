//! A person with a nose and toes in front of cameras on a circle.

use geometry::TriangulateError;
use multiview::FusedPose;
use nalgebra::{Matrix3, Point3, Vector3};

use super::*;
use crate::people::tests::camera;
use crate::sighting::{Sighting, parts_of};
use crate::skeleton_step::Kept;

const N_VIEWS: usize = 4;
const NAMES: [&str; 3] = ["nose", "left big toe", "right big toe"];
const SIGMA_PX: f64 = 2.0;

/// The 14 joints, in metres; the person faces along x.
const JOINTS: [[f64; 3]; 14] = [
    [0.1, -0.12, 0.08],
    [0.05, -0.11, 0.5],
    [0.0, -0.1, 0.92],
    [0.0, 0.1, 0.92],
    [0.05, 0.11, 0.5],
    [-0.1, 0.12, 0.08],
    [0.2, -0.3, 0.9],
    [0.05, -0.25, 1.15],
    [0.0, -0.19, 1.43],
    [0.0, 0.19, 1.43],
    [0.05, 0.25, 1.15],
    [-0.2, 0.3, 0.9],
    [0.0, 0.0, 1.5],
    [0.03, 0.0, 1.75],
];
const EXTRAS: [[f64; 3]; 3] = [[0.1, 0.0, 1.62], [0.1, 0.13, 0.02], [0.3, -0.13, 0.02]];

/// The sightings of all views, and the step to be tested.
struct Scene {
    step: ExtrasStep,
    skeleton: Skeleton,
    /// The people seen by each view.
    seen: Vec<Vec<Sighting>>,
}

impl Scene {
    fn new() -> Self {
        let cameras = (0..N_VIEWS).map(camera).collect();
        let names = NAMES.map(str::to_owned);
        let step = ExtrasStep::new(&names, cameras, Settings::default());
        let mut scene = Self {
            skeleton: skeleton(),
            seen: Vec::new(),
            step,
        };
        for view in 0..N_VIEWS {
            let centres = parts_of(&scene.joints(view, [0.0; 3]));
            scene.seen.push(vec![scene.sighting(view, [0.0; 3])]);
            scene.skeleton.views.push(Some(FusedView {
                pose: FusedPose {
                    centres_px: centres,
                    n_pairs: 1,
                    energy: 1.0,
                },
                exchanged: false,
                cell_px: 4.0,
                single_score: 1.0,
            }));
        }
        scene
    }

    /// Returns the joints of the displaced person in a view.
    fn joints(&self, view: usize, by: [f64; 3]) -> [[f64; 2]; 14] {
        JOINTS.map(|joint| self.project(view, joint, by))
    }

    fn project(&self, view: usize, point: [f64; 3], by: [f64; 3]) -> [f64; 2] {
        let at = Point3::from(point) + Vector3::from(by);
        self.step.cameras[view].project(&at).unwrap().into()
    }

    fn sighting(&self, view: usize, by: [f64; 3]) -> Sighting {
        let extra = |extra: [f64; 3]| Some((self.project(view, extra, by), SIGMA_PX));
        let joints = self.joints(view, by);
        Sighting {
            joints: joints.map(|at| Some(at.map(|side| side as f32))),
            heats: [0.9; 14],
            score: 1.0,
            front: [0.0; 2],
            extras: EXTRAS.map(extra).to_vec(),
            colour: None,
            age_s: 0.0,
        }
    }

    fn run(&self) -> Vec<Result<Triangulated, NoJoint>> {
        let seen = self.seen.iter().map(|people| {
            Some(ViewSightings {
                people: people.clone(),
                skew_s: 0.0,
            })
        });
        let seen: Vec<Option<ViewSightings>> = seen.collect();
        self.step.run(&self.skeleton, &seen, &mut Motion::default())
    }
}

fn skeleton() -> Skeleton {
    let joint = |point: &[f64; 3]| {
        Ok(Triangulated {
            in_world: Point3::from(*point),
            covariance: Matrix3::identity() * 1e-4,
            reprojection_px: 0.0,
            views_used: 0b1111,
            residuals_px: [0.0; geometry::MAX_VIEWS],
        })
    };
    Skeleton {
        joints: JOINTS.iter().map(joint).collect(),
        body: None,
        views: Vec::new(),
        n_people: 0,
        n_pairs: 0,
        facing_margin: 0.0,
        sides: None,
        kept: Kept::Solved,
    }
}

/// Checks that every extra keypoint is at its true position.
fn check(found: &[Result<Triangulated, NoJoint>]) {
    assert_eq!(found.len(), NAMES.len());
    for ((name, it), truth) in NAMES.iter().zip(found).zip(EXTRAS) {
        let off = (it.unwrap().in_world - Point3::from(truth)).norm();
        assert!(off < 1e-4, "{name}: {off} m");
    }
}

#[test]
fn a_keypoint_seen_by_all_views_is_triangulated_correctly() {
    let found = Scene::new().run();
    check(&found);
    assert!(found.iter().flatten().all(|joint| joint.views_used == 0b1111));
}

#[test]
fn a_view_with_swapped_legs_is_used() {
    let mut scene = Scene::new();
    let person = &mut scene.seen[2][0];
    for [right, left] in [[0, 5], [1, 4], [2, 3]] {
        person.joints.swap(right, left);
    }
    person.extras.swap(1, 2);
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|joint| joint.views_used == 0b1111));
}

#[test]
fn a_wrong_view_is_left_out() {
    let mut scene = Scene::new();
    scene.seen[1][0].extras[2] = Some(([100.0, 500.0], SIGMA_PX));
    let found = scene.run();
    check(&found);
    assert_eq!(found[2].unwrap().views_used, 0b1101);
}

#[test]
fn only_the_candidate_of_the_person_is_used() {
    let mut scene = Scene::new();
    for view in 0..N_VIEWS {
        let by = [0.3, -1.2, 0.0];
        let other = scene.sighting(view, by);
        scene.seen[view].insert(0, other);
    }
    check(&scene.run());
    // A view that shows only the other person does not contribute.
    scene.seen[3].pop();
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|joint| joint.views_used == 0b0111));
}

#[test]
fn a_candidate_without_extra_keypoints_is_not_replaced_by_another() {
    let mut scene = Scene::new();
    // Nothing was stored for the person's extra keypoints, because there was no room.
    let by = [0.3, -1.2, 0.0];
    let other = scene.sighting(0, by);
    scene.seen[0].insert(0, other);
    scene.seen[0][1].extras.clear();
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|joint| joint.views_used == 0b1110));
}

#[test]
fn a_keypoint_seen_by_one_view_has_no_position() {
    let mut scene = Scene::new();
    for people in &mut scene.seen[1..] {
        people[0].extras[0] = None;
    }
    let found = scene.run();
    let few = TriangulateError::TooFewViews {
        views: 1,
        needed: 2,
    };
    assert_eq!(found[0], Err(NoJoint::Triangulation(few)));
    found[1].unwrap();
}

#[test]
fn a_keypoint_far_from_every_joint_is_rejected() {
    let mut scene = Scene::new();
    for view in 0..N_VIEWS {
        let far = scene.project(view, [0.0, 0.9, 1.9], [0.0; 3]);
        scene.seen[view][0].extras[0] = Some((far, SIGMA_PX));
    }
    let found = scene.run();
    assert_eq!(found[0], Err(NoJoint::Implausible));
    found[2].unwrap();
}

#[test]
fn without_a_skeleton_there_are_no_extra_keypoints() {
    let mut scene = Scene::new();
    scene.skeleton.joints.clear();
    assert!(scene.run().iter().all(Result::is_err));
    scene.skeleton.views.fill(None);
    assert!(scene.run().iter().all(Result::is_err));
}
