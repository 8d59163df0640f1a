//! Averages the poses of a view's pairs.

/// The pose of one view after fusion.
#[derive(Debug, Clone, PartialEq)]
pub struct FusedPose {
    /// Centre of every part, named by the person's left and right, in pixels of the frame.
    pub centres_px: Vec<[f64; 2]>,
    /// Number of pairs that were averaged; 0 if this is the view's own pose.
    pub n_pairs: usize,
    /// Sum of the energies of the averaged pairs.
    pub energy: f64,
}

/// Returns the mean of a view's candidates over its pairs (the paper's section 7: "simply averaged").
///
/// * `candidates`: one pose per pair, as its energy and its anatomical part centres.
/// * Returns `None` if there is no candidate.
///
/// # Panics
///
/// If two candidates differ in their number of parts.
pub fn average(candidates: &[(f64, &[[f64; 2]])]) -> Option<FusedPose> {
    let n_parts = candidates.first()?.1.len();
    let mut sum = vec![[0.0; 2]; n_parts];
    for (_, centres) in candidates {
        assert_eq!(centres.len(), n_parts, "all pairs must have the same model");
        for (sum, centre) in sum.iter_mut().zip(*centres) {
            sum[0] += centre[0];
            sum[1] += centre[1];
        }
    }
    let n = candidates.len() as f64;
    Some(FusedPose {
        centres_px: sum.iter().map(|centre| centre.map(|sum| sum / n)).collect(),
        n_pairs: candidates.len(),
        energy: candidates.iter().map(|candidate| candidate.0).sum(),
    })
}

/// Renames the parts of a view that sees the person from behind: from left and right of the image to the person's left and right.
pub fn anatomical(centres: &[[f64; 2]], mirror: Option<&[usize]>) -> Vec<[f64; 2]> {
    match mirror {
        Some(mirror) => mirror.iter().map(|&part| centres[part]).collect(),
        None => centres.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_averaged_per_part() {
        let (first, second) = ([[0.0, 0.0], [4.0, 2.0]], [[2.0, 4.0], [6.0, 2.0]]);
        let got = average(&[(1.0, &first), (0.5, &second)]).expect("two candidates");
        assert_eq!(got.centres_px, [[1.0, 2.0], [5.0, 2.0]]);
        assert_eq!((got.n_pairs, got.energy), (2, 1.5));
    }

    #[test]
    fn the_parts_of_a_swapped_view_are_renamed() {
        let centres = [[0.0; 2], [1.0; 2], [2.0; 2]];
        let got = anatomical(&centres, Some(&[0, 2, 1]));
        assert_eq!(got, [[0.0; 2], [2.0; 2], [1.0; 2]]);
    }

    #[test]
    fn without_candidates_there_is_no_pose() {
        assert_eq!(average(&[]), None);
    }
}
