//! Memory for scores, aligned to a cache line.

/// Size of a cache line, and of the widest register, in bytes.
const LINE: usize = 64;

/// A buffer of scores that begins at a cache line.
#[derive(Debug, Default)]
pub struct ScoreBuffer {
    data: Vec<f32>,
    start: usize,
    len: usize,
}

impl ScoreBuffer {
    /// Resizes the buffer to `len` scores with unspecified values.
    ///
    /// * Returns true if the length did not change; the values are then kept.
    pub fn resize(&mut self, len: usize) -> bool {
        let same = len == self.len;
        self.len = len;
        let room = len + LINE / size_of::<f32>() - 1;
        if self.data.len() < room {
            self.data.resize(room, 0.0);
        }
        // An interpreter such as Miri may not know the alignment of memory, but the values do not depend on the alignment.
        let start = self.data.as_ptr().align_offset(LINE);
        self.start = start.min(room - len);
        same
    }

    /// The scores.
    pub fn scores(&self) -> &[f32] {
        &self.data[self.start..][..self.len]
    }

    /// The scores, as a mutable slice.
    pub fn scores_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..][..self.len]
    }

    /// Allocated memory, in bytes.
    pub fn bytes(&self) -> usize {
        self.data.capacity() * size_of::<f32>()
    }
}
