//! `parallax train consistency`: what several views of a person have in common, from sequences with truth.

mod report;
mod work;

use std::path::PathBuf;
use std::process::ExitCode;

use ::consistency::Learned;
use clap::Args;
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use sequences::Sequence;

use crate::commands::eval::{size, unread};
use crate::globals::Globals;
use crate::inputs;
use work::Work;

const HELP: &str = "\
SEQUENCE is what `parallax eval` takes: a folder of HumanEva-I, of UMPM, of `parallax synth`, or a description. \
Every view is solved alone; of the parts that are near the truth it is learned which types come together in \
two views, by the angle between the cameras as seen from the person, and with --rig NAME for the pairs of \
that rig by the cameras' names too. The median error of every part is its threshold (tau); joints are a linear \
map of the parts by least squares. Then alpha, the cap on distances and beta are chosen on subjects that \
were held out: those of the largest area under the curve of PCP3D.

The file belongs beside the model it was learned with: `consistency = \"person.consistency\"` in the [fuse] section \
of a deployment, or --consistency of `fuse-frame` and `eval`. Its format: cargo doc -p consistency, `Learned`.

With --json one object: the weights, every choice that was tried and how it did, tau, what the tables know of held-out \
people by the number of bins, the error of joints with and without the map.

Exit codes: 0 done; 2 the command line; 4 a sequence or a model, or nothing could be learned; 5 a calibration; 130 \
interrupted; OUT then holds the tables with the default weights, if weights were being tried.

Examples:
    parallax synth out/ring --rig ring:6 --subjects 1-8 --actions walking,boxing,gestures --frames 6 --rate 1
    parallax train consistency out/ring --scale 0.5 --out person.consistency
    parallax train consistency HumanEva_I --model he.txt --rig humaneva --hold-out S3 --out he.consistency";

/// What to learn from, and how.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The sequences.
    #[arg(required = true, value_name = "SEQUENCE")]
    sequences: Vec<PathBuf>,
    /// The model file; the person model that ships with Parallax if not given.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Subjects that the weights are chosen on, separated by commas; without it the last fourth of them.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    hold_out: Vec<String>,
    /// Most instants of the subjects held out that weights are tried on, evenly over all of them.
    #[arg(long, value_name = "N", default_value_t = 48)]
    tries: usize,
    /// Learn the pairs of these cameras by name too; all sequences are of one rig.
    #[arg(long, value_name = "NAME")]
    rig: Option<String>,
    /// Leave joints as they are, each at its own parts.
    #[arg(long)]
    no_joints: bool,
    /// Size of the frames.
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with = "scale")]
    size: Option<[u32; 2]>,
    /// Size of the frames as a share of the footage's.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Do not turn the frames upright.
    #[arg(long)]
    no_upright: bool,
    /// Take the first and every so many-th frame after it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Most frames of each sequence.
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Threads; one a core if not given. The file does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print what was found as JSON.
    #[arg(long)]
    json: bool,
}

/// Learns.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let (train, held) = split(sequences(arguments)?, &arguments.hold_out)?;
    if let Some(rig) = &arguments.rig {
        one_rig(&train.iter().chain(&held).collect::<Vec<_>>(), rig)?;
    }
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let bytes = inputs::model_bytes(arguments.model.as_deref())?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads.map_or(0, usize::from))
        .build()
        .or_fail(ExitKind::Run)?;
    let work = Work::new(arguments, globals, model, stop);
    let fingerprint = format!("{:016x}", checksum::fnv1a(&bytes));
    let keep = |learned: &Learned| {
        let text = learned.write().or_fail(ExitKind::Run)?;
        let wrong = |error: std::io::Error| inputs::in_file(&arguments.out, &error);
        std::fs::write(&arguments.out, text).map_err(wrong)
    };
    let done = pool.install(|| work.run(&train, &held, &fingerprint, &keep))?;
    report::say(arguments, globals, &done)?;
    Ok(ExitCode::SUCCESS)
}

fn sequences(arguments: &Arguments) -> Result<Vec<Sequence>, Failure> {
    let mut all: Vec<Sequence> = Vec::new();
    for path in &arguments.sequences {
        let read = sequences::read(path, &sequences::Options::default());
        for mut it in read.map_err(unread)? {
            it.thin_out(arguments.every, arguments.frames);
            all.push(it);
        }
    }
    Ok(all)
}

/// Those that are learned from, and those that the weights are chosen on.
fn split(
    all: Vec<Sequence>,
    hold_out: &[String],
) -> Result<(Vec<Sequence>, Vec<Sequence>), Failure> {
    let mut subjects: Vec<&str> = all.iter().map(|it| it.subject.as_str()).collect();
    subjects.sort_by_key(|it| (it.len(), *it));
    subjects.dedup();
    if let Some(unknown) = hold_out.iter().find(|it| !subjects.contains(&it.as_str())) {
        let known = subjects.join(", ");
        let message = format!("--hold-out: there is no subject {unknown:?}, only {known}");
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let held: Vec<String> = if hold_out.is_empty() {
        let n = subjects.len().div_ceil(4);
        let last = subjects.iter().rev().take(n);
        last.map(|it| (*it).to_owned()).collect()
    } else {
        hold_out.to_vec()
    };
    let (held, train): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|it| held.contains(&it.subject));
    if train.is_empty() {
        let message = "all subjects are held out: nobody is left to learn from";
        let failure = Failure::new(ExitKind::Usage, message);
        return Err(failure.with_hint("sequences of at least two subjects are needed"));
    }
    Ok((train, held))
}

/// Sees that all sequences have the same cameras.
fn one_rig(all: &[&Sequence], rig: &str) -> Result<(), Failure> {
    let cameras = |it: &Sequence| -> Vec<String> {
        let views = it.views.iter();
        views.map(|it| it.camera.clone()).collect()
    };
    for pair in all.windows(2) {
        if cameras(pair[0]) != cameras(pair[1]) {
            let other = pair[1];
            let message = format!(
                "--rig {rig}: {} {} has other cameras than the sequence before it",
                other.dataset, other.name
            );
            return Err(Failure::new(ExitKind::Usage, message));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use geometry::Rig;
    use skeleton::PARSE14;

    use super::*;

    /// One camera; what it sees does not matter here.
    fn rig() -> Rig {
        let camera = geometry::Camera {
            name: "c1".to_owned(),
            intrinsics: geometry::Intrinsics {
                fx: 300.0,
                fy: 300.0,
                cx: 160.0,
                cy: 120.0,
                size: [320, 240],
                lens: geometry::Lens::default(),
            },
            camera_from_world: nalgebra::Isometry3::identity(),
        };
        Rig::new(vec![camera], None, "made up").unwrap()
    }

    fn sequence(subject: &str) -> Sequence {
        Sequence {
            name: subject.to_owned(),
            dataset: String::new(),
            subject: subject.to_owned(),
            action: String::new(),
            rig: rig(),
            views: Vec::new(),
            joints: &PARSE14,
            frames: Vec::new(),
        }
    }

    fn held(subjects: &[&str], hold_out: &[&str]) -> Result<Vec<String>, String> {
        let all = subjects.iter().map(|it| sequence(it)).collect();
        let hold_out: Vec<String> = hold_out.iter().map(|it| (*it).to_owned()).collect();
        let (_, held) = split(all, &hold_out).map_err(|it| it.to_string())?;
        Ok(held.into_iter().map(|it| it.subject).collect())
    }

    #[test]
    fn the_last_fourth_of_the_subjects_is_held_out() {
        let subjects = ["s1", "s2", "s3", "s9", "s10", "s10", "s4", "s5"];
        assert_eq!(held(&subjects, &[]).unwrap(), ["s9", "s10", "s10"]);
        assert_eq!(held(&["s1", "s2"], &["s1"]).unwrap(), ["s1"]);
    }

    #[test]
    fn somebody_must_be_left_to_learn_from() {
        assert!(held(&["s1"], &[]).unwrap_err().contains("nobody is left"));
        let said = held(&["s1", "s2"], &["s3"]).unwrap_err();
        assert!(said.contains("no subject \"s3\", only s1, s2"), "{said}");
    }
}
