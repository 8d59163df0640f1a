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
    /// For every part, the result that is consistent across all views ([`multiview::consensus()`]).
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
    /// Weight of a skeleton's deviation from a human body, when one of several assumptions is chosen: score per squared standard deviation
    /// ([`skeleton::body::deviation`]).
    pub score: f64,
}

impl BodySettings {
    /// Settings that use no knowledge about bodies, for models of something other than people.
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
    /// Weight of the predicted errors of a joint's parts, if they are available. The weighted errors are added to `sigma_cells` as
    /// variances; 0 ignores them.
    pub error_weight: f64,
    /// How the pose of a view is computed from the poses of its pairs.
    pub combine: Combine,
    /// Settings for the agreement of the views on a part. The decision about which views see the person from behind always uses the
    /// consensus, because the mean of poses that confuse limbs is inconsistent under every assumption about left and right.
    pub consensus: ConsensusSettings,
    /// How knowledge about human bodies is used.
    pub body: BodySettings,
    /// If true, decide which views see the person from behind.
    pub facing: bool,
    /// Settings for tracking over time which views see the person from the same side.
    pub facing_filter: FacingSettings,
    /// Settings for deciding left and right for all views together.
    pub sides: SidesSettings,
    /// Weight of the agreement of all views in the decision about which views see the person from behind: score per squared cell of
    /// distance between a part and its reprojection. This is the geometric term over all views.
    pub agreement: f64,
    /// Weight of the views' evidence of the direction in which the person faces, in the decision about which views see the person from
    /// behind: score per nat. If the evidence fits neither the labels of a skeleton nor the swapped labels, left and right are assumed to
    /// be wrong in some views.
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
