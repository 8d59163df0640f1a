//! Choice of the size at which frames are searched, from the calibration alone: people should have the height that models expect.

mod shared_space;

use crate::Rig;
use shared_space::heights;

pub use shared_space::PERSON_METRES;

/// Target height of a person, in pixels of the searched frame.
pub const AIM_PX: f64 = 200.0;
/// Range of a person's height for which the search works best, in pixels of the searched frame.
pub const GOOD_PX: [f64; 2] = [150.0, 250.0];
/// Range of a person's height for which the search still works well, in pixels of the searched frame.
pub const USABLE_PX: [f64; 2] = [110.0, 350.0];
/// Maximum number of pixels of a searched frame unless more are requested. Searching a frame of this size takes about 0.41 s of processor
/// time. The processor time of all processes together, per frame and view, was measured for four views of 1088x1920 with default settings
/// (Intel Xeon, two cores, AVX-512): 0.22 s at 272x480, 0.32 s at 363x640, 0.43 s at 435x768 and 0.63 s at 544x960. With this limit, a Full
/// HD frame is reduced to at most 640x360; 640x480 keeps its size.
pub const MOST_PIXELS: u64 = 320_000;

/// Scales to choose from, largest first. Neighbours differ by at most a quarter, so that the height of a person is within 16 % of
/// [`AIM_PX`]. Resampling by a factor of one over a whole number is exact.
const SCALES: [f64; 15] = [
    1.0,
    0.75,
    2.0 / 3.0,
    0.5,
    0.4,
    1.0 / 3.0,
    0.25,
    0.2,
    1.0 / 6.0,
    0.125,
    0.1,
    1.0 / 12.0,
    0.0625,
    0.05,
    1.0 / 24.0,
];

/// Size at which the frames of one camera are searched.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSize {
    /// Name of the camera.
    pub camera: String,
    /// Size of the frame relative to the calibrated image; see [`OutSize::Scale`](crate::OutSize::Scale).
    pub scale: f64,
    /// Width and height of the frame, in pixels.
    pub frame_size: [u32; 2],
    /// Height of a person of [`PERSON_METRES`] in the calibrated image, in pixels: the median over the space that this camera and other
    /// cameras see. It is `None` for a camera that sees no such space.
    pub person_px: Option<f64>,
    /// Scale that would be chosen without the limit on processor time; larger than `scale` if the limit reduces the scale.
    pub wanted: f64,
}

impl SearchSize {
    /// Returns the height of the person in the frame, in pixels.
    pub fn person_in_frame_px(&self) -> Option<f64> {
        self.person_px.map(|person_px| person_px * self.scale)
    }

    /// Returns true if the limit on processor time makes the person smaller than [`GOOD_PX`].
    pub fn is_limited(&self) -> bool {
        let px = self.person_in_frame_px();
        self.scale < self.wanted && px.is_some_and(|px| px < GOOD_PX[0])
    }
}

/// Sizes at which the frames of all cameras of a rig are searched.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSizes {
    /// Size for every camera, in the order of the rig.
    pub cameras: Vec<SearchSize>,
    /// Maximum number of cameras that see a common space in which a person can stand; 0 if no two cameras do.
    pub n_sharing: usize,
}

/// Chooses the sizes at which frames are searched.
///
/// The target is a height of [`AIM_PX`] for a person of [`PERSON_METRES`] who stands in the space that the cameras share. If one scale
/// gives a height within [`GOOD_PX`] in every camera, it is used for all; otherwise each camera has its own scale. No frame is larger than
/// the calibrated image, or has more than [`MOST_PIXELS`]. If no two cameras share a space, the largest frame within this limit is used.
/// The sizes depend on the cameras only, not on the footage.
pub fn search_sizes(rig: &Rig) -> SearchSizes {
    let found = heights(rig);
    let sizes = rig.cameras().iter().map(|camera| camera.intrinsics.size);
    let limits: Vec<f64> = sizes.map(largest).collect();
    let common = common(&found.median_px, &limits);
    let cameras = rig.cameras().iter().zip(&found.median_px).zip(limits);
    let cameras = cameras.map(|((camera, person_px), limit)| {
        let own = |limit| person_px.map_or(limit, |px| nearest(px, limit));
        let scale = common.map_or_else(|| own(limit), |common| common.min(limit));
        SearchSize {
            camera: camera.name.clone(),
            scale,
            frame_size: at_scale(camera.intrinsics.size, scale),
            person_px: *person_px,
            wanted: own(1.0).max(scale),
        }
    });
    SearchSizes {
        cameras: cameras.collect(),
        n_sharing: found.n_sharing,
    }
}

/// Returns the scale that gives good heights in all cameras, if there is one; among several, the one that is nearest to the target height.
fn common(person_px: &[Option<f64>], limits: &[f64]) -> Option<f64> {
    let known: Vec<f64> = person_px.iter().flatten().copied().collect();
    let limits = person_px.iter().zip(limits).filter(|camera| camera.0.is_some());
    let limit = limits.map(|limit| *limit.1).fold(1.0, f64::min);
    let is_good = |scale: f64| {
        let mut px = known.iter().map(|value| value * scale);
        px.all(|height_px| (GOOD_PX[0]..=GOOD_PX[1]).contains(&height_px))
    };
    let off = |scale: f64| {
        let logs = known.iter().map(|px| (px * scale / AIM_PX).ln());
        logs.sum::<f64>().abs()
    };
    let good = SCALES.into_iter().filter(|scale| *scale <= limit && is_good(*scale));
    good.filter(|_| !known.is_empty()).min_by(|a, b| off(*a).total_cmp(&off(*b)))
}

/// Returns the scale, up to a limit, that brings a height nearest to the target.
fn nearest(person_px: f64, limit: f64) -> f64 {
    let off = |scale: f64| (person_px * scale / AIM_PX).ln().abs();
    let within = SCALES.into_iter().filter(|scale| *scale <= limit);
    let nearest = within.min_by(|a, b| off(*a).total_cmp(&off(*b)));
    nearest.unwrap_or(limit)
}

/// Returns the largest scale at which a frame is not too large to search.
fn largest(image: [u32; 2]) -> f64 {
    let pixels = |scale: f64| at_scale(image, scale).into_iter().map(u64::from).product::<u64>();
    let largest = SCALES.into_iter().find(|scale| pixels(*scale) <= MOST_PIXELS);
    largest.unwrap_or_else(|| (MOST_PIXELS as f64 / pixels(1.0) as f64).sqrt())
}

/// Returns the width and height of a frame, rounded like [`OutSize::Scale`](crate::OutSize::Scale).
fn at_scale(image: [u32; 2], scale: f64) -> [u32; 2] {
    image.map(|image| (f64::from(image) * scale).round().max(1.0) as u32)
}

/// Returns the scale that brings people to the target height, rounded for a settings file.
///
/// * `seen`: for every camera, the scale at which it was searched, and the height of people in its frames in pixels.
///
/// Returns `None` if `seen` is empty. A scale above 1 enlarges the frames.
pub fn better_scale(seen: &[[f64; 2]]) -> Option<f64> {
    let logs: Vec<f64> = seen.iter().map(|[scale, px]| (scale * AIM_PX / px).ln()).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    let [least, most] = [SCALES[SCALES.len() - 1], 2.0];
    let exact = mean.exp().clamp(least, most);
    let digits = if exact < 0.1 { 1000.0 } else { 100.0 };
    exact.is_finite().then(|| (exact * digits).round() / digits)
}

#[cfg(test)]
mod tests;
