//! Lists with more values than their key takes.

use toml::{Table, Value};

use crate::{Complaint, Deployment};

/// Checks that no list has more values than were read. The TOML reader ignores surplus values.
///
/// * `said`: the table that `deployment` was read from.
pub(super) fn fits(deployment: &Deployment, said: &Table) -> Result<(), Complaint> {
    let Ok(taken) = Table::try_from(deployment) else {
        return Ok(());
    };
    let wrong = too_long(&Value::Table(said.clone()), &Value::Table(taken), "");
    wrong.map_or(Ok(()), Err)
}

fn too_long(said: &Value, taken: &Value, key: &str) -> Option<Complaint> {
    match (said, taken) {
        (Value::Table(said), Value::Table(taken)) => said.iter().find_map(|(name, value)| {
            let key = if key.is_empty() {
                name.clone()
            } else {
                format!("{key}.{name}")
            };
            too_long(value, taken.get(name)?, &key)
        }),
        (Value::Array(said), Value::Array(taken)) if said.len() > taken.len() => Some(Complaint {
            key: key.to_owned(),
            got: format!("a list of {} values", said.len()),
            expected: format!("{}", taken.len()),
        }),
        (Value::Array(said), Value::Array(taken)) => {
            said.iter().zip(taken).find_map(|(said, taken)| too_long(said, taken, key))
        }
        _ => None,
    }
}
