//! `parallax fuse-frame`: fuses one synchronised set of still images, in this process.

mod expected;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use deployment::fuse::{Tau, TauName};
use fmp::Model;
use footage::{Fill, Size, Source, SourceSpec, Warp};
use geometry::files::ReadOptions;
use geometry::{Framing, OutSize, Rig, upright_roll};
use kernels::Rgb8View;
use launch::inputs::{self, Joints};
use launch::{frame_scale, output};
use pipeline::{Estimate, Estimator, EstimatorSettings, SkeletonSettings, ViewSettings};
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::{Value, json};
use skeleton::JointSet;

use crate::describe::{self, NamedJoints, Placed};
use expected::sigma;

/// The energy of fusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Energy {
    /// The paper's.
    Paper,
    /// That of the authors' program; by default with one candidate per view and without `facing`.
    Released,
}

/// Options of `parallax fuse-frame`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
    parallax fuse-frame --rig rig.toml --model he.txt C1.png C2.png --json
    parallax fuse-frame --rig rig.toml --model he.txt --energy released --no-upright \\
        --ptc C1wrtC2.csv --ptc C2wrtC1.csv C1=one.png C2=two.png --json")]
pub(crate) struct Arguments {
    /// One image per camera, in the order of the rig; or CAMERA=FILE for some cameras.
    #[arg(required = true)]
    images: Vec<String>,
    /// The calibration.
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// The model file; the person model that ships with Parallax if not given.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The energy.
    #[arg(long, value_enum, default_value_t = Energy::Paper)]
    energy: Energy,
    /// Learned consistency: part-type tables, weights, thresholds, joints; "shipped": the one that ships.
    #[arg(long, value_name = "FILE")]
    consistency: Option<PathBuf>,
    /// Where joints lie among the parts: a file that `train joints` made; "shipped": the one for the model that ships;
    /// "none": a joint is the centre of its part, as for other models.
    #[arg(long, value_name = "FILE", default_value = deployment::SHIPPED)]
    joint_map: PathBuf,
    /// What tells in which direction a person faces (`train orientation`); "shipped"; "none".
    #[arg(long, value_name = "FILE", default_value = deployment::SHIPPED)]
    orientation: PathBuf,
    /// Weight of the geometric term; if not given, the learned one, or the default of the energy.
    #[arg(long)]
    alpha: Option<f64>,
    /// Weight of the part-type term.
    #[arg(long)]
    beta: Option<f64>,
    /// Part-type tables of the first two views: given twice, `first wrt second` and `second wrt first`.
    #[arg(long, value_name = "FILE")]
    ptc: Vec<PathBuf>,
    /// File of expected errors in pixels: one line per view, one number per part.
    #[arg(long, value_name = "FILE")]
    sigma: Option<PathBuf>,
    /// Thresholds of the expected errors: none, learned, humaneva or umpm.
    #[arg(long, value_enum, default_value_t = Threshold::None)]
    tau: Threshold,
    /// Maximal number of candidates per view.
    #[arg(long, value_name = "N")]
    candidates: Option<usize>,
    /// Decide which views see the person from behind; by default true with `paper`, false with `released`.
    #[arg(long, value_name = "BOOL")]
    facing: Option<bool>,
    /// Do not turn the images upright.
    #[arg(long)]
    no_upright: bool,
    /// Ignore lens distortion: treat the cameras as pinholes.
    #[arg(long)]
    no_lens: bool,
    /// Size of the frames as a share of that of the images.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Maximal number of solutions per pair.
    #[arg(long, value_name = "N")]
    max_iterations: Option<usize>,
    /// Mean movement below which a view counts as converged, pixels.
    #[arg(long, value_name = "PX")]
    epsilon: Option<f64>,
    /// Joints: parse14, umpm15 or humaneva20.
    #[arg(long, value_name = "NAME", default_value = "parse14", value_parser = describe::joint_set)]
    joints: &'static JointSet,
    /// How the poses of a view from its pairs are combined.
    #[arg(long, value_enum, default_value_t = Combine::Mean)]
    combine: Combine,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// How the poses of a view from its pairs are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Combine {
    /// Their mean, as in the paper.
    Mean,
    /// Part by part, the pair poses that are consistent over all views.
    Consensus,
}

/// Named sets of thresholds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Threshold {
    /// No part is switched off.
    None,
    /// Those of --consistency.
    Learned,
    /// Those of the authors' program for HumanEva.
    Humaneva,
    /// Those of the authors' program for UMPM.
    Umpm,
}

/// A view with its framed image.
struct View {
    file: String,
    framing: Framing,
    rgb: Vec<u8>,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let rig = inputs::rig(
        std::slice::from_ref(&arguments.rig),
        &ReadOptions::default(),
    )?;
    let views = views(arguments, &rig)?;
    let settings = settings(arguments, &model, &views)?;
    let cameras: Vec<_> = views.iter().map(|it| it.framing.camera().clone()).collect();
    let joint_map = settings.skeleton.joint_map.clone();
    let estimator = Estimator::new(&model, &cameras, rig.up_in_world(), &settings);
    let mut estimator = estimator.or_fail(ExitKind::Input)?;
    let scales: Vec<f32> = views
        .iter()
        .map(|it| frame_scale(&it.framing) as f32)
        .collect();
    let sigma = sigma(arguments.sigma.as_deref(), &scales, model.n_parts())?;
    let mut images = Vec::new();
    for view in &views {
        let [width, height] = view.framing.out_size().map(|it| it as usize);
        images.push(Some(
            Rgb8View::new(width, height, &view.rgb).or_fail(ExitKind::Input)?,
        ));
    }
    let estimate = estimator.estimate(&images, &sigma);
    let report = Report {
        views: &views,
        model: &model,
        estimator: &estimator,
        estimate: &estimate,
        joints: NamedJoints {
            set: arguments.joints,
            map: joint_map,
        },
    };
    if arguments.json {
        output::json(&report.json())?;
    } else {
        report.print()?;
    }
    let is_found = estimate.skeleton.joints.iter().any(Result::is_ok);
    launch::no_results::require(is_found, "no joint has a place in space")
}

/// The cameras with an image, in the order of the rig, with their framed images.
fn views(arguments: &Arguments, rig: &Rig) -> Result<Vec<View>, Failure> {
    let n = rig.cameras().len();
    let mut files: Vec<Option<&str>> = vec![None; n];
    for (index, argument) in arguments.images.iter().enumerate() {
        let named = argument.split_once('=').and_then(|(name, file)| {
            let camera = rig.cameras().iter().position(|it| it.name == name)?;
            Some((camera, file))
        });
        let (camera, file) = named.unwrap_or((index, argument));
        let slot = files.get_mut(camera).ok_or_else(|| {
            let message = format!("{argument}: the rig has only {n} cameras");
            Failure::new(ExitKind::Usage, message)
        })?;
        *slot = Some(file);
    }
    let given = files.into_iter().enumerate();
    given
        .filter_map(|(camera, file)| Some((camera, file?)))
        .map(|(camera, file)| view(arguments, rig, camera, file))
        .collect()
}

fn view(arguments: &Arguments, rig: &Rig, camera: usize, file: &str) -> Result<View, Failure> {
    let mut camera = rig.cameras()[camera].clone();
    if arguments.no_lens {
        camera.intrinsics.lens = geometry::Lens::default();
    }
    let spec = SourceSpec {
        rotation: inputs::rotation(file, &camera.name, rig),
        ..SourceSpec::new(file)
    };
    let mut source = Source::open(&spec).or_fail(ExitKind::Input)?;
    let size = source.info().size;
    let roll = if arguments.no_upright {
        0.0
    } else {
        upright_roll(&camera, rig).unwrap_or(0.0)
    };
    let source_size = [size.width as u32, size.height as u32];
    let framing = Framing::new(
        &camera,
        source_size,
        None,
        OutSize::Scale(arguments.scale),
        roll,
    );
    let framing = framing.or_fail(ExitKind::Calibration)?;
    let [width, height] = framing.out_size().map(|it| it as usize);
    let output = Size::new(width, height);
    let warp = Warp::new(size, output, &framing.source_from_output(), Fill::Black);
    let mut rgb = vec![0; output.rgb_bytes()];
    if let Some(frame) = source.next_frame().or_fail(ExitKind::Input)? {
        warp.or_fail(ExitKind::Input)?.apply(frame.rgb, &mut rgb);
    }
    Ok(View {
        file: file.to_owned(),
        framing,
        rgb,
    })
}

/// The `[fuse]` settings from the command line.
fn config(arguments: &Arguments) -> deployment::fuse::Config {
    let defaults = deployment::fuse::Config::default();
    let is_released = arguments.energy == Energy::Released;
    deployment::fuse::Config {
        energy: if is_released {
            deployment::fuse::Energy::Released
        } else {
            deployment::fuse::Energy::Paper
        },
        alpha: arguments.alpha,
        beta: arguments.beta,
        tau: Tau::Named(match arguments.tau {
            Threshold::None => TauName::None,
            Threshold::Learned => TauName::Learned,
            Threshold::Humaneva => TauName::HumanEva,
            Threshold::Umpm => TauName::Umpm,
        }),
        facing: arguments.facing.unwrap_or(!is_released),
        max_iterations: arguments.max_iterations.unwrap_or(defaults.max_iterations),
        epsilon_px: arguments.epsilon.unwrap_or(defaults.epsilon_px),
        ..defaults
    }
}

fn settings(
    arguments: &Arguments,
    model: &Model,
    views: &[View],
) -> Result<EstimatorSettings, Failure> {
    let learned = inputs::learned(arguments.consistency.as_deref(), model)?;
    if arguments.tau == Threshold::Learned && learned.is_none() {
        let message = "--tau learned needs --consistency";
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let config = config(arguments);
    let view = ViewSettings::default();
    let n_candidates = match (arguments.candidates, arguments.energy) {
        (Some(n), _) => n,
        (None, Energy::Released) => 1,
        (None, Energy::Paper) => view.n_candidates,
    };
    let names: Vec<&str> = views
        .iter()
        .map(|it| it.framing.camera().name.as_str())
        .collect();
    let mut tables = inputs::pair_tables(&config, learned.as_ref(), model, &names)?;
    match &arguments.ptc[..] {
        [] => (),
        [first, second] => {
            let own = inputs::type_tables([first, second], model)?;
            tables.of_pairs.push((0, 1, own));
        }
        _ => {
            return Err(Failure::new(
                ExitKind::Usage,
                "--ptc is given twice, or not at all",
            ));
        }
    }
    let scale = views.iter().map(|it| frame_scale(&it.framing)).sum::<f64>() / views.len() as f64;
    let joints = Joints::of(&arguments.joint_map, arguments.model.as_deref())?;
    Ok(EstimatorSettings {
        fuse: fuse::settings(&config, n_candidates, scale as f32, learned.as_ref()),
        view: ViewSettings {
            n_candidates,
            orientation: inputs::orientation(&arguments.orientation, model)?,
            ..view
        },
        tables,
        views: pipeline::Views::Pairs,
        follow: pipeline::Follow::default(),
        skeleton: SkeletonSettings {
            joints: arguments.joints,
            joint_map: joints.map(learned.as_ref(), arguments.joints),
            combine: match arguments.combine {
                Combine::Mean => pipeline::Combine::Mean,
                Combine::Consensus => pipeline::Combine::Consensus,
            },
            facing: config.facing,
            ..SkeletonSettings::default()
        },
    })
}

/// The report on an estimate.
struct Report<'a> {
    views: &'a [View],
    model: &'a Arc<Model>,
    estimator: &'a Estimator,
    estimate: &'a Estimate,
    joints: NamedJoints,
}

impl Report<'_> {
    fn pose(&self, view: usize, pose: &fmp::Pose) -> Value {
        let layout = self.estimator.plans()[view].layout();
        Placed::new(pose, self.model, layout)
            .in_footage(&self.views[view].framing)
            .json(Some(&self.joints))
    }

    fn json(&self) -> Value {
        let views: Vec<Value> = (0..self.views.len()).map(|it| self.view(it)).collect();
        let pairs: Vec<Value> = self.estimate.pairs.iter().map(|it| self.pair(it)).collect();
        let joints = self
            .joints
            .set
            .joints
            .iter()
            .zip(&self.estimate.skeleton.joints);
        let joints: serde_json::Map<String, Value> = joints
            .map(|(joint, it)| {
                let value = match it {
                    Ok(it) => json!({
                        "position_m": <[f64; 3]>::from(it.in_world.coords),
                        "reprojection_px": it.reprojection_px,
                        "views": (0..self.views.len()).filter(|view| it.uses(*view)).map(|view| self.name(view)).collect::<Vec<_>>(),
                    }),
                    Err(error) => json!({ "error": error.to_string() }),
                };
                (joint.name.to_owned(), value)
            })
            .collect();
        json!({
            "schema_version": 1,
            "views": views,
            "pairs": pairs,
            "facing_margin": self.estimate.skeleton.facing_margin,
            "people": self.estimate.skeleton.people.iter().map(|it| json!({
                "candidates": it.candidates,
                "place_m": <[f64; 3]>::from(it.place.coords),
                "strength": it.strength,
                "size_px": it.size_px,
            })).collect::<Vec<_>>(),
            "joints": joints,
        })
    }

    fn name(&self, view: usize) -> &str {
        &self.views[view].framing.camera().name
    }

    fn view(&self, view: usize) -> Value {
        let answer = self.estimate.answers[view].as_ref();
        let candidates = answer.map(|it| {
            let each = it.candidates.iter();
            each.map(|pose| self.pose(view, pose)).collect::<Vec<_>>()
        });
        let fused = self.estimate.skeleton.views[view].as_ref();
        json!({
            "name": self.name(view),
            "image": self.views[view].file,
            "candidates": candidates,
            "start": self.estimate.start[view].map(|it| it.0),
            "behind": fused.map(|it| it.exchanged),
            "fused": fused.map(|it| json!({
                "energy": it.pose.energy,
                "pairs": it.pose.n_pairs,
                "parts": it.pose.centres_px.iter().map(|[x, y]| {
                    let at = self.views[view].framing.source_from_output().map(|row| row[0] * x + row[1] * y + row[2]);
                    json!({ "x": at[0], "y": at[1] })
                }).collect::<Vec<_>>(),
            })),
        })
    }

    fn pair(&self, pair: &pipeline::PairResult) -> Value {
        let hypotheses: Vec<Value> = pair
            .hypotheses
            .iter()
            .map(|hypothesis| {
                let iterations: Vec<Value> = hypothesis
                    .iterations
                    .iter()
                    .map(|step| {
                        let view = pair.views[step.target];
                        json!({
                            "view": self.name(view),
                            "score": step.score,
                            "moved_px": step.moved_px,
                            "pose": self.pose(view, &step.pose),
                        })
                    })
                    .collect();
                json!({
                    "exchanged": hypothesis.start.exchanged,
                    "energy": hypothesis.energy,
                    "converged": hypothesis.converged,
                    "active": hypothesis.active,
                    "iterations": iterations,
                    "poses": [self.pose(pair.views[0], &hypothesis.poses[0]), self.pose(pair.views[1], &hypothesis.poses[1])],
                })
            })
            .collect();
        json!({ "views": pair.views.map(|it| self.name(it)), "hypotheses": hypotheses })
    }

    fn print(&self) -> Result<(), Failure> {
        for (view, answer) in self.estimate.answers.iter().enumerate() {
            let best = answer.as_ref().and_then(|it| it.candidates.first());
            let score = best.map_or("nobody found".to_owned(), |it| {
                format!("score {:.4}, level {}", it.score, it.level + 1)
            });
            output::line(format_args!("{}: {score}", self.name(view)))?;
        }
        for pair in &self.estimate.pairs {
            for fused in &pair.hypotheses {
                let facing = if fused.start.exchanged {
                    "opposite"
                } else {
                    "same"
                };
                output::line(format_args!(
                    "{} - {}, {facing} facing: energy {:.4} after {} iterations{}",
                    self.name(pair.views[0]),
                    self.name(pair.views[1]),
                    fused.energy,
                    fused.iterations.len(),
                    if fused.converged { "" } else { ", not settled" }
                ))?;
            }
        }
        for (joint, it) in self
            .joints
            .set
            .joints
            .iter()
            .zip(&self.estimate.skeleton.joints)
        {
            match it {
                Ok(it) => output::line(format_args!(
                    "  {:<20} {:8.3} {:8.3} {:8.3} m  {:6.2} px",
                    joint.name, it.in_world.x, it.in_world.y, it.in_world.z, it.reprojection_px
                ))?,
                Err(error) => output::line(format_args!("  {:<20} {error}", joint.name))?,
            }
        }
        Ok(())
    }
}
