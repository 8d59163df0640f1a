//! Loading of a deployment from a file and the options of the command line.

use std::path::Path;

use toml::{Table, Value};

use crate::lists::fits;
use crate::places::{malformed, of_set, place, span_of};
use crate::{Complaint, ConfigError, Deployment, Machine, live, method, rules};

/// A deployment, and the origin of every value.
#[derive(Debug)]
pub struct Loaded {
    /// The deployment, with resolved paths and with defaults.
    pub deployment: Deployment,
    /// Content of the file, without changes.
    pub in_file: Table,
    /// Settings from the command line.
    pub on_command_line: Table,
}

impl Loaded {
    /// Reads the text of a deployment file; `set` has `key=value` pairs that replace its values.
    ///
    /// * `file`: file that contains the text. Relative paths, including those in `set`, are relative to the folder of this file.
    ///
    /// # Errors
    ///
    /// Returns the first [`ConfigError`] found.
    pub fn parse(
        text: &str,
        file: &Path,
        set: &[String],
        machine: &dyn Machine,
    ) -> Result<Self, ConfigError> {
        let malformed = |error: &toml::de::Error| malformed(file, text, error);
        let in_file: Result<Table, _> = toml::from_str(text);
        // Errors from the structs say more than errors from a table, so the structs are read first.
        let mut deployment: Deployment = toml::from_str(text).map_err(|error| malformed(&error))?;
        let in_file = in_file.map_err(|error| malformed(&error))?;
        let on_command_line = overrides(set)?;
        let mut given = in_file.clone();
        if !on_command_line.is_empty() {
            merge(&mut given, on_command_line.clone());
            let read = given.clone().try_into();
            deployment = read.map_err(|error| of_set(&error))?;
        }
        let placed = |complaint: Complaint| {
            let at = place(file, text, span_of(text, &complaint.key));
            complaint.at(at)
        };
        if let Some(stranger) = method::stranger(deployment.method, &given) {
            let place = if method::stranger(deployment.method, &in_file).is_some() {
                place(file, text, span_of(text, &stranger.key))
            } else {
                format!("--set {}", stranger.key)
            };
            let message = stranger.message;
            return Err(ConfigError::Malformed { place, message });
        }
        fits(&deployment, &given).map_err(placed)?;
        deployment.resolve(&machine.folder_of(file), machine);
        let checked =
            live::settle(&mut deployment, &given, machine).and_then(|()| rules::check(&deployment));
        checked.map_err(placed)?;
        Ok(Self {
            deployment,
            in_file,
            on_command_line,
        })
    }
}

impl Loaded {
    /// Returns the deployment, loaded again with different values.
    ///
    /// * `refused`: returns the reason if the value of a dotted key may not be replaced.
    ///
    /// Relative paths in `set` are relative to the working folder.
    ///
    /// # Errors
    ///
    /// Returns the first [`ConfigError`] found.
    pub fn again(
        deployment: &Deployment,
        set: &[String],
        refused: impl Fn(&str) -> Option<String>,
        machine: &dyn Machine,
    ) -> Result<Self, ConfigError> {
        let on_command_line = overrides(set)?;
        for argument in set {
            let key = argument.split('=').next().unwrap_or_default().trim();
            if let Some(message) = refused(key) {
                let place = format!("--set {argument}");
                return Err(ConfigError::Malformed { place, message });
            }
        }
        let in_file = Table::try_from(deployment)
            .map_err(|error| ConfigError::explain("--set".to_owned(), &error.to_string(), None))?;
        let mut table = in_file.clone();
        merge(&mut table, on_command_line.clone());
        let read: Result<Deployment, toml::de::Error> = table.try_into();
        let mut deployment = read.map_err(|error| of_set(&error))?;
        if let Some(stranger) = method::stranger(deployment.method, &on_command_line) {
            let place = format!("--set {}", stranger.key);
            let message = stranger.message;
            return Err(ConfigError::Malformed { place, message });
        }
        fits(&deployment, &on_command_line).map_err(|error| error.at("--set".to_owned()))?;
        deployment.resolve(&machine.folder_of(Path::new("")), machine);
        rules::check(&deployment).map_err(|error| error.at("--set".to_owned()))?;
        Ok(Self {
            deployment,
            in_file,
            on_command_line,
        })
    }
}

/// Text used instead of a file when only the defaults are needed.
const NO_FILE: &str = "name = \"\"\nrig = \"\"\noutput = \"\"\ncamera = []\n";

impl Loaded {
    /// Returns the defaults alone; keys without a default are empty.
    ///
    /// # Errors
    ///
    /// Fails with [`ConfigError`] if `set` gives a value that is not allowed.
    pub fn defaults(set: &[String]) -> Result<Self, ConfigError> {
        let mut table = Table::new();
        let on_command_line = overrides(set)?;
        let explain = |error: toml::de::Error| of_set(&error);
        merge(&mut table, NO_FILE.parse().map_err(explain)?);
        merge(&mut table, on_command_line.clone());
        Ok(Self {
            deployment: table.try_into().map_err(explain)?,
            in_file: Table::new(),
            on_command_line,
        })
    }
}

/// Returns the options `--set section.key=value` as a table.
///
/// A value that is not TOML is read as text, so that `--set paper.energy=released` needs no quotes.
fn overrides(set: &[String]) -> Result<Table, ConfigError> {
    let mut table = Table::new();
    for argument in set {
        let malformed = |message: &str| ConfigError::Malformed {
            place: format!("--set {argument}"),
            message: message.to_owned(),
        };
        let (key, value) = argument
            .split_once('=')
            .ok_or_else(|| malformed("expected key=value, for example capture.scale=0.5"))?;
        let value = format!("it = {value}")
            .parse::<Table>()
            .ok()
            .and_then(|mut value| value.remove("it"))
            .unwrap_or_else(|| Value::String(value.to_owned()));
        let nested = key.trim().rsplit('.').fold(value, |inner, name| {
            Value::Table(Table::from_iter([(name.to_owned(), inner)]))
        });
        if let Value::Table(nested) = nested {
            merge(&mut table, nested);
        }
    }
    Ok(table)
}

/// Replaces values of `table` by the values of `over`, key by key.
fn merge(table: &mut Table, over: Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(over)) => merge(inner, over),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests;
