//! Simulated disturbances that occur in real recordings: for example, part of a person is covered, a camera was rotated, or a view shows
//! another person.

use core::fmt;
use core::str::FromStr;

use geometry::Camera;

/// One disturbance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stress {
    /// No disturbance.
    Clean,
    /// In this many views, half of the person is covered with grey: the left, right, upper and lower half in turn.
    Covered(usize),
    /// Only this many views exist. The choice of views changes from frame to frame.
    Views(usize),
    /// One camera was rotated by this many degrees about its vertical axis after the calibration.
    Turned(f64),
    /// One view shows another person: the same person, shifted sideways by half the person's height.
    Bystander,
    /// Left and right are swapped in one view.
    Exchanged,
}

impl Stress {
    /// The disturbances of `--stress all`.
    pub const ALL: [Self; 7] = [
        Self::Clean,
        Self::Covered(1),
        Self::Covered(2),
        Self::Views(2),
        Self::Turned(2.0),
        Self::Bystander,
        Self::Exchanged,
    ];

    /// Returns the views to use at a frame.
    ///
    /// * `nth`: number of the frame, counted from 0.
    pub fn views(self, nth: usize, n_views: usize) -> Vec<usize> {
        match self {
            Self::Views(n) => (0..n.min(n_views)).map(|i| (i + nth) % n_views).collect(),
            _ => (0..n_views).collect(),
        }
    }

    /// Returns true if a view is disturbed at a frame. The views are disturbed in turn.
    pub fn hits(self, nth: usize, view: usize, n_views: usize) -> bool {
        let place = (view + nth) % n_views.max(1);
        match self {
            Self::Clean | Self::Views(_) => false,
            Self::Covered(n) => place < n,
            Self::Turned(_) | Self::Bystander | Self::Exchanged => place == 0,
        }
    }

    /// Returns the camera with the calibration that was made before the camera was rotated.
    pub fn calibrated(self, camera: &Camera) -> Camera {
        let Self::Turned(degrees) = self else {
            return camera.clone();
        };
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, degrees.to_radians(), 0.0);
        Camera {
            camera_from_world: turn * camera.camera_from_world,
            ..camera.clone()
        }
    }
}

/// Covers half of a person with grey.
///
/// * `rgb`: the picture, three bytes per pixel; `size` is its width and height.
/// * `outline`: box of the person: left, top, right, bottom, in pixels. A margin of 15 % of its height is added.
/// * `nth`: selects the half: in turn left, right, upper or lower.
pub fn cover_half(rgb: &mut [u8], size: [usize; 2], outline: [f64; 4], nth: usize) {
    const GREY: u8 = 127;
    let margin = 0.15 * (outline[3] - outline[1]);
    let [mut left, mut top] = [outline[0] - margin, outline[1] - margin];
    let [mut right, mut bottom] = [outline[2] + margin, outline[3] + margin];
    match nth % 4 {
        0 => right = f64::midpoint(left, right),
        1 => left = f64::midpoint(left, right),
        2 => bottom = f64::midpoint(top, bottom),
        _ => top = f64::midpoint(top, bottom),
    }
    let pixels = |from: f64, to: f64, side: usize| {
        let at = |value: f64| (value.max(0.0) as usize).min(side);
        at(from)..at(to).max(at(from))
    };
    let columns = pixels(left, right, size[0]);
    for row in pixels(top, bottom, size[1]) {
        rgb[3 * (row * size[0] + columns.start)..3 * (row * size[0] + columns.end)].fill(GREY);
    }
}

impl fmt::Display for Stress {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clean => to.write_str("clean"),
            Self::Covered(n) => write!(to, "covered:{n}"),
            Self::Views(n) => write!(to, "views:{n}"),
            Self::Turned(degrees) => write!(to, "turned:{degrees}"),
            Self::Bystander => to.write_str("bystander"),
            Self::Exchanged => to.write_str("exchanged"),
        }
    }
}

/// Error: the text does not name a disturbance.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is not one of clean, covered:N, views:N (N from 2), turned:DEGREES, bystander, exchanged"
)]
pub struct UnknownStress(String);

impl FromStr for Stress {
    type Err = UnknownStress;

    fn from_str(text: &str) -> Result<Self, UnknownStress> {
        let unknown = || UnknownStress(text.to_owned());
        let (name, value) = text.split_once(':').unwrap_or((text, ""));
        let count = |least: usize| match value.parse() {
            Ok(n) if (least..=64).contains(&n) => Ok(n),
            _ => Err(unknown()),
        };
        match (name, value) {
            ("clean", "") => Ok(Self::Clean),
            ("covered", _) => count(1).map(Self::Covered),
            ("views", _) => count(2).map(Self::Views),
            ("turned", _) => match value.parse::<f64>() {
                Ok(degrees) if degrees.abs() <= 180.0 => Ok(Self::Turned(degrees)),
                _ => Err(unknown()),
            },
            ("bystander", "") => Ok(Self::Bystander),
            ("exchanged", "") => Ok(Self::Exchanged),
            _ => Err(unknown()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stress_test_is_parsed_from_its_written_form_and_others_are_refused() {
        for stress in Stress::ALL {
            assert_eq!(stress.to_string().parse(), Ok(stress));
        }
        for text in [
            "",
            "dirty",
            "covered",
            "covered:0",
            "views:1",
            "turned:x",
            "turned:NaN",
            "clean:1",
        ] {
            let refused = text.parse::<Stress>().unwrap_err();
            assert!(
                refused.to_string().contains("is not one of clean"),
                "{text}"
            );
        }
    }

    #[test]
    fn the_stress_affects_each_view_in_turn() {
        for stress in [Stress::Covered(2), Stress::Bystander] {
            let hit: Vec<Vec<usize>> = (0..4)
                .map(|nth| (0..4).filter(|view| stress.hits(nth, *view, 4)).collect())
                .collect();
            let n = if stress == Stress::Bystander { 1 } else { 2 };
            assert!(hit.iter().all(|views| views.len() == n), "{hit:?}");
            assert!((0..4).all(|view| hit.iter().filter(|hit| hit.contains(&view)).count() == n));
        }
        assert_eq!(Stress::Views(2).views(3, 4), [3, 0]);
        assert_eq!(Stress::Clean.views(3, 4), [0, 1, 2, 3]);
    }

    #[test]
    fn covering_paints_one_half_grey_and_keeps_the_other_half() {
        for nth in 0..4 {
            let mut rgb = vec![9; 3 * 100 * 80];
            cover_half(&mut rgb, [100, 80], [20.0, 10.0, 60.0, 50.0], nth);
            let grey = rgb.chunks_exact(3).filter(|chunk| *chunk == [127; 3]).count();
            assert_eq!(grey, 52 * 26, "{nth}");
            let inside = |x: usize, y: usize| rgb[3 * (y * 100 + x)] == 127;
            let corners = [inside(16, 6), inside(63, 6), inside(16, 53), inside(63, 53)];
            let expected = [
                [true, false, true, false],
                [false, true, false, true],
                [true, true, false, false],
                [false, false, true, true],
            ];
            assert_eq!(corners, expected[nth], "{nth}");
        }
        let mut small = vec![9; 3 * 4 * 4];
        cover_half(&mut small, [4, 4], [-90.0, -90.0, -50.0, -50.0], 0);
        assert!(small.iter().all(|value| *value == 9));
    }
}
