//! A picture to learn from.

use serde::{Deserialize, Serialize};

/// Longest side of the pictures that are kept, pixels.
pub const SIDE: usize = 320;

/// A box around a person.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Around {
    /// Left, top, right, bottom, pixels.
    pub outline: [f32; 4],
    /// Set where the network should find it. Otherwise it is not asked: hardly anything is seen of the person, or nobody knows
    /// whether it is one.
    pub counts: bool,
}

impl Around {
    /// Width times height.
    pub fn area(&self) -> f32 {
        let [left, top, right, bottom] = self.outline;
        (right - left).max(0.0) * (bottom - top).max(0.0)
    }

    /// Returns what it shares with another box, as a share of their union.
    pub fn overlap(&self, other: &Self) -> f32 {
        let shared = self.cut(other.outline).area();
        shared / (self.area() + other.area() - shared).max(f32::MIN_POSITIVE)
    }

    /// The part within limits.
    #[must_use]
    pub fn cut(&self, [left, top, right, bottom]: [f32; 4]) -> Self {
        let own = self.outline;
        Self {
            outline: [
                own[0].max(left),
                own[1].max(top),
                own[2].min(right),
                own[3].min(bottom),
            ],
            ..*self
        }
    }
}

/// A picture, and the boxes of everybody in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Its name in messages.
    pub name: String,
    /// Width and height, pixels, [`SIDE`] at most.
    pub size: [usize; 2],
    /// The pixels, row by row, red first.
    pub rgb: Vec<u8>,
    /// Everybody in it.
    pub people: Vec<Around>,
}

impl Picture {
    /// Returns whether it has as many pixels as it says.
    pub fn is_whole(&self) -> bool {
        let [width, height] = self.size;
        width > 0 && height > 0 && self.rgb.len() == 3 * width * height
    }
}
