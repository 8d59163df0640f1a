//! Bone lengths of a person, used to recognise the person later.

use skeleton::body::{BONES, Joints, Kind};

/// Maximum number of bones by which a mean length is weighted.
const MOST_BONES: f64 = 100.0;
/// Minimum number of kinds of bones that two bodies must share to be compared.
pub(crate) const LEAST_KINDS: usize = 6;

/// Mean lengths of a person's bones, in metres; left and right are averaged together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bones {
    /// Mean length of each kind of bone, in the order of `skeleton::body::Kind::ALL`; 0 if no bone of that kind was seen.
    pub mean_m: [f64; Kind::ALL.len()],
    /// Number of bones by which each mean is weighted; left and right count separately.
    pub n: [f64; Kind::ALL.len()],
}

impl Bones {
    /// Adds the bones of one frame.
    pub(crate) fn add(&mut self, joints: &Joints) {
        for (nth, kind) in Kind::ALL.iter().enumerate() {
            let of_kind = BONES.iter().filter(|bone| bone.kind == *kind);
            for length in of_kind.filter_map(|bone| bone.length(joints)) {
                self.n[nth] = (self.n[nth] + 1.0).min(MOST_BONES);
                self.mean_m[nth] += (length - self.mean_m[nth]) / self.n[nth];
            }
        }
    }

    /// Returns the mean absolute difference of the logarithms of the lengths; `None` if too few kinds can be compared.
    pub(crate) fn difference(&self, other: &Self) -> Option<f64> {
        let (mut sum, mut n) = (0.0, 0);
        for nth in 0..Kind::ALL.len() {
            if self.n[nth] > 0.0 && other.n[nth] > 0.0 {
                sum += (self.mean_m[nth] / other.mean_m[nth]).ln().abs();
                n += 1;
            }
        }
        (n >= LEAST_KINDS).then(|| sum / n as f64)
    }
}
