//! Bone lengths as fractions of the stature, and their spread among people.

/// Standard deviation of the measured length of a bone from its true length, in metres.
///
/// The value is our own choice. The pipeline's joints have errors of 5 to 15 cm, but these are mostly common to neighbouring joints, and
/// mostly perpendicular to the bone.
pub const MEASUREMENT_SD: f64 = 0.05;

/// The statures to which [`Proportion::child`] and [`Proportion::adult`] apply, in metres. Between the two, the fractions change linearly
/// with the stature; outside, they are constant.
///
/// 0.95 m is about the median at three years (WHO Child Growth Standards 2006: girls 95.1 cm, boys 96.1 cm). 1.65 m is between the mean
/// statures of women (1.629 m) and men (1.756 m) in ANSUR II; it is our choice for the end of growth.
pub const CHILD_AND_ADULT: [f64; 2] = [0.95, 1.65];

/// Kind of a bone; left and right bones have the same kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Shoulder to elbow.
    UpperArm,
    /// Elbow to wrist.
    LowerArm,
    /// Hip to knee.
    UpperLeg,
    /// Knee to ankle.
    LowerLeg,
    /// Midpoint of the hips to the base of the neck.
    Trunk,
    /// Shoulder to shoulder.
    ShoulderWidth,
    /// Hip to hip.
    HipWidth,
    /// Shoulder to the base of the neck.
    ShoulderToNeck,
    /// Base of the neck to the top of the head.
    Head,
}

/// The length of a kind of bone, as a fraction of the stature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proportion {
    /// Mean fraction in adults.
    pub adult: f64,
    /// Mean fraction in a three-year-old child.
    pub child: f64,
    /// Standard deviation among people, as a fraction of the length.
    pub people: f64,
    /// Standard deviation due to differences between detectors and data sets in the positions of joints, as a fraction of the length.
    pub place: f64,
    /// Standard deviation due to the posture, as a fraction of the length.
    pub posture: f64,
}

impl Proportion {
    /// Returns the standard deviation of the length from the length expected for the stature, as a fraction of the length. It combines the
    /// effects of differences between people, joint positions and postures.
    pub fn spread(&self) -> f64 {
        self.variance().sqrt()
    }

    /// Returns the square of [`spread`](Self::spread).
    pub(crate) fn variance(&self) -> f64 {
        self.people * self.people + self.place * self.place + self.posture * self.posture
    }

    /// Returns the length at a stature, in metres.
    pub fn length(&self, stature: f64) -> f64 {
        let [child, adult] = CHILD_AND_ADULT;
        let share = self.child + self.slope() * (stature.clamp(child, adult) - child);
        share * stature
    }

    /// Returns the derivative of [`length`](Self::length) with respect to the stature.
    pub(crate) fn length_by_stature(&self, stature: f64) -> f64 {
        let [child, adult] = CHILD_AND_ADULT;
        if stature < child {
            self.child
        } else if stature > adult {
            self.adult
        } else {
            self.child + self.slope() * (2.0 * stature - child)
        }
    }

    /// Returns the stature at which a bone has this length, in metres: the inverse of [`length`](Self::length).
    pub fn stature(&self, length: f64) -> f64 {
        let [child, adult] = CHILD_AND_ADULT;
        if length <= self.child * child {
            return length / self.child;
        }
        if length >= self.adult * adult {
            return length / self.adult;
        }
        // slope s^2 + b s = length
        let slope = self.slope();
        let b = self.child - slope * child;
        2.0 * length / (b + (b * b + 4.0 * slope * length).sqrt())
    }

    fn slope(&self) -> f64 {
        let [child, adult] = CHILD_AND_ADULT;
        (self.adult - self.child) / (adult - child)
    }
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::UpperArm,
        Self::LowerArm,
        Self::UpperLeg,
        Self::LowerLeg,
        Self::Trunk,
        Self::ShoulderWidth,
        Self::HipWidth,
        Self::ShoulderToNeck,
        Self::Head,
    ];

    /// Returns the index of the kind in [`ALL`](Self::ALL).
    pub(crate) const fn index(self) -> usize {
        self as usize
    }

    /// Returns the length of this kind of bone as a fraction of the stature.
    ///
    /// The sources have these short names:
    ///
    /// * *D&C*: Drillis & Contini (1966), Body segment parameters, as in figure 4.1 of Winter, *Biomechanics and Motor Control of Human
    ///   Movement*: lengths between joints.
    /// * *ANSUR II*: Gordon et al. (2014), 2012 Anthropometric Survey of U.S. Army Personnel, Natick/TR-15/007: lengths between landmarks
    ///   on the skin, of 4082 men and 1986 women. `people` is the standard deviation of the fraction divided by its mean, over the
    ///   individuals in its public data: upper arm 0.1909 ± 0.0062, forearm 0.1511 ± 0.0067, thigh 0.2476 ± 0.0113, shank 0.2267 ± 0.0088,
    ///   trunk 0.3052 ± 0.0154, biacromial breadth 0.2328 ± 0.0114, hip breadth 0.2036 ± 0.0167. There is no value for the head; the spread
    ///   of the trunk is used.
    ///
    /// | kind | adult |
    /// |---|---|
    /// | upper and lower arm, upper and lower leg | D&C: 0.186, 0.146, 0.245, 0.246 |
    /// | trunk | D&C: shoulders at 0.818 of the stature, hips at 0.530; the base of the neck is 0.012 higher than the shoulders (our choice) |
    /// | head | what remains of the stature above the trunk: 0.170 |
    /// | shoulder width | ANSUR II: 0.2328, less 0.01 on either side to the centre of the joint (our choice) |
    /// | hip width | 72 % of the distance between the iliac spines (Bell, Pedersen & Brand 1990), which is about 24 cm: 0.100 |
    /// | shoulder to neck | half the shoulder width, with the neck 0.02 higher: 0.110 |
    ///
    /// The fractions for children are our own. From the ankle (0.045 above the floor) to the top of the head, they add up to 1. The head is
    /// about a fifth of the stature, whereas in adults it is 0.13 (D&C) plus a neck. The sitting height is about 0.57 of the stature at
    /// three years and 0.52 for adults (Fredriks et al. 2005), so the legs are shorter by a ninth than in adults. The arms are shorter by a
    /// twentieth.
    ///
    /// `place` and `posture` are our own. Data sets differ most in which points they call hips, neck and top of the head. Backs bend, heads
    /// nod and shoulders shrug, whereas limbs keep their lengths except for the skin under markers.
    pub const fn proportion(self) -> Proportion {
        let [adult, child, people, place, posture] = match self {
            Self::UpperArm => [0.186, 0.178, 0.032, 0.045, 0.02],
            Self::LowerArm => [0.146, 0.140, 0.044, 0.045, 0.02],
            Self::UpperLeg => [0.245, 0.220, 0.046, 0.045, 0.02],
            Self::LowerLeg => [0.246, 0.215, 0.039, 0.045, 0.02],
            Self::Trunk => [0.300, 0.300, 0.050, 0.06, 0.06],
            Self::ShoulderWidth => [0.213, 0.215, 0.049, 0.10, 0.07],
            Self::HipWidth => [0.100, 0.100, 0.082, 0.25, 0.05],
            Self::ShoulderToNeck => [0.110, 0.112, 0.049, 0.14, 0.12],
            Self::Head => [0.170, 0.220, 0.050, 0.09, 0.08],
        };
        Proportion {
            adult,
            child,
            people,
            place,
            posture,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kinds_are_numbered_in_their_order() {
        for (i, kind) in Kind::ALL.into_iter().enumerate() {
            assert_eq!(kind.index(), i);
        }
    }

    #[test]
    fn bone_lengths_add_up_to_the_stature() {
        let of = |kind: Kind| kind.proportion();
        let parts = [Kind::LowerLeg, Kind::UpperLeg, Kind::Trunk, Kind::Head].map(of);
        let adult: f64 = parts.iter().map(|part| part.adult).sum();
        let child: f64 = parts.iter().map(|part| part.child).sum();
        assert!((adult + 0.039 - 1.0).abs() < 1e-9, "{adult}");
        assert!((child + 0.045 - 1.0).abs() < 1e-9, "{child}");
    }

    #[test]
    fn the_stature_of_a_length_is_the_inverse_of_the_length_at_a_stature() {
        for kind in Kind::ALL {
            let it = kind.proportion();
            for tenth in 3..30 {
                let stature = f64::from(tenth) / 10.0;
                let back = it.stature(it.length(stature));
                assert!((back - stature).abs() < 1e-9, "{kind:?} {stature} {back}");
            }
        }
    }

    #[test]
    fn lengths_grow_with_the_stature_as_their_derivative_says() {
        for kind in Kind::ALL {
            let it = kind.proportion();
            for stature in [0.5, 0.96, 1.2, 1.64, 1.8] {
                let step = 1e-6;
                let numeric =
                    (it.length(stature + step) - it.length(stature - step)) / (2.0 * step);
                let by_stature = it.length_by_stature(stature);
                assert!(
                    numeric > 0.0 && (numeric - by_stature).abs() < 1e-6,
                    "{kind:?} {stature}"
                );
            }
        }
    }
}
