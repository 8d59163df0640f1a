//! Films: people in the pictures of every camera.

/// Pictures of one camera, by its own clock.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Film {
    /// Its pictures, in the order of their times.
    pub shots: Vec<Shot>,
}

/// One picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shot {
    /// When it was taken, seconds by the clock of the camera.
    pub time_s: f64,
    /// The people in it, in any order. One person may be there several times, as candidates.
    pub people: Vec<Person>,
}

/// A person, or a candidate for one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Person {
    /// By number, the same in all cameras; none where the joint was not found.
    pub joints: Vec<Option<Joint>>,
}

/// A joint that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Column and row, pixels of the calibrated picture. One that is not finite counts as not found.
    pub at: [f64; 2],
    /// How sure its finder is, 0 to 1.
    pub score: f64,
}

/// Why films cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// There are not as many films as cameras.
    #[error("{films} films were given for {cameras} cameras")]
    Number {
        /// Films.
        films: usize,
        /// Cameras.
        cameras: usize,
    },
    /// Fewer than two cameras.
    #[error("{cameras} camera: at least 2 are needed to compare their clocks")]
    OneCamera {
        /// How many.
        cameras: usize,
    },
    /// The times of a camera do not rise.
    #[error(
        "camera {camera}: picture {shot} is of {time_s} s, which is not after the one before it"
    )]
    Times {
        /// Position in the list, from 0.
        camera: usize,
        /// Picture of it, from 0.
        shot: usize,
        /// Its time.
        time_s: f64,
    },
    /// A setting is not a usable number.
    #[error("a window of {window_s} s, expected 0.1 to 60")]
    Window {
        /// The setting.
        window_s: f64,
    },
    /// A camera is not the reference that was asked for.
    #[error(
        "reference camera {reference} does not exist: there are {cameras} cameras, counted from 0"
    )]
    Reference {
        /// Position in the list, from 0.
        reference: usize,
        /// How many there are.
        cameras: usize,
    },
}

impl Film {
    /// Sees that times are finite and rise.
    pub(crate) fn check(&self, camera: usize) -> Result<(), FilmError> {
        let mut before = f64::NEG_INFINITY;
        for (shot, it) in self.shots.iter().enumerate() {
            let time_s = it.time_s;
            if !time_s.is_finite() || time_s <= before || time_s.abs() > 1e7 {
                return Err(FilmError::Times {
                    camera,
                    shot,
                    time_s,
                });
            }
            before = time_s;
        }
        Ok(())
    }

    /// Time between pictures, seconds: the median; none for fewer than two.
    pub(crate) fn interval_s(&self) -> Option<f64> {
        let mut steps: Vec<f64> =
            self.shots.array_windows().map(|[a, b]| b.time_s - a.time_s).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied()
    }
}
