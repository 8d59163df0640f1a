//! Tests of camera poses that are calibrated from a person: the keypoints of the balancing person.

use calibration::people::{Recording, Scale, Settings, Vertical, estimate};
use calibration::synchronisation::{Film, Joint, Person, Shot};
use keypoints::files::NameSet;
use keypoints::{is_joint, joint_rows, mirrored};
use skeleton::{PARSE14, SIDES};
use statistics::Sorted;

use crate::clocks::recorded;
use crate::{balancing, shared_dir};

/// Number of frames in each sample.
const DRAWN: usize = 42;
const N_SAMPLES: u64 = 20;
/// Height of the person in metres, computed from the bone lengths in the rig that is part of the recording.
const HEIGHT_M: f64 = 1.652;

/// Returns the joints in the order of a calibration, and for each joint the index of the same joint on the other side.
fn in_order(films: &[Film]) -> (Vec<Film>, Vec<usize>) {
    let set = NameSet::of_set("body-25b").unwrap();
    let names = set.names();
    let mut rows: Vec<Vec<(usize, f64)>> = joint_rows(names).into_iter().flatten().collect();
    let extra = names.iter().enumerate().filter(|entry| !is_joint(entry.1));
    let extra: Vec<(usize, &String)> = extra.collect();
    rows.extend(extra.iter().map(|extra| vec![(extra.0, 1.0)]));
    let n = PARSE14.joints.len();
    let mut sides: Vec<usize> = (0..rows.len()).collect();
    for [right, left] in SIDES {
        (sides[right], sides[left]) = (left, right);
    }
    for (nth, (_, name)) in extra.iter().enumerate() {
        let other = mirrored(name).and_then(|other| extra.iter().position(|of| *of.1 == other));
        sides[n + nth] = n + other.unwrap_or(nth);
    }
    // Every joint is one keypoint of this set.
    assert!(rows.iter().all(|row| row.len() == 1));
    let joint = |person: &Person, row: &[(usize, f64)]| person.joints[row[0].0];
    let person = |person: &Person| Person {
        joints: rows.iter().map(|row| joint(person, row)).collect::<Vec<Option<Joint>>>(),
    };
    let shot = |shot: &Shot| Shot {
        time_s: shot.time_s,
        people: shot.people.iter().map(person).collect(),
    };
    let film = |film: &Film| Film {
        shots: film.shots.iter().map(shot).collect(),
    };
    (films.iter().map(film).collect(), sides)
}

/// Draws the same frames from all cameras.
fn sample(films: &[Film], seed: u64) -> Vec<Film> {
    let n = films.iter().map(|film| film.shots.len()).min().unwrap();
    let mut frames: Vec<usize> = (0..n).collect();
    fastrand::Rng::with_seed(seed).shuffle(&mut frames);
    frames.truncate(DRAWN);
    frames.sort_unstable();
    let of = |film: &Film| Film {
        shots: frames.iter().map(|frame| film.shots[*frame].clone()).collect(),
    };
    films.iter().map(of).collect()
}

#[test]
#[ignore = "needs ../shared"]
fn the_balancing_cameras_are_found_from_the_person_alone() {
    let Some(shared) = shared_dir() else { return };
    let rig = balancing::rig();
    let (films, _) = recorded(&shared);
    let (films, sides) = in_order(&films);
    let (mut ways_mm, mut turns, mut refused) = (Vec::new(), Vec::new(), 0);
    for seed in 0..N_SAMPLES {
        let films = sample(&films, seed);
        let settings = Settings {
            n_joints: sides.len(),
            sides: sides.clone(),
            as_seen: false,
            offsets_s: Vec::new(),
            window_s: 0.0,
            scale: Scale::Height(HEIGHT_M),
            focal: false,
            most_instants: 300,
            seed: 1,
        };
        let recording = Recording {
            cameras: rig.cameras(),
            films: &films,
        };
        let outcome = estimate(&recording, &settings).unwrap();
        if !outcome.doubts.is_empty() {
            refused += 1;
            continue;
        }
        // The person does not stand upright in any frame, and the result states this.
        assert_eq!(outcome.vertical, Vertical::Leaning);
        let apart = calibration::differences(&outcome.cameras, rig.cameras(), false);
        let mean = |of: &dyn Fn(&calibration::Difference) -> f64| {
            apart.iter().map(of).sum::<f64>() / apart.len() as f64
        };
        ways_mm.push(mean(&|difference| 1e3 * difference.way));
        turns.push(mean(&|difference| difference.turn.to_degrees()));
    }
    let n = ways_mm.len();
    let way = Sorted::new(ways_mm).upper_median().unwrap();
    let turn = Sorted::new(turns).upper_median().unwrap();
    println!("{n} answered, {refused} refused: centres {way:.1} mm, rotations {turn:.2} degrees");
    // The goal for rotations is 0.6 degrees, but only 0.9 degrees is reached.
    assert!(way < 40.0 && turn < 1.1, "{way} mm, {turn} degrees");
    assert!(refused <= 4, "{refused} of {N_SAMPLES} refused");
}
