//! A room around the stage: floor, walls with windows and pictures, furniture; rendered by ray casting.

mod furnish;
mod material;

use nalgebra::{Point3, Vector2, Vector3};

use crate::colour::Linear;
use crate::light::Light;
use crate::random::Random;
pub(crate) use material::Material;

/// An upright box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Block {
    /// Centre, in metres in the frame of the stage.
    pub(crate) centre: [f32; 3],
    /// Half of the side lengths along the block's own axes, in metres.
    pub(crate) half: [f32; 3],
    /// Sine and cosine of the rotation about the vertical.
    turn: [f32; 2],
    /// Radius of the bounding ball, in metres.
    reach: f32,
    pub(crate) material: Material,
}

impl Block {
    /// * `yaw`: rotation about the vertical, in radians.
    pub(crate) fn new(centre: [f32; 3], half: [f32; 3], yaw: f32, material: Material) -> Self {
        let (sin, cos) = yaw.sin_cos();
        Self {
            centre,
            half,
            turn: [sin, cos],
            reach: Vector3::from(half).norm(),
            material,
        }
    }

    /// Returns the block enlarged by a distance on every side.
    fn grown(&self, by: f32) -> Self {
        Self {
            half: self.half.map(|half| half + by),
            reach: self.reach + 2.0 * by,
            ..*self
        }
    }
}

/// A flat object on a wall.
#[derive(Debug, Clone, Copy)]
struct Panel {
    /// Centre and half size, along the wall and upwards, in metres.
    middle: [f32; 2],
    half: [f32; 2],
    material: Material,
}

/// The walls, which form a rectangle around the stage.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    low: Vector3<f32>,
    high: Vector3<f32>,
    floor: Material,
    wall: Material,
    /// Flat objects on the walls at -x, +x, -y, +y.
    panels: [Vec<Panel>; 4],
    blocks: Vec<Block>,
    pub(crate) light: Light,
}

/// The point at which a ray ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Distance along the ray, in lengths of its direction vector.
    pub(crate) along: f32,
    pub(crate) at: Vector3<f32>,
    pub(crate) normal: Vector3<f32>,
    pub(crate) colour: Linear,
    /// True if the surface emits light and is not affected by the lamps.
    pub(crate) shines: bool,
    /// Fraction of the ambient light that nearby corners of the room block.
    pub(crate) dim: f32,
}

impl Room {
    /// Creates a random room that contains the cameras.
    ///
    /// * `cameras`: positions of the cameras; no random furniture is placed between them and the stage.
    /// * `furniture`: furniture that the action needs, already in position.
    pub(crate) fn new(random: Random, cameras: &[Point3<f32>], furniture: Vec<Block>) -> Self {
        furnish::room(random, cameras, furniture)
    }

    /// Returns the first hit of a ray from inside the room.
    pub(crate) fn cast(&self, from: &Point3<f32>, direction: &Vector3<f32>) -> Hit {
        let mut hit = self.walls(from, direction);
        for block in &self.blocks {
            if let Some((along, normal, local)) = block.enter(from, direction)
                && along < hit.along
            {
                let at = from.coords + direction * along;
                hit = Hit {
                    along,
                    at,
                    normal,
                    colour: block.material.colour(&local),
                    shines: false,
                    dim: 0.3 * (-(at.z - self.low.z).max(0.0) / 0.12).exp(),
                };
            }
        }
        hit
    }

    /// Returns true if furniture is between a point and the key lamp.
    pub(crate) fn is_shaded(&self, at: &Vector3<f32>, towards: &Vector3<f32>) -> bool {
        let from = Point3::from(at + towards * 2e-3);
        self.blocks.iter().any(|block| block.enter(&from, towards).is_some())
    }

    fn walls(&self, from: &Point3<f32>, direction: &Vector3<f32>) -> Hit {
        let mut best = (f32::INFINITY, 0);
        for axis in 0..3 {
            let wall = if direction[axis] > 0.0 {
                self.high
            } else {
                self.low
            };
            let along = (wall[axis] - from[axis]) / direction[axis];
            if along < best.0 {
                best = (along, axis);
            }
        }
        let (along, axis) = best;
        let at = from.coords + direction * along;
        let outward = direction[axis] > 0.0;
        let mut normal = Vector3::zeros();
        normal[axis] = if outward { -1.0 } else { 1.0 };
        let edge = (0..3)
            .filter(|i| *i != axis)
            .map(|i| (at[i] - self.low[i]).min(self.high[i] - at[i]));
        let near: f32 = edge.map(|edge| (-edge.max(0.0) / 0.3).exp()).sum();
        let (colour, shines) = match axis {
            2 if outward => (Linear::new(0.78, 0.77, 0.74), false),
            2 => (self.floor.colour(&at), false),
            _ => self.wall_colour(2 * axis + usize::from(outward), &at),
        };
        Hit {
            along,
            at,
            normal,
            colour,
            shines,
            dim: (0.35 * near).min(0.6),
        }
    }

    fn wall_colour(&self, wall: usize, at: &Vector3<f32>) -> (Linear, bool) {
        let place = Vector2::new(if wall < 2 { at.y } else { at.x }, at.z - self.low.z);
        for panel in &self.panels[wall] {
            let off = place - Vector2::from(panel.middle);
            if off.x.abs() < panel.half[0] && off.y.abs() < panel.half[1] {
                let share = Vector3::new(off.x / panel.half[0], off.y / panel.half[1], 0.0);
                let frame = (0.05 / panel.half[0], 0.05 / panel.half[1]);
                if share.x.abs() > 1.0 - frame.0 || share.y.abs() > 1.0 - frame.1 {
                    return (panel.material.frame(), false);
                }
                return (panel.material.colour(&share), panel.material.shines());
            }
        }
        if place.y < 0.09 {
            return (Linear::new(0.5, 0.48, 0.45), false);
        }
        (
            self.wall.colour(&Vector3::new(place.x, place.y, wall as f32)),
            false,
        )
    }
}

impl Block {
    /// Returns where a ray from outside enters the block: the distance along the ray, the normal, and the position in the block's own
    /// frame.
    fn enter(
        &self,
        from: &Point3<f32>,
        direction: &Vector3<f32>,
    ) -> Option<(f32, Vector3<f32>, Vector3<f32>)> {
        let [sin, cos] = self.turn;
        let off = Vector3::from(self.centre) - from.coords;
        let along = off.dot(direction);
        let length2 = direction.norm_squared();
        // The ray misses the bounding ball, or the ball is behind the ray.
        if off.norm_squared() * length2 - along * along > self.reach * self.reach * length2
            || along < -self.reach * length2.sqrt()
        {
            return None;
        }
        let inside =
            |v: Vector3<f32>| Vector3::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x, v.z);
        let origin = inside(-off);
        let heading = inside(*direction);
        let (mut first, mut last, mut face) = (f32::MIN, f32::MAX, 0);
        for axis in 0..3 {
            let over = 1.0 / heading[axis];
            let mid = -origin[axis] * over;
            let reach = self.half[axis] * over.abs();
            if mid - reach > first {
                (first, face) = (mid - reach, axis);
            }
            last = last.min(mid + reach);
        }
        if !(first > 0.0 && first < last) {
            return None;
        }
        let mut normal = Vector3::zeros();
        normal[face] = -heading[face].signum();
        let normal = Vector3::new(
            cos * normal.x - sin * normal.y,
            sin * normal.x + cos * normal.y,
            normal.z,
        );
        Some((first, normal, origin + heading * first))
    }
}

#[cfg(test)]
mod tests;
