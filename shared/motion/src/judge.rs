//! Compares a track with the truth: positions, velocities, accelerations, jitter and delay.

use nalgebra::Vector3;

/// Positions of one joint over time, in metres; `None` at instants without a position.
pub type Path = [Option<Vector3<f64>>];

/// A sum, and the number of its values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sum {
    /// Sum of the values.
    pub sum: f64,
    /// Number of values.
    pub n: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.n += 1.0;
    }

    fn take(&mut self, other: Self) {
        self.sum += other.sum;
        self.n += other.n;
    }
}

/// The errors of all joints at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Distance from the true position, in metres.
    pub position_m: Sum,
    /// Error of the velocity by central differences, in m/s.
    pub velocity_m_s: Sum,
    /// Error of the acceleration by second differences, in m/s².
    pub acceleration_m_s2: Sum,
    /// Change of the position error from one instant to the next, in metres.
    pub jitter_m: Sum,
    /// First, the position error along the true velocity, multiplied by that velocity (m²/s); second, the square of the velocity (m²/s²).
    /// Both are summed over instants. The ratio of the first to the second is the delay of the track, in seconds.
    pub late: [f64; 2],
}

impl Errors {
    /// Adds the errors of another instant.
    pub fn add(&mut self, other: &Self) {
        self.position_m.take(other.position_m);
        self.velocity_m_s.take(other.velocity_m_s);
        self.acceleration_m_s2.take(other.acceleration_m_s2);
        self.jitter_m.take(other.jitter_m);
        self.late[0] += other.late[0];
        self.late[1] += other.late[1];
    }
}

/// Compares one joint with the truth, and adds the differences to the errors of every instant.
///
/// Differences are taken over three successive instants, for the track and the truth in the same way. They are compared only at the
/// instants selected by `counted`, so that several tracks can be compared at the same instants.
///
/// * `times`: times in seconds, in ascending order.
/// * `counted`: for every instant, true if it is compared; the truth must be known there.
pub fn add(errors: &mut [Errors], times: &[f64], track: &Path, truth: &Path, counted: &[bool]) {
    let both = |at: usize| {
        let is_counted = counted.get(at).copied().unwrap_or(false);
        track[at].zip(truth[at]).filter(|_| is_counted)
    };
    for at in 0..times.len() {
        let Some((here, true_here)) = both(at) else {
            continue;
        };
        errors[at].position_m.add((here - true_here).norm());
        let Some((before, true_before)) = at.checked_sub(1).and_then(both) else {
            continue;
        };
        let change = (here - true_here) - (before - true_before);
        errors[at].jitter_m.add(change.norm());
        if at + 1 >= times.len() {
            continue;
        }
        let Some((after, true_after)) = both(at + 1) else {
            continue;
        };
        let times = [times[at - 1], times[at], times[at + 1]];
        let (velocity, acceleration) = differences(times, [before, here, after]);
        let (true_velocity, true_acceleration) =
            differences(times, [true_before, true_here, true_after]);
        let it = &mut errors[at];
        it.velocity_m_s.add((velocity - true_velocity).norm());
        it.acceleration_m_s2.add((acceleration - true_acceleration).norm());
        it.late[0] -= (here - true_here).dot(&true_velocity);
        it.late[1] += true_velocity.norm_squared();
    }
}

/// Returns the velocity and acceleration at the middle point of the parabola through three points.
fn differences(times: [f64; 3], points: [Vector3<f64>; 3]) -> (Vector3<f64>, Vector3<f64>) {
    let [before, after] = [times[1] - times[0], times[2] - times[1]];
    let slopes = [
        (points[1] - points[0]) / before,
        (points[2] - points[1]) / after,
    ];
    let whole = before + after;
    let velocity = (slopes[0] * after + slopes[1] * before) / whole;
    (velocity, (slopes[1] - slopes[0]) * (2.0 / whole))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_own_velocity_and_acceleration() {
        let at = |t: f64| Vector3::new(1.0 + 2.0 * t + 3.0 * t * t, -t, 0.0);
        let times = [0.1, 0.15, 0.3];
        let (velocity, acceleration) = differences(times, times.map(at));
        assert!((velocity - Vector3::new(2.9, -1.0, 0.0)).norm() < 1e-9);
        assert!((acceleration - Vector3::new(6.0, 0.0, 0.0)).norm() < 1e-9);
    }

    #[test]
    fn the_delay_of_a_late_track_is_measured() {
        let times: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        let at = |t: f64| Some(Vector3::new((3.0 * t).sin(), (2.0 * t).cos(), 0.0));
        let truth: Vec<_> = times.iter().map(|&t| at(t)).collect();
        let late: Vec<_> = times.iter().map(|&t| at(t - 0.02)).collect();
        let mut errors = vec![Errors::default(); 200];
        add(&mut errors, &times, &late, &truth, &[true; 200]);
        let [along, squared] = errors.iter().fold([0.0, 0.0], |sum, it| {
            [sum[0] + it.late[0], sum[1] + it.late[1]]
        });
        assert!((along / squared - 0.02).abs() < 1e-3, "{}", along / squared);
    }

    #[test]
    fn excluded_instants_are_ignored() {
        let times = [0.0, 0.1, 0.2, 0.3];
        let path = [
            Some(Vector3::zeros()),
            Some(Vector3::x()),
            None,
            Some(Vector3::zeros()),
        ];
        let truth = [Some(Vector3::zeros()); 4];
        let mut errors = vec![Errors::default(); 4];
        add(
            &mut errors,
            &times,
            &path,
            &truth,
            &[true, false, true, true],
        );
        let n: f64 = errors.iter().map(|error| error.position_m.n).sum();
        assert_eq!(n, 2.0);
        assert!(errors.iter().all(|error| error.jitter_m.n == 0.0));
    }
}
