//! Warnings about people whose height in the frames is unsuitable for the filters.

use std::collections::BTreeSet;

use geometry::search_size::{GOOD_PX, USABLE_PX, better_scale, search_sizes};
use training::datasets::sequences::Sequence;

/// Returns warnings about people whose height in the frames is too large or too small. All sequences of a rig share one warning.
///
/// * `size`: width and height of the frames; if `None`, `scale` times the footage's size.
pub(super) fn warnings(
    sequences: &[Sequence],
    size: Option<[u32; 2]>,
    scale: f64,
) -> BTreeSet<String> {
    let each = sequences.iter();
    each.filter_map(|sequence| warning(sequence, size, scale)).collect()
}

fn warning(sequence: &Sequence, size: Option<[u32; 2]>, scale: f64) -> Option<String> {
    let sizes = search_sizes(&sequence.rig).cameras;
    let cameras = sizes.iter().zip(sequence.rig.cameras());
    let seen: Vec<[f64; 2]> = cameras
        .filter(|(search, _)| sequence.views.iter().any(|view| view.camera == search.camera))
        .filter_map(|(search, camera)| {
            let [columns, rows] = camera.intrinsics.size.map(f64::from);
            let scale = size.map_or(scale, |[width, height]| {
                (f64::from(width) / columns).min(f64::from(height) / rows)
            });
            Some([scale, scale * search.person_px?])
        })
        .collect();
    let [least, most] = USABLE_PX;
    let outside = seen.iter().find(|seen| !(least..=most).contains(&seen[1]))?;
    Some(format!(
        "a person is about {:.0} px tall in the frames of {}, but the filters need {} to {}: use --scale {}",
        outside[1],
        sequence.dataset,
        GOOD_PX[0],
        GOOD_PX[1],
        better_scale(&seen)?
    ))
}
