//! The detections of a frame as rays, in an order that does not depend on the input order.

use core::cmp::Ordering;

use geometry::Camera;

use crate::sight::{Sights, sights};
use crate::{Detection, View};

/// A detection of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) view: usize,
    pub(crate) index: usize,
}

/// A detection converted to rays.
struct Prepared {
    sights: Sights,
    colour: Option<[f64; 3]>,
    /// Index of the detection in the input list.
    given: usize,
}

/// The detections of all views.
pub(crate) struct Frame {
    views: Vec<Vec<Prepared>>,
    pub(crate) as_seen: bool,
}

impl Frame {
    /// Prepares the detections of all views.
    ///
    /// * `order`: the order in which the views are processed.
    pub(crate) fn new(cameras: &[Camera], order: &[usize], views: &[View], as_seen: bool) -> Self {
        let prepare = |view: &usize| {
            let given = views.get(*view).map_or(&[][..], |view| &view.detections);
            let mut indices: Vec<usize> = (0..given.len()).collect();
            indices.sort_by(|a, b| by_pixels(&given[*a], &given[*b]));
            let prepared = indices.into_iter().map(|index| Prepared {
                sights: sights(&cameras[*view], &given[index]),
                colour: given[index].colour,
                given: index,
            });
            prepared.collect()
        };
        Self {
            views: order.iter().map(prepare).collect(),
            as_seen,
        }
    }

    pub(crate) fn n_views(&self) -> usize {
        self.views.len()
    }

    /// Returns the number of views that have at least one detection.
    pub(crate) fn n_seeing(&self) -> usize {
        self.views.iter().filter(|view| !view.is_empty()).count()
    }

    pub(crate) fn sights(&self, at: Place) -> &Sights {
        &self.views[at.view][at.index].sights
    }

    pub(crate) fn colour(&self, at: Place) -> Option<[f64; 3]> {
        self.views[at.view][at.index].colour
    }

    /// Returns the index of a detection in the input list of its view.
    pub(crate) fn given(&self, at: Place) -> usize {
        self.views[at.view][at.index].given
    }

    /// Returns the detections of a view.
    pub(crate) fn places(&self, view: usize) -> impl Iterator<Item = Place> + use<> {
        (0..self.views[view].len()).map(move |index| Place { view, index })
    }
}

/// Compares detections by their joints only.
fn by_pixels(a: &Detection, b: &Detection) -> Ordering {
    let numbers = |detection: &Detection| {
        detection.joints.map(|joint| {
            joint.map_or([f64::NAN; 4], |joint| {
                [joint.at_px[0], joint.at_px[1], joint.heat, joint.sd_px]
            })
        })
    };
    let (a, b) = (numbers(a), numbers(b));
    let each = a.as_flattened().iter().zip(b.as_flattened());
    each.map(|(a, b)| a.total_cmp(b))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}
