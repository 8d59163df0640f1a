//! Tests of the description of maps by Gaussians.

use super::*;
use crate::person_maps::{MapGrid, MapKind};

const SETTINGS: MapSettings = MapSettings {
    eps: 0.02,
    point_sigma: 0.0,
};

const SIZE: [usize; 2] = [80, 90];

fn maps(values: &[f32]) -> PersonMaps<'_> {
    PersonMaps::new(grid(MapKind::Cells), values, SETTINGS.floor())
}

fn grid(kind: MapKind) -> MapGrid {
    MapGrid {
        kind,
        first_px: [20.0, 30.0],
        cell_px: [2.0; 2],
        size: SIZE,
    }
}

#[test]
fn peaks_of_keypoints_become_the_same_gaussians_and_nearly_the_same_maps() {
    let floor = SETTINGS.floor();
    let mut values = [[0.0, 0.0, floor, 1.0]; N_JOINTS];
    values[3] = [40.5, 30.25, SETTINGS.of_heat(0.8, floor), 2.5];
    let peaks = PersonMaps::new(grid(MapKind::Peaks), values.as_flattened(), floor);
    let sent = bumps(&peaks, &SETTINGS);
    assert_eq!(sent.len(), 1);
    let Bump {
        joint,
        at,
        heat,
        precision,
    } = sent[0];
    assert_eq!((joint, at), (3, [40.5, 30.25]));
    assert!((heat - 0.8).abs() < 1e-6, "{heat}");
    assert_eq!(precision, [0.16, 0.0, 0.16]);
    let received = filled(&sent);
    let cells = maps(&received);
    // One to three standard deviations, beyond the floor, and outside the maps.
    for (across, most) in [
        (0.0, 0.01),
        (5.0, 0.05),
        (10.0, 0.3),
        (15.0, 0.7),
        (40.0, 1e-6),
        (900.0, 0.0),
    ] {
        let point = [20.0 + 81.0 + across, 30.0 + 60.5];
        let off = (peaks.at(3, point) - cells.at(3, point)).abs();
        assert!(off <= most, "{across}: {off}");
    }
    let found = peaks.maxima(3, 3, |_| true);
    let [(at, evidence)] = found[..] else {
        panic!("one maximum, not {found:?}");
    };
    assert_eq!(at, [101.0, 90.5]);
    assert!((evidence - 0.82_f32.ln()).abs() < 1e-6, "{evidence}");
    assert_eq!(peaks.maxima(4, 3, |_| true), []);
}

fn filled(bumps: &[Bump]) -> Vec<f32> {
    let mut values = vec![7.0; N_JOINTS * SIZE[0] * SIZE[1]];
    fill_from_bumps(bumps, SIZE, &SETTINGS, &mut values);
    values
}

fn bump(joint: usize, at: [f32; 2], heat: f32, sigma: [f32; 2], turned: f32) -> Bump {
    let [p, q] = sigma.map(|sigma| 1.0 / (sigma * sigma));
    let (sin, cos) = turned.sin_cos();
    Bump {
        joint,
        at,
        heat,
        precision: [
            p * cos * cos + q * sin * sin,
            (p - q) * sin * cos,
            p * sin * sin + q * cos * cos,
        ],
    }
}

/// Returns the maps of the given Gaussians, the Gaussians fitted to those maps, and the maps of the fitted Gaussians.
fn there_and_back(given: &[Bump]) -> (Vec<f32>, Vec<Bump>, Vec<f32>) {
    let sent = filled(given);
    let found = bumps(&maps(&sent), &SETTINGS);
    let received = filled(&found);
    (sent, found, received)
}

/// The largest difference in heat.
fn off(a: &[f32], b: &[f32]) -> f64 {
    let each = a.iter().zip(b);
    let each = each.map(|(a, b)| (SETTINGS.heat(*a) - SETTINGS.heat(*b)).abs());
    each.fold(0.0, f64::max)
}

#[test]
fn a_gaussian_is_recovered_exactly() {
    for given in [
        bump(0, [40.3, 50.8], 0.9, [2.0, 2.0], 0.0),
        bump(13, [30.0, 41.5], 0.2, [1.2, 3.5], 0.6),
        bump(5, [50.49, 60.51], 1.0, [4.0, 1.5], -1.1),
    ] {
        let (sent, found, received) = there_and_back(&[given]);
        let first = found[0];
        assert_eq!(first.joint, given.joint);
        let away = (first.at[0] - given.at[0]).hypot(first.at[1] - given.at[1]);
        assert!(away < 0.02, "{given:?}: {first:?}");
        assert!(
            (first.heat - given.heat).abs() < 0.02,
            "{given:?}: {first:?}"
        );
        assert!(off(&sent, &received) < 0.02, "{found:?}");
        assert!(
            found.len() <= 2 && found.iter().all(Bump::is_sound),
            "{found:?}"
        );
    }
}

#[test]
fn two_maxima_and_a_ridge_are_recovered_within_a_few_hundredths() {
    let mut given = vec![
        bump(3, [35.0, 50.0], 0.8, [2.0, 2.0], 0.0),
        bump(3, [38.5, 52.0], 0.6, [1.5, 1.5], 0.0),
        bump(4, [25.0, 40.0], 0.5, [2.0, 2.0], 0.0),
        bump(4, [55.0, 70.0], 0.4, [2.0, 2.0], 0.0),
    ];
    // Several Gaussians in a row describe a joint that may be anywhere along a limb.
    given.extend((0..6).map(|i| {
        bump(
            8,
            [30.0 + 2.0 * i as f32, 45.0 + i as f32],
            0.12,
            [1.5, 1.5],
            0.0,
        )
    }));
    let (sent, found, received) = there_and_back(&given);
    assert!(
        off(&sent, &received) < 0.06,
        "{}: {found:?}",
        off(&sent, &received)
    );
    assert!(found.len() < 20, "{}", found.len());
}

#[test]
fn an_empty_map_gives_the_floor_value() {
    let values = filled(&[]);
    assert!(values.iter().all(|value| *value == SETTINGS.floor()));
    assert_eq!(bumps(&maps(&values), &SETTINGS), []);
}

#[test]
fn a_gaussian_at_the_edge_or_beyond_it_stays_within_the_window() {
    let given = [
        bump(1, [10.0, 15.0], 0.9, [2.0, 2.0], 0.0),
        bump(2, [-500.0, 9000.0], 0.9, [2.0, 2.0], 0.0),
    ];
    let (sent, found, received) = there_and_back(&given);
    assert!(found.iter().all(|bump| bump.joint == 1), "{found:?}");
    assert!(off(&sent, &received) < 0.03, "{found:?}");
}

#[test]
fn an_invalid_gaussian_is_rejected() {
    let good = bump(1, [10.0, 15.0], 0.9, [2.0, 2.0], 0.3);
    assert!(good.is_sound());
    for bad in [
        Bump {
            joint: N_JOINTS,
            ..good
        },
        Bump {
            at: [f32::NAN, 0.0],
            ..good
        },
        Bump {
            at: [1e9, 0.0],
            ..good
        },
        Bump { heat: 0.0, ..good },
        Bump { heat: 1.1, ..good },
        Bump {
            precision: [1.0, 2.0, 1.0],
            ..good
        },
        Bump {
            precision: [f32::INFINITY, 0.0, 1.0],
            ..good
        },
        Bump {
            precision: [0.0, 0.0, 0.0],
            ..good
        },
        Bump {
            precision: [1e6, 0.0, 1e6],
            ..good
        },
    ] {
        assert!(!bad.is_sound(), "{bad:?}");
    }
}
