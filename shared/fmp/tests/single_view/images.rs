//! Tests with models made from synthetic images, from pixels to the pose.

use std::sync::Arc;

use fmp::{
    Edge, Extractor, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Responses, Solver,
    Spring, Springs, reference,
};
use kernels::Rgb8View;

use crate::common::Noise;

/// Pixels of a grey image with a textured figure of 48 x 64 pixels at `[x, y]`.
fn picture([width, height]: [usize; 2], [x0, y0]: [usize; 2]) -> Vec<u8> {
    let mut noise = Noise(7);
    let mut data = vec![128; width * height * 3];
    // Blotches of 6 x 6 pixels, which survive resizing.
    let blotches: Vec<u8> = (0..3 * 8 * 11).map(|_| noise.below(256) as u8).collect();
    for y in 0..64 {
        for x in 0..48 {
            let from = (y / 6 * 8 + x / 6) * 3;
            let to = ((y0 + y) * width + x0 + x) * 3;
            data[to..to + 3].copy_from_slice(&blotches[from..from + 3]);
        }
    }
    data
}

/// Cells of the figure from which the four parts' filters are cut, and the filters' sizes.
const CUTS: [([usize; 2], [usize; 2]); 4] = [
    ([4, 2], [4, 4]),
    ([6, 7], [4, 4]),
    ([2, 9], [3, 4]),
    ([7, 11], [4, 2]),
];

/// Returns a model whose filters are cut out of the figure in the given picture.
fn planted(size: [usize; 2], at: [usize; 2], data: &[u8]) -> Arc<Model> {
    let filter = |[_, [rows, cols]]: [[usize; 2]; 2], weights| Filter {
        rows,
        cols,
        weights,
    };
    let parts = CUTS.iter().enumerate().map(|(part, &(cell, _))| {
        let anchor = |axis: usize| cell[axis] as i32 - CUTS[part.saturating_sub(1)].0[axis] as i32;
        let spring = Spring {
            w: [0.05, 0.0, 0.05, 0.0],
            anchor: [anchor(0), anchor(1)],
        };
        PartSpec {
            name: format!("part {part}"),
            filter_of_type: vec![2 * part, 2 * part + 1],
            edge: (part > 0).then(|| Edge {
                parent: part - 1,
                bias: vec![vec![0.0, -0.01]; 2],
                springs: Springs::PerChildType(vec![spring; 2]),
            }),
        }
    });
    let blank = |&([x, y], size): &([usize; 2], [usize; 2])| {
        let empty = filter([[x, y], size], vec![0.0; size[0] * size[1] * N_CHANNELS]);
        [empty.clone(), empty]
    };
    let mut spec = ModelSpec {
        name: "planted".to_owned(),
        parts: parts.collect(),
        filters: CUTS.iter().flat_map(blank).collect(),
        root_bias: -1.0,
        interval: 5,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    };
    let model = Model::new(spec.clone()).unwrap();
    let layout = Layout::new(&model, size[0], size[1]).unwrap();
    let image = Rgb8View::new(size[0], size[1], data).unwrap();
    let images = reference::pyramid(&model, &layout, image);
    let features = reference::features(&model, &layout, &images[0]);
    let map_cols = layout.levels[0].padded[1];
    for (part, (cell, [rows, cols])) in CUTS.iter().enumerate() {
        let mut weights = Vec::new();
        for r in 0..*rows {
            let y = at[1] / 4 - 1 + cell[1] + r + layout.pad[0] + 1;
            let x = at[0] / 4 - 1 + cell[0] + layout.pad[1] + 1;
            let from = (y * map_cols + x) * N_CHANNELS;
            weights.extend_from_slice(&features[from..from + cols * N_CHANNELS]);
        }
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        for weight in &mut weights {
            *weight -= mean;
        }
        spec.filters[2 * part].weights = weights;
    }
    Arc::new(Model::new(spec).unwrap())
}

struct Found {
    layout: Layout,
    pose: fmp::Pose,
    values: Vec<f32>,
}

fn find(model: &Arc<Model>, size: [usize; 2], data: &[u8]) -> Found {
    let layout = Layout::new(model, size[0], size[1]).unwrap();
    let mut values = vec![f32::NAN; layout.n_responses()];
    let image = Rgb8View::new(size[0], size[1], data).unwrap();
    Extractor::new(Arc::clone(model)).responses(image, &layout, &mut values);
    let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
    let pose = Solver::new(Arc::clone(model))
        .best(&Responses::new(&layout, &values, &levels), None)
        .unwrap();
    Found {
        layout,
        pose,
        values,
    }
}

const SIZE: [usize; 2] = [120, 140];
const AT: [usize; 2] = [32, 40];

#[test]
fn a_figure_is_found_at_its_position() {
    let data = picture(SIZE, AT);
    let model = planted(SIZE, AT, &data);
    let found = find(&model, SIZE, &data);
    assert_eq!(found.pose.level, 0);
    for (part, (cell, [rows, cols])) in CUTS.iter().enumerate() {
        assert_eq!(found.pose.parts[part].mixture, 0);
        let box_ = found.pose.part_box(&model, &found.layout, part);
        let corner = [0, 1].map(|axis| (AT[axis] + 4 * cell[axis]) as f64);
        let end = [
            corner[0] + 4.0 * *cols as f64 - 1.0,
            corner[1] + 4.0 * *rows as f64 - 1.0,
        ];
        assert_eq!(box_, [corner[0], corner[1], end[0], end[1]], "part {part}");
    }
}

#[test]
fn moving_the_figure_by_a_cell_moves_the_pose_by_a_cell() {
    let data = picture(SIZE, AT);
    let model = planted(SIZE, AT, &data);
    let here = find(&model, SIZE, &data);
    let there = find(&model, SIZE, &picture(SIZE, [AT[0] + 4, AT[1] + 8]));
    assert!((here.pose.score - there.pose.score).abs() < 1e-4);
    for (a, b) in here.pose.parts.iter().zip(&there.pose.parts) {
        assert_eq!((a.x + 1, a.y + 2, a.mixture), (b.x, b.y, b.mixture));
    }
}

#[test]
fn a_smaller_figure_is_found_on_a_higher_level() {
    let data = picture(SIZE, AT);
    let model = planted(SIZE, AT, &data);
    let (width, height) = (2 * SIZE[0], 2 * SIZE[1]);
    let mut large = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let from = ((y / 2) * SIZE[0] + x / 2) * 3;
            large.extend_from_slice(&data[from..from + 3]);
        }
    }
    let found = find(&model, [width, height], &large);
    assert_eq!(found.pose.level, 5, "one octave of five levels");
    let small = find(&model, SIZE, &data)
        .pose
        .centres(&model, &Layout::new(&model, SIZE[0], SIZE[1]).unwrap());
    for (a, b) in found.pose.centres(&model, &found.layout).iter().zip(small) {
        assert!(
            (a[0] - 2.0 * b[0]).abs() < 9.0 && (a[1] - 2.0 * b[1]).abs() < 9.0,
            "{a:?} {b:?}"
        );
    }
}

#[test]
fn extractor_and_solver_give_the_result_of_the_reference() {
    let data = picture(SIZE, AT);
    let model = planted(SIZE, AT, &data);
    let found = find(&model, SIZE, &data);
    let image = Rgb8View::new(SIZE[0], SIZE[1], &data).unwrap();
    let best = reference::best(&model, &found.layout, image).unwrap();
    assert_eq!(
        (usize::from(found.pose.level), &found.pose.parts),
        (best.level, &best.parts)
    );
    assert!((f64::from(found.pose.score) - best.score).abs() < 1e-4);
    // Plain sums are as accurate as single precision allows. Tiles have larger rounding errors, in proportion to the largest responses:
    // errors of up to 1.3e-5 of the largest response were measured here.
    let mut plain = vec![f32::NAN; found.layout.n_responses()];
    Extractor::direct(Arc::clone(&model)).responses(image, &found.layout, &mut plain);
    let largest = plain.iter().fold(0.0_f32, |largest, it| largest.max(it.abs()));
    let images = reference::pyramid(&model, &found.layout, image);
    for (level, (image, it)) in images.iter().zip(&found.layout.levels).enumerate() {
        let features = reference::features(&model, &found.layout, image);
        let want = reference::responses(&model, it, &features);
        for (filter, want) in want.iter().enumerate() {
            let map = found.layout.map_range(level, filter);
            assert_eq!(map.len(), want.len());
            let got = found.values[map.clone()].iter().zip(&plain[map]);
            for (want, (tiled, plain)) in want.iter().zip(got) {
                let off = |got: f32| (want - f64::from(got)).abs();
                assert!(off(*plain) < 1e-4, "{level} {filter}");
                assert!(off(*tiled) < 2e-5 * f64::from(largest), "{level} {filter}");
            }
        }
    }
}

#[test]
fn threads_and_instruction_sets_and_earlier_images_do_not_change_the_result() {
    let data = picture(SIZE, AT);
    let model = planted(SIZE, AT, &data);
    let want = find(&model, SIZE, &data);
    for isa in kernels::Isa::available() {
        let extractor = Extractor::on(isa, Arc::clone(&model));
        let other = picture([60, 70], [4, 2]);
        let layout = Layout::new(&model, 60, 70).unwrap();
        let mut values = vec![0.0; layout.n_responses()];
        extractor.responses(Rgb8View::new(60, 70, &other).unwrap(), &layout, &mut values);
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut got = vec![f32::NAN; want.values.len()];
            let image = Rgb8View::new(SIZE[0], SIZE[1], &data).unwrap();
            pool.install(|| extractor.responses(image, &want.layout, &mut got));
            assert!(got == want.values, "{isa:?}, {threads} threads");
        }
    }
}
