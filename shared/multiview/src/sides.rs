//! Decides, for all views together and over time, which side of the body is the right-hand side.
//!
//! Swapping left and right in all views changes no energy. So the decision uses the views' evidence of the direction in which the person
//! faces ([`front`](crate::front())), and the way in which bodies bend ([`anatomical_evidence`](crate::anatomical_evidence)).

use nalgebra::Vector3;

/// Settings for deciding left and right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SidesSettings {
    /// Weight of the views' evidence of the direction in which the person faces: log-likelihood ratio per nat. It is below 1 because the
    /// errors of the views are not independent.
    pub front_weight: f64,
    /// Log-likelihood ratio per unit of anatomical evidence (trunk lengths), in nats.
    pub anatomy_weight: f64,
    /// Probability that a person turns around from one frame to the next. It limits how much the earlier frames count.
    pub turn: f64,
    /// Log-odds below which a decision is unsure, in nats.
    pub unsure: f64,
}

impl Default for SidesSettings {
    fn default() -> Self {
        Self {
            front_weight: 0.6,
            anatomy_weight: 1.0,
            turn: 0.02,
            unsure: 1.5,
        }
    }
}

/// The decision for one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sides {
    /// True if left and right must be swapped in all views.
    pub exchange: bool,
    /// Log-odds of the decision, in nats; not negative.
    pub margin: f64,
    /// True if the margin is too small to rely on.
    pub unsure: bool,
}

/// Tracks over time which side is the right-hand side, with a Bayes filter of one bit.
///
/// The bit is passed from frame to frame by means of the direction in which the person faces, so how the earlier frames were labelled does
/// not matter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SidesFilter {
    /// The last direction, and the log-odds that it is correct.
    last: Option<(Vector3<f64>, f64)>,
}

impl SidesFilter {
    /// Decides a frame.
    ///
    /// * `front`: direction in which the skeleton faces according to its labels, as a unit vector; `None` if
    ///   unknown.
    /// * `evidence`: log-likelihood ratio of the labels over the swapped labels, from this frame alone, in nats.
    pub fn decide(
        &mut self,
        settings: &SidesSettings,
        front: Option<Vector3<f64>>,
        evidence: f64,
    ) -> Sides {
        let evidence = if evidence.is_finite() { evidence } else { 0.0 };
        let earlier = match (front, self.last) {
            (Some(front), Some(last)) => carried(settings, front.dot(&last.0), last.1),
            _ => 0.0,
        };
        let log_odds = earlier + evidence;
        if let Some(front) = front {
            self.last = Some((front, log_odds));
        }
        Sides {
            exchange: log_odds < 0.0,
            margin: log_odds.abs(),
            unsure: log_odds.abs() < settings.unsure,
        }
    }
}

/// Returns the log-odds of this frame's labels that follow from the log-odds of the last frame's labels.
///
/// * `cosine`: cosine of the angle between the two directions. If the person seems to have turned by a right angle, the turn may have been
///   to either side.
fn carried(settings: &SidesSettings, cosine: f64, log_odds: f64) -> f64 {
    let cosine = cosine.clamp(-1.0, 1.0);
    let turned = settings.turn + (0.5 - settings.turn) * (1.0 - cosine.abs());
    let odds = log_odds.clamp(-50.0, 50.0).exp();
    let carried = (((1.0 - turned) * odds + turned) / (turned * odds + 1.0 - turned)).ln();
    if cosine < 0.0 { -carried } else { carried }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decide(filter: &mut SidesFilter, front: Vector3<f64>, evidence: f64) -> Sides {
        filter.decide(&SidesSettings::default(), Some(front), evidence)
    }

    #[test]
    fn a_single_frame_is_decided_by_its_evidence() {
        let got = decide(&mut SidesFilter::default(), Vector3::x(), -4.0);
        assert!(got.exchange && !got.unsure);
        assert_eq!(got.margin, 4.0);
        assert!(decide(&mut SidesFilter::default(), Vector3::x(), 0.5).unsure);
    }

    #[test]
    fn earlier_frames_outvote_one_with_weak_evidence() {
        let mut filter = SidesFilter::default();
        for _ in 0..5 {
            decide(&mut filter, Vector3::x(), 2.0);
        }
        assert!(!decide(&mut filter, Vector3::x(), -1.0).exchange);
    }

    #[test]
    fn labels_that_swap_between_frames_are_corrected() {
        let mut filter = SidesFilter::default();
        for frame in 0..10 {
            let sign = if frame % 2 == 0 { 1.0 } else { -1.0 };
            let got = decide(&mut filter, Vector3::x() * sign, 0.8 * sign);
            assert_eq!(got.exchange, sign < 0.0, "frame {frame}");
        }
    }

    #[test]
    fn a_wrong_first_decision_is_corrected_by_strong_evidence() {
        let mut filter = SidesFilter::default();
        for _ in 0..100 {
            decide(&mut filter, Vector3::x(), -1.0);
        }
        for _ in 0..3 {
            decide(&mut filter, Vector3::x(), 4.0);
        }
        assert!(!decide(&mut filter, Vector3::x(), 4.0).exchange);
    }

    #[test]
    fn after_a_turn_by_a_right_angle_the_sides_are_decided_again() {
        let mut filter = SidesFilter::default();
        decide(&mut filter, Vector3::x(), 5.0);
        let got = decide(&mut filter, Vector3::y(), -0.5);
        assert!(got.exchange && got.unsure);
    }

    #[test]
    fn invalid_numbers_have_no_effect() {
        let got = decide(&mut SidesFilter::default(), Vector3::x(), f64::NAN);
        assert_eq!((got.exchange, got.margin, got.unsure), (false, 0.0, true));
    }
}
