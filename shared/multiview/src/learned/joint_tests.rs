//! Tests of learning from synthetic people, and of files with errors.

use proptest::prelude::*;
use skeleton::{HUMANEVA20, JointSet, MIRROR, N_PARTS, PARSE14, UMPM15};

use crate::learned::local::own;
use crate::learned::{JointFile, JointsLearned, LearnedSet, Local, Marked, best_local, try_all};

/// Settings of all these tests: reach and ridge.
const SETTINGS: Local = Local {
    reach: 2,
    ridge: 1e-4,
};
/// Distance of an annotated knee beyond its part, as a fraction of the distance between the thigh part and the knee part.
const BEYOND: f64 = 0.25;

/// Returns a person in a random pose whose knees are beyond their parts, away from the thigh.
fn person(random: &mut fastrand::Rng, noise_px: f64) -> Marked {
    let mut noise = |most: f64| most * (2.0 * random.f64() - 1.0);
    let upright = |part: usize| -> [f64; 2] {
        let side = if MIRROR[part] < part { 1.0 } else { -1.0 };
        let side = if MIRROR[part] == part { 0.0 } else { side };
        let right = part.min(MIRROR[part]);
        match right {
            0 => [0.0, -30.0],
            1 => [0.0, 0.0],
            2..=6 => [
                side * (18.0 + 2.0 * (right - 2) as f64),
                4.0 + 14.0 * (right - 2) as f64,
            ],
            _ => [side * 12.0, 22.0 + 18.0 * (right - 7) as f64],
        }
    };
    let (turn, scale) = (noise(0.5), 1.0 + noise(0.4));
    let (sin, cos) = turn.sin_cos();
    let mut centres = [[0.0; 2]; N_PARTS];
    for (part, centre) in centres.iter_mut().enumerate() {
        let [x, y] = upright(part);
        let [x, y] = [x + noise(6.0), y + noise(6.0)];
        *centre = [
            scale * (cos * x - sin * y) + 200.0,
            scale * (sin * x + cos * y) + 100.0,
        ];
    }
    let mut joints = [[0.0; 2]; 14];
    for (joint, at) in joints.iter_mut().enumerate() {
        let own = own(joint);
        *at = centres[own];
        if PARSE14.joints[joint].name.ends_with("knee") {
            let thigh = centres[own - 1];
            *at = [0, 1].map(|axis| at[axis] + BEYOND * (at[axis] - thigh[axis]));
        }
    }
    for at in &mut joints {
        *at = at.map(|at| at + noise(noise_px));
    }
    Marked { centres, joints }
}

fn people(seed: u64, n: usize, noise_px: f64) -> Vec<Marked> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..n).map(|_| person(&mut random, noise_px)).collect()
}

/// Moves the parts of every fifth person to random places.
fn with_wrong_ones(mut people: Vec<Marked>) -> Vec<Marked> {
    let mut random = fastrand::Rng::with_seed(7);
    for person in people.iter_mut().step_by(5) {
        for centre in &mut person.centres {
            *centre = [400.0 * random.f64(), 400.0 * random.f64()];
        }
    }
    people
}

fn learn(people: &[Marked]) -> Vec<Vec<f64>> {
    SETTINGS.learn(&[people.iter().collect()])
}

/// Returns the weights of the knee's own part and of the thigh.
fn knee(rows: &[Vec<f64>]) -> [f64; 2] {
    [rows[1][11], rows[1][10]]
}

#[test]
fn a_known_offset_is_learned() {
    let [own, thigh] = knee(&learn(&people(1, 200, 0.5)));
    assert!((own - 1.0 - BEYOND).abs() < 0.04, "{own}");
    assert!((thigh + BEYOND).abs() < 0.04, "{thigh}");
}

#[test]
fn the_offset_is_learned_even_if_every_fifth_person_was_found_wrongly() {
    let [own, thigh] = knee(&learn(&with_wrong_ones(people(1, 300, 0.5))));
    assert!((own - 1.0 - BEYOND).abs() < 0.06, "{own}");
    assert!((thigh + BEYOND).abs() < 0.06, "{thigh}");
}

#[test]
fn joints_that_coincide_with_parts_are_unchanged() {
    for (joint, row) in learn(&people(1, 200, 0.0)).iter().enumerate() {
        if !PARSE14.joints[joint].name.ends_with("knee") {
            assert!((row[own(joint)] - 1.0).abs() < 1e-3, "{joint}: {row:?}");
        }
    }
}

#[test]
fn either_side_is_the_mirror_image_of_the_other_and_rows_sum_to_one() {
    let rows = learn(&people(3, 60, 3.0));
    for (joint, row) in rows.iter().enumerate() {
        let other = MIRROR[own(joint)];
        let other = (0..14).find(|i| own(*i) == other).unwrap();
        for part in 0..N_PARTS {
            let difference = (row[part] - rows[other][MIRROR[part]]).abs();
            assert!(difference < 2e-6, "{joint}, part {part}: {difference}");
        }
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_small_data_set_counts_as_much_as_a_large_one() {
    let (near, far) = (people(5, 400, 0.0), people(6, 40, 0.0));
    let far: Vec<Marked> = far
        .into_iter()
        .map(|far| {
            let mut joints = far.joints;
            for knee in [1, 4] {
                joints[knee] = far.centres[own(knee)];
            }
            Marked { joints, ..far }
        })
        .collect();
    let [own, _] = knee(&SETTINGS.learn(&[near.iter().collect(), far.iter().collect()]));
    assert!((own - 1.0 - BEYOND / 2.0).abs() < 0.04, "{own}");
}

#[test]
fn settings_are_chosen_on_held_out_people() {
    let tried = try_all(&[people(1, 60, 0.5)]);
    let (best, errors) = best_local(&tried).unwrap();
    assert!(tried.iter().all(|trial| trial.1[0] >= errors[0]));
    assert!(
        best.ridge < 1e-2,
        "an offset without noise needs little regularisation"
    );
}

fn file() -> JointFile {
    let learned = JointsLearned {
        reach: 2,
        ridge: 1e-4,
        sets: vec![LearnedSet {
            name: "made up".to_owned(),
            people: 61,
            found: 60,
            error_before: 3.5,
            error_after: 1.25,
        }],
    };
    let model = "0123456789abcdef".to_owned();
    JointFile::new(model, learn(&people(1, 60, 0.5)), learned)
}

#[test]
fn a_joint_map_survives_a_round_trip() {
    let file = file();
    assert_eq!(JointFile::parse(&file.write().unwrap()).unwrap(), file);
}

#[test]
fn every_joint_set_derives_from_the_same_joints() {
    let file = file();
    let centres = people(9, 1, 0.0)[0].centres;
    let at = |set: &JointSet| file.map(set).unwrap().from_parts(&centres);
    let joints = at(&PARSE14);
    let middle = [0, 1].map(|axis| f64::midpoint(joints[2][axis], joints[3][axis]));
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
    assert!(near(at(&UMPM15)[0], middle));
    assert!(near(at(&UMPM15)[11], joints[1]));
    assert!(near(at(&HUMANEVA20)[1], middle));
    assert!(near(at(&HUMANEVA20)[0], joints[12]));
}

#[test]
fn a_wrong_file_is_refused_with_the_field() {
    type Change = fn(&mut JointFile);
    let cases: [(&str, Change); 13] = [
        ("parallax-else", |file| {
            file.format = "parallax-else".to_owned();
        }),
        ("version 2", |file| file.version = 2),
        ("`model`", |file| file.model = "0123".to_owned()),
        ("`model`", |file| file.model = "0123456789abcdeG".to_owned()),
        ("`joints`", |file| drop(file.joints.pop())),
        ("`joints[3].name`", |file| {
            file.joints[3].name = "hip".to_owned();
        }),
        ("`joints[0].weights`", |file| {
            file.joints[0].weights.truncate(25);
        }),
        ("`joints[5].weights`", |file| {
            file.joints[5].weights[2] += 0.01;
        }),
        ("`joints[5].weights`", |file| {
            file.joints[5].weights[2] += 20.0;
            file.joints[5].weights[3] -= 20.0;
        }),
        ("`learned.ridge`", |file| file.learned.ridge = -1.0),
        ("`learned.reach`", |file| file.learned.reach = 27),
        ("`learned.sets[0].found`", |file| {
            file.learned.sets[0].found = 62;
        }),
        ("`learned.sets[0].error_after`", |file| {
            file.learned.sets[0].error_after = -0.5;
        }),
    ];
    for (words, change) in cases {
        let mut it = file();
        change(&mut it);
        // Format and version are written correctly.
        let text = it.write().unwrap();
        let text = text.replace("parallax-joints", &it.format);
        let text = text.replace("\"version\":1", &format!("\"version\":{}", it.version));
        let error = JointFile::parse(&text).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let text = file().write().unwrap();
    for (from, to, words) in [
        (
            "\"reach\":2",
            "\"reach\":2,\"more\":1",
            "unknown field `more`",
        ),
        ("\"ridge\":0.0001,", "", "missing field `ridge`"),
        ("1.25", "null", "invalid type"),
        ("1.25", "1e999", "out of range"),
        ("{", "", "expected"),
    ] {
        let error = JointFile::parse(&text.replacen(from, to, 1)).unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

proptest! {
    #[test]
    fn damaged_joint_maps_do_not_panic(at in 0_usize..4000, byte in 32_u8..127) {
        let mut text = file().write().unwrap().into_bytes();
        let at = at % text.len();
        text[at] = byte;
        let read = JointFile::parse(core::str::from_utf8(&text).unwrap());
        if let Ok(it) = read {
            prop_assert!(it.map(&PARSE14).is_some());
        }
    }
}
