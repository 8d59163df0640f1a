//! Synthetic terms of other views.

use fmp::ExtraTerms;

use crate::common::Noise;

/// Synthetic terms of another view: every second part has a position term.
pub(crate) struct OtherView(pub(crate) u64);

impl ExtraTerms for OtherView {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        if !(self.0 as usize + part).is_multiple_of(2) {
            return false;
        }
        let mut noise = Noise(self.0 ^ ((part * 100 + level) as u64) << 20);
        for _ in 0..first {
            noise.next();
        }
        for it in score {
            *it += noise.score() as f32;
        }
        true
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        Noise(self.0 ^ ((part * 100 + mixture) as u64) << 40).score() as f32
    }
}

/// Terms that differ from part to part and from time to time; one seed for each part.
#[derive(Debug)]
pub(crate) struct OtherViews {
    pub(crate) seeds: Vec<u64>,
    /// Value that is added to every position term, and that no term exceeds.
    pub(crate) gain: f32,
    /// Factor by which all terms are multiplied.
    pub(crate) scale: f32,
    /// True if the maximum gain is reported.
    pub(crate) known: bool,
}

impl ExtraTerms for OtherViews {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let mut terms = vec![0.0; score.len()];
        // In `OtherView`, even parts have a term under even seeds.
        let other = OtherView(2 * self.seeds[part]);
        let has_one = other.add_position(2 * part, level, first, &mut terms);
        for (score, term) in score.iter_mut().zip(terms) {
            *score += self.scale * (term - 1.0 + self.gain);
        }
        has_one
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        self.scale * (OtherView(self.seeds[part]).of_type(part, mixture) - 1.0)
    }

    fn max_gain(&self, _part: usize) -> f32 {
        if self.known {
            self.scale * self.gain
        } else {
            f32::INFINITY
        }
    }

    fn key(&self, part: usize) -> Option<u64> {
        // Some parts never report a key.
        let key = self.seeds[part] ^ (u64::from(self.gain.to_bits()) << 32);
        (!self.seeds[part].is_multiple_of(5)).then_some(key)
    }
}
