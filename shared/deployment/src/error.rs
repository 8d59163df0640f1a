//! Why a deployment file was refused: always with the place, and with what would do.

/// Why a deployment file was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
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
        /// Its value.
        got: String,
        /// Description of the values that are accepted.
        expected: String,
    },
}

impl ConfigError {
    /// Explains what the TOML reader said.
    ///
    /// Serde says `unknown field`, the name, then what it knows, each in backticks; of its other words see
    /// [`failure::wording::in_words`].
    ///
    /// * `key`: of the value that is wrong, with its section, where it is known.
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

/// The most common slip of a file that has one camera too many for its brackets.
fn of_cameras(key: &str) -> &'static str {
    if key == "camera" {
        "; every camera begins with [[camera]], in double brackets"
    } else {
        ""
    }
}

/// Describes the keys that a deployment or a camera needs at least.
fn of_what_is_missing(key: &str) -> &'static str {
    match key {
        "rig" | "output" | "camera" | "name" => {
            "; a deployment file needs `name`, `rig`, `output`, and a [[camera]] with `name` and `source` for each camera"
        }
        _ => "",
    }
}

/// The nearest known name, or all of them if none is near.
fn hint(key: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(key, name), name))
        .filter(|(distance, it)| *distance <= 2.max(it.len() / 3))
        .min();
    nearest.map_or_else(
        || format!("known here: {}", known.join(", ")),
        |(_, it)| format!("did you mean `{it}`?"),
    )
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_slip_gets_the_nearest_name() {
        let message = "unknown field `modle`, expected one of `name`, `model`, `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message, None).to_string();
        assert_eq!(got, "a.toml:3: unknown key `modle`, did you mean `model`?");
    }

    #[test]
    fn no_word_of_the_program_is_left_of_what_its_types_say() {
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
    fn a_name_like_no_other_gets_the_list() {
        let message = "unknown field `quux`, expected `name` or `rig`";
        let got = ConfigError::explain("a.toml:3".to_owned(), message, None).to_string();
        assert_eq!(got, "a.toml:3: unknown key `quux`, known here: name, rig");
    }
}
