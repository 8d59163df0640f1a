//! Correction for pictures that were not taken at the instant of their frame.
//!
//! The *skew* of a picture is the time from the instant of its frame to the picture, in seconds; it is negative if the picture is earlier.
//! There are two corrections: a point is moved to the instant by its own velocity ([`Tracks`], [`moved`]), or its standard deviation is
//! increased by the distance that it may have moved ([`widened_px`]). The test `clock` of the crate `pipeline` measures both. Moving the
//! points is far better. It works best in combination with a larger standard deviation for two kinds of points: points without a known
//! velocity, and points moved beyond the observed interval.

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2};

/// Number of frames to store; enough to check whether two successive velocities agree.
const N_NOTED: usize = 3;
/// Maximum speed of a point, in heights of the person per second; a faster point is taken for a different one. The foot of a jogger moves
/// at 5 heights per second.
const MOST_SPEED: f64 = 9.0;
/// Maximum change of a velocity between successive intervals, in heights per second. A larger change means that one of the two velocities
/// belongs to a different point.
const MOST_CHANGE: f64 = 6.0;
/// Maximum time between two pictures that determine a velocity, in seconds.
const LONGEST_GAP_S: f64 = 0.15;
/// Assumed speed of a point with unknown velocity, in heights per second.
const UNKNOWN_SPEED: f64 = 1.0;

/// Positions of the points of one view in the last pictures.
#[derive(Debug, Clone, Default)]
pub struct Tracks {
    /// Times and points of the last pictures, the newest last.
    noted: VecDeque<(f64, Vec<Option<Point2<f64>>>)>,
}

/// Velocity of a point in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    /// Velocity, in pixels per second.
    pub px_per_s: Vector2<f64>,
    /// Time between the two pictures from which the velocity was measured, in seconds.
    pub gap_s: f64,
}

impl Velocity {
    /// Returns the movement of the point during a given time, in pixels. Returns `None` for a time longer than the interval over which the
    /// velocity was measured, because nobody moves evenly for that long.
    pub fn shift(&self, seconds: f64) -> Option<Vector2<f64>> {
        (seconds.abs() <= self.gap_s).then(|| self.px_per_s * seconds)
    }
}

impl Tracks {
    /// Adds a picture. A picture that is not later than the previous one resets the tracks.
    ///
    /// * `taken_s`: time of the picture, in seconds.
    /// * `points_px`: points, in the same order in every picture; `None` for an unknown point.
    pub fn note(&mut self, taken_s: f64, points_px: Vec<Option<Point2<f64>>>) {
        if self.noted.back().is_some_and(|noted| taken_s <= noted.0) {
            self.noted.clear();
        }
        if !taken_s.is_finite() {
            return;
        }
        self.noted.push_back((taken_s, points_px));
        if self.noted.len() > N_NOTED {
            self.noted.pop_front();
        }
    }

    /// Returns the velocity of a point from the last picture to a new picture that is not added yet.
    ///
    /// * `taken_s`: time of the new picture, in seconds.
    /// * `height_px`: height of the person, in pixels; the longer side of the rectangle around the points.
    /// * Returns `None` for a point that is too fast, that was not seen before, or whose velocity has changed too much.
    pub fn velocity(
        &self,
        nth: usize,
        (taken_s, at): (f64, Point2<f64>),
        height_px: f64,
    ) -> Option<Velocity> {
        let mut known = self.noted.iter().rev().map(|(seconds, points)| {
            let point = points.get(nth).copied().flatten();
            point.map(|at| (*seconds, at))
        });
        let before = known.next()??;
        let velocity = between(before, (taken_s, at))?;
        let earlier = known.next().flatten().and_then(|earlier| between(earlier, before));
        let change = earlier.map_or(0.0, |earlier| (earlier.px_per_s - velocity.px_per_s).norm());
        let is_person =
            velocity.px_per_s.norm() <= MOST_SPEED * height_px && change <= MOST_CHANGE * height_px;
        is_person.then_some(velocity)
    }
}

fn between((from_s, from): (f64, Point2<f64>), (to_s, to): (f64, Point2<f64>)) -> Option<Velocity> {
    let gap_s = to_s - from_s;
    let px_per_s = (to - from) / gap_s;
    let is_near = gap_s > 0.0 && gap_s <= LONGEST_GAP_S;
    (is_near && px_per_s.iter().all(|px_per_s| px_per_s.is_finite()))
        .then_some(Velocity { px_per_s, gap_s })
}

/// Returns the position of a point at the instant of its frame, in pixels, and the standard deviation to add to its own. If the instant is
/// between the two pictures that give the velocity, a moved point is as accurate as an observed one. At a time `s` after the later picture
/// (negative if before it), `x + (x - x') s / gap` has `(1 + s / gap)^2 + (s / gap)^2` times the variance of `x`.
///
/// * `velocity`: result of [`Tracks::velocity`]. A point without a velocity, or with a skew that is too long for the velocity, keeps its
///   position and gets a larger standard deviation.
/// * `sigma_px`: standard deviation of the point.
/// * `height_px`: height of the person.
pub fn moved(
    at: Point2<f64>,
    velocity: Option<Velocity>,
    skew_s: f64,
    [sigma_px, height_px]: [f64; 2],
) -> (Point2<f64>, f64) {
    let known = velocity.and_then(|velocity| Some((velocity.shift(skew_s)?, velocity.gap_s)));
    let Some((shift, gap_s)) = known else {
        return (at, widened_px(0.0, UNKNOWN_SPEED * height_px, skew_s));
    };
    let share = skew_s / gap_s;
    let variances = (1.0 - share).powi(2) + share.powi(2);
    let more = sigma_px * (variances - 1.0).max(0.0).sqrt();
    (at - shift, more)
}

/// Returns the standard deviation of a point that is not moved, in pixels.
///
/// * `sigma_px`: standard deviation at the time of the picture.
/// * `px_per_s`: speed of the point.
pub fn widened_px(sigma_px: f64, px_per_s: f64, skew_s: f64) -> f64 {
    sigma_px.hypot(px_per_s * skew_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEIGHT: f64 = 200.0;

    fn at(x: f64) -> Vec<Option<Point2<f64>>> {
        vec![Some(Point2::new(x, 7.0)), None]
    }

    fn speed(tracks: &Tracks, taken_s: f64, x: f64) -> Option<f64> {
        let found = tracks.velocity(0, (taken_s, Point2::new(x, 7.0)), HEIGHT);
        found.map(|velocity| velocity.px_per_s.x)
    }

    #[test]
    fn a_point_is_moved_back_to_the_instant_by_its_velocity() {
        let mut tracks = Tracks::default();
        tracks.note(1.0, at(100.0));
        let now = Point2::new(110.0, 7.0);
        let velocity = tracks.velocity(0, (1.05, now), HEIGHT).unwrap();
        let (late, more) = moved(now, Some(velocity), 0.01, [2.0, HEIGHT]);
        assert!((late.x - 108.0).abs() < 1e-9 && more == 0.0);
        let (early, more) = moved(now, Some(velocity), -0.01, [2.0, HEIGHT]);
        assert!((early.x - 112.0).abs() < 1e-9);
        assert!((more - 2.0 * (1.2_f64.powi(2) + 0.04 - 1.0).sqrt()).abs() < 1e-9);
        assert_eq!(moved(now, Some(velocity), 0.0, [2.0, HEIGHT]), (now, 0.0));
        assert_eq!(moved(now, None, -0.02, [2.0, HEIGHT]), (now, 4.0));
        let far = moved(now, Some(velocity), 0.06, [2.0, HEIGHT]);
        assert_eq!(
            far,
            (now, 0.06 * HEIGHT),
            "more than the time between the pictures"
        );
    }

    #[test]
    fn a_point_that_jumps_has_no_velocity() {
        let mut tracks = Tracks::default();
        assert_eq!(speed(&tracks, 1.0, 0.0), None);
        tracks.note(0.9, at(98.0));
        tracks.note(1.0, at(100.0));
        assert_eq!(speed(&tracks, 1.1, 102.0).map(f64::round), Some(20.0));
        // The point moved at 20 pixels per second, and now seems to move at 1400: it must be a different point.
        assert_eq!(speed(&tracks, 1.1, 240.0), None);
        tracks.note(1.1, at(240.0));
        assert_eq!(speed(&tracks, 1.2, 242.0), None, "nor on its way back");
        tracks.note(1.2, at(242.0));
        assert_eq!(speed(&tracks, 1.3, 244.0).map(f64::round), Some(20.0));
        assert_eq!(speed(&tracks, 1.4, 244.0), None, "too long ago");
        assert_eq!(speed(&tracks, 1.2, 244.0), None, "not later");
        assert_eq!(speed(&tracks, f64::NAN, 244.0), None);
        assert_eq!(tracks.velocity(1, (1.3, Point2::origin()), HEIGHT), None);
        assert_eq!(tracks.velocity(9, (1.3, Point2::origin()), HEIGHT), None);
    }

    #[test]
    fn a_clock_that_goes_back_resets_the_velocity() {
        let mut tracks = Tracks::default();
        tracks.note(5.0, at(0.0));
        tracks.note(1.0, at(100.0));
        tracks.note(f64::NAN, at(3.0));
        assert_eq!(speed(&tracks, 1.1, 102.0).map(f64::round), Some(20.0));
    }
}
