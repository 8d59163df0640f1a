//! Why an answer is not to be used.

/// Median residual of a camera, as a share of the size of a person.
const MOST_RESIDUAL: f64 = 0.04;

/// A reason not to use what was found. Cameras by number, from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// A camera sees nobody for long enough.
    NoPeople {
        /// Which.
        camera: usize,
        /// How long it sees people, seconds.
        seen_s: f64,
        /// How long it should, seconds.
        least_s: f64,
    },
    /// The cameras see people together at too few instants.
    FewInstants {
        /// Instants.
        n: usize,
        /// The fewest.
        least: usize,
    },
    /// No two cameras see enough of one person at the same time to say where they stand.
    NoPair,
    /// A camera cannot be placed among the others.
    Unplaced {
        /// Which.
        camera: usize,
        /// Mean cost of a joint at the best place; none where too few joints are in view of it and of two others.
        cost: Option<f64>,
    },
    /// Joints do not fit the rig.
    Fit {
        /// Which camera.
        camera: usize,
        /// Median residual as a share of the size of the person.
        share: f64,
        /// The most.
        limit: f64,
    },
    /// The adjustment did not come to an end.
    NotConverged {
        /// Iterations.
        iterations: usize,
    },
    /// The joints do not determine the rig at all.
    Undetermined {
        /// Which of it.
        what: String,
    },
    /// The pose of a camera is too uncertain.
    Uncertain {
        /// Which.
        camera: usize,
        /// Standard deviations: degrees, and share of the distance to the people.
        sd: [f64; 2],
        /// The most of each.
        limits: [f64; 2],
    },
    /// Two halves of the recording give different rigs.
    Halves {
        /// The camera that differs most.
        camera: usize,
        /// By how much: degrees, and share of the distance to the people.
        by: [f64; 2],
        /// The most of each.
        limits: [f64; 2],
    },
    /// A half of the recording gives no rig.
    NoHalf {
        /// Why.
        why: Box<Self>,
    },
    /// Bones change their lengths.
    Bones {
        /// Median deviation as a share of the length.
        spread: f64,
        /// The most.
        limit: f64,
    },
    /// Too few bones are seen to determine scale and vertical.
    NoBody,
}

impl Doubt {
    /// The doubt that the joints of a camera do not fit, if they do not.
    ///
    /// * `residual_px`: the median; `size_px`: of the person in the camera's pictures.
    pub(crate) fn of_fit(camera: usize, residual_px: f64, size_px: f64) -> Option<Self> {
        let (share, limit) = (residual_px / size_px, MOST_RESIDUAL);
        // NaN is not less.
        (share >= limit || share.is_nan()).then_some(Self::Fit {
            camera,
            share,
            limit,
        })
    }

    /// For people to read.
    ///
    /// * `names`: of the cameras.
    #[expect(clippy::too_many_lines, reason = "one sentence for each doubt")]
    pub fn text(&self, names: &[&str]) -> String {
        let name = |camera: &usize| names.get(*camera).copied().unwrap_or("?");
        match self {
            Self::NoPeople {
                camera,
                seen_s,
                least_s,
            } => format!(
                "{} sees a person for {seen_s:.1} s, less than {least_s} s",
                name(camera)
            ),
            Self::FewInstants { n, least } => format!(
                "two cameras see a person together at {n} instants, fewer than {least}"
            ),
            Self::NoPair => "no two cameras see enough of one person at the same time, from different sides, to say where they stand"
                .to_owned(),
            Self::Unplaced { camera, cost: None } => format!(
                "{} sees too little of what two others see at the same time: nothing connects it with them",
                name(camera)
            ),
            Self::Unplaced {
                camera,
                cost: Some(cost),
            } => format!(
                "{} fits the others nowhere (mean cost {cost:.1}): its intrinsics, its clock or its people may be wrong",
                name(camera)
            ),
            Self::Fit {
                camera,
                share,
                limit,
            } => format!(
                "the joints of {} are {:.1} % of a person's size from where the rig says, more than {:.1} %",
                name(camera),
                100.0 * share,
                100.0 * limit
            ),
            Self::NotConverged { iterations } => {
                format!("the adjustment did not come to an end in {iterations} steps")
            }
            Self::Undetermined { what } => what.clone(),
            Self::Uncertain { camera, sd, limits } => format!(
                "{} is known to {:.2} degrees and {:.1} % of its distance only (at most {} and {})",
                name(camera),
                sd[0],
                100.0 * sd[1],
                limits[0],
                100.0 * limits[1]
            ),
            Self::Halves { camera, by, limits } => format!(
                "two halves of the recording disagree about {} by {:.2} degrees and {:.1} % of its distance (at most {} and {}): \
                 too little of the volume was walked through, or a camera moved",
                name(camera),
                by[0],
                100.0 * by[1],
                limits[0],
                100.0 * limits[1]
            ),
            Self::NoHalf { why } => format!("half of the recording gives no rig: {}", why.text(names)),
            Self::Bones { spread, limit } => format!(
                "bones change their lengths by {:.0} %, more than {:.0} %: the joints in space are not those of a person",
                100.0 * spread,
                100.0 * limit
            ),
            Self::NoBody => "too few joints are seen to tell how large a person is, and which way is up".to_owned(),
        }
    }
}
