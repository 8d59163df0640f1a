//! Compares the output of smoothing methods on a finished run with the ground truth at the same times.

use std::path::Path;

use failure::wording::Table;
use failure::{ExitKind, Failure, in_file};
use motion::finished::{self, Run};
use motion::judge::{self, Errors, Sum};
use motion::live;
use motion::{Joint, Motion, Recorded, Role, Settings, butterworth};
use nalgebra::Vector3;
use serde_json::{Value, json};
use statistics::score::{Bootstrap, Share};

/// Compared methods, in the order of the tables.
const METHODS: [&str; 5] = ["raw", "rts", "rts, constant bones", "butterworth", "kalman"];

/// A mean and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Confidence interval of the mean.
    pub interval: [f64; 2],
}

/// Errors of a method against the ground truth. Except for filled positions, means are over the joints and times for which every method has
/// a position.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the method.
    pub method: &'static str,
    /// Distance from the true position, in mm.
    pub position_mm: Option<Mean>,
    /// Error of the velocity by central differences, in m/s.
    pub velocity_m_s: Option<Mean>,
    /// Error of the acceleration by second differences, in m/s².
    pub acceleration_m_s2: Option<Mean>,
    /// Change of the error from one frame to the next, in mm.
    pub jitter_mm: Option<Mean>,
    /// Delay of the method, in ms.
    pub lag_ms: Option<Mean>,
    /// Distance from the true position, in mm, where the method has filled in a position without a measurement.
    pub filled_mm: Option<Mean>,
}

/// Comparison of all methods with the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Number of compared positions: one for each joint and time.
    pub n_compared: usize,
    /// A row for every method that has positions.
    pub rows: Vec<Row>,
}

/// The errors of a method at one time, and the distances of filled positions from the truth.
type Tried = (Errors, Sum);

/// Compares every smoothing method, and the raw measurements of a finished run, with the ground truth. The ground truth is for a single
/// person. It is compared with the person of the run who has the lowest id.
///
/// * `truth`: a sequence for `parallax-lab eval`: a folder of `parallax-lab synth`, or a description file.
///
/// # Errors
///
/// Fails if the ground truth cannot be read, has several sequences, or has no frame or joint in common with the run.
pub fn against(
    run: &Run,
    settings: &finished::Settings,
    truth_file: &Path,
) -> Result<Comparison, Failure> {
    let person = run
        .people
        .first()
        .ok_or_else(|| Failure::new(ExitKind::Input, "the run has no person in any frame"))?;
    let truth = truth(truth_file, &person.recorded, &run.frames)?;
    Ok(compare(&person.recorded, settings, &truth))
}

/// Returns the true joints at every time, in the order of the joints; `None` for an unknown joint.
fn truth(
    path: &Path,
    recorded: &Recorded,
    frames: &[u64],
) -> Result<Vec<Vec<Option<Vector3<f64>>>>, Failure> {
    let sequences = training::datasets::sequences::read(
        path,
        &training::datasets::sequences::Options::default(),
    )
    .map_err(|error| in_file(path, &error))?;
    let [sequence] = &sequences[..] else {
        let what = format!(
            "{}: found {} sequences, expected one",
            path.display(),
            sequences.len()
        );
        return Err(
            Failure::new(ExitKind::Usage, what).with_hint("name the folder of one sequence")
        );
    };
    let first = sequence.views.first().map_or(0, |view| view.first);
    let mut all = vec![vec![None; frames.len()]; recorded.joints.len()];
    let mut n_known = 0;
    for frame in &sequence.frames {
        let Ok(at) = frames.binary_search(&(first + frame.index)) else {
            continue;
        };
        for (joint, place) in sequence.joints.joints.iter().zip(&frame.joints) {
            let is_it = |known: &Joint| {
                let same_role = known.role.is_some() && known.role == Role::of(joint.name);
                known.name == joint.name || same_role
            };
            let known = recorded.joints.iter().position(is_it);
            if let (Some(known), Some(place)) = (known, place) {
                all[known][at] = Some(Vector3::from(*place));
                n_known += 1;
            }
        }
    }
    if n_known == 0 {
        let what = format!(
            "{}: the truth has none of the {} frames of the run (the first is {}), or none of its joints",
            path.display(),
            frames.len(),
            frames.first().copied().unwrap_or_default()
        );
        return Err(Failure::new(ExitKind::Input, what));
    }
    Ok(all)
}

/// Compares all methods.
///
/// Confidence intervals are computed by a bootstrap over blocks of one second.
///
/// * `truth`: true positions, by joint and time.
pub fn compare(
    recorded: &Recorded,
    settings: &finished::Settings,
    truth: &[Vec<Option<Vector3<f64>>>],
) -> Comparison {
    let tried = tried(recorded, settings, truth);
    let length_s = recorded.times.last().zip(recorded.times.first());
    let length_s = length_s.map_or(0.0, |(last, first)| last - first);
    let rate_hz = recorded.times.len() as f64 / length_s.max(1e-9);
    let bootstrap = Bootstrap {
        block: rate_hz.round().max(1.0) as usize,
        ..Bootstrap::default()
    };
    let n = tried.first().map_or(0.0, |tried| {
        tried.iter().map(|errors| errors.0.position_m.n).sum()
    });
    Comparison {
        n_compared: n as usize,
        rows: rows(&tried, &bootstrap),
    }
}

/// Returns the errors of every method at every time.
fn tried(
    recorded: &Recorded,
    settings: &finished::Settings,
    truth: &[Vec<Option<Vector3<f64>>>],
) -> Vec<Vec<Tried>> {
    let fill_s = settings.fill_s;
    let rts = |constant_bones: bool| {
        let settings = Settings {
            fill_s,
            constant_bones,
        };
        Some(motion::smooth(recorded, &settings))
    };
    let tracks: [Option<Motion>; 5] = [
        Some(motion::as_measured(recorded)),
        rts(false),
        rts(true),
        butterworth::filter(recorded, settings.cutoff_hz, fill_s).ok(),
        Some(live::over(recorded, fill_s)),
    ];
    let n = recorded.times.len();
    let mut all = vec![vec![Tried::default(); n]; tracks.len()];
    for (joint, truth) in truth.iter().enumerate() {
        let path = |track: &Option<Motion>| -> Option<Vec<Option<Vector3<f64>>>> {
            let track = &track.as_ref()?.joints[joint];
            Some(track.iter().map(|track| track.ok().map(|state| state.position)).collect())
        };
        let paths: Vec<_> = tracks.iter().map(path).collect();
        let has_all = |at: usize| paths.iter().flatten().all(|path| path[at].is_some());
        let counted: Vec<bool> = (0..n).map(|at| truth[at].is_some() && has_all(at)).collect();
        for (path, tried) in paths.iter().zip(&mut all) {
            let Some(path) = path else { continue };
            let mut errors = vec![Errors::default(); n];
            judge::add(&mut errors, &recorded.times, path, truth, &counted);
            for (at, it) in errors.iter().enumerate() {
                tried[at].0.add(it);
                let is_filled = recorded.joints[joint].measured[at].is_none();
                if let Some((it, truth)) = path[at].zip(truth[at]).filter(|_| is_filled) {
                    tried[at].1.sum += (it - truth).norm();
                    tried[at].1.n += 1.0;
                }
            }
        }
    }
    all
}

/// Returns a row for every method that has positions.
///
/// * `tried`: errors by method and time.
fn rows(tried: &[Vec<Tried>], bootstrap: &Bootstrap) -> Vec<Row> {
    let row = |(method, tried): (&&'static str, &Vec<Tried>)| {
        let mean = |factor: f64, of: &dyn Fn(&Tried) -> Sum| {
            let shares: Vec<Share> = tried
                .iter()
                .map(of)
                .map(|sum| Share {
                    sum: sum.sum,
                    n: sum.n,
                })
                .collect();
            let interval = bootstrap.interval(&shares)?;
            Some(Mean {
                mean: Share::mean(&shares)? * factor,
                interval: interval.map(|interval| interval * factor),
            })
        };
        Row {
            method,
            position_mm: mean(1e3, &|errors| errors.0.position_m),
            velocity_m_s: mean(1.0, &|errors| errors.0.velocity_m_s),
            acceleration_m_s2: mean(1.0, &|errors| errors.0.acceleration_m_s2),
            jitter_mm: mean(1e3, &|errors| errors.0.jitter_m),
            lag_ms: mean(1e3, &|errors| Sum {
                sum: errors.0.late[0],
                n: errors.0.late[1],
            }),
            filled_mm: mean(1e3, &|errors| errors.1),
        }
    };
    let rows = METHODS.iter().zip(tried).map(row);
    rows.filter(|row| row.position_mm.is_some()).collect()
}

impl Row {
    /// Returns the numbers with their names and units.
    pub fn numbers(&self) -> [(&'static str, Option<Mean>); 6] {
        [
            ("position_mm", self.position_mm),
            ("velocity_m_s", self.velocity_m_s),
            ("acceleration_m_s2", self.acceleration_m_s2),
            ("jitter_mm", self.jitter_mm),
            ("lag_ms", self.lag_ms),
            ("filled_mm", self.filled_mm),
        ]
    }

    /// Returns the comparison as JSON.
    pub fn to_json(&self) -> Value {
        let mut value = json!({ "method": self.method });
        for (name, mean) in self.numbers() {
            value[name] = mean.map_or(
                Value::Null,
                |mean| json!({ "mean": mean.mean, "interval": mean.interval }),
            );
        }
        value
    }
}

/// Returns rows as a text table.
pub fn table(rows: &[Row]) -> String {
    let mut table = Table::new([
        "<",
        "position mm",
        "velocity m/s",
        "acceleration m/s²",
        "jitter mm",
        "lag ms",
        "filled mm",
    ]);
    for row in rows {
        let numbers = row.numbers().map(|(_, mean)| {
            mean.map_or("-".to_owned(), |found| {
                let [low, high] = found.interval;
                format!("{:.2} ({low:.2} to {high:.2})", found.mean)
            })
        });
        table.row([row.method.to_owned()].into_iter().chain(numbers));
    }
    table.to_string()
}
