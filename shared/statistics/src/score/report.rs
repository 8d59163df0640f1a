//! Counts over the images of a test set, and their table.

use std::fmt;

use crate::score::pck::{PCK_GROUPS, joints_found};
use crate::score::pcp::{PARSE_STICKS, Pcp, PcpRule, sticks_found};

/// PCK thresholds, as fractions of the person's size.
pub const PCK_SHARES: [f64; 2] = [0.1, 0.2];

/// PCP by both rules and PCK at both thresholds, per stick and per joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    n_images: usize,
    n_missed: usize,
    sticks: [[Pcp; PARSE_STICKS.len()]; 2],
    joints: [[Pcp; 14]; 2],
}

/// Judges a list of images.
///
/// * `images`: the detection (if `None`, all joints count as wrong) and the truth, each with 14
///   joints in the order of `skeleton::PARSE14`, in pixels.
pub fn evaluate<'a>(
    images: impl IntoIterator<Item = (Option<&'a [[f64; 2]; 14]>, &'a [[f64; 2]; 14])>,
) -> Report {
    let mut report = Report::default();
    for (found, truth) in images {
        report.add(found, truth);
    }
    report
}

impl Report {
    /// Counts one more image; see [`evaluate`].
    pub fn add(&mut self, found: Option<&[[f64; 2]; 14]>, truth: &[[f64; 2]; 14]) {
        self.n_images += 1;
        self.n_missed += usize::from(found.is_none());
        let found = found.unwrap_or(&[[f64::NAN; 2]; 14]);
        for (rule, sticks) in RULES.into_iter().zip(&mut self.sticks) {
            for (stick, is_found) in sticks.iter_mut().zip(sticks_found(found, truth, rule)) {
                stick.count(is_found);
            }
        }
        for (share, joints) in PCK_SHARES.into_iter().zip(&mut self.joints) {
            for (joint, is_found) in joints.iter_mut().zip(joints_found(found, truth, share)) {
                joint.count(is_found);
            }
        }
    }

    /// Returns the number of judged images.
    pub fn n_images(&self) -> usize {
        self.n_images
    }

    /// Returns the number of images on which nothing was found.
    pub fn n_missed(&self) -> usize {
        self.n_missed
    }

    /// Returns the result over all sticks.
    pub fn pcp(&self, rule: PcpRule) -> Pcp {
        sum(self.sticks(rule).iter().copied())
    }

    /// Returns the result of each of [`PARSE_STICKS`].
    pub fn sticks(&self, rule: PcpRule) -> &[Pcp; PARSE_STICKS.len()] {
        match rule {
            PcpRule::MeanOfEnds => &self.sticks[0],
            PcpRule::BothEnds => &self.sticks[1],
        }
    }

    /// Returns the results as in publications: left and right sticks are combined in one column; each column has a name.
    pub fn limbs(&self, rule: PcpRule) -> [(&'static str, Pcp); COLUMNS.len()] {
        COLUMNS.map(|(name, sticks)| {
            let sticks = sticks.iter().map(|&stick| self.sticks(rule)[stick]);
            (name, sum(sticks))
        })
    }

    /// Returns the result over all joints, which is the mean over [`PCK_GROUPS`].
    ///
    /// * `share`: index of the threshold in [`PCK_SHARES`].
    ///
    /// # Panics
    ///
    /// If there is no such threshold.
    pub fn pck(&self, share: usize) -> Pcp {
        sum(self.joints[share].iter().copied())
    }

    /// Returns the result of each of [`PCK_GROUPS`].
    ///
    /// * `share`: index of the threshold in [`PCK_SHARES`].
    ///
    /// # Panics
    ///
    /// If there is no such threshold.
    pub fn groups(&self, share: usize) -> [Pcp; PCK_GROUPS.len()] {
        PCK_GROUPS.map(|(_, joints)| sum(joints.iter().map(|&joint| self.joints[share][joint])))
    }
}

const RULES: [PcpRule; 2] = [PcpRule::MeanOfEnds, PcpRule::BothEnds];

fn sum(counts: impl IntoIterator<Item = Pcp>) -> Pcp {
    let mut total = Pcp::default();
    for count in counts {
        total.add(count);
    }
    total
}

/// Columns of the published tables: left and right sticks are combined.
const COLUMNS: [(&str, &[usize]); 6] = [
    ("torso", &[0]),
    ("u.leg", &[1, 2]),
    ("l.leg", &[3, 4]),
    ("u.arm", &[5, 6]),
    ("l.arm", &[7, 8]),
    ("head", &[9]),
];

impl fmt::Display for Report {
    /// Writes a table of percentages, with one line for each rule of PCP and each threshold of PCK.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (n_images, n_missed) = (self.n_images, self.n_missed);
        write!(
            out,
            "{n_images} images, {n_missed} of them without a detection"
        )?;
        write!(out, "\n{:<18}", "PCP, %")?;
        for (name, _) in COLUMNS {
            write!(out, " {name:>8}")?;
        }
        write!(out, " {:>8}", "total")?;
        for (rule, name) in RULES.into_iter().zip(["mean of ends", "both ends"]) {
            write!(out, "\n{name:<18}")?;
            for (_, of_both) in self.limbs(rule) {
                write!(out, " {:>8.1}", of_both.percent())?;
            }
            write!(out, " {:>8.1}", self.pcp(rule).percent())?;
        }
        write!(out, "\n{:<18}", "PCK, %")?;
        for (name, _) in PCK_GROUPS {
            write!(out, " {name:>8}")?;
        }
        write!(out, " {:>8}", "mean")?;
        for (share, of_size) in PCK_SHARES.into_iter().enumerate() {
            write!(out, "\n{:<18}", format!("within {of_size} of size"))?;
            for group in self.groups(share) {
                write!(out, " {:>8.1}", group.percent())?;
            }
            write!(out, " {:>8.1}", self.pck(share).percent())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person() -> [[f64; 2]; 14] {
        std::array::from_fn(|joint| [10.0 * (joint % 4) as f64, 25.0 * (joint / 4) as f64])
    }

    #[test]
    fn missing_detections_count_as_wrong() {
        let truth = person();
        let report = evaluate([(Some(&truth), &truth), (None, &truth)]);
        assert_eq!((report.n_images(), report.n_missed()), (2, 1));
        for rule in RULES {
            assert_eq!(report.pcp(rule).percent(), 50.0);
            assert!(report.sticks(rule).iter().all(|stick| stick.percent() == 50.0));
        }
        for share in 0..2 {
            assert_eq!(report.pck(share).percent(), 50.0);
            assert!(report.groups(share).iter().all(|group| group.percent() == 50.0));
        }
    }

    #[test]
    fn one_wrong_wrist_halves_the_score_of_its_group() {
        let truth = person();
        let mut found = truth;
        found[6][0] += 12.0;
        let report = evaluate([(Some(&found), &truth)]);
        assert_eq!(
            report.groups(0)[3].percent(),
            50.0,
            "12 px of 76 is beyond 0.1"
        );
        assert_eq!(report.groups(1)[3].percent(), 100.0, "but within 0.2");
        assert_eq!(report.pck(0).correct, 13);
        let sticks = report.sticks(PcpRule::BothEnds);
        assert!(sticks.iter().all(|stick| stick.total == 1));
    }

    #[test]
    fn the_table_has_a_row_for_every_rule_and_fraction() {
        let truth = person();
        let expected = "\
1 images, 0 of them without a detection
PCP, %                torso    u.leg    l.leg    u.arm    l.arm     head    total
mean of ends          100.0    100.0    100.0    100.0    100.0    100.0    100.0
both ends             100.0    100.0    100.0    100.0    100.0    100.0    100.0
PCK, %                 head shoulder    elbow    wrist      hip     knee    ankle     mean
within 0.1 of size    100.0    100.0    100.0    100.0    100.0    100.0    100.0    100.0
within 0.2 of size    100.0    100.0    100.0    100.0    100.0    100.0    100.0    100.0";
        assert_eq!(evaluate([(Some(&truth), &truth)]).to_string(), expected);
    }
}
