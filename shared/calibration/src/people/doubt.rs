//! Reasons not to use a result.

/// Largest accepted median residual of a camera, as a fraction of the size of a person.
const MOST_RESIDUAL: f64 = 0.04;

/// Reason not to use a result. Cameras are given by index, from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// A camera sees no person for long enough.
    NoPeople {
        /// Index of the camera.
        camera: usize,
        /// Time for which the camera sees people, in seconds.
        seen_s: f64,
        /// Minimum time, in seconds.
        least_s: f64,
    },
    /// The cameras see people together at too few instants.
    FewInstants {
        /// Number of instants.
        n: usize,
        /// Minimum number of instants.
        least: usize,
    },
    /// No two cameras see enough of one person at the same time to determine the relative pose of the cameras.
    NoPair,
    /// The pose of a camera relative to the others cannot be determined.
    Unplaced {
        /// Index of the camera.
        camera: usize,
        /// Mean cost of a joint at the best pose; `None` if too few joints are seen by this camera and by two others.
        cost: Option<f64>,
    },
    /// The joints do not fit the rig.
    Fit {
        /// Index of the camera.
        camera: usize,
        /// Median residual as a fraction of the size of the person.
        share: f64,
        /// Largest accepted value.
        limit: f64,
    },
    /// The adjustment did not converge.
    NotConverged {
        /// Number of iterations.
        iterations: usize,
    },
    /// The joints do not determine the rig at all.
    Undetermined {
        /// Description of the undetermined part.
        what: String,
    },
    /// The pose of a camera is too uncertain.
    Uncertain {
        /// Index of the camera.
        camera: usize,
        /// Standard deviations: degrees, and fraction of the distance to the people.
        sd: [f64; 2],
        /// Largest accepted value of each.
        limits: [f64; 2],
    },
    /// Two halves of the recording give different rigs.
    Halves {
        /// Index of the camera that differs most.
        camera: usize,
        /// Difference: degrees, and fraction of the distance to the people.
        by: [f64; 2],
        /// Largest accepted value of each.
        limits: [f64; 2],
    },
    /// One half of the recording gives no rig.
    NoHalf {
        /// Reason why this half gives no rig.
        why: Box<Self>,
    },
    /// The lengths of bones change over time.
    Bones {
        /// Median deviation as a fraction of the length.
        spread: f64,
        /// Largest accepted value.
        limit: f64,
    },
    /// Too few bones are seen to determine the scale and the vertical.
    NoBody,
}

impl Doubt {
    /// Returns a doubt if the joints of a camera do not fit.
    ///
    /// * `residual_px`: median residual; `size_px`: size of the person in the camera's pictures.
    pub(crate) fn of_fit(camera: usize, residual_px: f64, size_px: f64) -> Option<Self> {
        let (share, limit) = (residual_px / size_px, MOST_RESIDUAL);
        // NaN is also a doubt.
        (share >= limit || share.is_nan()).then_some(Self::Fit {
            camera,
            share,
            limit,
        })
    }

    /// Returns the doubt as a sentence.
    ///
    /// * `names`: names of the cameras.
    #[expect(clippy::too_many_lines, reason = "one sentence for each doubt")]
    pub fn text(&self, names: &[&str]) -> String {
        let name = |camera: &usize| names.get(*camera).copied().unwrap_or("?");
        match self {
            Self::NoPeople {
                camera,
                seen_s,
                least_s,
            } => format!(
                "{} sees a person for {seen_s:.1} s, but at least {least_s} s are needed",
                name(camera)
            ),
            Self::FewInstants { n, least } => format!(
                "two cameras see a person together at only {n} instants, but at least {least} are needed"
            ),
            Self::NoPair => "no two cameras see enough of one person at the same time, from different sides, to determine their relative pose"
                .to_owned(),
            Self::Unplaced { camera, cost: None } => format!(
                "{} sees too few joints at the same time as two other cameras, so its pose cannot be found",
                name(camera)
            ),
            Self::Unplaced {
                camera,
                cost: Some(cost),
            } => format!(
                "{} does not fit the other cameras in any pose (mean cost {cost:.1}): its intrinsics, its clock or the people it detected \
                 may be wrong",
                name(camera)
            ),
            Self::Fit {
                camera,
                share,
                limit,
            } => format!(
                "the joints in {} are {:.1} % of a person's size away from the rig's prediction, but the limit is {:.1} %",
                name(camera),
                100.0 * share,
                100.0 * limit
            ),
            Self::NotConverged { iterations } => {
                format!("the adjustment did not converge in {iterations} steps")
            }
            Self::Undetermined { what } => what.clone(),
            Self::Uncertain { camera, sd, limits } => format!(
                "the pose of {} is uncertain by {:.2} degrees and {:.1} % of its distance to the people, but the limits are {} degrees and \
                 {} %",
                name(camera),
                sd[0],
                100.0 * sd[1],
                limits[0],
                100.0 * limits[1]
            ),
            Self::Halves { camera, by, limits } => format!(
                "two halves of the recording disagree about {} by {:.2} degrees and {:.1} % of its distance to the people, but the limits \
                 are {} degrees and {} %: people walked through too little of the volume, or a camera moved",
                name(camera),
                by[0],
                100.0 * by[1],
                limits[0],
                100.0 * limits[1]
            ),
            Self::NoHalf { why } => format!("one half of the recording does not determine a rig: {}", why.text(names)),
            Self::Bones { spread, limit } => format!(
                "the lengths of bones change by {:.0} %, but the limit is {:.0} %: the triangulated joints are not those of a person",
                100.0 * spread,
                100.0 * limit
            ),
            Self::NoBody => "the cameras see too few joints to determine the size of the person and the up direction".to_owned(),
        }
    }
}
