//! Tests of training runs from samples to files, with synthetic errors.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use fastrand::Rng;
use skeleton::N_PARTS;
use training::networks::quality::network::Kind;
use training::networks::quality::sample::{Sample, picture_size};
use training::networks::quality::settings::{Loss, Settings, Unit, Vary};
use training::networks::quality::store::Samples;
use training::networks::quality::task::{QualityTask, TaskError};
use training::networks::{Backend, Parameter, TrainError, Trainer};
use viewquality::{Network, TileShape, n_evidence};

/// Samples whose errors depend on the first value of the pose's evidence and on the brightness of the
/// picture.
fn samples(kind: Kind, n: usize) -> Samples {
    let [height, width] = kind.tile().unwrap_or([8, 8]);
    let [rows, cols] = picture_size(TileShape { height, width });
    let mut dice = Rng::with_seed(7);
    let sample = |nth: usize| {
        let [in_evidence, in_picture] = [dice.f32(), dice.f32()];
        let bright = (200.0 * in_picture) as u8;
        let mut evidence: Vec<f32> = (0..n_evidence(N_PARTS)).map(|_| dice.f32() - 0.5).collect();
        evidence[N_PARTS * 16] = in_evidence;
        Sample {
            group: format!("subject {}", nth % 20),
            source: format!("picture {nth}"),
            picture: (0..3 * rows * cols).map(|_| bright + dice.u8(0..40)).collect(),
            evidence,
            height_px: 200.0,
            errors_px: vec![1.0 + 20.0 * in_evidence + 20.0 * in_picture; N_PARTS],
        }
    };
    Samples {
        tile: [height, width],
        all: (0..n).map(sample).collect(),
    }
}

fn settings(network: Kind) -> Settings {
    Settings {
        network,
        epochs: 4,
        batch: 8,
        width: 4,
        hidden: 16,
        rate: 0.004,
        dropout: 0.2,
        ..Settings::default()
    }
}

/// A training run from the start, or from a checkpoint.
fn begun<'a>(
    settings: &'a Settings,
    samples: &'a Samples,
    checkpoint: Option<&[u8]>,
) -> Result<Trainer<QualityTask<'a>>, TrainError> {
    let task = QualityTask::new(settings, samples, &[]).unwrap();
    Trainer::new(task, Backend::BuiltIn, checkpoint)
}

fn trained<'a>(settings: &'a Settings, samples: &'a Samples) -> Trainer<QualityTask<'a>> {
    let mut trainer = begun(settings, samples, None).unwrap();
    while !trainer.is_done() {
        assert!(trainer.pass(&mut |_| true));
    }
    trainer
}

/// Checks that the file, run by another library, gives the trainer's predictions.
fn check_file(network: Kind, n: usize, within: f32) {
    let (settings, samples) = (settings(network), samples(network, n));
    let trainer = if network == Kind::Vgg16 {
        // No training is needed: the initial weights are enough.
        begun(&settings, &samples, None).unwrap()
    } else {
        trained(&settings, &samples)
    };
    let file = Network::parse(trainer.onnx("a test"), N_PARTS).unwrap();
    assert_eq!(file.card().identity, "a test");
    assert_eq!(file.card().tau.len(), N_PARTS);
    assert_eq!(file.takes_tile(), network.tile().is_some());
    assert_eq!(file.takes_evidence(), network.sees_evidence());
    let some: Vec<&Sample> = samples.all.iter().take(5).collect();
    for (seen, result) in trainer.predictions(&some) {
        let other = file.run(&seen.tile, &seen.evidence).unwrap();
        for (result, other) in result.iter().zip(other) {
            assert!(
                (result - other).abs() < within * result.abs().max(1.0),
                "{result}, {other}"
            );
        }
    }
}

#[test]
fn the_file_of_the_small_network_gives_the_predictions_of_the_trainer() {
    check_file(Kind::Small, 40, 1e-4);
}

#[test]
fn the_file_of_the_evidence_network_gives_the_predictions_of_the_trainer() {
    check_file(Kind::Evidence, 40, 1e-4);
}

#[test]
fn the_file_of_vgg_16_gives_the_predictions_of_the_trainer() {
    check_file(Kind::Vgg16, 21, 1e-4);
}

#[test]
fn the_evidence_network_learns_the_errors_in_the_evidence_only() {
    let mut samples = samples(Kind::Evidence, 400);
    for sample in &mut samples.all {
        let in_evidence = sample.evidence[N_PARTS * 16];
        sample.evidence.fill(0.0);
        sample.evidence[N_PARTS * 16] = in_evidence;
    }
    let settings = Settings {
        epochs: 12,
        batch: 16,
        rate: 0.01,
        vary: Vary {
            mirror: 0.0,
            ..Vary::default()
        },
        ..settings(Kind::Evidence)
    };
    let trainer = trained(&settings, &samples);
    let [first, last] = [trainer.passes()[0], *trainer.passes().last().unwrap()];
    assert!(last.score.unwrap().loss < first.score.unwrap().loss);
    let judged = trainer.judge(trainer.task().validated());
    // The evidence explains half of the variance. A perfect predictor from the evidence has a rank correlation of about 0.7.
    let found = judged.mean_rank_correlation();
    assert!((0.55..0.85).contains(&found), "{found}");
}

#[test]
fn an_interrupted_training_ends_with_the_same_bits() {
    let samples = samples(Kind::Small, 48);
    for loss in [Loss::L2, Loss::Robust] {
        let settings = Settings {
            loss,
            ..settings(Kind::Small)
        };
        let whole = trained(&settings, &samples);
        let mut before = begun(&settings, &samples, None).unwrap();
        assert!(before.pass(&mut |_| true));
        let of_pass = before.step();
        assert!(
            !before.pass(&mut |step| step < of_pass + 2),
            "left within a pass"
        );
        let kept = before.checkpoint().unwrap();
        let mut after = begun(&settings, &samples, Some(&kept)).unwrap();
        while !after.is_done() {
            assert!(after.pass(&mut |_| true));
        }
        assert_eq!(after.checkpoint().unwrap(), whole.checkpoint().unwrap());
        assert_eq!(after.onnx("it"), whole.onnx("it"));
    }
}

#[test]
fn a_checkpoint_of_other_settings_or_samples_is_refused() {
    let (settings, samples) = (settings(Kind::Evidence), samples(Kind::Evidence, 40));
    let kept = begun(&settings, &samples, None).unwrap();
    let kept = kept.checkpoint().unwrap();
    let others = Settings {
        unit: Unit::Relative,
        ..settings.clone()
    };
    let result = begun(&others, &samples, Some(&kept));
    assert!(matches!(result, Err(TrainError::Other { .. })));
    let mut changed = samples.clone();
    changed.all[3].errors_px[0] += 1.0;
    let result = begun(&settings, &changed, Some(&kept));
    assert!(matches!(result, Err(TrainError::Other { .. })));
    let result = begun(&settings, &samples, Some(&kept[..kept.len() - 1]));
    assert!(matches!(result, Err(TrainError::Checkpoint(_))));
}

#[test]
fn groups_are_not_split_and_a_single_group_is_refused() {
    let (settings, mut samples) = (settings(Kind::Evidence), samples(Kind::Evidence, 200));
    let task = QualityTask::new(&settings, &samples, &[]).unwrap();
    let validated: Vec<&str> =
        task.validated().iter().map(|sample| sample.group.as_str()).collect();
    let of_these = samples.all.iter().filter(|sample| validated.contains(&sample.group.as_str()));
    assert_eq!(of_these.count(), validated.len());
    assert!(!validated.is_empty() && validated.len() < 120);
    samples.all.iter_mut().for_each(|sample| sample.group.clear());
    let result = QualityTask::new(&settings, &samples, &[]);
    assert!(matches!(result, Err(TaskError::TooFew { .. })));
}

#[test]
fn weights_of_unknown_layers_are_refused_and_frozen_weights_do_not_change() {
    let samples = samples(Kind::Vgg16, 21);
    let settings = Settings {
        epochs: 1,
        hidden: 4,
        ..settings(Kind::Vgg16)
    };
    let plain = begun(&settings, &samples, None).unwrap();
    let mut first: Parameter = plain.parameters()[0].clone();
    first.values.iter_mut().for_each(|value| *value *= 0.5);
    let weights = [first.clone()];
    let task = QualityTask::new(&settings, &samples, &weights).unwrap();
    let mut trainer = Trainer::new(task, Backend::BuiltIn, None).unwrap();
    let top = trainer.parameters().last().unwrap().clone();
    assert!(trainer.pass(&mut |_| true));
    assert_eq!(trainer.parameters()[0], first, "the first layer is frozen");
    assert_ne!(trainer.parameters().last().unwrap(), &top, "the top learns");
    first.dims.pop();
    let result = QualityTask::new(&settings, &samples, &[first]);
    assert!(matches!(result, Err(TaskError::Weights { name }) if name == "conv1_1.weight"));
}
