//! The file beside a model with the learned consistency parameters.

use std::sync::Arc;

use crate::{AngleTables, TypeTables};
use serde::{Deserialize, Serialize};
use skeleton::{JointMap, JointSet};

use crate::learned::counts::{Appearance, Counts, Shape, marginals};

/// The format name of a consistency file.
const FORMAT: &str = "parallax-consistency";
/// The version that is written, and the only version that can be read.
const VERSION: u32 = 1;
/// Maximum number of bins of half the circle.
const MAX_BINS: usize = 180;
/// The expected size of tables, for error messages.
const SIZED: &str =
    "a matrix of counts for every part, with the size given by the numbers of types";

/// The consistency parameters of one model.
///
/// The file is a single JSON object; all fields are required, and unknown fields are rejected.
///
/// | field | content |
/// |---|---|
/// | `format`, `version` | `"parallax-consistency"`, 1 |
/// | `model` | `fingerprint` (16 hexadecimal digits, FNV-1a of the model file) and `shape`: `n_types` of every part, `mirror` of every part, from 0 |
/// | `learned` | number of `instants` and `views` used for learning, and number of held-out instants |
/// | `weights` | `alpha`, `beta`, `max_distance_cells` (or null: no cap), `appearance`: `"joint"` or `"lift"` |
/// | `tau_tenths` | median error of every part in the single view, in tenths of the person's size |
/// | `smoothing` | number of observations of independent types that are added to every table |
/// | `ring` | tables by angle: entry `i` of `n` for angles from `i` to `i + 1` times `180 / n` degrees, from the first view to the second counter-clockwise as seen from above; [`Counts`] |
/// | `rigs` | `name` and `pairs` of every rig that was learned by name: `cameras` (two names), `counts` |
/// | `joints` | `set` (`parse14`, `umpm15`, `humaneva20`) and `weights`: a row of as many numbers as the model has parts for every joint; empty if nothing was learned |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// The format name, `parallax-consistency`.
    pub format: String,
    /// The format version, 1.
    pub version: u32,
    /// The model to which the file belongs.
    pub model: ModelOf,
    /// The amount of training data.
    pub learned: LearnedFrom,
    /// Weights of the terms.
    pub weights: Weights,
    /// Thresholds of the expected error, one per part, in tenths of the person's size.
    pub tau_tenths: Vec<f32>,
    /// Observations of independent types that are added to every table.
    pub smoothing: f64,
    /// Tables by angle.
    pub ring: Vec<Counts>,
    /// Tables by rig name.
    pub rigs: Vec<NamedRig>,
    /// Maps from parts to joints.
    pub joints: Vec<JointWeights>,
}

/// The model to which the types belong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelOf {
    /// Fingerprint of the model file.
    pub fingerprint: String,
    /// Parts and types of the model.
    pub shape: Shape,
}

/// The amount of training data.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedFrom {
    /// Number of instants.
    pub instants: u64,
    /// Number of pictures of these instants.
    pub views: u64,
    /// Number of held-out instants on which the weights were chosen.
    pub held_out: u64,
}

/// The weights of the terms between views.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// Weight of the geometric term; score per squared cell.
    pub alpha: f64,
    /// Weight of the appearance term.
    pub beta: f64,
    /// Distance at which the geometric term is capped, in cells.
    pub max_distance_cells: Option<f64>,
    /// The values of the appearance term.
    pub appearance: Appearance,
}

impl Default for Weights {
    /// Returns the weights of `crate::Settings`.
    fn default() -> Self {
        let settings = crate::Settings::default();
        let cap = settings.max_distance_cells;
        Self {
            alpha: settings.alpha,
            beta: settings.beta,
            max_distance_cells: cap.is_finite().then_some(cap),
            appearance: Appearance::Joint,
        }
    }
}

/// Tables of the pairs of cameras of one rig.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedRig {
    /// Name of the rig.
    pub name: String,
    /// Pairs of cameras of the rig.
    pub pairs: Vec<NamedPair>,
}

/// Tables of one pair of cameras.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedPair {
    /// Names of the two cameras.
    pub cameras: [String; 2],
    /// Counts of the pair.
    pub counts: Counts,
}

/// The linear map from parts to the joints of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointWeights {
    /// Name of the set.
    pub set: String,
    /// One row for each joint, with one number for each part.
    pub weights: Vec<Vec<f64>>,
}

/// Reason why a text was rejected as a consistency file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The text is not JSON with the expected fields.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// The text has another format or another version.
    #[error("`{format}` version {version}, expected `{FORMAT}` version {VERSION}")]
    Version {
        /// Format name in the text.
        format: String,
        /// Version in the text.
        version: u32,
    },
    /// A value is out of range or has the wrong size.
    #[error("`{field}` is not {expected}")]
    Value {
        /// Name of the field.
        field: String,
        /// The expected value.
        expected: &'static str,
    },
    /// The file was learned for another model.
    #[error(
        "the file was learned for a model with {got:?} types per part, but this model has {expected:?}"
    )]
    Model {
        /// Number of types of every part in the file.
        got: Vec<usize>,
        /// Number of types of every part in the model.
        expected: Vec<usize>,
    },
}

impl Learned {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// [`FileError`], naming the field.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        let head: Head = serde_json::from_str(text)?;
        if head.format != FORMAT || head.version != VERSION {
            return Err(FileError::Version {
                format: head.format.chars().take(32).collect(),
                version: head.version,
            });
        }
        let read: Self = serde_json::from_str(text)?;
        read.check()?;
        Ok(read)
    }

    /// Writes the text that [`Self::parse`] reads.
    ///
    /// # Errors
    ///
    /// [`FileError::Json`] for numbers that JSON cannot represent.
    pub fn write(&self) -> Result<String, FileError> {
        Ok(serde_json::to_string(self)? + "\n")
    }

    /// Format name and version of a new file.
    pub(crate) fn head() -> (String, u32) {
        (FORMAT.to_owned(), VERSION)
    }

    /// Checks that the file belongs to a model.
    ///
    /// # Errors
    ///
    /// [`FileError::Model`].
    pub fn check_model(&self, shape: &Shape) -> Result<(), FileError> {
        if self.model.shape == *shape {
            return Ok(());
        }
        Err(FileError::Model {
            got: self.model.shape.n_types.clone(),
            expected: shape.n_types.clone(),
        })
    }

    /// Returns the tables for any pair of cameras.
    pub fn by_angle(&self, appearance: Appearance) -> AngleTables {
        let marginals = self.marginals();
        let tables = |counts: &Counts| {
            (counts.total() > 0).then(|| self.tables(counts, &marginals, appearance))
        };
        let half = self.ring.iter().map(tables).collect();
        AngleTables::new(half, &self.model.shape.mirror)
    }

    /// Returns the tables of the cameras of a rig that was learned by name, as pairs of camera indices, the smaller index first.
    ///
    /// * Returns `None` if no rig of that name was learned.
    pub fn of_rig(
        &self,
        name: &str,
        cameras: &[&str],
        appearance: Appearance,
    ) -> Option<Vec<(usize, usize, TypeTables)>> {
        let marginals = self.marginals();
        let rig = self.rigs.iter().find(|rig| rig.name == name)?;
        let index = |name: &String| cameras.iter().position(|camera| camera == name);
        let pair = |pair: &NamedPair| {
            let [first, second] = [index(&pair.cameras[0])?, index(&pair.cameras[1])?];
            let tables = self.tables(&pair.counts, &marginals, appearance);
            Some(if first < second {
                (first, second, tables)
            } else {
                (second, first, tables.reversed(&self.model.shape.mirror))
            })
        };
        Some(rig.pairs.iter().filter_map(pair).collect())
    }

    /// Returns the map from parts to the joints of a set, if one was learned.
    pub fn joint_map(&self, set: &JointSet) -> Option<Arc<JointMap>> {
        let found = self.joints.iter().find(|joint| joint.set == set.name)?;
        JointMap::new(found.weights.clone()).map(Arc::new)
    }

    fn tables(
        &self,
        counts: &Counts,
        marginals: &[Vec<f64>],
        appearance: Appearance,
    ) -> TypeTables {
        counts.tables(&self.model.shape, marginals, self.smoothing, appearance)
    }

    fn marginals(&self) -> Vec<Vec<f64>> {
        let named = self.rigs.iter().flat_map(|rig| &rig.pairs);
        let all = self.ring.iter().chain(named.map(|named| &named.counts));
        marginals(&self.model.shape, &all.collect::<Vec<_>>())
    }

    fn check(&self) -> Result<(), FileError> {
        let shape = &self.model.shape;
        let n_parts = shape.n_types.len();
        let types = shape.n_types.iter().all(|kind| (1..=255).contains(kind));
        demand(
            types && (1..=255).contains(&n_parts),
            "model.shape.n_types",
            "a list of 1 to 255 parts with 1 to 255 types each",
        )?;
        let back = |(part, other): (usize, &usize)| shape.mirror.get(*other) == Some(&part);
        let mirror = shape.mirror.len() == n_parts && shape.mirror.iter().enumerate().all(back);
        demand(
            mirror,
            "model.shape.mirror",
            "a list of mutual mirror parts, one for every part",
        )?;
        let it = &self.weights;
        demand(
            in_range(it.alpha),
            "weights.alpha",
            "a number of at least 0",
        )?;
        demand(in_range(it.beta), "weights.beta", "a number of at least 0")?;
        let cap = it.max_distance_cells.is_none_or(|value| value.is_finite() && value > 0.0);
        demand(
            cap,
            "weights.max_distance_cells",
            "null or a number above 0",
        )?;
        let smoothing = self.smoothing.is_finite() && self.smoothing > 0.0;
        demand(smoothing, "smoothing", "a number above 0")?;
        let tau = self.tau_tenths.len() == n_parts
            && self
                .tau_tenths
                .iter()
                .all(|tau_tenth| tau_tenth.is_finite() && *tau_tenth >= 0.0);
        demand(tau, "tau_tenths", "a number of at least 0 for every part")?;
        self.check_tables()?;
        self.check_joints(n_parts)
    }

    fn check_tables(&self) -> Result<(), FileError> {
        let shape = &self.model.shape;
        demand(
            (1..=MAX_BINS).contains(&self.ring.len()),
            "ring",
            "1 to 180 bins",
        )?;
        for (bin, counts) in self.ring.iter().enumerate() {
            demand(counts.fits(shape), &format!("ring[{bin}]"), SIZED)?;
        }
        for (nth, rig) in self.rigs.iter().enumerate() {
            let others = &self.rigs[..nth];
            let is_new = others.iter().all(|other| other.name != rig.name);
            demand(
                is_new,
                &format!("rigs[{nth}].name"),
                "different from the preceding names",
            )?;
            for (pair, it) in rig.pairs.iter().enumerate() {
                let field = format!("rigs[{nth}].pairs[{pair}]");
                demand(it.counts.fits(shape), &field, SIZED)?;
                demand(it.cameras[0] != it.cameras[1], &field, "for two cameras")?;
            }
        }
        Ok(())
    }

    fn check_joints(&self, n_parts: usize) -> Result<(), FileError> {
        for (nth, joints) in self.joints.iter().enumerate() {
            let field = format!("joints[{nth}]");
            let Some(set) = JointSet::by_name(&joints.set) else {
                return demand(false, &field, "of `parse14`, `umpm15` or `humaneva20`");
            };
            let is_row = |row: &Vec<f64>| {
                let sum: f64 = row.iter().sum();
                row.len() == n_parts
                    && row.iter().all(|value| value.abs() < 100.0)
                    && (sum - 1.0).abs() < 1e-3
            };
            let rows =
                joints.weights.len() == set.joints.len() && joints.weights.iter().all(is_row);
            demand(
                rows,
                &field,
                "a row of weights with the sum 1 for every joint",
            )?;
        }
        Ok(())
    }
}

#[derive(Deserialize)]
struct Head {
    format: String,
    version: u32,
}

fn demand(holds: bool, field: &str, expected: &'static str) -> Result<(), FileError> {
    if holds {
        return Ok(());
    }
    let field = field.to_owned();
    Err(FileError::Value { field, expected })
}

fn in_range(weight: f64) -> bool {
    weight.is_finite() && weight >= 0.0
}
