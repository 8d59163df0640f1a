//! Section `[fuse]` of a deployment file.

use std::path::PathBuf;

use consistency::Learned;
use multiview::{EnergyKind, Settings, SwitchBy};
use serde::{Deserialize, Serialize};
use viewquality::TrainingErrors;

/// The energy that ties the views together, and its optimiser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Which energy.
    pub energy: Energy,
    /// What the views of a frame are solved in.
    pub views: Views,
    /// What was learned about several views: tables, weights, thresholds, joints.
    pub consistency: Option<PathBuf>,
    /// The rig of that file whose pairs of cameras these are; tables go by angle without it.
    pub consistency_rig: Option<String>,
    /// Weight of the geometric term.
    pub alpha: Option<f64>,
    /// Weight of the part-type term.
    pub beta: Option<f64>,
    /// Distance beyond which the geometric term grows no more, cells.
    pub max_distance_cells: Option<f64>,
    /// Part-type tables, a pair of views each.
    pub compatibility: Vec<Compatibility>,
    /// Expected error above which a part is switched off.
    pub tau: Tau,
    /// Whose expected error counts, in the paper's energy.
    pub switch: Switch,
    /// Decide for every view whether it sees the person from behind.
    pub facing: bool,
    /// Most fusion processes; the pairs are dealt to them in turn.
    pub workers: usize,
    /// Most single-view solutions of a pair.
    pub max_iterations: usize,
    /// Mean movement below which a view counts as settled, pixels.
    pub epsilon_px: f64,
    /// Pairs of cameras to fuse, by name; all pairs if empty.
    pub pairs: Vec<[String; 2]>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            energy: Energy::Paper,
            views: Views::Pairs,
            consistency: None,
            consistency_rig: None,
            alpha: None,
            beta: None,
            max_distance_cells: None,
            compatibility: Vec::new(),
            tau: Tau::Named(TauName::None),
            switch: Switch::Either,
            facing: true,
            workers: 1,
            max_iterations: 12,
            epsilon_px: 0.1,
            pairs: Vec::new(),
        }
    }
}

impl Config {
    /// Most processes that have something to do: all views at once are one piece of work.
    pub fn most_workers(&self) -> usize {
        match self.views {
            Views::Pairs => self.workers,
            Views::All => 1,
        }
    }

    /// The settings of the optimiser.
    ///
    /// * `n_candidates`: most candidates that a view offers.
    /// * `frame_scale`: pixels of the frame per pixel of the footage, in which `tau` is given.
    /// * `learned`: the content of the file `consistency`; its weights are those of the paper's energy where this
    ///   says nothing else.
    pub fn settings(
        &self,
        n_candidates: usize,
        frame_scale: f32,
        learned: Option<&Learned>,
    ) -> Settings {
        let scaled = |px: Vec<f32>| px.into_iter().map(|it| it * frame_scale).collect();
        let (energy, defaults) = match self.energy {
            Energy::Paper => (EnergyKind::Paper, Settings::default()),
            Energy::Released => (EnergyKind::Released, Settings::released()),
        };
        let weights = learned.filter(|_| self.energy == Energy::Paper);
        let weights = weights.map(|it| it.weights);
        let defaults = match weights {
            None => defaults,
            Some(it) => Settings {
                alpha: it.alpha,
                beta: it.beta,
                max_distance_cells: it.max_distance_cells.unwrap_or(f64::INFINITY),
                ..defaults
            },
        };
        let is_learned = self.tau == Tau::Named(TauName::Learned);
        let tau_tenths = learned.filter(|_| is_learned);
        Settings {
            energy,
            alpha: self.alpha.unwrap_or(defaults.alpha),
            beta: self.beta.unwrap_or(defaults.beta),
            max_distance_cells: self
                .max_distance_cells
                .unwrap_or(defaults.max_distance_cells),
            max_iterations: self.max_iterations,
            epsilon_px: self.epsilon_px,
            tau_px: scaled(self.tau.px()),
            tau_tenths: tau_tenths.map_or_else(Vec::new, |it| it.tau_tenths.clone()),
            rescue_px: scaled(self.tau.rescue_px()),
            switch: match self.switch {
                Switch::Either => SwitchBy::Either,
                Switch::Support => SwitchBy::Support,
                Switch::Worse => SwitchBy::Worse,
            },
            facing: self.facing,
            n_candidates,
        }
    }
}

/// What the views of a frame are solved in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Pairs, whose poses are then combined, as in the paper.
    #[default]
    Pairs,
    /// All at once, every view supported by all others.
    All,
}

impl From<Views> for pipeline::Views {
    fn from(from: Views) -> Self {
        match from {
            Views::Pairs => Self::Pairs,
            Views::All => Self::All,
        }
    }
}

/// Which energy ties two views together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The paper's.
    #[default]
    Paper,
    /// What the authors' program computes.
    Released,
}

/// Whose expected error switches a part off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Switch {
    /// That of either view, as in the paper.
    #[default]
    Either,
    /// That of the view that supports the other.
    Support,
    /// The same, where it is also the worse of the two.
    Worse,
}

/// Thresholds of the expected error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"none\", \"learned\", \"humaneva\", \"humaneva-median\", \"umpm\", \"umpm-median\", \
                 one number per part, or { file = \"...\" }"
)]
pub enum Tau {
    /// Thresholds that are known by name.
    Named(TauName),
    /// Pixels of the footage, one per part.
    Given(Vec<f32>),
    /// The same from a file.
    File(TauFile),
}

/// A file with thresholds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TauFile {
    /// Numbers separated by white space or commas, pixels of the footage; `#` begins a comment.
    pub file: PathBuf,
}

/// Thresholds that are known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TauName {
    /// No part is ever switched off.
    #[serde(rename = "none")]
    None,
    /// Those of the file `consistency`, in tenths of the person's size.
    #[serde(rename = "learned")]
    Learned,
    /// Those of the authors' program for `HumanEva`: median training error plus inaccuracy.
    #[serde(rename = "humaneva")]
    HumanEva,
    /// The paper's rule for `HumanEva`: the median training error alone.
    #[serde(rename = "humaneva-median")]
    HumanEvaMedian,
    /// Those of the authors' program for UMPM.
    #[serde(rename = "umpm")]
    Umpm,
    /// The paper's rule for UMPM.
    #[serde(rename = "umpm-median")]
    UmpmMedian,
}

impl Tau {
    fn training(&self) -> Option<TrainingErrors> {
        let Self::Named(name) = self else {
            return None;
        };
        match name {
            TauName::None | TauName::Learned => None,
            TauName::HumanEva | TauName::HumanEvaMedian => Some(TrainingErrors::HUMANEVA),
            TauName::Umpm | TauName::UmpmMedian => Some(TrainingErrors::UMPM),
        }
    }

    /// The thresholds, pixels of the footage; empty if there are none, or if a file has them that is
    /// still to be read.
    pub fn px(&self) -> Vec<f32> {
        let Some(errors) = self.training() else {
            return match self {
                Self::Given(px) => px.clone(),
                Self::Named(_) | Self::File(_) => Vec::new(),
            };
        };
        let is_median = matches!(
            self,
            Self::Named(TauName::HumanEvaMedian | TauName::UmpmMedian)
        );
        let tau = if is_median {
            viewquality::Tau::median_only(&errors)
        } else {
            viewquality::Tau::median_and_inaccuracy(&errors)
        };
        tau.px().to_vec()
    }

    /// The median training errors, by which the released energy takes one of two switched-off views
    /// back; empty if they are not known.
    fn rescue_px(&self) -> Vec<f32> {
        self.training()
            .map_or_else(Vec::new, |it| it.median_px.to_vec())
    }
}

/// The part-type tables of one pair of views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compatibility {
    /// The two cameras, by name.
    pub views: [String; 2],
    /// `[first with respect to second, second with respect to first]`: rows are the types of the
    /// first-named view of each.
    pub files: [PathBuf; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_optimiser() {
        let expected = Settings::default();
        assert_eq!(
            Config::default().settings(expected.n_candidates, 1.0, None),
            expected
        );
    }

    #[test]
    fn the_papers_rule_is_the_median_alone() {
        let px = |name| Tau::Named(name).px();
        assert_eq!(
            px(TauName::HumanEvaMedian),
            TrainingErrors::HUMANEVA.median_px
        );
        assert_eq!(px(TauName::UmpmMedian), TrainingErrors::UMPM.median_px);
        assert!(px(TauName::Umpm)[0] > px(TauName::UmpmMedian)[0]);
        assert!(px(TauName::None).is_empty());
    }

    #[test]
    fn the_released_energy_has_its_own_weight() {
        let config = Config {
            energy: Energy::Released,
            ..Config::default()
        };
        assert_eq!(
            config.settings(1, 1.0, None).alpha,
            Settings::released().alpha
        );
    }
}
