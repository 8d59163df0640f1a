//! People who stand in front of cameras on a circle.

use nalgebra::Point3;

use super::*;
use crate::people::tests::camera;

const RATE_HZ: f64 = 30.0;
const N_VIEWS: usize = 4;

/// The 14 joints of a person who stands at the origin, in metres.
const JOINTS: [[f64; 3]; 14] = [
    [0.1, -0.12, 0.08],
    [0.05, -0.11, 0.5],
    [0.0, -0.1, 0.92],
    [0.0, 0.1, 0.92],
    [0.05, 0.11, 0.5],
    [0.0, 0.12, 0.08],
    [0.1, -0.3, 0.9],
    [0.05, -0.25, 1.15],
    [0.0, -0.19, 1.43],
    [0.0, 0.19, 1.43],
    [0.05, 0.25, 1.15],
    [0.1, 0.3, 0.9],
    [0.0, 0.0, 1.5],
    [0.03, 0.0, 1.75],
];

fn sighting(camera: &Camera, [x, y]: [f64; 2], heat: f32) -> Sighting {
    let at = |[jx, jy, jz]: [f64; 3]| {
        let pixel = camera.project(&Point3::new(jx + x, jy + y, jz))?;
        Some([pixel.x as f32, pixel.y as f32])
    };
    Sighting {
        joints: JOINTS.map(at),
        heats: [heat; 14],
        score: -5.0,
        front: [0.0; 2],
        extras: Vec::new(),
        colour: None,
        age_s: 0.0,
    }
}

/// Returns the views' sightings of people at given positions, in an order that differs from view to view.
fn seen(people: &[([f64; 2], f32)]) -> Vec<Option<ViewSightings>> {
    let view = |view: usize| {
        let camera = camera(view);
        let all = people.iter();
        let mut all: Vec<Sighting> =
            all.map(|(place, heat)| sighting(&camera, *place, *heat)).collect();
        let n = all.len().max(1);
        all.rotate_left(view % n);
        (!all.is_empty()).then_some(ViewSightings {
            people: all,
            skew_s: 0.0,
        })
    };
    (0..N_VIEWS).map(view).collect()
}

/// Returns the people of every frame.
fn run(follow: Follow, frames: &[&[([f64; 2], f32)]]) -> Vec<FramePeople> {
    let settings = WhoSettings {
        follow,
        ..WhoSettings::default()
    };
    let mut step = WhoStep::new((0..N_VIEWS).map(camera).collect(), settings);
    let each = frames.iter().enumerate();
    each.map(|(frame, people)| step.run(frame as f64 / RATE_HZ, &seen(people)))
        .collect()
}

fn ids(frame: &FramePeople) -> Vec<u64> {
    frame.people.iter().map(|person| person.id).collect()
}

#[test]
fn no_more_people_are_reported_than_wanted() {
    let three = [[-1.2, 0.0], [0.0, 0.8], [1.2, 0.0]].map(|place| (place, 0.9));
    let all: Vec<&[([f64; 2], f32)]> = vec![&three; 20];
    let n_of = |n_people: usize| {
        let settings = WhoSettings {
            n_people,
            ..WhoSettings::default()
        };
        let cameras: Vec<Camera> = (0..N_VIEWS).map(camera).collect();
        let mut step = WhoStep::new(cameras.clone(), WhoSettings::default());
        all.iter().enumerate().for_each(|(frame, people)| {
            step.run(frame as f64 / RATE_HZ, &seen(people));
        });
        // A process with other settings continues with all three people.
        let mut step = WhoStep::resume(cameras, settings, &step.memory()).unwrap();
        let found = step.run(all.len() as f64 / RATE_HZ, &seen(&three));
        (ids(&found), found.n_seen)
    };
    assert_eq!(n_of(3), (vec![1, 2, 3], 3));
    assert_eq!(n_of(2), (vec![1, 2], 3));
}

#[test]
fn everybody_is_reported_with_their_candidate_in_every_view() {
    let both: &[([f64; 2], f32)] = &[([-0.6, 0.0], 0.9), ([0.9, 0.4], 0.7)];
    let frames = run(Follow::Last, &[both; 4]);
    for frame in &frames {
        let mut found = ids(frame);
        found.sort_unstable();
        assert_eq!((found, frame.n_seen), (vec![1, 2], 2));
        // Person p is candidate (p - v) mod 2 of view v.
        let mut candidates: Vec<_> =
            frame.people.iter().map(|person| person.candidates.clone()).collect();
        candidates.sort();
        let [even, odd] = [0, 1].map(|first| {
            let each = (0..N_VIEWS).map(|view| Some((view + first) % 2));
            each.collect::<Vec<_>>()
        });
        assert_eq!(candidates, [even, odd]);
    }
}

#[test]
fn the_followed_person_stays_first_and_keeps_the_id_through_a_gap_of_a_second() {
    let both: &[([f64; 2], f32)] = &[([-0.6, 0.0], 0.9), ([0.9, 0.4], 0.7)];
    let other: &[([f64; 2], f32)] = &[([0.9, 0.4], 0.95)];
    let frames = [vec![both; 5], vec![other; 10], vec![both; 5]].concat();
    let found = run(Follow::Last, &frames);
    let first = found[0].people[0].id;
    let (before, gone, after) = (&found[4], &found[9], &found[19]);
    assert_eq!(ids(gone)[0], first, "the place of the one who is followed");
    assert_eq!(gone.people[0].candidates, [None; N_VIEWS]);
    assert_eq!((gone.n_seen, gone.people.len()), (1, 2));
    assert_eq!((ids(before), ids(after)[0]), (ids(after), first));
    let clearest = run(Follow::Clearest, &frames);
    assert_eq!(ids(&clearest[9]), [3 - first]);
}

#[test]
fn another_person_is_followed_after_the_person_has_left() {
    let both: &[([f64; 2], f32)] = &[([-0.6, 0.0], 0.9), ([0.9, 0.4], 0.7)];
    let other: &[([f64; 2], f32)] = &[([0.9, 0.4], 0.7)];
    let frames = [vec![both; 5], vec![other; 45]].concat();
    let found = run(Follow::Last, &frames);
    let [first, last] = [&found[0], &found[49]].map(ids);
    assert_eq!(last, [first[1]]);
}

#[test]
fn no_candidates_or_a_single_view_give_no_people() {
    let mut step = WhoStep::new((0..N_VIEWS).map(camera).collect(), WhoSettings::default());
    assert_eq!(
        step.run(0.0, &[None, None, None, None]),
        FramePeople::default()
    );
    let mut one = seen(&[([0.0, 0.0], 0.9)]);
    one[1..].fill(None);
    assert_eq!(step.run(0.1, &one), FramePeople::default());
}

#[test]
fn a_restarted_process_never_reuses_an_id() {
    let settings = WhoSettings {
        n_restarts: 2,
        ..WhoSettings::default()
    };
    let mut step = WhoStep::new((0..N_VIEWS).map(camera).collect(), settings);
    let found = step.run(0.0, &seen(&[([0.0, 0.0], 0.9)]));
    assert_eq!(ids(&found), [2001]);
}

#[test]
fn a_restored_step_knows_the_people_and_the_followed_person() {
    let cameras = || (0..N_VIEWS).map(camera).collect();
    let both: &[([f64; 2], f32)] = &[([-0.6, 0.0], 0.7), ([0.9, 0.4], 0.9)];
    let mut first = WhoStep::new(cameras(), WhoSettings::default());
    let before = (0..4).map(|frame| first.run(f64::from(frame) / RATE_HZ, &seen(both)));
    let before = before.last().unwrap();
    assert_eq!(before.people.len(), 2);
    let mut next = WhoStep::resume(cameras(), WhoSettings::default(), &first.memory()).unwrap();
    // Nothing was seen for half a second.
    assert_eq!(next.run(0.6, &seen(both)), before);
    let nobody = WhoStep::resume(cameras(), WhoSettings::default(), &first.memory()[..7]);
    assert!(nobody.is_none());
}
