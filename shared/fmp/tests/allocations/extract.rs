//! Counts the allocations of the extractor, on one thread and in a pool.

use std::sync::Arc;

use fmp::{
    Extractor, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Region as Rectangle, Scope,
};
use kernels::Rgb8View;

use crate::allocations;

const SIZE: [usize; 2] = [90, 110];

/// Returns a model with thirty filters of two sizes on one part, ten levels per octave.
fn model() -> Arc<Model> {
    let filter = |side: usize| Filter {
        rows: side,
        cols: side,
        weights: vec![0.1; side * side * N_CHANNELS],
    };
    let spec = ModelSpec {
        name: "thirty filters".to_owned(),
        parts: vec![PartSpec {
            name: "root".to_owned(),
            filter_of_type: (0..30).collect(),
            edge: None,
        }],
        filters: [vec![filter(5); 15], vec![filter(4); 15]].concat(),
        root_bias: 0.0,
        interval: 10,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    };
    Arc::new(Model::new(spec).unwrap())
}

/// Returns the number of allocations and reallocations of the frames after the first.
fn of_frames(n_frames: usize) -> usize {
    let model = model();
    let layout = Layout::new(&model, SIZE[0], SIZE[1]).unwrap();
    let extractor = Extractor::new(model);
    let frames: Vec<Vec<u8>> = (0..=n_frames)
        .map(|seed| (0..3 * SIZE[0] * SIZE[1]).map(|i| (i * i % (211 + seed)) as u8).collect())
        .collect();
    let mut values = vec![0.0; layout.n_responses()];
    let part = Rectangle {
        x: [20, 70],
        y: [10, 60],
    };
    let part = Scope::new(&layout, 2..12, part).unwrap();
    let mut respond = |frame: &[u8]| {
        let image = Rgb8View::new(SIZE[0], SIZE[1], frame).unwrap();
        extractor.responses(image, &layout, &mut values);
        extractor.responses_in(image, &layout, &part, &mut values);
    };
    respond(&frames[0]);
    allocations(|| frames[1..].iter().for_each(|frame| respond(frame)))
}

/// Checks the extractor on one thread and in a pool.
pub(crate) fn takes_no_memory() {
    assert_eq!(of_frames(3), 0, "on one thread");
    // The pool lives until the end, because a thread that ends allocates memory for the data that it leaves to other threads; this would
    // be counted.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3);
    let pool = pool.build().unwrap();
    assert_eq!(pool.install(|| of_frames(3)), 0, "in a pool");
}
