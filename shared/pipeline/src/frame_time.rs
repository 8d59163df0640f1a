//! Times of frames.

/// Returns the time of a frame, in seconds; if the frame rate is unknown, a typical one is assumed.
pub fn time_s(frame: u64, frame_rate_hz: Option<f64>) -> f64 {
    const COMMON_HZ: f64 = 30.0;
    frame as f64 / frame_rate_hz.unwrap_or(COMMON_HZ)
}
