//! Limits how often the network runs in a view, so that the view keeps up with the frame rate.

/// Share of the processor time of all cores that the networks of all views may take. The rest is for decoding pictures, for solving in 3D,
/// and for pages in the browser.
const SHARE: f64 = 0.6;
/// Weight of a new measurement in the mean times.
const NEW_COST: f64 = 0.05;
const NEW_LOAD: f64 = 0.2;
/// A view is too slow if its frames take more than this share of the time between frames.
const MOST_LOAD: f64 = 0.9;
/// Factors for the budget: per frame while the view is too slow, after frames that were dropped, and per frame otherwise. Frames are dropped
/// although this view is fast enough if other processes have too little time, for example those that decode its pictures.
const LESS: f64 = 0.95;
const AFTER_DROPPED: f64 = 0.9;
const MORE: f64 = 1.01;
/// Minimum share of the budget that is kept.
const LEAST_KEPT: f64 = 0.1;

/// Number of frames after which the usual difference between their numbers is determined anew.
const MANY: u64 = 100;

/// Number of runs of the network that a view can afford per frame at the frame rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookBudget {
    /// Time between frames, in seconds.
    interval_s: f64,
    /// Difference between the numbers of frames if none is dropped.
    frame_step: u64,
    /// Usual difference; larger than `frame_step` if the camera delivers fewer frames than it states, for example in the dark.
    usual_step: u64,
    recent: Recent,
    /// Processor time per frame, in seconds, if the view keeps up.
    most_s: f64,
    /// Fraction of `most_s` that is used. It decreases while the view is too slow, because other programs may need the cores.
    kept: f64,
    /// Mean processor time of one run, in seconds; `None` before the first run.
    cost_s: Option<f64>,
    /// Mean duration of a frame, as a fraction of the interval.
    load: f64,
}

/// The frames since the usual difference between their numbers was determined.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Recent {
    n: u64,
    /// Number of frames with little more than the minimum budget.
    n_low: u64,
    /// Sum of the differences between the numbers of frames.
    steps: u64,
}

/// Runs of the network in a frame, and the times that the frame took.
#[derive(Debug, Clone, Copy)]
pub struct Spent {
    /// Number of runs.
    pub n_looks: f64,
    /// Processor time, in seconds.
    pub processor_s: f64,
    /// Time on the clock, in seconds.
    pub clock_s: f64,
    /// Difference between the numbers of this frame and the one before.
    pub n_frames: u64,
}

impl LookBudget {
    /// Creates the budget of a view.
    ///
    /// * `cores_per_view`: number of cores divided by the number of views that they process.
    /// * `interval_s`: time between frames, in seconds; `frame_step`: difference between their numbers if none is dropped.
    pub fn new(cores_per_view: f64, interval_s: f64, frame_step: u64) -> Self {
        let frame_step = frame_step.max(1);
        Self {
            interval_s,
            frame_step,
            usual_step: frame_step,
            recent: Recent::default(),
            most_s: SHARE * cores_per_view * interval_s,
            kept: 1.0,
            cost_s: None,
            load: 0.0,
        }
    }

    /// Returns the number of runs that a frame can afford on average; `None` before the time of a run is known.
    pub fn looks(&self) -> Option<f64> {
        Some(self.kept * self.most_s / self.cost_s?)
    }

    /// Takes note of the times that a frame took.
    pub fn spent(&mut self, spent: &Spent) {
        self.load += NEW_LOAD * (spent.clock_s / self.interval_s - self.load);
        self.learn_step(spent.n_frames);
        let factor = if spent.n_frames > self.usual_step {
            AFTER_DROPPED
        } else if self.load > MOST_LOAD {
            LESS
        } else {
            MORE
        };
        self.kept = (self.kept * factor).clamp(LEAST_KEPT, 1.0);
        if spent.n_looks > 0.0 && spent.processor_s > 0.0 {
            let new = spent.processor_s / spent.n_looks;
            self.cost_s = Some(self.cost_s.map_or(new, |cost| cost + NEW_COST * (new - cost)));
        }
    }
}

impl LookBudget {
    /// Learns the usual difference between the numbers of frames. If frames are missing however few runs there are, they were not dropped
    /// for want of time.
    fn learn_step(&mut self, n_frames: u64) {
        let recent = &mut self.recent;
        recent.n += 1;
        recent.n_low += u64::from(self.kept <= 2.0 * LEAST_KEPT);
        recent.steps += n_frames;
        if recent.n < MANY {
            return;
        }
        let mean = recent.steps.div_ceil(recent.n * self.frame_step).max(1) * self.frame_step;
        self.usual_step = if recent.n_low == recent.n {
            mean
        } else {
            mean.min(self.usual_step)
        };
        *recent = Recent::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(n_looks: f64, processor_s: f64, clock_s: f64) -> Spent {
        Spent {
            n_looks,
            processor_s,
            clock_s,
            n_frames: 2,
        }
    }

    #[test]
    fn the_budget_is_the_number_of_network_runs_that_the_cores_manage_between_two_frames() {
        let mut budget = LookBudget::new(0.5, 1.0 / 15.0, 2);
        assert_eq!(budget.looks(), None, "nothing is known yet");
        budget.spent(&frame(4.0, 0.04, 0.05));
        // 20 ms of 67 ms on half a core, at 10 ms a run.
        assert!((budget.looks().unwrap() - 2.0).abs() < 1e-9);
        budget.spent(&frame(0.0, 0.001, 0.001));
        assert!(
            (budget.looks().unwrap() - 2.0).abs() < 1e-9,
            "no run, no news"
        );
    }

    #[test]
    fn a_view_that_does_not_keep_up_runs_the_network_less_often_until_it_does() {
        let mut budget = LookBudget::new(1.0, 0.05, 2);
        let looks_after = |budget: &mut LookBudget, n: u32, clock_s: f64| {
            (0..n).for_each(|_| budget.spent(&frame(1.0, 0.01, clock_s)));
            budget.looks().unwrap()
        };
        let at_first = looks_after(&mut budget, 1, 0.02);
        assert_eq!(looks_after(&mut budget, 1, 0.2), at_first, "one slow frame");
        let slow = looks_after(&mut budget, 20, 0.08);
        assert!(slow < 0.5 * at_first && slow > 0.0, "{slow}");
        assert_eq!(looks_after(&mut budget, 200, 0.02), at_first);
    }

    #[test]
    fn a_view_whose_frames_are_dropped_runs_the_network_less_often() {
        let mut budget = LookBudget::new(1.0, 0.05, 2);
        let fast = frame(1.0, 0.01, 0.02);
        let dropped = Spent {
            n_frames: 4,
            ..fast
        };
        budget.spent(&fast);
        let at_first = budget.looks().unwrap();
        (0..6).for_each(|_| budget.spent(&dropped));
        let after = budget.looks().unwrap();
        assert!(after < 0.6 * at_first && after > 0.0, "{after}");
        (0..200).for_each(|_| budget.spent(&fast));
        assert_eq!(budget.looks(), Some(at_first));
    }

    #[test]
    fn a_camera_that_delivers_fewer_frames_than_it_states_is_not_taken_for_a_slow_machine() {
        // The differences of a camera with half, and of one with two thirds of its stated rate.
        for steps in [[4, 4], [2, 4]] {
            let mut budget = LookBudget::new(1.0, 0.05, 2);
            let mut run = |n: usize, steps: [u64; 2]| {
                for n_frames in steps.into_iter().cycle().take(n) {
                    budget.spent(&Spent {
                        n_frames,
                        ..frame(1.0, 0.01, 0.02)
                    });
                }
                budget.looks().unwrap()
            };
            let at_first = run(1, [2, 2]);
            assert!(run(99, steps) < 0.2 * at_first);
            assert_eq!(run(500, steps), at_first, "{steps:?}");
            // In the light, it has its rate again, and then a larger difference is a dropped frame.
            run(200, [2, 2]);
            assert!(run(6, [4, 4]) < 0.6 * at_first);
        }
    }
}
