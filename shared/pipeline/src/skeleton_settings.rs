//! The settings of the skeleton step.

use std::sync::Arc;

use multiview::{ConsensusSettings, FacingSettings, SidesSettings};
use skeleton::{JointMap, JointSet, PARSE14};

/// How the pose of a view is made from the poses of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Combine {
    /// Their mean: the paper's section 7.
    #[default]
    Mean,
    /// For every part the result that is consistent over all views ([`multiview::consensus()`]).
    Consensus,
}

/// Uses of the knowledge of bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySettings {
    /// Leave out joints, and skeletons, that no body has.
    pub check: bool,
    /// Move joints to where the bones have the lengths of people: a prior in triangulation.
    pub prior: bool,
    /// The prior knows the lengths that this person's bones had in the frames before.
    pub learn: bool,
    /// Weight of how unlike a person a skeleton is, in the choice among assumptions: score per squared standard
    /// deviation ([`skeleton::body::deviation`]).
    pub score: f64,
}

impl BodySettings {
    /// Nothing is known: for models of something else than people.
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
    /// Which joints to triangulate.
    pub joints: &'static JointSet,
    /// Learned map from parts to these joints; without it a joint is the mean of its own parts.
    pub joint_map: Option<Arc<JointMap>>,
    /// How to triangulate.
    pub triangulation: geometry::Settings,
    /// Uncertainty of a joint in one view, cells of the level on which it was fused.
    pub sigma_cells: f64,
    /// Weight of the expected errors of a joint's parts, where they were predicted; they are added
    /// to `sigma_cells` as variances. 0: not used.
    pub error_weight: f64,
    /// How the pose of a view is made from the poses of its pairs.
    pub combine: Combine,
    /// How the views agree on a part. The decision about facing always uses the consensus: a mean
    /// of poses with different limbs is consistent under no assumption about left and right.
    pub consensus: ConsensusSettings,
    /// Uses of the knowledge of bodies.
    pub body: BodySettings,
    /// Decide which views see the person from behind.
    pub facing: bool,
    /// How it is tracked over time which views see the person from the same side.
    pub facing_filter: FacingSettings,
    /// How left and right of all views together are decided.
    pub sides: SidesSettings,
    /// Weight of the agreement of all views in the decision about facing: score per squared cell of
    /// distance between a part and its reprojection. It is the geometric term over all views.
    pub agreement: f64,
    /// Weight of what the views see of the front in that decision: score per nat. A skeleton whose sides fit
    /// none of what the views see is one with views on the wrong side.
    pub front_score: f64,
    /// Distance at which the penalty for disagreement is capped, cells.
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
