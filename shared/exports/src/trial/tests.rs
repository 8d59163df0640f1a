//! Tests of instants on the grid, of gaps, and of rejected input.

use super::*;
use crate::testing::{line, walker};

fn people(lines: &[FrameLine], rate_hz: Option<f64>) -> Result<Vec<Trial>, TrialError> {
    let mut all = Gathering::new(Vec::new());
    for line in lines {
        all.push(line)?;
    }
    all.finish("x", rate_hz)
}

/// Returns the trial of a run, which has exactly one person.
fn gathered(lines: &[FrameLine], rate_hz: Option<f64>) -> Result<Trial, TrialError> {
    let [trial] = <[Trial; 1]>::try_from(people(lines, rate_hz)?).unwrap();
    Ok(trial)
}

#[test]
fn every_person_has_a_trial_and_all_trials_have_the_same_times() {
    let lines = [0, 1, 2, 3].map(|frame| {
        let mut line = line(frame, Some(30.0));
        let other = PersonLine {
            id: 7,
            ..line.people[0].clone()
        };
        match frame {
            0 => {}
            1 => line.people = vec![other],
            2 => line.people.insert(0, other),
            _ => {
                line.people.clear();
                line.status = "too few views".to_owned();
            }
        }
        line
    });
    let [one, other] = <[Trial; 2]>::try_from(people(&lines, None).unwrap()).unwrap();
    assert_eq!((one.id(), other.id()), (1, 7));
    let found = |trial: &Trial| -> Vec<String> {
        let slots = trial.slots.iter();
        slots.map(|slot| format!("{} {}", slot.status, slot.points.len())).collect()
    };
    assert_eq!(
        found(&one),
        ["ok 14", "not there 0", "ok 14", "too few views 0"]
    );
    assert_eq!(
        found(&other),
        ["not there 0", "ok 14", "ok 14", "too few views 0"]
    );
    assert_eq!(
        (one.gaps(0), other.gaps(0)),
        (vec![[1, 1], [3, 3]], vec![[0, 0], [3, 3]])
    );
}

#[test]
fn people_followed_one_after_the_other_form_one_trial_with_both_ids() {
    let lines = [0, 1, 2].map(|frame| {
        let mut line = line(frame, Some(30.0));
        match frame {
            1 => line.people.clear(),
            _ => line.people[0].id = 4 - frame,
        }
        line
    });
    let [trial] = <[Trial; 1]>::try_from(people(&lines, None).unwrap()).unwrap();
    assert_eq!((trial.ids.as_slice(), trial.id()), (&[2, 4][..], 2));
    assert_eq!(trial.n_with_points(), 2);
    assert_eq!(
        [0, 1, 2].map(|slot| trial.id_at(slot)),
        [Some(4), None, Some(2)]
    );
    let mut table = Vec::new();
    crate::tables::wide(&trial, &mut table).unwrap();
    let table = String::from_utf8(table).unwrap();
    let rows = table.lines().skip(1).map(|row| row.split(',').nth(2).unwrap());
    assert_eq!(rows.collect::<Vec<_>>(), ["4", "", "2"]);
}

#[test]
fn frames_are_placed_on_a_time_grid_and_missing_ones_are_gaps() {
    let frames = [9, 3, 5, 13].map(|i| line(i, Some(60.0)));
    let trial = gathered(&frames, None).unwrap();
    assert_eq!((trial.first_frame, trial.frame_step), (3, 2));
    assert_eq!((trial.rate_hz, trial.slots.len()), (Some(30.0), 6));
    assert_eq!(trial.time_s(3), Some(0.15));
    assert_eq!(trial.n_with_points(), 4);
    assert_eq!(trial.gaps(0), [[7, 7], [11, 11]]);
    assert_eq!((trial.n_irregular, trial.n_repeated), (0, 0));
    assert_eq!(trial.views, ["left", "right"]);
}

#[test]
fn refused_joints_and_invalid_numbers_are_gaps() {
    let mut one = line(0, None);
    let mut joints = one.people[0].joints.values_mut();
    *joints.next().unwrap() = JointLine::Missing {
        status: "implausible".to_owned(),
    };
    for value in [f64::NAN, f64::INFINITY, 1e9] {
        let Some(JointLine::Placed(joint)) = joints.next() else {
            panic!("a joint")
        };
        joint.position_m[1] = value;
    }
    let trial = gathered(&[one, line(1, None)], None).unwrap();
    assert_eq!(trial.points(0).flatten().count(), 10);
    assert_eq!(trial.points(1).flatten().count(), 14);
    let head = trial.names().position(|name| name == "head").unwrap();
    assert_eq!(trial.slots[0].points[head], Err(Gap("implausible".into())));
    assert_eq!(trial.rate_hz, None);
}

#[test]
fn irregular_times_and_repeated_frames_are_counted() {
    let mut late = line(2, Some(30.0));
    late.time_s = Some(0.08);
    let lines = [0, 1, 3, 3, 4].map(|i| line(i, Some(30.0)));
    let trial = gathered(&[&lines[..], &[late]].concat(), None).unwrap();
    assert_eq!((trial.n_irregular, trial.n_repeated), (1, 1));
    assert_eq!(trial.rate_hz, Some(30.0));
}

#[test]
fn runs_without_poses_are_refused() {
    assert_eq!(gathered(&[], None), Err(TrialError::Empty));
    let mut empty = line(0, None);
    empty.people[0].joints.clear();
    let missing = gathered(&[empty.clone(), empty.clone()], None);
    assert_eq!(missing, Err(TrialError::NoPoint { frames: 2 }));
    let mut all_missing = line(0, None);
    for joint in all_missing.people[0].joints.values_mut() {
        *joint = JointLine::Missing {
            status: "too few views".to_owned(),
        };
    }
    assert_eq!(
        gathered(&[all_missing], None),
        Err(TrialError::NoPoint { frames: 1 })
    );
    let far = gathered(&[line(0, None), line(1, None), line(u64::MAX, None)], None);
    assert!(matches!(far, Err(TrialError::Range { .. })), "{far:?}");
    let mut other = line(0, None);
    other.people[0].joints.remove("head");
    let other = gathered(&[other], None);
    assert!(matches!(other, Err(TrialError::Joints(_))), "{other:?}");
}

#[test]
fn a_single_frame_has_a_rate_only_if_its_time_determines_it() {
    assert_eq!(
        gathered(&[line(0, Some(30.0))], None).unwrap().rate_hz,
        None
    );
    let one = gathered(&[line(6, Some(30.0))], None).unwrap();
    assert_eq!((one.rate_hz, one.slots.len()), (Some(30.0), 1));
    let given = gathered(&[line(0, None)], Some(25.0)).unwrap();
    assert_eq!(given.rate_hz, Some(25.0));
}

#[test]
fn filled_gaps_are_marked_in_every_format_that_supports_it() {
    let mut all = Gathering::new(Vec::new());
    let states = ["measured", "filled", "rejected", "exchanged"];
    for (frame, state) in (0..).zip(states) {
        let mut line = line(frame, Some(30.0));
        line.people[0].states = [("head".to_owned(), state.to_owned())].into();
        all.push(&line).unwrap();
    }
    let trial = all.finish("x", None).unwrap().remove(0);
    assert_eq!(trial.filled(13), [[1, 2]]);
    assert_eq!(trial.gaps(13), [[0_u64; 2]; 0]);
    let mut table = Vec::new();
    crate::tables::long(&trial, &mut table).unwrap();
    let table = String::from_utf8(table).unwrap();
    assert_eq!(table.matches(",filled\n").count(), 2);
}

#[test]
fn keypoints_that_appear_later_are_gaps_before_that() {
    let mut second = line(11, Some(30.0));
    let nose = second.people[0].joints["head"].clone();
    second.people[0].keypoints.insert("nose, \"tip\"".to_owned(), nose);
    let trial = gathered(&[line(10, Some(30.0)), second], None).unwrap();
    assert_eq!(trial.extras, ["nose, \"tip\""]);
    assert_eq!(trial.gaps(14), [[10, 10]]);
    assert_eq!(walker(2).gaps(0), [[0_u64; 2]; 0]);
}
