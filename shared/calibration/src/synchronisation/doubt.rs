//! Why offsets are not to be trusted.

use core::fmt;

/// Why offsets are not to be trusted. Cameras are numbers of the list that was given.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// A camera sees hardly anyone.
    NoPeople {
        /// The camera.
        camera: usize,
        /// For how long someone is followed, seconds.
        seen_s: f64,
        /// The least.
        least_s: f64,
    },
    /// Nothing connects a camera to the others: they stand in one place, or see people at other times.
    Unconnected {
        /// The camera.
        camera: usize,
        /// Joints that it sees together with others.
        n: usize,
        /// The least.
        least: usize,
    },
    /// Another offset of some cameras explains the movement nearly as well: it repeats itself, or is not seen well enough.
    Ambiguous {
        /// The cameras.
        cameras: Vec<usize>,
        /// The other offset against the best one, seconds.
        away_s: f64,
        /// Its gain as a share of the best.
        ratio: f64,
        /// The largest that is accepted.
        most_ratio: f64,
        /// By how many standard errors the best is better.
        t: f64,
        /// The least that is accepted.
        least_t: f64,
    },
    /// The offset is where the search ends: the right one may be outside.
    Edge {
        /// The camera.
        camera: usize,
        /// Its offset, seconds.
        offset_s: f64,
        /// The window, seconds.
        window_s: f64,
    },
    /// The minimum is flat: there is too little movement.
    Flat {
        /// The camera.
        camera: usize,
        /// Standard error of its offset, seconds.
        error_s: f64,
        /// The largest that is accepted.
        most_s: f64,
    },
    /// Too little movement to tell offsets apart.
    Still {
        /// The camera.
        camera: usize,
        /// Amount by which the best offset costs less than the mean of all, as a share.
        gain: f64,
        /// The least that is accepted.
        least: f64,
    },
    /// The views do not fit each other at any offset: cameras exchanged, moved, or of another scene.
    Misfit {
        /// The camera.
        camera: usize,
        /// Median residual, percent of the size of the person.
        percent: f64,
        /// The largest that is accepted.
        most: f64,
    },
    /// A pair that is sure by itself finds another offset than all together.
    Pair {
        /// The cameras.
        cameras: [usize; 2],
        /// Amount by which the pair's own offset is away, seconds.
        away_s: f64,
        /// The gain of the common offset as a share of the pair's best.
        share: f64,
        /// The least that is accepted.
        least_share: f64,
    },
    /// A clock that runs at another speed than clocks do: the frame rate is wrong, or frames are missing.
    Speed {
        /// The camera.
        camera: usize,
        /// Its drift, as a share.
        drift: f64,
        /// The largest that is accepted.
        most: f64,
    },
    /// A camera recorded hardly any sound that begins.
    Quiet {
        /// The camera.
        camera: usize,
        /// Sounds that begin.
        n: usize,
        /// The least.
        least: usize,
    },
    /// A camera did not hear what the others heard, or it fits at several offsets; the pair is the one that fits best.
    Unheard {
        /// The cameras.
        cameras: [usize; 2],
        /// Beginnings of sounds that fall together.
        n: usize,
        /// The least.
        least: usize,
        /// The cosine between their beginnings.
        cosine: f64,
        /// The least that is accepted.
        least_cosine: f64,
        /// How good another offset is, as a share.
        ratio: f64,
        /// The largest that is accepted.
        most_ratio: f64,
    },
    /// A pair heard sounds further apart than their way and the offsets of all allow.
    Heard {
        /// The cameras.
        cameras: [usize; 2],
        /// By how much, seconds.
        away_s: f64,
        /// The largest that is accepted.
        most_s: f64,
    },
    /// Two parts of the footage give different offsets.
    Parts {
        /// The camera.
        camera: usize,
        /// By how much, seconds.
        away_s: f64,
        /// The largest that is accepted.
        most_s: f64,
    },
}

impl Doubt {
    /// The doubt in words.
    ///
    /// * `names`: of the cameras.
    pub fn text(&self, names: &[&str]) -> String {
        Worded { doubt: self, names }.to_string()
    }

    /// The cameras that it concerns.
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
                "{}: someone is followed for {seen_s:.1} s, at least {least_s:.1} s are needed",
                name(camera)
            ),
            Doubt::Unconnected { camera, n, least } => write!(
                f,
                "{}: {n} joints are seen together with other cameras at these offsets, at least {least} are needed",
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
                    "{}: ambiguous: {:+.0} ms away is {:.0} % as good (at most {:.0} % is accepted), the difference is {t:.1} standard \
                     errors (at least {least_t:.0}); movement that repeats itself, or too little of it",
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
                "{}: the best offset, {offset_s:+.2} s, is at the edge of the search of {window_s:.1} s: search further",
                name(camera)
            ),
            _ => self.fit(f),
        }
    }
}

impl Worded<'_> {
    /// Too little that tells, or nothing that fits.
    fn fit(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |camera: &usize| self.names.get(*camera).map_or("?", |name| name);
        match self.doubt {
            Doubt::Flat {
                camera,
                error_s,
                most_s,
            } => write!(
                f,
                "{}: the minimum is flat: standard error {:.1} ms, at most {:.1} ms is accepted",
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
                "{}: the best offset costs {:.0} % less than the others do, at least {:.0} % is needed: too little movement, or the \
                 calibration does not fit",
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
                "{}: joints are {percent:.1} % of a person's size off what the other cameras say (median; at most {most:.1} %): cameras \
                 exchanged, moved, or not of one scene",
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
                "{} and {}: alone they give an offset {:+.0} ms away from that of all cameras, which is {:.0} % as good for them (at least {:.0} % is needed)",
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
                "{}: its clock would run {:+.2} % off, at most {:.0} % is accepted: is the frame rate right?",
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
                "{}: parts of the footage give offsets {:.0} ms apart, at most {:.0} ms is accepted: frames missing, or another speed",
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
                "{}: {n} sounds begin in its recording, at least {least} are needed: clap a few times, unevenly",
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
                "{} and {}: {n} sounds begin together at the best offset (at least {least}), with a cosine of {cosine:.2} (at least \
                 {least_cosine:.1}); another offset is {:.0} % as good (at most {:.0} %): not of one room, outside the search, or a beat",
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
                "{} and {}: alone they give an offset {:+.0} ms away from that of all cameras, at most {:.0} ms is accepted",
                name(a),
                name(b),
                1e3 * *away_s,
                1e3 * *most_s
            ),
            _ => Ok(()),
        }
    }
}
