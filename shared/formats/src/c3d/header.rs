//! The header, and the points of the trial. The header gives the position of the points in the file.

use crate::c3d::C3dError;
use crate::c3d::numbers::{BLOCK, Bytes};
use crate::c3d::parameters::Parameters;

/// The fields of the header that are needed.
#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) n_points: usize,
    pub(crate) first_frame: u32,
    pub(crate) n_frames: usize,
    pub(crate) rate_hz: f64,
    /// Units per step of an integer; negative if the points are reals.
    scale: f32,
    /// Position at which the points begin.
    data: usize,
    /// Number of analog values that follow the points of each frame.
    n_analog: usize,
}

impl Header {
    /// Reads the first block.
    ///
    /// Frame numbers have 16 bits. If the last frame has the largest such number, parameters may give a larger one: `POINT:LONG_FRAMES`,
    /// `POINT:FRAMES` as a real, or the two words of `TRIAL:ACTUAL_END_FIELD`.
    pub(crate) fn read(bytes: Bytes<'_>, parameters: &Parameters<'_>) -> Result<Self, C3dError> {
        const WHAT: &str = "the header";
        let word = |nth: usize| bytes.u16(2 * (nth - 1), WHAT);
        let scale = bytes.f32(12, WHAT)?;
        if scale == 0.0 || !scale.is_finite() {
            let value = f64::from(scale);
            return Err(C3dError::Scale { value });
        }
        let (first, last) = (u32::from(word(4)?), u32::from(word(5)?));
        if last < first {
            return Err(C3dError::Frames { first, last });
        }
        let mut n_frames = (last - first + 1) as usize;
        if last == u32::from(u16::MAX) {
            let end = parameters.double_word("TRIAL", "ACTUAL_END_FIELD");
            let start = parameters.double_word("TRIAL", "ACTUAL_START_FIELD");
            let told = [
                parameters.number("POINT", "LONG_FRAMES"),
                parameters.number("POINT", "FRAMES"),
                end.map(|end| end - start.unwrap_or(1.0) + 1.0),
            ];
            let is_more = |value: &f64| *value > n_frames as f64 && *value < 1e9;
            let more = told.into_iter().flatten().find(is_more);
            n_frames = more.map_or(n_frames, |more| more as usize);
        }
        let rate = f64::from(bytes.f32(20, WHAT)?);
        let is_rate = |value: &f64| value.is_finite() && *value > 0.0;
        let rates = [Some(rate), parameters.number("POINT", "RATE")];
        Ok(Self {
            n_points: usize::from(word(2)?),
            first_frame: first,
            n_frames,
            rate_hz: rates.into_iter().flatten().find(is_rate).unwrap_or(0.0),
            scale,
            data: usize::from(word(9)?.max(1) - 1) * BLOCK,
            n_analog: usize::from(word(3)?),
        })
    }

    /// Returns all points, frame by frame.
    pub(crate) fn points(&self, bytes: Bytes<'_>) -> Result<Vec<Option<[f64; 3]>>, C3dError> {
        let width = if self.scale < 0.0 { 4 } else { 2 };
        let of_points = 4 * width * self.n_points;
        let of_frame = of_points + width * self.n_analog;
        let n = of_frame.saturating_mul(self.n_frames);
        let all = bytes.slice(self.data, n, "the last frame")?;
        let mut points = Vec::with_capacity(self.n_points * self.n_frames);
        if of_points == 0 {
            return Ok(points);
        }
        for frame in all.chunks_exact(of_frame) {
            for point in frame[..of_points].chunks_exact(4 * width) {
                points.push(self.point(bytes, point));
            }
        }
        Ok(points)
    }

    /// Returns a point; `None` if its fourth value is negative, or if its position is not finite.
    fn point(&self, bytes: Bytes<'_>, point: &[u8]) -> Option<[f64; 3]> {
        let (place, residual) = if self.scale < 0.0 {
            let [x, y, z, w] = *point.as_chunks().0.first_chunk()?;
            let place = [x, y, z].map(|coordinate| f64::from(bytes.f32_of(coordinate)));
            (place, bytes.f32_of(w))
        } else {
            let [x, y, z, w] = *point.as_chunks().0.first_chunk()?;
            let whole = |bytes_of_word: [u8; 2]| bytes.u16_of(bytes_of_word) as i16;
            let place = [x, y, z].map(|word| f64::from(whole(word)) * f64::from(self.scale));
            (place, f32::from(whole(w)))
        };
        let is_seen = residual >= 0.0 && place.iter().all(|value| value.is_finite());
        is_seen.then_some(place)
    }
}
