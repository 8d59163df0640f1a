//! Evidence of a view for the joints of one person: the network's maps near the joints that were found.

use multiview::JointEvidence;
use nalgebra::Vector2;
use posenetwork::PersonMaps;

use crate::placed::N;
use crate::sighting::Sighting;

/// Maximum number of candidate positions that a view offers for a joint.
const N_MAXIMA: usize = 3;
/// Margin around the box of the joints within which the person is searched for, as a fraction of the box's longer side.
const BEYOND: f64 = 0.3;

/// The maps of a view near one person, as evidence for joints.
pub(crate) struct PersonEvidence<'a> {
    maps: PersonMaps<'a>,
    /// Part of the picture where the person may be, in pixels: left, top, right, bottom.
    near: [f64; 4],
    maxima: Vec<Vec<([f64; 2], f32)>>,
    /// Displacement of every joint between the instant of the frame and the time of the picture, in pixels; empty if the two times are the
    /// same.
    since_instant: Vec<Vector2<f64>>,
    /// Height of the network's window around the person, in pixels.
    pub(crate) window_px: f64,
}

impl<'a> PersonEvidence<'a> {
    /// Creates the evidence of a person; `None` if no joint is seen.
    pub(crate) fn new(maps: PersonMaps<'a>, sighting: &Sighting) -> Option<Self> {
        let [left, top, right, bottom] = sighting.outline()?;
        let more = BEYOND * (right - left).max(bottom - top);
        let near = [left - more, top - more, right + more, bottom + more];
        let maxima = |joint: usize| maps.maxima(joint, N_MAXIMA, |at| is_within(near, at));
        let grid = maps.grid();
        Some(Self {
            maps,
            near,
            maxima: (0..N).map(maxima).collect(),
            since_instant: Vec::new(),
            window_px: grid.size[1] as f64 * grid.cell_px[1],
        })
    }

    /// Returns the displacement of a joint between the instant of the frame and the time of the picture, in pixels.
    pub(crate) fn since_instant(&self, joint: usize) -> Vector2<f64> {
        self.since_instant.get(joint).copied().unwrap_or_default()
    }

    /// Moves the evidence to the instant of the frame.
    ///
    /// * `since_instant`: displacement of each joint since the instant.
    pub(crate) fn move_to_instant(&mut self, since_instant: Vec<Vector2<f64>>) {
        for (maxima, by) in self.maxima.iter_mut().zip(&since_instant) {
            for (at, _) in maxima {
                *at = [at[0] - by.x, at[1] - by.y];
            }
        }
        self.since_instant = since_instant;
    }
}

fn is_within([left, top, right, bottom]: [f64; 4], [x, y]: [f64; 2]) -> bool {
    (left..=right).contains(&x) && (top..=bottom).contains(&y)
}

impl JointEvidence for PersonEvidence<'_> {
    fn at(&self, joint: usize, point: [f64; 2]) -> f32 {
        let mut score = [0.0];
        self.add_at(joint, &[point], &mut score);
        score[0] as f32
    }

    fn add_at(&self, joint: usize, points: &[[f64; 2]], scores: &mut [f64]) {
        let by = self.since_instant(joint);
        let map = self.maps.map(joint);
        for (score, point) in scores.iter_mut().zip(points) {
            let point = [point[0] + by.x, point[1] + by.y];
            *score += f64::from(if is_within(self.near, point) {
                map.at(point)
            } else {
                self.maps.floor()
            });
        }
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        self.maps.floor()
    }
}
