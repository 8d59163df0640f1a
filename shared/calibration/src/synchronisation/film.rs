//! Films: the people in the pictures of every camera.

/// Pictures of one camera, by the camera's own clock.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Film {
    /// The pictures, in order of time.
    pub shots: Vec<Shot>,
}

/// One picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shot {
    /// Time of the picture, in seconds by the clock of the camera.
    pub time_s: f64,
    /// People in the picture, in any order. One person may appear several times, as candidates.
    pub people: Vec<Person>,
}

/// A person, or a candidate for one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Person {
    /// Joints by number, which is the same in all cameras; `None` for a joint that was not found.
    pub joints: Vec<Option<Joint>>,
}

/// A joint that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Column and row, in pixels of the calibrated picture. A joint with a value that is not finite counts as not found.
    pub at: [f64; 2],
    /// Score of the joint detector, 0 to 1.
    pub score: f64,
}

/// Reason why films cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// The number of films differs from the number of cameras.
    #[error("there are {cameras} cameras, but footage of {films}; each camera needs its footage")]
    Number {
        /// Number of films.
        films: usize,
        /// Number of cameras.
        cameras: usize,
    },
    /// There are fewer than two cameras.
    #[error("the number of cameras is {cameras}, but at least 2 are needed to compare clocks")]
    OneCamera {
        /// Number of cameras.
        cameras: usize,
    },
    /// The times of a camera are not ascending.
    #[error(
        "camera {camera}: picture {shot} is at {time_s} s, but must be later than the previous picture"
    )]
    Times {
        /// Index of the camera, from 0.
        camera: usize,
        /// Index of the picture, from 0.
        shot: usize,
        /// Time of the picture, in seconds.
        time_s: f64,
    },
    /// The search window is out of range.
    #[error("the search window is {window_s} s, expected 0.1 to 60 s")]
    Window {
        /// The window, in seconds.
        window_s: f64,
    },
    /// The reference camera does not exist.
    #[error(
        "the reference camera {reference} does not exist: there are {cameras} cameras, counted from 0"
    )]
    Reference {
        /// Index of the requested reference, from 0.
        reference: usize,
        /// Number of cameras.
        cameras: usize,
    },
}

impl Film {
    /// Checks that times are finite and ascending.
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

    /// Returns the median time between pictures, in seconds; `None` for fewer than two.
    pub(crate) fn interval_s(&self) -> Option<f64> {
        let mut steps: Vec<f64> =
            self.shots.array_windows().map(|[a, b]| b.time_s - a.time_s).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied()
    }
}
