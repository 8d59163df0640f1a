//! Measures the time on one core to compute the expected errors of one view. The tile of a person 400 pixels high is cut from a 1280 x 720
//! frame. It is the input of a network with 13 depthwise-separable blocks of half the usual width, 160 x 64 pixels and random weights.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::hint::black_box;

use inference::onnx::{Attribute, Side};
use kernels::Rgb8View;
use rustix::time::{ClockId, clock_gettime};
use viewquality::{Network, Normalisation, Sampler, Tile, TileShape};

const SIZE: [usize; 2] = [1280, 720];
const N_PARTS: usize = 26;
const REPEATS: usize = 300;
/// Channels and strides of the blocks of `MobileNet` at full width (Howard et al. 2017, table 1).
const BLOCKS: [(usize, i64); 13] = [
    (64, 1),
    (128, 2),
    (128, 1),
    (256, 2),
    (256, 1),
    (512, 2),
    (512, 1),
    (512, 1),
    (512, 1),
    (512, 1),
    (512, 1),
    (1024, 2),
    (1024, 1),
];

fn main() {
    let pixels: Vec<u8> =
        (0..3 * SIZE[0] * SIZE[1]).map(|i| ((i * 2_654_435_761) >> 13) as u8).collect();
    let image = Rgb8View::new(SIZE[0], SIZE[1], &pixels).unwrap();
    let tile = Tile::around([600.0, 200.0, 740.0, 600.0], TileShape::SMALL).unwrap();
    let network = Network::parse(file(), N_PARTS).unwrap();
    let mut values = vec![0.0; tile.shape.n_values()];
    let mut sampler = Sampler::default();
    let mut sample = || {
        sampler.sample(image, &tile, &Normalisation::IMAGENET, &mut values);
    };
    let sampled = fastest(&mut sample);
    let run = fastest(|| drop(black_box(network.run(black_box(&values), &[]).unwrap())));
    println!("CPU ms, least of {REPEATS}: tile {sampled:.3}, network {run:.3}");
}

/// Shortest CPU time of the whole process over many repetitions, in milliseconds.
fn fastest(mut act: impl FnMut()) -> f64 {
    let now = || {
        let time = clock_gettime(ClockId::ProcessCPUTime);
        time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 / 1e6
    };
    let once = |_| {
        let begin = now();
        act();
        now() - begin
    };
    (0..REPEATS).map(once).fold(f64::INFINITY, f64::min)
}

/// The network, with batch normalisation merged into the convolutions.
fn file() -> Vec<u8> {
    let mut net = inference::onnx::Network::default();
    let TileShape { height, width } = TileShape::SMALL;
    let tile = [
        Side::Fixed(1),
        Side::Fixed(3),
        Side::Fixed(height),
        Side::Fixed(width),
    ];
    net.inputs.push(("tile".to_owned(), tile.to_vec()));
    let sigma = vec![Side::Fixed(1), Side::Fixed(N_PARTS)];
    net.outputs.push(("sigma".to_owned(), sigma));
    let mut layers = Layers {
        net,
        seed: 1,
        last: "tile".to_owned(),
        channels: 3,
    };
    layers.convolve(16, 3, 2, 1);
    for (channels, stride) in BLOCKS {
        let n = layers.channels;
        layers.convolve(n, 3, stride, n);
        layers.convolve(channels / 2, 1, 1, 1);
    }
    let mut net = layers.net;
    net.node("GlobalAveragePool", &[&layers.last], "mean", vec![]);
    net.node("Flatten", &["mean"], "flat", vec![]);
    net.floats("top", &[512, N_PARTS], vec![0.01; 512 * N_PARTS]);
    net.node("MatMul", &["flat", "top"], "sigma", vec![]);
    net.file()
}

struct Layers {
    net: inference::onnx::Network,
    seed: u32,
    last: String,
    channels: usize,
}

impl Layers {
    /// A convolution with bias, followed by a rectifier.
    fn convolve(&mut self, channels: usize, side: usize, stride: i64, groups: usize) {
        let nth = self.net.nodes.len();
        let [weights, bias, raw, out] = ["w", "b", "c", "r"].map(|name| format!("{name}{nth}"));
        let shape = [channels, self.channels / groups, side, side];
        let n = shape.iter().product();
        let values = (0..n).map(|_| self.random(n / channels)).collect();
        self.net.floats(&weights, &shape, values);
        self.net.floats(&bias, &[channels], vec![0.05; channels]);
        let (side, pad) = (side as i64, side as i64 / 2);
        let attributes = vec![
            ("kernel_shape", Attribute::Ints(vec![side; 2])),
            ("strides", Attribute::Ints(vec![stride; 2])),
            ("pads", Attribute::Ints(vec![pad; 4])),
            ("group", Attribute::Int(groups as i64)),
        ];
        self.net.node("Conv", &[&self.last, &weights, &bias], &raw, attributes);
        self.net.node("Relu", &[&raw], &out, vec![]);
        (self.last, self.channels) = (out, channels);
    }

    /// A random number around 0, scaled so that sums of `fan_in` terms have the same size for any `fan_in`.
    fn random(&mut self, fan_in: usize) -> f32 {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let unit = (self.seed >> 8) as f32 / (1 << 24) as f32;
        (unit - 0.5) * (24.0 / fan_in as f32).sqrt()
    }
}
