//! Selects the views whose rays to a point cross at wide angles.

use nalgebra::Vector3;

/// The direction in which a view sees a point, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sightline {
    /// Unit vector in the world.
    pub direction: Vector3<f64>,
    /// Weight of the view, at least 0.
    pub weight: f64,
}

/// Returns the indices of at most `n` views, in increasing order. The first choice is the view with the largest weight. Each next choice
/// has the largest product of its weight and the sine of its smallest angle to the views chosen so far. Opposite directions count as equal,
/// because their rays cross nowhere.
pub fn widest_apart(views: &[Sightline], n: usize) -> Vec<usize> {
    if views.len() <= n {
        return (0..views.len()).collect();
    }
    let mut squared_sines = vec![1.0_f64; views.len()];
    let mut chosen: Vec<usize> = Vec::with_capacity(n);
    for _ in 0..n {
        let mut best: Option<(usize, f64)> = None;
        for (nth, view) in views.iter().enumerate().filter(|(nth, _)| !chosen.contains(nth)) {
            let value = view.weight * view.weight * squared_sines[nth];
            if best.is_none_or(|best| value > best.1) {
                best = Some((nth, value));
            }
        }
        let Some((nth, _)) = best else { break };
        chosen.push(nth);
        for (least, view) in squared_sines.iter_mut().zip(views) {
            let cosine = view.direction.dot(&views[nth].direction);
            *least = least.min((1.0 - cosine * cosine).max(0.0));
        }
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(n: usize) -> Vec<Sightline> {
        let at = |nth: usize| {
            let angle = core::f64::consts::TAU * nth as f64 / n as f64;
            Sightline {
                direction: Vector3::new(angle.cos(), angle.sin(), 0.0),
                weight: 1.0,
            }
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn views_of_a_ring_are_chosen_all_around_and_never_opposite_each_other() {
        assert_eq!(widest_apart(&ring(8), 2), [0, 2]);
        assert_eq!(widest_apart(&ring(16), 4), [0, 2, 4, 6]);
    }

    #[test]
    fn few_views_are_all_chosen() {
        assert_eq!(widest_apart(&ring(4), 6), [0, 1, 2, 3]);
        assert_eq!(widest_apart(&[], 6), [0_usize; 0]);
    }

    #[test]
    fn a_view_that_sees_little_is_not_chosen() {
        let mut views = ring(8);
        views[2].weight = 0.1;
        assert_eq!(widest_apart(&views, 2), [0, 6]);
        views[0].weight = 0.0;
        assert!(!widest_apart(&views, 3).contains(&0));
    }
}
