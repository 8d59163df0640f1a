//! Range of every number of a deployment file.

use messages::{MAX_CANDIDATES, MAX_VIEWS};

/// Maximum number of cores that Linux supports on a machine.
pub const MAX_CORES: usize = 1024;

/// One hour, and one day, in milliseconds.
const HOUR_MS: f64 = 3_600_000.0;
const DAY_MS: f64 = 24.0 * HOUR_MS;
/// One day, in seconds.
const DAY_S: f64 = 86_400.0;
/// Maximum number of frames of any footage: a thousand years of video.
const MOST_FRAMES: f64 = 1e12;

/// Keys with their minimum and maximum. The value of a key is a number, a list of numbers or a table of numbers; for `camera`, the range
/// limits the length of the list.
///
/// The ranges of whole numbers are also given as `f64`, which represents all of them exactly.
pub(crate) const RANGES: [(&str, f64, f64); 27] = [
    ("capture.size", 1.0, 16_384.0),
    ("capture.scale", 0.001, 8.0),
    ("capture.frame_rate_hz", 0.001, 1e5),
    ("capture.start_frame", 0.0, MOST_FRAMES),
    ("capture.frame_step", 1.0, 1e9),
    ("capture.n_frames", 1.0, MOST_FRAMES),
    ("paper.candidates", 1.0, MAX_CANDIDATES as f64),
    ("network.find_every", 1.0, 1e6),
    ("network.least_heat", 0.0, 1.0),
    ("network.looks", 0.1, 1000.0),
    ("network.people", 1.0, MAX_CANDIDATES as f64),
    ("runtime.threads", 1.0, 256.0),
    ("paper.alpha", 0.0, 1e6),
    ("paper.beta", 0.0, 1e6),
    ("paper.tau", 0.0, 1e6),
    ("paper.workers", 1.0, MAX_VIEWS as f64),
    ("link.jpeg_quality", 1.0, 100.0),
    ("supervise.deadline_ms", 1.0, HOUR_MS),
    ("supervise.hang_limit_s", 1.0, DAY_S),
    ("supervise.missed_beats", 1.0, 1e6),
    ("supervise.max_restarts", 0.0, 1e6),
    ("supervise.latency_budget_ms", 1e-3, DAY_MS),
    ("runtime.cores", 0.0, (MAX_CORES - 1) as f64),
    ("runtime.priority", 1.0, 99.0),
    ("camera.offset_ms", -HOUR_MS, HOUR_MS),
    ("camera.drift_ppm", -1e4, 1e4),
    ("camera", 1.0, MAX_VIEWS as f64),
];

/// Returns the minimum and maximum of a key; infinite if the key has no row.
pub(crate) fn range(key: &str) -> [f64; 2] {
    let row = RANGES.iter().find(|range| range.0 == key);
    row.map_or([f64::NEG_INFINITY, f64::INFINITY], |&(_, least, most)| {
        [least, most]
    })
}
