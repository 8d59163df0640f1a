//! Checks that results without time skews are bit-identical to results without instants.

use pipeline::{BodySettings, Skeleton, SkeletonSettings, SkeletonStep, ViewResult};

use crate::planted::Scene;

/// Returns the skeletons of a few frames in which views find one candidate after the other.
///
/// * `instants`: true to pass the instants of the frames to the step.
fn skeletons(scene: &Scene, instants: bool, skews_s: [f64; 3]) -> Vec<Skeleton> {
    let settings = SkeletonSettings {
        body: BodySettings::NONE,
        ..SkeletonSettings::default()
    };
    let mut step = SkeletonStep::new(scene.plans.clone(), None, settings);
    let frame = |nth: usize| {
        let answers = scene.answers.iter().zip(skews_s).map(|(answer, skew_s)| {
            let mut answer: ViewResult = answer.clone()?;
            let n = answer.candidates.len();
            answer.candidates.rotate_left(nth % n);
            answer.skew_s = skew_s;
            Some(answer)
        });
        let answers: Vec<Option<ViewResult>> = answers.collect();
        if instants {
            step.begin(Some(nth as f64 / 30.0));
        }
        step.run(&answers, &[])
    };
    (0..4).map(frame).collect()
}

/// Returns all digits of the joints as text, because NaN is not equal to itself.
fn digits(skeletons: &[Skeleton]) -> Vec<String> {
    skeletons.iter().map(|skeleton| format!("{skeleton:?}")).collect()
}

#[test]
fn with_equal_capture_times_the_result_is_bit_for_bit_the_same() {
    let scene = Scene::new(48, 3);
    let before = skeletons(&scene, false, [0.0; 3]);
    assert!(before.iter().all(|skeleton| skeleton.joints.iter().any(Result::is_ok)));
    assert_eq!(digits(&before), digits(&skeletons(&scene, true, [0.0; 3])));
    let untold = skeletons(&scene, false, [0.0, 0.01, -0.01]);
    assert_eq!(digits(&before), digits(&untold), "no rate, no velocities");
}

#[test]
fn with_different_capture_times_3d_joints_are_moved_and_poses_of_views_are_not() {
    let scene = Scene::new(48, 3);
    let equal = skeletons(&scene, true, [0.0; 3]);
    let skewed = skeletons(&scene, true, [0.0, 0.01, -0.01]);
    assert_ne!(digits(&equal), digits(&skewed));
    for (equal, skewed) in equal.iter().zip(&skewed) {
        assert_eq!(equal.views, skewed.views);
    }
}
