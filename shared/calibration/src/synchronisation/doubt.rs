//! Reasons not to trust estimated offsets.

use core::fmt;

/// Reason not to trust offsets. Cameras are given by their indices in the list.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// A camera sees people for too short a time.
    NoPeople {
        /// Index of the camera.
        camera: usize,
        /// Time for which a person is followed, in seconds.
        seen_s: f64,
        /// Minimum time, in seconds.
        least_s: f64,
    },
    /// No shared observations connect a camera to the others: the cameras are in the same place, or see people at different times.
    Unconnected {
        /// Index of the camera.
        camera: usize,
        /// Number of joints that the camera sees together with other cameras.
        n: usize,
        /// Minimum number of joints.
        least: usize,
    },
    /// Another offset of some cameras explains the movement nearly as well, because the movement repeats itself or is not seen well enough.
    Ambiguous {
        /// Indices of the cameras.
        cameras: Vec<usize>,
        /// Difference between the other offset and the best offset, in seconds.
        away_s: f64,
        /// Gain of the other offset as a fraction of the gain of the best offset.
        ratio: f64,
        /// Largest accepted ratio.
        most_ratio: f64,
        /// Difference between the two gains, in standard errors of this difference.
        t: f64,
        /// Smallest accepted difference, in standard errors.
        least_t: f64,
    },
    /// The best offset is at the edge of the search window, so the correct offset may be outside.
    Edge {
        /// Index of the camera.
        camera: usize,
        /// Offset of the camera, in seconds.
        offset_s: f64,
        /// Search window, in seconds.
        window_s: f64,
    },
    /// The minimum of the cost is flat, because there is too little movement.
    Flat {
        /// Index of the camera.
        camera: usize,
        /// Standard error of the camera's offset, in seconds.
        error_s: f64,
        /// Largest accepted standard error, in seconds.
        most_s: f64,
    },
    /// There is too little movement to distinguish offsets.
    Still {
        /// Index of the camera.
        camera: usize,
        /// Decrease of the cost at the best offset relative to the mean of all offsets, as a fraction.
        gain: f64,
        /// Smallest accepted decrease.
        least: f64,
    },
    /// The views do not fit each other at any offset: cameras were moved, footage was assigned to the wrong camera, or the views are from
    /// different scenes.
    Misfit {
        /// Index of the camera.
        camera: usize,
        /// Median residual, in percent of the size of the person.
        percent: f64,
        /// Largest accepted residual, in percent.
        most: f64,
    },
    /// Two cameras, compared alone, have a clear offset that contradicts the common solution.
    Pair {
        /// Indices of the two cameras.
        cameras: [usize; 2],
        /// Difference between the pair's own offset and the common one, in seconds.
        away_s: f64,
        /// Gain of the common offset as a fraction of the gain of the pair's best offset.
        share: f64,
        /// Smallest accepted ratio of gains.
        least_share: f64,
    },
    /// The drift of a clock is implausible: the frame rate is wrong, or frames are missing.
    Speed {
        /// Index of the camera.
        camera: usize,
        /// Drift of the clock, as a fraction.
        drift: f64,
        /// Largest accepted drift.
        most: f64,
    },
    /// The recording of a camera has too few sudden sounds.
    Quiet {
        /// Index of the camera.
        camera: usize,
        /// Number of sudden sounds in the recording.
        n: usize,
        /// Minimum number of sounds.
        least: usize,
    },
    /// A camera did not record the same sounds as the others, or its sounds fit at several offsets. `cameras` is the pair with the best
    /// fit.
    Unheard {
        /// Indices of the two cameras.
        cameras: [usize; 2],
        /// Number of sounds that begin at the same time in both recordings.
        n: usize,
        /// Minimum number of sounds.
        least: usize,
        /// Cosine between the beginnings of sounds in both recordings.
        cosine: f64,
        /// Smallest accepted cosine.
        least_cosine: f64,
        /// Cosine at the second-best offset as a fraction of the cosine at the best.
        ratio: f64,
        /// Largest accepted ratio.
        most_ratio: f64,
    },
    /// The offset of a pair differs from the common one by more than the travel time of sound allows.
    Heard {
        /// Indices of the two cameras.
        cameras: [usize; 2],
        /// Difference of the offsets, in seconds.
        away_s: f64,
        /// Largest accepted difference, in seconds.
        most_s: f64,
    },
    /// Two parts of the footage give different offsets.
    Parts {
        /// Index of the camera.
        camera: usize,
        /// Difference of the offsets, in seconds.
        away_s: f64,
        /// Largest accepted difference, in seconds.
        most_s: f64,
    },
}

impl Doubt {
    /// Returns the doubt in words.
    ///
    /// * `names`: names of the cameras.
    pub fn text(&self, names: &[&str]) -> String {
        Worded { doubt: self, names }.to_string()
    }

    /// Returns the cameras that the doubt concerns.
    pub fn cameras(&self) -> Vec<usize> {
        match self {
            Self::Ambiguous { cameras, .. } => cameras.clone(),
            Self::Pair { cameras, .. }
            | Self::Unheard { cameras, .. }
            | Self::Heard { cameras, .. } => cameras.to_vec(),
            Self::NoPeople { camera, .. }
            | Self::Unconnected { camera, .. }
            | Self::Edge { camera, .. }
            | Self::Flat { camera, .. }
            | Self::Still { camera, .. }
            | Self::Misfit { camera, .. }
            | Self::Speed { camera, .. }
            | Self::Quiet { camera, .. }
            | Self::Parts { camera, .. } => vec![*camera],
        }
    }
}

struct Worded<'a> {
    doubt: &'a Doubt,
    names: &'a [&'a str],
}

impl fmt::Display for Worded<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |camera: &usize| self.names.get(*camera).map_or("?", |name| name);
        match self.doubt {
            Doubt::NoPeople {
                camera,
                seen_s,
                least_s,
            } => write!(
                f,
                "{}: a person is followed for {seen_s:.1} s, but at least {least_s:.1} s are needed",
                name(camera)
            ),
            Doubt::Unconnected { camera, n, least } => write!(
                f,
                "{}: at these offsets, it sees only {n} joints together with other cameras, but at least {least} are needed",
                name(camera)
            ),
            Doubt::Ambiguous {
                cameras,
                away_s,
                ratio,
                most_ratio,
                t,
                least_t,
            } => {
                let named: Vec<&str> = cameras.iter().map(name).collect();
                write!(
                    f,
                    "{}: the offset is ambiguous: another offset, {:+.0} ms away, is {:.0} % as good (limit {:.0} %), and the difference \
                     is {t:.1} standard errors (at least {least_t:.0} are needed). The movement repeats itself, or there is too little \
                     movement",
                    named.join(", "),
                    1e3 * *away_s,
                    100.0 * ratio,
                    100.0 * most_ratio
                )
            }
            Doubt::Edge {
                camera,
                offset_s,
                window_s,
            } => write!(
                f,
                "{}: the best offset, {offset_s:+.2} s, is at the edge of the search window of {window_s:.1} s: search a larger window",
                name(camera)
            ),
            _ => self.fit(f),
        }
    }
}

impl Worded<'_> {
    /// Writes a doubt about too little movement, or about views that do not fit.
    fn fit(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |camera: &usize| self.names.get(*camera).map_or("?", |name| name);
        match self.doubt {
            Doubt::Flat {
                camera,
                error_s,
                most_s,
            } => write!(
                f,
                "{}: the minimum of the cost is flat: the standard error of the offset is {:.1} ms, but the limit is {:.1} ms",
                name(camera),
                1e3 * *error_s,
                1e3 * *most_s
            ),
            Doubt::Still {
                camera,
                gain,
                least,
            } => write!(
                f,
                "{}: the best offset costs {:.0} % less than the mean of all offsets, but at least {:.0} % is needed: there is too little \
                 movement, or the calibration does not fit",
                name(camera),
                100.0 * gain,
                100.0 * least
            ),
            Doubt::Misfit {
                camera,
                percent,
                most,
            } => write!(
                f,
                "{}: its joints are {percent:.1} % of a person's size away from the prediction of the other cameras (median), but the \
                 limit is {most:.1} %: cameras were swapped or moved, or they show different scenes",
                name(camera)
            ),
            _ => self.contradiction(f),
        }
    }

    /// Writes a contradiction.
    fn contradiction(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |camera: &usize| self.names.get(*camera).map_or("?", |name| name);
        match self.doubt {
            Doubt::Pair {
                cameras: [a, b],
                away_s,
                share,
                least_share,
            } => write!(
                f,
                "{} and {}: the offset of these two cameras alone differs by {:+.0} ms from the offset of all cameras, which fits this \
                 pair {:.0} % as well (at least {:.0} % is needed)",
                name(a),
                name(b),
                1e3 * *away_s,
                100.0 * share,
                100.0 * least_share
            ),
            Doubt::Speed {
                camera,
                drift,
                most,
            } => write!(
                f,
                "{}: the rate of its clock would be {:+.2} % off, but the limit is {:.0} %: is the frame rate right?",
                name(camera),
                100.0 * drift,
                100.0 * most
            ),
            Doubt::Parts {
                camera,
                away_s,
                most_s,
            } => write!(
                f,
                "{}: different sections of the footage give offsets {:.0} ms apart, but the limit is {:.0} ms: frames are missing, or the \
                 frame rate changed",
                name(camera),
                1e3 * *away_s,
                1e3 * *most_s
            ),
            _ => self.sound(f),
        }
    }

    /// Writes a doubt about sounds.
    fn sound(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |camera: &usize| self.names.get(*camera).map_or("?", |name| name);
        match self.doubt {
            Doubt::Quiet { camera, n, least } => write!(
                f,
                "{}: only {n} sounds begin in its recording, but at least {least} are needed: clap a few times at uneven intervals",
                name(camera)
            ),
            Doubt::Unheard {
                cameras: [a, b],
                n,
                least,
                cosine,
                least_cosine,
                ratio,
                most_ratio,
            } => write!(
                f,
                "{} and {}: at the best offset, {n} sounds begin together (at least {least} are needed), with a cosine of {cosine:.2} (at \
                 least {least_cosine:.1} is needed); another offset is {:.0} % as good (limit {:.0} %). The cameras were in different \
                 rooms, the offset is outside the search window, or the sounds are a regular beat",
                name(a),
                name(b),
                100.0 * ratio,
                100.0 * most_ratio
            ),
            Doubt::Heard {
                cameras: [a, b],
                away_s,
                most_s,
            } => write!(
                f,
                "{} and {}: the offset of these two cameras alone differs by {:+.0} ms from the offset of all cameras, but the limit is \
                 {:.0} ms",
                name(a),
                name(b),
                1e3 * *away_s,
                1e3 * *most_s
            ),
            _ => Ok(()),
        }
    }
}
