//! Why a deployment file was refused: always with the place, and with what would do.

use std::path::PathBuf;

/// Why a deployment file was refused.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ConfigError {
    /// The file could not be read.
    #[error("cannot read the deployment file {}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A key that nothing reads, most often a slip.
    #[error("{place}: unknown key `{key}`, {hint}")]
    UnknownKey {
        /// File and line, or the option of the command line.
        place: String,
        /// The key.
        key: String,
        /// The nearest known key, or all that are known there.
        hint: String,
    },
    /// Not TOML, or a value of another kind than its key asks for.
    #[error("{place}: {message}")]
    Malformed {
        /// File and line, or the option of the command line.
        place: String,
        /// What is wrong.
        message: String,
    },
    /// A value that cannot be.
    #[error("{place}: `{key}` is {got}, expected {expected}")]
    Value {
        /// File and line.
        place: String,
        /// The key, with its section.
        key: String,
        /// Its value.
        got: String,
        /// What would do.
        expected: String,
    },
}

impl ConfigError {
    /// Explains what the TOML reader said.
    ///
    /// Serde says `unknown field`, the name, then what it knows, each in backticks; nothing else of
    /// its wording is relied on.
    pub(super) fn explain(place: String, message: &str) -> Self {
        let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        if let Some((key, known)) = names.split_first()
            && message.starts_with("unknown field")
        {
            let hint = hint(key, known);
            return Self::UnknownKey {
                place,
                key: (*key).to_owned(),
                hint,
            };
        }
        let message = message
            .replace("missing field", "missing key")
            .replace("unknown variant", "unknown value");
        let message = message.trim_end().replace('\n', ", ");
        Self::Malformed { place, message }
    }
}

/// The nearest known name, or all of them if none is near.
fn hint(key: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|it| (strsim::damerau_levenshtein(key, it), it))
        .filter(|(distance, it)| *distance <= 2.max(it.len() / 3))
        .min();
    nearest.map_or_else(
        || format!("known here: {}", known.join(", ")),
        |(_, it)| format!("did you mean `{it}`?"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_gets_the_nearest_name() {
        let message = "unknown field `modle`, expected one of `name`, `model`, `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message).to_string();
        assert_eq!(got, "a.toml:3: unknown key `modle`, did you mean `model`?");
    }

    #[test]
    fn a_name_like_no_other_gets_the_list() {
        let message = "unknown field `quux`, expected `name` or `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message).to_string();
        assert_eq!(got, "a.toml:3: unknown key `quux`, known here: name, rig");
    }
}
