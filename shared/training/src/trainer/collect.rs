//! Work on images: placing people, mining hard negatives and wrong poses, and computing features.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError};

use crate::datasets::Picture;
use fmp::{FeaturePyramid, Layout, Model, Placement, Pose};
use rayon::prelude::*;

use super::{TrainError, Trainer};
use crate::confuse::{Confuser, loss};
use crate::dual::Constraint;
use crate::example::{Cells, Example};
use crate::latent::{Marked, best_near, nearest};
use crate::mine::Miner;
use crate::origin::{Origin, Placed};
use crate::shape::Shape;
use crate::watch::{Event, Step};

/// Number of background images for the windows of the initial filters, and number of windows of each image.
const WINDOW_IMAGES: usize = 100;
const WINDOWS: usize = 20;

impl Trainer<'_> {
    /// Runs `visit` for every item of `all` in parallel, and returns the results in order.
    fn visit_all<S: Sync, T: Send>(
        &self,
        all: &[S],
        visit: impl Fn(&S) -> Result<T, TrainError> + Sync,
    ) -> Result<Vec<T>, TrainError> {
        let done = AtomicUsize::new(0);
        all.par_iter()
            .map(|item| {
                self.go_on()?;
                let seen = visit(item)?;
                let done = 1 + done.fetch_add(1, Ordering::Relaxed);
                let of = all.len();
                self.watch.tell(Event::Images { done, of });
                Ok(seen)
            })
            .collect()
    }

    /// The part of the image around a person, and the marked parts in it.
    fn person(&self, it: usize, with_types: bool) -> Result<(Picture, Marked), TrainError> {
        let person = self.plan.person(it);
        let image = self.album.person(person).map_err(|source| {
            let person = person + 1;
            TrainError::Person { person, source }
        })?;
        let mut marked = self.plan.marked(it, with_types);
        let (crop, origin) = image.crop(marked.surroundings());
        for part in &mut marked.parts {
            *part = [part[0] - origin[0], part[1] - origin[1]];
        }
        Ok((crop, marked))
    }

    fn background(&self, image: usize) -> Result<Picture, TrainError> {
        self.album.background(image).map_err(|source| {
            let image = image + 1;
            TrainError::Background { image, source }
        })
    }

    /// The current model, with the pyramid interval for background images.
    fn mining_model(&self) -> Result<Model, TrainError> {
        let shape = Shape {
            interval: self.settings.mining_interval,
            ..self.plan.shape().clone()
        };
        Ok(shape.model(&self.v, 0.0)?)
    }

    /// Examples of all people. The parts are as close to the marks as the cells allow, and have the types of their clusters.
    pub(super) fn nearest(&self) -> Result<Vec<Example>, TrainError> {
        let model = self.model()?;
        let all: Vec<_> = (0..self.plan.n_people()).collect();
        let placed = self.visit_all(&all, |&person| {
            let (image, marked) = self.person(person, true)?;
            Ok(on_pyramid(&model, &image, |pyramid, layout| {
                let pose = nearest(&model, layout, &marked, self.settings.overlap)?;
                let map = pyramid.level(usize::from(pose.level));
                Some(Example::of(self.plan.shape(), &self.at, &map, &pose))
            }))
        })?;
        let placed: Vec<_> = placed.into_iter().flatten().collect();
        if placed.is_empty() {
            let n_people = self.plan.n_people();
            return Err(TrainError::NobodyPlaced { n_people });
        }
        Ok(placed)
    }

    /// Features of random windows in background images.
    pub(super) fn windows(&self) -> Result<Vec<Vec<f32>>, TrainError> {
        let model = self.model()?;
        let side = self.plan.shape().side;
        let images: Vec<_> = (0..self.album.n_backgrounds().min(WINDOW_IMAGES)).collect();
        let found = self.visit_all(&images, |&image| {
            let mut random = fastrand::Rng::with_seed(self.seed_of(image));
            let picture = self.background(image)?;
            let windows = on_pyramid(&model, &picture, |pyramid, layout| {
                let window = |_| {
                    let level = random.usize(0..layout.levels.len());
                    let it = &layout.levels[level];
                    let (x, y) = (random.usize(0..it.cols), random.usize(0..it.rows));
                    crate::example::window(&pyramid.level(level), [x, y], side)
                };
                Some((0..WINDOWS).map(window).collect::<Vec<_>>())
            });
            Ok(windows.unwrap_or_default())
        })?;
        Ok(found.concat())
    }

    /// The best poses of all people near their marks under the current model, with their scores.
    pub(super) fn best_placements(
        &self,
        with_types: bool,
    ) -> Result<Vec<Option<(Placed, f64)>>, TrainError> {
        let model = self.model()?;
        let all: Vec<_> = (0..self.plan.n_people()).collect();
        let placed = self.visit_all(&all, |&person| {
            let (image, marked) = self.person(person, with_types)?;
            Ok(on_pyramid(&model, &image, |pyramid, layout| {
                let pose = best_near(&model, pyramid, layout, &marked, self.settings.overlap)?;
                Some((Placed::of(&pose), f64::from(pose.score)))
            }))
        })?;
        let scores: Vec<f64> = placed.iter().flatten().map(|placed| placed.1).collect();
        let n = scores.len();
        if n == 0 {
            let n_people = placed.len();
            return Err(TrainError::NobodyPlaced { n_people });
        }
        self.watch.tell(Event::Placed {
            n,
            n_lost: placed.len() - n,
            mean_score: scores.iter().sum::<f64>() / n as f64,
        });
        Ok(placed)
    }

    /// Adds the examples of a batch: hard negatives in background images, and wrong poses of people.
    pub(super) fn collect(&mut self, step: Step) -> Result<(), TrainError> {
        let Step::Learn { round, pass, batch } = step else {
            return Ok(());
        };
        let share = |n: usize, salt: usize| {
            // The order is the same in all batches of a pass.
            let mut order: Vec<usize> = (0..n).collect();
            let salt = (round * self.settings.passes + pass) * 2 + salt;
            fastrand::Rng::with_seed(self.seed_of(usize::MAX - salt)).shuffle(&mut order);
            let n_batches = self.album.n_backgrounds().div_ceil(self.settings.batch.max(1));
            let size = n.div_ceil(n_batches);
            let batch = order.into_iter().skip(batch * size).take(size);
            batch.collect::<Vec<_>>()
        };
        let held: BTreeSet<&Origin> = self.machine.entries().map(|entry| entry.0).collect();
        let images = share(self.album.n_backgrounds(), 0);
        let mut origins = self.hard_negatives(&images, &held)?;
        let backgrounds = origins.len();
        if self.settings.pose_weight > 0.0 {
            let people = share(self.plan.n_people(), 1);
            origins.extend(self.mistakes(&people, &held)?);
        }
        let mistakes = origins.len() - backgrounds;
        self.add(origins, &mut std::iter::repeat(0.0))?;
        self.watch.tell(Event::Collected {
            backgrounds,
            mistakes,
            held: self.machine.len(),
            bytes: self.bytes(),
        });
        Ok(())
    }

    pub(super) fn hard_negatives(
        &self,
        images: &[usize],
        held: &BTreeSet<&Origin>,
    ) -> Result<Vec<Origin>, TrainError> {
        let miner = Miner::new(self.mining_model()?);
        let mut n_held = BTreeMap::<usize, usize>::new();
        for it in held {
            if let Origin::Background { image, .. } = it {
                *n_held.entry(*image as usize).or_default() += 1;
            }
        }
        let found = self.visit_all(images, |&image| {
            let picture = self.background(image)?;
            // The poses that are already in the working set may be the best ones again. The search therefore returns as many additional
            // poses.
            let n_held = n_held.get(&image).copied().unwrap_or(0);
            let poses = miner.search(&picture, -1.0, self.settings.per_image + n_held);
            let origins = poses.iter().map(|pose| Origin::Background {
                image: image as u32,
                pose: Placed::of(pose),
            });
            let new = origins.filter(|origin| !held.contains(origin));
            Ok(new.take(self.settings.per_image).collect::<Vec<_>>())
        })?;
        Ok(found.concat())
    }

    fn mistakes(
        &self,
        people: &[usize],
        held: &BTreeSet<&Origin>,
    ) -> Result<Vec<Origin>, TrainError> {
        let confuser = Confuser::new(self.model()?);
        let found = self.visit_all(people, |&person| {
            if self.right[person].is_none() {
                return Ok(None);
            }
            let (image, marked) = self.person(person, false)?;
            let wrong = confuser.worst(&image, &marked, self.settings.pose_margin);
            Ok(wrong.map(|pose| Origin::Mistake {
                person: person as u32,
                pose: Placed::of(&pose),
            }))
        })?;
        let found = found.into_iter().flatten();
        Ok(found.filter(|origin| !held.contains(origin)).collect())
    }

    /// The constraints of all origins.
    pub(super) fn constraints(&self, origins: &[Origin]) -> Result<Vec<Constraint>, TrainError> {
        let (of_people, of_images) = (self.model()?, self.mining_model()?);
        let same = |a: &Origin, b: &Origin| a.source() == b.source();
        let runs: Vec<&[Origin]> = origins.chunk_by(same).collect();
        let made = self.visit_all(&runs, |run| {
            let made = match run.first() {
                None => Some(Vec::new()),
                Some(Origin::Background { image, .. }) => {
                    self.of_background(&of_images, *image as usize, run)?
                }
                Some(Origin::Right { person, .. } | Origin::Mistake { person, .. }) => {
                    self.of_person(&of_people, *person as usize, run)?
                }
            };
            made.ok_or(TrainError::Moved)
        })?;
        Ok(made.into_iter().flatten().collect())
    }

    /// Returns `None` if a pose is not on the image.
    fn of_background(
        &self,
        model: &Model,
        image: usize,
        origins: &[Origin],
    ) -> Result<Option<Vec<Constraint>>, TrainError> {
        let picture = self.background(image)?;
        Ok(on_pyramid(model, &picture, |pyramid, layout| {
            let cells = self.cells(image, pyramid, layout);
            let constraint = |origin: &Origin| {
                let pose = on_layout(origin.pose(), layout)?;
                let wrong = Example::sharing(self.plan.shape(), &self.at, &cells, &pose);
                Some(Constraint {
                    x: wrong.features.negated(),
                    margin: 1.0 + wrong.fixed,
                })
            };
            origins.iter().map(constraint).collect()
        }))
    }

    /// Returns `None` if a pose is not on the image.
    fn of_person(
        &self,
        model: &Model,
        person: usize,
        origins: &[Origin],
    ) -> Result<Option<Vec<Constraint>>, TrainError> {
        let (image, marked) = self.person(person, false)?;
        Ok(on_pyramid(model, &image, |pyramid, layout| {
            let example = |placed: &Placed| {
                let pose = on_layout(placed, layout)?;
                let map = pyramid.level(usize::from(pose.level));
                let example = Example::of(self.plan.shape(), &self.at, &map, &pose);
                Some((pose, example))
            };
            let constraint = |origin: &Origin| {
                let (pose, shown) = example(origin.pose())?;
                let (x, margin) = if let Origin::Mistake { .. } = origin {
                    let (_, right) = example(self.right[person].as_ref()?)?;
                    let worst = self.settings.pose_margin;
                    let lost = loss(model, layout, &marked, worst).of_pose(model, &pose);
                    let margin = lost - (right.fixed - shown.fixed);
                    (right.features.minus(&shown.features), margin)
                } else {
                    (shown.features, 1.0 - shown.fixed)
                };
                Some(Constraint { x, margin })
            };
            origins.iter().map(constraint).collect()
        }))
    }

    /// The features of a background image, which are kept while examples use them.
    fn cells(&self, image: usize, pyramid: &FeaturePyramid<'_>, layout: &Layout) -> Arc<Cells> {
        let held = || self.cells.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(it) = held().get(&image) {
            return Arc::clone(it);
        }
        let cells = Arc::new(Cells::of(pyramid, layout.levels.len()));
        Arc::clone(held().entry(image).or_insert(cells))
    }
}

/// Returns the pose if it is on the image.
fn on_layout(placed: &Placed, layout: &Layout) -> Option<Pose> {
    let pose = placed.pose();
    let level = layout.levels.get(usize::from(pose.level))?;
    let lies = |placement: &Placement| {
        usize::from(placement.x) < level.cols && usize::from(placement.y) < level.rows
    };
    pose.parts.iter().all(lies).then_some(pose)
}

/// Runs `visit` on the features of an image if the image is large enough for the model.
fn on_pyramid<T>(
    model: &Model,
    image: &Picture,
    visit: impl FnOnce(&FeaturePyramid<'_>, &Layout) -> Option<T>,
) -> Option<T> {
    let view = image.view();
    let layout = Layout::new(model, view.width(), view.height()).ok()?;
    visit(&FeaturePyramid::new(model, view, &layout), &layout)
}
