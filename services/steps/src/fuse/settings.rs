//! Converts the section `[paper]` of a deployment to the settings of the optimiser.

use deployment::Views;
use deployment::paper::{Config, Energy, Switch, Tau, TauName};
use deployment::person::Follow;
use multiview::learned::Learned;
use multiview::{EnergyKind, Settings, SwitchBy};
use viewquality::TrainingErrors;

/// Returns the settings of the optimiser.
///
/// * `frame_scale`: pixels of the frame per pixel of the footage. `tau` is given in pixels of the footage.
/// * `learned`: the content of the file `consistency`. Its weights are used for the paper's energy, unless `config` sets them.
pub fn settings(config: &Config, frame_scale: f32, learned: Option<&Learned>) -> Settings {
    let scaled = |px: Vec<f32>| px.into_iter().map(|px| px * frame_scale).collect();
    let (energy, defaults) = match config.energy {
        Energy::Paper => (EnergyKind::Paper, Settings::default()),
        Energy::Released => (EnergyKind::Released, Settings::released()),
    };
    let weights = learned.filter(|_| config.energy == Energy::Paper);
    let weights = weights.map(|weight| weight.weights);
    let defaults = match weights {
        None => defaults,
        Some(it) => Settings {
            alpha: it.alpha,
            beta: it.beta,
            max_distance_cells: it.max_distance_cells.unwrap_or(f64::INFINITY),
            ..defaults
        },
    };
    let is_learned = config.tau == Tau::Named(TauName::Learned);
    let tau_tenths = learned.filter(|_| is_learned);
    Settings {
        energy,
        alpha: config.alpha.unwrap_or(defaults.alpha),
        beta: config.beta.unwrap_or(defaults.beta),
        tau_px: scaled(tau_px(&config.tau)),
        tau_tenths: tau_tenths.map_or_else(Vec::new, |tau_tenth| tau_tenth.tau_tenths.clone()),
        rescue_px: scaled(rescue_px(&config.tau)),
        switch: match config.switch {
            Switch::Either => SwitchBy::Either,
            Switch::Support => SwitchBy::Support,
            Switch::Worse => SwitchBy::Worse,
        },
        facing: config.facing,
        n_candidates: config.candidates,
        ..defaults
    }
}

/// Returns how the views of a frame are grouped for the solution.
pub fn views(from: Views) -> pipeline::Views {
    match from {
        Views::Pairs => pipeline::Views::Pairs,
        Views::All | Views::Space => pipeline::Views::All,
    }
}

fn training(tau: &Tau) -> Option<TrainingErrors> {
    let Tau::Named(name) = tau else {
        return None;
    };
    match name {
        TauName::None | TauName::Learned => None,
        TauName::HumanEva | TauName::HumanEvaMedian => Some(TrainingErrors::HUMANEVA),
        TauName::Umpm | TauName::UmpmMedian => Some(TrainingErrors::UMPM),
    }
}

/// Returns the thresholds in pixels of the footage. The list is empty if there are none, or if they are in a file that has not been
/// read yet.
pub fn tau_px(tau: &Tau) -> Vec<f32> {
    let Some(errors) = training(tau) else {
        return match tau {
            Tau::Given(px) => px.clone(),
            Tau::Named(_) | Tau::File(_) => Vec::new(),
        };
    };
    let is_median = matches!(
        tau,
        Tau::Named(TauName::HumanEvaMedian | TauName::UmpmMedian)
    );
    let thresholds = if is_median {
        viewquality::Tau::median_only(&errors)
    } else {
        viewquality::Tau::median_and_inaccuracy(&errors)
    };
    thresholds.px().to_vec()
}

/// Returns the median training errors. If both views of a pair are switched off, the energy of the authors' released program uses these
/// errors to switch one of them on again. The list is empty if the errors are not known.
fn rescue_px(tau: &Tau) -> Vec<f32> {
    training(tau).map_or_else(Vec::new, |errors| errors.median_px.to_vec())
}

/// Returns the choice of the followed person.
pub fn follow(from: Follow) -> pipeline::Follow {
    match from {
        Follow::Last => pipeline::Follow::Last,
        Follow::Largest => pipeline::Follow::Largest,
        Follow::Clearest => pipeline::Follow::Clearest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_equal_those_of_the_optimiser() {
        let expected = Settings::default();
        assert_eq!(settings(&Config::default(), 1.0, None), expected);
    }

    #[test]
    fn the_default_rule_for_following_equals_that_of_the_step() {
        assert_eq!(follow(Follow::default()), pipeline::Follow::default());
    }

    #[test]
    fn the_rule_of_the_paper_uses_only_the_median() {
        let px = |name| tau_px(&Tau::Named(name));
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
            settings(&config, 1.0, None).alpha,
            Settings::released().alpha
        );
    }
}
