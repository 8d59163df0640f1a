//! Solves for one person in 3D from the network maps of all views, which are read without copying.

use std::sync::Arc;

use ::people::Solved;
use geometry::{TriangulateError, Triangulated};
use multiview::{
    FrontEvidence, Sides, SidesFilter, SolvedPerson, SpacePose, SpaceView, ViewPlan,
    anatomical_evidence, front, front_log_ratio_of, solve_person,
};
use nalgebra::{Point2, UnitVector3};
use posenetwork::PersonMaps;
use skeleton::{MIRRORED, SIDES};

use crate::bodies::{Bodies, Body, NoJoint};
use crate::disagreement::{self, FoundByViews};
use crate::fused_view::FusedView;
use crate::motion::Motion;
use crate::person_evidence::PersonEvidence;
use crate::placed::{N, PartView, Places, hidden, joints_at, of_set, shown_in};
use crate::sighting::{Sighting, ViewSightings};
use crate::skeleton_step::{Kept, Skeleton};
use crate::space_settings::SpaceStepSettings;
use crate::who::FramePeople;

/// Minimum number of joints that two views must see clearly; it is low because half of a person is often hidden. In measurements in six
/// empty rooms, the joint with the seventh highest heat in two views had a heat of at most 0.41. With people who stood, sat or ran in front
/// of three or four cameras, its heat was at least 0.58.
const WELL_SEEN: usize = 7;
/// Minimum number of a person's joints that a view must see; otherwise, the view does not contribute.
const SEEN: usize = 3;

/// Data that does not change from frame to frame.
#[derive(Debug)]
pub(crate) struct Rig {
    pub(crate) plans: Vec<Arc<ViewPlan>>,
    pub(crate) up_in_world: Option<UnitVector3<f64>>,
    pub(crate) settings: SpaceStepSettings,
}

/// Sightings and maps of a frame.
#[derive(Clone, Copy)]
pub(crate) struct FrameViews<'f, 'a> {
    /// Sightings of each view.
    pub(crate) answers: &'f [Option<ViewSightings>],
    /// Maps of the people of each view. A view without sightings or maps does not contribute.
    pub(crate) evidence: &'f [Vec<PersonMaps<'a>>],
    pub(crate) people: &'f FramePeople,
}

/// Solves for one person; remembers left and right, bone lengths and motion from the earlier frames.
#[derive(Debug)]
pub(crate) struct PersonStep {
    rig: Arc<Rig>,
    bodies: Bodies,
    sides: SidesFilter,
    /// Motion of the candidates in the pictures.
    seen: Motion,
    /// Motion of the solution in the pictures.
    solved: Motion,
}

/// A person as one view of the frame shows them.
pub(crate) struct Shown<'a> {
    pub(crate) view: usize,
    front: FrontEvidence,
    pub(crate) evidence: PersonEvidence<'a>,
}

/// A solution, and the decision about its left and right.
struct Solution<'a> {
    places: Places,
    energy: f64,
    views: Vec<PartView<'a>>,
    sides: Option<Sides>,
}

impl PersonStep {
    pub(crate) fn new(rig: &Arc<Rig>) -> Self {
        Self {
            rig: Arc::clone(rig),
            bodies: Bodies::default(),
            sides: SidesFilter::default(),
            seen: Motion::default(),
            solved: Motion::default(),
        }
    }

    /// Begins a frame, like [`SpaceStep::begin`](crate::SpaceStep::begin).
    pub(crate) fn begin(&mut self, instant_s: Option<f64>) {
        self.seen.begin(instant_s);
        self.solved.begin(instant_s);
    }

    /// Solves for the person in a frame.
    ///
    /// * `nth`: index of the person among the people of the frame.
    /// * Returns a skeleton without joints if fewer than two views show the person. For example, false detections in an empty room do not
    ///   agree between views.
    pub(crate) fn run(&mut self, frame: &FrameViews<'_, '_>, nth: usize) -> Skeleton {
        let shown = self.shown(frame, nth);
        let rig = Arc::clone(&self.rig);
        let solution = self.solve(&rig.plans, &shown);
        let solution = solution.as_ref();
        let (places, views) = match solution {
            Some(solution) => (solution.places, &solution.views[..]),
            None => ([None; N], &[][..]),
        };
        let joints = joints_at(&places, views, &rig.settings.maps);
        self.finish(frame, solution, &joints)
    }

    /// Completes the person of a frame from joints that were solved from keypoints.
    ///
    /// * `shown`: the person in each view that shows the person.
    pub(crate) fn complete(
        &mut self,
        frame: &FrameViews<'_, '_>,
        (shown, solved): (&[Shown<'_>], &Solved),
    ) -> Skeleton {
        let rig = Arc::clone(&self.rig);
        let solution = self.solution_by_keypoints(&rig.plans, shown, solved);
        let Some(solution) = &solution else {
            let nothing = joints_at(&[None; N], &[], &rig.settings.maps);
            return self.finish(frame, None, &nothing);
        };
        let mut joints = joints_at(&solution.places, &solution.views, &rig.settings.maps);
        let exchanged = solution.sides.is_some_and(|sides| sides.exchange);
        for (nth, joint) in joints.iter_mut().enumerate() {
            let own = if exchanged { MIRRORED[nth] } else { nth };
            if matches!(joint, Err(TriangulateError::TooFewViews { .. }))
                && let Some(placed) = hidden(solved, own)
            {
                *joint = Ok(placed);
            }
        }
        self.finish(frame, Some(solution), &joints)
    }

    /// Removes impossible joints, and computes residuals and views.
    fn finish(
        &mut self,
        frame: &FrameViews<'_, '_>,
        solution: Option<&Solution<'_>>,
        joints: &[Result<Triangulated, TriangulateError>],
    ) -> Skeleton {
        let FrameViews {
            answers, people, ..
        } = *frame;
        let rig = Arc::clone(&self.rig);
        let Rig {
            plans, settings, ..
        } = &*rig;
        let of_set = of_set(settings.joints, joints);
        let settled = self.bodies.settle(&settings.body, joints, (settings.joints, of_set));
        let (mut settled, body): (Vec<Result<Triangulated, NoJoint>>, Option<Body>) = settled;
        let takes_part = |view: usize| {
            solution.is_some_and(|solution| solution.views.iter().any(|part| part.view == view))
        };
        let takes_part: Vec<bool> = (0..plans.len()).map(takes_part).collect();
        let found_by = FoundByViews {
            plans,
            answers,
            takes_part: &takes_part,
            least_heat: settings.least_heat,
            joints: settings.joints,
        };
        disagreement::measure(&found_by, &mut self.solved, &mut settled);
        Skeleton {
            joints: settled,
            body,
            views: self.views(answers, solution),
            n_people: people.n_seen,
            n_pairs: pairs_of(takes_part.iter().filter(|takes_part| **takes_part).count()),
            facing_margin: f64::INFINITY,
            sides: solution.and_then(|solution| solution.sides),
            kept: Kept::Solved,
        }
    }

    /// Returns the views with a candidate that shows the person, at the instant of the frame.
    pub(crate) fn shown<'a>(&mut self, frame: &FrameViews<'_, 'a>, nth: usize) -> Vec<Shown<'a>> {
        let FrameViews {
            answers,
            evidence,
            people,
        } = *frame;
        let mut shown = Vec::new();
        for (view, candidate) in people.people[nth].candidates.iter().enumerate() {
            let (Some(candidate), Some(Some(answer)), Some(maps)) =
                (*candidate, answers.get(view), evidence.get(view))
            else {
                continue;
            };
            // A restarted process can repeat a frame and see different people from those whose maps arrived earlier.
            let (Some(sighting), Some(maps), true) = (
                answer.people.get(candidate),
                maps.get(candidate),
                maps.len() == answer.people.len(),
            ) else {
                continue;
            };
            let evidence = PersonEvidence::new(*maps, sighting);
            let Some(mut evidence) = evidence else {
                continue;
            };
            let found = sighting.places(false).map(Point2::from);
            let found = found.map(|at| Some(at).filter(|at| at.x.is_finite()));
            let skew_s = answer.skew_s - f64::from(sighting.age_s);
            if let Some(by) = self.seen.since_instant(view, [skew_s; 2], found.to_vec()) {
                evidence.move_to_instant(by);
            }
            shown.push(Shown {
                view,
                front: front_seen(sighting),
                evidence,
            });
        }
        shown
    }

    /// Returns the solution from keypoints; `None` if fewer than two views show it.
    fn solution_by_keypoints<'a>(
        &mut self,
        plans: &'a [Arc<ViewPlan>],
        shown: &'a [Shown<'_>],
        solved: &Solved,
    ) -> Option<Solution<'a>> {
        let found = SolvedPerson {
            pose: SpacePose {
                joints: solved.joints,
                energy: 0.0,
            },
            views: vec![Some([false; 2]); shown.len()],
        };
        let views = shown.iter().map(|shown| PartView {
            view: shown.view,
            shown: space_view(plans, shown),
            window_px: shown.evidence.window_px,
        });
        let views = views.filter(|part| self.shows(&found, part));
        let views: Vec<PartView<'a>> = views.collect();
        (views.len() >= 2).then(|| self.with_sides(&found, views))
    }

    /// Solves for the person; `None` if fewer than two views see the person clearly.
    fn solve<'a>(
        &mut self,
        plans: &'a [Arc<ViewPlan>],
        shown: &'a [Shown<'_>],
    ) -> Option<Solution<'a>> {
        let views: Vec<SpaceView<'a>> =
            shown.iter().map(|shown| space_view(plans, shown)).collect();
        if views.len() < 2 {
            return None;
        }
        let found = solve_person(&views, &self.rig.settings.space)?;
        let used = found.views.iter().zip(&views).zip(shown);
        let used = used.filter_map(|((exchanged, view), it)| {
            Some(PartView {
                view: it.view,
                shown: SpaceView {
                    exchanged: (*exchanged)?,
                    ..*view
                },
                window_px: it.evidence.window_px,
            })
        });
        let mut used: Vec<PartView<'a>> = used.collect();
        if !self.is_well_seen(&found, &used) {
            return None;
        }
        used.retain(|part| self.shows(&found, part));
        if used.len() < 2 {
            return None;
        }
        Some(self.with_sides(&found, used))
    }

    /// Decides left and right of the whole body, if the views name left and right as they appear in the picture.
    fn with_sides<'a>(
        &mut self,
        found: &SolvedPerson,
        mut views: Vec<PartView<'a>>,
    ) -> Solution<'a> {
        let mut places = found.pose.joints;
        let sides = self.rig.settings.sides.as_ref().map(|settings| {
            let said = views.iter().map(|view| (view.shown.camera, view.shown.front));
            let said: Vec<_> = said.collect();
            let evidence = settings.anatomy_weight
                * anatomical_evidence(&places, self.rig.up_in_world)
                + settings.front_weight * front_log_ratio_of(&places, &said);
            self.sides.decide(settings, front(&places), evidence)
        });
        if sides.is_some_and(|sides| sides.exchange) {
            for [right, left] in SIDES {
                places.swap(right, left);
            }
            for part in &mut views {
                part.shown.exchanged = part.shown.exchanged.map(|exchanged| !exchanged);
            }
        }
        Solution {
            places,
            energy: found.pose.energy,
            views,
            sides,
        }
    }

    /// Returns true if two views see enough joints of a solution clearly.
    fn is_well_seen(&self, found: &SolvedPerson, views: &[PartView<'_>]) -> bool {
        let is_seen = |joint: &usize| {
            let heats = views.iter().map(|view| self.heat_of(*joint, found, view));
            let well = heats.filter(|heat| *heat >= self.rig.settings.least_heat);
            well.count() >= 2
        };
        (0..N).filter(is_seen).count() >= WELL_SEEN
    }

    /// Returns the heat of a joint of a solution in a view, 0 to 1.
    fn heat_of(&self, joint: usize, found: &SolvedPerson, view: &PartView<'_>) -> f64 {
        let at = found.pose.joints[joint];
        at.map_or(0.0, |at| {
            self.rig.settings.maps.heat(view.shown.evidence_at(joint, &at))
        })
    }

    /// Returns true if a view shows the person of a solution at all. If it shows something else, it provides no evidence of the person, and
    /// its pixels do not belong to the person.
    fn shows(&self, found: &SolvedPerson, view: &PartView<'_>) -> bool {
        let heats = (0..N).map(|joint| self.heat_of(joint, found, view));
        let seen = heats.filter(|heat| *heat >= self.rig.settings.least_heat / 2.0);
        seen.count() >= SEEN
    }

    /// Returns the poses of a solution in the views that contribute to it.
    fn views(
        &self,
        answers: &[Option<ViewSightings>],
        solution: Option<&Solution<'_>>,
    ) -> Vec<Option<FusedView>> {
        let mut views = vec![None; self.rig.plans.len()];
        let Some(solution) = solution else {
            return views;
        };
        for part in &solution.views {
            let best = answers[part.view].as_ref();
            let best = best.and_then(|answer| answer.people.first());
            let score = best.map_or(0.0, |sighting| f64::from(sighting.score));
            let exchanged = solution.sides.is_some_and(|sides| sides.exchange);
            views[part.view] = Some(FusedView {
                exchanged,
                ..shown_in(
                    &self.rig.plans[part.view],
                    &solution.places,
                    solution.energy,
                    score,
                )
            });
        }
        views
    }
}

fn space_view<'a>(plans: &'a [Arc<ViewPlan>], shown: &'a Shown<'_>) -> SpaceView<'a> {
    SpaceView {
        camera: plans[shown.view].camera(),
        evidence: &shown.evidence,
        exchanged: [false; 2],
        front: shown.front,
    }
}

/// Returns the evidence of a view about the direction in which a person faces.
fn front_seen(sighting: &Sighting) -> FrontEvidence {
    if !sighting.front.iter().all(|number| number.is_finite()) {
        return FrontEvidence::default();
    }
    // A person in a handstand looks upright to the network, because the picture was rotated. For a lying person, the network's evidence
    // says nothing about up and down in the picture.
    let weight = sighting.trunk_upward().unwrap_or(1.0).powi(2) as f32;
    sighting.front.map(|told| weight * told)
}

/// Returns the number of pairs of views.
fn pairs_of(n_views: usize) -> usize {
    n_views * n_views.saturating_sub(1) / 2
}
