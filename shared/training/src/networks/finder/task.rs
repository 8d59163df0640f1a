//! The training of the network that finds people: steps of Adam, with smaller pictures at first.

use formats::checksum::fnv1a;
use keypoints::DetectorCard;
use rayon::prelude::*;

use super::card::card;
use super::cost::{Cost, Truth};
use super::network::{CHANNELS, Shape, initial};
use super::picture::Picture;
use super::score::{Score, Tally};
use super::settings::Settings;
use super::vary::{FinderSample, plain, varied};
use crate::networks::course::{self, About, JUDGED_AT_ONCE, TooFew};
use crate::networks::lesson::Shown;
use crate::networks::optimiser::{Rule, Schedule, Step};
use crate::networks::order;
use crate::networks::parameters::Parameter;
use crate::networks::settings::Precision;
use crate::networks::training::{Batch, Costed, Plan, Task, Trainer};

/// Share of the steps in which the step length rises.
const RISING: f32 = 0.05;

/// The training of the network that finds people.
#[derive(Debug)]
pub struct FinderTask<'a> {
    settings: &'a Settings,
    learnt: &'a [Picture],
    kept: &'a [Picture],
    card: DetectorCard,
    from: Option<Vec<Parameter>>,
    stamp: u64,
}

impl<'a> FinderTask<'a> {
    /// Prepares a training run.
    ///
    /// * `learnt`, `kept`: training pictures, and held-out pictures for the evaluation.
    /// * `from`: the network read by [`begun`](super::begun), used instead of random parameters.
    ///
    /// # Errors
    ///
    /// Fails with [`TooFew`].
    ///
    /// # Panics
    ///
    /// Panics if the card that this crate writes is not valid.
    pub fn new(
        settings: &'a Settings,
        [learnt, kept]: [&'a [Picture]; 2],
        from: Option<Vec<Parameter>>,
    ) -> Result<Self, TooFew> {
        course::check(Self::LEARNED_FROM, [learnt.len(), kept.len()])?;
        let text = card(&settings.shape, &About::default());
        #[expect(clippy::expect_used, reason = "it was written here")]
        let card = DetectorCard::parse(&text).expect("a card");
        Ok(Self {
            settings,
            learnt,
            kept,
            card,
            stamp: stamp(settings, [learnt, kept], from.as_deref()),
            from,
        })
    }

    /// The network with the input size of a step.
    fn shape_at(&self, nth: usize) -> Shape {
        let settings = self.settings;
        if (nth as f32) < settings.small * settings.steps as f32 {
            settings.shape.smaller()
        } else {
            settings.shape.clone()
        }
    }

    fn sample(&self, at: usize, shape: &Shape) -> FinderSample {
        let seed = self.settings.seed;
        let picture = &self.learnt[order::shown(at, self.learnt.len(), seed)];
        let mut dice = order::dice(at, seed);
        varied(
            picture,
            self.learnt,
            (shape, &self.settings.vary),
            &mut dice,
        )
    }

    /// Returns the length of a step.
    fn rate(&self, nth: usize) -> f32 {
        let schedule = Schedule {
            steps: self.settings.steps,
            rising: RISING,
            longest: self.settings.rate,
        };
        schedule.length(nth)
    }
}

impl Task for FinderTask<'_> {
    type Network = Shape;
    type Truth = Truth;
    type Cost = Cost;
    type Score = Score;

    const LEARNED_FROM: &'static str = "pictures";

    fn stamp(&self) -> u64 {
        self.stamp
    }

    fn network(&self) -> Shape {
        self.settings.shape.clone()
    }

    fn precision(&self) -> Precision {
        self.settings.precision
    }

    fn begin(&self) -> Vec<Parameter> {
        self.from
            .clone()
            .unwrap_or_else(|| initial(&self.settings.shape, self.settings.seed))
    }

    fn seed(&self) -> u64 {
        self.settings.seed
    }

    fn n_steps(&self) -> usize {
        self.settings.steps
    }

    fn plan(&self, steps: usize, passes: usize) -> Plan {
        course::plan(self.settings.steps.saturating_sub(steps), passes)
    }

    fn learned(&self, _nth: usize, parameters: &[Parameter]) -> Vec<bool> {
        vec![true; parameters.len()]
    }

    fn step(&self, nth: usize) -> Step {
        let settings = self.settings;
        Step {
            rule: Rule::Adam,
            rate: self.rate(nth),
            decay: settings.decay,
            longest: settings.longest,
            averaged: course::averaged(nth, settings.averaged),
        }
    }

    fn batch(&self, nth: usize) -> Batch<Shape, Truth> {
        let n = self.settings.batch;
        let network = self.shape_at(nth);
        let seen: Vec<FinderSample> =
            (0..n).into_par_iter().map(|at| self.sample(nth * n + at, &network)).collect();
        let joined = |part: &dyn Fn(&FinderSample) -> &[f32]| -> Vec<f32> {
            seen.iter().flat_map(part).copied().collect()
        };
        Batch {
            shown: course::shown(&seen, |sample| &sample.picture),
            truth: Truth {
                heat: joined(&|sample| &sample.heat),
                sides: joined(&|sample| &sample.sides),
            },
            network,
        }
    }

    fn cost(&self, nth: usize, truth: &Truth, outputs: &[Vec<f32>]) -> Costed<Cost> {
        let cells = self.shape_at(nth).cells().pow(2);
        let found = outputs.first().map_or(&[][..], Vec::as_slice);
        let (cost, gradient) = truth.cost(found, cells, self.settings.sides);
        Costed {
            cost,
            gradients: vec![gradient],
        }
    }

    fn mean(&self, costs: &[(usize, Cost)]) -> Cost {
        Cost {
            heat: course::mean(costs, |cost| cost.heat),
            sides: course::mean(costs, |cost| cost.sides),
        }
    }

    fn score(&self, find: &dyn Fn(&Shown) -> Vec<Vec<f32>>) -> Score {
        let shape = &self.settings.shape;
        let n = CHANNELS * shape.cells().pow(2);
        let mut tally = Tally::default();
        for pictures in self.kept.chunks(JUDGED_AT_ONCE) {
            let seen: Vec<FinderSample> =
                pictures.par_iter().map(|picture| plain(picture, shape)).collect();
            let outputs = find(&course::shown(&seen, |sample| &sample.picture));
            let found = outputs.first().map_or(&[][..], Vec::as_slice);
            for (picture, found) in pictures.iter().zip(found.chunks_exact(n)) {
                tally.add(&picture.people, &self.boxes(picture, found));
            }
        }
        tally.score()
    }
}

impl FinderTask<'_> {
    /// Decodes the network's output to boxes, in pixels of the picture; no boxes if the output is not finite.
    fn boxes(&self, picture: &Picture, found: &[f32]) -> Vec<[f32; 4]> {
        let Shape { side, .. } = self.settings.shape;
        let cells = self.settings.shape.cells();
        let read = self.card.boxes(found, &[1, CHANNELS, cells, cells]);
        let [width, height] = picture.size;
        let step = width.max(height) as f64 / side as f64;
        let found = read.unwrap_or_default().into_iter();
        let outlines = found.map(|found| found.outline.map(|at| ((at + 0.5) * step - 0.5) as f32));
        outlines.collect()
    }
}

impl Trainer<FinderTask<'_>> {
    /// Returns the output `[n, 5, rows, columns]` of the trained network for pictures `[n, 3, side, side]`.
    pub fn find_in(&self, n: usize, pictures: &[f32]) -> Vec<f32> {
        let inputs = vec![pictures.to_vec()];
        let found = self.find(&Shown { n, inputs });
        found.into_iter().next().unwrap_or_default()
    }

    /// The trained network as an ONNX file.
    ///
    /// * `metadata`: keys and values of the file's metadata.
    pub fn onnx(&self, metadata: &[(String, String)]) -> Vec<u8> {
        self.file(course::document("boxes", metadata))
    }
}

/// Hash of everything that the result depends on.
fn stamp(settings: &Settings, pictures: [&[Picture]; 2], from: Option<&[Parameter]>) -> u64 {
    let samples = pictures.into_iter().flatten().map(|picture| {
        let truth = format!("{:?}{:?}", picture.size, picture.people);
        (fnv1a(&picture.rgb), truth)
    });
    course::stamp(settings, samples, from)
}
