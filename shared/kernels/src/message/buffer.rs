//! Memory for scores that begins where a cache line does.

/// Bytes of a cache line, and of the widest register.
const LINE: usize = 64;

/// A buffer of scores whose first one lies at the beginning of a cache line.
#[derive(Debug, Default)]
pub struct ScoreBuffer {
    data: Vec<f32>,
    start: usize,
    len: usize,
}

impl ScoreBuffer {
    /// Makes the buffer hold `len` scores, whose values are unspecified.
    ///
    /// * Returns whether they are still those of before.
    pub fn resize(&mut self, len: usize) -> bool {
        let same = len == self.len;
        self.len = len;
        let room = len + LINE / size_of::<f32>() - 1;
        if self.data.len() < room {
            self.data.resize(room, 0.0);
        }
        // An interpreter may refuse to say how memory is aligned; the values do not depend on it.
        let start = self.data.as_ptr().align_offset(LINE);
        self.start = start.min(room - len);
        same
    }

    /// The scores.
    pub fn scores(&self) -> &[f32] {
        &self.data[self.start..][..self.len]
    }

    /// The scores, to be written.
    pub fn scores_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..][..self.len]
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        self.data.capacity() * size_of::<f32>()
    }
}
