//! Measures the search of frames by the filters on the GPU, and on the processor for comparison.

use core::time::Duration;
use std::sync::Arc;
use std::time::Instant;

use exports::report::run::Limit;
use failure::wording::Table;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::{Layout, Model, Scope};
use gpu::{Choice, Device};
use kernels::Rgb8View;
use pipeline::{ComputedOn, EvidenceWindow, ViewSettings, ViewStep};
use rayon::prelude::*;
use serde_json::{Value, json};
use terminal::output::{self, Verbosity};

use super::provenance::Provenance;
use super::report::Report;
use crate::spread::Spread;

/// Number of rounds before the measured rounds, in which kernels are compiled and memory is allocated.
const WARM_UP: usize = 3;

/// Options of the benchmark of the GPU.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// Widths and heights of the frames, in pixels.
    pub sizes: Vec<[usize; 2]>,
    /// Numbers of views that are searched at the same time.
    pub views: Vec<usize>,
    /// Frame rates, in hertz; 0 means as fast as possible.
    pub rates_hz: Vec<f64>,
    /// Number of frames for each row of the table.
    pub frames: usize,
    /// True if software Vulkan is allowed.
    pub software: bool,
}

/// A row of the table.
struct Row {
    device: &'static str,
    size: [usize; 2],
    n_views: usize,
    rate_hz: f64,
    /// Time from the arrival of the pictures to the poses and evidence of all views, in milliseconds.
    spread: Option<Spread>,
}

/// Measures all rows.
///
/// # Errors
///
/// Fails if there is no GPU, if it cannot run the search, or if it is lost.
pub fn gpu(options: &Gpu, verbosity: Verbosity) -> Result<Report, Failure> {
    let provenance = Provenance::now();
    let choice = if options.software {
        Choice::Any
    } else {
        Choice::Hardware
    };
    let device = Arc::new(Device::open(choice).or_fail(ExitKind::Config)?);
    let model = inputs::model_or_shipped(None)?;
    let mut rows = Vec::new();
    for &size in &options.sizes {
        for &n_views in &options.views {
            for on_gpu in [true, false] {
                let name = if on_gpu { "GPU" } else { "processor" };
                if !verbosity.quiet {
                    let [width, height] = size;
                    output::message(format_args!(
                        "{name}, {width}x{height}, views: {n_views} ..."
                    ));
                }
                let steps = steps(&model, size, n_views, on_gpu.then_some(&device))?;
                for &rate_hz in &options.rates_hz {
                    rows.push(Row {
                        device: name,
                        size,
                        n_views,
                        rate_hz,
                        spread: measure(&steps, rate_hz, options.frames, on_gpu)?,
                    });
                }
            }
        }
    }
    Ok(options.report(provenance, &device, &rows))
}

/// Returns a search step for each view.
fn steps(
    model: &Arc<Model>,
    [width, height]: [usize; 2],
    n_views: usize,
    device: Option<&Arc<Device>>,
) -> Result<Vec<ViewStep>, Failure> {
    let layout = Arc::new(Layout::new(model, width, height).or_fail(ExitKind::Usage)?);
    let step = |_| {
        let settings = ViewSettings {
            window: EvidenceWindow::Around(2),
            ..ViewSettings::default()
        };
        let step = ViewStep::new(Arc::clone(model), Arc::clone(&layout), settings);
        match device {
            Some(device) => {
                step.on_gpu(device).map_err(|(_, error)| error).or_fail(ExitKind::Config)
            }
            None => Ok(step),
        }
    };
    (0..n_views).map(step).collect()
}

/// Searches frames of all views at a rate.
fn measure(
    steps: &[ViewStep],
    rate_hz: f64,
    n_frames: usize,
    on_gpu: bool,
) -> Result<Option<Spread>, Failure> {
    let Some(first) = steps.first() else {
        return Ok(None);
    };
    let [width, height] = first.layout().image_size;
    let pixels = picture(width, height);
    let image = Rgb8View::new(width, height, &pixels).or_fail(ExitKind::Usage)?;
    let scope = Scope::whole(first.layout());
    let mut responses = vec![vec![0.0; first.layout().n_responses()]; steps.len()];
    let mut times = Vec::new();
    let mut next = Instant::now();
    for frame in 0..WARM_UP + n_frames {
        if rate_hz > 0.0 {
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
            next += Duration::from_secs_f64(1.0 / rate_hz);
        }
        let begin = Instant::now();
        let searched = steps.par_iter().zip(&mut responses);
        let computed_on =
            searched.map(|(step, responses)| step.run(image, scope, responses).computed_on);
        let is_lost = computed_on.filter(|by| *by == ComputedOn::ProcessorForGpu).count() > 0;
        if is_lost && on_gpu {
            return Err(gpu::DeviceLost).or_fail(ExitKind::Run);
        }
        if frame >= WARM_UP {
            times.push(begin.elapsed().as_secs_f64() * 1e3);
        }
    }
    Ok(Spread::of(times))
}

/// Returns a picture with edges in all directions: circles and noise.
fn picture(width: usize, height: usize) -> Vec<u8> {
    let mut rng = fastrand::Rng::with_seed(1);
    let mut pixel = |at: usize| {
        let (x, y) = ((at / 3 % width) as f64, (at / 3 / width) as f64);
        let around = ((x - width as f64 / 2.0).hypot(y - height as f64 / 3.0) / 9.0).sin();
        (110.0 + 80.0 * around) as u8 + rng.u8(0..60)
    };
    (0..3 * width * height).map(&mut pixel).collect()
}

impl Gpu {
    fn report(&self, provenance: Provenance, device: &Device, rows: &[Row]) -> Report {
        let mut table = Table::new([
            "<device", "size", "views", "hertz", "p50", "p99", "p99.9", "max",
        ]);
        for row in rows {
            let [width, height] = row.size;
            let rate = if row.rate_hz > 0.0 {
                format!("{}", row.rate_hz)
            } else {
                "free".to_owned()
            };
            let head = [
                row.device.to_owned(),
                format!("{width}x{height}"),
                row.n_views.to_string(),
                rate,
            ];
            table.row(head.into_iter().chain(Spread::cells(row.spread, 2)));
        }
        let numbers = rows.iter().map(|row| {
            json!({ "device": row.device, "size": row.size, "views": row.n_views, "rate_hz": row.rate_hz, "ms": row.spread })
        });
        Report {
            bench: "gpu",
            title: "from pictures to poses and evidence, all views of a frame, milliseconds"
                .to_owned(),
            provenance,
            settings: json!({ "frames": self.frames, "adapter": device.adapter().to_string() }),
            table,
            notes: Vec::new(),
            limits: Vec::<Limit>::new(),
            numbers: Value::Array(numbers.collect()),
        }
    }
}
