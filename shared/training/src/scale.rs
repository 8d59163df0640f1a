//! The size of a person: the side of one square box for all parts.

use statistics::Sorted;

/// Sizes of the part boxes of all people, in pixels of their images.
///
/// The length of every edge of the tree is divided by the typical ratio of its length to the length of the first edge (neck to head). The
/// side of a person's boxes is the upper quartile of the results. The box thus has the size that the head would have even if the head is
/// tilted towards the camera. Source: the function `pointtobox` in the release of Yang & Ramanan 2013.
///
/// * `people`: centres of the parts of every person, in pixels.
/// * `parents`: parent of every part; `None` for the root.
pub(crate) fn box_sides(people: &[Vec<[f64; 2]>], parents: &[Option<usize>]) -> Vec<f64> {
    let edges: Vec<_> = parents
        .iter()
        .enumerate()
        .filter_map(|(part, parent)| Some((part, (*parent)?)))
        .collect();
    let length = |person: &[[f64; 2]], (part, parent): (usize, usize)| {
        let ([x1, y1], [x2, y2]) = (person[part], person[parent]);
        (x1 - x2).hypot(y1 - y2)
    };
    let Some(&first) = edges.first() else {
        return vec![0.0; people.len()];
    };
    let usual = |edge: (usize, usize)| {
        let of_person =
            |person: &Vec<[f64; 2]>| (length(person, edge) / length(person, first)).ln();
        let ratios: Vec<_> = people.iter().map(of_person).collect();
        let ratios = ratios.into_iter().filter(|ratio| ratio.is_finite()).collect();
        quantile(ratios, 0.5).exp()
    };
    let usual: Vec<_> = edges.iter().map(|edge| usual(*edge)).collect();
    let side = |person: &Vec<[f64; 2]>| {
        let sides = edges.iter().zip(&usual);
        let sides = sides.map(|(edge, usual)| length(person, *edge) / usual);
        quantile(sides.collect(), 0.75)
    };
    people.iter().map(side).collect()
}

/// The side of the filters in cells, and the side in pixels from which it was computed: the fifth percentile of the
/// box sizes.
pub(crate) fn filter_side(sides: &[f64], cell_px: usize) -> (usize, f64) {
    let side = quantile(sides.to_vec(), 0.05);
    ((side / cell_px as f64).floor() as usize, side)
}

/// The quantile at `share`, interpolated linearly between neighbours; 0 for an empty list.
pub(crate) fn quantile(values: Vec<f64>, share: f64) -> f64 {
    Sorted::new(values).interpolated(share).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parents of the head, the neck, and the two parts of an arm.
    const PARENTS: [Option<usize>; 4] = [None, Some(0), Some(1), Some(2)];

    fn person(scale: f64) -> Vec<[f64; 2]> {
        [[0.0, 0.0], [0.0, 20.0], [15.0, 30.0], [30.0, 55.0]]
            .iter()
            .map(|part| part.map(|value| 7.0 + scale * value))
            .collect()
    }

    #[test]
    fn the_box_scales_with_the_person() {
        let people = [person(1.0), person(1.5), person(3.0)];
        let sides = box_sides(&people, &PARENTS);
        assert!(
            (sides[0] - 20.0).abs() < 1e-9,
            "the length of the head: {sides:?}"
        );
        assert!((sides[1] - 30.0).abs() < 1e-9 && (sides[2] - 60.0).abs() < 1e-9);
    }

    #[test]
    fn a_head_seen_from_above_does_not_make_a_person_small() {
        let mut people = vec![person(1.0); 9];
        people[4][0] = [7.0, 26.0];
        let sides = box_sides(&people, &PARENTS);
        assert!(sides[4] > 15.0, "{sides:?}");
    }

    #[test]
    fn empty_sets_and_people_at_a_single_point_have_no_size() {
        assert!(box_sides(&[], &PARENTS).is_empty());
        let side = box_sides(&[vec![[3.0, 3.0]; 4]], &PARENTS)[0];
        assert_eq!(side, 0.0);
    }

    #[test]
    fn the_filter_fits_all_but_the_smallest_twentieth() {
        let mut sides = vec![23.0; 96];
        sides.extend([9.0; 4]);
        assert_eq!(filter_side(&sides, 4), (5, 23.0));
        assert_eq!(quantile(vec![1.0, 2.0, 4.0], 0.75), 3.0);
    }
}
