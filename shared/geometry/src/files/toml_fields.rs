//! Numbers from a TOML table, with errors that name the key.

use nalgebra::Matrix3;
use toml::{Table, Value};

use super::{ParseError, numbers};

/// A table, and the path to it.
pub(super) struct Fields<'a> {
    pub(super) table: &'a Table,
    pub(super) path: String,
}

impl<'a> Fields<'a> {
    pub(super) fn field(&self, key: &str) -> String {
        format!("{}.{key}", self.path)
    }

    /// Returns true if a key is present; Caliscope writes `"null"` for unknown values.
    pub(super) fn has(&self, key: &str) -> bool {
        let value = self.table.get(key);
        value.is_some_and(|value| value.as_str() != Some("null"))
    }

    pub(super) fn get(&self, key: &str) -> Result<&'a Value, ParseError> {
        self.table.get(key).ok_or_else(|| ParseError::Missing {
            field: self.field(key),
        })
    }

    /// Returns a list of numbers of any length.
    pub(super) fn list(&self, key: &str) -> Result<Vec<f64>, ParseError> {
        list(&self.field(key), self.get(key)?)
    }

    /// Returns a list of `N` numbers.
    pub(super) fn array<const N: usize>(&self, key: &str) -> Result<[f64; N], ParseError> {
        let list = self.list(key)?;
        exactly(&self.field(key), &list)
    }

    /// Returns a 3x3 matrix.
    pub(super) fn matrix(&self, key: &str) -> Result<Matrix3<f64>, ParseError> {
        matrix(&self.field(key), self.get(key)?)
    }
}

fn matrix(field: &str, value: &Value) -> Result<Matrix3<f64>, ParseError> {
    let rows = as_list(field, value)?;
    let [_, _, _] = rows else {
        return Err(ParseError::Shape {
            field: field.to_owned(),
            expected: "3 rows",
            found: format!("{} rows", rows.len()),
        });
    };
    let mut matrix = [[0.0; 3]; 3];
    for (i, (row, out)) in rows.iter().zip(&mut matrix).enumerate() {
        let field = format!("{field}[{i}]");
        *out = exactly(&field, &list(&field, row)?)?;
    }
    Ok(numbers::matrix(matrix))
}

fn exactly<const N: usize>(field: &str, list: &[f64]) -> Result<[f64; N], ParseError> {
    let Some((numbers, [])) = list.split_first_chunk::<N>() else {
        return Err(ParseError::Shape {
            field: field.to_owned(),
            expected: match N {
                2 => "2 numbers",
                3 => "3 numbers",
                _ => "a different number of values",
            },
            found: format!("{} numbers", list.len()),
        });
    };
    Ok(*numbers)
}

fn list(field: &str, value: &Value) -> Result<Vec<f64>, ParseError> {
    let number = |(i, value): (usize, &Value)| match value {
        Value::Float(number) => Ok(*number),
        Value::Integer(number) => Ok(*number as f64),
        other => Err(ParseError::Shape {
            field: format!("{field}[{i}]"),
            expected: "a number",
            found: other.to_string(),
        }),
    };
    as_list(field, value)?.iter().enumerate().map(number).collect()
}

fn as_list<'a>(field: &str, value: &'a Value) -> Result<&'a [Value], ParseError> {
    match value {
        Value::Array(list) => Ok(list),
        other => Err(ParseError::Shape {
            field: field.to_owned(),
            expected: "a list",
            found: other.type_str().to_owned(),
        }),
    }
}
