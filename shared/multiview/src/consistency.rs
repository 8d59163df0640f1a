//! The paper's terms between two views (eq. 3 to 7), for one fixed view or for two given poses.

use fmp::{ExtraTerms, Pose};

use crate::term::Term;
use crate::{Compatibility, PairInput, Settings, SwitchBy};

/// The terms of a pair, with everything that stays the same from iteration to iteration.
#[derive(Debug)]
pub(crate) struct PairTerms<'a> {
    settings: &'a Settings,
    pair: &'a PairInput<'a>,
    /// `counterpart[i]` is the part of the second view that shows the same limb as part `i` of the
    /// first.
    counterpart: Vec<usize>,
    /// Switches of the terms, `[target][part of the first view]`.
    active: [Vec<bool>; 2],
    table: Option<&'a Compatibility>,
}

impl<'a> PairTerms<'a> {
    /// Creates the terms of a pair.
    ///
    /// * `exchanged`: true if the two views see the person from opposite sides. Such a pair needs a table of its own; without one, it has
    ///   no appearance term.
    pub(crate) fn new(settings: &'a Settings, pair: &'a PairInput<'a>, exchanged: bool) -> Self {
        let model = pair.views[0].plan.model();
        let counterpart = counterparts(model, exchanged);
        let active = active_parts(settings, pair, &counterpart);
        let table = pair.tables.filter(|_| settings.beta != 0.0);
        let table = table.and_then(|tables| {
            if exchanged {
                tables.exchanged.as_deref()
            } else {
                Some(tables.joint.as_ref())
            }
        });
        Self {
            settings,
            pair,
            counterpart,
            active,
            table,
        }
    }

    /// Returns the switches `a_i` of eq. 6 by part of the first view: on if the terms are on for either
    /// view.
    pub(crate) fn active(&self) -> Vec<bool> {
        let [first, second] = &self.active;
        first.iter().zip(second).map(|(a, b)| *a || *b).collect()
    }

    /// Returns the value of the two consistency sums of eq. 3 for two given poses. If the switches of the views differ, it is the mean of
    /// the two values, one with each view's switches.
    pub(crate) fn between(&self, first: &Pose, second: &Pose) -> f64 {
        let value = self.for_target(0, first, second);
        if self.active[0] == self.active[1] {
            value
        } else {
            0.5 * (value + self.for_target(1, first, second))
        }
    }

    /// Like [`Self::between`], with the terms that are switched on while `target` is solved.
    pub(crate) fn for_target(&self, target: usize, first: &Pose, second: &Pose) -> f64 {
        let plan = self.pair.views[0].plan;
        let scale2 = plan.scale(usize::from(first.level)).powi(2);
        (0..self.counterpart.len())
            .map(|part| {
                let at = plan.ideal_centre(first, part);
                let term = self.term([0, target], part, second);
                let distance2 = term.map_or(0.0, |term| term.distance2(at, scale2));
                let mixture = usize::from(first.parts[part].mixture);
                let of_type = self.of_type([0, target], [part, mixture], second);
                f64::from(of_type) - self.settings.alpha * distance2
            })
            .sum()
    }

    /// Returns the geometric term of a part of view `view`, with its switch while view `target` is solved.
    ///
    /// * `support`: the pose of the other view.
    fn term(&self, [view, target]: [usize; 2], part: usize, support: &Pose) -> Option<Term> {
        if !self.is_active([view, target], part) {
            return None;
        }
        let plan = self.pair.views[1 - view].plan;
        let support_from_target = self.pair.epipolar.support_from_target(view == 0);
        let scale = plan.scale(usize::from(support.level));
        let at = plan.ideal_centre(support, self.partner(part));
        let cap = self.settings.max_distance_cells;
        Term::new(support_from_target, at, scale, cap)
    }

    /// Returns the appearance term of a type of a part, like [`Self::term`].
    fn of_type(
        &self,
        [view, target]: [usize; 2],
        [part, mixture]: [usize; 2],
        support: &Pose,
    ) -> f32 {
        let Some(table) = self.table else {
            return 0.0;
        };
        if !self.is_active([view, target], part) {
            return 0.0;
        }
        let partner = self.partner(part);
        let other = usize::from(support.parts[partner].mixture);
        // The table is indexed by the parts of the first view.
        let joint = if view == 0 {
            table.value(part, mixture, other)
        } else {
            table.value(partner, other, mixture)
        };
        (self.settings.beta * joint) as f32
    }

    /// Returns the part of the other view that corresponds to `part` of view `target`.
    fn partner(&self, part: usize) -> usize {
        // Swapping left and right twice changes nothing, so one table serves both directions.
        self.counterpart[part]
    }

    /// Returns true if the terms of `part` of view `view` are on while view `target` is solved.
    fn is_active(&self, [view, target]: [usize; 2], part: usize) -> bool {
        self.active[target][if view == 0 {
            part
        } else {
            self.counterpart[part]
        }]
    }
}

/// The terms for the target view while the supporting view is fixed.
#[derive(Debug)]
pub(crate) struct Consistency<'a> {
    pair_terms: &'a PairTerms<'a>,
    target: usize,
    support: &'a Pose,
    terms: Vec<Option<Term>>,
}

impl<'a> Consistency<'a> {
    pub(crate) fn new(pair_terms: &'a PairTerms<'a>, target: usize, support: &'a Pose) -> Self {
        let term = |part| pair_terms.term([target; 2], part, support);
        Self {
            terms: (0..support.parts.len()).map(term).collect(),
            pair_terms,
            target,
            support,
        }
    }
}

impl Consistency<'_> {
    fn is_active(&self, part: usize) -> bool {
        self.pair_terms.is_active([self.target; 2], part)
    }
}

impl ExtraTerms for Consistency<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let Some(term) = self.terms[part].filter(|term| !term.is_constant()) else {
            return false;
        };
        let plan = self.pair_terms.pair.views[self.target].plan;
        let scale2 = plan.scale(level).powi(2);
        let alpha = self.pair_terms.settings.alpha;
        let cells = &plan.cells(part, level)[first..];
        for (score, cell) in score.iter_mut().zip(cells) {
            *score -= (alpha * term.distance2(*cell, scale2)) as f32;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        self.pair_terms.of_type([self.target; 2], [part, mixture], self.support)
    }

    fn max_gain(&self, part: usize) -> f32 {
        let position = if self.terms[part].is_none() || self.pair_terms.settings.alpha >= 0.0 {
            // Distances only reduce the score.
            0.0
        } else {
            f32::INFINITY
        };
        let plan = self.pair_terms.pair.views[self.target].plan;
        let types = 0..plan.model().n_types(part);
        let types = types.map(|mixture| self.of_type(part, mixture));
        position + types.fold(f32::NEG_INFINITY, f32::max)
    }

    fn key(&self, part: usize) -> Option<u64> {
        let is_active = self.is_active(part);
        let partner = self.pair_terms.partner(part);
        Some(if is_active {
            support_key(self.support, partner)
        } else {
            NO_SUPPORT
        })
    }
}

/// The key of a part whose support adds nothing.
pub(crate) const NO_SUPPORT: u64 = u64::MAX;

/// Returns a key for everything in the supporting pose that affects the terms of one pair.
pub(crate) fn support_key(support: &Pose, part: usize) -> u64 {
    let at = support.parts[part];
    let fields = [at.x, at.y, u16::from(at.mixture)].map(u64::from);
    let level = u64::from(support.level);
    fields.into_iter().fold(level, |key, it| key << 16 | it)
}

/// For every part of one view, the part of the other view that shows the same limb.
pub(crate) fn counterparts(model: &fmp::Model, exchanged: bool) -> Vec<usize> {
    match (&model.spec().mirror, exchanged) {
        (Some(mirror), true) => mirror.clone(),
        _ => (0..model.n_parts()).collect(),
    }
}

/// Evaluates eq. 6 for each target view, by part of the first view: a part is off if a relevant expected error exceeds its threshold.
fn active_parts(
    settings: &Settings,
    pair: &PairInput<'_>,
    counterpart: &[usize],
) -> [Vec<bool>; 2] {
    // Without a prediction, a part is assumed to be usable.
    let expected = |view: usize, part: usize| {
        let expectation = pair.views[view].expectation(settings, part);
        expectation.unwrap_or([0.0, 1.0])
    };
    let by_part = |on: &dyn Fn([f32; 2], [f32; 2]) -> bool| -> Vec<bool> {
        let parts = counterpart.iter().enumerate();
        parts.map(|(part, &other)| on(expected(0, part), expected(1, other))).collect()
    };
    let usable = |[sigma, tau]: [f32; 2]| sigma <= tau;
    // Errors are compared relative to the thresholds, since a person can be larger in one view than in the other.
    let no_worse =
        |[sigma, tau]: [f32; 2], [other, other_tau]: [f32; 2]| sigma * other_tau <= other * tau;
    match settings.switch {
        SwitchBy::Either => {
            let both = by_part(&|first, second| usable(first) && usable(second));
            [both.clone(), both]
        }
        SwitchBy::Support => [
            by_part(&|_, second| usable(second)),
            by_part(&|first, _| usable(first)),
        ],
        SwitchBy::Worse => [
            by_part(&|first, second| usable(second) || no_worse(second, first)),
            by_part(&|first, second| usable(first) || no_worse(first, second)),
        ],
    }
}
