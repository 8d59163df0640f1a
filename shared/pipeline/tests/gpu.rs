//! The single-view step on any Vulkan adapter, including software adapters; skipped if there is none.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::sync::Arc;

use fmp::{Layout, Region, Scope};
use gpu::{Choice, Device};
use kernels::Rgb8View;
use pipeline::{ComputedOn, EvidenceWindow, ViewEstimate, ViewSettings, ViewStep};

const SIZE: [usize; 2] = [64, 80];

fn step() -> ViewStep {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../configs/models/person.fmp"
    );
    let model = Arc::new(fmp::files::read(file.as_ref()).unwrap());
    let layout = Arc::new(Layout::new(&model, SIZE[0], SIZE[1]).unwrap());
    let settings = ViewSettings {
        window: EvidenceWindow::Around(1),
        ..ViewSettings::default()
    };
    ViewStep::new(model, layout, settings)
}

/// Returns a picture in which no two regions are equal.
fn pixels() -> Vec<u8> {
    let pixel = |at: usize| ((at * at / 7) % 251) as u8;
    (0..SIZE[0] * SIZE[1] * 3).map(pixel).collect()
}

fn run(step: &ViewStep, scope: Scope) -> (ViewEstimate, Vec<f32>) {
    let pixels = pixels();
    let image = Rgb8View::new(SIZE[0], SIZE[1], &pixels).unwrap();
    let mut responses = vec![0.0; step.layout().n_responses()];
    let estimate = step.run(image, scope, &mut responses);
    (estimate, responses)
}

#[test]
fn the_gpu_finds_the_same_as_the_cpu_and_the_cpu_continues_if_the_gpu_is_lost() {
    let device = match Device::open(Choice::Any) {
        Ok(device) => Arc::new(device),
        Err(error) => return eprintln!("skipped: {error}"),
    };
    let (on_processor, on_gpu) = (step(), step().on_gpu(&device).unwrap());
    let whole = Scope::whole(on_gpu.layout());
    let (expected, its_responses) = run(&on_processor, whole);
    assert_eq!(expected.computed_on, ComputedOn::Processor);

    let (found, responses) = run(&on_gpu, whole);
    assert_eq!(found.computed_on, ComputedOn::Gpu);
    assert_eq!(found.levels, expected.levels);
    let [parts, its_parts] =
        [&found, &expected].map(|estimate| estimate.candidates[0].parts.clone());
    assert_eq!(parts, its_parts);
    let apart = found.candidates[0].score - expected.candidates[0].score;
    assert!(apart.abs() < 1e-4, "{apart}");
    for level in &found.levels {
        let maps = on_gpu.layout().maps_in(&whole, usize::from(*level));
        let pairs = responses[maps.clone()].iter().zip(&its_responses[maps]);
        let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < 1e-4, "level {level}: {most}");
    }

    let part = Region {
        x: [8, 60],
        y: [8, 72],
    };
    let part = Scope::new(on_gpu.layout(), 0..2, part).unwrap();
    assert_eq!(run(&on_gpu, part), run(&on_processor, part));

    device.destroy();
    let (found, responses) = run(&on_gpu, whole);
    assert_eq!(found.computed_on, ComputedOn::ProcessorForGpu);
    let as_expected = ViewEstimate {
        computed_on: ComputedOn::Processor,
        ..found
    };
    assert_eq!((as_expected, responses), (expected, its_responses));
}
