//! Tests that augmented samples stay consistent with the picture.

use viewquality::n_evidence;

use super::*;

const TILE: TileShape = TileShape {
    height: 40,
    width: 24,
};

/// A sample in which every part is a bright dot at its position in the evidence. The error of a part is its number.
fn sample() -> Sample {
    let [rows, cols] = picture_size(TILE);
    let mut sample = Sample {
        group: String::new(),
        source: String::new(),
        picture: vec![0; 3 * rows * cols],
        evidence: (0..n_evidence(N_PARTS)).map(|at| at as f32 / 100.0).collect(),
        height_px: 200.0,
        errors_px: (0..N_PARTS).map(|part| part as f32).collect(),
    };
    for part in 0..N_PARTS {
        let [col, row] = [MARGIN + 4 + part * 3 % 16, MARGIN + 5 + part];
        let middle = [cols, rows].map(|side| (side as f32 - 1.0) / 2.0);
        let place = [col as f32 - middle[0], row as f32 - middle[1]];
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            sample.evidence[column(part, name).unwrap()] = place[axis] / TILE.height as f32;
        }
        for channel in 0..3 {
            sample.picture[3 * (row * cols + col) + channel] = 255;
        }
    }
    sample
}

fn unknown() -> Vec<f32> {
    vec![0.25; n_evidence(N_PARTS)]
}

/// Brightness of the first plane at the position of a part in the evidence.
fn brightness(planes: &[f32], evidence: &[f32], part: usize) -> f32 {
    let place = ["x", "y"].map(|axis| evidence[column(part, axis).unwrap()] * TILE.height as f32);
    let middle = [TILE.width, TILE.height].map(|side| (side as f32 - 1.0) / 2.0);
    let [x, y] = [0, 1].map(|axis| (place[axis] + middle[axis]).round() as usize);
    planes[y * TILE.width + x]
}

#[test]
fn an_unchanged_sample_is_the_middle_of_its_picture() {
    let sample = sample();
    let [_, cols] = picture_size(TILE);
    let planes = pixels(&sample, TILE, AS_IT_IS);
    for (row, col) in [(0, 0), (7, 13), (39, 23)] {
        let at = 3 * ((row + MARGIN) * cols + col + MARGIN);
        let expected = f32::from(sample.picture[at]) / 255.0;
        assert_eq!(planes[row * TILE.width + col], expected);
    }
}

#[test]
fn evidence_and_picture_agree_for_every_position_of_the_tile() {
    let sample = sample();
    for mirrored in [false, true] {
        for (scale, shift) in [(1.0, [0.0, 0.0]), (1.0, [2.0, -3.0]), (0.95, [-1.0, 1.5])] {
            let place = Place {
                scale,
                shift,
                mirrored,
            };
            let planes = pixels(&sample, TILE, place);
            let evidence = moved(&sample.evidence, TILE, place, &unknown());
            let dark = planes.iter().filter(|value| **value < 0.15).count();
            assert!(dark > 800, "{dark}: most of the picture is dark");
            for part in 0..N_PARTS {
                let light = brightness(&planes, &evidence, part);
                assert!(light > 0.2, "part {part}, {place:?}: {light}");
            }
        }
    }
}

#[test]
fn mirroring_swaps_errors_and_evidence_of_left_and_right_and_is_its_own_inverse() {
    let sample = sample();
    let vary = Vary {
        mirror: 1.0,
        shift: 0.0,
        scale: 0.0,
        blur: 0.0,
        noise: 0.0,
        ..Vary::default()
    };
    let mut dice = Rng::with_seed(1);
    let seen = varied(&sample, (TILE, true), (&vary, &unknown()), &mut dice);
    let plain = plain(&sample, TILE, true);
    for (part, &other) in MIRROR.iter().enumerate() {
        assert_eq!(seen.errors_px[part], sample.errors_px[other]);
        let at = |part: usize, name: &str| column(part, name).unwrap();
        let (here, there) = (at(part, "response"), at(other, "response"));
        assert_eq!(seen.evidence[here], sample.evidence[there]);
        let (here, there) = (at(part, "x"), at(other, "x"));
        assert_eq!(seen.evidence[here], -sample.evidence[there]);
        assert_eq!(seen.evidence[part * PER_PART + PART_NUMBERS.len()], 0.25);
    }
    for row in 0..TILE.height {
        let of = |tile: &[f32]| tile[row * TILE.width..][..TILE.width].to_vec();
        let mut back = of(&seen.tile);
        back.reverse();
        assert_eq!(back, of(&plain.tile));
    }
}

#[test]
fn a_blur_keeps_the_mean_and_reduces_contrast() {
    let mut planes = vec![0.0; 3 * TILE.height * TILE.width];
    planes[20 * TILE.width + 12] = 1.0;
    blur(&mut planes, TILE, 1.0);
    let sum: f32 = planes.iter().sum();
    assert!((sum - 1.0).abs() < 1e-5);
    assert!((planes[20 * TILE.width + 12] - 0.159).abs() < 0.005);
}

#[test]
fn without_augmentation_samples_are_unchanged() {
    let sample = sample();
    let still = Vary {
        mirror: 0.0,
        shift: 0.0,
        scale: 0.0,
        blur: 0.0,
        noise: 0.0,
        ..Vary::default()
    };
    let mut dice = Rng::with_seed(1);
    let seen = varied(&sample, (TILE, true), (&still, &unknown()), &mut dice);
    assert_eq!(seen, plain(&sample, TILE, true));
}
