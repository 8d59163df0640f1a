//! Part-type tables for pairs of cameras that have no training data of their own, selected by the angle between the views.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point2, Vector3};

use crate::{TypeTables, ViewInput};

/// Part-type tables by the angle between two views, as seen from the person.
///
/// The circle is divided into bins of equal width. Tables are given for one half; the other half has the same tables with the views
/// swapped. A pair of views uses the table of the bin that contains its angle.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleTables {
    /// Tables by angle, starting at -180 degrees; `None` if there is no table.
    bins: Vec<Option<TypeTables>>,
}

impl AngleTables {
    /// Creates the tables of the whole circle from the tables of one half.
    ///
    /// * `half`: the `i`-th of `n` tables is for angles from `i` to `i + 1` times `180 / n`
    ///   degrees.
    /// * `mirror`: the part on the other side of every part; the parts themselves if the model has no sides.
    pub fn new(half: Vec<Option<TypeTables>>, mirror: &[usize]) -> Self {
        let reversed =
            |tables: &Option<TypeTables>| tables.as_ref().map(|tables| tables.reversed(mirror));
        let mut bins: Vec<Option<TypeTables>> = half.iter().rev().map(reversed).collect();
        bins.extend(half);
        Self { bins }
    }

    /// Returns the tables for an angle (see [`angle_between`]), in radians.
    pub fn at(&self, angle: f64) -> Option<&TypeTables> {
        let turn = (angle + PI).rem_euclid(TAU) / TAU;
        let last = self.bins.len().checked_sub(1)?;
        let bin = (turn * self.bins.len() as f64) as usize;
        self.bins[bin.min(last)].as_ref()
    }
}

/// Returns the angle between two cameras as seen from the person: from the first camera to the second, in radians from -pi to pi,
/// counter-clockwise as seen from above.
///
/// The person is assumed to be where the rays through the centres of the views' best poses meet. The angle is therefore the angle between
/// the rays, and the exact meeting point does not matter. Up is the mean up direction of the pictures. Returns `None` if the lens model has
/// no solution, or if a view looks straight up or down.
pub fn angle_between(first: &ViewInput<'_>, second: &ViewInput<'_>) -> Option<f64> {
    let ups = [first, second].map(up);
    let up = (ups[0] + ups[1]).try_normalize(1e-6)?;
    let level = |view: &ViewInput<'_>| {
        let ray = ray(view)?;
        (ray - up * ray.dot(&up)).try_normalize(1e-3)
    };
    let [from, to] = [level(first)?, level(second)?];
    Some(from.cross(&to).dot(&up).atan2(from.dot(&to)))
}

/// Returns the up direction of the view's picture, in the world.
fn up(view: &ViewInput<'_>) -> Vector3<f64> {
    let turn = view.plan.camera().camera_from_world.rotation.inverse();
    turn * -Vector3::y()
}

/// Returns the direction from the camera to the person, in the world.
fn ray(view: &ViewInput<'_>) -> Option<Vector3<f64>> {
    let centres = view.plan.centres(view.best()?);
    let n = centres.len().max(1) as f64;
    let mean = [0, 1].map(|axis| centres.iter().map(|centre| centre[axis]).sum::<f64>() / n);
    let ray = view.plan.camera().ray(&Point2::from(mean))?;
    Some(ray.direction.into_inner())
}
