//! Evaluation of all sequences, frame by frame, with the results stored in files.

use std::fs::File;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use crate::evaluation::{
    Bench, Expectation, Film, FilmSettings, Header, Predicted, Record, Setup, SingleView, Trial,
    Version, parse14, part_errors, projected, read_records, tenth_of,
};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop, in_file, read_text};
use fmp::Model;
use multiview::learned::Learned;
use pipeline::{PairTables, SkeletonSettings, ViewSettings};
use skeleton::{JointMap, JointSet, PARSE14};
use training::datasets::sequences::{Frame, Sequence};
use viewquality::orientation::Detector;
use viewquality::{ForecastInput, Forecaster, Table};

use super::progress::Progress;
use crate::failures::film_failure;

/// Settings for solving the views of a sequence together, and the part-type tables of its cameras.
pub type Fusion = (multiview::Settings, PairTables);

/// Evaluation of every sequence.
pub struct Job<'a> {
    /// The single-view model.
    pub model: Arc<Model>,
    /// Returns the fusion settings of a sequence. The number is the scale of the frames: pixels of the frame per pixel of the footage,
    /// averaged over the views.
    pub fusion: &'a (dyn Fn(&Sequence, f32) -> Result<Fusion, Failure> + Sync),
    /// True to decide for every view whether the person is seen from the front or from behind.
    pub facing: bool,
    /// Returns the map from parts to the joints of a set; without a map, each joint is the centre of one part.
    pub joint_map: &'a (dyn Fn(&JointSet) -> Option<Arc<JointMap>> + Sync),
    /// Learned consistency between views.
    pub learned: Option<&'a Learned>,
    /// The versions to compare.
    pub versions: Vec<Version>,
    /// All settings that the results depend on; a run is resumed only with the same settings.
    pub settings: String,
    /// Settings of the frames.
    pub film: FilmSettings,
    /// Largest number of candidates in a view.
    pub n_candidates: usize,
    /// Detector of the direction in which a person faces.
    pub orientation: Option<Arc<Detector>>,
    /// Expected errors, in pixels of the footage.
    pub sigma: Option<Table>,
    /// Thresholds from the settings, in pixels of the footage; empty if there are none.
    pub tau_px: Vec<f32>,
    /// Network that predicts the errors.
    pub forecaster: Option<Mutex<Forecaster>>,
    /// True to use the true errors as the expected errors.
    pub oracle: bool,
    /// True to continue an earlier run from the results in `poses`.
    pub resume: bool,
    /// Folder for the results of every frame.
    pub poses: PathBuf,
    /// Stop request, checked after every frame.
    pub stop: Stop,
}

/// Results of an evaluation.
#[derive(Debug, Default)]
pub struct Done {
    /// Sequences that were started, with their results.
    pub sequences: Vec<(Sequence, Vec<Record>)>,
    /// Number of frames without footage.
    pub n_missing: usize,
}

impl Job<'_> {
    /// Solves all sequences on rayon's current pool, until a stop is requested.
    ///
    /// # Errors
    ///
    /// Fails if footage or cameras cannot be used, or if a file of results cannot be written or is from another run.
    pub fn run(&self, sequences: &[Sequence], console: &dyn Console) -> Result<Done, Failure> {
        let n_frames = sequences.iter().map(|sequence| sequence.frames.len()).sum();
        let mut progress = Progress::new(console, n_frames);
        let mut done = Done::default();
        for sequence in sequences {
            if self.stop.is_requested() {
                break;
            }
            let (records, n_missing) = self.sequence(sequence, &mut progress)?;
            done.n_missing += n_missing;
            done.sequences.push((sequence.clone(), records));
        }
        progress.end();
        Ok(done)
    }

    fn sequence(
        &self,
        sequence: &Sequence,
        progress: &mut Progress<'_>,
    ) -> Result<(Vec<Record>, usize), Failure> {
        let (mut kept, mut records) = self.keep(sequence)?;
        let is_done =
            |frame: &Frame| records.iter().any(|record: &Record| record.frame == frame.number);
        let open: Vec<&Frame> = sequence.frames.iter().filter(|frame| !is_done(frame)).collect();
        progress.passed_over(sequence.frames.len() - open.len());
        if open.is_empty() {
            return Ok((records, 0));
        }
        let mut film = Film::open(sequence, &self.film).map_err(film_failure)?;
        let mut bench = self.bench(sequence, &film)?;
        let scales: Vec<f32> = film.footage_from_frame().iter().map(scale).collect();
        let mut n_missing = 0;
        for frame in open {
            if self.stop.is_requested() {
                break;
            }
            let images = film.at(frame.index).map_err(film_failure)?;
            if images.iter().any(Option::is_none) {
                n_missing += 1;
                progress.passed_over(1);
                continue;
            }
            let truth = self.truth(sequence, frame, &bench);
            let predicted = Mutex::new(vec![None; sequence.views.len()]);
            let found = bench.solve(&images, &|look| {
                let view = look.view;
                let joints = truth.as_ref().and_then(|truth| truth[view].as_ref());
                if self.oracle {
                    let sigma = part_errors(look.centres, joints?, self.facing)?;
                    return Some(Expectation { sigma, tau: None });
                }
                if let Some(forecaster) = &self.forecaster {
                    let scale = f64::from(scales[view]);
                    let (expectation, judged) = self.forecast(forecaster, look, joints, scale)?;
                    predicted.lock().unwrap_or_else(PoisonError::into_inner)[view] = judged;
                    return Some(expectation);
                }
                self.looked_up(sequence, frame, view, scales[view])
            });
            let predicted = predicted.into_inner().unwrap_or_else(PoisonError::into_inner);
            let record = Record {
                frame: frame.number,
                found,
                predicted: if self.forecaster.is_some() {
                    predicted
                } else {
                    Vec::new()
                },
            };
            let line = serde_json::to_string(&record).or_fail(ExitKind::Run)?;
            writeln!(kept, "{line}").or_fail(ExitKind::Run)?;
            records.push(record);
            progress.solved(&sequence.name);
        }
        Ok((records, n_missing))
    }

    /// Returns the expected errors of a view from the table.
    fn looked_up(
        &self,
        sequence: &Sequence,
        frame: &Frame,
        view: usize,
        frame_scale: f32,
    ) -> Option<Expectation> {
        let table = self.sigma.as_ref()?;
        let camera = &sequence.views[view].camera;
        let number = i64::try_from(frame.number).ok()?;
        let sigma = table.get(&sequence.subject, &sequence.action, number, camera)?;
        Some(Expectation {
            sigma: sigma.iter().map(|sigma| sigma * frame_scale).collect(),
            tau: None,
        })
    }

    /// Returns the errors that the network predicts for a view; if the truth is known, also the predicted errors together with the true
    /// errors.
    ///
    /// * `joints`: the true joints in the frame.
    /// * `frame_scale`: pixels of the frame per pixel of the footage.
    fn forecast(
        &self,
        forecaster: &Mutex<Forecaster>,
        look: &SingleView<'_>,
        joints: Option<&Vec<[f64; 2]>>,
        frame_scale: f64,
    ) -> Option<(Expectation, Option<Predicted>)> {
        let seen = ForecastInput {
            image: look.image,
            on: (look.plan.model(), look.plan.layout()),
            candidates: &look.found.candidates,
            scores: &look.found.local,
            frame_scale,
        };
        let mut forecaster = forecaster.lock().unwrap_or_else(PoisonError::into_inner);
        let forecast = forecaster.run(&seen).inspect_err(
            |error| tracing::warn!(view = look.view, %error, "the network gives no prediction"),
        );
        let forecast = forecast.ok()?;
        let tenth = joints.map(|joint| tenth_of(joint));
        let tau_px: Vec<f32> = if !self.tau_px.is_empty() {
            self.tau_px.iter().map(|tau_px| tau_px * frame_scale as f32).collect()
        } else if forecast.tau_px.is_empty() {
            tenth.map_or_else(Vec::new, |tenth| {
                vec![tenth as f32; forecast.sigma_px.len()]
            })
        } else {
            forecast.tau_px
        };
        let judged = joints.zip(tenth).and_then(|(joints, tenth)| {
            let errors = part_errors(look.centres, joints, self.facing)?;
            Some(Predicted {
                sigma_px: forecast.sigma_px.clone(),
                tau_px: tau_px.clone(),
                error_px: errors.iter().map(|error| error * tenth as f32).collect(),
            })
        });
        let expectation = Expectation {
            sigma: forecast.sigma_px,
            tau: (!tau_px.is_empty()).then_some(tau_px),
        };
        Some((expectation, judged))
    }

    /// Opens the file for the results of a sequence, and reads the results that it already contains.
    fn keep(&self, sequence: &Sequence) -> Result<(File, Vec<Record>), Failure> {
        let name = format!("{} {}", sequence.dataset, sequence.name);
        let safe = |letter: char| {
            if letter.is_alphanumeric() {
                letter
            } else {
                '-'
            }
        };
        let file = self.poses.join(name.chars().map(safe).collect::<String>() + ".jsonl");
        let versions = self.versions.iter().map(ToString::to_string).collect();
        let header = Header::new(&sequence.name, &self.settings, versions);
        let wrong = |error: std::io::Error| in_file(&file, &error);
        let (mut records, mut n_bytes) = (Vec::new(), 0);
        if file.exists() {
            if !self.resume {
                let message = format!("{} already exists", file.display());
                let failure = Failure::new(ExitKind::Usage, message);
                return Err(failure.with_hint("continue it with --resume, or choose another --out"));
            }
            (records, n_bytes) = read_records(&read_text(&file)?, &header).map_err(|error| {
                let failure = in_file(&file, &error);
                failure.with_hint("remove it, or choose another --out")
            })?;
        }
        let folder = files::Folder::open(file.parent().unwrap_or(std::path::Path::new(".")));
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let opened = folder.and_then(|folder| folder.reopen(&name));
        let mut kept = opened.map_err(wrong)?;
        kept.set_len(n_bytes as u64).map_err(wrong)?;
        kept.seek(SeekFrom::End(0)).map_err(wrong)?;
        if n_bytes == 0 {
            let line = serde_json::to_string(&header).or_fail(ExitKind::Run)?;
            writeln!(kept, "{line}").map_err(wrong)?;
        }
        Ok((kept, records))
    }

    fn bench(&self, sequence: &Sequence, film: &Film) -> Result<Bench, Failure> {
        let maps = film.footage_from_frame();
        let mean = maps.iter().map(scale).sum::<f32>() / maps.len().max(1) as f32;
        let learned = self.learned;
        let (mut fuse, tables) = (self.fusion)(sequence, mean)?;
        if self.oracle {
            // The true errors are in tenths of the person's size.
            let tau = learned.filter(|_| !fuse.tau_tenths.is_empty());
            fuse.tau_px = match tau {
                Some(learned) => learned.tau_tenths.clone(),
                None => vec![1.0; self.model.n_parts()],
            };
            fuse.rescue_px = Vec::new();
        }
        let trial = |version: &Version| Trial::of(*version, &fuse, &tables);
        let setup = Setup {
            model: Arc::clone(&self.model),
            view: ViewSettings {
                n_candidates: self.n_candidates,
                orientation: self.orientation.clone(),
                ..ViewSettings::default()
            },
            trials: self.versions.iter().map(trial).collect(),
            joint_map: (self.joint_map)(&PARSE14),
            skeleton: SkeletonSettings {
                joints: sequence.joints,
                joint_map: (self.joint_map)(sequence.joints),
                facing: fuse.facing,
                // The true errors are not in pixels of the frame, so they are only used to switch parts on and off.
                error_weight: f64::from(u8::from(!self.oracle)),
                ..SkeletonSettings::default()
            },
        };
        let up = sequence.rig.up_in_world();
        Bench::new(setup, &film.cameras(), up, maps).or_fail(ExitKind::Input)
    }

    /// Returns the true joints in the frames of every view, if expected errors are derived from them or compared with them.
    fn truth(
        &self,
        sequence: &Sequence,
        frame: &Frame,
        bench: &Bench,
    ) -> Option<Vec<Option<Vec<[f64; 2]>>>> {
        let joints = parse14(sequence.joints, &frame.joints);
        let in_frame = |camera: &geometry::Camera| {
            let joints = projected(camera, [0.0; 2], &joints)?;
            Some(joints.to_vec())
        };
        let is_needed = self.oracle || self.forecaster.is_some();
        is_needed.then(|| bench.cameras().map(in_frame).collect())
    }
}

/// Pixels of the frame per pixel of the footage.
fn scale(footage_from_frame: &[[f64; 3]; 2]) -> f32 {
    let [[a, b, _], [c, d, _]] = footage_from_frame;
    (1.0 / (a * d - b * c).abs().sqrt()) as f32
}
