//! Tracks of people from picture to picture, with the positions of their joints at any time.

use geometry::Camera;
use nalgebra::Point2;

use crate::synchronisation::film::{Film, Person};

/// Longest gap in a person's detections that a track can bridge, in seconds.
const LONGEST_GAP_S: f64 = 0.25;
/// Largest movement of a person's joints between two pictures, in sizes of the person: a constant, and an amount per second.
const FARTHEST: [f64; 2] = [0.15, 4.0];
/// A joint is an outlier if its distance from the position predicted by its neighbours in time exceeds this, in sizes of the person. For a
/// moving joint, a fraction of the distance between the neighbours is added to the limit.
const OUTLIER: f64 = 0.03;
const TURNING: f64 = 0.25;
/// Number of neighbours in time on each side.
const NEIGHBOURS: usize = 3;
/// Minimum score, 0 to 1, of a joint that is used.
const LEAST_SCORE: f64 = 0.05;
/// Half the width of the smoothing kernel, in standard deviations.
const KERNEL_END: f64 = 2.5;
/// Minimum number of joints of a person who is followed.
pub(crate) const LEAST_JOINTS: usize = 3;

/// A joint at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position, in ideal pixels.
    pub at: [f64; 2],
    /// Speed, in ideal pixels per second.
    pub speed: [f64; 2],
    /// Weight, from the scores of the samples.
    pub weight: f64,
}

/// A sample of a joint.
#[derive(Debug, Clone, Copy)]
struct Sample {
    time_s: f64,
    at: [f64; 2],
    score: f64,
}

/// One person over time, in one camera.
#[derive(Debug, Clone)]
pub struct Track {
    /// First and last time, in seconds by the clock of the camera.
    pub(crate) span: [f64; 2],
    /// Size of the person, in ideal pixels.
    pub(crate) size: f64,
    /// Samples of each joint, in order of time.
    joints: Vec<Vec<Sample>>,
    /// Standard deviation of the smoothing kernel, in seconds.
    sigma_s: f64,
}

impl Track {
    /// Returns the first and last time, in seconds by the clock of the camera.
    pub fn span(&self) -> [f64; 2] {
        self.span
    }

    /// Returns the size of the person, in ideal pixels.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Returns the mean score of the joints; 0 if there are none.
    pub fn score(&self) -> f64 {
        let scores = self.joints.iter().flatten().map(|joint| joint.score);
        let n = self.joints.iter().map(Vec::len).sum::<usize>();
        scores.sum::<f64>() / n.max(1) as f64
    }

    /// Returns the position of a joint at a time, from a line through its nearby samples, weighted by a Gaussian in time.
    pub fn place(&self, joint: usize, time_s: f64) -> Option<Place> {
        let samples = &self.joints[joint];
        let reach = KERNEL_END * self.sigma_s;
        let from = samples.partition_point(|sample| sample.time_s < time_s - reach);
        let near = samples[from..].iter().take_while(|sample| sample.time_s <= time_s + reach);
        let (mut n, mut before, mut after) = (0, false, false);
        let mut sums = [0.0; 3];
        let mut moments = [[0.0; 2]; 2];
        let mut scores = 0.0;
        for it in near {
            let dt = it.time_s - time_s;
            let kernel = (-0.5 * (dt / self.sigma_s).powi(2)).exp();
            let weight = it.score * kernel;
            n += 1;
            before |= dt <= 0.0;
            after |= dt >= 0.0;
            scores += kernel;
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += weight * dt.powi(power as i32);
            }
            for (moments, at) in moments.iter_mut().zip(it.at) {
                moments[0] += weight * at;
                moments[1] += weight * dt * at;
            }
        }
        let [s0, s1, s2] = sums;
        let spread = s0 * s2 - s1 * s1;
        if n < 2 || !before || !after || spread <= 1e-12 * s0 * s0 {
            return None;
        }
        let line =
            moments.map(|[m0, m1]| [(s2 * m0 - s1 * m1) / spread, (s0 * m1 - s1 * m0) / spread]);
        Some(Place {
            at: line.map(|line| line[0]),
            speed: line.map(|line| line[1]),
            weight: s0 / scores,
        })
    }
}

/// A person in a picture, in ideal pixels.
struct Seen {
    joints: Vec<Option<([f64; 2], f64)>>,
    size: f64,
}

/// A track under construction.
struct Open {
    samples: Vec<(f64, Seen)>,
}

/// Returns the tracks of a film.
///
/// * `sigma_s`: standard deviation of the kernel that smooths the tracks, in seconds.
pub fn tracks(film: &Film, camera: &Camera, n_joints: usize, sigma_s: f64) -> Vec<Track> {
    let [width, height] = camera.intrinsics.size;
    let least_size = 0.03 * f64::from(width.max(height));
    let (mut open, mut done) = (Vec::<Open>::new(), Vec::new());
    for shot in &film.shots {
        let people = shot.people.iter();
        let mut people: Vec<Option<Seen>> =
            people.map(|person| seen(person, camera, n_joints, least_size)).collect();
        let is_old = |open: &Open| shot.time_s - open.last().0 > LONGEST_GAP_S;
        let (old, mut fresh): (Vec<Open>, Vec<Open>) = open.into_iter().partition(is_old);
        done.extend(old);
        link(shot.time_s, &mut people, &mut fresh);
        let begun = people.into_iter().flatten().map(|person| Open {
            samples: vec![(shot.time_s, person)],
        });
        fresh.extend(begun);
        open = fresh;
    }
    done.extend(open);
    let tracks = done.into_iter();
    tracks.filter_map(|track| track.finish(n_joints, sigma_s)).collect()
}

/// Assigns people to the tracks with the nearest last picture, in order of distance.
fn link(time_s: f64, people: &mut [Option<Seen>], open: &mut [Open]) {
    let mut ties = Vec::new();
    for (track, it) in open.iter().enumerate() {
        let (last_s, last) = it.last();
        let farthest = FARTHEST[0] + FARTHEST[1] * (time_s - last_s);
        for (person, seen) in people.iter().enumerate() {
            let Some(seen) = seen else { continue };
            if let Some(apart) = apart(last, seen).filter(|value| *value < farthest) {
                ties.push((apart, track, person));
            }
        }
    }
    ties.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut is_taken = vec![false; open.len()];
    for (_, track, person) in ties {
        if !is_taken[track]
            && let Some(seen) = people[person].take()
        {
            is_taken[track] = true;
            open[track].samples.push((time_s, seen));
        }
    }
}

/// Returns the median distance of the joints of two people, in sizes of the larger one.
fn apart(a: &Seen, b: &Seen) -> Option<f64> {
    let both = a.joints.iter().zip(&b.joints);
    let mut each: Vec<f64> = both
        .filter_map(|(a, b)| {
            let (a, b) = ((*a)?.0, (*b)?.0);
            Some((a[0] - b[0]).hypot(a[1] - b[1]))
        })
        .collect();
    if each.len() < LEAST_JOINTS {
        return None;
    }
    each.sort_by(f64::total_cmp);
    Some(each[each.len() / 2] / a.size.max(b.size))
}

fn seen(person: &Person, camera: &Camera, n_joints: usize, least_size: f64) -> Option<Seen> {
    let ideal = |joint: usize| {
        let it = (*person.joints.get(joint)?)?;
        let is_good = it.at.iter().all(|value| value.is_finite()) && it.score > LEAST_SCORE;
        let at = camera.undistorted_px(&Point2::from(it.at)).filter(|_| is_good)?;
        Some(([at.x, at.y], it.score.min(1.0)))
    };
    let joints: Vec<Option<([f64; 2], f64)>> = (0..n_joints).map(ideal).collect();
    let known = joints.iter().flatten();
    if known.clone().count() < LEAST_JOINTS {
        return None;
    }
    let extent = |axis: usize| {
        let each = known.clone().map(|joint| joint.0[axis]);
        let [from, to] = each.fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], it| {
            [from.min(it), to.max(it)]
        });
        to - from
    };
    let size = extent(0).max(extent(1)).max(least_size);
    Some(Seen { joints, size })
}

impl Open {
    fn last(&self) -> (f64, &Seen) {
        let (time_s, seen) = &self.samples[self.samples.len() - 1];
        (*time_s, seen)
    }

    fn finish(self, n_joints: usize, sigma_s: f64) -> Option<Track> {
        if self.samples.len() < 3 {
            return None;
        }
        let mut sizes: Vec<f64> = self.samples.iter().map(|sample| sample.1.size).collect();
        sizes.sort_by(f64::total_cmp);
        // People who bend or are cut off look smaller than they are.
        let size = sizes[sizes.len() * 3 / 4];
        let of_joint = |joint: usize| {
            let each = self.samples.iter();
            let each = each.filter_map(|(time_s, seen)| {
                let (at, score) = seen.joints[joint]?;
                Some(Sample {
                    time_s: *time_s,
                    at,
                    score,
                })
            });
            without_outliers(&each.collect::<Vec<_>>(), OUTLIER * size)
        };
        Some(Track {
            span: [self.samples[0].0, self.last().0],
            size,
            joints: (0..n_joints).map(of_joint).collect(),
            sigma_s,
        })
    }
}

/// Leaves out samples far from the line between the medians of the samples before and after.
fn without_outliers(samples: &[Sample], limit: f64) -> Vec<Sample> {
    let is_good = |nth: usize| {
        let before = &samples[nth.saturating_sub(NEIGHBOURS)..nth];
        let after = &samples[nth + 1..(nth + 1 + NEIGHBOURS).min(samples.len())];
        let (Some(before), Some(after)) = (middle(before), middle(after)) else {
            return true;
        };
        let it = samples[nth];
        let share = (it.time_s - before.time_s) / (after.time_s - before.time_s);
        [0, 1].into_iter().all(|axis| {
            let way = after.at[axis] - before.at[axis];
            let away = it.at[axis] - before.at[axis] - share * way;
            away.abs() < limit + TURNING * way.abs()
        })
    };
    let kept = (0..samples.len()).filter(|i| is_good(*i));
    kept.map(|i| samples[i]).collect()
}

/// Returns the median of samples, separately for each number.
fn middle(samples: &[Sample]) -> Option<Sample> {
    let median = |of: fn(&Sample) -> f64| {
        let mut each: Vec<f64> = samples.iter().map(of).collect();
        each.sort_by(f64::total_cmp);
        let n = each.len();
        (n > 0).then(|| f64::midpoint(each[(n - 1) / 2], each[n / 2]))
    };
    Some(Sample {
        time_s: median(|sample| sample.time_s)?,
        at: [
            median(|sample| sample.at[0])?,
            median(|sample| sample.at[1])?,
        ],
        score: 1.0,
    })
}
