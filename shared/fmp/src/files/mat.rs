//! Yang & Ramanan's released models: a MATLAB level 5 file with a struct called `model`.

use formats::mat5::{ContainerError, Numbers, Structs, Value};

use super::released::{Released, ReleasedPart, SpringIds, filter_from_planes};
use crate::{Filter, Model, ModelError, ModelSpec, N_CHANNELS, Spring};

/// Reason why a MATLAB file was rejected as a model.
#[derive(Debug, thiserror::Error)]
pub enum MatError {
    /// The file is not a readable MATLAB file.
    #[error("not a readable MATLAB level 5 file")]
    Container(#[from] ContainerError),
    /// A field is missing.
    #[error("`{field}` is missing")]
    Missing {
        /// Path of the field in the file.
        field: String,
    },
    /// A field has the wrong type.
    #[error("`{field}` is not {expected}")]
    Kind {
        /// Path of the field in the file.
        field: String,
        /// The expected type.
        expected: &'static str,
    },
    /// The size of an array contradicts the rest of the model.
    #[error("`{field}` is {}, expected {}", times(.got), times(.expected))]
    Size {
        /// Path of the field in the file.
        field: String,
        /// Size of the array.
        got: Vec<usize>,
        /// Accepted size.
        expected: Vec<usize>,
    },
    /// A number is out of range.
    #[error("`{field}` holds {value}, expected {expected}")]
    Number {
        /// Path of the field in the file.
        field: String,
        /// The number that was found.
        value: f64,
        /// The accepted values.
        expected: String,
    },
    /// An index is out of range.
    #[error("an index in the components refers to an entry that does not exist")]
    Index(#[from] ModelError),
}

/// Reads a model of Yang & Ramanan's release 1.3 or 1.4.
///
/// The releases differ in `defid`. Release 1.3 has one spring per type of the child. Release 1.4 has one spring per pair of types, `[parent
/// type, child type]`, with 0 if the pair never occurs (its `biasid` may also contain 0). Parents are `components{1}(i).parent`; the
/// model's own `pa` or `parent`, if present, must agree. `len` and `obj` are ignored. Only models with one component can be read.
///
/// # Errors
///
/// [`MatError`], naming the field by its MATLAB path. The numbers themselves are checked by
/// [`Model::new`].
pub fn parse(file: &[u8]) -> Result<ModelSpec, MatError> {
    let variables = formats::mat5::variables(file)?;
    for bytes in &variables {
        let (name, value) = formats::mat5::variable(bytes)?;
        if name == "model" {
            return Ok(released(&value)?.into_spec()?);
        }
    }
    Err(MatError::Missing {
        field: "model".to_owned(),
    })
}

/// Maximum number of indices in a field.
const MAX_IDS: usize = Model::MAX_TYPES * Model::MAX_TYPES;

/// A value and its path in the file.
struct At<'v, 'a> {
    field: String,
    value: &'v Value<'a>,
}

/// An array of structs and its path in the file.
struct Elements<'v, 'a> {
    field: String,
    structs: &'v Structs<'a>,
}

impl<'v, 'a> At<'v, 'a> {
    fn kind(&self, expected: &'static str) -> MatError {
        MatError::Kind {
            field: self.field.clone(),
            expected,
        }
    }

    fn structs(&self) -> Result<Elements<'v, 'a>, MatError> {
        match self.value {
            Value::Structs(structs) => Ok(Elements {
                field: self.field.clone(),
                structs,
            }),
            _ => Err(self.kind("a struct")),
        }
    }

    fn numbers(&self) -> Result<&'v Numbers<'a>, MatError> {
        match self.value {
            Value::Numbers(numbers) => Ok(numbers),
            _ => Err(self.kind("an array of real numbers")),
        }
    }

    fn numbers_up_to(&self, limit: usize) -> Result<&'v Numbers<'a>, MatError> {
        let numbers = self.numbers()?;
        if numbers.n_values() > limit {
            return Err(self.size(vec![1, limit]));
        }
        Ok(numbers)
    }

    fn size(&self, expected: Vec<usize>) -> MatError {
        MatError::Size {
            field: self.field.clone(),
            got: match self.value {
                Value::Numbers(numbers) => numbers.sizes().to_vec(),
                _ => Vec::new(),
            },
            expected,
        }
    }

    /// Returns all numbers of the value; there must be exactly `N`.
    fn row<const N: usize>(&self) -> Result<[f64; N], MatError> {
        let numbers = self.numbers_up_to(N)?;
        <[f64; N]>::try_from(numbers.values()).map_err(|_values| self.size(vec![1, N]))
    }

    fn scalar(&self) -> Result<f64, MatError> {
        self.row::<1>().map(|[it]| it)
    }

    fn id(&self) -> Result<usize, MatError> {
        self.as_id(self.scalar()?)
    }

    fn ids(&self) -> Result<Vec<usize>, MatError> {
        let values = self.numbers_up_to(MAX_IDS)?.values();
        values.into_iter().map(|value| self.as_id(value)).collect()
    }

    /// Returns a table of indices, by rows.
    fn table(&self, rows: usize, cols: usize) -> Result<Vec<Vec<usize>>, MatError> {
        if *self.numbers()?.sizes() != [rows, cols] {
            return Err(self.size(vec![rows, cols]));
        }
        let ids = self.ids()?;
        Ok((0..rows)
            .map(|row| (0..cols).map(|col| ids[col * rows + row]).collect())
            .collect())
    }

    fn as_id(&self, value: f64) -> Result<usize, MatError> {
        if value.fract() == 0.0 && (0.0..1e9).contains(&value) {
            Ok(value as usize)
        } else {
            Err(self.wrong(value, "a whole number of at least 0"))
        }
    }

    fn wrong(&self, value: f64, expected: impl Into<String>) -> MatError {
        MatError::Number {
            field: self.field.clone(),
            value,
            expected: expected.into(),
        }
    }
}

impl<'v, 'a> Elements<'v, 'a> {
    fn len(&self) -> usize {
        self.structs.len()
    }

    fn path(&self, element: usize, name: &str) -> String {
        match self.len() {
            1 => format!("{}.{name}", self.field),
            _ => format!("{}({}).{name}", self.field, element + 1),
        }
    }

    fn find(&self, element: usize, name: &str) -> Option<At<'v, 'a>> {
        Some(At {
            value: self.structs.get(element, name)?,
            field: self.path(element, name),
        })
    }

    fn get(&self, element: usize, name: &str) -> Result<At<'v, 'a>, MatError> {
        self.find(element, name).ok_or_else(|| MatError::Missing {
            field: self.path(element, name),
        })
    }
}

fn released(value: &Value<'_>) -> Result<Released, MatError> {
    let model = At {
        field: "model".to_owned(),
        value,
    }
    .structs()?;
    let filters = filters(&model.get(0, "filters")?.structs()?)?;
    let parts = parts(&model)?;
    parents_agree(&model, &parts)?;
    largest_agrees(&model, &filters)?;
    Ok(Released {
        biases: biases(&model.get(0, "bias")?.structs()?)?,
        filters,
        springs: springs(&model.get(0, "defs")?.structs()?)?,
        parts,
        interval: model.get(0, "interval")?.id()?,
        cell_px: model.get(0, "sbin")?.id()?,
        threshold: model.get(0, "thresh")?.scalar()?,
    })
}

fn biases(all: &Elements<'_, '_>) -> Result<Vec<f64>, MatError> {
    (0..all.len()).map(|i| all.get(i, "w")?.scalar()).collect()
}

fn filters(all: &Elements<'_, '_>) -> Result<Vec<Filter>, MatError> {
    (0..all.len())
        .map(|k| {
            let weights = all.get(k, "w")?;
            let numbers = weights.numbers()?;
            match *numbers.sizes() {
                [rows, cols, N_CHANNELS] if rows.max(cols) <= Model::MAX_FILTER => {
                    Ok(filter_from_planes(rows, cols, &numbers.values()))
                }
                _ => {
                    let side = |i: usize| numbers.sizes()[i].min(Model::MAX_FILTER);
                    Err(weights.size(vec![side(0), side(1), N_CHANNELS]))
                }
            }
        })
        .collect()
}

fn springs(all: &Elements<'_, '_>) -> Result<Vec<Spring>, MatError> {
    (0..all.len())
        .map(|i| {
            let w = all.get(i, "w")?.row()?;
            let at = all.get(i, "anchor")?;
            let [x, y, octave] = at.row()?;
            for value in [x, y] {
                if value.fract() != 0.0 || value.abs() > 1e6 {
                    return Err(at.wrong(value, "a whole number of cells"));
                }
            }
            if octave != 0.0 {
                return Err(at.wrong(octave, "0 octaves between a part and its parent"));
            }
            Ok(Spring {
                w,
                anchor: [x, y].map(|value| value as i32 - 1),
            })
        })
        .collect()
}

fn parts(model: &Elements<'_, '_>) -> Result<Vec<ReleasedPart>, MatError> {
    let components = model.get(0, "components")?;
    let component = match components.value {
        Value::Cell(cells) => match &cells[..] {
            [one] => one,
            several => {
                return Err(MatError::Size {
                    field: components.field,
                    got: vec![1, several.len()],
                    expected: vec![1, 1],
                });
            }
        },
        _ => return Err(components.kind("a cell array")),
    };
    let all = At {
        field: format!("{}{{1}}", components.field),
        value: component,
    }
    .structs()?;
    if all.len() > Model::MAX_PARTS {
        return Err(MatError::Size {
            got: vec![1, all.len()],
            field: all.field,
            expected: vec![1, Model::MAX_PARTS],
        });
    }
    (0..all.len()).map(|i| part(&all, i)).collect()
}

fn part(all: &Elements<'_, '_>, it: usize) -> Result<ReleasedPart, MatError> {
    let parent = all.get(it, "parent")?;
    let parent_id = parent.id()?;
    let filter_ids = all.get(it, "filterid")?.ids()?;
    if parent_id == 0 {
        return Ok(ReleasedPart {
            parent: 0,
            filter_ids,
            bias_ids: vec![all.get(it, "biasid")?.ids()?],
            spring_ids: SpringIds::PerChildType(Vec::new()),
        });
    }
    if parent_id > all.len() {
        return Err(parent.wrong(parent_id as f64, format!("0 to {}", all.len())));
    }
    let n_parent = all.get(parent_id - 1, "filterid")?.numbers()?.n_values();
    let n_own = filter_ids.len();
    let springs = all.get(it, "defid")?;
    let ids = springs.ids()?;
    let sizes = springs.numbers()?.sizes();
    let per_pair = *sizes == [n_parent, n_own] && (n_parent > 1 || ids.contains(&0));
    let spring_ids = if !per_pair && ids.len() == n_own {
        SpringIds::PerChildType(ids)
    } else {
        SpringIds::PerTypePair(springs.table(n_parent, n_own)?)
    };
    Ok(ReleasedPart {
        parent: parent_id,
        filter_ids,
        bias_ids: all.get(it, "biasid")?.table(n_parent, n_own)?,
        spring_ids,
    })
}

fn parents_agree(model: &Elements<'_, '_>, parts: &[ReleasedPart]) -> Result<(), MatError> {
    let Some(list) = model.find(0, "pa").or_else(|| model.find(0, "parent")) else {
        return Ok(());
    };
    let ids = list.ids()?;
    if ids.len() != parts.len() {
        return Err(MatError::Size {
            field: list.field,
            got: vec![1, ids.len()],
            expected: vec![1, parts.len()],
        });
    }
    for (part, (&id, other)) in ids.iter().zip(parts).enumerate() {
        if id != other.parent {
            let other = other.parent;
            let expected = format!("{other} for part {}, as the components say", part + 1);
            return Err(list.wrong(id as f64, expected));
        }
    }
    Ok(())
}

/// Checks `maxsize`, if present, against the filters.
fn largest_agrees(model: &Elements<'_, '_>, filters: &[Filter]) -> Result<(), MatError> {
    let Some(at) = model.find(0, "maxsize") else {
        return Ok(());
    };
    let [rows, cols]: [f64; 2] = at.row()?;
    let largest = |side: fn(&Filter) -> usize| filters.iter().map(side).max().unwrap_or(0);
    for (got, expected) in [
        (rows, largest(|filter| filter.rows)),
        (cols, largest(|filter| filter.cols)),
    ] {
        if got != expected as f64 {
            return Err(at.wrong(got, format!("{expected}, the largest filter's side")));
        }
    }
    Ok(())
}

fn times(sizes: &[usize]) -> String {
    let sizes: Vec<String> = sizes.iter().map(ToString::to_string).collect();
    sizes.join("x")
}

#[cfg(test)]
mod tests;
