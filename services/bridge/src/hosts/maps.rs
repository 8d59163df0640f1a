//! Format of a view's maps between two hosts: Gaussians, after the poses.
//!
//! All numbers are little endian. The number of people comes first (`u32`). Each person has the position of the first cell and the distance
//! between cells (two `f64` each), and the numbers of columns, rows and Gaussians (`u32` each). Each Gaussian has its joint (`u32`),
//! position, height and precision (six `f32`).

/// Number of bytes per person.
const PERSON: usize = 44;
/// Number of bytes per Gaussian.
const EACH: usize = 28;
/// Maximum number of Gaussians in a message.
pub const MOST_GAUSSIANS: usize = 1024;

/// A Gaussian that approximates a peak of the heat in a joint's map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    /// Index of the joint.
    pub joint: u32,
    /// Position of the maximum: column and row, in cells of the map.
    pub at: [f32; 2],
    /// Heat at the maximum.
    pub heat: f32,
    /// Inverse of the covariance, per square cell: horizontal, mixed and vertical entry.
    pub precision: [f32; 3],
}

/// The maps of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct PersonGaussians {
    /// Centre of the first cell, in pixels of the frame.
    pub first_px: [f64; 2],
    /// Distance between neighbouring cells, horizontally and vertically, in pixels of the frame.
    pub cell_px: [f64; 2],
    /// Number of columns and rows.
    pub size: [u32; 2],
    /// Gaussians, ordered by joint. The highest Gaussian of each joint comes first.
    pub gaussians: Vec<Gaussian>,
}

/// The maps of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct Maps {
    /// The people, in the order of the candidates.
    pub people: Vec<PersonGaussians>,
}

/// Error for bytes that are not maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MapsError {
    /// The maps are truncated, or longer than their header states.
    #[error("the maps have {len} bytes, expected {expected}")]
    Length {
        /// Length of the maps.
        len: usize,
        /// Length according to the header, or the shortest possible length.
        expected: usize,
    },
    /// There are more Gaussians than any host sends.
    #[error("the maps have {got} Gaussians, but at most {MOST_GAUSSIANS} are allowed")]
    Many {
        /// Number of Gaussians.
        got: usize,
    },
}

impl Maps {
    /// Returns the maps as bytes. If there are more than [`MOST_GAUSSIANS`], the last Gaussians are left out.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = (self.people.len() as u32).to_le_bytes().to_vec();
        let mut n_left = MOST_GAUSSIANS;
        for person in &self.people {
            let n = person.gaussians.len().min(n_left);
            n_left -= n;
            for number in [person.first_px, person.cell_px].as_flattened() {
                out.extend_from_slice(&number.to_le_bytes());
            }
            let [columns, rows] = person.size;
            for number in [columns, rows, n as u32] {
                out.extend_from_slice(&number.to_le_bytes());
            }
            for gaussian in &person.gaussians[..n] {
                out.extend_from_slice(&gaussian.joint.to_le_bytes());
                let [xx, xy, yy] = gaussian.precision;
                let [x, y] = gaussian.at;
                for number in [x, y, gaussian.heat, xx, xy, yy] {
                    out.extend_from_slice(&number.to_le_bytes());
                }
            }
        }
        out
    }

    /// Parses maps. The receiver must check that the cells are in the picture, and that the numbers are plausible.
    ///
    /// # Errors
    ///
    /// Fails with [`MapsError`] if the bytes are not maps.
    pub fn parse(bytes: &[u8]) -> Result<Self, MapsError> {
        let mut reader = Reader { bytes, at: 0 };
        let n_people = reader.u32()?;
        let mut people = Vec::new();
        let mut n_gaussians = 0;
        for _ in 0..n_people {
            reader.needs(PERSON)?;
            let mut number = || reader.f64();
            let (first_px, cell_px) = ([number()?, number()?], [number()?, number()?]);
            let size = [reader.u32()?, reader.u32()?];
            let n = reader.u32()? as usize;
            n_gaussians += n;
            if n_gaussians > MOST_GAUSSIANS {
                return Err(MapsError::Many { got: n_gaussians });
            }
            reader.needs(n * EACH)?;
            let gaussians: Result<Vec<Gaussian>, MapsError> =
                (0..n).map(|_| reader.gaussian()).collect();
            people.push(PersonGaussians {
                first_px,
                cell_px,
                size,
                gaussians: gaussians?,
            });
        }
        if reader.at != bytes.len() {
            return Err(reader.length(reader.at));
        }
        Ok(Self { people })
    }
}

/// Reads a sequence of numbers.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn length(&self, expected: usize) -> MapsError {
        MapsError::Length {
            len: self.bytes.len(),
            expected,
        }
    }

    /// Checks that at least this many bytes are left.
    fn needs(&self, n: usize) -> Result<(), MapsError> {
        let end = self.at + n;
        if self.bytes.len() < end {
            return Err(self.length(end));
        }
        Ok(())
    }

    fn next<const N: usize>(&mut self) -> Result<[u8; N], MapsError> {
        let left = self.bytes.get(self.at..).and_then(|left| left.first_chunk());
        let chunk = left.ok_or(self.length(self.at + N))?;
        self.at += N;
        Ok(*chunk)
    }

    fn u32(&mut self) -> Result<u32, MapsError> {
        self.next().map(u32::from_le_bytes)
    }

    fn f32(&mut self) -> Result<f32, MapsError> {
        self.next().map(f32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, MapsError> {
        self.next().map(f64::from_le_bytes)
    }

    fn gaussian(&mut self) -> Result<Gaussian, MapsError> {
        Ok(Gaussian {
            joint: self.u32()?,
            at: [self.f32()?, self.f32()?],
            heat: self.f32()?,
            precision: [self.f32()?, self.f32()?, self.f32()?],
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
        let person = |n: usize| PersonGaussians {
            first_px: [10.5, -3.0],
            cell_px: [4.0, 4.25],
            size: [48, 64],
            gaussians: (0..n).map(gaussian).collect(),
        };
        Maps {
            people: vec![person(n / 2), person(n - n / 2)],
        }
    }

    #[test]
    fn maps_survive_a_round_trip() {
        for n in [0, 1, 40, MOST_GAUSSIANS] {
            assert_eq!(Maps::parse(&maps(n).to_bytes()), Ok(maps(n)));
        }
        let mut more = maps(MOST_GAUSSIANS);
        let first = more.people[0].gaussians[0];
        more.people[1].gaussians.push(first);
        let sent = Maps::parse(&more.to_bytes()).unwrap();
        assert_eq!(sent, maps(MOST_GAUSSIANS));
    }

    #[test]
    fn truncated_maps_and_maps_with_too_many_gaussians_are_refused_with_the_number() {
        let whole = maps(2).to_bytes();
        let refused = |bytes: &[u8]| Maps::parse(bytes).unwrap_err().to_string();
        assert_eq!(whole.len(), 4 + 2 * (PERSON + EACH));
        assert!(refused(&whole[..10]).contains("10 bytes, expected 48"));
        assert!(refused(&whole[..75]).contains("75 bytes, expected 76"));
        assert!(refused(&[&whole[..], b"x"].concat()).contains("149 bytes, expected 148"));
        let mut many = whole;
        many[44..48].copy_from_slice(&1200_u32.to_le_bytes());
        assert!(refused(&many).contains("1200 Gaussians, but at most 1024 are allowed"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_parsed_as_maps_or_refused(bytes: Vec<u8>) {
            let parsed = Maps::parse(&bytes);
            if let Ok(maps) = parsed {
                prop_assert_eq!(maps.to_bytes(), bytes);
            }
        }
    }
}
