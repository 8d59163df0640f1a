//! Initial rig: the first pair of cameras, then each other camera by resection.

use fastrand::Rng;
use geometry::bundle::{Cameras, Free, Settings as Search, solve};
use geometry::{Camera, Observation};
use nalgebra::{Isometry3, Point3};

use super::adjust::{Adjustment, Beliefs};
use super::doubt::Doubt;
use super::instant::place;
use super::resect::{Known, resected};
use super::sightings::{Chain, Sightings};
use super::two_view::{Match, Relative, normalised, relative};

/// Initial value for the expected error of a joint, as a fraction of the size of the person.
pub(crate) const SHARE: f64 = 0.015;
/// Maximum number of pairs of cameras to try as the first pair.
const MOST_PAIRS: usize = 10;
/// Minimum fraction of joints that must agree with the relative pose of the first pair of cameras.
const LEAST_INLIERS: f64 = 0.4;
/// Angle between rays above which a larger angle no longer makes a pair better, in radians.
const WIDE: f64 = 0.5;
/// A camera's pose is accepted if the mean cost of its joints, log(1 + (residual / sigma)^2), is at most this.
const MOST_COST: f64 = 3.2;
/// Step between the offsets that are searched, in seconds.
const STEP_S: f64 = 0.1;

/// Choice for one camera: the person that it sees, the offset of its clock, and whether left and right are swapped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Choice {
    pub(crate) chain: usize,
    pub(crate) offset_s: f64,
    pub(crate) is_exchanged: bool,
}

/// Input of the search for a first rig.
#[derive(Debug, Clone)]
pub(crate) struct Study<'a> {
    /// Cameras without distortion.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) chains: &'a [Vec<Chain>],
    pub(crate) times_s: Vec<f64>,
    pub(crate) n_joints: usize,
    pub(crate) sides: &'a [usize],
    /// Choices for each camera, the most likely first.
    pub(crate) choices: Vec<Vec<Choice>>,
}

/// Initial rig, in a world of its own.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub(crate) cameras: Vec<Camera>,
    pub(crate) choices: Vec<Choice>,
    /// The first pair of cameras; the distance between them is 1.
    pub(crate) pair: [usize; 2],
}

/// Returns all possible choices for a camera.
pub(crate) fn choices(n_chains: usize, offset_s: f64, window_s: f64, as_seen: bool) -> Vec<Choice> {
    let steps = (window_s / STEP_S).ceil() as i64;
    let mut all = Vec::new();
    for chain in 0..n_chains {
        for step in -steps..=steps {
            for is_exchanged in [false, true] {
                if is_exchanged && !as_seen {
                    continue;
                }
                all.push(Choice {
                    chain,
                    offset_s: offset_s + STEP_S * step as f64,
                    is_exchanged,
                });
            }
        }
    }
    all.sort_by(|a, b| {
        let far = |choice: &Choice| (choice.chain, (choice.offset_s - offset_s).abs());
        far(a).partial_cmp(&far(b)).unwrap_or(core::cmp::Ordering::Equal)
    });
    all
}

impl Study<'_> {
    /// Returns the joints of the chosen people.
    pub(crate) fn sightings(&self, chosen: &[Option<Choice>]) -> Sightings {
        let chains = chosen.iter().enumerate();
        let chains: Vec<Option<&Chain>> =
            chains.map(|(camera, it)| self.chains[camera].get((*it)?.chain)).collect();
        let offsets: Vec<f64> =
            chosen.iter().map(|choice| choice.map_or(0.0, |known| known.offset_s)).collect();
        let mut all = Sightings::new(&chains, &self.times_s, &offsets, self.n_joints);
        for (camera, it) in chosen.iter().enumerate() {
            if it.is_some_and(|choice| choice.is_exchanged) {
                all.exchange_all(camera, self.sides);
            }
        }
        all
    }

    /// Returns the expected error of a joint of a camera at the start, in pixels.
    pub(crate) fn sigma_px(&self, camera: usize, choice: Choice) -> f64 {
        SHARE * self.chains[camera][choice.chain].size()
    }

    fn matches(&self, pair: [usize; 2], chosen: [Choice; 2]) -> Vec<Match> {
        let mut all = vec![None; self.cameras.len()];
        for (camera, choice) in pair.into_iter().zip(chosen) {
            all[camera] = Some(choice);
        }
        let seen = self.sightings(&all);
        let mut matches = Vec::new();
        for instant in &seen.seen {
            let [of_a, of_b] = pair.map(|pair| &instant[pair]);
            for both in of_a.iter().zip(of_b) {
                let both = [*both.0, *both.1];
                let [a, b] = [0, 1].map(|nth| {
                    let (it, at) = (pair[nth], both[nth]?.at);
                    Some(normalised(&self.cameras[it], &at))
                });
                if let (Some(a), Some(b)) = (a, b) {
                    matches.push(Match { a, b });
                }
            }
        }
        matches
    }

    /// Finds the first pair of cameras.
    fn pair(&self, random: &mut Rng) -> Option<([usize; 2], [Choice; 2], Relative)> {
        let n = self.cameras.len();
        let mut pairs: Vec<([usize; 2], usize)> = Vec::new();
        for a in 0..n {
            for b in a + 1..n {
                if let (Some(of_a), Some(of_b)) = (self.choices[a].first(), self.choices[b].first())
                {
                    pairs.push(([a, b], self.matches([a, b], [*of_a, *of_b]).len()));
                }
            }
        }
        pairs.sort_by_key(|pair| core::cmp::Reverse(pair.1));
        pairs.truncate(MOST_PAIRS);
        let mut best = None;
        let mut most = 0.0;
        for (pair, _) in pairs {
            let [a, b] = pair;
            // The clock of the first camera, and its convention for left and right, are the reference for the other camera.
            let mut of_a = self.choices[a].clone();
            let first = of_a[0];
            of_a.retain(|choice| {
                choice.offset_s == first.offset_s && !choice.is_exchanged || *choice == first
            });
            for choice_a in of_a {
                for choice_b in &self.choices[b] {
                    let matches = self.matches(pair, [choice_a, *choice_b]);
                    let sigma = |camera: usize, choice| {
                        self.sigma_px(camera, choice) / self.cameras[camera].intrinsics.fx
                    };
                    let sigma =
                        sigma(a, choice_a).hypot(sigma(b, *choice_b)) / core::f64::consts::SQRT_2;
                    let Some(found) = relative(&matches, sigma, random) else {
                        continue;
                    };
                    let angle = found.parallax.min(core::f64::consts::PI - found.parallax);
                    let worth =
                        found.inliers * (matches.len() as f64).sqrt() * (angle / WIDE).min(1.0)
                            / (0.1 + found.cost);
                    if worth > most && found.inliers > LEAST_INLIERS {
                        most = worth;
                        best = Some((pair, [choice_a, *choice_b], found));
                    }
                }
            }
        }
        best
    }

    /// Finds the initial rig.
    pub(crate) fn start(&self, random: &mut Rng) -> Result<Start, Doubt> {
        let (pair, chosen, found) = self.pair(random).ok_or(Doubt::NoPair)?;
        let mut cameras = self.cameras.clone();
        cameras[pair[0]].camera_from_world = Isometry3::identity();
        cameras[pair[1]].camera_from_world = found.b_from_a;
        let mut choices = vec![None; cameras.len()];
        choices[pair[0]] = Some(chosen[0]);
        choices[pair[1]] = Some(chosen[1]);
        while choices.iter().any(Option::is_none) {
            self.settle(&mut cameras, &choices, pair);
            let next = self.next(&cameras, &choices, random);
            let Some((camera, choice, placed, cost)) = next else {
                let camera = choices.iter().position(Option::is_none).unwrap_or(0);
                return Err(Doubt::Unplaced { camera, cost: None });
            };
            if cost > MOST_COST {
                return Err(Doubt::Unplaced {
                    camera,
                    cost: Some(cost),
                });
            }
            cameras[camera] = placed;
            choices[camera] = Some(choice);
        }
        Ok(Start {
            cameras,
            choices: choices.into_iter().flatten().collect(),
            pair,
        })
    }

    /// Adjusts the cameras whose poses have been found so far.
    fn settle(&self, cameras: &mut Vec<Camera>, choices: &[Option<Choice>], pair: [usize; 2]) {
        let free: Vec<Free> = choices
            .iter()
            .enumerate()
            .map(|(camera, it)| Free {
                pose: it.is_some() && camera != pair[0],
                ..Free::default()
            })
            .collect();
        let beliefs = Beliefs {
            baseline: Some((pair[0], pair[1], 1.0)),
            ..Beliefs::default()
        };
        let seen = self.sightings(choices);
        let sigmas = self.sigmas(choices);
        let all = Cameras::new(cameras.clone(), &free);
        let problem = Adjustment::new(all, &seen, &sigmas, beliefs);
        let settings = Search {
            max_iterations: 12,
            least_gain: 1e-4,
        };
        let (end, _) = solve(problem, &settings);
        *cameras = end.cameras().cameras().to_vec();
    }

    /// Returns the expected errors at the start, by camera and joint.
    pub(crate) fn sigmas(&self, choices: &[Option<Choice>]) -> Vec<Vec<f64>> {
        let of = |(camera, it): (usize, &Option<Choice>)| {
            let sigma = it.map_or(1.0, |choice| self.sigma_px(camera, choice));
            vec![sigma; self.n_joints]
        };
        choices.iter().enumerate().map(of).collect()
    }

    /// Returns the camera whose pose can be determined best, and this pose.
    fn next(
        &self,
        cameras: &[Camera],
        choices: &[Option<Choice>],
        random: &mut Rng,
    ) -> Option<(usize, Choice, Camera, f64)> {
        let points = self.points(cameras, choices);
        let mut best: Option<(usize, Choice, Camera, f64)> = None;
        for camera in (0..cameras.len()).filter(|i| choices[*i].is_none()) {
            for choice in &self.choices[camera] {
                let mut alone = vec![None; cameras.len()];
                alone[camera] = Some(*choice);
                let seen = self.sightings(&alone);
                let sigma = self.sigma_px(camera, *choice);
                let mut known: Vec<Known> = Vec::new();
                for (instant, points) in seen.seen.iter().zip(&points) {
                    let each = instant[camera].iter().zip(points);
                    known.extend(each.filter_map(|(seen, point)| {
                        let seen = (*seen)?;
                        Some(((*point)?, seen.at, sigma / seen.weight.sqrt()))
                    }));
                }
                if let Some((placed, cost)) = resected(&self.cameras[camera], &known, random)
                    && best.as_ref().is_none_or(|best| cost < best.3)
                {
                    best = Some((camera, *choice, placed, cost));
                }
            }
        }
        best
    }

    /// Returns the joints as triangulated from the cameras with known poses, by instant and joint.
    fn points(
        &self,
        cameras: &[Camera],
        choices: &[Option<Choice>],
    ) -> Vec<Vec<Option<Point3<f64>>>> {
        let seen = self.sightings(choices);
        let at = |instant: &Vec<Vec<Option<super::sightings::Sight>>>, joint: usize| {
            let each = cameras.iter().enumerate();
            let observations: Vec<Observation<'_>> = each
                .filter_map(|(camera, it)| {
                    let sight = instant[camera][joint]?;
                    Some(Observation {
                        camera: it,
                        point_px: sight.at,
                        sigma_px: self.sigma_px(camera, choices[camera]?),
                    })
                })
                .collect();
            place(&observations)
        };
        let of = |instant| (0..self.n_joints).map(|i| at(instant, i)).collect();
        seen.seen.iter().map(of).collect()
    }
}
