//! Colours of people's trunks, by which a view tells people apart.
//!
//! Cameras differ in exposure and white balance, so every view has its own colours.

use nalgebra::Vector3;

use crate::Frame;
use crate::cluster::Member;
use crate::frame::Place;

/// Red, green and blue, 0 to 1.
pub(crate) type Rgb = [f64; 3];

/// Weight of a new colour in the stored one.
const NEW_COLOUR: f64 = 0.1;
/// Light and shade change a colour by up to this factor, which does not count as a difference.
const SHADE: f64 = 1.2;

/// The colours of a person's trunk.
#[derive(Debug, Clone, Default)]
pub(crate) struct Colours {
    /// One per view; `None` if the view has not seen the trunk.
    views: Vec<Option<Rgb>>,
    /// The colour over all views.
    pub(crate) mean: Option<Rgb>,
}

impl Colours {
    /// Adds the colours of a frame.
    pub(crate) fn add(&mut self, frame: &Frame, members: &[Member]) {
        self.views.resize(frame.n_views(), None);
        for member in members {
            if let Some(colour) = frame.colour(member.at) {
                let own = &mut self.views[member.at.view];
                *own = Some(mixed(*own, colour));
                self.mean = Some(mixed(self.mean, colour));
            }
        }
    }

    /// Returns the difference between a detection and the colour of the person in the same view; `None` if one of them is unknown.
    pub(crate) fn difference(&self, frame: &Frame, at: Place) -> Option<f64> {
        let own = self.views.get(at.view).copied().flatten()?;
        Some(difference(own, frame.colour(at)?))
    }

    /// Returns the mean difference of several detections, as [`Self::difference`].
    pub(crate) fn mean_difference(&self, frame: &Frame, members: &[Member]) -> Option<f64> {
        let each = members.iter().filter_map(|member| self.difference(frame, member.at));
        let (n, sum) = each.fold((0.0, 0.0), |(n, sum), by| (n + 1.0, sum + by));
        (n > 0.0).then(|| sum / n)
    }
}

fn mixed(own: Option<Rgb>, new: Rgb) -> Rgb {
    let own = own.unwrap_or(new);
    [0, 1, 2].map(|nth| own[nth] + NEW_COLOUR * (new[nth] - own[nth]))
}

/// Returns the distance between two colours, apart from a small difference in brightness.
pub(crate) fn difference(a: Rgb, b: Rgb) -> f64 {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    let gain = (a.dot(&b) / b.norm_squared().max(f64::MIN_POSITIVE)).clamp(1.0 / SHADE, SHADE);
    (a - gain * b).norm()
}
