//! Tests on the simulated people of `scene` in all their actions: each must be accepted as a whole person, with about the right stature.

use nalgebra::Point3;
use scene::{Action, Scene, Settings};
use skeleton::body::{Joints, check, deviation, refine};

#[test]
fn synthetic_people_are_accepted_in_every_action() {
    let mut worst = [0.0_f64; 3];
    for subject in 1..=50 {
        for action in [
            Action::ALL[subject % 10],
            Action::ALL[(3 * subject + 1) % 10],
        ] {
            let settings = Settings {
                subject: subject as u64,
                action,
                ..Settings::default()
            };
            let scene = Scene::new(&settings).unwrap();
            for frame in 0..20 {
                let seconds = 0.45 * f64::from(frame);
                let joints: Joints = scene.joints(seconds).map(|joint| Some(Point3::from(joint)));
                let found = check(&joints, &[None; 14], None);
                let at = format!("subject {subject} {} {seconds} s", action.name());
                assert_eq!((found.nobody, found.dropped), (None, [false; 14]), "{at}");
                let tall = found.stature.unwrap().metres;
                assert!((1.4..2.05).contains(&tall), "{at}: {tall} m");
                let moved = refine(&joints, &[None; 14], None).joints;
                let moved =
                    moved.iter().zip(&joints).map(|(a, b)| (a.unwrap() - b.unwrap()).norm());
                let values = [
                    found.deviation,
                    deviation(&joints),
                    moved.fold(0.0, f64::max),
                ];
                worst = core::array::from_fn(|i| worst[i].max(values[i]));
            }
        }
    }
    let [of_verdict, of_start, moved] = worst;
    assert!(of_verdict < 0.6, "{of_verdict}");
    assert!(of_start < 4.0, "{of_start}");
    assert!(moved < 0.04, "{moved} m");
}
