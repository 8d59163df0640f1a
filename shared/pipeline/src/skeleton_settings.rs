//! The settings of the skeleton step.

use std::sync::Arc;

use multiview::{ConsensusSettings, FacingSettings, SidesSettings};
use skeleton::{JointMap, JointSet, PARSE14};

/// How the pose of a view is computed from the poses of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combine {
    /// The mean of the poses: the paper's section 7.
    #[default]
    Mean,
    /// For every part, the result that is consistent over all views ([`multiview::consensus()`]).
    Consensus,
}

/// How knowledge about human bodies is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySettings {
    /// Leave out joints and skeletons that no body can have.
    pub check: bool,
    /// Move joints so that the bones have the lengths of people: a prior in triangulation.
    pub prior: bool,
    /// Let the prior learn this person's bone lengths from the earlier frames.
    pub learn: bool,
    /// Weight of the deviation of a skeleton from a human body when one of several assumptions is chosen: score per squared standard
    /// deviation ([`skeleton::body::deviation`]).
    pub score: f64,
}

impl BodySettings {
    /// Uses no knowledge about bodies: for models of something other than people.
    pub const NONE: Self = Self {
        check: false,
        prior: false,
        learn: false,
        score: 0.0,
    };
}

impl Default for BodySettings {
    fn default() -> Self {
        Self {
            check: true,
            prior: true,
            learn: true,
            score: 0.02,
        }
    }
}

/// Settings of the skeleton step.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonSettings {
    /// The joints to triangulate.
    pub joints: &'static JointSet,
    /// Learned map from parts to these joints; without a map, a joint is the mean of its own parts.
    pub joint_map: Option<Arc<JointMap>>,
    /// Settings of triangulation.
    pub triangulation: geometry::Settings,
    /// Uncertainty of a joint in one view, in cells of the level on which the view was fused.
    pub sigma_cells: f64,
    /// Weight of the predicted errors of a joint's parts, if available; they are added
    /// to `sigma_cells` as variances. 0 ignores them.
    pub error_weight: f64,
    /// How the pose of a view is computed from the poses of its pairs.
    pub combine: Combine,
    /// Settings for the agreement of the views on a part. The decision about facing always uses the consensus: a mean
    /// of poses with different limbs is inconsistent under every assumption about left and right.
    pub consensus: ConsensusSettings,
    /// How knowledge about human bodies is used.
    pub body: BodySettings,
    /// Decide which views see the person from behind.
    pub facing: bool,
    /// Settings for tracking over time which views see the person from the same side.
    pub facing_filter: FacingSettings,
    /// How left and right of all views together are decided.
    pub sides: SidesSettings,
    /// Weight of the agreement of all views in the decision about facing: score per squared cell of
    /// distance between a part and its reprojection. This is the geometric term over all views.
    pub agreement: f64,
    /// Weight of the views' front evidence in the decision about facing: score per nat. If the evidence fits neither the sides of a
    /// skeleton nor the exchanged sides, some views are assumed to be on the wrong side.
    pub front_score: f64,
    /// Distance at which the penalty for disagreement is capped, in cells.
    pub max_distance_cells: f64,
}

impl Default for SkeletonSettings {
    fn default() -> Self {
        Self {
            joints: &PARSE14,
            joint_map: None,
            triangulation: geometry::Settings::default(),
            sigma_cells: 1.0,
            error_weight: 1.0,
            combine: Combine::default(),
            consensus: ConsensusSettings::default(),
            body: BodySettings::default(),
            facing: true,
            facing_filter: FacingSettings::default(),
            sides: SidesSettings::default(),
            agreement: 0.01,
            front_score: 0.5,
            max_distance_cells: 3.0,
        }
    }
}
