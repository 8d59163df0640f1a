//! The settings of a scene, and the address that contains all of them in one line.

use std::path::{Path, PathBuf};

use crate::flaws::{FlawError, Flaws};
use crate::motion::Action;
use crate::rigs::{RigChoice, RigChoiceError};

/// The complete settings of a scene. The same settings give the same pictures, bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The cameras of the scene.
    pub rig: RigChoice,
    /// Number of the subject, which determines shape, clothes and style of movement.
    pub subject: u64,
    /// Action of the subject.
    pub action: Action,
    /// Number of other people who stand near the subject, at most [`MOST_OTHERS`](Self::MOST_OTHERS).
    pub others: u64,
    /// Number of other people who walk past the subject, at most [`MOST_OTHERS`](Self::MOST_OTHERS).
    pub passers: u64,
    /// Seed of the random choices: the performance, the room, the lamps.
    pub seed: u64,
    /// Number of frames per second.
    pub rate_hz: f64,
    /// Folder of photographs to use instead of the room; every camera gets a random photograph.
    pub backdrop: Option<PathBuf>,
    /// The flaws of the cameras.
    pub flaws: Flaws,
    /// Time from the instant of a frame to the picture of each camera, in milliseconds, in the order of the rig. Cameras without an entry
    /// take their pictures exactly at the instant.
    pub skews_ms: Vec<f64>,
}

impl Settings {
    /// Maximum number of other people of each kind.
    pub const MOST_OTHERS: u64 = 4;
    /// Maximum time between a picture and the instant of its frame, in milliseconds.
    pub const MOST_SKEW_MS: f64 = 1000.0;

    /// Reads [`Self::skews_ms`]: numbers separated by commas.
    pub fn parse_skews_ms(text: &str) -> Option<Vec<f64>> {
        let one = |text: &str| {
            let skew: f64 = text.trim().parse().ok()?;
            (skew.abs() <= Self::MOST_SKEW_MS).then_some(skew)
        };
        text.split(',').map(one).collect()
    }
}

impl Default for Settings {
    /// Returns the settings for subject 1 walking in front of the cameras of HumanEva, at 30 frames per second, without flaws.
    fn default() -> Self {
        Self {
            rig: RigChoice::HumanEva,
            subject: 1,
            others: 0,
            passers: 0,
            action: Action::Walking,
            seed: 1,
            rate_hz: 30.0,
            backdrop: None,
            flaws: Flaws::default(),
            skews_ms: Vec::new(),
        }
    }
}

/// Reason why an address is invalid.
#[derive(Debug, thiserror::Error)]
pub enum AddressError {
    /// The address does not begin with `synth://`.
    #[error("an address of a scene begins with synth://")]
    Scheme,
    /// The rig is invalid.
    #[error("the rig of the address is not usable")]
    Rig(#[from] RigChoiceError),
    /// A key is unknown.
    #[error("unknown key {key:?}, expected one of {}", Address::KEYS.join(", "))]
    Key {
        /// The unknown key.
        key: String,
    },
    /// A part of the address has no `=`, or its key occurs twice.
    #[error("{text:?} is not key=value, or repeats a key")]
    Pair {
        /// Text of this part.
        text: String,
    },
    /// A value is invalid.
    #[error("{key}={value}: expected {expected}")]
    Value {
        /// Key of the value.
        key: String,
        /// The invalid value.
        value: String,
        /// Description of the accepted values.
        expected: String,
    },
    /// A flaw is invalid.
    #[error("a flaw of the address is not valid")]
    Flaw(#[from] FlawError),
    /// The address does not contain a camera.
    #[error("the address names no camera: add camera=NAME or camera=0, 1, ...")]
    NoCamera,
}

/// One camera of a scene, described in one line: `synth://RIG?key=value&key=value`.
///
/// ```
/// let it = scene::Address::parse("synth://humaneva?action=walking&subject=3&seed=1&camera=C1")?;
/// assert_eq!(it.settings.subject, 3);
/// assert_eq!(scene::Address::parse(&it.to_string())?, it);
/// # Ok::<(), scene::AddressError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Address {
    /// Settings of the scene.
    pub settings: Settings,
    /// Name of the camera in the rig, or its index, counted from 0.
    pub camera: String,
    /// Number of frames.
    pub n_frames: u64,
}

const SCHEME: &str = "synth://";

impl Address {
    /// Keys of an address, with the keys of the flaws last; `camera` is required.
    pub const KEYS: [&'static str; 17] = [
        "camera",
        "action",
        "subject",
        "others",
        "passers",
        "seed",
        "rate",
        "frames",
        "backdrop",
        "skew-ms",
        "noise",
        "blur",
        "exposure",
        "desync",
        "drop",
        "calibration-degrees",
        "calibration-mm",
    ];

    /// Returns true if a text begins like an address, whether valid or not.
    pub fn is_address(text: &str) -> bool {
        text.starts_with(SCHEME)
    }

    /// Reads an address. Missing keys have the values of [`Settings::default`]; the default number of frames is 300.
    ///
    /// # Errors
    ///
    /// [`AddressError`] for the leftmost error.
    pub fn parse(text: &str) -> Result<Self, AddressError> {
        let rest = text.strip_prefix(SCHEME).ok_or(AddressError::Scheme)?;
        let (rig, query) = rest.split_once('?').unwrap_or((rest, ""));
        let mut address = Self {
            settings: Settings {
                rig: RigChoice::parse(rig)?,
                ..Settings::default()
            },
            camera: String::new(),
            n_frames: 300,
        };
        let mut seen: Vec<&str> = Vec::new();
        for pair in query.split('&').filter(|part| !part.is_empty()) {
            let wrong = || AddressError::Pair {
                text: pair.to_owned(),
            };
            let (key, value) = pair.split_once('=').ok_or_else(wrong)?;
            if seen.contains(&key) {
                return Err(wrong());
            }
            seen.push(key);
            address.set(key, value)?;
        }
        address.settings.flaws.check()?;
        if address.camera.is_empty() {
            return Err(AddressError::NoCamera);
        }
        Ok(address)
    }

    /// Returns the address with relative paths interpreted relative to `base`; any other text is returned unchanged.
    #[must_use]
    pub fn relative_to(text: &str, base: &Path) -> String {
        let Ok(mut address) = Self::parse(text) else {
            return text.to_owned();
        };
        if let RigChoice::File(path) = &mut address.settings.rig {
            *path = base.join(&path);
        }
        if let Some(folder) = &mut address.settings.backdrop {
            *folder = base.join(&folder);
        }
        address.to_string()
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), AddressError> {
        let wrong = |expected: &str| AddressError::Value {
            key: key.to_owned(),
            value: value.to_owned(),
            expected: expected.to_owned(),
        };
        let count = || value.parse::<u64>().map_err(|_not| wrong("a whole number, 0 or more"));
        let settings = &mut self.settings;
        match key {
            "camera" => value.clone_into(&mut self.camera),
            "action" => {
                let names = Action::ALL.map(Action::name).join(", ");
                settings.action = Action::by_name(value).ok_or_else(|| wrong(&names))?;
            }
            "subject" => settings.subject = count()?,
            "others" | "passers" => {
                let people = Some(count()?).filter(|people| *people <= Settings::MOST_OTHERS);
                let people = people.ok_or_else(|| wrong("0 to 4"))?;
                if key == "others" {
                    settings.others = people;
                } else {
                    settings.passers = people;
                }
            }
            "seed" => settings.seed = count()?,
            "frames" => self.n_frames = count()?.max(1),
            "backdrop" => settings.backdrop = Some(value.into()),
            "skew-ms" => {
                let skews = Settings::parse_skews_ms(value);
                settings.skews_ms = skews.ok_or_else(|| {
                    wrong("milliseconds of the cameras, -1000 to 1000, separated by commas")
                })?;
            }
            "rate" => {
                let rate: Option<f64> = value.parse().ok();
                let rate = rate.filter(|rate| (0.1..=1000.0).contains(rate));
                settings.rate_hz = rate.ok_or_else(|| wrong("0.1 to 1000 frames per second"))?;
            }
            _ => {
                let flaw = settings.flaws.by_name_mut(key);
                let flaw = flaw.ok_or_else(|| AddressError::Key {
                    key: key.to_owned(),
                })?;
                *flaw = value.parse().map_err(|_not| wrong("a number"))?;
            }
        }
        Ok(())
    }
}

impl std::fmt::Display for Address {
    /// Writes the address; flaws that are 0 are left out.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Settings {
            rig,
            subject,
            others,
            passers,
            action,
            seed,
            rate_hz,
            backdrop,
            mut flaws,
            skews_ms,
        } = self.settings.clone();
        let (camera, action, n_frames) = (&self.camera, action.name(), self.n_frames);
        write!(
            out,
            "{SCHEME}{rig}?camera={camera}&action={action}&subject={subject}&seed={seed}"
        )?;
        write!(out, "&rate={rate_hz}&frames={n_frames}")?;
        if others > 0 {
            write!(out, "&others={others}")?;
        }
        if passers > 0 {
            write!(out, "&passers={passers}")?;
        }
        if let Some(folder) = backdrop {
            write!(out, "&backdrop={}", folder.display())?;
        }
        if !skews_ms.is_empty() {
            let all: Vec<String> = skews_ms.iter().map(f64::to_string).collect();
            write!(out, "&skew-ms={}", all.join(","))?;
        }
        for name in Flaws::NAMES {
            if let Some(value) = flaws.by_name_mut(name).filter(|value| **value != 0.0) {
                write!(out, "&{name}={value}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn errors_of_invalid_scene_addresses_name_the_cause() {
        let cases = [
            ("http://x", "begins with synth://"),
            ("synth://nowhere?camera=0", "rig of the address"),
            ("synth://umpm", "names no camera"),
            ("synth://umpm?camera=l&camera=r", "repeats a key"),
            ("synth://umpm?camera=l&colour", "key=value"),
            ("synth://umpm?camera=l&actoin=walking", "unknown key"),
            ("synth://umpm?camera=l&others=5", "0 to 4"),
            ("synth://umpm?camera=l&action=flying", "walking, jogging"),
            ("synth://umpm?camera=l&seed=-1", "whole number"),
            ("synth://umpm?camera=l&rate=0", "frames per second"),
            ("synth://umpm?camera=l&noise=many", "a number"),
            ("synth://umpm?camera=l&drop=2", "flaw"),
            ("synth://umpm?camera=l&skew-ms=1,,2", "milliseconds"),
            ("synth://umpm?camera=l&skew-ms=NaN", "milliseconds"),
        ];
        for (text, expected) in cases {
            let error = Address::parse(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    #[test]
    fn every_flaw_has_a_key() {
        for name in Flaws::NAMES {
            assert!(Address::KEYS.contains(&name));
        }
    }

    /// Key-value pairs that are valid at any position, unless a key occurs twice.
    fn pair() -> impl Strategy<Value = String> {
        prop_oneof![
            "action=(walking|boxing|throw-catch)",
            "(subject|seed|frames)=[0-9]{1,12}",
            "rate=[1-9][0-9]{0,1}(\\.[0-9]{1,4})?",
            "backdrop=[a-z/. ]{1,8}",
            "(noise|blur|desync|calibration-degrees|calibration-mm)=[0-9](\\.[0-9]{1,6})?",
            "exposure=-?[1-7]",
            "drop=0(\\.[0-8])?",
            "skew-ms=-?[0-9]{1,2}(,[0-9]{1,2}(\\.[0-9])?){0,3}",
        ]
    }

    proptest! {
        /// The strategy generates only valid texts, in any spelling, because otherwise the assertion would not be reached.
        #[test]
        fn a_parsed_address_is_written_and_parsed_to_the_same(
            rig in "humaneva|umpm|ring:[1-9](:[2-9](\\.[0-9]{1,3})?)?|[a-z]{1,5}/[a-z]{1,5}\\.toml",
            camera in "[a-zA-Z0-9_]{1,4}", pairs in prop::collection::vec(pair(), 0..4),
        ) {
            let mut keys: Vec<&str> = pairs.iter().filter_map(|pair| pair.split('=').next()).collect();
            keys.sort_unstable();
            keys.dedup();
            let text = format!("synth://{rig}?camera={camera}&{}", pairs.join("&"));
            let parsed = Address::parse(&text);
            prop_assert_eq!(parsed.is_ok(), keys.len() == pairs.len(), "{}: {:?}", text, parsed);
            if let Ok(address) = parsed {
                prop_assert_eq!(Address::parse(&address.to_string()).unwrap(), address);
            }
        }

        #[test]
        fn no_text_panics(text in "(synth://)?[a-z:/0-9.]{0,12}[?]?[a-z=&0-9.-]{0,40}") {
            drop(Address::parse(&text));
        }

        #[test]
        fn a_written_address_is_read_back(
            subject: u64, seed: u64, action in 0..10_usize, n_frames in 1..u64::MAX,
            noise in 0.0..50.0, desync in 0.0..1.0, others in 0..5_u64, passers in 0..5_u64, n in 1_usize..60, radius in 2.0..50.0,
        ) {
            let it = Address {
                settings: Settings {
                    rig: RigChoice::Ring { n, radius, height: 1.5 },
                    subject,
                    others,
                    passers,
                    action: Action::ALL[action],
                    seed,
                    rate_hz: 29.97,
                    backdrop: Some("a folder/of it".into()),
                    flaws: Flaws { noise, desync_s: desync, ..Flaws::default() },
                    skews_ms: vec![noise, -desync],
                },
                camera: "c1".to_owned(),
                n_frames,
            };
            prop_assert_eq!(Address::parse(&it.to_string()).unwrap(), it);
        }
    }
}
