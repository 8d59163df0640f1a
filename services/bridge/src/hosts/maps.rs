//! The maps of a view on their way between two hosts, as Gaussians after its poses.
//!
//! Bytes, little endian: level and number of Gaussians (`u16` each), first column and the one after the last, first row and the one after
//! the last of the region (`u32` each), then for every Gaussian its joint (`u32`), place, height and precision (six `f32`).

/// Bytes before the Gaussians, and of each of them.
const HEAD: usize = 20;
const EACH: usize = 28;
/// Most Gaussians of a message.
pub const MOST_GAUSSIANS: usize = 512;

/// A Gaussian of the heat of a joint's map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    /// The joint.
    pub joint: u32,
    /// Where it is highest: column and row, cells of the level.
    pub at: [f32; 2],
    /// The heat there.
    pub heat: f32,
    /// The inverse of its covariance: across, both, down; per square cell.
    pub precision: [f32; 3],
}

/// The maps of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct Maps {
    /// The level of the pyramid that they have.
    pub level: u16,
    /// First column of the picture that they cover, and the one after the last, pixels.
    pub x: [u32; 2],
    /// First row that they cover, and the one after the last, pixels.
    pub y: [u32; 2],
    /// The highest first, of one joint after the other.
    pub gaussians: Vec<Gaussian>,
}

/// Bytes that are no maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MapsError {
    /// They are cut off, or longer than they say.
    #[error("maps of {len} bytes, expected {expected}")]
    Length {
        /// Their length.
        len: usize,
        /// What they say, or the shortest possible.
        expected: usize,
    },
    /// There are more than any host sends.
    #[error("{got} Gaussians, at most {MOST_GAUSSIANS}")]
    Many {
        /// How many.
        got: usize,
    },
}

impl Maps {
    /// The maps as bytes. Beyond [`MOST_GAUSSIANS`] the last are left out.
    pub fn to_bytes(&self) -> Vec<u8> {
        let gaussians = &self.gaussians[..self.gaussians.len().min(MOST_GAUSSIANS)];
        let mut out = Vec::with_capacity(HEAD + EACH * gaussians.len());
        out.extend_from_slice(&self.level.to_le_bytes());
        out.extend_from_slice(&(gaussians.len() as u16).to_le_bytes());
        for number in [self.x, self.y].as_flattened() {
            out.extend_from_slice(&number.to_le_bytes());
        }
        for it in gaussians {
            out.extend_from_slice(&it.joint.to_le_bytes());
            let [xx, xy, yy] = it.precision;
            for number in [it.at[0], it.at[1], it.heat, xx, xy, yy] {
                out.extend_from_slice(&number.to_le_bytes());
            }
        }
        out
    }

    /// Reads maps. Whether the region lies in the picture, and whether the numbers can be, is for the receiver to say.
    ///
    /// # Errors
    ///
    /// [`MapsError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, MapsError> {
        let length = |expected| MapsError::Length {
            len: bytes.len(),
            expected,
        };
        let (head, rest) = bytes.split_at_checked(HEAD).ok_or(length(HEAD))?;
        let two = |at: usize| u16::from_le_bytes([head[at], head[at + 1]]);
        let four = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|it| head[at + it]));
        let n = usize::from(two(2));
        if n > MOST_GAUSSIANS {
            return Err(MapsError::Many { got: n });
        }
        if rest.len() != n * EACH {
            return Err(length(HEAD + n * EACH));
        }
        let gaussian = |it: &[u8]| {
            let word = |nth: usize| [0, 1, 2, 3].map(|byte| it[4 * nth + byte]);
            let number = |nth: usize| f32::from_le_bytes(word(nth));
            Gaussian {
                joint: u32::from_le_bytes(word(0)),
                at: [1, 2].map(number),
                heat: number(3),
                precision: [4, 5, 6].map(number),
            }
        };
        Ok(Self {
            level: two(0),
            x: [four(4), four(8)],
            y: [four(12), four(16)],
            gaussians: rest.chunks_exact(EACH).map(gaussian).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn maps(n: usize) -> Maps {
        let gaussian = |nth: usize| Gaussian {
            joint: nth as u32 % 14,
            at: [nth as f32 + 0.25, 7.5],
            heat: 0.5,
            precision: [0.25, -0.125, 1.0],
        };
        Maps {
            level: 3,
            x: [10, 300],
            y: [0, 70_000],
            gaussians: (0..n).map(gaussian).collect(),
        }
    }

    #[test]
    fn maps_survive_the_way() {
        for n in [0, 1, 40, MOST_GAUSSIANS] {
            assert_eq!(Maps::parse(&maps(n).to_bytes()), Ok(maps(n)));
        }
        let more = Maps::parse(&maps(MOST_GAUSSIANS + 5).to_bytes()).unwrap();
        assert_eq!(more, maps(MOST_GAUSSIANS));
    }

    #[test]
    fn what_is_cut_off_or_too_much_is_refused_with_the_number() {
        let whole = maps(2).to_bytes();
        let refused = |bytes: &[u8]| Maps::parse(bytes).unwrap_err().to_string();
        assert!(refused(&whole[..10]).contains("10 bytes, expected 20"));
        assert!(refused(&whole[..75]).contains("75 bytes, expected 76"));
        let mut many = whole;
        many[2..4].copy_from_slice(&600_u16.to_le_bytes());
        assert!(refused(&many).contains("600 Gaussians, at most 512"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_maps_or_refused(bytes: Vec<u8>) {
            let parsed = Maps::parse(&bytes);
            if let Ok(maps) = parsed {
                prop_assert_eq!(maps.to_bytes(), bytes);
            }
        }
    }
}
