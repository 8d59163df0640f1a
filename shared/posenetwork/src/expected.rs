//! The expected error of the joints that a network finds, computed from their heat.

/// Heat, 0 to 1, and the standard deviation of the position along one axis, as a share of the height of the network's window. The standard
/// deviations were fitted to the joints that `TinyPose` found for 689 people of LSP-extended, in ground-truth boxes. Two thirds of the
/// errors are below 1.515 standard deviations, as for a normal distribution in the plane. For 172 other people, 69 % of the errors are
/// below this limit.
const KNOWN: [[f64; 2]; 11] = [
    [0.0, 0.17],
    [0.15, 0.145],
    [0.25, 0.095],
    [0.35, 0.068],
    [0.45, 0.048],
    [0.55, 0.039],
    [0.65, 0.033],
    [0.75, 0.027],
    [0.85, 0.021],
    [0.95, 0.016],
    [1.0, 0.015],
];

/// The expected error of a joint's position along one axis, as a share of the height of the network's window.
///
/// * `heat`: value of the joint's map at its peak, 0 to 1.
pub fn expected_error(heat: f64) -> f64 {
    let heat = heat.clamp(0.0, 1.0);
    let beyond = KNOWN.iter().position(|[at, _]| *at >= heat);
    let after = beyond.unwrap_or(KNOWN.len() - 1).max(1);
    let ([h0, e0], [h1, e1]) = (KNOWN[after - 1], KNOWN[after]);
    e0 + (e1 - e0) * (heat - h0) / (h1 - h0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_higher_heat_gives_a_lower_expected_error() {
        assert_eq!(expected_error(0.0), 0.17);
        assert_eq!(expected_error(0.25), 0.095);
        assert_eq!(expected_error(2.0), 0.015);
        assert_eq!(expected_error(0.6), f64::midpoint(0.039, 0.033));
        let all: Vec<f64> = (0..=100).map(|i| expected_error(f64::from(i) / 100.0)).collect();
        assert!(all.is_sorted_by(|a, b| a > b), "{all:?}");
    }
}
