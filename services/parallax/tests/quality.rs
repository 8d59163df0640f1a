//! Tests of deployments in which a network predicts expected errors from the frames.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::sync::Arc;

use common::{Case, PLAIN, planted};
use fmp::{Layout, Scope};
use inference::onnx::{Network, Side};
use kernels::Rgb8View;
use multiview::ViewPlan;
use nalgebra::Point3;
use pipeline::{BodySettings, SkeletonSettings, SkeletonStep, ViewResult, ViewSettings, ViewStep};
use serde_json::{Value, json};
use viewquality::{Card, ForecastInput, Forecaster, Unit, n_evidence};

const N_PARTS: usize = 26;

/// Returns a network with `sigma` of part `i` = mean red of the tile + `i` / 8 + response of part 1, at least 0. A part is switched off if
/// its `sigma` exceeds `tau`.
fn network(tau: f32) -> Network {
    let k = n_evidence(N_PARTS);
    let mut net = Network::default();
    let tile = [
        Side::Named("n"),
        Side::Fixed(3),
        Side::Fixed(40),
        Side::Fixed(16),
    ];
    net.inputs.push(("tile".to_owned(), tile.to_vec()));
    let evidence = vec![Side::Named("n"), Side::Fixed(k)];
    net.inputs.push(("evidence".to_owned(), evidence));
    let sigma = vec![Side::Named("n"), Side::Fixed(N_PARTS)];
    net.outputs.push(("sigma".to_owned(), sigma));
    let red = |value: usize| if value < N_PARTS { 0.05 } else { 0.0 };
    net.floats("w", &[3, N_PARTS], (0..3 * N_PARTS).map(red).collect());
    let bias = (0..N_PARTS).map(|i| i as f32 / 800.0);
    net.floats("b", &[N_PARTS], bias.collect());
    let first = |value: usize| if value < N_PARTS { 0.01 } else { 0.0 };
    net.floats("v", &[k, N_PARTS], (0..k * N_PARTS).map(first).collect());
    net.node("GlobalAveragePool", &["tile"], "mean", vec![]);
    net.node("Flatten", &["mean"], "flat", vec![]);
    net.node("Gemm", &["flat", "w", "b"], "seen", vec![]);
    net.node("MatMul", &["evidence", "v"], "known", vec![]);
    net.node("Add", &["seen", "known"], "sigma", vec![]);
    let card = Card {
        evidence: Some(viewquality::EVIDENCE_VERSION),
        unit: Unit::Relative,
        tau: vec![tau; N_PARTS],
        ..Card::default()
    };
    let entries = card.entries().into_iter();
    net.metadata = entries.map(|(name, value)| (name.to_owned(), value)).collect();
    net
}

/// Returns the search of a view, and its pyramid layout.
fn step_of(plan: &ViewPlan) -> (ViewStep, Arc<Layout>) {
    let layout = Arc::new(plan.layout().clone());
    let step = ViewStep::new(
        planted::model(),
        Arc::clone(&layout),
        ViewSettings::default(),
    );
    (step, layout)
}

#[test]
fn the_service_and_the_library_predict_the_same() {
    let more = PLAIN.to_owned() + "errors = \"q.onnx\"\n";
    let case = Case::new("network", &[8; 2], &more);
    let file = network(0.02).file();
    case.write("q.onnx", &file);
    case.run().ends(0);
    let lines = case.lines("pose2d.jsonl");
    assert_eq!(lines.len(), 16);
    let network = viewquality::Network::parse(file, N_PARTS).unwrap();
    let mut forecaster = Forecaster::new(network);
    let (rig, model) = (planted::rig(2), planted::model());
    let [width, height] = planted::SIZE.map(|size| size as usize);
    // No frame waits for the network. On a loaded machine, a frame may have been processed without it.
    let mut n_late = 0;
    for (view, camera) in rig.cameras().iter().enumerate() {
        let (step, layout) = step_of(&pipeline::plan(&model, camera).unwrap());
        let mut responses = vec![0.0; layout.n_responses()];
        for frame in 0..8 {
            let picture = planted::picture(camera, frame);
            let image = Rgb8View::new(width, height, picture.rgb()).unwrap();
            let found = step.run(image, Scope::whole(&layout), &mut responses);
            let seen = ForecastInput {
                image,
                on: (&model, &layout),
                candidates: &found.candidates,
                scores: &found.local,
                frame_scale: 1.0,
            };
            let forecast = forecaster.run(&seen).unwrap();
            assert!(
                forecast.sigma_px.iter().any(|value| *value > 0.0),
                "nothing to compare"
            );
            let line = &lines[frame * 2 + view];
            if line["sigma_px"].is_null() {
                n_late += 1;
                continue;
            }
            let at = format!("frame {frame}, view {view}");
            assert_eq!(line["sigma_px"], json!(forecast.sigma_px), "{at}");
            assert_eq!(line["sigma_used"], json!(0), "{at}");
        }
    }
    assert!(n_late <= 4, "{n_late} of 16 without expected errors");
}

/// Returns the candidates of every view, each for its own frame.
fn answers(plans: &[Arc<ViewPlan>], frames: &[usize]) -> Vec<Option<ViewResult>> {
    let [width, height] = planted::SIZE.map(|size| size as usize);
    let say = |(plan, frame): (&Arc<ViewPlan>, &usize)| {
        let (step, layout) = step_of(plan);
        let mut responses = vec![0.0; layout.n_responses()];
        let picture = planted::picture(plan.camera(), *frame);
        let image = Rgb8View::new(width, height, picture.rgb()).unwrap();
        let found = step.run(image, Scope::whole(&layout), &mut responses);
        Some(ViewResult {
            candidates: found.candidates,
            front: found.front,
            sigma_px: None,
            tau_px: None,
            skew_s: 0.0,
        })
    };
    plans.iter().zip(frames).map(say).collect()
}

#[test]
fn a_joint_follows_the_views_with_small_expected_errors() {
    let (rig, model) = (planted::rig(4), planted::model());
    let plans = rig.cameras().iter().map(|camera| pipeline::plan(&model, camera));
    let plans: Vec<_> = plans.collect::<Result<_, _>>().unwrap();
    let joints = |answers: &[Option<ViewResult>], error_weight: f64| -> Vec<Point3<f64>> {
        let settings = SkeletonSettings {
            error_weight,
            body: BodySettings::NONE,
            facing: false,
            ..SkeletonSettings::default()
        };
        let mut step = SkeletonStep::new(plans.clone(), None, settings);
        let found = step.run(answers, &[]).joints.into_iter();
        found.map(|joint| joint.unwrap().in_world).collect()
    };
    // The first view answers for a different frame than the other views.
    let mut answers = answers(&plans, &[7, 0, 0, 0]);
    let unaware = joints(&answers, 1.0);
    let first = answers[0].take();
    let others = joints(&answers, 1.0);
    answers[0] = first;
    for (view, answer) in answers.iter_mut().flatten().enumerate() {
        let sigma = if view == 0 { 1000.0 } else { 0.0 };
        answer.sigma_px = Some(vec![sigma; N_PARTS]);
    }
    let aware = joints(&answers, 1.0);
    let off = |of: &[Point3<f64>]| -> f64 {
        let joints = of.iter().zip(&others);
        joints.map(|(joint, other)| (joint - other).norm()).sum()
    };
    let (aware, without) = (off(&aware), off(&unaware));
    assert!(without > 0.1, "{without} m: nothing to tell apart");
    assert!(aware < 0.1 * without, "{aware} m, {without} m");
    assert_eq!(joints(&answers, 0.0), unaware);
}

#[test]
fn a_network_that_does_not_fit_is_refused_before_anything_starts() {
    let more = PLAIN.to_owned() + "errors = \"q.onnx\"\n";
    let case = Case::new("unfit", &[2; 2], &more);
    let said = |file: &[u8]| {
        case.write("q.onnx", file);
        let ended = case.start(&["config", "check", "deployment.toml"]).wait().ends(4);
        ended.stderr
    };
    let mut net = network(0.02);
    net.inputs[0].1[1] = Side::Fixed(1);
    let stderr = said(&net.file());
    assert!(
        stderr.contains("q.onnx: `tile` of the network is [n, 1, 40, 16], expected [n, 3"),
        "{stderr}"
    );
    let file = network(0.02).file();
    let stderr = said(&file[..file.len() / 2]);
    assert!(stderr.contains("truncated or not an ONNX file"), "{stderr}");
}

#[test]
fn a_prediction_that_never_ends_is_detected_by_its_missing_progress() {
    // The time limit alone would only detect the hang after ten minutes.
    let more = "[capture]\nupright = false\nmode = \"realtime\"\n\
                frame_rate_hz = 20\n[results]\noverlay_every = 0\n\
                [paper]\nerrors = \"q.onnx\"\n[supervise]\nhang_limit_s = 600\n";
    let case = Case::new("endless", &[240; 2], more);
    case.write("q.onnx", network(0.02).file());
    let chaos = ["chaos", "deployment.toml", "--scenario", "spin-quality"];
    let named = ["--out", "chaos", "--name", &case.name, "--json"];
    let ended = case.start(&[&chaos[..], &named].concat()).wait();
    case.assert_nothing_left();
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let spun = &report["scenarios"][0];
    let process = &spun["measured"]["process"];
    let expected = json!([{ "process": process, "restarts": 1 }]);
    // On a loaded machine, the footage may end before the process has been restarted.
    assert_eq!(spun["run"]["restarts"], expected, "{}", ended.stderr);
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use crate::common::started::signal;

    use super::*;

    /// Returns the lines about a view.
    fn of_view(case: &Case, name: &str) -> Vec<Value> {
        let lines = case.lines("pose2d.jsonl");
        lines.into_iter().filter(|line| line["view"] == name).collect()
    }

    #[test]
    #[ignore = "takes long"]
    fn no_frame_waits_for_a_suspended_network() {
        let more = "[capture]\nupright = false\nmode = \"realtime\"\n\
                    frame_rate_hz = 5\n[results]\noverlay_every = 0\n\
                    [paper]\nerrors = \"q.onnx\"\n\
                    [supervise]\nmissed_beats = 1000\n";
        let case = Case::new("stopped", &[100; 2], more);
        case.write("q.onnx", network(0.02).file());
        let mut started = case.start(&["run", "deployment.toml", "--json"]);
        let used = || -> Vec<Option<u64>> {
            let lines = of_view(&case, "b").into_iter();
            let fused = lines.filter(|line| !line["fused"].is_null());
            fused.map(|fused| fused["sigma_used"].as_u64()).collect()
        };
        started.until("predictions", |_| used().contains(&Some(0)));
        let stopped = started.pid_of("quality --index 1");
        let n_before = used().len();
        signal("STOP", stopped.into());
        let after = || used().split_off(n_before);
        started.until("the last prediction while it is fresh", |_| {
            after().iter().flatten().any(|value| *value > 0)
        });
        started.until("and none when it no longer is", |_| {
            after().last() == Some(&None)
        });
        signal("CONT", stopped.into());
        let ended = started.wait();
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(report["restarts"], json!([]), "{}", ended.stderr);
        let of_other = of_view(&case, "a");
        let n_of_other = of_other.iter().filter(|value| !value["sigma_used"].is_null());
        assert!(n_of_other.count() > 5, "the other view has its own");
    }
}
