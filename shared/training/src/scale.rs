//! How large a person is: one square box for all parts.

/// Sizes of the part boxes of all people, in pixels of their images.
///
/// The length of every edge of the tree is divided by its usual length, which is counted in lengths
/// of the first edge (neck to head); the side of a person's boxes is the upper quartile of these.
/// So the box has the size that the head would have, though the head may be tilted towards the
/// camera. Source: Yang & Ramanan 2013, their release's `pointtobox`.
///
/// * `people`: centres of the parts of every person, pixels.
/// * `parents`: of every part; `None` for the root.
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
        let of_person = |it: &Vec<[f64; 2]>| (length(it, edge) / length(it, first)).ln();
        let ratios: Vec<_> = people.iter().map(of_person).collect();
        let ratios = ratios.into_iter().filter(|it| it.is_finite()).collect();
        quantile(ratios, 0.5).exp()
    };
    let usual: Vec<_> = edges.iter().map(|it| usual(*it)).collect();
    let side = |person: &Vec<[f64; 2]>| {
        let sides = edges.iter().zip(&usual);
        let sides = sides.map(|(edge, usual)| length(person, *edge) / usual);
        quantile(sides.collect(), 0.75)
    };
    people.iter().map(side).collect()
}

/// The side of the filters, cells, and of the boxes that they come from, pixels: the boxes of all but
/// the smallest twentieth of the people hold it.
pub(crate) fn filter_side(sides: &[f64], cell_px: usize) -> (usize, f64) {
    let side = quantile(sides.to_vec(), 0.05);
    ((side / cell_px as f64).floor() as usize, side)
}

/// The quantile at `share`, linear between neighbours; 0 of nothing.
pub(crate) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = share * values.len().saturating_sub(1) as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    match (values.get(low), values.get(high)) {
        (Some(low), Some(high)) => low + (high - low) * at.fract(),
        _ => 0.0,
    }
}
