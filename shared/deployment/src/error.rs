//! Errors in a deployment file, each with its place and with the values that are accepted.

/// Reason why a deployment file was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// An unknown key, most often a typing error.
    #[error("{place}: unknown key `{key}`: {hint}")]
    UnknownKey {
        /// File and line, or the option of the command line.
        place: String,
        /// Name of the key.
        key: String,
        /// The nearest known key, or all keys that are known in the same section.
        hint: String,
    },
    /// The text is not TOML, or a value has the wrong type for its key.
    #[error("{place}: {message}")]
    Malformed {
        /// File and line, or the option of the command line.
        place: String,
        /// Reason why it is malformed.
        message: String,
    },
    /// A value that is not allowed.
    #[error("{place}: `{key}` is {got}, expected {expected}")]
    Value {
        /// File and line.
        place: String,
        /// The key, with its section.
        key: String,
        /// The value that was given.
        got: String,
        /// Description of the values that are accepted.
        expected: String,
    },
}

impl ConfigError {
    /// Converts a message of the TOML reader into an error.
    ///
    /// Serde writes `unknown field`, the name, then the known names, each in backticks. For its other messages, see
    /// [`failure::wording::in_words`].
    ///
    /// * `key`: the key of the wrong value, with its section, if known.
    pub(super) fn explain(place: String, message: &str, key: Option<&str>) -> Self {
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
        let said = failure::wording::in_words(message.trim_end()).replace('\n', ", ");
        let message = match (key, names.first()) {
            (Some(key), _) if message.starts_with("duplicate key") => {
                format!("`{key}` is given twice{}", of_cameras(key))
            }
            (Some(key), _) if !said.starts_with("missing key") => {
                format!("`{key}`: {said}{}", of_cameras(key))
            }
            (_, Some(&missing)) if said.starts_with("missing key") => {
                format!("{said}{}", of_what_is_missing(missing))
            }
            _ => said,
        };
        Self::Malformed { place, message }
    }
}

/// Returns a hint for the most common mistake: `[camera]` with single brackets.
fn of_cameras(key: &str) -> &'static str {
    if key == "camera" {
        "; every camera begins with [[camera]] in double brackets"
    } else {
        ""
    }
}

/// Describes the keys that every deployment or camera needs.
fn of_what_is_missing(key: &str) -> &'static str {
    match key {
        "rig" | "output" | "camera" | "name" => {
            "; a deployment file needs `name`, `rig`, `output`, and a [[camera]] with `name` and `source` for each camera"
        }
        _ => "",
    }
}

/// Returns the nearest known name, or all known names if none is near.
fn hint(key: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(key, name), name))
        .filter(|(distance, it)| *distance <= 2.max(it.len() / 3))
        .min();
    nearest.map_or_else(
        || format!("the known keys of this section are {}", known.join(", ")),
        |(_, it)| format!("did you mean `{it}`?"),
    )
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_misspelt_name_gets_the_nearest_name_as_suggestion() {
        let message = "unknown field `modle`, expected one of `name`, `model`, `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message, None).to_string();
        assert_eq!(got, "a.toml:3: unknown key `modle`: did you mean `model`?");
    }

    #[test]
    fn messages_about_types_contain_no_rust_terms() {
        #[derive(Debug, serde::Deserialize)]
        #[expect(dead_code, reason = "only read")]
        struct All {
            a: Option<u64>,
            b: Option<[usize; 2]>,
            c: Option<bool>,
            d: Option<PathBuf>,
            e: Option<Vec<f32>>,
        }
        let words = [
            "u64", "usize", "f32", "boolean", "integer", "sequence", "map", "length", "string",
        ];
        let mut n_refused = 0;
        for key in ["a", "b", "c", "d", "e"] {
            for value in ["\"x\"", "-1", "1.5", "true", "[\"x\"]", "{ x = 1 }"] {
                let Err(error) = toml::from_str::<All>(&format!("{key} = {value}")) else {
                    continue;
                };
                n_refused += 1;
                let error = ConfigError::explain("a.toml:1".to_owned(), error.message(), Some(key));
                let said = error.to_string();
                assert!(
                    said.starts_with(&format!("a.toml:1: `{key}`: expected ")),
                    "{said}"
                );
                let word = words.iter().find(|word| said.contains(**word));
                assert_eq!(word, None, "{key} = {value}: {said}");
            }
        }
        assert!(n_refused > 20, "{n_refused}");
    }

    #[test]
    fn a_name_without_a_similar_one_gets_the_list_of_names() {
        let message = "unknown field `quux`, expected `name` or `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message, None).to_string();
        assert_eq!(
            got,
            "a.toml:3: unknown key `quux`: the known keys of this section are name, rig"
        );
    }
}
