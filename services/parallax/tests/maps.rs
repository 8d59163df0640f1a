//! Tests of deployments whose evidence comes from the maps of a network or from another program's keypoints. The person consists of
//! fourteen dots, each in its own colour. A network with one layer finds them.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;
use crate::common::networks::{DETECTOR as DETECTOR_CARD, detector_of};

use core::fmt::Write as _;

use common::{Case, Ended};
use footage::{Canvas, Size};
use geometry::{Camera, Intrinsics, Lens, LensModel, Rig};
use inference::onnx::{Attribute, Network, Side};
use keypoints::{HALPE_26, LSP_14};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

pub(crate) const SIZE: [u32; 2] = [200, 240];
pub(crate) const N: usize = 14;
pub(crate) const N_FRAMES: usize = 40;
const RIGHT_WRIST: usize = 6;
/// Box of the detector, in pixels of its input.
const BOX: [f32; 4] = [8.0, 6.0, 46.0, 58.0];

/// Joints of `skeleton::PARSE14` of a person who stands with one arm raised, in metres, with z up.
const STANDING: [[f64; 3]; N] = [
    [0.02, -0.12, 0.08],
    [0.04, -0.11, 0.49],
    [0.0, -0.10, 0.92],
    [0.0, 0.10, 0.92],
    [0.05, 0.11, 0.49],
    [-0.02, 0.12, 0.08],
    [0.30, -0.30, 1.40],
    [0.10, -0.38, 1.28],
    [0.0, -0.19, 1.45],
    [0.0, 0.19, 1.45],
    [0.03, 0.24, 1.15],
    [0.08, 0.26, 0.88],
    [0.0, 0.0, 1.50],
    [0.02, 0.0, 1.76],
];

const CARD: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "Fourteen colours"
[input]
width = 96
height = 128
scale = 0.00909090909090909
mean = [1.16363636, 1.16363636, 1.16363636]
[crop]
fill = 128
[output]
codec = "heat-map"
[keypoints]
set = "lsp-14"
"#;

/// Returns fourteen directions in the space of colours, spread along a spiral.
fn directions() -> [[f64; 3]; N] {
    core::array::from_fn(|nth| {
        let z = 1.0 - (2.0 * nth as f64 + 1.0) / N as f64;
        let angle = nth as f64 * core::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let radius = (1.0 - z * z).sqrt();
        [radius * angle.cos(), radius * angle.sin(), z]
    })
}

/// Returns a network with a map for every colour. The map is 1 at full colour, and falls to 0 at three quarters of it.
fn network(bias: f32) -> Network {
    let mut net = Network::default();
    let sides = |n: [usize; 4]| n.map(Side::Fixed).to_vec();
    net.inputs.push(("picture".to_owned(), sides([1, 3, 128, 96])));
    net.outputs.push(("maps".to_owned(), sides([1, N, 128, 96])));
    let weights = directions().into_iter().flatten();
    let weights = weights.map(|weight| 4.0 * weight as f32);
    net.floats("weights", &[N, 3, 1, 1], weights.collect());
    net.floats("bias", &[N], vec![bias; N]);
    let one = vec![("kernel_shape", Attribute::Ints(vec![1, 1]))];
    if bias.is_nan() {
        // Relu would turn NaN into 0.
        net.node("Conv", &["picture", "weights", "bias"], "maps", one);
    } else {
        net.node("Conv", &["picture", "weights", "bias"], "sums", one);
        net.node("Relu", &["sums"], "maps", vec![]);
    }
    net
}

/// Returns four cameras around the person.
pub(crate) fn rig() -> Rig {
    let cameras = (0..4).map(|view| {
        let angle = 0.4 + 1.4 * f64::from(view);
        let eye = Point3::new(4.5 * angle.cos(), 4.5 * angle.sin(), 1.6);
        let at = Point3::new(0.0, 0.0, 0.9);
        let looking = Isometry3::look_at_rh(&eye, &at, &Vector3::z());
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
        Camera {
            name: format!("c{view}"),
            intrinsics: Intrinsics {
                fx: 400.0,
                fy: 400.0,
                cx: 99.5,
                cy: 119.5,
                size: SIZE,
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::from_parts(Translation3::identity(), turned) * looking,
        }
    });
    Rig::new(cameras.collect(), Some(Vector3::z_axis()), "dots").unwrap()
}

/// Returns the joints in a frame, in metres.
fn joints(frame: usize) -> [Point3<f64>; N] {
    joints_at(frame as f64)
}

/// Returns the joints at a time given in frames, in metres.
pub(crate) fn joints_at(frame: f64) -> [Point3<f64>; N] {
    let by = Vector3::new(0.005 * frame, 0.15 * (0.5 * frame).sin(), 0.0);
    STANDING.map(|standing| Point3::from(standing) + by)
}

/// Maps each joint to the joint whose name a view reports for it; 14 if the view does not see the joint.
pub(crate) type Named = fn(usize) -> usize;

pub(crate) fn as_it_is(joint: usize) -> usize {
    joint
}

/// Swaps left and right.
pub(crate) fn exchanged(joint: usize) -> usize {
    let pair = skeleton::SIDES.iter().find(|side| side.contains(&joint));
    pair.map_or(joint, |[a, b]| a + b - joint)
}

pub(crate) fn without_a_wrist(joint: usize) -> usize {
    if joint == RIGHT_WRIST { N } else { joint }
}

/// Returns the picture of a camera in a frame: dots on grey. Later joints are in front of earlier joints.
pub(crate) fn picture(camera: &Camera, frame: usize, named: Named) -> Canvas {
    let [width, height] = SIZE.map(|size| size as usize);
    let mut canvas = Canvas::new(Size::new(width, height), [128; 3]);
    for (joint, place) in joints(frame).iter().enumerate() {
        if named(joint) == N {
            continue;
        }
        let at = camera.project(place).unwrap();
        let colour =
            directions()[named(joint)].map(|direction| (128.0 + 110.0 * direction).round() as u8);
        canvas.disc(at.coords.into(), 4.0, colour);
    }
    canvas
}

/// Creates a deployment with these pictures.
///
/// * `view`: names that each view gives to the joints; `None` for a view that sees nothing.
pub(crate) fn case(name: &str, views: [Option<Named>; 4]) -> Case {
    let rig = rig();
    let case = Case::with_rig(&rig, name, &[0; 4], "");
    case.write("net.onnx", network(-3.0).file());
    case.write("net.toml", CARD);
    case.write("det.onnx", detector_of(BOX, 0.9).file());
    case.write("det.toml", DETECTOR_CARD);
    for (camera, named) in rig.cameras().iter().zip(views) {
        for frame in 0..N_FRAMES {
            let file = case.path(&camera.name).join(format!("{frame:04}.png"));
            let [width, height] = SIZE.map(|size| size as usize);
            let canvas = match named {
                Some(named) => picture(camera, frame, named),
                // Every picture is different, so the camera does not look frozen.
                None => Canvas::new(Size::new(width, height), [120 + frame as u8; 3]),
            };
            canvas.save_png(&file).unwrap();
        }
    }
    // The shipped model is not needed, because the detector finds the boxes.
    case.set_network("file = \"net.onnx\"\ndetector = \"det.onnx\"");
    case
}

pub(crate) fn run(case: &Case, more: &[&str]) -> Ended {
    case.start(&[&["run", "deployment.toml"], more].concat()).wait()
}

/// Returns the status of every frame, and the mean distance of its joints from the truth, in metres.
fn found(case: &Case) -> Vec<(String, f64)> {
    let text = std::fs::read_to_string(case.path("out/pose3d.jsonl")).unwrap();
    let frames = text.lines().map(|line| {
        let line: Value = serde_json::from_str(line).unwrap();
        let truth = joints(line["frame"].as_u64().unwrap() as usize);
        let names = skeleton::PARSE14.joints.iter().map(|joint| joint.name);
        let distance = |(name, truth): (&str, &Point3<f64>)| {
            let at = &line["people"][0]["joints"][name]["position_m"];
            let axis = |nth: usize| at[nth].as_f64();
            Some((Point3::new(axis(0)?, axis(1)?, axis(2)?) - truth).norm())
        };
        let each: Option<Vec<f64>> = names.zip(&truth).map(distance).collect();
        let mean = each.map_or(f64::INFINITY, |distances| {
            distances.iter().sum::<f64>() / distances.len() as f64
        });
        (line["status"].as_str().unwrap_or_default().to_owned(), mean)
    });
    frames.collect()
}

/// Largest accepted error, in metres: a third of a cell of the maps. The peaks of this artificial network are squares with a flat top.
const NEAR_M: f64 = 0.035;

#[track_caller]
fn all_are_near(case: &Case, metres: f64) {
    let found = found(case);
    assert_eq!(found.len(), N_FRAMES);
    for (frame, (status, error)) in found.iter().enumerate() {
        assert!(*error < metres, "frame {frame} ({status}): {error} m");
    }
}

#[test]
fn a_network_and_a_detector_are_all_that_a_deployment_needs() {
    let case = case("maps", [Some(as_it_is as Named); 4]);
    let searched = |more: &[&str]| {
        run(&case, more).ends(0);
        all_are_near(&case, NEAR_M);
        let lines = std::fs::read_to_string(case.path("out/pose2d.jsonl")).unwrap();
        ["full", "tracked"].map(|name| lines.matches(&format!("\"search\":\"{name}\"")).count())
    };
    // Pictures in a folder may have been taken at any time, so boxes are searched in every picture. At 20 frames per second, boxes are
    // searched in the first frame and in every tenth frame. The views take turns: their second searches are in frames 10, 8, 5 and 3.
    assert_eq!(searched(&[]), [160, 0]);
    assert_eq!(searched(&["--set", "capture.frame_rate_hz=20"]), [19, 141]);
}

#[test]
fn a_view_with_swapped_left_and_right_is_corrected() {
    let right = Some(as_it_is as Named);
    let case = case("sides", [right, right, Some(exchanged), right]);
    run(&case, &[]).ends(0);
    all_are_near(&case, NEAR_M);
}

#[test]
fn two_swapped_cameras_are_detected() {
    let case = case("swapped", [Some(as_it_is as Named); 4]);
    case.edit("deployment.toml", "source = \"c0\"", "source = \"cX\"");
    case.edit("deployment.toml", "source = \"c1\"", "source = \"c0\"");
    case.edit("deployment.toml", "source = \"cX\"", "source = \"c1\"");
    let ended = run(&case, &[]);
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stdout);
    assert!(
        ended.stderr.contains("c0") && ended.stderr.contains("swapped"),
        "{}",
        ended.stderr
    );
}

#[test]
fn only_the_joint_that_a_single_view_shows_is_missing() {
    let hidden = Some(without_a_wrist as Named);
    let case = case("wrist", [Some(as_it_is), hidden, hidden, hidden]);
    run(&case, &[]).ends(0);
    let text = std::fs::read_to_string(case.path("out/pose3d.jsonl")).unwrap();
    for line in text.lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let truth = joints(line["frame"].as_u64().unwrap() as usize);
        for (joint, truth) in skeleton::PARSE14.joints.iter().zip(truth) {
            let at = &line["people"][0]["joints"][joint.name]["position_m"];
            let axis = |nth: usize| at[nth].as_f64();
            let error = (|| Some((Point3::new(axis(0)?, axis(1)?, axis(2)?) - truth).norm()))();
            let is_hidden = joint.name == "right wrist";
            assert_eq!(error.is_none(), is_hidden, "{}: {line}", joint.name);
            assert!(error.unwrap_or(0.0) < 0.05, "{}: {error:?}", joint.name);
        }
    }
}

#[test]
fn a_view_without_people_is_listed_with_a_reason() {
    let right = Some(as_it_is as Named);
    let case = case("nobody", [right, None, right, right]);
    run(&case, &["--json"]).ends(0);
    all_are_near(&case, NEAR_M);
    let text = std::fs::read_to_string(case.path("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["summary"]["views_present"]["c1"], 0, "{summary}");
    assert_eq!(summary["summary"]["views_present"]["c0"], N_FRAMES);
}

#[test]
fn a_network_with_non_numeric_output_is_refused_before_the_start() {
    let case = case("nan", [Some(as_it_is as Named); 4]);
    case.write("net.onnx", network(f32::NAN).file());
    let ended = run(&case, &[]);
    assert_ne!(ended.status.code(), Some(0));
    ended.says("net.onnx");
    ended.says("maps");
}

#[test]
fn a_run_whose_detector_finds_nobody_has_no_result_and_reports_it() {
    let case = case("blind", [Some(as_it_is as Named); 4]);
    case.write("det.onnx", detector_of(BOX, 0.01).file());
    let ended = run(&case, &[]);
    assert!(
        ended.stdout.contains("3D            0 of 40 frames"),
        "{}",
        ended.stdout
    );
    assert!(ended.stdout.contains("40 empty"), "{}", ended.stdout);
    assert!(found(&case).iter().all(|frame| frame.1.is_infinite()));
}

#[test]
fn settings_of_the_paper_method_are_refused_together_with_a_network() {
    let case = case("beside", [Some(as_it_is as Named); 4]);
    for (set, words) in [
        ("paper.errors=shipped", "set `method = \"paper\"`"),
        ("paper.consistency=shipped", "set `method = \"paper\"`"),
        (
            "paper.views=all",
            "`paper.views` belongs to the paper's method",
        ),
    ] {
        let ended = run(&case, &["--set", set]);
        assert_ne!(ended.status.code(), Some(0), "{set}");
        assert!(ended.stderr.contains(words), "{set}: {}", ended.stderr);
    }
}

/// Returns the position of a keypoint in a frame: the position of the joint with the same name, or a point at the ankle, between the hips,
/// or at the head.
fn place(name: &str, frame: f64) -> Point3<f64> {
    let joints = joints_at(frame);
    let named = |name: &str| {
        let number = skeleton::PARSE14.joints.iter().position(|joint| joint.name == name);
        joints[number.unwrap()]
    };
    let by = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    match name.split_once(' ').unwrap_or((name, "")) {
        ("nose", _) => named("head") + by(0.1, -0.1),
        ("pelvis", _) => nalgebra::center(&named("left hip"), &named("right hip")),
        ("head", _) => named("head"),
        (side, "big toe" | "small toe") => named(&format!("{side} ankle")) + by(0.15, -0.05),
        (side, "heel") => named(&format!("{side} ankle")) + by(-0.05, -0.05),
        (_, "eye" | "ear") => named("head") + by(0.0, -0.05),
        _ => named(name),
    }
}

/// Replaces the pictures by keypoints in the layout of OpenPose.
///
/// * `names`: names of a set, as the view gives them to the keypoints.
pub(crate) fn with_keypoints(case: &Case, set: &str, names: impl Fn(usize) -> Vec<String>) {
    with_skewed_keypoints(case, set, names, [0.0; 4]);
}

/// Like [`with_keypoints`], for cameras that take their pictures some frames late.
fn with_skewed_keypoints(
    case: &Case,
    set: &str,
    names: impl Fn(usize) -> Vec<String>,
    skews: [f64; 4],
) {
    let rig = rig();
    let mut text = String::from("name = \"dots\"\nrig = \"rig.toml\"\noutput = \"out\"\n");
    text.push_str("[capture]\nframe_rate_hz = 30.0\n");
    for (view, camera) in rig.cameras().iter().enumerate() {
        let folder = case.path(&camera.name);
        for frame in 0..N_FRAMES {
            // There are no pictures if this is not the first call.
            let _gone = std::fs::remove_file(folder.join(format!("{frame:04}.png")));
            let names = names(view);
            let numbers = names.iter().map(|name| {
                let taken = frame as f64 + skews[view];
                let at = camera.project(&place(name, taken)).unwrap();
                format!("{:.2},{:.2},0.9", at.x, at.y)
            });
            let numbers: Vec<String> = numbers.collect();
            let file = folder.join(format!("{}_{frame:012}_keypoints.json", camera.name));
            let person = numbers.join(",");
            let json = format!("{{\"people\":[{{\"pose_keypoints_2d\":[{person}]}}]}}");
            std::fs::write(file, json).unwrap();
        }
        let name = &camera.name;
        writeln!(
            text,
            "[[camera]]\nname = {name:?}\nkeypoints = {name:?}\nkeypoint_names = {set:?}"
        )
        .unwrap();
        if skews[view] != 0.0 {
            writeln!(text, "skew_ms = {}", skews[view] * 1e3 / 30.0).unwrap();
        }
    }
    let own = std::fs::read_to_string(case.path("deployment.toml")).unwrap();
    let name = own.lines().find(|line| line.starts_with("name")).unwrap();
    case.write("deployment.toml", text.replacen("name = \"dots\"", name, 1));
}

#[test]
fn keypoint_files_replace_videos_and_a_damaged_file_loses_one_view_of_one_frame() {
    let case = case("json", [Some(as_it_is as Named); 4]);
    with_keypoints(&case, "lsp-14", |_| LSP_14.map(str::to_owned).to_vec());
    run(&case, &[]).ends(0);
    all_are_near(&case, NEAR_M);
    let damaged = case.path("c2").join("c2_000000000005_keypoints.json");
    std::fs::write(damaged, "{\"people\":[{\"pose_keypoints_2d\":[1,2").unwrap();
    let ended = run(&case, &[]);
    ended.says("c2_000000000005");
    all_are_near(&case, NEAR_M);
    let text = std::fs::read_to_string(case.path("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["summary"]["views_present"]["c2"], N_FRAMES - 1);
}

#[test]
fn extra_keypoints_of_other_programs_are_written_by_name() {
    let case = case("extra", [Some(as_it_is as Named); 4]);
    // The third view swaps the left and the right leg.
    let named = |view: usize, name: &str| {
        let leg = ["hip", "knee", "ankle", "toe", "heel"];
        let is_leg = leg.iter().any(|part| name.ends_with(part));
        let other = keypoints::mirrored(name).filter(|_| view == 2 && is_leg);
        other.unwrap_or_else(|| name.to_owned())
    };
    with_keypoints(&case, "halpe-26", |view| {
        HALPE_26.map(|name| named(view, name)).to_vec()
    });
    run(&case, &[]).ends(0);
    let read = |name: &str| std::fs::read_to_string(case.path(&format!("out/{name}"))).unwrap();
    for line in read("pose3d.jsonl").lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let frame = line["frame"].as_u64().unwrap() as usize;
        let extra = line["people"][0]["keypoints"].as_object().unwrap();
        assert_eq!(extra.len(), 12, "5 of the face, the pelvis, 6 of the feet");
        for (name, it) in extra {
            let at = &it["position_m"];
            let at = [0, 1, 2].map(|axis| at[axis].as_f64().unwrap_or(f64::NAN));
            let off = (Point3::from(at) - place(name, frame as f64)).norm();
            assert!(off < 0.01, "frame {frame}, {name}: {off} m");
            assert_eq!(it["views"].as_array().unwrap().len(), 4, "{name}");
        }
    }
    assert_eq!(read("pose3d.csv").lines().count(), 1 + N_FRAMES * 26);
    let trc = read("pose3d.trc");
    assert!(trc.contains("\tleft_heel\t"), "{trc}");
}

/// Returns the mean distances of the joints and of the extra keypoints from the truth in all frames except the first, in millimetres.
fn errors_mm(case: &Case) -> [f64; 2] {
    let found = found(case);
    let joints: f64 = found[1..].iter().map(|frame| frame.1).sum();
    let (mut extras, mut n) = (0.0, 0.0);
    for line in &case.lines("pose3d.jsonl")[1..] {
        for (name, it) in line["people"][0]["keypoints"].as_object().unwrap() {
            let at = [0, 1, 2].map(|axis| it["position_m"][axis].as_f64().unwrap());
            let frame = line["frame"].as_f64().unwrap();
            extras += (Point3::from(at) - place(name, frame)).norm();
            n += 1.0;
        }
    }
    [1e3 * joints / (found.len() - 1) as f64, 1e3 * extras / n]
}

#[test]
fn joints_from_pictures_with_a_skew_are_moved_to_the_instants_of_their_frames() {
    let case = case("skews", [Some(as_it_is as Named); 4]);
    let names = |_: usize| HALPE_26.map(str::to_owned).to_vec();
    let mut errors = Vec::new();
    for skews in [[0.0; 4], [0.0, -0.48, 0.25, 0.48]] {
        with_skewed_keypoints(&case, "halpe-26", names, skews);
        run(&case, &[]).ends(0);
        errors.push(errors_mm(&case));
    }
    let text = std::fs::read_to_string(case.path("deployment.toml")).unwrap();
    let untold = text.lines().filter(|line| !line.starts_with("skew_ms"));
    case.write("deployment.toml", untold.collect::<Vec<_>>().join("\n"));
    run(&case, &[]);
    errors.push(errors_mm(&case));
    let (without, told, untold) = (errors[0], errors[1], errors[2]);
    // For joints and for extra keypoints: an upper limit of the error if the skew is known, and the minimum factor by which the error grows
    // if the skew is unknown. Joints and their velocities depend on evidence whose positions are rounded to cells.
    for (which, most, more) in [(0, 2.5, 1.5), (1, 2.5, 2.0)] {
        let [told, untold] = [told, untold].map(|mm| mm[which] - without[which]);
        assert!(told < most && untold > more * told, "{errors:?}");
    }
}
