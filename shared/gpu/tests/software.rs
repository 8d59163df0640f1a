//! Compares the kernels with the CPU, on any Vulkan adapter, including programs that emulate one. The tests are skipped if there is no
//! adapter.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::sync::{Arc, OnceLock};

use fastrand::Rng;
use fmp::{
    Edge, Extractor, FeaturePyramid, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Pose,
    Responses, Solver, Spring, Springs,
};
use gpu::{Choice, Device, DeviceLost, Found, Unsuitable, View, Wanted};
use kernels::Rgb8View;

const SIZE: [usize; 2] = [64, 80];
const WANTED: Wanted = Wanted {
    n: 8,
    min_separation: 1.0,
};

/// The device shared by all tests, except the tests in which the device is lost.
fn device() -> Option<Arc<Device>> {
    static DEVICE: OnceLock<Option<Arc<Device>>> = OnceLock::new();
    DEVICE.get_or_init(|| opened().map(Arc::new)).clone()
}

fn opened() -> Option<Device> {
    match Device::open(Choice::Any) {
        Ok(device) => Some(device),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// A random tree with the given number of parts, types of each part, and side of the filters.
fn spec(rng: &mut Rng, [n_parts, n_types, side]: [usize; 3]) -> ModelSpec {
    let filter = |rng: &mut Rng| Filter {
        rows: side,
        cols: side,
        weights: (0..side * side * N_CHANNELS).map(|_| rng.f64() * 0.2 - 0.1).collect(),
    };
    let part = |rng: &mut Rng, part: usize| PartSpec {
        name: format!("part {part}"),
        filter_of_type: (part * n_types..(part + 1) * n_types).collect(),
        edge: (part > 0).then(|| {
            let parent = rng.usize(0..part);
            edge(rng, parent, n_types)
        }),
    };
    ModelSpec {
        name: "tree".to_owned(),
        parts: (0..n_parts).map(|index| part(rng, index)).collect(),
        filters: (0..n_parts * n_types).map(|_| filter(rng)).collect(),
        root_bias: rng.f64() - 0.5,
        interval: 4,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    }
}

fn edge(rng: &mut Rng, parent: usize, n_types: usize) -> Edge {
    let spring = |rng: &mut Rng| Spring {
        w: [
            0.02 + 0.1 * rng.f64(),
            0.1 * rng.f64() - 0.05,
            0.02 + 0.1 * rng.f64(),
            0.1 * rng.f64() - 0.05,
        ],
        anchor: [rng.i32(-3..4), rng.i32(-3..4)],
    };
    let bias = |rng: &mut Rng, own: usize| {
        if own > 0 && rng.usize(0..4) == 0 {
            f64::NEG_INFINITY
        } else {
            rng.f64()
        }
    };
    Edge {
        parent,
        springs: Springs::PerChildType((0..n_types).map(|_| spring(rng)).collect()),
        bias: (0..n_types).map(|_| (0..n_types).map(|own| bias(rng, own)).collect()).collect(),
    }
}

/// A model, its layout for small images, and an image: noise over a gradient.
struct Case {
    model: Arc<Model>,
    layout: Arc<Layout>,
    pixels: Vec<u8>,
}

impl Case {
    fn new(rng: &mut Rng, shape: [usize; 3]) -> Self {
        let model = Model::new(spec(rng, shape)).unwrap();
        Self::of_model(rng, model)
    }

    fn of_model(rng: &mut Rng, model: Model) -> Self {
        let model = Arc::new(model);
        let layout = Arc::new(Layout::new(&model, SIZE[0], SIZE[1]).unwrap());
        let pixel = |at: usize| (at / 60) as u8 ^ rng.u8(0..60);
        let pixels = (0..SIZE[0] * SIZE[1] * 3).map(pixel).collect();
        Self {
            model,
            layout,
            pixels,
        }
    }

    fn view(&self, device: &Arc<Device>) -> Result<View, Unsuitable> {
        View::new(device, Arc::clone(&self.model), Arc::clone(&self.layout))
    }

    fn image(&self) -> Rgb8View<'_> {
        Rgb8View::new(SIZE[0], SIZE[1], &self.pixels).unwrap()
    }

    fn levels(&self) -> Vec<u16> {
        (0..self.layout.levels.len() as u16).collect()
    }

    /// The result of the CPU.
    fn solved(&self, responses: &[f32]) -> Found {
        let levels = self.levels();
        let evidence = Responses::new(&self.layout, responses, &levels);
        let solver = Solver::new(Arc::clone(&self.model));
        let (candidates, bounds) =
            solver.distinct_and_bounds(&evidence, WANTED.n, WANTED.min_separation);
        Found { candidates, bounds }
    }
}

#[test]
fn features_equal_those_of_the_cpu_bit_for_bit() {
    let Some(device) = device() else { return };
    let case = Case::new(&mut Rng::with_seed(1), [2, 1, 5]);
    let found = case.view(&device).unwrap().features(case.image()).unwrap();
    let pyramid = FeaturePyramid::new(&case.model, case.image(), &case.layout);
    let levels = 0..case.layout.levels.len();
    let expected: Vec<u32> = levels
        .flat_map(|level| pyramid.level(level).cells.iter().map(|value| value.to_bits()))
        .collect();
    let found: Vec<u32> = found.iter().map(|value| value.to_bits()).collect();
    let differ = expected.iter().zip(&found).filter(|(a, b)| a != b).count();
    assert_eq!((found.len(), differ), (expected.len(), 0));
}

#[test]
fn with_equal_responses_poses_scores_and_bounds_equal_those_of_the_cpu_bit_for_bit() {
    let Some(device) = device() else { return };
    let mut rng = Rng::with_seed(2);
    for shape in [[1, 1, 1], [4, 3, 2], [9, 2, 3], [6, 8, 1], [26, 6, 5]] {
        let case = Case::new(&mut rng, shape);
        let view = case.view(&device).unwrap();
        for n_values in [9, 1 << 20] {
            // If there are only a few different values, scores are often equal; with many values, they never are.
            let value = |_| rng.u32(0..n_values) as f32 / n_values as f32 * 2.0 - 1.0;
            let responses: Vec<f32> = (0..case.layout.n_responses()).map(value).collect();
            let expected = case.solved(&responses);
            assert_eq!(
                view.solve(&responses, WANTED).unwrap(),
                expected,
                "{shape:?}"
            );
            assert!(!expected.candidates.is_empty());
        }
    }
}

#[test]
fn a_search_returns_evidence_and_the_poses_found_in_it() {
    let Some(device) = device() else { return };
    let case = Case::new(&mut Rng::with_seed(3), [5, 3, 5]);
    let view = case.view(&device).unwrap();
    let mut evidence = vec![f32::NAN; case.layout.n_responses()];
    let all = |_: &[Pose]| case.levels();
    let found = view.search(case.image(), WANTED, &all, &mut evidence).unwrap();
    assert_eq!(found, case.solved(&evidence));

    let mut expected = vec![0.0; evidence.len()];
    Extractor::direct(Arc::clone(&case.model)).responses(case.image(), &case.layout, &mut expected);
    for level in 0..case.layout.levels.len() {
        for (filter_idx, filter) in case.model.spec().filters.iter().enumerate() {
            // No feature is larger than 1. Each product and sum is rounded once, both on the CPU and on the device.
            let weights: f64 = filter.weights.iter().map(|weight| weight.abs()).sum();
            let bound = 2.0 * filter.weights.len() as f64 * f64::from(f32::EPSILON) * weights;
            for at in case.layout.map_range(level, filter_idx) {
                let apart = f64::from(evidence[at]) - f64::from(expected[at]);
                assert!(apart.abs() <= bound, "{} {}", evidence[at], expected[at]);
            }
        }
    }

    let mut some = vec![f32::NAN; evidence.len()];
    let one = |poses: &[Pose]| vec![poses[0].level];
    assert_eq!(
        view.search(case.image(), WANTED, &one, &mut some).unwrap(),
        found
    );
    for level in case.levels() {
        let first = case.layout.map_range(usize::from(level), 0).start;
        assert_eq!(some[first].is_nan(), level != found.candidates[0].level);
    }
}

#[test]
fn the_included_model_runs_on_the_gpu() {
    let Some(device) = device() else { return };
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../configs/models/person.fmp"
    );
    let model = fmp::files::read(file.as_ref()).unwrap();
    let case = Case::of_model(&mut Rng::with_seed(8), model);
    let mut evidence = vec![f32::NAN; case.layout.n_responses()];
    let all = |_: &[Pose]| case.levels();
    let view = case.view(&device).unwrap();
    let found = view.search(case.image(), WANTED, &all, &mut evidence).unwrap();
    assert_eq!(found, case.solved(&evidence));
}

#[test]
fn a_device_with_small_buffers_gives_the_same_result() {
    let (Some(device), Some(small)) = (device(), opened()) else {
        return;
    };
    let case = Case::new(&mut Rng::with_seed(4), [26, 6, 3]);
    let n_bytes = (case.layout.n_responses() * size_of::<f32>()) as u64;
    let small = Arc::new(small.with_max_binding(n_bytes * 3 / 4));
    let levels = |_: &[Pose]| case.levels();
    let [whole, split] = [&device, &small].map(|device| {
        let mut evidence = vec![f32::NAN; case.layout.n_responses()];
        let view = case.view(device).unwrap();
        let found = view.search(case.image(), WANTED, &levels, &mut evidence).unwrap();
        (found, evidence)
    });
    assert_eq!(whole, split);
}

#[test]
fn a_driver_without_spirv_support_gives_the_same_poses() {
    let Some(device) = opened() else { return };
    let device = Arc::new(device.without_spirv());
    let case = Case::new(&mut Rng::with_seed(9), [6, 3, 5]);
    let view = case.view(&device).unwrap();
    let mut evidence = vec![f32::NAN; case.layout.n_responses()];
    let all = |_: &[Pose]| case.levels();
    let found = view.search(case.image(), WANTED, &all, &mut evidence).unwrap();
    assert_eq!(found, case.solved(&evidence));
}

#[test]
fn a_device_whose_buffers_are_too_small_is_refused() {
    let Some(small) = opened() else { return };
    let small = Arc::new(small.with_max_binding(10_000));
    let case = Case::new(&mut Rng::with_seed(5), [26, 6, 3]);
    let refused = case.view(&small).unwrap_err();
    assert!(
        matches!(refused, Unsuitable::TooSmall { has: 10_000, .. }),
        "{refused}"
    );
}

#[test]
fn a_lost_device_is_an_error_instead_of_a_panic() {
    let Some(device) = opened().map(Arc::new) else {
        return;
    };
    let case = Case::new(&mut Rng::with_seed(6), [2, 1, 2]);
    let view = case.view(&device).unwrap();
    let mut evidence = vec![0.0; case.layout.n_responses()];
    let levels = |_: &[Pose]| {
        device.destroy();
        case.levels()
    };
    for _ in 0..2 {
        let lost = view.search(case.image(), WANTED, &levels, &mut evidence);
        assert_eq!(lost, Err(DeviceLost));
    }
}

#[test]
fn unsupported_models_are_left_to_the_cpu() {
    let Some(device) = device() else { return };
    let refusal = |change: &dyn Fn(&mut ModelSpec)| {
        let mut spec = spec(&mut Rng::with_seed(7), [3, 2, 2]);
        change(&mut spec);
        let model = Arc::new(Model::new(spec).unwrap());
        let layout = Arc::new(Layout::new(&model, SIZE[0], SIZE[1]).unwrap());
        View::new(&device, model, layout).unwrap_err().to_string()
    };
    let pairs = refusal(&|spec| {
        let edge = spec.parts[1].edge.as_mut().unwrap();
        if let Springs::PerChildType(springs) = &edge.springs {
            let springs = springs.iter().map(|spring| Some(*spring));
            edge.springs = Springs::PerTypePair(vec![springs.collect(); 2]);
            edge.bias = vec![vec![0.0; 2]; 2];
        }
    });
    assert!(pairs.contains("springs per pair of types"), "{pairs}");
    let unequal = refusal(&|spec| {
        let filter = &mut spec.filters[3];
        (filter.rows, filter.cols) = (1, 4);
    });
    assert!(unequal.contains("filters of different sizes"), "{unequal}");
    let shared = refusal(&|spec| spec.parts[0].filter_of_type = vec![1, 0]);
    assert!(shared.contains("not numbered part by part"), "{shared}");
}
