//! A training picture with its boxes.

use serde::{Deserialize, Serialize};

/// Longest side of stored pictures, in pixels.
pub const SIDE: usize = 320;

/// A box around a person.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Around {
    /// Left, top, right, bottom, in pixels.
    pub outline: [f32; 4],
    /// True if the network should find this person. If false, the box is ignored: the person is hardly visible, or may not be a person at
    /// all.
    pub counts: bool,
}

impl Around {
    /// Area of the box: width times height.
    pub fn area(&self) -> f32 {
        let [left, top, right, bottom] = self.outline;
        (right - left).max(0.0) * (bottom - top).max(0.0)
    }

    /// Returns the overlap with another box (intersection over union).
    pub fn overlap(&self, other: &Self) -> f32 {
        let shared = self.cut(other.outline).area();
        shared / (self.area() + other.area() - shared).max(f32::MIN_POSITIVE)
    }

    /// Returns the part of the box within limits.
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

/// A picture, with the boxes of all people in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Name of the picture in messages.
    pub name: String,
    /// Width and height in pixels, at most [`SIDE`].
    pub size: [usize; 2],
    /// The pixels, row by row, red first.
    pub rgb: Vec<u8>,
    /// All people in the picture.
    pub people: Vec<Around>,
}

impl Picture {
    /// Returns true if the number of pixels matches the size.
    pub fn is_whole(&self) -> bool {
        let [width, height] = self.size;
        width > 0 && height > 0 && self.rgb.len() == 3 * width * height
    }
}
