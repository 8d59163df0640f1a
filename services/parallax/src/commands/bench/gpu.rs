//! `parallax bench gpu`: measures how fast the filters search frames, on the GPU and on the processor.

use clap::Args;
use trials::bench::Gpu;

use super::{EXITS, Output};

const HELP: &str = "\
Searches frames with the shipped model, and measures the time from the picture to poses and evidence. Frames are searched at the rates of \
cameras, and as fast as possible (0). At a camera's rate, a graphics card may lower its clock between frames. All views of a frame are searched \
at the same time, by threads of one process, which share the GPU. The picture is artificial.";

/// Options of the GPU benchmark.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// Sizes of the frames, in pixels.
    #[arg(long, value_name = "WxH,..", value_delimiter = ',', default_value = "172x224,640x480", value_parser = size)]
    sizes: Vec<[usize; 2]>,
    /// Numbers of views.
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "1,4", value_parser = clap::value_parser!(u64).range(1..=64))]
    views: Vec<u64>,
    /// Frame rates in frames per second, or 0 for as fast as possible.
    #[arg(long, value_name = "HZ,..", value_delimiter = ',', default_value = "0,60,30,10", value_parser = rate)]
    rates: Vec<f64>,
    /// Number of frames to measure for every row of the table.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Use software Vulkan if there is no GPU, to check that the search works.
    #[arg(long)]
    software: bool,
    /// Output options.
    #[command(flatten)]
    pub(super) output: Output,
}

impl Arguments {
    /// Returns the options of the benchmark.
    pub(super) fn options(&self) -> Gpu {
        Gpu {
            sizes: self.sizes.clone(),
            views: self.views.iter().map(|n| *n as usize).collect(),
            rates_hz: self.rates.clone(),
            frames: self.frames as usize,
            software: self.software,
        }
    }
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let side = |side: &str| side.parse().ok().filter(|side| (40..=4096).contains(side));
    let sides = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, 40 to 4096 pixels each".to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (0.0..=1000.0).contains(rate));
    rate.ok_or_else(|| "expected 0 to 1000 hertz".to_owned())
}
