//! Percentage of correctly detected parts in one image.

/// A stick: its name, and the joints at each of its ends; an end is the mean of its joints.
type Stick = (&'static str, &'static [usize], &'static [usize]);

/// The ten sticks of the PARSE evaluation, with ends in `skeleton::PARSE14` order.
///
/// The torso goes from the midpoint of the shoulders to the midpoint of the hips, limbs from joint to joint, and the head
/// from the neck to the top of the head.
pub const PARSE_STICKS: [Stick; 10] = [
    ("torso", &[8, 9], &[2, 3]),
    ("right upper leg", &[2], &[1]),
    ("left upper leg", &[3], &[4]),
    ("right lower leg", &[1], &[0]),
    ("left lower leg", &[4], &[5]),
    ("right upper arm", &[8], &[7]),
    ("left upper arm", &[9], &[10]),
    ("right lower arm", &[7], &[6]),
    ("left lower arm", &[10], &[11]),
    ("head", &[12], &[13]),
];

/// Rule for judging the two ends of a stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PcpRule {
    /// Each end must be within half the stick's true length of the true end.
    BothEnds,
    /// The mean of the two ends' distances from the truth must be at most half the stick's true length.
    MeanOfEnds,
}

/// Number of correct sticks and of judged sticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pcp {
    /// Number of sticks found.
    pub correct: usize,
    /// Number of sticks judged.
    pub total: usize,
}

impl Pcp {
    /// Returns the percentage of correct sticks; 0 if nothing was judged.
    pub fn percent(&self) -> f64 {
        if self.total == 0 {
            return 0.0;
        }
        100.0 * self.correct as f64 / self.total as f64
    }

    /// Counts one more stick.
    pub fn count(&mut self, is_correct: bool) {
        self.correct += usize::from(is_correct);
        self.total += 1;
    }

    /// Adds another image.
    pub fn add(&mut self, other: Self) {
        self.correct += other.correct;
        self.total += other.total;
    }
}

/// Judges the ten sticks of one image, with half of the true length as the limit.
///
/// * `found`, `truth`: the 14 joints of `skeleton::PARSE14`, in pixels.
pub fn pcp(found: &[[f64; 2]; 14], truth: &[[f64; 2]; 14], rule: PcpRule) -> Pcp {
    let sticks = sticks_found(found, truth, rule);
    Pcp {
        correct: sticks.iter().filter(|stick| **stick).count(),
        total: sticks.len(),
    }
}

/// Returns which of [`PARSE_STICKS`] are found, with half of the true length as the limit.
///
/// * `found`, `truth`: the 14 joints of `skeleton::PARSE14`, in pixels.
pub fn sticks_found(
    found: &[[f64; 2]; 14],
    truth: &[[f64; 2]; 14],
    rule: PcpRule,
) -> [bool; PARSE_STICKS.len()] {
    let end = |joints: &[[f64; 2]; 14], of: &[usize]| {
        let n = of.len() as f64;
        let sum = of.iter().fold([0.0; 2], |sum, &it| {
            [sum[0] + joints[it][0], sum[1] + joints[it][1]]
        });
        [sum[0] / n, sum[1] / n]
    };
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    PARSE_STICKS.map(|(_, from, to)| {
        let limit = 0.5 * distance(end(truth, from), end(truth, to));
        let errors = [from, to].map(|joint| distance(end(found, joint), end(truth, joint)));
        match rule {
            PcpRule::BothEnds => errors.iter().all(|error| *error <= limit),
            PcpRule::MeanOfEnds => f64::midpoint(errors[0], errors[1]) <= limit,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person() -> [[f64; 2]; 14] {
        std::array::from_fn(|joint| [10.0 * (joint % 4) as f64, 25.0 * (joint / 4) as f64])
    }

    #[test]
    fn the_ground_truth_is_completely_correct() {
        let got = pcp(&person(), &person(), PcpRule::BothEnds);
        assert_eq!((got.correct, got.percent()), (10, 100.0));
    }

    #[test]
    fn one_wrong_end_fails_the_strict_rule_and_passes_the_mean_rule() {
        let truth = person();
        let mut found = truth;
        let length = (truth[12][0] - truth[13][0]).hypot(truth[12][1] - truth[13][1]);
        found[13][0] += 0.8 * length;
        assert_eq!(pcp(&found, &truth, PcpRule::BothEnds).correct, 9);
        assert_eq!(pcp(&found, &truth, PcpRule::MeanOfEnds).correct, 10);
    }
}
