//! Settings for training a model.

use fmp::Model;
use serde::{Deserialize, Serialize};

/// All settings of a training run, except the data.
///
/// The defaults are those of Yang & Ramanan 2013, where known. The exceptions are `symmetric` and the settings
/// that limit memory and time (`per_image`, `room`, `cache_mib`, `batch`, `passes`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    /// Number of types of every part (6: Yang & Ramanan 2013).
    pub n_types: usize,
    /// Offsets by which the parts are clustered into types.
    pub types_by: TypesBy,
    /// True if the types, filters, springs and biases of the left side of the body are the mirror image of those of the right side. Only
    /// valid if the training set contains the mirror images.
    pub symmetric: bool,
    /// Number of random starts of every clustering; the tightest result is used.
    pub cluster_starts: usize,
    /// Side of a feature cell, in pixels of its level.
    pub cell_px: usize,
    /// Largest side of the filters, in cells; the filters are smaller if the people are small.
    pub max_filter_cells: usize,
    /// Levels per octave of the pyramid for which the model is trained.
    pub interval: usize,
    /// Levels per octave on which images without people are searched.
    pub mining_interval: usize,
    /// Cost per unit by which a negative scores above -1 (the `C` of the machine).
    pub cost: f64,
    /// Cost per unit by which a person scores below 1, as a multiple of the cost of a negative.
    pub positive_weight: f64,
    /// Cost of a wrong pose that scores as well as the right pose of the same person, as a multiple of the cost of a negative. The value 0
    /// turns these examples off, as in Yang & Ramanan 2013.
    pub pose_weight: f64,
    /// Margin between the right pose and a pose with all parts wrong.
    pub pose_margin: f64,
    /// Minimum intersection over union of a placed part's box with the marked box.
    pub overlap: f64,
    /// Duality gap at which the machine stops, as a share of its objective.
    pub tolerance: f64,
    /// Memory for the examples and their features, in MiB. Examples that the solution needs are kept even
    /// if they take more.
    pub cache_mib: usize,
    /// A negative is removed from the working set if it exceeds its margin by more than this value.
    pub room: f64,
    /// Maximum number of negatives that are added from one image at a time, those with the highest scores first.
    pub per_image: usize,
    /// Number of background images that are searched before the machine is solved again.
    pub batch: usize,
    /// Number of rounds in which every part keeps the type of its cluster.
    pub fixed_rounds: usize,
    /// Number of later rounds in which the model chooses the types.
    pub latent_rounds: usize,
    /// Number of passes over all background images in each round.
    pub passes: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// The offsets that define the types of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TypesBy {
    /// The offset from the parent; for the root, the offset from its first child (Yang & Ramanan 2013).
    Parent,
    /// The offsets from the parent and from all children (the 2014 release).
    Neighbours,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            n_types: 6,
            types_by: TypesBy::Parent,
            symmetric: true,
            cluster_starts: 100,
            cell_px: 4,
            max_filter_cells: 5,
            interval: 10,
            mining_interval: 2,
            cost: 0.002,
            positive_weight: 2.0,
            pose_weight: 0.3,
            pose_margin: 1.0,
            overlap: 0.6,
            tolerance: 0.05,
            cache_mib: 2048,
            room: 0.05,
            per_image: 200,
            batch: 128,
            fixed_rounds: 1,
            latent_rounds: 1,
            passes: 3,
            seed: 1,
        }
    }
}

/// A setting out of range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{key} is {got}, expected {min} to {max}")]
pub struct SettingsError {
    /// Key of the setting.
    pub key: &'static str,
    /// Value of the setting.
    pub got: f64,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

impl Settings {
    /// Checks that every setting is in its range.
    ///
    /// # Errors
    ///
    /// Fails with [`SettingsError`], for the first setting out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        const LEAST: f64 = 1e-12;
        const MOST: f64 = 1e12;
        let (most_types, most_cells) = (Model::MAX_TYPES as f64, Model::MAX_FILTER as f64);
        let limits = [
            ("n-types", self.n_types as f64, 1.0, most_types),
            ("cluster-starts", self.cluster_starts as f64, 1.0, 1e6),
            ("cell-px", self.cell_px as f64, 2.0, 64.0),
            (
                "max-filter-cells",
                self.max_filter_cells as f64,
                3.0,
                most_cells,
            ),
            ("interval", self.interval as f64, 1.0, 64.0),
            ("mining-interval", self.mining_interval as f64, 1.0, 64.0),
            ("cost", self.cost, LEAST, MOST),
            ("positive-weight", self.positive_weight, LEAST, MOST),
            ("pose-weight", self.pose_weight, 0.0, MOST),
            ("pose-margin", self.pose_margin, 0.0, MOST),
            ("overlap", self.overlap, 0.01, 0.99),
            ("tolerance", self.tolerance, 0.0, 1.0),
            ("cache-mib", self.cache_mib as f64, 1.0, 1e6),
            ("room", self.room, 0.0, MOST),
            ("per-image", self.per_image as f64, 1.0, 1e6),
            ("batch", self.batch as f64, 1.0, 1e9),
            ("fixed-rounds", self.fixed_rounds as f64, 0.0, 1e3),
            ("latent-rounds", self.latent_rounds as f64, 0.0, 1e3),
            ("passes", self.passes as f64, 0.0, 1e3),
        ];
        for (key, got, min, max) in limits {
            if !(min..=max).contains(&got) {
                return Err(SettingsError { key, got, min, max });
            }
        }
        Ok(())
    }
}
