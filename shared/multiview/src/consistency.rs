//! The paper's terms between two views: eq. 3 to 7, with one side fixed or both given.

use fmp::{Extra, Pose};

use crate::term::Term;
use crate::{Compatibility, PairInput, Settings};

/// Everything about the terms of a pair that does not change from one iteration to the next.
#[derive(Debug)]
pub(crate) struct PairTerms<'a> {
    settings: &'a Settings,
    pair: &'a PairInput<'a>,
    /// `counterpart[i]` of the second view is the anatomical part that `i` of the first view shows.
    counterpart: Vec<usize>,
    active: Vec<bool>,
    table: Option<&'a Compatibility>,
}

impl<'a> PairTerms<'a> {
    /// The terms of a pair.
    ///
    /// * `exchanged`: the second view shows the other side of the body. Type tables are learned on
    ///   views as the model names their parts, so an exchanged pair goes without the appearance term.
    pub(crate) fn new(settings: &'a Settings, pair: &'a PairInput<'a>, exchanged: bool) -> Self {
        let model = pair.views[0].plan.model();
        let counterpart = counterparts(model, exchanged);
        let active = active_parts(settings, pair, &counterpart);
        let table = pair
            .tables
            .filter(|_| !exchanged && settings.beta != 0.0)
            .map(|it| it.joint.as_ref());
        Self {
            settings,
            pair,
            counterpart,
            active,
            table,
        }
    }

    /// The switches `a_i` of eq. 6, by part of the first view.
    pub(crate) fn active(&self) -> &[bool] {
        &self.active
    }

    /// Value of the two consistency sums of eq. 3 for two given poses.
    pub(crate) fn between(&self, first: &Pose, second: &Pose) -> f64 {
        let plan = self.pair.views[0].plan;
        let fixed = Consistency::new(self, 0, second);
        let scale2 = plan.scale(usize::from(first.level)).powi(2);
        (0..self.active.len())
            .map(|part| {
                let at = plan.ideal_centre(first, part);
                let distance2 = fixed.terms[part].map_or(0.0, |it| it.distance2(at, scale2));
                let mixture = usize::from(first.parts[part].mixture);
                f64::from(fixed.of_type(part, mixture)) - self.settings.alpha * distance2
            })
            .sum()
    }

    /// The part of the other view that goes with `part` of view `target`.
    fn partner(&self, part: usize) -> usize {
        // The exchange is its own inverse, so one table serves both directions.
        self.counterpart[part]
    }

    fn is_active(&self, target: usize, part: usize) -> bool {
        self.active[if target == 0 {
            part
        } else {
            self.counterpart[part]
        }]
    }
}

/// The terms as the target view sees them while the support stands still.
#[derive(Debug)]
pub(crate) struct Consistency<'a> {
    pair_terms: &'a PairTerms<'a>,
    target: usize,
    support: &'a Pose,
    terms: Vec<Option<Term>>,
}

impl<'a> Consistency<'a> {
    pub(crate) fn new(pair_terms: &'a PairTerms<'a>, target: usize, support: &'a Pose) -> Self {
        let settings = pair_terms.settings;
        let plan = pair_terms.pair.views[1 - target].plan;
        let support_from_target = pair_terms.pair.epipolar.support_from_target(target == 0);
        let scale = plan.scale(usize::from(support.level));
        let terms = (0..support.parts.len())
            .map(|part| {
                pair_terms.is_active(target, part).then_some(())?;
                let at = plan.ideal_centre(support, pair_terms.partner(part));
                Term::new(support_from_target, at, scale, settings.max_distance_cells)
            })
            .collect();
        Self {
            pair_terms,
            target,
            support,
            terms,
        }
    }
}

impl Extra for Consistency<'_> {
    fn add_position(&self, part: usize, level: usize, score: &mut [f32]) -> bool {
        let Some(term) = self.terms[part].filter(|it| !it.is_constant()) else {
            return false;
        };
        let plan = self.pair_terms.pair.views[self.target].plan;
        let scale2 = plan.scale(level).powi(2);
        let alpha = self.pair_terms.settings.alpha;
        for (score, cell) in score.iter_mut().zip(plan.cells(part, level)) {
            *score -= (alpha * term.distance2(*cell, scale2)) as f32;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        let Some(table) = self.pair_terms.table else {
            return 0.0;
        };
        if !self.pair_terms.is_active(self.target, part) {
            return 0.0;
        }
        let other = usize::from(self.support.parts[self.pair_terms.partner(part)].mixture);
        let joint = if self.target == 0 {
            table.value(part, mixture, other)
        } else {
            table.value(part, other, mixture)
        };
        (self.pair_terms.settings.beta * joint) as f32
    }
}

/// For every part of one view the part of the other view that shows the same limb.
pub(crate) fn counterparts(model: &fmp::Model, exchanged: bool) -> Vec<usize> {
    match (&model.spec().mirror, exchanged) {
        (Some(mirror), true) => mirror.clone(),
        _ => (0..model.n_parts()).collect(),
    }
}

/// Eq. 6: a part is off if either view's expected error exceeds its threshold.
fn active_parts(settings: &Settings, pair: &PairInput<'_>, counterpart: &[usize]) -> Vec<bool> {
    let off = |view: usize, part: usize| {
        let sigma = pair.views[view].sigma_px.and_then(|it| it.get(part));
        let tau = settings.tau_px.get(part);
        matches!((sigma, tau), (Some(sigma), Some(tau)) if sigma > tau)
    };
    counterpart
        .iter()
        .enumerate()
        .map(|(part, &other)| !off(0, part) && !off(1, other))
        .collect()
}
