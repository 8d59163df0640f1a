//! Marker tables: the conversion of the markers of a file to joints.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use skeleton::PARSE14;

use super::MotionError;
use super::presets::preset;

const TOES: [&str; 2] = ["right toes", "left toes"];

/// Converts the markers of a file to joints, which are sums of markers with weights that add up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerTable {
    up: Axis,
    unit_metres: Option<f64>,
    joints: BTreeMap<String, Vec<(String, f64)>>,
}

/// Content of a table's file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// The axis of the motion file that points up.
    up: Axis,
    /// The unit of the motion file, for files with a missing or wrong unit.
    #[serde(default)]
    unit: Option<String>,
    joints: BTreeMap<String, Markers>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Axis {
    X,
    Y,
    Z,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "a list of markers, or markers with weights")]
enum Markers {
    Mean(Vec<String>),
    Sum(BTreeMap<String, f64>),
}

impl MarkerTable {
    /// Returns one of [`PRESETS`](super::PRESETS).
    pub fn preset(name: &str) -> Option<Self> {
        Self::parse(preset(name)?).ok()
    }

    /// Reads the file of a table.
    ///
    /// # Errors
    ///
    /// Fails with [`MotionError::Io`] or [`MotionError::Table`].
    pub fn read(path: &Path) -> Result<Self, MotionError> {
        let text = std::fs::read_to_string(path).map_err(|source| MotionError::Io {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text).map_err(|what| MotionError::Table {
            path: path.to_owned(),
            what,
        })
    }

    /// Parses the text of a table; the error describes what is wrong.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
        let unit_metres = match &file.unit {
            None => None,
            Some(unit) => Some(metres_per(unit).ok_or(format!("unit {unit:?} is not known"))?),
        };
        let known = PARSE14.joints.iter().map(|joint| joint.name);
        let missing = known.clone().find(|joint| !file.joints.contains_key(*joint));
        if let Some(joint) = missing {
            return Err(format!("no markers are given for the joint {joint:?}"));
        }
        let mut joints = BTreeMap::new();
        for (joint, markers) in file.joints {
            if !known.clone().chain(TOES).any(|known| known == joint) {
                return Err(format!("{joint:?} is not a joint"));
            }
            let weights = weights(markers).map_err(|error| format!("{joint:?}: {error}"))?;
            joints.insert(joint, weights);
        }
        if joints.contains_key(TOES[0]) != joints.contains_key(TOES[1]) {
            return Err("only one foot has toes".to_owned());
        }
        Ok(Self {
            up: file.up,
            unit_metres,
            joints,
        })
    }

    /// The markers of a joint with their weights.
    pub(super) fn joint(&self, name: &str) -> Option<&[(String, f64)]> {
        self.joints.get(name).map(Vec::as_slice)
    }

    /// The markers of all joints; the same marker may occur several times.
    pub(super) fn markers(&self) -> impl Iterator<Item = &str> {
        self.joints.values().flatten().map(|value| value.0.as_str())
    }

    pub(super) fn has_toes(&self) -> bool {
        self.joints.contains_key(TOES[0])
    }

    pub(super) fn unit_metres(&self) -> Option<f64> {
        self.unit_metres
    }

    /// Rotates a point of the file to z up. The axes are permuted cyclically, so that nothing is mirrored.
    pub(super) fn upright(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self.up {
            Axis::X => [y, z, x],
            Axis::Y => [z, x, y],
            Axis::Z => [x, y, z],
        }
    }
}

fn weights(markers: Markers) -> Result<Vec<(String, f64)>, String> {
    let weights: Vec<(String, f64)> = match markers {
        Markers::Mean(names) => {
            let share = 1.0 / names.len() as f64;
            names.into_iter().map(|name| (name, share)).collect()
        }
        Markers::Sum(weights) => weights.into_iter().collect(),
    };
    let sum: f64 = weights.iter().map(|weight| weight.1).sum();
    if (sum - 1.0).abs() > 1e-6 || weights.iter().any(|weight| !weight.1.is_finite()) {
        return Err(format!("the weights add up to {sum}, not to 1"));
    }
    Ok(weights)
}

/// Length in metres of the unit with this name.
pub(super) fn metres_per(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "mm" => Some(0.001),
        "cm" => Some(0.01),
        "dm" => Some(0.1),
        "m" => Some(1.0),
        "in" => Some(0.0254),
        _ => None,
    }
}
