//! Metadata of a recording: the run that was recorded, and which data was left out on purpose.

use std::collections::BTreeMap;

/// Name of the metadata record.
pub(crate) const NAME: &str = "parallax";
/// Name of the metadata record that gives the topic of each channel number.
pub(crate) const TOPICS: &str = "parallax.topics";
/// Version of the format that this crate writes. It reads no other version.
const FORMAT: &str = "3";

/// The kinds of data that were left out on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Without {
    /// True if frames are recorded without pixels.
    pub pixels: bool,
    /// True if evidence is not recorded.
    pub evidence: bool,
}

/// The run that was recorded.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct About {
    /// Version of the program that wrote the recording.
    pub version: String,
    /// Session in the stamp of every message.
    pub session: u64,
    /// Start time, in nanoseconds since 1970.
    pub began_unix_nanos: u64,
    /// Settings of the run, as JSON.
    pub settings: String,
    /// The kinds of data that were left out on purpose.
    pub without: Without,
}

/// Reason why the metadata of a recording is missing or invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AboutError {
    /// A key is missing.
    #[error("the recording does not state its {0}")]
    Missing(&'static str),
    /// A value is not a number.
    #[error("the value of {key} in the recording is {got:?}, which is not valid")]
    Value {
        /// Name of the key.
        key: &'static str,
        /// Value in the file.
        got: String,
    },
    /// The recording was written by another version of the program.
    #[error("the recording has format {got:?}, but this program reads format {FORMAT}")]
    Format {
        /// Format in the file.
        got: String,
    },
}

impl About {
    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let yes_or_no = |value: bool| if value { "yes" } else { "no" }.to_owned();
        let entries = [
            ("format", FORMAT.to_owned()),
            ("version", self.version.clone()),
            ("session", self.session.to_string()),
            ("began_unix_nanos", self.began_unix_nanos.to_string()),
            ("settings", self.settings.clone()),
            ("without_pixels", yes_or_no(self.without.pixels)),
            ("without_evidence", yes_or_no(self.without.evidence)),
        ];
        entries.map(|(key, value)| (key.to_owned(), value)).into()
    }

    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, AboutError> {
        let text = |key: &'static str| map.get(key).ok_or(AboutError::Missing(key));
        let refused = |key, got: &str| AboutError::Value {
            key,
            got: got.chars().take(40).collect(),
        };
        let number = |key| {
            let it = text(key)?;
            it.parse().ok().ok_or_else(|| refused(key, it))
        };
        let flag = |key| match text(key)?.as_str() {
            "yes" => Ok(true),
            "no" => Ok(false),
            other => Err(refused(key, other)),
        };
        let format = text("format")?;
        if format != FORMAT {
            let got = format.chars().take(40).collect();
            return Err(AboutError::Format { got });
        }
        Ok(Self {
            version: text("version")?.clone(),
            session: number("session")?,
            began_unix_nanos: number("began_unix_nanos")?,
            settings: text("settings")?.clone(),
            without: Without {
                pixels: flag("without_pixels")?,
                evidence: flag("without_evidence")?,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about() -> About {
        About {
            version: "0.1.0".to_owned(),
            session: u64::MAX,
            began_unix_nanos: 5,
            settings: "{\"name\": \"walk\"}".to_owned(),
            without: Without {
                pixels: true,
                evidence: false,
            },
        }
    }

    #[test]
    fn metadata_survives_a_round_trip() {
        assert_eq!(About::from_map(&about().to_map()), Ok(about()));
    }

    #[test]
    fn missing_keys_are_named() {
        for key in about().to_map().keys() {
            let mut map = about().to_map();
            map.remove(key);
            let error = About::from_map(&map).unwrap_err().to_string();
            assert!(error.ends_with(key), "{error}");
        }
    }

    #[test]
    fn an_unknown_format_or_an_invalid_number_is_refused_with_its_value() {
        let refused = |key: &str, value: &str| {
            let mut map = about().to_map();
            map.insert(key.to_owned(), value.to_owned());
            About::from_map(&map).unwrap_err().to_string()
        };
        assert!(refused("format", "4").contains("format \"4\""));
        assert!(refused("session", "-1").contains("session in the recording is \"-1\""));
        assert!(refused("without_pixels", "maybe").contains("\"maybe\""));
    }
}
