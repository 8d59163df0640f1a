//! The text format of the paper authors' released models.

mod error;
mod tokens;

pub use error::{TextError, TextPosition};

use tokens::{Tokens, shortened};

use super::released::{Released, ReleasedPart, SpringIds, filter_from_planes};
use crate::{Filter, Model, ModelSpec, N_CHANNELS, Spring};

/// Reads the authors' text format.
///
/// The format consists of keywords and arrays in a fixed order, separated by white space. An array consists of `rows cols planes`, followed
/// by its values; the row index changes fastest, and the plane index slowest. Indices count from 1. Deformations are `dx^2 dx dy^2 dy`,
/// anchors `x y octave`. The start offsets `*_i` and `obj` are only used in training and are skipped; `len` and `obj` may be absent.
///
/// A tree like that of the published models gets the published part names and mirror permutation. Memory is never reserved just because the
/// text states a count: the memory used is proportional to the size of the text.
///
/// # Errors
///
/// [`TextError`]. The numbers themselves are checked by [`Model::new`].
pub fn parse(text: &str) -> Result<ModelSpec, TextError> {
    let mut it = Tokens::new(text);
    let n_parts = count(&mut it, "partsNbr", 1, Model::MAX_PARTS)?;
    let n_types = count(&mut it, "typesNbr", 1, Model::MAX_TYPES)?;
    let n_biases = count(&mut it, "biasSz", 1, MAX_SPRINGS + 1)?;
    let biases = reals(&mut it, "bias_w", [n_biases, 1, 1])?;
    reals(&mut it, "bias_i", [n_biases, 1, 1])?;
    let n_filters = count(&mut it, "filtersSz", 1, MAX_FILTERS)?;
    let filters = filters(&mut it, n_filters)?;
    reals(&mut it, "filters_i", [n_filters, 1, 1])?;
    let springs = springs(&mut it)?;
    let parts = components(&mut it, n_parts, n_types)?;
    largest_filter(&mut it, &filters)?;
    let interval = count(&mut it, "interval", 1, MAX_SETTING)?;
    let cell_px = count(&mut it, "sbin", 1, MAX_SETTING)?;
    let n_weights = n_biases
        + filters.iter().map(|filter| filter.weights.len()).sum::<usize>()
        + springs.len() * SPRING_WEIGHTS;
    let place = it.place();
    if it.skip("len") {
        let got = it.number("len", INDEX)?;
        agree("len", place, [("len", got, n_weights)])?;
    }
    it.keyword("thresh")?;
    let threshold = it.number("thresh", REAL)?;
    if it.skip("obj") {
        it.number::<f64>("obj", REAL)?;
    }
    if let Some(got) = it.peek() {
        return Err(TextError::Trailing {
            place: it.place(),
            got: shortened(got),
        });
    }
    let released = Released {
        biases,
        filters,
        springs,
        parts,
        interval,
        cell_px,
        threshold,
    };
    Ok(released.into_spec()?)
}

const MAX_FILTERS: usize = Model::MAX_PARTS * Model::MAX_TYPES;
const MAX_SPRINGS: usize = MAX_FILTERS * Model::MAX_TYPES;
/// Maximum value of a setting; [`Model::new`] checks the exact range.
const MAX_SETTING: usize = 1 << 16;
/// Number of weights of a spring, `dx^2 dx dy^2 dy`.
const SPRING_WEIGHTS: usize = 4;
const INDEX: &str = "a whole number of at least 0";
const REAL: &str = "a number";

fn count(
    it: &mut Tokens<'_>,
    field: &'static str,
    min: usize,
    max: usize,
) -> Result<usize, TextError> {
    it.keyword(field)?;
    let place = it.place();
    let got = it.number(field, INDEX)?;
    if (min..=max).contains(&got) {
        Ok(got)
    } else {
        Err(TextError::Limit {
            field,
            place,
            got,
            min,
            max,
        })
    }
}

fn agree<const N: usize>(
    field: &'static str,
    place: TextPosition,
    claims: [(&'static str, usize, usize); N],
) -> Result<(), TextError> {
    match claims.into_iter().find(|(_, got, expected)| got != expected) {
        None => Ok(()),
        Some((what, got, expected)) => Err(TextError::Disagrees {
            field,
            place,
            what,
            got,
            expected,
        }),
    }
}

/// Reads the sizes of an array, which must be `expected`, and its values.
fn array<T: std::str::FromStr>(
    it: &mut Tokens<'_>,
    field: &'static str,
    expected: [usize; 3],
    kind: &'static str,
) -> Result<Vec<T>, TextError> {
    let place = it.place();
    let [rows, cols, planes] = sizes(it, field)?;
    agree(
        field,
        place,
        [
            ("rows", rows, expected[0]),
            ("cols", cols, expected[1]),
            ("planes", planes, expected[2]),
        ],
    )?;
    let n_values = rows * cols * planes;
    let mut values = Vec::with_capacity(n_values.min(it.at_most()));
    for _ in 0..n_values {
        values.push(it.number(field, kind)?);
    }
    Ok(values)
}

fn sizes(it: &mut Tokens<'_>, field: &'static str) -> Result<[usize; 3], TextError> {
    Ok([
        it.number(field, INDEX)?,
        it.number(field, INDEX)?,
        it.number(field, INDEX)?,
    ])
}

fn reals(
    it: &mut Tokens<'_>,
    field: &'static str,
    sizes: [usize; 3],
) -> Result<Vec<f64>, TextError> {
    it.keyword(field)?;
    array(it, field, sizes, REAL)
}

fn ids(
    it: &mut Tokens<'_>,
    field: &'static str,
    sizes: [usize; 3],
) -> Result<Vec<usize>, TextError> {
    it.keyword(field)?;
    array(it, field, sizes, INDEX)
}

fn filters(it: &mut Tokens<'_>, n_filters: usize) -> Result<Vec<Filter>, TextError> {
    const FIELD: &str = "filters_w";
    it.keyword(FIELD)?;
    let mut filters = Vec::with_capacity(n_filters.min(it.at_most()));
    for filter in 0..n_filters {
        let place = it.place();
        if it.peek() == Some("filters_i") {
            agree(FIELD, place, [("number of filters", filter, n_filters)])?;
        }
        let [rows, cols, _] = sizes(&mut it.clone(), FIELD)?;
        for got in [rows, cols] {
            if !(1..=Model::MAX_FILTER).contains(&got) {
                return Err(TextError::Limit {
                    field: FIELD,
                    place,
                    got,
                    min: 1,
                    max: Model::MAX_FILTER,
                });
            }
        }
        let values: Vec<f64> = array(it, FIELD, [rows, cols, N_CHANNELS], REAL)?;
        filters.push(filter_from_planes(rows, cols, &values));
    }
    Ok(filters)
}

fn springs(it: &mut Tokens<'_>) -> Result<Vec<Spring>, TextError> {
    let n_springs = count(it, "defsSz", 0, MAX_SPRINGS)?;
    let weights = reals(it, "defs_w", [n_springs, SPRING_WEIGHTS, 1])?;
    reals(it, "defs_i", [n_springs, 1, 1])?;
    it.keyword("defs_anchor")?;
    let place = it.place();
    let anchors: Vec<i32> = array(it, "defs_anchor", [n_springs, 3, 1], "a whole number")?;
    (0..n_springs)
        .map(|spring| {
            let column = |col: usize| col * n_springs + spring;
            match anchors[column(2)] {
                0 => Ok(Spring {
                    w: [0, 1, 2, 3].map(|col| weights[column(col)]),
                    anchor: [0, 1].map(|col| anchors[column(col)].saturating_sub(1)),
                }),
                got => Err(TextError::OtherLevel {
                    place,
                    spring: spring + 1,
                    got,
                }),
            }
        })
        .collect()
}

fn components(
    it: &mut Tokens<'_>,
    n_parts: usize,
    n_types: usize,
) -> Result<Vec<ReleasedPart>, TextError> {
    count(it, "componentsNbr", 1, 1)?;
    let place = it.place();
    let size = count(it, "componentSz", 0, Model::MAX_PARTS)?;
    agree("componentSz", place, [("parts", size, n_parts)])?;
    let bias_ids = ids(it, "components_biasid", [n_types, n_types, n_parts])?;
    let filter_ids = ids(it, "components_filterid", [n_parts, n_types, 1])?;
    let spring_ids = ids(it, "components_defid", [n_parts, n_types, 1])?;
    let parents = ids(it, "components_parent", [n_parts, 1, 1])?;
    let place = it.place();
    let parents_again = ids(it, "pa", [1, n_parts, 1])?;
    for (&got, &expected) in parents_again.iter().zip(&parents) {
        agree("pa", place, [("a parent", got, expected)])?;
    }
    let of_types = |part: usize, all: &[usize]| -> Vec<usize> {
        (0..n_types).map(|own| all[own * n_parts + part]).collect()
    };
    let pairs = |part: usize| -> Vec<Vec<usize>> {
        (0..n_types)
            .map(|parent| {
                let of_child = |child: usize| bias_ids[(part * n_types + child) * n_types + parent];
                (0..n_types).map(of_child).collect()
            })
            .collect()
    };
    Ok((0..n_parts)
        .map(|part| ReleasedPart {
            parent: parents[part],
            filter_ids: of_types(part, &filter_ids),
            bias_ids: pairs(part),
            spring_ids: SpringIds::PerChildType(of_types(part, &spring_ids)),
        })
        .collect())
}

/// Reads `maxsize`, which must equal the largest height and width of the filters.
fn largest_filter(it: &mut Tokens<'_>, filters: &[Filter]) -> Result<(), TextError> {
    let place = it.place();
    let maxsize = ids(it, "maxsize", [1, 2, 1])?;
    let rows = filters.iter().map(|filter| filter.rows).max().unwrap_or(0);
    let cols = filters.iter().map(|filter| filter.cols).max().unwrap_or(0);
    agree(
        "maxsize",
        place,
        [("rows", maxsize[0], rows), ("cols", maxsize[1], cols)],
    )
}

#[cfg(test)]
mod tests;
