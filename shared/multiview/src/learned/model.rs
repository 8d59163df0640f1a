//! Properties of a person model on which the tables depend.

use fmp::Model;

use crate::learned::Shape;

impl Shape {
    /// Returns the number of types of every part of a model, and the parts on the other side.
    pub fn of(model: &Model) -> Self {
        let parts = 0..model.n_parts();
        let mirror = model.spec().mirror.clone();
        Self {
            n_types: parts.clone().map(|part| model.n_types(part)).collect(),
            mirror: mirror.unwrap_or_else(|| parts.collect()),
        }
    }
}
