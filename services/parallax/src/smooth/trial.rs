//! Smoothers tried on motions whose truth is known, with the errors that measured joints have.

mod noise;

use deployment::smooth::Config;
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use nalgebra::Vector3;
use scene::{Action, Scene};
use score::Bootstrap;
use serde_json::{Value, json};

use super::compare::{self, Row, Tried};
pub use noise::Flaws;

/// What is tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Every motion is done once with each: its subject, its performance and its errors.
    pub seeds: Vec<u64>,
    /// Instants a second.
    pub rates_hz: Vec<f64>,
    /// Standard deviation of the errors, millimetres.
    pub noises_mm: Vec<f64>,
    /// Length of a motion, seconds.
    pub seconds: f64,
}

impl Default for Trial {
    fn default() -> Self {
        Self {
            seeds: (101..=104).collect(),
            rates_hz: vec![10.0, 30.0, 60.0, 120.0],
            noises_mm: vec![3.0, 15.0, 50.0],
            seconds: 10.0,
        }
    }
}

/// The rows of one rate and size of the errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Instants a second.
    pub rate_hz: f64,
    /// Standard deviation of the errors, millimetres.
    pub noise_mm: f64,
    /// Motions.
    pub n_motions: usize,
    /// A row of every method.
    pub rows: Vec<Row>,
}

/// Tries every method on every motion.
///
/// # Errors
///
/// A scene that cannot be made, or a signal to stop.
pub fn run(trial: &Trial, stop: &Stop, console: &dyn Console) -> Result<Vec<Cell>, Failure> {
    let cells: Vec<[f64; 2]> = trial
        .rates_hz
        .iter()
        .flat_map(|&rate| trial.noises_mm.iter().map(move |&noise| [rate, noise]))
        .collect();
    let mut tried: Vec<Vec<Vec<Tried>>> =
        vec![vec![Vec::new(); compare::METHODS.len()]; cells.len()];
    let n = Action::ALL.len() * trial.seeds.len();
    for (nth, action) in Action::ALL.into_iter().enumerate() {
        for (seed_nth, &seed) in trial.seeds.iter().enumerate() {
            let settings = scene::Settings {
                subject: seed,
                action,
                seed,
                ..scene::Settings::default()
            };
            let scene = Scene::new(&settings).or_fail(ExitKind::Run)?;
            for (&[rate_hz, noise_mm], tried) in cells.iter().zip(&mut tried) {
                if stop.is_requested() {
                    return Err(Failure::new(ExitKind::Interrupted, "stopped"));
                }
                let number = seed.wrapping_mul(64).wrapping_add(nth as u64);
                let of_methods = one(&scene, number, rate_hz, noise_mm, trial.seconds);
                for (tried, it) in tried.iter_mut().zip(of_methods) {
                    tried.push(it);
                }
            }
            console.set(nth * trial.seeds.len() + seed_nth + 1, n);
        }
    }
    let cell = |([rate_hz, noise_mm], tried): ([f64; 2], Vec<Vec<Tried>>)| Cell {
        rate_hz,
        noise_mm,
        n_motions: n,
        rows: compare::rows(&tried, &Bootstrap::default()),
    };
    Ok(cells.into_iter().zip(tried).map(cell).collect())
}

/// The errors of every method on one motion.
fn one(scene: &Scene, number: u64, rate_hz: f64, noise_mm: f64, seconds: f64) -> Vec<Tried> {
    let n = (seconds * rate_hz).round().max(1.0) as usize;
    let times: Vec<f64> = (0..n).map(|it| it as f64 / rate_hz).collect();
    let places: Vec<_> = times.iter().map(|&it| scene.joints(it)).collect();
    let flaws = Flaws::of(noise_mm / 1000.0);
    let recorded = noise::recorded(&times, &places, &flaws, number);
    let path = |joint: usize| {
        places
            .iter()
            .map(|it| Some(Vector3::from(it[joint])))
            .collect()
    };
    let truth: Vec<Vec<_>> = (0..recorded.joints.len()).map(path).collect();
    let tried = compare::tried(&recorded, &Config::default(), &truth);
    let whole = |instants: Vec<Tried>| {
        instants.iter().fold(Tried::default(), |mut sum, it| {
            sum.0.add(&it.0);
            sum.1.sum += it.1.sum;
            sum.1.n += it.1.n;
            sum
        })
    };
    tried.into_iter().map(whole).collect()
}

impl Cell {
    /// For programs.
    pub fn to_json(&self) -> Value {
        let rows: Vec<Value> = self.rows.iter().map(Row::to_json).collect();
        json!({
            "rate_hz": self.rate_hz,
            "noise_mm": self.noise_mm,
            "motions": self.n_motions,
            "methods": rows,
        })
    }
}
