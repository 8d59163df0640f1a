//! Four real cameras around a balancing person: the effects of upright frames, of the facing direction, and of several candidates.
//!
//! Prints a table of the errors relative to the markerless reference, and checks that they are not larger than the errors reached so far.

use std::path::Path;
use std::sync::Arc;

use ::footage::{Fill, Size, Source, SourceSpec, Warp};
use formats::trc::Trc;
use geometry::{Camera, Framing, OutSize, Rig, upright_roll};
use kernels::Rgb8View;
use nalgebra::Point3;
use pipeline::{Combine, Estimator, EstimatorSettings, Views};
use skeleton::PARSE14;
use statistics::Sorted;
use viewquality::orientation::{Detector, Network};

use crate::shared_dir;

pub(crate) const SIZE: [u32; 2] = [272, 480];
/// Frames with an upright trunk.
const UPRIGHT: [usize; 5] = [0, 5, 10, 15, 20];
/// Frames in which the person is mostly bent over.
const BENT: [usize; 7] = [5, 15, 25, 35, 45, 55, 65];
/// If the torso of a view's pose is further than this from the torso of the reference, in pixels, the pose is on a wrong object.
const WRONG_PX: f64 = 40.0;

/// Options of one row of the table.
#[derive(Clone, Copy)]
struct Switches {
    upright: bool,
    facing: bool,
    candidates: bool,
    combine: Combine,
    views: Views,
}

/// Errors in a set of frames.
#[derive(Default)]
pub(crate) struct Errors {
    pub(crate) joints_cm: Vec<f64>,
    wrong_single: usize,
    wrong_fused: usize,
    n_views: usize,
}

impl Errors {
    pub(crate) fn median_and_p90(&self) -> [f64; 2] {
        let sorted = Sorted::new(&self.joints_cm[..]);
        [0.5, 0.9].map(|share| sorted.interpolated(share).unwrap())
    }

    fn describe(&self) -> String {
        let [median, p90] = self.median_and_p90();
        let (single, fused, n) = (self.wrong_single, self.wrong_fused, self.n_views);
        format!("{median:.1} / {p90:.1}, {single} -> {fused} of {n}")
    }
}

/// Returns the rows of the table: without any option, with each of the three options alone, and with all options.
fn rows() -> [(&'static str, Switches); 7] {
    let row = |upright, facing, candidates| Switches {
        upright,
        facing,
        candidates,
        combine: Combine::Mean,
        views: Views::Pairs,
    };
    let consensus = Switches {
        combine: Combine::Consensus,
        ..row(true, true, true)
    };
    let at_once = Switches {
        views: Views::All,
        ..row(true, true, true)
    };
    [
        ("nothing: the paper's own start", row(false, false, false)),
        ("upright only", row(true, false, false)),
        ("facing only", row(false, true, false)),
        ("candidates only", row(false, false, true)),
        ("all three", row(true, true, true)),
        ("all three, combined by consensus", consensus),
        ("all three, all views at once", at_once),
    ]
}

pub(crate) struct Clip {
    pub(crate) cameras: Vec<Camera>,
    /// Pictures as `[view][frame]`, with all frames up to the last frame that is needed.
    pub(crate) frames: Vec<Vec<Vec<u8>>>,
}

#[test]
#[ignore = "needs ../shared"]
fn errors_stay_below_the_recorded_values() {
    let Some(dir) = shared_dir() else { return };
    let rig = rig();
    let data = dir.join("data/pose2sim_balancing");
    let truth = reference(&data.join("reference_0-69.trc"));
    let model = Arc::new(fmp::files::read(&dir.join("data/models/parse_fmp.mat")).unwrap());
    let clips = [false, true].map(|upright| clip(&data, &rig, upright));
    println!(
        "| switched on | upright trunk: cm median / p90, wrong views single -> fused | mostly bent: the same |"
    );
    let mut reached = Vec::new();
    for (name, switches) in rows() {
        let clip = &clips[usize::from(switches.upright)];
        let all = errors(&model, &rig, clip, &truth, switches);
        let cells: Vec<String> = all.iter().map(Errors::describe).collect();
        println!("| {name} | {} | {} |", cells[0], cells[1]);
        reached.push(all);
    }
    let [.., mean, consensus, at_once] = &reached[..] else {
        panic!("three rows with everything switched on")
    };
    // Median and 90th percentile of the errors reached so far, in cm. In upright frames: 6.7 and 19.7 by the mean, 6.6 and 18.0 by
    // consensus, 6.4 and 15.9 with all views at once (goal: 7 and 15). In bent frames: 11.2 and 52.5 by the mean, 9.0 and 65.9 by
    // consensus, 8.3 and 59.4 with all views at once (goal: 17 and 50). In the upright frames, large errors are caused by crossed legs and
    // raised wrists. In the bent frames, they are caused by swapped sides, and by poses that differ from the training data.
    for ([upright, bent], [upright_cm, bent_cm]) in [
        (mean, [7.5, 13.0]),
        (consensus, [8.0, 11.0]),
        (at_once, [7.0, 11.0]),
    ] {
        assert_eq!(
            upright.wrong_fused, 0,
            "no view on a wrong object while the trunk is upright"
        );
        assert!(bent.wrong_fused <= 2, "{} views", bent.wrong_fused);
        assert!(
            upright.median_and_p90()[0] <= upright_cm,
            "upright median, cm"
        );
        assert!(bent.median_and_p90()[0] <= bent_cm, "bent median, cm");
    }
}

/// Returns the rig with the four cameras.
pub(crate) fn rig() -> Rig {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = root.join("configs/rigs/pose2sim-balancing.toml");
    geometry::files::read(&file, &geometry::files::ReadOptions::default()).unwrap()
}

/// Returns the shipped detector that determines whether a person is seen from the front or from behind.
fn orientation() -> Arc<Detector> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let bytes = std::fs::read(root.join("configs/models/person.orientation")).unwrap();
    Arc::new(Detector::new(Network::from_bytes(&bytes).unwrap()))
}

/// Returns the errors over [`UPRIGHT`] and [`BENT`]; every frame is estimated independently.
fn errors(
    model: &Arc<fmp::Model>,
    rig: &Rig,
    clip: &Clip,
    truth: &[Vec<Point3<f64>>],
    switches: Switches,
) -> [Errors; 2] {
    let mut settings = EstimatorSettings {
        views: switches.views,
        ..EstimatorSettings::default()
    };
    settings.view.orientation = switches.facing.then(orientation);
    settings.fuse.facing = switches.facing;
    settings.skeleton.facing = switches.facing;
    settings.skeleton.combine = switches.combine;
    if !switches.candidates {
        settings.fuse.n_candidates = 1;
        settings.view.n_candidates = 1;
    }
    let mut frames: Vec<usize> = UPRIGHT.into_iter().chain(BENT).collect();
    frames.sort_unstable();
    frames.dedup();
    let mut all = [Errors::default(), Errors::default()];
    for frame in frames {
        let mut estimator =
            Estimator::new(model, &clip.cameras, rig.up_in_world(), &settings).unwrap();
        let images: Vec<_> = clip
            .frames
            .iter()
            .map(|frames| Rgb8View::new(SIZE[0] as usize, SIZE[1] as usize, &frames[frame]).ok())
            .collect();
        let got = rayon::ThreadPoolBuilder::new()
            .build()
            .unwrap()
            .install(|| estimator.estimate(&images, &vec![None; images.len()]));
        let of_frame = compare(&got, &estimator, &clip.cameras, &truth[frame]);
        for (set, errors) in [&UPRIGHT[..], &BENT[..]].iter().zip(&mut all) {
            if set.contains(&frame) {
                errors.joints_cm.extend(&of_frame.joints_cm);
                errors.wrong_single += of_frame.wrong_single;
                errors.wrong_fused += of_frame.wrong_fused;
                errors.n_views += of_frame.n_views;
            }
        }
    }
    all
}

pub(crate) fn compare(
    got: &pipeline::Estimate,
    estimator: &Estimator,
    cameras: &[Camera],
    truth: &[Point3<f64>],
) -> Errors {
    let joints_cm = got
        .skeleton
        .joints
        .iter()
        .zip(truth)
        // A joint that could not be triangulated counts as an error of one metre.
        .map(|(joint, truth)| {
            joint.as_ref().map_or(100.0, |joint| 100.0 * (joint.in_world - truth).norm())
        })
        .collect();
    let mut errors = Errors {
        joints_cm,
        n_views: cameras.len(),
        ..Errors::default()
    };
    for (view, camera) in cameras.iter().enumerate() {
        let seen: Vec<[f64; 2]> = truth
            .iter()
            .map(|truth| camera.project(truth).map_or([f64::NAN; 2], |pixel| [pixel.x, pixel.y]))
            .collect();
        let target = torso(&seen);
        let off = |centres: &[[f64; 2]]| {
            let at = torso(&PARSE14.from_parts(centres));
            (at[0] - target[0]).hypot(at[1] - target[1]) > WRONG_PX
        };
        let single = got.answers[view].as_ref().unwrap();
        let single = estimator.plans()[view].centres(&single.candidates[0]);
        // A view that does not contribute to the frame does not count as being on a wrong object.
        let fused = got.skeleton.views[view].as_ref();
        errors.wrong_single += usize::from(off(&single));
        errors.wrong_fused += usize::from(fused.is_some_and(|fused| off(&fused.pose.centres_px)));
    }
    errors
}

/// Returns the middle of hips and shoulders.
fn torso(joints: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| [2, 3, 8, 9].iter().map(|&i| joints[i][axis]).sum::<f64>() / 4.0)
}

/// Returns the 14 joints in every frame in the world: TRC(X, Y, Z) is world(y, z, x).
pub(crate) fn reference(path: &Path) -> Vec<Vec<Point3<f64>>> {
    const NAMES: [&str; 14] = [
        "RAnkle",
        "RKnee",
        "RHip",
        "LHip",
        "LKnee",
        "LAnkle",
        "RWrist",
        "RElbow",
        "RShoulder",
        "LShoulder",
        "LElbow",
        "LWrist",
        "Neck",
        "Head",
    ];
    let trc = Trc::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    let columns = NAMES.map(|name| trc.marker(name).unwrap());
    trc.frames
        .iter()
        .map(|frame| {
            let at = |column: usize| frame[column].map(|[x, y, z]| Point3::new(z, x, y)).unwrap();
            columns.map(at).to_vec()
        })
        .collect()
}

pub(crate) fn clip(data: &Path, rig: &Rig, upright: bool) -> Clip {
    let mut clip = Clip {
        cameras: Vec::new(),
        frames: Vec::new(),
    };
    for camera in rig.cameras() {
        let path = data.join("videos").join(format!("{}.mp4", camera.name));
        let spec = SourceSpec {
            count: Some(66),
            ..SourceSpec::new(path.to_str().unwrap())
        };
        let mut source = Source::open(&spec).unwrap();
        let size = source.info().size;
        let roll = if upright {
            upright_roll(camera, rig).unwrap()
        } else {
            0.0
        };
        // Two of the videos lack the eight rightmost columns of the calibrated sensor.
        let framing = Framing::new(
            camera,
            [size.width as u32, size.height as u32],
            Some([0, 0]),
            OutSize::Exact(SIZE),
            roll,
        )
        .unwrap();
        let out = Size::new(SIZE[0] as usize, SIZE[1] as usize);
        let mut warp = Warp::new(size, out, &framing.source_from_output(), Fill::Black).unwrap();
        let mut frames = Vec::new();
        while let Some(frame) = source.next_frame().unwrap() {
            let mut image = vec![0; out.rgb_bytes()];
            warp.apply(frame.rgb, &mut image);
            frames.push(image);
        }
        clip.cameras.push(framing.camera().clone());
        clip.frames.push(frames);
    }
    clip
}
