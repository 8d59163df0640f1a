//! Tests of sending people and maps in messages.

use proptest::prelude::*;

use super::*;

fn person() -> impl Strategy<Value = Sighting> {
    let joint = (-9e5..9e5_f32, -9e5..9e5_f32, 0.0..=1.0_f32, any::<bool>());
    let extra = prop::option::of((0..900_u16, 0..900_u16, 1..9_u16));
    (
        prop::collection::vec(joint, 14),
        -60.0..2.0_f32,
        [-1.0..1.0_f32, -1.0..1.0_f32],
        prop::collection::vec(extra, 3),
        prop::option::of([0.0..=1.0_f32, 0.0..=1.0_f32, 0.0..=1.0_f32]),
        0.0..=2.0_f32,
    )
        .prop_map(|(joints, score, front, extras, colour, age_s)| {
            let is_seen = |joint: usize| joints[joint].3 && joints[joint].2 > 0.0;
            let at = |joint: usize| [joints[joint].0, joints[joint].1];
            let extra = |point: Option<(u16, u16, u16)>| {
                point.map(|(x, y, sigma)| ([x, y].map(f64::from), f64::from(sigma)))
            };
            Sighting {
                joints: core::array::from_fn(|joint| is_seen(joint).then(|| at(joint))),
                heats: core::array::from_fn(
                    |joint| {
                        if is_seen(joint) { joints[joint].2 } else { 0.0 }
                    },
                ),
                score,
                front,
                extras: extras.into_iter().map(extra).collect(),
                colour,
                age_s,
            }
        })
}

fn grid() -> impl Strategy<Value = MapGrid> {
    let side = || 1..9_usize;
    let px = || -500.0..3000.0;
    let kind = prop::sample::select(vec![MapKind::Cells, MapKind::Peaks]);
    ([px(), px()], [0.1..30.0, 0.1..30.0], [side(), side()], kind).prop_map(
        |(first_px, cell_px, size, kind)| MapGrid {
            kind,
            first_px,
            cell_px,
            size,
        },
    )
}

proptest! {
    #[test]
    fn people_survive_a_round_trip(people in prop::collection::vec(person(), 0..=8), skew in -9_i64..9) {
        let mut message = sightings_to_message(&people, 3, [640, 480]).unwrap();
        message.skew_nanos = skew * 1_000_000;
        let back = sightings_from_message(&message, 3).unwrap();
        let is_somebody = !people.is_empty();
        prop_assert_eq!(message.status == Status::OK, is_somebody);
        let sent = ViewSightings { people, skew_s: (skew * 1_000_000) as f64 * 1e-9 };
        prop_assert_eq!(back, is_somebody.then_some(sent));
    }

    #[test]
    fn maps_survive_a_round_trip(grids in prop::collection::vec(grid(), 0..=8)) {
        let message = maps_to_message(&grids, [640, 480]).unwrap();
        let values: Vec<f32> = (0..n_values(&grids)).map(|nth| 1.0 / (nth + 1) as f32).collect();
        let maps = maps_from_message(&message, &values).unwrap();
        let back: Vec<MapGrid> = maps.iter().map(|map| *map.grid()).collect();
        prop_assert_eq!(back, grids);
        let all: Vec<f32> = maps.iter().flat_map(|map| map.values().to_vec()).collect();
        prop_assert_eq!(&all, &values);
        let longer = [&values[..], &[1.0]].concat();
        maps_from_message(&message, &longer).unwrap_err();
    }

    #[test]
    fn any_message_is_refused_or_readable(
        numbers in prop::collection::vec(prop_oneof![3 => (0.0_f32..1.0).prop_map(f32::to_bits), 1 => any::<u32>()], 8),
        sides in prop::array::uniform2(prop_oneof![3 => 1_u32..4, 1 => any::<u32>()]),
        kind in 0_u32..3,
        n in any::<u32>(),
        small in 0_u32..10,
        which in 0_usize..8,
    ) {
        let mut pose = Sightings { status: Status::OK, n_keypoints: 3, ..Sightings::default() };
        let mut header = EvidenceHeader::default();
        let number = |nth: usize| f32::from_bits(numbers[nth]);
        for n in [n, small] {
            (pose.n_candidates, header.n_people) = (n, n);
            pose.heats[which][3] = number(0);
            pose.joints[which][3] = [number(1), number(2)];
            pose.candidates[which].score = number(3);
            if let Ok(Some(view)) = sightings_from_message(&pose, 3) {
                prop_assert_eq!(view.people.len(), n as usize);
                for person in &view.people {
                    prop_assert!(person.heats.iter().all(|heat| (0.0..=1.0).contains(heat)));
                    prop_assert!(person.joints.iter().flatten().flatten().all(|side| side.is_finite()));
                    prop_assert!(person.score.is_finite());
                }
            }
            header.people.fill(GridMessage {
                first_px: [f64::from(number(4)), f64::from(number(5))],
                cell_px: [f64::from(number(6)), f64::from(number(7))],
                size: sides,
                kind,
                padding: 0,
            });
            let Ok(grids) = grids_from_message(&header) else { continue };
            prop_assert_eq!(grids.len(), n as usize);
            prop_assert!(grids.iter().all(|grid| grid.cell_px.iter().all(|px| px.is_finite() && *px > 0.0)));
            let values = vec![0.5; n_values(&grids).min(10_000)];
            if let Ok(maps) = maps_from_message(&header, &values) {
                let n_read: usize = maps.iter().map(|map| map.values().len()).sum();
                prop_assert_eq!(n_read, values.len());
            }
        }
    }
}

#[test]
fn impossible_numbers_of_a_view_are_refused() {
    let person = Sighting {
        joints: [Some([3.0, 4.0]); 14],
        heats: [0.5; 14],
        score: -9.0,
        front: [0.0; 2],
        extras: Vec::new(),
        colour: Some([0.5; 3]),
        age_s: 0.1,
    };
    let sent = sightings_to_message(&[person], 0, [64, 48]).unwrap();
    sightings_from_message(&sent, 0).unwrap();
    for wrong in [f32::NAN, -0.1, 1.1] {
        let mut message = sent;
        message.heats[0][2] = wrong;
        sightings_from_message(&message, 0).unwrap_err();
    }
    for wrong in [f32::NAN, -0.5, 1.1] {
        let mut message = sent;
        message.colours[0][1] = wrong;
        sightings_from_message(&message, 0).unwrap_err();
    }
    for wrong in [f32::NAN, -0.1, 61.0] {
        let mut message = sent;
        message.ages_s[0] = wrong;
        sightings_from_message(&message, 0).unwrap_err();
    }
    for wrong in [f32::NAN, f32::INFINITY, 2e6] {
        let mut message = sent;
        message.joints[0][5][1] = wrong;
        sightings_from_message(&message, 0).unwrap_err();
    }
    let grid = small_grid(MapKind::Cells);
    let sent = maps_to_message(&[grid], [64, 48]).unwrap();
    let mut values = vec![-1.0; grid.n_values()];
    maps_from_message(&sent, &values).unwrap();
    values[17] = f32::NAN;
    maps_from_message(&sent, &values).unwrap_err();
    for size in [[0, 2], [u32::MAX, u32::MAX]] {
        let mut message = sent;
        message.people[0].size = size;
        maps_from_message(&message, &[]).unwrap_err();
    }
    let mut message = sent;
    message.people[0].cell_px[1] = 0.0;
    maps_from_message(&message, &[]).unwrap_err();
}

fn small_grid(kind: MapKind) -> MapGrid {
    MapGrid {
        kind,
        first_px: [0.0; 2],
        cell_px: [2.0; 2],
        size: [3, 2],
    }
}

#[test]
fn impossible_peaks_of_keypoints_are_refused() {
    let grid = small_grid(MapKind::Peaks);
    let mut message = maps_to_message(&[grid], [64, 48]).unwrap();
    let values = [3.0, 4.0, 0.5, 1.0].repeat(14);
    maps_from_message(&message, &values).unwrap();
    for (nth, wrong) in [(3, 0.0), (3, -1.0), (2, f32::NAN), (0, f32::INFINITY)] {
        let mut values = values.clone();
        values[4 * 5 + nth] = wrong;
        maps_from_message(&message, &values).unwrap_err();
    }
    message.people[0].kind = 2;
    maps_from_message(&message, &values).unwrap_err();
}
