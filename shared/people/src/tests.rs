//! Properties of the tracker.

mod solver;

use std::collections::BTreeSet;

use fastrand::Rng;
use proptest::prelude::*;

use crate::Memory;
use crate::testing::{Actor, ring, seen};
use crate::{Person, Settings, Solver, State, Tracker, View};

const RATE_HZ: f64 = 25.0;

fn settings() -> Settings {
    Settings {
        max: 8,
        ..Settings::default()
    }
}

/// People who walk about, arrive and leave; the same seed gives the same scene.
fn walk(seed: u64, n_people: usize, n_frames: usize, n_views: usize) -> Vec<Vec<View>> {
    let mut random = Rng::with_seed(seed);
    let cameras = ring(n_views);
    let mut actor = || Actor {
        at: [0, 1].map(|_| 2.4 * (random.f64() - 0.5)),
        turn: 6.0 * random.f64(),
        stature: 1.5 + 0.4 * random.f64(),
    };
    let starts: Vec<Actor> = (0..n_people).map(|_| actor()).collect();
    let ends: Vec<Actor> = (0..n_people).map(|_| actor()).collect();
    let frame = |nth: usize| {
        let share = nth as f64 / n_frames as f64;
        let each = starts.iter().zip(&ends).enumerate();
        let present = each.filter(|(who, _)| (nth / 10 + who) % 4 != 3);
        let people = present.map(|(_, (start, end))| Actor {
            at: [0, 1].map(|axis| start.at[axis] + share * (end.at[axis] - start.at[axis])),
            ..*start
        });
        people.collect::<Vec<Actor>>()
    };
    (0..n_frames).map(|nth| seen(&cameras, &frame(nth), 3.0, &mut random)).collect()
}

fn follow(n_views: usize, frames: &[Vec<View>]) -> Vec<Vec<Person>> {
    let mut tracker = Tracker::new(ring(n_views), settings());
    let frames = frames.iter().enumerate();
    frames.map(|(nth, views)| tracker.step(nth as f64 / RATE_HZ, views)).collect()
}

/// Returns the ids of two people, from left to right, before and after they swap positions while no camera sees them.
///
/// * `colours`: colours of their trunks.
fn exchanged(colours: [Option<[f64; 3]>; 2]) -> [Vec<u64>; 2] {
    let cameras = ring(4);
    let mut random = Rng::with_seed(1);
    let mut tracker = Tracker::new(cameras.clone(), settings());
    let mut frame = |nth: usize| {
        let side = if nth < 20 { -0.25 } else { 0.25 };
        let people = [side, -side].map(|x| Actor {
            at: [x, 0.0],
            turn: 0.0,
            stature: 1.7,
        });
        let mut views = seen(&cameras, &people, 3.0, &mut random);
        for view in &mut views {
            if (20..28).contains(&nth) {
                view.detections.clear();
            }
            for (detection, colour) in view.detections.iter_mut().zip(colours) {
                detection.colour = colour;
            }
        }
        let mut people = tracker.step(nth as f64 / RATE_HZ, &views);
        people.retain(|person| person.state != State::Lost);
        people.sort_by(|a, b| {
            a.joints[12]
                .map(|neck| neck.x)
                .partial_cmp(&b.joints[12].map(|neck| neck.x))
                .unwrap()
        });
        people.iter().map(|person| person.id).collect::<Vec<u64>>()
    };
    let ids: Vec<Vec<u64>> = (0..32).map(&mut frame).collect();
    [ids[19].clone(), ids[31].clone()]
}

#[test]
fn people_who_swap_places_unseen_keep_their_ids_by_their_colours() {
    let [before, after] = exchanged([Some([0.7, 0.3, 0.2]), Some([0.2, 0.3, 0.6])]);
    assert_eq!(before.len(), 2);
    assert_eq!(after, [before[1], before[0]]);
    for alike in [[None; 2], [Some([0.5, 0.5, 0.45]), Some([0.55, 0.5, 0.45])]] {
        let [before, after] = exchanged(alike);
        assert_eq!(after, before, "nothing tells them apart but their places");
    }
}

#[test]
fn a_person_does_not_jump_to_another_one_on_whom_two_views_agree() {
    let cameras = ring(4);
    let mut random = Rng::with_seed(3);
    let mut tracker = Tracker::new(cameras.clone(), settings());
    let actor = |along: f64| Actor {
        at: [along * 0.3_f64.cos(), along * 0.3_f64.sin()],
        turn: 1.0,
        stature: 1.7,
    };
    for nth in 0..20 {
        let views = seen(&cameras, &[actor(0.0)], 1.0, &mut random);
        tracker.step(f64::from(nth) / RATE_HZ, &views);
    }
    // The other person is between two opposite cameras, so their rays pass close to the first person.
    let mut views = seen(&cameras, &[actor(0.8)], 1.0, &mut random);
    (views[1], views[3]) = (View::default(), View::default());
    let people = tracker.step(20.0 / RATE_HZ, &views);
    let neck = people[0].joints[12].unwrap();
    assert!(people[0].id == 1 && neck.x.hypot(neck.y) < 0.3, "{neck}");
}

#[test]
fn a_person_in_another_light_keeps_the_id() {
    let cameras = ring(3);
    let mut random = Rng::with_seed(2);
    let mut tracker = Tracker::new(cameras.clone(), settings());
    let actor = Actor {
        at: [0.2, 0.1],
        turn: 1.0,
        stature: 1.8,
    };
    for nth in 0..30 {
        let mut views = seen(&cameras, &[actor], 3.0, &mut random);
        for view in &mut views {
            view.detections[0].colour = Some([if nth < 15 { 0.9 } else { 0.2 }; 3]);
        }
        let people = tracker.step(f64::from(nth) / RATE_HZ, &views);
        assert!(people.iter().all(|person| person.id == 1));
        let n_views = people.iter().map(|person| person.detections.iter().flatten().count());
        assert!(nth < 5 || n_views.eq([3]), "frame {nth}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_order_of_views_and_of_detections_changes_nothing(seed in any::<u64>(), n_people in 1_usize..6) {
        let frames = walk(seed, n_people, 24, 4);
        let expected = follow(4, &frames);
        let mut random = Rng::with_seed(seed);
        let mut order: Vec<usize> = (0..4).collect();
        random.shuffle(&mut order);
        let cameras = ring(4);
        let cameras: Vec<_> = order.iter().map(|view| cameras[*view].clone()).collect();
        let mut tracker = Tracker::new(cameras.clone(), settings());
        let (mut one, mut other) = (Solver::new(ring(4)), Solver::new(cameras));
        for (nth, (views, expected)) in frames.iter().zip(&expected).enumerate() {
            let time_s = nth as f64 / RATE_HZ;
            let mut orders = Vec::new();
            let shuffled: Vec<View> = order.iter().map(|view| {
                let mut order: Vec<usize> = (0..views[*view].detections.len()).collect();
                random.shuffle(&mut order);
                let detections = order.iter().map(|nth| views[*view].detections[*nth]).collect();
                orders.push(order);
                View { detections, loose: Vec::new() }
            }).collect();
            let got = tracker.step(time_s, &shuffled);
            let solved = other.step(time_s, &got, &shuffled);
            prop_assert_eq!(one.step(time_s, expected, views), solved);
            prop_assert_eq!(got.len(), expected.len());
            for (got, expected) in got.iter().zip(expected) {
                prop_assert_eq!((got.id, got.state, got.joints), (expected.id, expected.state, expected.joints));
                for (place, view) in order.iter().enumerate() {
                    prop_assert_eq!(got.detections[place].map(|nth| orders[place][nth]), expected.detections[*view]);
                }
            }
        }
    }

    #[test]
    fn a_detection_belongs_to_one_person_and_an_id_is_never_reused(seed in any::<u64>(), n_people in 1_usize..7, n_views in 2_usize..6) {
        let frames = walk(seed, n_people, 30, n_views);
        let (mut known, mut last) = (BTreeSet::new(), 0);
        for people in follow(n_views, &frames) {
            let mut taken = BTreeSet::new();
            for person in &people {
                for (view, detection) in person.detections.iter().enumerate() {
                    prop_assert!(detection.is_none_or(|detection| taken.insert((view, detection))));
                }
                // A newly reported person has either the next free id or a known id.
                prop_assert!(known.contains(&person.id) || person.id == last + 1);
                last = last.max(person.id);
                known.insert(person.id);
            }
            let ids: BTreeSet<u64> = people.iter().map(|person| person.id).collect();
            prop_assert_eq!(ids.len(), people.len(), "nobody is in two places");
        }
    }

    #[test]
    fn a_restored_tracker_continues_with_the_same_people(seed in any::<u64>(), n_people in 1_usize..5) {
        // All people are present from the start, so no track is about to be confirmed.
        let actors: Vec<Actor> = (0..n_people).map(|nth| Actor { at: [nth as f64 - 1.5, 0.3], turn: nth as f64, stature: 1.7 }).collect();
        let mut random = Rng::with_seed(seed);
        let frames: Vec<_> = (0..12).map(|_| seen(&ring(4), &actors, 3.0, &mut random)).collect();
        let mut tracker = Tracker::new(ring(4), settings());
        for (nth, views) in frames.iter().enumerate() {
            let time_s = nth as f64 / RATE_HZ;
            let memory = Memory::from_numbers(&tracker.memory().to_numbers()).unwrap();
            prop_assert_eq!(memory.people.len(), tracker.memory().people.len());
            let mut other = Tracker::resume(ring(4), settings(), &memory);
            let expected: Vec<Person> = tracker.step(time_s, views);
            if nth > 3 {
                let got = other.step(time_s, views);
                prop_assert_eq!(got, expected);
            }
        }
    }
}

/// Returns the ids of every frame.
fn ids(people: &[Vec<Person>]) -> Vec<Vec<u64>> {
    people
        .iter()
        .map(|people| people.iter().map(|person| person.id).collect())
        .collect()
}

#[test]
fn two_who_pass_each_other_keep_their_ids() {
    let mut random = Rng::with_seed(1);
    let frames: Vec<_> = (0..100)
        .map(|nth| {
            let x = -1.5 + 0.03 * f64::from(nth);
            let both = [
                Actor {
                    at: [x, 0.35],
                    turn: 0.0,
                    stature: 1.7,
                },
                Actor {
                    at: [-x, -0.35],
                    turn: 3.0,
                    stature: 1.7,
                },
            ];
            seen(&ring(4), &both, 4.0, &mut random)
        })
        .collect();
    let people = follow(4, &frames);
    assert!(ids(&people).iter().all(|ids| *ids == [1, 2]));
    let side = |people: &[Person], id: usize| people[id].joints[12].unwrap().y > 0.0;
    let first = [0, 1].map(|id| side(&people[0], id));
    assert_ne!(first[0], first[1]);
    assert!(people.iter().all(|people| [0, 1].map(|id| side(people, id)) == first));
}

#[test]
fn a_returning_person_is_recognised_by_bone_lengths_and_a_stranger_is_not() {
    let mut random = Rng::with_seed(2);
    let at = |stature: f64| Actor {
        at: [0.2, 0.0],
        turn: 1.0,
        stature,
    };
    let stay = |random: &mut Rng, people: &[Actor], n: usize| {
        (0..n).map(|_| seen(&ring(4), people, 2.0, random)).collect::<Vec<_>>()
    };
    let mut frames = stay(&mut random, &[at(1.9)], 40);
    frames.extend(stay(&mut random, &[], 40));
    frames.extend(stay(&mut random, &[at(1.5)], 40));
    frames.extend(stay(&mut random, &[], 40));
    frames.extend(stay(&mut random, &[at(1.9)], 40));
    let people = follow(4, &frames);
    let mut ids: Vec<u64> = ids(&people).into_iter().flatten().collect();
    ids.dedup();
    assert_eq!(ids, [1, 2, 1]);
}

#[test]
fn a_person_who_has_left_is_not_expected_after_a_restart() {
    let mut random = Rng::with_seed(2);
    let at = |stature: f64| Actor {
        at: [0.2, 0.0],
        turn: 1.0,
        stature,
    };
    let mut tracker = Tracker::new(ring(4), settings());
    let time_s = |nth: usize| nth as f64 / RATE_HZ;
    for nth in 0..80 {
        let people = if nth < 40 { vec![at(1.9)] } else { Vec::new() };
        tracker.step(time_s(nth), &seen(&ring(4), &people, 2.0, &mut random));
    }
    let memory = Memory::from_numbers(&tracker.memory().to_numbers()).unwrap();
    let mut tracker = Tracker::resume(ring(4), settings(), &memory);
    let people = tracker.step(time_s(80), &seen(&ring(4), &[at(1.5)], 2.0, &mut random));
    assert_eq!(
        people.iter().map(|person| person.id).collect::<Vec<u64>>(),
        [2]
    );
}

#[test]
fn a_new_person_is_reported_in_the_third_frame_or_at_once_if_nobody_was_known() {
    let mut random = Rng::with_seed(3);
    let [one, other] = [[-0.8, 0.0], [0.8, 0.0]].map(|at| Actor {
        at,
        turn: 0.0,
        stature: 1.7,
    });
    let frames: Vec<_> = (0..6)
        .map(|nth| {
            let people = if nth < 2 { vec![one] } else { vec![one, other] };
            seen(&ring(4), &people, 2.0, &mut random)
        })
        .collect();
    let people = follow(4, &frames);
    let n: Vec<usize> = people.iter().map(Vec::len).collect();
    assert_eq!(n, [1, 1, 1, 1, 2, 2]);
    assert_eq!(
        (people[0][0].state, people[1][0].state, people[4][1].state),
        (State::New, State::Tracked, State::New)
    );
}

#[test]
fn a_single_view_keeps_a_person_with_less_certainty() {
    let mut random = Rng::with_seed(4);
    let actor = Actor {
        at: [0.0, 0.0],
        turn: 0.0,
        stature: 1.7,
    };
    let frames: Vec<_> = (0..50)
        .map(|nth| {
            let mut views = seen(&ring(4), &[actor], 2.0, &mut random);
            if nth > 10 {
                views[1..].fill(View::default());
            }
            views
        })
        .collect();
    let people = follow(4, &frames);
    let last = &people[49][0];
    assert_eq!((last.id, last.state), (1, State::Unsure));
    assert_eq!(last.detections, [Some(0), None, None, None]);
}

#[test]
fn sides_as_seen_by_the_views_are_resolved() {
    let mut random = Rng::with_seed(5);
    let actor = Actor {
        at: [0.0, 0.0],
        turn: 0.4,
        stature: 1.7,
    };
    let mut views = seen(&ring(4), &[actor], 2.0, &mut random);
    for view in [1, 2] {
        let joints = views[view].detections[0].joints;
        views[view].detections[0].joints = crate::MIRROR.map(|joint| joints[joint]);
    }
    let as_seen = Settings {
        as_seen: true,
        ..settings()
    };
    let people = Tracker::new(ring(4), as_seen).step(0.0, &views);
    let exchanged = &people[0].is_exchanged;
    assert!(
        exchanged[1] == exchanged[2]
            && exchanged[0] == exchanged[3]
            && exchanged[0] != exchanged[1]
    );
}

#[test]
fn a_person_seen_by_two_of_four_views_is_reported_after_six_frames() {
    let mut random = Rng::with_seed(7);
    let [one, other] = [[-0.8, 0.0], [0.8, 0.0]].map(|at| Actor {
        at,
        turn: 0.0,
        stature: 1.7,
    });
    let doubtful = Settings {
        least_heat: 0.5,
        ..settings()
    };
    let mut tracker = Tracker::new(ring(4), doubtful);
    let n: Vec<usize> = (0..12)
        .map(|nth| {
            let mut views = seen(&ring(4), &[one, other], 2.0, &mut random);
            for view in &mut views[2..] {
                view.detections.truncate(1);
            }
            tracker.step(f64::from(nth) / RATE_HZ, &views).len()
        })
        .collect();
    assert_eq!(n[..5], [1; 5], "rays of two people meet as well");
    assert_eq!(n[9..], [2; 3]);
}

#[test]
fn a_person_who_appears_where_another_was_lost_keeps_the_id() {
    let mut random = Rng::with_seed(8);
    let at = |x: f64| Actor {
        at: [x, 0.0],
        turn: 0.0,
        stature: 1.7,
    };
    let frames: Vec<_> = (0..50)
        .map(|nth| {
            let people = match nth {
                0..25 => vec![at(-0.6)],
                25..33 => Vec::new(),
                _ => vec![at(0.6)],
            };
            seen(&ring(4), &people, 2.0, &mut random)
        })
        .collect();
    let people = follow(4, &frames);
    let mut ids: Vec<u64> = ids(&people).into_iter().flatten().collect();
    ids.dedup();
    assert_eq!(ids, [1]);
    let last = people[49][0].joints[12].unwrap();
    assert!((last.x - 0.6).abs() < 0.1, "{last}");
}
