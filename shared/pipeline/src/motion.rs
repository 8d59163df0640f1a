//! Corrects the points found in pictures that were not taken at the instant of their frame: moves the points to that instant.

use geometry::longer_side;
use geometry::skew::{Tracks, Velocity, moved};
use nalgebra::{Point2, Vector2};

use crate::fused_view::FusedView;
use crate::view_result::ViewResult;

/// Points of a view; `None` for a point that the view does not show.
type Points = Vec<Option<Point2<f64>>>;

/// The poses of the views at the instant of a frame.
#[derive(Debug, Clone)]
pub(crate) struct AtInstant {
    pub(crate) views: Vec<Option<FusedView>>,
    /// Standard deviations to add to the standard deviations of the parts, in pixels.
    pub(crate) more_px: Vec<Vec<f64>>,
}

/// Times that differ by less are of one picture, in seconds.
const SAME_PICTURE_S: f64 = 1e-4;

/// Motion of the points of every view from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    views: Vec<Moving>,
    /// Instant of the frame, in seconds.
    instant_s: Option<f64>,
}

/// Motion of the points of one view.
#[derive(Debug, Clone, Default)]
struct Moving {
    tracks: Tracks,
    /// Time of the last points, in seconds, and their velocities.
    last: Option<(f64, Vec<Option<Velocity>>)>,
}

impl Motion {
    /// Begins a frame.
    ///
    /// * `instant_s`: instant of the frame, in seconds. If it is `None` (frame rate unknown), nothing is moved.
    pub fn begin(&mut self, instant_s: Option<f64>) {
        self.instant_s = instant_s;
    }

    /// Returns the instant of the frame if points must be moved, that is, if any picture was taken at another time.
    fn instant(&self, answers: &[Option<ViewResult>]) -> Option<f64> {
        let is_off = answers.iter().flatten().any(|answer| answer.skew_s != 0.0);
        self.instant_s.filter(|_| is_off)
    }

    /// Returns the poses of the views at the instant of the frame; `None` if all pictures were taken at that instant.
    ///
    /// * `sigma_cells`: standard deviation of a part, in cells.
    pub(crate) fn at_instant(
        &mut self,
        answers: &[Option<ViewResult>],
        views: &[Option<FusedView>],
        sigma_cells: f64,
    ) -> Option<AtInstant> {
        let instant_s = self.instant(answers)?;
        let mut at_instant = views.to_vec();
        let mut more_px = vec![Vec::new(); views.len()];
        for (view, fused) in at_instant.iter_mut().enumerate() {
            let (Some(fused), Some(Some(answer))) = (fused, answers.get(view)) else {
                continue;
            };
            let centres = &mut fused.pose.centres_px;
            let points: Points = centres.iter().map(|centre| Some(Point2::from(*centre))).collect();
            let height_px = height(&points);
            let sizes = [fused.cell_px * sigma_cells, height_px];
            let skew_s = answer.skew_s;
            let velocities = self.velocities(view, instant_s + skew_s, points, height_px);
            more_px[view] = centres
                .iter_mut()
                .zip(velocities)
                .map(|(centre, velocity)| {
                    let (at, more) = moved(Point2::from(*centre), velocity, skew_s, sizes);
                    *centre = at.coords.into();
                    more
                })
                .collect();
        }
        Some(AtInstant {
            views: at_instant,
            more_px,
        })
    }

    /// Returns the displacement of the points of a view between the instant of the frame and the time of the picture, in pixels;
    /// `None` if the picture was taken at the instant. No point is moved by more than it moved between the last two pictures.
    ///
    /// * `skew_s`, `taken_s`: time of the picture and time of the points, both in seconds after the instant. Points of the same picture can
    ///   be given again in a later frame.
    pub(crate) fn since_instant(
        &mut self,
        view: usize,
        [skew_s, taken_s]: [f64; 2],
        points: Points,
    ) -> Option<Vec<Vector2<f64>>> {
        let instant_s = self.instant_s?;
        let height_px = height(&points);
        let velocities = self.velocities(view, instant_s + taken_s, points, height_px);
        if skew_s == 0.0 {
            return None;
        }
        let by = |velocity: Option<Velocity>| {
            velocity
                .and_then(|velocity| velocity.shift(skew_s.clamp(-velocity.gap_s, velocity.gap_s)))
                .unwrap_or_else(Vector2::zeros)
        };
        Some(velocities.into_iter().map(by).collect())
    }

    /// Computes and stores the velocities of the points of a view.
    fn velocities(
        &mut self,
        view: usize,
        taken_s: f64,
        points: Points,
        height_px: f64,
    ) -> Vec<Option<Velocity>> {
        if self.views.len() <= view {
            self.views.resize_with(view + 1, Moving::default);
        }
        let Moving { tracks, last } = &mut self.views[view];
        if let Some((last_s, velocities)) = last
            && (taken_s - *last_s).abs() < SAME_PICTURE_S
        {
            return velocities.clone();
        }
        let of_point = |(nth, at): (usize, &Option<Point2<f64>>)| {
            tracks.velocity(nth, (taken_s, (*at)?), height_px)
        };
        let velocities: Vec<Option<Velocity>> = points.iter().enumerate().map(of_point).collect();
        tracks.note(taken_s, points);
        *last = Some((taken_s, velocities.clone()));
        velocities
    }
}

/// Returns the height of the person in the picture, in pixels.
fn height(points: &Points) -> f64 {
    longer_side(points.iter().flatten().map(|point| [point.x, point.y])).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use multiview::FusedPose;

    use super::*;

    fn answer(skew_s: f64) -> ViewResult {
        ViewResult {
            candidates: Vec::new(),
            front: Vec::new(),
            sigma_px: None,
            tau_px: None,
            skew_s,
        }
    }

    fn view(x: f64) -> FusedView {
        FusedView {
            pose: FusedPose {
                centres_px: vec![[x, 0.0], [x, 200.0]],
                n_pairs: 0,
                energy: 0.0,
            },
            exchanged: false,
            cell_px: 4.0,
            single_score: 0.0,
        }
    }

    #[test]
    fn joints_of_every_view_are_moved_by_their_own_velocity_and_time() {
        let mut motion = Motion::default();
        let answers = [Some(answer(0.01)), Some(answer(-0.01)), None];
        motion.begin(Some(1.0));
        motion.at_instant(&answers, &[Some(view(10.0)), Some(view(30.0)), None], 1.0);
        motion.begin(Some(1.1));
        let found = motion.at_instant(&answers, &[Some(view(20.0)), Some(view(20.0)), None], 1.0);
        let AtInstant {
            views,
            more_px: more,
        } = found.unwrap();
        let x = |view: usize| views[view].as_ref().unwrap().pose.centres_px[1][0];
        assert!(
            (x(0) - 19.0).abs() < 1e-9 && (x(1) - 19.0).abs() < 1e-9,
            "{views:?}"
        );
        assert_eq!((more[0][0], more[2].len()), (0.0, 0));
        assert!(more[1][0] > 1.0);
    }

    #[test]
    fn points_seen_some_frames_ago_are_moved_by_their_last_velocity() {
        let mut motion = Motion::default();
        let points = |x: f64| vec![Some(Point2::new(x, 0.0)), Some(Point2::new(x, 200.0))];
        let mut since = |instant_s: f64, age_s: f64, x: f64| {
            motion.begin(Some(instant_s));
            let by = motion.since_instant(0, [-age_s; 2], points(x))?;
            Some(by[0].x)
        };
        assert_eq!(since(1.0, 0.0, 10.0), None);
        assert_eq!(since(1.1, 0.0, 20.0), None);
        // The same points again: they are 10 px behind.
        let again = since(1.2, 0.1, 20.0).unwrap();
        assert!((again + 10.0).abs() < 1e-6, "{again}");
        let later = since(1.3, 0.2, 20.0).unwrap();
        assert!((later + 10.0).abs() < 1e-6, "no farther than seen: {later}");
        assert_eq!(since(1.4, 0.0, 50.0), None);
    }

    #[test]
    fn nothing_is_moved_if_all_pictures_show_the_instant_or_times_are_unknown() {
        let mut motion = Motion::default();
        let views = [Some(view(10.0)), Some(view(30.0))];
        motion.begin(Some(1.0));
        assert!(
            motion
                .at_instant(&[Some(answer(0.0)), Some(answer(0.0))], &views, 1.0)
                .is_none()
        );
        motion.begin(None);
        assert!(
            motion
                .at_instant(&[Some(answer(0.01)), Some(answer(0.0))], &views, 1.0)
                .is_none()
        );
    }
}
