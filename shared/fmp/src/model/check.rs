//! Checks of a model before it is used.

use super::{Edge, Filter, Model, ModelError, ModelSpec, PartSpec, Spring, Springs};
use crate::N_CHANNELS;

/// Checks all properties of a model that the rest of the crate relies on.
pub(super) fn check(spec: &ModelSpec) -> Result<(), ModelError> {
    if spec.parts.is_empty() {
        return Err(ModelError::NoParts);
    }
    let model = || "the model".to_owned();
    limit(
        "number of parts",
        model,
        spec.parts.len(),
        1,
        Model::MAX_PARTS,
    )?;
    limit(
        "number of filters",
        model,
        spec.filters.len(),
        1,
        MAX_FILTERS,
    )?;
    limit("interval", model, spec.interval, 1, 64)?;
    limit("cell size", model, spec.cell_px, 2, 64)?;
    number("root bias", model, spec.root_bias)?;
    number("threshold", model, spec.threshold)?;
    for (part_idx, part) in spec.parts.iter().enumerate() {
        check_part(spec, part_idx, part)?;
    }
    for (filter_idx, filter) in spec.filters.iter().enumerate() {
        check_filter(|| format!("filter {}", filter_idx + 1), filter)?;
    }
    spec.mirror.as_ref().map_or(Ok(()), |mirror| check_mirror(&spec.parts, mirror))
}

const MAX_FILTERS: usize = Model::MAX_PARTS * Model::MAX_TYPES;
/// Maximum number in a model; sums of larger numbers could overflow in single precision.
const MAX_NUMBER: f64 = 1e9;
/// Minimum stiffness of a spring; with weaker springs, the intersections of parabolas could overflow.
const MIN_STIFFNESS: f64 = 1e-9;
const MAX_ANCHOR: i32 = 1000;

fn check_part(spec: &ModelSpec, part_idx: usize, part: &PartSpec) -> Result<(), ModelError> {
    let whose = || format!("part {}", part_idx + 1);
    let n_types = part.filter_of_type.len();
    limit("number of types", whose, n_types, 1, Model::MAX_TYPES)?;
    for &filter in &part.filter_of_type {
        present(part_idx, "filter", filter, spec.filters.len())?;
    }
    match &part.edge {
        None if part_idx == 0 => Ok(()),
        Some(edge) if part_idx > 0 => {
            present(part_idx, "part", edge.parent, spec.parts.len())?;
            if edge.parent >= part_idx {
                return Err(ModelError::Tree {
                    part: part_idx + 1,
                    parent: edge.parent + 1,
                });
            }
            let n_parent = spec.parts[edge.parent].filter_of_type.len();
            check_edge(part_idx, edge, [n_parent, n_types])
        }
        _ => Err(ModelError::Root { part: part_idx + 1 }),
    }
}

/// Checks the biases and the springs of an edge; `n_types` is `[parent's, child's]`.
fn check_edge(part_idx: usize, edge: &Edge, n_types: [usize; 2]) -> Result<(), ModelError> {
    let whose = || format!("part {}", part_idx + 1);
    let [n_parent, n_own] = n_types;
    size("bias", whose, edge.bias.len(), n_parent)?;
    for (parent_type, row) in edge.bias.iter().enumerate() {
        size(
            "bias",
            || of_parent_type(part_idx, parent_type),
            row.len(),
            n_own,
        )?;
        for &bias in row.iter().filter(|&&it| it != f64::NEG_INFINITY) {
            number("bias", whose, bias)?;
        }
        if row.iter().all(|&entry| entry == f64::NEG_INFINITY) {
            return Err(ModelError::DeadEnd {
                part: part_idx + 1,
                parent_type: parent_type + 1,
            });
        }
    }
    match &edge.springs {
        Springs::PerChildType(springs) => {
            size("springs", whose, springs.len(), n_own)?;
            springs.iter().try_for_each(|spring| check_spring(whose, spring))
        }
        Springs::PerTypePair(springs) => {
            size("springs", whose, springs.len(), n_parent)?;
            for (parent_type, (row, biases)) in springs.iter().zip(&edge.bias).enumerate() {
                size(
                    "springs",
                    || of_parent_type(part_idx, parent_type),
                    row.len(),
                    n_own,
                )?;
                for (own_type, (spring, &bias)) in row.iter().zip(biases).enumerate() {
                    match spring {
                        Some(spring) => check_spring(whose, spring)?,
                        None if bias == f64::NEG_INFINITY => {}
                        None => {
                            return Err(ModelError::NoSpring {
                                part: part_idx + 1,
                                parent_type: parent_type + 1,
                                own_type: own_type + 1,
                            });
                        }
                    }
                }
            }
            Ok(())
        }
    }
}

fn check_spring(whose: impl Fn() -> String + Copy, spring: &Spring) -> Result<(), ModelError> {
    let [xx, x, yy, y] = spring.w;
    for stiffness in [xx, yy] {
        if !(MIN_STIFFNESS..=MAX_NUMBER).contains(&stiffness) {
            return Err(ModelError::Value {
                what: "stiffness of a spring",
                whose: whose(),
                value: stiffness,
                expected: "1e-9 to 1e9",
            });
        }
    }
    for slope in [x, y] {
        number("slope of a spring", whose, slope)?;
    }
    for anchor in spring.anchor {
        if !(-MAX_ANCHOR..=MAX_ANCHOR).contains(&anchor) {
            return Err(ModelError::Value {
                what: "anchor of a spring",
                whose: whose(),
                value: f64::from(anchor),
                expected: "-1000 to 1000 cells",
            });
        }
    }
    Ok(())
}

fn check_filter(whose: impl Fn() -> String + Copy, filter: &Filter) -> Result<(), ModelError> {
    limit("height", whose, filter.rows, 1, Model::MAX_FILTER)?;
    limit("width", whose, filter.cols, 1, Model::MAX_FILTER)?;
    let n_weights = filter.rows * filter.cols * N_CHANNELS;
    size("weights", whose, filter.weights.len(), n_weights)?;
    filter.weights.iter().try_for_each(|&weight| number("weight", whose, weight))
}

/// Checks that `mirror` swaps parts in pairs and preserves the tree.
fn check_mirror(parts: &[PartSpec], mirror: &[usize]) -> Result<(), ModelError> {
    size(
        "mirror",
        || "the model".to_owned(),
        mirror.len(),
        parts.len(),
    )?;
    for (part_idx, &other) in mirror.iter().enumerate() {
        present(part_idx, "as its mirror part", other, parts.len())?;
    }
    let parent_of = |i: usize| parts[i].edge.as_ref().map(|edge| edge.parent);
    for (part_idx, &other) in mirror.iter().enumerate() {
        let mirrored_parent = parent_of(part_idx).map(|i| mirror[i]);
        if mirror[other] != part_idx || parent_of(other) != mirrored_parent {
            return Err(ModelError::Mirror {
                part: part_idx + 1,
                other: other + 1,
            });
        }
    }
    Ok(())
}

fn limit(
    what: &'static str,
    whose: impl Fn() -> String,
    got: usize,
    min: usize,
    max: usize,
) -> Result<(), ModelError> {
    if (min..=max).contains(&got) {
        return Ok(());
    }
    Err(ModelError::Limit {
        what,
        whose: whose(),
        got,
        min,
        max,
    })
}

fn size(
    what: &'static str,
    whose: impl Fn() -> String,
    got: usize,
    expected: usize,
) -> Result<(), ModelError> {
    if got == expected {
        return Ok(());
    }
    Err(ModelError::Size {
        what,
        whose: whose(),
        got,
        expected,
    })
}

fn number(what: &'static str, whose: impl Fn() -> String, value: f64) -> Result<(), ModelError> {
    if value.abs() <= MAX_NUMBER {
        return Ok(());
    }
    Err(ModelError::Value {
        what,
        whose: whose(),
        value,
        expected: "-1e9 to 1e9",
    })
}

fn present(part: usize, what: &'static str, index: usize, count: usize) -> Result<(), ModelError> {
    if index < count {
        return Ok(());
    }
    Err(ModelError::Missing {
        part: part + 1,
        what,
        index: index.saturating_add(1),
        count,
    })
}

fn of_parent_type(part_idx: usize, parent_type: usize) -> String {
    format!("part {}, parent type {},", part_idx + 1, parent_type + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::planted;

    /// One change to a valid model.
    type Change = fn(&mut ModelSpec);
    /// Sets one number of a valid model.
    type ChangeTo = fn(&mut ModelSpec, f64);

    /// Makes one change to a valid model and returns the error.
    fn outcome(change: impl FnOnce(&mut ModelSpec)) -> String {
        let mut spec = planted::three_parts();
        change(&mut spec);
        match Model::new(spec) {
            Ok(_) => "fine".to_owned(),
            Err(error) => error.to_string(),
        }
    }

    fn edge(spec: &mut ModelSpec, part: usize) -> &mut Edge {
        spec.parts[part].edge.as_mut().unwrap()
    }

    fn spring(spec: &mut ModelSpec) -> &mut Spring {
        match &mut edge(spec, 1).springs {
            Springs::PerChildType(springs) => &mut springs[0],
            Springs::PerTypePair(springs) => springs[0][0].as_mut().unwrap(),
        }
    }

    #[test]
    fn the_planted_models_are_accepted() {
        assert_eq!(outcome(|_| ()), "fine");
        Model::new(planted::per_pair()).unwrap();
    }

    #[test]
    fn refuses_a_model_without_parts() {
        assert_eq!(
            outcome(|model| model.parts.clear()),
            "the model has no parts"
        );
    }

    #[test]
    fn refuses_counts_beyond_the_limits() {
        let cases: [(&str, Change); 10] = [
            (
                "number of parts of the model is 65, expected 1 to 64",
                |model| {
                    model.parts = vec![model.parts[0].clone(); 65];
                },
            ),
            (
                "number of filters of the model is 0, expected 1 to 2048",
                |model| model.filters.clear(),
            ),
            (
                "number of types of part 2 is 0, expected 1 to 32",
                |model| {
                    model.parts[1].filter_of_type.clear();
                },
            ),
            (
                "number of types of part 2 is 33, expected 1 to 32",
                |model| {
                    model.parts[1].filter_of_type = vec![0; 33];
                },
            ),
            ("interval of the model is 0, expected 1 to 64", |model| {
                model.interval = 0;
            }),
            ("interval of the model is 65, expected 1 to 64", |model| {
                model.interval = 65;
            }),
            ("cell size of the model is 1, expected 2 to 64", |model| {
                model.cell_px = 1;
            }),
            ("cell size of the model is 65, expected 2 to 64", |model| {
                model.cell_px = 65;
            }),
            ("height of filter 3 is 17, expected 1 to 16", |model| {
                model.filters[2].rows = 17;
            }),
            ("width of filter 3 is 0, expected 1 to 16", |model| {
                model.filters[2].cols = 0;
            }),
        ];
        for (expected, change) in cases {
            assert_eq!(outcome(change), expected);
        }
    }

    #[test]
    fn only_part_1_is_the_root() {
        assert_eq!(
            outcome(|model| model.parts[0].edge = model.parts[1].edge.clone()),
            "part 1 has a parent: part 1 and only part 1 is the root"
        );
        assert_eq!(
            outcome(|model| model.parts[2].edge = None),
            "part 3 has no parent: part 1 and only part 1 is the root"
        );
    }

    #[test]
    fn a_cycle_is_rejected() {
        let refused = "part 2 names part 3 as its parent: the tree has a cycle or is out of order";
        assert_eq!(outcome(|model| edge(model, 1).parent = 2), refused);
        let refused = "part 3 names part 3 as its parent: the tree has a cycle or is out of order";
        assert_eq!(outcome(|model| edge(model, 2).parent = 2), refused);
    }

    #[test]
    fn rejects_indices_out_of_range() {
        assert_eq!(
            outcome(|model| model.parts[1].filter_of_type[1] = 6),
            "part 2 names filter 7, but the model has only 6"
        );
        assert_eq!(
            outcome(|model| edge(model, 1).parent = 3),
            "part 2 names part 4, but the model has only 3"
        );
        assert_eq!(
            outcome(|model| model.mirror = Some(vec![0, 1, usize::MAX])),
            format!(
                "part 3 names as its mirror part {}, but the model has only 3",
                usize::MAX
            )
        );
    }

    #[test]
    fn refuses_arrays_of_another_size() {
        let cases: [(&str, Change); 6] = [
            ("bias of part 2 has 1 entries, expected 2", |model| {
                edge(model, 1).bias.pop();
            }),
            (
                "bias of part 2, parent type 2, has 1 entries, expected 2",
                |model| {
                    edge(model, 1).bias[1].pop();
                },
            ),
            ("springs of part 2 has 0 entries, expected 2", |model| {
                edge(model, 1).springs = Springs::PerChildType(vec![]);
            }),
            ("springs of part 2 has 1 entries, expected 2", |model| {
                edge(model, 1).springs = Springs::PerTypePair(vec![vec![None; 2]]);
            }),
            (
                "weights of filter 1 has 127 entries, expected 128",
                |model| {
                    model.filters[0].weights.pop();
                },
            ),
            ("mirror of the model has 2 entries, expected 3", |model| {
                model.mirror = Some(vec![0, 1]);
            }),
        ];
        for (expected, change) in cases {
            assert_eq!(outcome(change), expected);
        }
    }

    #[test]
    fn refuses_numbers_that_are_not_finite_or_overflow_single_precision() {
        for bad in [f64::NAN, f64::INFINITY, -2e9] {
            let changes: [(&str, ChangeTo); 5] = [
                ("root bias of the model", |it, bad| it.root_bias = bad),
                ("threshold of the model", |it, bad| it.threshold = bad),
                ("weight of filter 2", |it, bad| {
                    it.filters[1].weights[9] = bad;
                }),
                ("bias of part 3", |it, bad| edge(it, 2).bias[1][0] = bad),
                ("slope of a spring of part 2", |it, bad| {
                    spring(it).w[3] = bad;
                }),
            ];
            for (what, change) in changes {
                let expected = format!("{what} is {bad}, expected -1e9 to 1e9");
                assert_eq!(outcome(|model| change(model, bad)), expected);
            }
        }
    }

    #[test]
    fn spring_stiffness_must_be_positive() {
        for bad in [0.0, -0.01, f64::NAN, f64::INFINITY, 1e-300] {
            for axis in [0, 2] {
                assert_eq!(
                    outcome(|model| spring(model).w[axis] = bad),
                    format!("stiffness of a spring of part 2 is {bad}, expected 1e-9 to 1e9")
                );
            }
        }
        assert_eq!(
            outcome(|model| spring(model).anchor[1] = -1001),
            "anchor of a spring of part 2 is -1001, expected -1000 to 1000 cells"
        );
    }

    #[test]
    fn every_type_of_the_parent_is_compatible_with_some_type_of_the_child() {
        let never = f64::NEG_INFINITY;
        assert_eq!(
            outcome(|model| edge(model, 1).bias[1] = vec![never, 0.5]),
            "fine"
        );
        assert_eq!(
            outcome(|model| edge(model, 1).bias[1] = vec![never, never]),
            "no type of part 2 is compatible with type 2 of its parent"
        );
    }

    #[test]
    fn a_pair_of_types_that_occurs_has_a_spring() {
        let mut spec = planted::per_pair();
        edge(&mut spec, 1).bias[0][1] = 0.0;
        let said = Model::new(spec).unwrap_err().to_string();
        let expected = "part 2 has a bias but no spring for type 1 of its parent and its type 2";
        assert_eq!(said, expected);
    }

    #[test]
    fn the_mirror_swaps_parts_in_pairs_and_keeps_the_tree() {
        assert_eq!(
            outcome(|model| model.mirror = Some(vec![1, 2, 0])),
            "part 1 mirrors part 2, but part 2 does not mirror it, or their parents do not mirror each other"
        );
        assert_eq!(
            outcome(|model| model.mirror = Some(vec![2, 1, 0])),
            "part 1 mirrors part 3, but part 3 does not mirror it, or their parents do not mirror each other"
        );
        assert_eq!(outcome(|model| model.mirror = Some(vec![0, 1, 2])), "fine");
        // Three arms in a cycle: the tree is preserved, but parts are not swapped in pairs.
        let ring = outcome(|model| {
            model.parts.push(model.parts[2].clone());
            model.mirror = Some(vec![0, 2, 3, 1]);
        });
        let expected = "part 2 mirrors part 3, but part 3 does not mirror it, or their parents do not mirror each other";
        assert_eq!(ring, expected);
    }
}
