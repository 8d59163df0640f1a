//! Who is in a frame: the candidates of every view that are one person.

use std::sync::Arc;

use multiview::{SeenPerson, ViewPlan, same_person};

use crate::following::{Follow, Following, Others};
use crate::people::{FoundBody, bodies_of_people};
use crate::placed::N;
use crate::sighting::{Sighting, Sightings};

/// A person of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownPerson {
    /// Identity within the run, from 1.
    pub id: u64,
    /// Index of the person among the candidates of every view; `None` where the view does not show the person.
    pub candidates: Vec<Option<usize>>,
}

/// The people of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FramePeople {
    /// The people, the one who is followed first.
    pub people: Vec<KnownPerson>,
    /// Number of people that several views agree on.
    pub n_seen: usize,
}

/// The step that says who is who, from the candidates of networks alone.
#[derive(Debug)]
pub struct WhoStep {
    plans: Vec<Arc<ViewPlan>>,
    following: Following,
    as_seen: bool,
}

impl WhoStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order.
    /// * `as_seen`: whether left and right follow the picture, so that two views may have them exchanged.
    pub fn new(plans: Vec<Arc<ViewPlan>>, follow: Follow, as_seen: bool) -> Self {
        Self {
            plans,
            following: Following::new(follow),
            as_seen,
        }
    }

    /// Says who is in the next frame: the person who is followed, if at least two views show that person.
    pub fn run(&mut self, answers: &[Option<Sightings>]) -> FramePeople {
        let views = self.plans.iter().zip(answers);
        let views: Vec<Vec<FoundBody>> = views
            .map(|(plan, seen)| bodies_of_people(plan.camera(), seen.as_ref()))
            .collect();
        let followed = self.following.next(&self.plans, views);
        let candidates = self.candidates(answers, &followed.others);
        let n_views = candidates.iter().flatten().count();
        let person = (n_views >= 2).then_some(KnownPerson {
            id: followed.id,
            candidates,
        });
        FramePeople {
            people: person.into_iter().collect(),
            n_seen: followed.n_seen,
        }
    }

    /// The candidate of every view that is the same person: the one who is followed where the view sees it, else among those who are
    /// nobody else.
    fn candidates(&self, answers: &[Option<Sightings>], others: &Others) -> Vec<Option<usize>> {
        let mut indices: Vec<Vec<usize>> = vec![Vec::new(); answers.len()];
        let mut people: Vec<Vec<SeenPerson>> = vec![Vec::new(); answers.len()];
        for (view, answer) in answers.iter().enumerate() {
            let Some(answer) = answer.as_ref().filter(|_| !others.only(view)) else {
                continue;
            };
            for (index, sighting) in answer.people.iter().enumerate() {
                let is_own = others.own(view).is_none_or(|own| own == index);
                if is_own && others.of_view(view) >> index & 1 == 0 {
                    indices[view].push(index);
                    people[view].push(self.seen(view, sighting));
                }
            }
        }
        let views = self.plans.iter().zip(&people);
        let views: Vec<_> = views
            .map(|(plan, people)| (plan.camera(), &people[..]))
            .collect();
        let chosen = same_person(&views, self.as_seen).into_iter().zip(indices);
        chosen
            .map(|(chosen, indices)| indices.get(chosen?).copied())
            .collect()
    }

    /// The person of a candidate.
    fn seen(&self, view: usize, sighting: &Sighting) -> SeenPerson {
        let [_, height] = self.plans[view].layout().image_size;
        let joint = |joint: usize| {
            let at = sighting.joint(joint)?;
            Some((at, f64::from(sighting.heats[joint])))
        };
        let outline = sighting.outline().unwrap_or_default();
        let longer_px = (outline[2] - outline[0]).max(outline[3] - outline[1]);
        SeenPerson {
            joints: (0..N).map(joint).collect(),
            height: longer_px / height as f64,
        }
    }
}
