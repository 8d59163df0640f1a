//! Common code for the formats of the released models, which refer to everything by 1-based indices.

use skeleton::{MIRROR, N_PARTS, PARENT, PART_NAMES};

use crate::{Edge, Filter, ModelError, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};

/// A released model as stored in the file, before any check.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Released {
    /// All biases; [`ReleasedPart::bias_ids`] assigns them to parts.
    pub(super) biases: Vec<f64>,
    /// All filters.
    pub(super) filters: Vec<Filter>,
    /// All springs.
    pub(super) springs: Vec<Spring>,
    /// The parts, in the file's order.
    pub(super) parts: Vec<ReleasedPart>,
    /// Levels per octave.
    pub(super) interval: usize,
    /// Side of a cell, in pixels.
    pub(super) cell_px: usize,
    /// Minimum score of the positive examples, as set by training.
    pub(super) threshold: f64,
}

/// One part, which refers to its filters, biases and springs by 1-based indices.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReleasedPart {
    /// The parent; 0 for the root.
    pub(super) parent: usize,
    /// One filter per type.
    pub(super) filter_ids: Vec<usize>,
    /// Biases as `[parent type][child type]`, 0 if the pair never occurs; the root uses `[0][0]` only.
    pub(super) bias_ids: Vec<Vec<usize>>,
    /// The springs; ignored for the root.
    pub(super) spring_ids: SpringIds,
}

/// The springs between a part and its parent.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum SpringIds {
    /// One per type of the child.
    PerChildType(Vec<usize>),
    /// One per pair, `[parent type][child type]`, 0 if the pair never occurs.
    PerTypePair(Vec<Vec<usize>>),
}

impl Released {
    /// Replaces every index with the item that it refers to.
    ///
    /// A tree of 26 parts with the published models' parents gets their part names and their mirror
    /// permutation; any other tree gets `part 1`, `part 2`, ... and no mirror.
    pub(super) fn into_spec(self) -> Result<ModelSpec, ModelError> {
        let names_known = self.parts.len() == N_PARTS
            && self
                .parts
                .iter()
                .zip(PARENT)
                .all(|(part, parent)| part.parent == parent.map_or(0, |parent| parent + 1));
        let mut parts = Vec::with_capacity(self.parts.len());
        for (part_idx, part) in self.parts.iter().enumerate() {
            let filter_of_type = part
                .filter_ids
                .iter()
                .map(|&id| index(part_idx, "filter", id, self.filters.len()))
                .collect::<Result<_, _>>()?;
            let edge = match part.parent {
                0 => None,
                parent => Some(self.edge(part_idx, parent - 1)?),
            };
            parts.push(PartSpec {
                name: if names_known {
                    PART_NAMES[part_idx].to_owned()
                } else {
                    format!("part {}", part_idx + 1)
                },
                filter_of_type,
                edge,
            });
        }
        Ok(ModelSpec {
            name: "unnamed".to_owned(),
            parts,
            root_bias: self.root_bias()?,
            interval: self.interval,
            cell_px: self.cell_px,
            threshold: self.threshold,
            mirror: names_known.then(|| MIRROR.to_vec()),
            filters: self.filters,
        })
    }

    fn root_bias(&self) -> Result<f64, ModelError> {
        let root = self.parts.first().ok_or(ModelError::NoParts)?;
        let id = root.bias_ids.first().and_then(|row| row.first());
        let idx = index(0, "bias", id.copied().unwrap_or(0), self.biases.len())?;
        Ok(self.biases[idx])
    }

    fn edge(&self, part: usize, parent: usize) -> Result<Edge, ModelError> {
        let own = &self.parts[part];
        let bias = map_pairs(&own.bias_ids, |id| {
            if id == 0 {
                return Ok(f64::NEG_INFINITY);
            }
            let idx = index(part, "bias", id, self.biases.len())?;
            Ok(self.biases[idx])
        })?;
        let spring = |id| {
            let idx = index(part, "spring", id, self.springs.len())?;
            Ok(self.springs[idx])
        };
        let springs = match &own.spring_ids {
            SpringIds::PerChildType(ids) => {
                Springs::PerChildType(ids.iter().map(|&id| spring(id)).collect::<Result<_, _>>()?)
            }
            SpringIds::PerTypePair(ids) => Springs::PerTypePair(map_pairs(ids, |id| {
                (id > 0).then(|| spring(id)).transpose()
            })?),
        };
        Ok(Edge {
            parent,
            bias,
            springs,
        })
    }
}

/// Converts the 1-based `id` to a 0-based index, if the item exists.
fn index(part: usize, what: &'static str, id: usize, count: usize) -> Result<usize, ModelError> {
    id.checked_sub(1).filter(|&idx| idx < count).ok_or(ModelError::Missing {
        part: part + 1,
        what,
        index: id,
        count,
    })
}

/// Creates a filter from its values in the order of the files: row fastest, channel slowest.
///
/// * `values`: `rows x cols x N_CHANNELS` values.
pub(super) fn filter_from_planes(rows: usize, cols: usize, values: &[f64]) -> Filter {
    let mut weights = Vec::with_capacity(values.len());
    for row in 0..rows {
        for col in 0..cols {
            weights
                .extend((0..N_CHANNELS).map(|channel| values[(channel * cols + col) * rows + row]));
        }
    }
    Filter {
        rows,
        cols,
        weights,
    }
}

/// Maps every entry of a table `[parent type][child type]`.
fn map_pairs<T>(
    ids: &[Vec<usize>],
    mut f: impl FnMut(usize) -> Result<T, ModelError>,
) -> Result<Vec<Vec<T>>, ModelError> {
    ids.iter().map(|row| row.iter().map(|&id| f(id)).collect()).collect()
}
