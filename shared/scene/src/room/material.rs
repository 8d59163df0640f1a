//! The materials of rooms.

use nalgebra::Vector3;

use crate::colour::{Linear, srgb};
use crate::random::{Random, noise};

/// A material and its colour, in sRGB from 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Material {
    Plain([u8; 3]),
    /// Boards along x.
    Wood([u8; 3]),
    /// Squares of two shades, with their width in metres.
    Tiles([u8; 3], f32),
    Carpet([u8; 3]),
    Bricks([u8; 3]),
    /// Vertical stripes.
    Paper([u8; 3]),
    /// Rows of coloured book spines.
    Books(u32),
    /// A picture of coloured shapes.
    Poster(u32),
    /// Daylight behind bars.
    Window(u32),
}

fn chequered(u: f32, v: f32) -> f32 {
    let odd = (u.floor() + v.floor()).rem_euclid(2.0);
    if odd < 0.5 { 1.0 } else { 0.0 }
}

impl Material {
    /// Returns the colour at a point, which is given in metres in the object's own frame, or from -1 to 1 across a flat object on a wall.
    pub(crate) fn colour(self, at: &Vector3<f32>) -> Linear {
        let grain = |scale: f32, size: f32| 1.0 + size * noise(&(at * scale), 21);
        match self {
            Self::Plain(c) => srgb(c) * grain(3.0, 0.04),
            Self::Wood(c) => {
                let board = (at.y / 0.14).floor();
                let shade = noise(
                    &Vector3::new(board * 7.3, (at.x / 1.1 + board * 0.37).floor() * 3.1, 0.5),
                    22,
                );
                let rings = noise(&Vector3::new(at.x * 2.5, at.y * 60.0, at.z * 60.0), 23);
                let gap = if (at.y / 0.14).rem_euclid(1.0) < 0.02 {
                    0.55
                } else {
                    1.0
                };
                srgb(c) * ((1.0 + 0.16 * shade + 0.1 * rings) * gap)
            }
            Self::Tiles(c, wide) => {
                let [u, v] = [at.x / wide, at.y / wide];
                let joint = u.rem_euclid(1.0) < 0.025 || v.rem_euclid(1.0) < 0.025;
                let share = if joint {
                    0.5
                } else {
                    1.0 - 0.14 * chequered(u, v)
                };
                srgb(c) * (share * grain(2.0, 0.05))
            }
            Self::Carpet(c) => srgb(c) * (grain(160.0, 0.2) * grain(1.3, 0.06)),
            Self::Bricks(c) => {
                let row = (at.y / 0.075).floor();
                let u = at.x / 0.24 + 0.5 * row.rem_euclid(2.0);
                let joint = (at.y / 0.075).rem_euclid(1.0) < 0.13 || u.rem_euclid(1.0) < 0.045;
                let shade = noise(&Vector3::new(u.floor() * 5.7, row * 3.3, at.z), 24);
                if joint {
                    srgb([170, 164, 154])
                } else {
                    srgb(c) * (1.0 + 0.25 * shade)
                }
            }
            Self::Paper(c) => {
                let stripe = if (at.x / 0.2).rem_euclid(1.0) < 0.5 {
                    1.0
                } else {
                    0.86
                };
                srgb(c) * (stripe * grain(3.0, 0.03))
            }
            Self::Books(seed) => books(at, seed),
            Self::Poster(seed) => poster(at, seed),
            Self::Window(_) => {
                let bar = at.x.abs() < 0.04 || (at.y - 0.2).abs() < 0.03;
                let sky = 0.9 + 0.25 * at.y + 0.1 * noise(&(at * 3.0), 25);
                if bar {
                    srgb([220, 218, 212])
                } else {
                    Linear::new(0.92, 0.97, 1.05) * sky
                }
            }
        }
    }

    /// Returns the colour of the frame around a flat object of this material.
    pub(super) fn frame(self) -> Linear {
        match self {
            Self::Window(_) => srgb([225, 224, 220]),
            Self::Poster(seed) if seed.is_multiple_of(2) => srgb([40, 36, 34]),
            _ => srgb([140, 120, 96]),
        }
    }

    pub(super) fn shines(self) -> bool {
        matches!(self, Self::Window(_))
    }
}

fn books(at: &Vector3<f32>, seed: u32) -> Linear {
    let shelf = (at.z / 0.32).floor();
    let up = (at.z / 0.32).rem_euclid(1.0);
    if up < 0.07 {
        return srgb([120, 90, 60]);
    }
    let across = (at.x + at.y) / 0.045;
    let mut random = Random::new(u64::from(seed))
        .nth(shelf as i64 as u64)
        .nth(across.floor() as i64 as u64);
    let top = 0.6 + 0.35 * random.unit() as f32;
    let colour = [0, 0, 0].map(|_: u8| 40 + (170.0 * random.unit()) as u8);
    if up > top {
        srgb([26, 22, 20])
    } else {
        srgb(colour)
    }
}

fn poster(at: &Vector3<f32>, seed: u32) -> Linear {
    let mut random = Random::new(u64::from(seed)).fork("poster");
    let mut any = || [0, 0, 0].map(|_: u8| 30 + (215.0 * random.unit()) as u8);
    let mut colour = any();
    let shades = [any(), any(), any(), any()];
    for (nth, shade) in shades.into_iter().enumerate() {
        let mut place = Random::new(u64::from(seed)).fork("shape").nth(nth as u64);
        let [x, y] = [0, 1].map(|_| place.range(-0.9, 0.9) as f32);
        let [wide, high] = [0, 1].map(|_| place.range(0.15, 0.6) as f32);
        let [u, v] = [(at.x - x) / wide, (at.y - y) / high];
        let within = if nth % 2 == 0 {
            u * u + v * v < 1.0
        } else {
            u.abs() < 1.0 && v.abs() < 1.0
        };
        if within {
            colour = shade;
        }
    }
    srgb(colour)
}
