//! Properties of the solver.

use super::*;

#[test]
fn unassigned_keypoints_fill_missing_joints() {
    let mut random = Rng::with_seed(6);
    let actor = Actor {
        at: [0.0, 0.0],
        turn: 0.4,
        stature: 1.7,
    };
    let mut views = seen(&ring(4), &[actor], 2.0, &mut random);
    let wrist = 6;
    for (view, camera) in views.iter_mut().zip(ring(4)) {
        let at = camera.project(&actor.joints()[wrist]).unwrap();
        view.detections[0].joints[wrist] = None;
        view.loose = vec![Vec::new(); 14];
        view.loose[wrist] = vec![crate::Keypoint {
            at_px: [at.x, at.y],
            sd_px: 2.0,
            heat: 0.8,
        }];
    }
    let people = Tracker::new(ring(4), settings()).step(0.0, &views);
    assert_eq!(people[0].joints[wrist], None);
    let solved = Solver::new(ring(4)).step(0.0, &people, &views);
    let distance = (solved[0].joints[wrist].unwrap() - actor.joints()[wrist]).norm();
    assert!(
        distance < 0.05 && solved[0].n_views[wrist] == 4,
        "{distance}"
    );
}

/// Returns a person of whom only the detections are known, the first in each view.
fn unplaced(n_views: usize) -> Person {
    Person {
        id: 1,
        state: State::Tracked,
        detections: vec![Some(0); n_views],
        is_exchanged: vec![false; n_views],
        joints: [None; 14],
        covariances: [None; 14],
        velocity: nalgebra::Vector3::zeros(),
    }
}

#[test]
fn a_person_without_coarse_joints_is_solved_and_found_again_after_an_error_of_the_identity() {
    let mut random = Rng::with_seed(8);
    // Beyond six, not all views propose positions.
    for n_views in [3, 4, 12] {
        let mut solver = Solver::new(ring(n_views));
        for (nth, x) in [0.0, 0.05, 1.5, 1.5].into_iter().enumerate() {
            let actor = Actor {
                at: [x, 0.2],
                turn: 0.4,
                stature: 1.7,
            };
            let views = seen(&ring(n_views), &[actor], 1.0, &mut random);
            let solved = solver.step(nth as f64 / RATE_HZ, &[unplaced(n_views)], &views);
            let off = solved[0].joints.iter().zip(actor.joints());
            let off = off.filter_map(|(joint, truth)| Some(((*joint)? - truth).norm()));
            let mut off: Vec<f64> = off.collect();
            off.sort_by(f64::total_cmp);
            assert!(
                off.len() >= 12,
                "{n_views} views, frame {nth}: {}",
                off.len()
            );
            assert!(
                off[off.len() / 2] < 0.04,
                "{n_views} views, frame {nth}: {off:?}"
            );
        }
    }
}

#[test]
fn a_joint_that_one_view_shows_stays_on_its_ray() {
    let mut random = Rng::with_seed(9);
    let mut solver = Solver::new(ring(3));
    let wrist = 6;
    for nth in 0..12 {
        let actor = Actor {
            at: [0.01 * f64::from(nth), 0.0],
            turn: 0.4,
            stature: 1.7,
        };
        let mut views = seen(&ring(3), &[actor], 1.0, &mut random);
        let truth = actor.joints()[wrist];
        for (view, camera) in ring(3).iter().enumerate() {
            let at = camera.project(&truth).unwrap();
            let is_shown = nth < 8 || view == 1;
            views[view].detections[0].joints[wrist] = is_shown.then_some(crate::Keypoint {
                at_px: [at.x, at.y],
                sd_px: 1.0,
                heat: 0.8,
            });
        }
        let solved = &solver.step(f64::from(nth) / RATE_HZ, &[unplaced(3)], &views)[0];
        let off = (solved.joints[wrist].unwrap() - truth).norm();
        assert!(off < 0.06, "frame {nth}: {off}");
        assert_eq!(solved.n_views[wrist], if nth < 8 { 3 } else { 1 });
    }
}
