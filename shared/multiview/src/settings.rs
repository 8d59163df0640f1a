//! Settings of fusion.

use std::sync::Arc;

use crate::Compatibility;

/// The energy of the terms between two views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EnergyKind {
    /// The paper's energy: squared point-to-line distances in both directions, and a joint type table. A part is switched off if its
    /// expected error in either view is too large (see [`SwitchBy`]).
    #[default]
    Paper,
    /// The energy of the authors' program: normalised heat maps and conditional type tables. A part is switched off if its expected error
    /// in the supporting view is too large.
    Released,
}

/// The expected error that can switch the terms of a part off, in the paper's energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SwitchBy {
    /// The error of either view: the paper's eq. 6.
    #[default]
    Either,
    /// The error of the support alone, as in the authors' program: a reliable view continues to correct an unreliable one, but is not
    /// changed by it. Each view then has its own energy. The energy of a pair is the mean of the two, and may fall during the optimisation.
    Support,
    /// The error of the support, but only if the support is the worse of the two views (each error relative to its threshold). The better
    /// of two unreliable views continues to support the other, so that the views still support each other if large errors are expected
    /// everywhere. Energies are defined as for [`Self::Support`].
    Worse,
}

/// The part-type tables of one pair of views.
#[derive(Debug, Clone, PartialEq)]
pub struct TypeTables {
    /// The tables `p(type in second | type in first)` and the reverse, for [`EnergyKind::Released`].
    pub conditional: [Arc<Compatibility>; 2],
    /// The table `p(type in first, type in second)`, or another value for each pair of types, for
    /// [`EnergyKind::Paper`].
    pub joint: Arc<Compatibility>,
    /// Joint table for two views from opposite sides of the person. Rows are types of the first view's part; columns are types of the
    /// second view's part that shows the same limb. If `None`, such views have no appearance term.
    pub exchanged: Option<Arc<Compatibility>>,
}

impl TypeTables {
    /// Returns the tables of the same views in the opposite order.
    ///
    /// * `mirror`: for every part, the part on the other side; the parts themselves if the model has no sides.
    #[must_use]
    pub fn reversed(&self, mirror: &[usize]) -> Self {
        let [first, second] = &self.conditional;
        Self {
            conditional: [Arc::clone(second), Arc::clone(first)],
            joint: Arc::new(self.joint.transposed()),
            exchanged: self
                .exchanged
                .as_ref()
                .map(|table| Arc::new(table.transposed().permuted(mirror))),
        }
    }
}

/// Settings of the optimiser.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The kind of energy.
    pub energy: EnergyKind,
    /// Weight of the geometric term.
    ///
    /// `Paper`: score per squared cell. Distances are divided by the cell size of the pose's own level before they are squared. The weight
    /// then has the same effect for near and far people and at every resolution, and can be compared with the springs of the model (the
    /// weakest of which is 0.01 per squared cell). `Released`: score of a cell on the epipolar line; 0.07 in the authors' runs.
    pub alpha: f64,
    /// Weight of the appearance term: score of two types that always occur together.
    pub beta: f64,
    /// Distance at which the geometric term of the paper's energy is capped, in cells. Infinity gives the
    /// paper's own form.
    pub max_distance_cells: f64,
    /// Maximum number of single-view solutions of a pair.
    pub max_iterations: usize,
    /// Mean movement of the part centres, in pixels, below which a view counts as converged.
    pub epsilon_px: f64,
    /// Expected error above which a part is switched off, in pixels of the frame, one per part; if empty,
    /// no part is switched off.
    pub tau_px: Vec<f32>,
    /// The expected error that switches a part off.
    pub switch: SwitchBy,
    /// The same thresholds as `tau_px`, but in tenths of the person's size in the view; used if `tau_px` is empty. The size is the longer
    /// side of the rectangle around the part centres of the view's best pose.
    pub tau_tenths: Vec<f32>,
    /// `Released` only: minimum difference of the expected errors, in pixels, one per part (the median training errors). If both views are
    /// off and their errors differ by at least this much, the better one is switched on again. If empty, no view is switched on again.
    pub rescue_px: Vec<f32>,
    /// Decide for every view whether left and right are swapped; the paper does not do this.
    pub facing: bool,
    /// Maximum number of candidates per view that the start may combine; 1 is the paper's start.
    pub n_candidates: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            energy: EnergyKind::Paper,
            alpha: 0.002,
            beta: 0.03,
            max_distance_cells: f64::INFINITY,
            max_iterations: 12,
            epsilon_px: 0.1,
            tau_px: Vec::new(),
            switch: SwitchBy::default(),
            tau_tenths: Vec::new(),
            rescue_px: Vec::new(),
            facing: true,
            n_candidates: 8,
        }
    }
}

impl Settings {
    /// Returns the settings of the authors' runs: their energy, weights and start.
    pub fn released() -> Self {
        Self {
            energy: EnergyKind::Released,
            alpha: 0.07,
            facing: false,
            n_candidates: 1,
            ..Self::default()
        }
    }
}
