//! Colours of people's trunks, by which people are told apart in a view.
//!
//! Cameras differ in exposure and white balance, so every view has its own colours. If a view has not seen a person often enough, the mean
//! colour over all views is used.

use nalgebra::Vector3;

use crate::Frame;
use crate::cluster::Member;
use crate::frame::Place;

/// Red, green and blue, 0 to 1.
pub(crate) type Rgb = [f64; 3];

/// Minimum weight of a new colour in the mean.
const NEW_COLOUR: f64 = 0.1;
/// Number of sightings, in one view or in all together, after which a colour is taken as known. Before that, a new person may have been
/// given the detections of others.
const KNOWN: u32 = 5;
/// Light and shadow change the brightness by up to this factor; such a change does not count as a difference.
const SHADE: f64 = 1.2;

/// The colours of a person's trunk.
#[derive(Debug, Clone, Default)]
pub(crate) struct Colours {
    /// Mean colour in each view.
    views: Vec<Mean>,
    /// Mean colour over all views.
    all: Mean,
}

/// A mean colour, and the number of colours that were averaged.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    colour: Rgb,
    n: u32,
}

impl Mean {
    fn add(&mut self, new: Rgb) {
        self.n = self.n.saturating_add(1);
        let weight = NEW_COLOUR.max(1.0 / f64::from(self.n));
        for (own, new) in self.colour.iter_mut().zip(new) {
            *own += weight * (new - *own);
        }
    }

    fn known(&self) -> Option<Rgb> {
        (self.n >= KNOWN).then_some(self.colour)
    }
}

impl Colours {
    /// Creates the colours of a remembered person.
    ///
    /// * `overall`: colour over all views.
    pub(crate) fn remembered(overall: Option<Rgb>) -> Self {
        let known = |colour| Mean { colour, n: KNOWN };
        Self {
            views: Vec::new(),
            all: overall.map_or_else(Mean::default, known),
        }
    }

    /// Adds the colours of a person's detections.
    pub(crate) fn add(&mut self, frame: &Frame, members: &[Member]) {
        self.views.resize(frame.n_views(), Mean::default());
        for member in members {
            if let Some(colour) = frame.colour(member.at) {
                self.views[member.at.view].add(colour);
                self.all.add(colour);
            }
        }
    }

    /// Returns the colour over all views; `None` until it is known.
    pub(crate) fn overall(&self) -> Option<Rgb> {
        self.all.known()
    }

    /// Returns the difference between a detection and the person's colour; `None` if one of them is unknown.
    pub(crate) fn difference(&self, frame: &Frame, at: Place) -> Option<f64> {
        let own = self.views.get(at.view).and_then(Mean::known);
        let own = own.or_else(|| self.overall())?;
        Some(difference(own, frame.colour(at)?))
    }

    /// Returns the mean difference of several detections from the person's colour; `None` if none is known.
    pub(crate) fn mean_difference(&self, frame: &Frame, members: &[Member]) -> Option<f64> {
        let each = members.iter().filter_map(|member| self.difference(frame, member.at));
        let (n, sum) = each.fold((0.0, 0.0), |(n, sum), by| (n + 1.0, sum + by));
        (n > 0.0).then(|| sum / n)
    }
}

/// Returns the distance between two colours, ignoring a small difference in brightness.
pub(crate) fn difference(a: Rgb, b: Rgb) -> f64 {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    let gain = (a.dot(&b) / b.norm_squared().max(f64::MIN_POSITIVE)).clamp(1.0 / SHADE, SHADE);
    (a - gain * b).norm()
}
