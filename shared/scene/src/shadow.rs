//! The shadows of people, as a shadow map of the key lamp.

use nalgebra::{Point3, Vector2, Vector3};

use crate::light::Light;

/// Width of a cell, in metres.
const CELL: f32 = 0.011;

/// The surface of a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surface<'a> {
    pub(crate) points: &'a [Point3<f32>],
    pub(crate) triangles: &'a [[u32; 3]],
}

/// The shadow map of all bodies.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shadow {
    low: Vector2<f32>,
    width: usize,
    height: usize,
    /// Coordinate, towards the lamp, of the nearest point of a body in each cell; minus infinity for an empty cell.
    near: Vec<f32>,
}

impl Shadow {
    /// Draws the bodies into the shadow map.
    pub(crate) fn cast(&mut self, light: &Light, bodies: &[Surface<'_>]) {
        let points = bodies.iter().flat_map(|body| body.points);
        let beams: Vec<(Vector2<f32>, f32)> =
            points.map(|point| light.beam(&point.coords)).collect();
        let (mut low, mut high) = (Vector2::repeat(f32::MAX), Vector2::repeat(f32::MIN));
        for (across, _) in &beams {
            low = low.inf(across);
            high = high.sup(across);
        }
        let extent = ((high - low) / CELL).map(|value| value.clamp(0.0, 2000.0));
        self.low = low;
        (self.width, self.height) = (extent.x as usize + 2, extent.y as usize + 2);
        self.near.clear();
        self.near.resize(self.width * self.height, f32::NEG_INFINITY);
        let mut first = 0;
        for Surface { points, triangles } in bodies {
            for triangle in *triangles {
                self.draw(triangle.map(|triangle| {
                    let (across, near) = beams[first + triangle as usize];
                    let at = (across - low) / CELL;
                    Vector3::new(at.x, at.y, near)
                }));
            }
            first += points.len();
        }
    }

    fn draw(&mut self, [a, b, c]: [Vector3<f32>; 3]) {
        let area = (b - a).xy().perp(&(c - a).xy());
        if area.abs() < 1e-9 {
            return;
        }
        let range = |values: [f32; 3], n: usize| {
            let low = values[0].min(values[1]).min(values[2]).ceil().max(0.0) as usize;
            let high = values[0].max(values[1]).max(values[2]).floor().max(0.0) as usize + 1;
            low..high.min(n)
        };
        for y in range([a.y, b.y, c.y], self.height) {
            for x in range([a.x, b.x, c.x], self.width) {
                let p = Vector2::new(x as f32, y as f32);
                let u = (c - b).xy().perp(&(p - b.xy())) / area;
                let v = (a - c).xy().perp(&(p - c.xy())) / area;
                let w = 1.0 - u - v;
                if u >= -1e-4 && v >= -1e-4 && w >= -1e-4 {
                    let near = u * a.z + v * b.z + w * c.z;
                    let cell = &mut self.near[y * self.width + x];
                    *cell = cell.max(near);
                }
            }
        }
    }

    /// Returns the fraction of the lamp's light that the bodies block at a point, 0 to 1, averaged over a square of cells.
    ///
    /// * `reach`: number of cells on each side of the point; a larger lamp needs more.
    /// * `bias`: minimum distance towards the lamp at which a surface casts a shadow, in metres.
    pub(crate) fn share(&self, across: Vector2<f32>, near: f32, reach: usize, bias: f32) -> f32 {
        let at = (across - self.low) / CELL;
        let border = reach as f32 + 1.0;
        let outside = |value: f32, n: usize| value < -border || value > n as f32 + border;
        if outside(at.x, self.width) || outside(at.y, self.height) {
            return 0.0;
        }
        let cell = at.map(|at| at.floor() as i64);
        let part = at - at.map(f32::floor);
        let taps = 2 * reach as i64 + 1;
        let mut sum = 0.0;
        for dy in 0..=taps {
            let y = cell.y + dy - reach as i64;
            let wy = weight(dy, taps, part.y);
            if y < 0 || y >= self.height as i64 {
                continue;
            }
            for dx in 0..=taps {
                let x = cell.x + dx - reach as i64;
                if x >= 0
                    && x < self.width as i64
                    && self.near[y as usize * self.width + x as usize] > near + bias
                {
                    sum += wy * weight(dx, taps, part.x);
                }
            }
        }
        sum / (taps * taps) as f32
    }
}

/// Returns the weight of a cell along one axis of the square. The first and the last cell are covered only in part.
fn weight(nth: i64, taps: i64, part: f32) -> f32 {
    match nth {
        0 => 1.0 - part,
        it if it == taps => part,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn a_plate_casts_a_shadow_only_behind_it() {
        let light = Light::new(Random::new(1));
        let to = light.to_key;
        let side = to.cross(&Vector3::x()).try_normalize(1e-6).unwrap();
        let other = to.cross(&side);
        let corner = |a: f32, b: f32| Point3::from(side * a + other * b);
        let points = [
            corner(-0.3, -0.3),
            corner(0.3, -0.3),
            corner(0.3, 0.3),
            corner(-0.3, 0.3),
        ];
        let mut shadow = Shadow::default();
        let surface = Surface {
            points: &points,
            triangles: &[[0, 1, 2], [0, 2, 3]],
        };
        shadow.cast(&light, &[surface]);
        let at = |place: Vector3<f32>| {
            let (across, near) = light.beam(&place);
            shadow.share(across, near, 2, 0.02)
        };
        assert_eq!(at(-to * 0.5), 1.0, "behind");
        assert_eq!(at(to * 0.5), 0.0, "before");
        assert_eq!(at(side * 0.5 - to * 0.5), 0.0, "beside");
        assert_eq!(at(-to * 0.01), 0.0, "on itself");
        let edge = at(side * 0.3 - to * 0.5);
        assert!((0.2..0.8).contains(&edge), "soft at its edge: {edge}");
    }
}
