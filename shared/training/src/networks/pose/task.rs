//! The training of the network that finds joints: steps of Adam with growing pictures, then steps for the expected error alone.

use formats::checksum::fnv1a;
use rayon::prelude::*;

use super::cost::{Cost, Truth};
use super::network::{N_KEYPOINTS, Shape, initial};
use super::peak;
use super::person::Person;
use super::score::{Judged, Score};
use super::settings::Settings;
use super::vary::{NetworkSample, plain, varied};
use crate::networks::course::{self, JUDGED_AT_ONCE, TooFew};
use crate::networks::lesson::Shown;
use crate::networks::onnx;
use crate::networks::optimiser::{Rule, Schedule, Step};
use crate::networks::order;
use crate::networks::parameters::Parameter;
use crate::networks::settings::Precision;
use crate::networks::training::{Batch, Costed, Plan, Task, Trainer};

/// Number of consecutive people in the list that are assigned together to one of the two parts of [`KeptApart`].
const RUN: usize = 16;
/// Share of the steps in which the step length rises.
const RISING: f32 = 0.1;
/// Length of the steps that train only the expected error.
const ERROR_RATE: f32 = 3e-4;

/// Writes a network as an ONNX file, with weights in half precision.
///
/// * `parameters`: in the order of [`initial`].
/// * `metadata`: keys and values of the file's metadata.
///
/// # Panics
///
/// Panics if the parameters belong to a different network.
pub fn file(shape: &Shape, parameters: &[Parameter], metadata: &[(String, String)]) -> Vec<u8> {
    onnx::write(shape, parameters, course::document("pose", metadata))
}

/// Outputs of the network for pictures.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// Log-odds, `[n, keypoints, rows, columns]`.
    pub maps: Vec<f32>,
    /// Evidence for the direction, `[n, 2]`.
    pub fronts: Vec<f32>,
    /// Natural logarithms of the expected errors in heights of the input, `[n, keypoints]`.
    pub errors: Vec<f32>,
}

impl Found {
    fn new(outputs: Vec<Vec<f32>>) -> Self {
        let mut outputs = outputs.into_iter();
        let mut next = || outputs.next().unwrap_or_default();
        Self {
            maps: next(),
            fronts: next(),
            errors: next(),
        }
    }
}

/// Held-out people. The expected error is trained on some of them; all outputs are evaluated on the others.
#[derive(Debug)]
struct KeptApart<'a> {
    calibrating: Vec<&'a Person>,
    judged: Vec<&'a Person>,
}

impl<'a> KeptApart<'a> {
    /// Assigns groups of [`RUN`] people alternately to the two parts, because neighbouring pictures in a list may show the same person. If
    /// there are too few people, all are used for both.
    fn new(people: &'a [Person]) -> Self {
        let (calibrating, judged): (Vec<_>, Vec<_>) =
            people.iter().enumerate().partition(|(at, _)| (at / RUN).is_multiple_of(2));
        let people_of = |numbered: Vec<(usize, &'a Person)>| -> Vec<&'a Person> {
            numbered.into_iter().map(|(_, person)| person).collect()
        };
        if judged.len() < RUN {
            let all: Vec<&Person> = people.iter().collect();
            return Self {
                calibrating: all.clone(),
                judged: all,
            };
        }
        Self {
            calibrating: people_of(calibrating),
            judged: people_of(judged),
        }
    }
}

/// The training of the network that finds joints.
#[derive(Debug)]
pub struct PoseTask<'a> {
    settings: &'a Settings,
    learnt: Vec<&'a Person>,
    kept: KeptApart<'a>,
    from: Option<Vec<Parameter>>,
    stamp: u64,
}

impl<'a> PoseTask<'a> {
    /// Prepares a training run.
    ///
    /// * `learnt`, `kept`: training people, and held-out people for the evaluation and the training of the expected error.
    /// * `from`: the network read by [`begun`](super::begun), used instead of random parameters.
    ///
    /// # Errors
    ///
    /// Fails with [`TooFew`].
    pub fn new(
        settings: &'a Settings,
        [learnt, kept]: [&'a [Person]; 2],
        from: Option<Vec<Parameter>>,
    ) -> Result<Self, TooFew> {
        course::check(Self::LEARNED_FROM, [learnt.len(), kept.len()])?;
        Ok(Self {
            settings,
            stamp: stamp(settings, [learnt, kept], from.as_deref()),
            learnt: learnt.iter().collect(),
            kept: KeptApart::new(kept),
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

    /// Returns true if a step trains only the expected error.
    fn is_for_error(&self, nth: usize) -> bool {
        nth >= self.settings.steps
    }

    /// Returns the sample with a given number.
    fn sample(&self, people: &[&Person], at: usize, shape: &Shape) -> Option<NetworkSample> {
        let (settings, seed) = (self.settings, self.settings.seed);
        let person = people[order::shown(at, people.len(), seed)];
        let mut dice = order::dice(at, seed);
        let other = people[dice.usize(0..people.len())];
        varied(person, other, (shape, &settings.vary), &mut dice)
    }

    /// Returns the length of a step.
    fn rate(&self, nth: usize) -> f32 {
        if self.is_for_error(nth) {
            return ERROR_RATE;
        }
        let schedule = Schedule {
            steps: self.settings.steps,
            rising: RISING,
            longest: self.settings.rate,
        };
        schedule.length(nth)
    }
}

impl Task for PoseTask<'_> {
    type Network = Shape;
    type Truth = Truth;
    type Cost = Cost;
    type Score = Score;

    const LEARNED_FROM: &'static str = "people";

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
        let begin = || initial(&self.settings.shape, self.settings.seed);
        self.from.clone().unwrap_or_else(begin)
    }

    fn seed(&self) -> u64 {
        self.settings.seed
    }

    fn n_steps(&self) -> usize {
        self.settings.steps + self.settings.error_steps
    }

    /// Ends a pass at the step from which only the expected error is trained. That pass and the last one are evaluated.
    fn plan(&self, steps: usize, passes: usize) -> Plan {
        let end = if self.is_for_error(steps) {
            self.n_steps()
        } else {
            self.settings.steps
        };
        course::plan(end.saturating_sub(steps), passes)
    }

    fn restarts(&self, nth: usize) -> bool {
        nth == self.settings.steps
    }

    fn learned(&self, nth: usize, parameters: &[Parameter]) -> Vec<bool> {
        let is_learned = |parameter: &Parameter| {
            let layer = parameter.name.trim_start_matches("extra_");
            !self.is_for_error(nth) || layer.starts_with("error")
        };
        parameters.iter().map(is_learned).collect()
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
        let people = if self.is_for_error(nth) {
            &self.kept.calibrating
        } else {
            &self.learnt
        };
        let n = self.settings.batch;
        let network = self.shape_at(nth);
        let seen: Vec<NetworkSample> = (0..n)
            .into_par_iter()
            .filter_map(|at| self.sample(people, nth * n + at, &network))
            .collect();
        Batch {
            shown: course::shown(&seen, |sample| &sample.picture),
            truth: truth(&seen, &network),
            network,
        }
    }

    fn cost(&self, nth: usize, truth: &Truth, outputs: &[Vec<f32>]) -> Costed<Cost> {
        let [maps, front, error] = outputs else {
            return Costed {
                cost: Cost::default(),
                gradients: Vec::new(),
            };
        };
        let of_error = truth.of_error(error, maps);
        let of_maps = truth.of_maps(maps);
        let of_front = truth.of_front(front);
        let cost = Cost {
            maps: of_maps.cost,
            front: of_front.cost,
            error: of_error.cost,
        };
        let settings = self.settings;
        let scaled = |gradient: Vec<f32>, factor: f32| -> Vec<f32> {
            gradient.into_iter().map(|value| value * factor).collect()
        };
        let everything = f32::from(u8::from(!self.is_for_error(nth)));
        let gradients = vec![
            scaled(of_maps.gradient, everything),
            scaled(of_front.gradient, everything * settings.front),
            scaled(of_error.gradient, settings.error),
        ];
        Costed { cost, gradients }
    }

    fn mean(&self, costs: &[(usize, Cost)]) -> Cost {
        Cost {
            maps: course::mean(costs, |cost| cost.maps),
            front: course::mean(costs, |cost| cost.front),
            error: course::mean(costs, |cost| cost.error),
        }
    }

    fn score(&self, find: &dyn Fn(&Shown) -> Vec<Vec<f32>>) -> Score {
        score(find, &self.settings.shape, &self.kept.judged)
    }
}

impl Trainer<PoseTask<'_>> {
    /// Evaluates the trained network on people.
    pub fn judge(&self, people: &[Person]) -> Score {
        let people: Vec<&Person> = people.iter().collect();
        score(
            &|shown| self.find(shown),
            &self.task().settings.shape,
            &people,
        )
    }

    /// Returns the outputs of the trained network for pictures, `[n, 3, height, width]`.
    pub fn find_in(&self, n: usize, pictures: &[f32]) -> Found {
        let inputs = vec![pictures.to_vec()];
        Found::new(self.find(&Shown { n, inputs }))
    }

    /// The trained network as an ONNX file.
    ///
    /// * `metadata`: keys and values of the file's metadata.
    pub fn onnx(&self, metadata: &[(String, String)]) -> Vec<u8> {
        self.file(course::document("pose", metadata))
    }
}

fn truth(seen: &[NetworkSample], shape: &Shape) -> Truth {
    let maps = seen.iter().flat_map(|sample| &sample.maps);
    let places = seen.iter().flat_map(|sample| sample.places);
    Truth {
        cells: Truth::cells([shape.width, shape.height]),
        maps: maps.copied().collect(),
        weights: seen.iter().flat_map(|sample| sample.weights).collect(),
        fronts: seen.iter().flat_map(|sample| sample.front).collect(),
        places: places.flatten().collect(),
    }
}

fn score(find: &dyn Fn(&Shown) -> Vec<Vec<f32>>, shape: &Shape, people: &[&Person]) -> Score {
    let judged = people.chunks(JUDGED_AT_ONCE).flat_map(|people| {
        let seen: Vec<NetworkSample> =
            people.par_iter().filter_map(|person| plain(person, shape)).collect();
        let found = Found::new(find(&course::shown(&seen, |sample| &sample.picture)));
        let each = seen.iter().enumerate();
        let each = each.map(|(at, seen)| judged(&found, seen, (at, shape.cells())));
        each.collect::<Vec<Judged>>()
    });
    Score::new(&judged.collect::<Vec<Judged>>())
}

fn judged(found: &Found, seen: &NetworkSample, (at, cells): (usize, [usize; 2])) -> Judged {
    let [columns, rows] = cells;
    let size = columns * rows;
    let map = |joint: usize| {
        let from = (at * N_KEYPOINTS + joint) * size;
        &found.maps[from..from + size]
    };
    Judged {
        found: core::array::from_fn(|joint| peak(map(joint), columns)),
        expected: core::array::from_fn(|joint| found.errors[at * N_KEYPOINTS + joint]),
        front: core::array::from_fn(|axis| found.fronts[at * 2 + axis]),
        truth: seen.places,
        facing: seen.front,
    }
}

/// Hash of everything that the result depends on.
fn stamp(settings: &Settings, people: [&[Person]; 2], from: Option<&[Parameter]>) -> u64 {
    let samples = people.into_iter().flatten().map(|person| {
        let truth = format!("{:?}{:?}", person.targets, person.front);
        (fnv1a(&person.rgb), truth)
    });
    course::stamp(settings, samples, from)
}
