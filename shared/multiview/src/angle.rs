//! Part-type tables for views that nobody trained on, chosen by the angle between them.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point2, Vector3};

use crate::{TypeTables, ViewInput};

/// Part-type tables by the angle under which two views see the person.
///
/// The full circle is cut into bins of equal width; the angles of one half are given, the other half holds the
/// same tables with the views exchanged. A pair takes the table of the bin that its angle falls into.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleTables {
    /// By angle from -180 degrees; `None` where nothing is known.
    bins: Vec<Option<TypeTables>>,
}

impl AngleTables {
    /// From the tables of half the circle.
    ///
    /// * `half`: of `n` tables the `i`-th is for angles from `i` to `i + 1` times `180 / n` degrees.
    /// * `mirror`: the part on the other side of every part; the parts themselves if the model has no sides.
    pub fn new(half: Vec<Option<TypeTables>>, mirror: &[usize]) -> Self {
        let reversed = |it: &Option<TypeTables>| it.as_ref().map(|it| it.reversed(mirror));
        let mut bins: Vec<Option<TypeTables>> = half.iter().rev().map(reversed).collect();
        bins.extend(half);
        Self { bins }
    }

    /// The tables for an angle (see [`angle_between`]), radians.
    pub fn at(&self, angle: f64) -> Option<&TypeTables> {
        let turn = (angle + PI).rem_euclid(TAU) / TAU;
        let last = self.bins.len().checked_sub(1)?;
        let bin = (turn * self.bins.len() as f64) as usize;
        self.bins[bin.min(last)].as_ref()
    }
}

/// The angle between two cameras as seen from the person: how far around the person one has to go from the first
/// to the second, radians from -pi to pi, counter-clockwise as seen from above.
///
/// The person is where the rays through the middles of the views' best poses meet, so the angle at the person
/// is that between the rays, and where exactly they meet does not matter. Up is what the pictures show as
/// up. `None` where the lens model has no answer, or a view looks straight up or down.
pub fn angle_between(first: &ViewInput<'_>, second: &ViewInput<'_>) -> Option<f64> {
    let ups = [first, second].map(up);
    let up = (ups[0] + ups[1]).try_normalize(1e-6)?;
    let level = |answer: &ViewInput<'_>| {
        let ray = ray(answer)?;
        (ray - up * ray.dot(&up)).try_normalize(1e-3)
    };
    let [from, to] = [level(first)?, level(second)?];
    Some(from.cross(&to).dot(&up).atan2(from.dot(&to)))
}

/// Against gravity, as the view's picture shows it, in the world.
fn up(answer: &ViewInput<'_>) -> Vector3<f64> {
    let turn = answer.plan.camera().camera_from_world.rotation.inverse();
    turn * -Vector3::y()
}

/// Direction from the camera to the person, in the world.
fn ray(answer: &ViewInput<'_>) -> Option<Vector3<f64>> {
    let centres = answer.plan.centres(answer.candidates.first()?);
    let n = centres.len().max(1) as f64;
    let mean = [0, 1].map(|axis| centres.iter().map(|it| it[axis]).sum::<f64>() / n);
    let ray = answer.plan.camera().ray(&Point2::from(mean))?;
    Some(ray.direction.into_inner())
}
