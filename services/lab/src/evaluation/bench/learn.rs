//! Compares single views with the ground truth, to make training data for the consistency terms.

use kernels::Rgb8View;
use multiview::learned::{Learner, Pair, ViewObservation};
use multiview::{ViewInput, angle_between};
use nalgebra::Point3;
use statistics::score::Point;
use training::datasets::sequences::Sequence;

use super::Bench;
use crate::evaluation::{parse14, part_errors_and_facing, projected, size};

impl Bench {
    /// Solves every view of a frame on its own, and adds the results to the learners.
    ///
    /// * `joints`: the true joints of the sequence's joint set, in metres.
    /// * `by_name`: true to learn pairs of cameras by name as well.
    ///
    /// # Panics
    ///
    /// Panics if the number of images or the size of an image does not match the rig.
    pub fn learn(
        &mut self,
        learners: &mut [Learner],
        (sequence, joints): (&Sequence, &[Option<Point>]),
        images: &[Option<Rgb8View<'_>>],
        by_name: bool,
    ) {
        assert_eq!(images.len(), self.views.len(), "one image per view");
        let mut responses = std::mem::take(&mut self.responses);
        let found = self.single_views(images, &mut responses);
        self.responses = responses;
        let view_answer = |view: usize| {
            let found = found[view].as_ref()?;
            (!found.candidates.is_empty()).then_some(ViewInput {
                plan: &self.plans[view],
                candidates: &found.candidates,
                others: 0,
                sigma_px: None,
                tau_px: None,
            })
        };
        let observe = |view: usize| {
            let answer = view_answer(view)?;
            Some((answer, observation(&answer, sequence, joints)?))
        };
        let views: Vec<Option<(ViewInput<'_>, ViewObservation)>> =
            (0..found.len()).map(observe).collect();
        for learner in &mut *learners {
            let observations = views.iter().flatten();
            observations.for_each(|observation| learner.add_view(&observation.1, sequence.joints));
            learner.end_instant();
        }
        for [first, second] in pipeline::all_pairs(views.len()) {
            if let [Some(a), Some(b)] = [&views[first], &views[second]] {
                let names = [first, second].map(|i| sequence.views[i].camera.as_str());
                let pair = Pair {
                    views: [&a.1, &b.1],
                    angle: angle_between(&a.0, &b.0),
                    cameras: by_name.then_some(names),
                };
                for learner in &mut *learners {
                    learner.add_pair(&pair);
                }
            }
        }
    }
}

fn observation(
    answer: &ViewInput<'_>,
    sequence: &Sequence,
    joints: &[Option<Point>],
) -> Option<ViewObservation> {
    let best = answer.candidates.first()?;
    let camera = answer.plan.camera();
    let centres = answer.plan.centres(best);
    let truth = projected(camera, [0.0; 2], &parse14(sequence.joints, joints))?;
    let (errors, exchanged) = part_errors_and_facing(&centres, &truth, true)?;
    let project = |joint: &Option<Point>| {
        let at = camera.project(&Point3::from((*joint)?))?;
        Some([at.x, at.y])
    };
    Some(ViewObservation {
        types: best.parts.iter().map(|part| part.mixture).collect(),
        centres,
        errors,
        exchanged,
        size: size(&truth),
        joints: joints.iter().map(project).collect(),
    })
}
