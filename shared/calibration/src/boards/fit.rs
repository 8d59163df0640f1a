//! Selection of markers that agree with the layout of a board.

use nalgebra::Point2;

use crate::boards::marker::Sighting;
use crate::boards::{Homography, Layout};

/// Largest distance of a marker from the position predicted by the other markers, in sides of the marker. The limit is large enough for
/// lens distortion.
const OFF_SIDES: f64 = 0.45;
/// Maximum number of pairs of markers to try.
const MOST_PAIRS: usize = 300;

/// Returns the largest set of detected markers that one projective map takes to their positions in the layout. It has at least two markers,
/// and no number occurs twice.
pub(crate) fn agreeing(layout: &Layout, sightings: &[Sighting]) -> Vec<Sighting> {
    let mut best: (f64, Vec<Sighting>) = (f64::MAX, Vec::new());
    let pairs = (0..sightings.len()).flat_map(|a| (a + 1..sightings.len()).map(move |b| [a, b]));
    let possible = pairs.filter(|[a, b]| {
        let [a, b] = [sightings[*a], sightings[*b]];
        a.id != b.id && a.is_mirrored == b.is_mirrored
    });
    let possible: Vec<[usize; 2]> = possible.collect();
    let step = possible.len().div_ceil(MOST_PAIRS).max(1);
    for [a, b] in possible.into_iter().step_by(step) {
        let Some(map) = map_of(layout, &[sightings[a], sightings[b]]) else {
            continue;
        };
        let seed = supporters(layout, &map, &[sightings[a], sightings[b]]);
        if seed.1.len() < 2 {
            continue;
        }
        let found = supporters(layout, &map, sightings);
        if is_better(&found, &best) {
            best = found;
        }
    }
    // Repeat with the map that was fitted to all these markers.
    if let Some(map) = map_of(layout, &best.1) {
        let found = supporters(layout, &map, sightings);
        if found.1.len() >= best.1.len() {
            best = found;
        }
    }
    if best.1.len() < 2 { Vec::new() } else { best.1 }
}

fn is_better(a: &(f64, Vec<Sighting>), b: &(f64, Vec<Sighting>)) -> bool {
    a.1.len() > b.1.len() || (a.1.len() == b.1.len() && a.0 < b.0)
}

fn map_of(layout: &Layout, sightings: &[Sighting]) -> Option<Homography> {
    let pairs = sightings.iter().filter_map(|sighting| {
        let marker = layout.marker(sighting.id)?;
        Some((0..4).map(move |i| (marker.corners[i], sighting.corners[i], 1.0)))
    });
    Homography::fit(pairs.flatten())
}

/// Returns the detected markers near the positions that a map predicts, and the sum of their distances from these positions, in sides of a
/// marker.
fn supporters(layout: &Layout, map: &Homography, sightings: &[Sighting]) -> (f64, Vec<Sighting>) {
    let mut kept: Vec<(f64, Sighting)> = Vec::new();
    for sighting in sightings {
        let Some(off) = off_sides(layout, map, sighting).filter(|off_side| *off_side < OFF_SIDES)
        else {
            continue;
        };
        match kept.iter_mut().find(|kept| kept.1.id == sighting.id) {
            Some(known) if off < known.0 => *known = (off, *sighting),
            Some(_) => {}
            None => kept.push((off, *sighting)),
        }
    }
    let sum = kept.iter().map(|kept| kept.0).sum();
    (sum, kept.into_iter().map(|kept| kept.1).collect())
}

/// Returns the largest distance of a marker's corner from the position that a map predicts, in sides of the marker.
fn off_sides(layout: &Layout, map: &Homography, sighting: &Sighting) -> Option<f64> {
    let marker = layout.marker(sighting.id)?;
    let mut worst: f64 = 0.0;
    for (on_board, in_picture) in marker.corners.iter().zip(sighting.corners) {
        let off: f64 = (map.apply(*on_board)? - in_picture).norm();
        worst = worst.max(off / sighting.side_px());
    }
    Some(worst)
}

/// Returns the map that holds near a point of the board; known points near that point have the largest weight.
///
/// * `known`: position on the board (metres), position in the picture (pixels), and weight.
/// * `reach`: distance in metres beyond which points have a low weight.
pub(crate) fn map_near(
    known: &[(Point2<f64>, Point2<f64>, f64)],
    at: Point2<f64>,
    reach: f64,
) -> Option<Homography> {
    Homography::fit(known.iter().map(|(on_board, in_picture, weight)| {
        let away = (on_board - at).norm_squared() / (2.0 * reach * reach);
        (*on_board, *in_picture, weight * ((-away).exp() + 1e-3))
    }))
}
