//! Test of the peak memory of a pose process, with images and a model of realistic size.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::{Case, planted};
use fmp::{Filter, Model, ModelSpec, N_CHANNELS};
use footage::{Canvas, Size};
use geometry::{Intrinsics, Rig};
use nalgebra::Vector3;
use serde_json::{Value, json};

const SIZE: [u32; 2] = [640, 480];
const N_FRAMES: usize = 6;
/// Number of types of every part. Each type has its own filter.
const N_TYPES: usize = 6;

/// Returns the small test cameras with larger pictures.
fn rig() -> Rig {
    let mut cameras = planted::rig(2).cameras().to_vec();
    for camera in &mut cameras {
        let [width, height] = SIZE.map(f64::from);
        camera.intrinsics = Intrinsics {
            fx: 640.0,
            fy: 640.0,
            cx: (width - 1.0) / 2.0,
            cy: (height - 1.0) / 2.0,
            size: SIZE,
            ..camera.intrinsics
        };
    }
    Rig::new(cameras, Some(Vector3::z_axis()), "planted").unwrap()
}

/// Returns the small test model with as many filters as the paper's `HumanEva` model, of the same size.
fn model() -> Model {
    let small = planted::model();
    let mut spec: ModelSpec = small.spec().clone();
    let n_parts = spec.parts.len();
    for (part, it) in spec.parts.iter_mut().enumerate() {
        it.filter_of_type = (0..N_TYPES).map(|mixture| part * N_TYPES + mixture).collect();
        if let Some(edge) = &mut it.edge {
            edge.bias = vec![vec![0.0; N_TYPES]; N_TYPES];
            if let fmp::Springs::PerChildType(springs) = &mut edge.springs {
                *springs = (0..N_TYPES).map(|i| springs[i % 2]).collect();
            }
        }
    }
    let mut random = fastrand::Rng::with_seed(1);
    let filter = || Filter {
        rows: 6,
        cols: 6,
        weights: (0..36 * N_CHANNELS).map(|_| 0.1 * random.f64() - 0.05).collect(),
    };
    spec.filters = std::iter::repeat_with(filter).take(n_parts * N_TYPES).collect();
    spec.interval = 10;
    Model::new(spec).unwrap()
}

/// Returns a picture of noise, in which there are poses on every level.
fn noise(seed: u64) -> Canvas {
    let [width, height] = SIZE.map(|size| size as usize);
    let mut random = fastrand::Rng::with_seed(seed);
    let rgb: Vec<u8> = std::iter::repeat_with(|| random.u8(..)).take(width * height * 3).collect();
    Canvas::from_rgb(Size::new(width, height), &rgb)
}

#[test]
#[ignore = "takes long"]
fn a_pose_process_stays_under_300_megabytes_at_640x480() {
    let more = "[capture]\nscale = 1\nupright = false\n[results]\noverlay_every = 0\n";
    let rig = rig();
    let case = Case::with_rig(&rig, "memory", &[N_FRAMES; 2], more);
    fmp::files::write(&case.path("model.plx"), &model()).unwrap();
    for (view, camera) in rig.cameras().iter().enumerate() {
        for frame in 0..N_FRAMES {
            let file = case.path(&camera.name).join(format!("{frame:04}.png"));
            let seed = (view * N_FRAMES + frame) as u64;
            noise(seed).save_png(&file).unwrap();
        }
    }
    let ended = case.run();
    // Noise shows no person, as the verdict states. Only the memory is measured.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let summary = &report["recorded"]["summary"];
    assert_eq!(summary["frames"], json!(N_FRAMES));
    for view in 0..2 {
        let evidence = &summary["evidence_bytes_per_frame"][planted::name(view)];
        let evidence = evidence.as_u64().unwrap();
        assert!(evidence > 100_000_000, "{evidence} bytes of evidence");
        let peak = &report["peak_memory_bytes"][format!("pose-{view}")];
        let peak = peak.as_u64().unwrap();
        // Shared memory is included, because evidence is written there directly.
        assert!((evidence..300_000_000).contains(&peak), "{peak} bytes");
    }
}
