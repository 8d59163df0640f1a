//! Models and images for the benchmark.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fmp::{
    Edge, ExtraTerms, Filter, Layout, Model, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs,
};
use kernels::Rgb8View;
use skeleton::{N_PARTS, PARENT};

const N_TYPES: usize = 6;

/// One model and one image.
pub(crate) struct Workload {
    /// Side of the filters, in cells.
    pub(crate) filter: usize,
    pub(crate) model: Arc<Model>,
    pub(crate) layout: Layout,
    pixels: Vec<u8>,
}

impl Workload {
    /// Returns the three workloads of the benchmark, or a single small workload for a quick check.
    pub(crate) fn all(quick: bool) -> Vec<Self> {
        if quick {
            return vec![Self::new([48, 52], 3, ["", ""])];
        }
        let small = "reference/test_vectors/he_c1_172x224_full.png";
        let large = "data/humaneva/S1_Walking_1_C1_im0080.bmp";
        vec![
            Self::new([172, 224], 5, ["data/models/parse_fmp.mat", small]),
            Self::new([172, 224], 6, ["data/models/humaneva_fmp.txt", small]),
            Self::new([640, 480], 6, ["data/models/humaneva_fmp.txt", large]),
        ]
    }

    fn new(size: [usize; 2], filter: usize, [model, image]: [&str; 2]) -> Self {
        let model = real(model).and_then(|path| fmp::files::read(&path).ok());
        let model = model.unwrap_or_else(|| made_up_model(filter));
        let pixels = real(image).and_then(|path| image::open(path).ok());
        let pixels = pixels.map(image::DynamicImage::into_rgb8);
        let pixels =
            pixels.filter(|pixel| [pixel.width(), pixel.height()] == size.map(|size| size as u32));
        let pixels = pixels.map_or_else(|| made_up_pixels(size), image::RgbImage::into_raw);
        Self {
            filter,
            layout: Layout::new(&model, size[0], size[1]).unwrap(),
            model: Arc::new(model),
            pixels,
        }
    }

    /// Returns the image size as `width x height`.
    pub(crate) fn image_name(&self) -> String {
        let [width, height] = self.layout.image_size;
        format!("{width}x{height}")
    }

    pub(crate) fn image(&self) -> Rgb8View<'_> {
        let [width, height] = self.layout.image_size;
        Rgb8View::new(width, height, &self.pixels).unwrap()
    }
}

/// Returns the path of a file in the folder beside the clone, if the file exists.
fn real(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let path = root.join(name);
    path.is_file().then_some(path)
}

/// Pseudorandom numbers in -1..1 that depend only on the seed.
fn noise(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed;
    std::iter::repeat_with(move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
    })
}

/// Returns a model with the published models' tree, and with springs and responses of similar size.
fn made_up_model(side: usize) -> Model {
    let mut noise = noise(side as u64);
    let mut filter = || Filter {
        rows: side,
        cols: side,
        weights: noise
            .by_ref()
            .take(side * side * N_CHANNELS)
            .map(|noise| noise * 0.03)
            .collect(),
    };
    let spring = |part: usize| Spring {
        w: [0.012, 0.001, 0.014, -0.002],
        anchor: [part as i32 % 5 - 2, part as i32 % 4 - 1],
    };
    let part = |part: usize| PartSpec {
        name: format!("part {part}"),
        filter_of_type: (part * N_TYPES..(part + 1) * N_TYPES).collect(),
        edge: PARENT[part].map(|parent| Edge {
            parent,
            bias: vec![vec![0.01; N_TYPES]; N_TYPES],
            springs: Springs::PerChildType(vec![spring(part); N_TYPES]),
        }),
    };
    let spec = ModelSpec {
        name: "made up".to_owned(),
        parts: (0..N_PARTS).map(part).collect(),
        filters: (0..N_PARTS * N_TYPES).map(|_| filter()).collect(),
        root_bias: 0.0,
        interval: 10,
        cell_px: 4,
        threshold: 0.0,
        mirror: None,
    };
    Model::new(spec).unwrap()
}

/// Waves with a little noise on them.
fn made_up_pixels([width, height]: [usize; 2]) -> Vec<u8> {
    let mut noise = noise(1);
    let mut pixel = |at: usize| {
        let (x, y) = ((at / 3 % width) as f64, (at / 3 / width) as f64);
        let wave = 60.0 * (0.07 * x + at as f64 % 3.0).sin() + 50.0 * (0.05 * y + 0.01 * x).cos();
        (128.0 + wave + 8.0 * noise.next().unwrap()) as u8
    };
    (0..3 * width * height).map(&mut pixel).collect()
}

/// Terms of another view: one map for all parts, and a preferred type.
pub(crate) struct OtherView {
    /// Maps of the levels.
    maps: Vec<Vec<f32>>,
}

impl OtherView {
    pub(crate) fn new(layout: &Layout) -> Self {
        let map = |level_layout: &fmp::LevelLayout| {
            let cells = 0..level_layout.rows * level_layout.cols;
            cells
                .map(|at| 0.07 * ((at % level_layout.cols) as f32 / level_layout.cols as f32))
                .collect()
        };
        Self {
            maps: layout.levels.iter().map(map).collect(),
        }
    }
}

impl ExtraTerms for OtherView {
    fn add_position(&self, _part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        for (score, term) in score.iter_mut().zip(&self.maps[level][first..]) {
            *score += term;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        if part % N_TYPES == mixture { 0.03 } else { 0.0 }
    }
}
