//! A person with a nose and toes before cameras on a circle.

use fmp::Placement;
use geometry::TriangulateError;
use multiview::FusedPose;
use nalgebra::{Matrix3, Point3, Vector3};
use posenetwork::springs;

use super::*;
use crate::estimate::plan;
use crate::network_step::cell_at;
use crate::people::tests::camera;
use crate::skeleton_step::Kept;

const N_VIEWS: usize = 4;
const NAMES: [&str; 3] = ["nose", "left big toe", "right big toe"];
const SIGMA_PX: f64 = 2.0;

/// The 14 joints, metres; the person faces along x.
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

/// What all views found, and the step.
struct Scene {
    step: ExtrasStep,
    skeleton: Skeleton,
    candidates: Vec<Vec<Pose>>,
    extras: Vec<Vec<ExtraKeypoint>>,
}

impl Scene {
    fn new() -> Self {
        let people: Vec<[[f64; 2]; 14]> = (0..40).map(person_in_cells).collect();
        let model = Arc::new(springs::learn(&people, &springs::SpringSettings::default()).unwrap());
        let plans: Vec<Arc<ViewPlan>> = (0..N_VIEWS)
            .map(|view| plan(&model, &camera(view)).unwrap())
            .collect();
        let names = NAMES.map(str::to_owned);
        let step = ExtrasStep::new(&names, plans, Settings::default());
        let mut scene = Self {
            skeleton: skeleton(),
            candidates: Vec::new(),
            extras: Vec::new(),
            step,
        };
        for view in 0..N_VIEWS {
            let centres = scene.centres(view, [0.0; 3]);
            let pose = scene.pose(view, &centres);
            scene.candidates.push(vec![pose]);
            scene.extras.push(scene.seen(view, [0.0; 3]));
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

    /// The parts of the person, moved, in a view.
    fn centres(&self, view: usize, by: [f64; 3]) -> Vec<[f64; 2]> {
        let at = |part: usize| {
            let joint = springs::joint_of(part).unwrap_or(12);
            self.project(view, JOINTS[joint], by)
        };
        (0..skeleton::N_PARTS).map(at).collect()
    }

    fn project(&self, view: usize, point: [f64; 3], by: [f64; 3]) -> [f64; 2] {
        let at = Point3::from(point) + Vector3::from(by);
        self.step.plans[view].camera().project(&at).unwrap().into()
    }

    fn pose(&self, view: usize, centres: &[[f64; 2]]) -> Pose {
        let level = 0;
        let parts = centres.iter().map(|it| {
            let [x, y] = cell_at(self.step.plans[view].layout(), level, *it);
            Placement {
                x: x.round() as u16,
                y: y.round() as u16,
                mixture: 0,
            }
        });
        Pose {
            score: 1.0,
            level,
            parts: parts.collect(),
        }
    }

    fn seen(&self, view: usize, by: [f64; 3]) -> Vec<ExtraKeypoint> {
        let each = EXTRAS.iter();
        each.map(|it| Some((self.project(view, *it, by), SIGMA_PX)))
            .collect()
    }

    fn run(&self) -> Vec<Result<Triangulated, NoJoint>> {
        let each = self.candidates.iter().zip(&self.extras);
        let found = each.map(|(candidates, extras)| {
            Some(FoundExtras {
                candidates,
                extras,
                skew_s: 0.0,
            })
        });
        let found: Vec<Option<FoundExtras<'_>>> = found.collect();
        self.step
            .run(&self.skeleton, &found, &mut Motion::default())
    }
}

/// A person of the springs, none like the other.
fn person_in_cells(nth: usize) -> [[f64; 2]; 14] {
    core::array::from_fn(|joint| {
        let [_, y, z] = JOINTS[joint];
        let off = ((nth * 31 + joint * 17) % 13) as f64 / 13.0;
        [20.0 * y + off, -20.0 * z + off * off]
    })
}

fn skeleton() -> Skeleton {
    let joint = |it: &[f64; 3]| {
        Ok(Triangulated {
            in_world: Point3::from(*it),
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

/// Checks that every extra keypoint lies where it is.
fn check(found: &[Result<Triangulated, NoJoint>]) {
    assert_eq!(found.len(), NAMES.len());
    for ((name, it), truth) in NAMES.iter().zip(found).zip(EXTRAS) {
        let off = (it.unwrap().in_world - Point3::from(truth)).norm();
        assert!(off < 1e-4, "{name}: {off} m");
    }
}

#[test]
fn what_all_views_see_lies_where_it_is() {
    let found = Scene::new().run();
    check(&found);
    assert!(found.iter().flatten().all(|it| it.views_used == 0b1111));
}

#[test]
fn a_view_that_exchanges_the_legs_takes_part() {
    let mut scene = Scene::new();
    let mut centres = scene.centres(2, [0.0; 3]);
    for [right, left] in [[13, 25], [11, 23], [9, 21]] {
        centres.swap(right, left);
    }
    scene.candidates[2][0] = scene.pose(2, &centres);
    scene.extras[2].swap(1, 2);
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|it| it.views_used == 0b1111));
}

#[test]
fn a_view_that_is_wrong_is_left_out() {
    let mut scene = Scene::new();
    scene.extras[1][2] = Some(([100.0, 500.0], SIGMA_PX));
    let found = scene.run();
    check(&found);
    assert_eq!(found[2].unwrap().views_used, 0b1101);
}

#[test]
fn the_candidate_that_is_the_person_counts() {
    let mut scene = Scene::new();
    for view in 0..N_VIEWS {
        let by = [0.3, -1.2, 0.0];
        let other = scene.pose(view, &scene.centres(view, by));
        scene.candidates[view].insert(0, other);
        let of_other = scene.seen(view, by);
        scene.extras[view].splice(0..0, of_other);
    }
    check(&scene.run());
    // A view that shows the other one alone has no part.
    scene.candidates[3].pop();
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|it| it.views_used == 0b0111));
}

#[test]
fn a_candidate_without_its_keypoints_is_no_other_one() {
    let mut scene = Scene::new();
    // There was no room for those of the person.
    let by = [0.3, -1.2, 0.0];
    let other = scene.pose(0, &scene.centres(0, by));
    scene.candidates[0].insert(0, other);
    scene.extras[0] = scene.seen(0, by);
    let found = scene.run();
    check(&found);
    assert!(found.iter().flatten().all(|it| it.views_used == 0b1110));
}

#[test]
fn what_one_view_sees_has_no_place() {
    let mut scene = Scene::new();
    for extras in &mut scene.extras[1..] {
        extras[0] = None;
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
fn what_is_far_from_every_joint_is_not_the_persons() {
    let mut scene = Scene::new();
    for view in 0..N_VIEWS {
        let far = scene.project(view, [0.0, 0.9, 1.9], [0.0; 3]);
        scene.extras[view][0] = Some((far, SIGMA_PX));
    }
    let found = scene.run();
    assert_eq!(found[0], Err(NoJoint::Implausible));
    found[2].unwrap();
}

#[test]
fn without_a_skeleton_there_is_nothing() {
    let mut scene = Scene::new();
    scene.skeleton.joints.clear();
    assert!(scene.run().iter().all(Result::is_err));
    scene.skeleton.views.fill(None);
    assert!(scene.run().iter().all(Result::is_err));
}
