//! People solved in space from maps with a known truth.

use geometry::{Camera, Intrinsics, Lens};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::*;
use crate::front::{front, front_in_view};
use crate::solve_person;
use crate::space_view::{JointEvidence, LIMBS, SpaceView};
use crate::{SeenPerson, same_person};

/// A man who stands with one arm raised, in metres; joints of `skeleton::PARSE14`, z up.
const STANDING: [[f64; 3]; N] = [
    [0.02, -0.12, 0.08],
    [0.04, -0.11, 0.49],
    [0.0, -0.10, 0.92],
    [0.0, 0.10, 0.92],
    [0.05, 0.11, 0.49],
    [-0.02, 0.12, 0.08],
    [0.30, -0.30, 1.40],
    [0.10, -0.38, 1.28],
    [0.0, -0.19, 1.45],
    [0.0, 0.19, 1.45],
    [0.03, 0.24, 1.15],
    [0.08, 0.26, 0.88],
    [0.0, 0.0, 1.50],
    [0.02, 0.0, 1.76],
];

fn camera(degrees: f64) -> Camera {
    let angle = degrees.to_radians();
    let eye = Point3::new(4.5 * angle.cos(), 4.5 * angle.sin(), 1.6);
    Camera {
        name: format!("camera at {degrees} degrees"),
        intrinsics: Intrinsics {
            fx: 800.0,
            fy: 800.0,
            cx: 319.5,
            cy: 239.5,
            size: [640, 480],
            lens: Lens::default(),
        },
        // nalgebra's cameras look along -z.
        camera_from_world: UnitQuaternion::from_axis_angle(
            &Vector3::x_axis(),
            core::f64::consts::PI,
        ) * Isometry3::look_at_rh(
            &eye,
            &Point3::new(0.0, 0.0, 0.9),
            &Vector3::z(),
        ),
    }
}

/// A view whose map of a joint is a single peak; the view does not see joints that are `None`.
struct Bumps {
    at: [Option<[f64; 2]>; N],
    maxima: Vec<Vec<([f64; 2], f32)>>,
}

const SIGMA: f64 = 9.0;
const EPS: f64 = 0.02;

impl Bumps {
    fn new(camera: &Camera) -> Self {
        Self::of_joints(camera, &STANDING)
    }

    fn of_joints(camera: &Camera, joints: &[[f64; 3]; N]) -> Self {
        let at = joints.map(|joint| {
            let at = camera.project(&Point3::from(joint)).unwrap();
            Some([at.x, at.y])
        });
        let maxima = at.map(|at| at.map_or_else(Vec::new, |point| vec![(point, 1.02_f32.ln())]));
        Self {
            at,
            maxima: maxima.to_vec(),
        }
    }
}

impl JointEvidence for Bumps {
    fn at(&self, joint: usize, [x, y]: [f64; 2]) -> f32 {
        let heat = self.at[joint].map_or(0.0, |at| {
            let squared = (x - at[0]).powi(2) + (y - at[1]).powi(2);
            (-squared / (2.0 * SIGMA * SIGMA)).exp()
        });
        (heat + EPS).ln() as f32
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        EPS.ln() as f32
    }
}

fn solved<E: JointEvidence>(cameras: &[Camera], evidence: &[E]) -> SpacePose {
    solved_by(cameras, evidence, &SpaceSettings::default())
}

fn solved_by<E: JointEvidence>(
    cameras: &[Camera],
    evidence: &[E],
    settings: &SpaceSettings,
) -> SpacePose {
    let views: Vec<SpaceView<'_>> = cameras
        .iter()
        .zip(evidence)
        .map(|(camera, evidence)| SpaceView {
            camera,
            evidence,
            exchanged: [false; 2],
            front: [0.0; 2],
        })
        .collect();
    solve_person(&views, settings).unwrap().pose
}

/// Returns the largest error, in metres.
fn worst(found: &SpacePose) -> f64 {
    let errors = found.joints.iter().zip(STANDING);
    errors
        .filter_map(|(joint, truth)| Some(((*joint)? - Point3::from(truth)).norm()))
        .fold(0.0, f64::max)
}

const RING: [f64; 4] = [10.0, 95.0, 190.0, 260.0];

#[test]
fn a_person_seen_by_all_views_is_found() {
    for n in 2..=4 {
        let cameras: Vec<Camera> = RING[..n].iter().map(|ring| camera(*ring)).collect();
        let bumps: Vec<Bumps> = cameras.iter().map(Bumps::new).collect();
        let error = worst(&solved(&cameras, &bumps));
        assert!(error < 0.03, "{n} views: {error}");
    }
}

#[test]
fn a_misplaced_joint_is_outvoted_by_bones_and_the_other_views() {
    let cameras = RING.map(camera);
    let mut bumps = cameras.each_ref().map(Bumps::new);
    for (view, joint) in [(0, 6), (1, 6), (2, 0), (3, 10)] {
        let wrong = bumps[view].at[joint].map(|at| [at[0] + 70.0, at[1] - 40.0]);
        bumps[view].at[joint] = wrong;
        bumps[view].maxima[joint] = wrong.map(|wrong| (wrong, 0.0)).into_iter().collect();
    }
    let error = worst(&solved(&cameras, &bumps));
    assert!(error < 0.03, "{error}");
}

#[test]
fn a_joint_seen_by_two_views_is_kept_and_one_seen_by_a_single_view_is_missing() {
    let cameras = RING.map(camera);
    let mut bumps = cameras.each_ref().map(Bumps::new);
    for view in [1, 3] {
        bumps[view].at[6] = None;
        bumps[view].maxima[6].clear();
    }
    assert!(worst(&solved(&cameras, &bumps)) < 0.03);
    bumps[0].at[6] = None;
    bumps[0].maxima[6].clear();
    // No view sees the elbow, so the wrist is not connected to the body.
    for view in &mut bumps {
        view.at[7] = None;
        view.maxima[7].clear();
    }
    let found = solved(&cameras, &bumps);
    let missing: Vec<usize> = (0..N).filter(|i| found.joints[*i].is_none()).collect();
    assert_eq!(missing, [6, 7]);
    assert!(worst(&found) < 0.03);
    assert_eq!(
        solve_person(&[], &SpaceSettings::default()),
        None,
        "no views"
    );
}

#[test]
fn a_view_with_swapped_sides_is_corrected() {
    for n in 3..=4 {
        let cameras: Vec<Camera> = RING[..n].iter().map(|ring| camera(*ring)).collect();
        let mut bumps: Vec<Bumps> = cameras.iter().map(Bumps::new).collect();
        for [right, left] in LIMBS.into_iter().flatten() {
            bumps[1].at.swap(right, left);
            bumps[1].maxima.swap(right, left);
        }
        let error = worst(&solved(&cameras, &bumps));
        assert!(error < 0.03, "{n} views: {error}");
    }
}

#[test]
fn sides_as_seen_in_the_pictures_are_unified_for_any_swapped_views() {
    let settings = SpaceSettings {
        as_seen: true,
        ..SpaceSettings::default()
    };
    for (n, exchanged) in [(2, 0b10), (3, 0b011), (4, 0b1010), (4, 0b0110), (4, 0b1111)] {
        let cameras: Vec<Camera> = RING[..n].iter().map(|ring| camera(*ring)).collect();
        let mut bumps: Vec<Bumps> = cameras.iter().map(Bumps::new).collect();
        for view in (0..n).filter(|i| exchanged >> i & 1 == 1) {
            for [right, left] in LIMBS.into_iter().flatten() {
                bumps[view].at.swap(right, left);
                bumps[view].maxima.swap(right, left);
            }
        }
        let views = cameras.iter().zip(&bumps).map(|(camera, evidence)| SpaceView {
            camera,
            evidence,
            exchanged: [false; 2],
            front: [0.0; 2],
        });
        let views: Vec<SpaceView<'_>> = views.collect();
        let mut found = solve_person(&views, &settings).unwrap().pose;
        // Left and right in the result are named as in the first view.
        if exchanged & 1 == 1 {
            for [right, left] in LIMBS.into_iter().flatten() {
                found.joints.swap(right, left);
            }
        }
        let error = worst(&found);
        assert!(error < 0.03, "{n} views, {exchanged:b}: {error}");
    }
}

#[test]
fn ambiguous_shoulders_are_resolved_by_the_facing_in_the_views() {
    let settings = SpaceSettings {
        as_seen: true,
        ..SpaceSettings::default()
    };
    // The body is flat and symmetric: from here, a person facing x and one facing y look the same except for the names of left and right.
    let mut flat = STANDING.map(|[_, y, z]| [0.0, y, z]);
    for [right, left] in LIMBS.into_iter().flatten() {
        flat[right] = [0.0, -flat[left][1], flat[left][2]];
    }
    let cameras = [45.0, 135.0, 225.0, 315.0].map(camera);
    let bumps = cameras.each_ref().map(|camera| {
        let mut seen = Bumps::of_joints(camera, &flat);
        // The side that appears on the left of the picture is named right.
        for [right, left] in LIMBS.into_iter().flatten() {
            if seen.at[right].unwrap()[0] > seen.at[left].unwrap()[0] {
                seen.at.swap(right, left);
                seen.maxima.swap(right, left);
            }
        }
        seen
    });
    let place = Point3::new(0.0, 0.0, 0.9);
    for facing in [Vector3::x(), Vector3::y()] {
        let view = |(camera, evidence)| SpaceView {
            camera,
            evidence,
            exchanged: [false; 2],
            front: front_in_view(camera, &place, &facing).map(|value| 10.0 * value as f32),
        };
        let views: Vec<SpaceView<'_>> = cameras
            .iter()
            .zip(bumps.iter().map(|bump| bump as &dyn JointEvidence))
            .map(view)
            .collect();
        let found = solve_person(&views, &settings).unwrap().pose;
        let found = front(&found.joints).unwrap().dot(&facing);
        assert!(found.abs() > 0.95, "{facing:?}: {found}");
    }
}

#[test]
fn a_rotated_camera_is_left_out_if_three_others_agree() {
    let cameras = RING.map(camera);
    let bumps = cameras.each_ref().map(Bumps::new);
    for turned in 0..4 {
        let mut calibrated = cameras.clone();
        let turn = UnitQuaternion::from_euler_angles(0.0, 3.0_f64.to_radians(), 0.0);
        calibrated[turned].camera_from_world = turn * cameras[turned].camera_from_world;
        let error = worst(&solved(&calibrated, &bumps));
        assert!(error < 0.03, "camera {turned}: {error}");
    }
}

/// With many views, only a few give the first solution; all give the last one.
#[test]
fn many_views_are_solved_with_a_swapped_one_a_rotated_one_and_a_joint_that_two_of_them_see() {
    let cameras: Vec<Camera> = (0..14).map(|nth| camera(7.0 + 26.0 * f64::from(nth))).collect();
    for (swapped, rotated) in [(0, 1), (5, 9), (12, 3)] {
        let mut bumps: Vec<Bumps> = cameras.iter().map(Bumps::new).collect();
        for [right, left] in LIMBS.into_iter().flatten() {
            bumps[swapped].at.swap(right, left);
            bumps[swapped].maxima.swap(right, left);
        }
        let mut calibrated = cameras.clone();
        let turn = UnitQuaternion::from_euler_angles(0.0, 3.0_f64.to_radians(), 0.0);
        calibrated[rotated].camera_from_world = turn * cameras[rotated].camera_from_world;
        // Two neighbours see the wrist.
        for nth in (0..14).filter(|nth| !(7..9).contains(nth)) {
            bumps[nth].at[6] = None;
            bumps[nth].maxima[6].clear();
        }
        let shown = calibrated.iter().zip(&bumps).map(|(camera, evidence)| SpaceView {
            camera,
            evidence,
            exchanged: [false; 2],
            front: [0.0; 2],
        });
        let shown: Vec<SpaceView<'_>> = shown.collect();
        let found = solve_person(&shown, &SpaceSettings::default()).unwrap();
        assert!(found.pose.joints[6].is_some(), "{swapped} {rotated}");
        let error = worst(&found.pose);
        assert!(error < 0.03, "{swapped} {rotated}: {error}");
        for (nth, exchanged) in found.views.iter().enumerate() {
            let expected = (nth != rotated).then_some([nth == swapped; 2]);
            assert_eq!(*exchanged, expected, "{swapped} {rotated}: view {nth}");
        }
    }
}

#[test]
fn bone_lengths_follow_the_stature_estimated_from_the_joints() {
    let of_anybody = lengths_of(None);
    let small = STANDING.map(|standing| Some(Point3::from(standing) * 0.7));
    let of_child = lengths_of(Some(&small));
    for (bone, (anybody, child)) in of_anybody.iter().zip(of_child).enumerate() {
        assert!(child.mean < anybody.mean, "{bone}");
        assert!(child.sd < anybody.sd, "{bone}: less is unknown");
    }
    let thigh = of_child[8].mean;
    assert!((thigh - 0.43 * 0.7).abs() < 0.05, "{thigh}");
}

#[test]
fn the_person_who_is_consistent_in_most_views_is_chosen() {
    let cameras = [camera(10.0), camera(95.0), camera(190.0)];
    let seen = |camera: &Camera, by: [f64; 2], height: f64| SeenPerson {
        joints: STANDING
            .iter()
            .map(|standing| {
                let at =
                    camera.project(&(Point3::from(*standing) + Vector3::new(by[0], by[1], 0.0)))?;
                Some(([at.x, at.y], 0.9))
            })
            .collect(),
        height,
    };
    let people = [
        vec![
            seen(&cameras[0], [1.5, 1.0], 0.7),
            seen(&cameras[0], [0.0; 2], 0.5),
        ],
        vec![seen(&cameras[1], [0.0; 2], 0.5)],
        vec![
            seen(&cameras[2], [-1.0, 2.0], 0.8),
            seen(&cameras[2], [0.0; 2], 0.5),
        ],
    ];
    let views: Vec<(&Camera, &[SeenPerson])> =
        cameras.iter().zip(&people).map(|(camera, it)| (camera, &it[..])).collect();
    assert_eq!(same_person(&views, false), [Some(1), Some(0), Some(1)]);
    assert_eq!(
        same_person(&views[..1], false),
        [Some(0)],
        "alone, the largest"
    );
    let nobody: [(&Camera, &[SeenPerson]); 2] = [views[0], (&cameras[1], &[])];
    assert_eq!(same_person(&nobody, false), [Some(0), None]);
    assert_eq!(same_person(&[], false), []);
}

/// A view whose network cannot distinguish the left and right ankles or knees, and sees the left leg better in both maps.
struct EitherLeg(Bumps);

impl EitherLeg {
    fn new(camera: &Camera) -> Self {
        let mut bumps = Bumps::new(camera);
        for [right, left] in [[1, 4], [0, 5]] {
            let places = [left, right].map(|i| bumps.at[i].unwrap());
            let heats: [f32; 2] = [1.0, 0.8];
            let both = places.into_iter().zip(heats);
            let both: Vec<_> = both.map(|(at, heat)| (at, (heat + EPS as f32).ln())).collect();
            bumps.maxima[right].clone_from(&both);
            bumps.maxima[left] = both;
        }
        Self(bumps)
    }
}

impl JointEvidence for EitherLeg {
    fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        let heat = |joint: usize| self.0.at(joint, point).exp() - EPS as f32;
        match joint {
            0 | 5 => (heat(5).max(0.8 * heat(0)) + EPS as f32).ln(),
            1 | 4 => (heat(4).max(0.8 * heat(1)) + EPS as f32).ln(),
            _ => self.0.at(joint, point),
        }
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        self.0.maxima(joint)
    }

    fn floor(&self) -> f32 {
        self.0.floor()
    }
}

#[test]
fn both_legs_are_not_placed_on_the_better_visible_one() {
    let cameras = RING.map(camera);
    let evidence = cameras.each_ref().map(EitherLeg::new);
    let apart = solved(&cameras, &evidence);
    assert!(worst(&apart) < 0.03, "{}", worst(&apart));
    let without = SpaceSettings {
        apart: 0.0,
        ..SpaceSettings::default()
    };
    let together = solved_by(&cameras, &evidence, &without);
    assert!(worst(&together) > 0.15, "the term is what keeps them apart");
}

#[test]
fn legs_that_are_close_together_stay_close() {
    // Both maps have a peak at the same place only, so there is no other leg to find.
    let cameras = RING.map(camera);
    let mut bumps = cameras.each_ref().map(Bumps::new);
    for view in &mut bumps {
        for [right, left] in [[1, 4], [0, 5]] {
            view.at[right] = view.at[left];
            view.maxima[right] = view.maxima[left].clone();
        }
    }
    let found = solved(&cameras, &bumps);
    for joint in [0, 1] {
        let left = [5, 4][joint];
        let between = (found.joints[joint].unwrap() - found.joints[left].unwrap()).norm();
        assert!(between < 0.12, "joint {joint}: {between}");
        let off = (found.joints[joint].unwrap() - Point3::from(STANDING[left])).norm();
        assert!(off < 0.12, "joint {joint}: {off}");
    }
}
