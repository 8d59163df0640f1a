//! Learning from sequences: learns from all people, then tries weights on held-out people.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::evaluation::{
    Bench, Combining, Film, FilmSettings, Setup, Terms, Trial, Version, score,
};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use fmp::Model;
use kernels::Rgb8View;
use multiview::learned::{Grid, Learned, Learner, Point, Settings, Shape, Tally, Weights, best};
use pipeline::{PairTables, SkeletonSettings, ViewSettings};
use statistics::score::Point as Joint;
use training::datasets::sequences::{Frame, Sequence};

use crate::failures::film_failure;

/// Numbers of bins to compare.
const BINS: [usize; 5] = [3, 6, 9, 12, 18];
/// Ridge parameters to compare, in units of the squared size of the person.
const RIDGES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// Settings of a training of consistency.
#[derive(Debug, Clone)]
pub struct Job {
    /// Largest number of held-out frames on which weights are tried. They are evenly spaced over all held-out frames.
    pub tries: usize,
    /// Name of the rig whose camera pairs are also learned by name.
    pub rig: Option<String>,
    /// True to learn joints as a map of the parts.
    pub with_joints: bool,
    /// Settings of the frames.
    pub film: FilmSettings,
    /// Identity of the model in the file.
    pub fingerprint: String,
}

/// A training of consistency.
#[derive(Debug)]
pub struct Learning<'a> {
    job: &'a Job,
    console: &'a dyn Console,
    model: Arc<Model>,
    stop: Stop,
    begin: Instant,
}

/// Result of a training.
#[derive(Debug)]
pub struct Done {
    /// Content of the file.
    pub learned: Learned,
    /// For each number of bins, how well tables with this number of bins predict the part types of held-out people.
    pub bins: Vec<(usize, Option<f64>)>,
    /// Ridge parameter, and root mean square error of the joints of held-out people. The first entry is the error without a map.
    pub joints: Vec<(Option<f64>, f64)>,
    /// Score that is reached if every view is solved alone.
    pub single: Option<Point>,
    /// All weights that were tried, with their scores.
    pub surface: Vec<Point>,
    /// Total time, in seconds.
    pub seconds: f64,
}

impl<'a> Learning<'a> {
    /// Prepares the training. The duration of the training is counted from here.
    pub fn new(job: &'a Job, console: &'a dyn Console, model: Arc<Model>, stop: Stop) -> Self {
        Self {
            job,
            console,
            model,
            stop,
            begin: Instant::now(),
        }
    }

    /// Learns the tables, and chooses the weights.
    ///
    /// * `keep`: stores results. It is called twice: with the default weights before weights are tried, and with the chosen weights.
    ///
    /// # Errors
    ///
    /// Fails if frames cannot be read, if nothing can be learned from them, if `keep` fails, or on a stop request
    /// ([`ExitKind::Interrupted`]).
    pub fn run(
        &self,
        train: &[Sequence],
        held: &[Sequence],
        keep: &dyn Fn(&Learned) -> Result<(), Failure>,
    ) -> Result<Done, Failure> {
        let learners = self.look(train, "learning")?;
        let others = self.look(held, "processing held-out people")?;
        let known = learners.iter().zip(&others);
        let bins: Vec<(usize, Option<f64>)> = BINS
            .iter()
            .zip(known)
            .map(|(n, (learner, other))| (*n, learner.lift_on(other)))
            .collect();
        let chosen = largest(bins.iter().map(|bin| bin.1));
        let (learner, other) = (&learners[chosen], &others[chosen]);
        let joints = joint_errors(learner, other);
        let ridge = smallest(&joints).filter(|_| self.job.with_joints);
        let first = self.learned(learner, Weights::default(), ridge)?;
        keep(&first)?;
        let tried = self.thinned(held);
        let (single, surface) = self.choose(&tried, &first)?;
        let weights = best(&surface).map_or(first.weights, |point| point.weights);
        let mut learned = self.learned(learner, weights, ridge)?;
        learned.learned.held_out = tried.iter().map(|tried| tried.frames.len() as u64).sum();
        keep(&learned)?;
        Ok(Done {
            learned,
            bins,
            joints,
            single,
            surface,
            seconds: self.begin.elapsed().as_secs_f64(),
        })
    }

    /// Returns some of the held-out frames, evenly spaced.
    fn thinned(&self, held: &[Sequence]) -> Vec<Sequence> {
        let n: usize = held.iter().map(|held| held.frames.len()).sum();
        let most = self.job.tries.min(n);
        let mut seen = 0;
        let thin = |sequence: &Sequence| {
            let mut sequence = sequence.clone();
            sequence.frames.retain(|_| {
                seen += 1;
                // True if the number of frames to keep has grown by one.
                seen * most / n > (seen - 1) * most / n
            });
            sequence
        };
        held.iter().map(thin).collect()
    }

    fn learned(
        &self,
        learner: &Learner,
        weights: Weights,
        ridge: Option<f64>,
    ) -> Result<Learned, Failure> {
        let rig = self.job.rig.as_deref();
        let learned = learner.learned(self.job.fingerprint.clone(), weights, rig, ridge);
        learned.or_fail(ExitKind::Input)
    }

    /// Learns from the poses of single views, for each number of bins.
    fn look(&self, sequences: &[Sequence], what: &str) -> Result<Vec<Learner>, Failure> {
        let shape = Shape::of(&self.model);
        let learner = |n_bins: usize| {
            let settings = Settings {
                n_bins,
                ..Settings::default()
            };
            Learner::new(shape.clone(), settings)
        };
        let mut learners = BINS.map(learner).to_vec();
        let by_name = self.job.rig.is_some();
        self.frames(sequences, what, &[], |bench, sequence, frame, images| {
            let truth: (&Sequence, &[Option<Joint>]) = (sequence, &frame.joints);
            bench.learn(&mut learners, truth, images, by_name);
        })?;
        Ok(learners)
    }

    /// Tries weights on held-out people: first for geometry, then for appearance with the best weight for geometry.
    fn choose(
        &self,
        held: &[Sequence],
        learned: &Learned,
    ) -> Result<(Option<Point>, Vec<Point>), Failure> {
        if held.iter().all(|sequence| sequence.frames.is_empty()) {
            return Ok((None, Vec::new()));
        }
        let grid = Grid::default();
        let alone = Weights {
            alpha: 0.0,
            beta: 0.0,
            ..Weights::default()
        };
        let mut tried = vec![alone];
        tried.extend(grid.geometry());
        let mut points = self.try_out(held, learned, &tried, "choosing alpha")?;
        let single = points.remove(0);
        let Some(geometry) = best(&points) else {
            return Ok((Some(single), points));
        };
        let tried = grid.appearance(&geometry.weights);
        points.extend(self.try_out(held, learned, &tried, "choosing beta")?);
        Ok((Some(single), points))
    }

    fn try_out(
        &self,
        held: &[Sequence],
        learned: &Learned,
        tried: &[Weights],
        what: &str,
    ) -> Result<Vec<Point>, Failure> {
        let tables = |weights: &Weights| PairTables {
            of_pairs: Vec::new(),
            by_angle: Some(Arc::new(learned.by_angle(weights.appearance))),
        };
        let trial = |weights: &Weights| Trial {
            version: version(weights),
            fuse: fusion(weights),
            tables: tables(weights),
        };
        let trials: Vec<Trial> = tried.iter().map(trial).collect();
        let mut tallies = vec![Tally::default(); trials.len()];
        self.frames(held, what, &trials, |bench, sequence, frame, images| {
            let found = bench.solve(images, &|_| None);
            for (tally, found) in tallies.iter_mut().zip(&found) {
                let score = score(sequence, frame, found);
                tally.add(&score.segments, &score.iterations);
            }
        })?;
        let points = tallies.iter().zip(tried);
        Ok(points.map(|(tally, weights)| tally.point(*weights)).collect())
    }

    /// Calls a function on every frame of all sequences.
    fn frames(
        &self,
        sequences: &[Sequence],
        what: &str,
        trials: &[Trial],
        mut visit: impl FnMut(&mut Bench, &Sequence, &Frame, &[Option<Rgb8View<'_>>]),
    ) -> Result<(), Failure> {
        let n: usize = sequences.iter().map(|sequence| sequence.frames.len()).sum();
        let (mut done, mut said) = (0, Instant::now());
        for sequence in sequences {
            let mut film = Film::open(sequence, &self.job.film).map_err(film_failure)?;
            let mut bench = self.bench(sequence, &film, trials)?;
            for frame in &sequence.frames {
                self.stop.check("interrupted").map_err(|failure| {
                    failure.with_hint(
                        "if weights were being tried, OUT contains the tables learned so far",
                    )
                })?;
                let images = film.at(frame.index).map_err(film_failure)?;
                visit(&mut bench, sequence, frame, &images);
                done += 1;
                if said.elapsed() > Duration::from_secs(5) || done == n {
                    said = Instant::now();
                    let text = format!("{what}: {done} of {n} instants");
                    self.console.message(&text);
                }
            }
        }
        Ok(())
    }

    fn bench(&self, sequence: &Sequence, film: &Film, trials: &[Trial]) -> Result<Bench, Failure> {
        let setup = Setup {
            model: Arc::clone(&self.model),
            view: ViewSettings::default(),
            skeleton: SkeletonSettings {
                joints: sequence.joints,
                ..SkeletonSettings::default()
            },
            joint_map: None,
            trials: trials.to_vec(),
        };
        let up = sequence.rig.up_in_world();
        let maps = film.footage_from_frame();
        Bench::new(setup, &film.cameras(), up, maps).or_fail(ExitKind::Input)
    }
}

fn version(weights: &Weights) -> Version {
    Version {
        terms: match (weights.alpha > 0.0, weights.beta > 0.0) {
            (false, _) => Terms::Single,
            (true, false) => Terms::Geometry,
            (true, true) => Terms::Appearance,
        },
        combining: Combining::Pairs,
    }
}

fn fusion(weights: &Weights) -> multiview::Settings {
    multiview::Settings {
        alpha: weights.alpha,
        beta: weights.beta,
        max_distance_cells: weights.max_distance_cells.unwrap_or(f64::INFINITY),
        ..multiview::Settings::default()
    }
}

/// Returns the root mean square error of the joints of held-out people for each ridge parameter. The first entry is the error without a
/// map.
fn joint_errors(learner: &Learner, other: &Learner) -> Vec<(Option<f64>, f64)> {
    let theirs = other.joints();
    let none = multiview::learned::JointFit::default();
    let mut errors = vec![(None, theirs.error_of(&none, 1.0))];
    let with = |ridge: f64| (Some(ridge), theirs.error_of(learner.joints(), ridge));
    errors.extend(RIDGES.map(with));
    let known = errors.into_iter();
    known.filter_map(|(ridge, it)| Some((ridge, it?.sqrt()))).collect()
}

fn smallest(errors: &[(Option<f64>, f64)]) -> Option<f64> {
    errors.iter().min_by(|a, b| a.1.total_cmp(&b.1))?.0
}

/// Returns the index of the largest value. If several values are equal or no value is known, returns the first index.
fn largest(values: impl Iterator<Item = Option<f64>>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (nth, value) in values.enumerate() {
        if value.is_some_and(|value| value > best.1) {
            best = (nth, value.unwrap_or(best.1));
        }
    }
    best.0
}
