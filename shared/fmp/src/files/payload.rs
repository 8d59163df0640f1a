//! The payload of Parallax's own model file; serde and bincode are used only here.

use bincode::config::{self, Configuration, Limit, LittleEndian, Varint};
use bincode::error::{DecodeError, EncodeError};
use serde::{Deserialize, Serialize};

use crate::{Edge, Filter, ModelSpec, PartSpec, Spring, Springs};

/// Maximum size of a payload in bytes; larger than the largest accepted model.
const MAX_BYTES: usize = 192 << 20;

const fn configuration() -> Configuration<LittleEndian, Varint, Limit<MAX_BYTES>> {
    config::standard().with_limit::<MAX_BYTES>()
}

/// Encodes the payload of a model.
pub(super) fn write(spec: &ModelSpec) -> Result<Vec<u8>, EncodeError> {
    bincode::serde::encode_to_vec(ModelRecord::from(spec), configuration())
}

/// Decodes a payload; returns the model and the number of bytes read.
pub(super) fn read(payload: &[u8]) -> Result<(ModelSpec, usize), DecodeError> {
    let (record, n_bytes): (ModelRecord, _) =
        bincode::serde::decode_from_slice(payload, configuration())?;
    Ok((record.into(), n_bytes))
}

#[derive(Serialize, Deserialize)]
struct ModelRecord {
    name: String,
    parts: Vec<PartRecord>,
    filters: Vec<FilterRecord>,
    root_bias: f64,
    interval: u32,
    cell_px: u32,
    threshold: f64,
    mirror: Option<Vec<u32>>,
}

#[derive(Serialize, Deserialize)]
struct PartRecord {
    name: String,
    filter_of_type: Vec<u32>,
    edge: Option<EdgeRecord>,
}

#[derive(Serialize, Deserialize)]
struct EdgeRecord {
    parent: u32,
    bias: Vec<Vec<f64>>,
    springs: SpringsRecord,
}

#[derive(Serialize, Deserialize)]
enum SpringsRecord {
    PerChildType(Vec<SpringRecord>),
    PerTypePair(Vec<Vec<Option<SpringRecord>>>),
}

#[derive(Serialize, Deserialize)]
struct SpringRecord {
    w: [f64; 4],
    anchor: [i32; 2],
}

#[derive(Serialize, Deserialize)]
struct FilterRecord {
    rows: u32,
    cols: u32,
    weights: Vec<f64>,
}

impl From<&ModelSpec> for ModelRecord {
    fn from(spec: &ModelSpec) -> Self {
        Self {
            name: spec.name.clone(),
            parts: spec.parts.iter().map(PartRecord::from).collect(),
            filters: spec.filters.iter().map(FilterRecord::from).collect(),
            root_bias: spec.root_bias,
            interval: spec.interval as u32,
            cell_px: spec.cell_px as u32,
            threshold: spec.threshold,
            mirror: spec.mirror.as_deref().map(narrow),
        }
    }
}

impl From<ModelRecord> for ModelSpec {
    fn from(record: ModelRecord) -> Self {
        Self {
            name: record.name,
            parts: record.parts.into_iter().map(PartSpec::from).collect(),
            filters: record.filters.into_iter().map(Filter::from).collect(),
            root_bias: record.root_bias,
            interval: record.interval as usize,
            cell_px: record.cell_px as usize,
            threshold: record.threshold,
            mirror: record.mirror.map(widen),
        }
    }
}

impl From<&PartSpec> for PartRecord {
    fn from(part: &PartSpec) -> Self {
        Self {
            name: part.name.clone(),
            filter_of_type: narrow(&part.filter_of_type),
            edge: part.edge.as_ref().map(EdgeRecord::from),
        }
    }
}

impl From<PartRecord> for PartSpec {
    fn from(record: PartRecord) -> Self {
        Self {
            name: record.name,
            filter_of_type: widen(record.filter_of_type),
            edge: record.edge.map(Edge::from),
        }
    }
}

impl From<&Edge> for EdgeRecord {
    fn from(edge: &Edge) -> Self {
        Self {
            parent: edge.parent as u32,
            bias: edge.bias.clone(),
            springs: match &edge.springs {
                Springs::PerChildType(springs) => {
                    SpringsRecord::PerChildType(springs.iter().map(SpringRecord::from).collect())
                }
                Springs::PerTypePair(rows) => SpringsRecord::PerTypePair(
                    rows.iter()
                        .map(|row| {
                            row.iter().map(|row| row.as_ref().map(SpringRecord::from)).collect()
                        })
                        .collect(),
                ),
            },
        }
    }
}

impl From<EdgeRecord> for Edge {
    fn from(record: EdgeRecord) -> Self {
        Self {
            parent: record.parent as usize,
            bias: record.bias,
            springs: match record.springs {
                SpringsRecord::PerChildType(springs) => {
                    Springs::PerChildType(springs.into_iter().map(Spring::from).collect())
                }
                SpringsRecord::PerTypePair(rows) => Springs::PerTypePair(
                    rows.into_iter()
                        .map(|row| row.into_iter().map(|row| row.map(Spring::from)).collect())
                        .collect(),
                ),
            },
        }
    }
}

impl From<&Spring> for SpringRecord {
    fn from(&Spring { w, anchor }: &Spring) -> Self {
        Self { w, anchor }
    }
}

impl From<SpringRecord> for Spring {
    fn from(SpringRecord { w, anchor }: SpringRecord) -> Self {
        Self { w, anchor }
    }
}

impl From<&Filter> for FilterRecord {
    fn from(filter: &Filter) -> Self {
        Self {
            rows: filter.rows as u32,
            cols: filter.cols as u32,
            weights: filter.weights.clone(),
        }
    }
}

impl From<FilterRecord> for Filter {
    fn from(record: FilterRecord) -> Self {
        Self {
            rows: record.rows as usize,
            cols: record.cols as usize,
            weights: record.weights,
        }
    }
}

/// Indices and sizes of a checked model are far below 2^32.
fn narrow(indices: &[usize]) -> Vec<u32> {
    indices.iter().map(|&index| index as u32).collect()
}

fn widen(indices: Vec<u32>) -> Vec<usize> {
    indices.into_iter().map(|index| index as usize).collect()
}
