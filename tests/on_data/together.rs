//! Association of several people across views: real motion, real cameras, synthetic keypoints.

use std::path::Path;

use fastrand::Rng;
use geometry::Camera;
use geometry::files::ReadOptions;
use nalgebra::{Point3, Vector3};
use people::{Detection, Keypoint, Person, Settings, Tracker, View};
use serde_json::Value;
use statistics::score::Bootstrap;

use crate::shared_dir;

const N_JOINTS: usize = 14;
/// Index of each joint of `skeleton::PARSE14` among the 19 joints of the set, which has no top of the head.
const JOINTS: [Option<usize>; N_JOINTS] = [
    Some(14),
    Some(13),
    Some(12),
    Some(6),
    Some(7),
    Some(8),
    Some(11),
    Some(10),
    Some(9),
    Some(3),
    Some(4),
    Some(5),
    Some(0),
    None,
];
const HIPS: [usize; 2] = [2, 3];
const NECK: usize = 12;
/// Side of the square in which the people are, in metres.
const SQUARE_M: f64 = 3.6;
/// Smallest distance between people, in metres.
const APART_M: f64 = 0.45;
/// Distance from the middle line of a trunk within which the trunk hides joints behind it, in metres.
const TRUNK_M: f64 = 0.15;
/// Fraction of the joints that the detector misses.
const MISSED: f64 = 0.1;
/// Number of frames in a clip.
const N_INSTANTS: usize = 20;
/// First frame that is evaluated.
const FIRST: usize = 5;
/// Time between two frames, in seconds.
const STEP_S: f64 = 1.0 / 29.97;

/// Joints of a person, in metres.
type Body = [Option<Point3<f64>>; N_JOINTS];

/// Motion and cameras of the data set.
struct Motion {
    cameras: Vec<Camera>,
    /// Clips of all people, from all sections of the motion, frame by frame.
    clips: Vec<Vec<Body>>,
}

fn body(person: &Value) -> Option<(u64, Body)> {
    let numbers = person["joints19"].as_array()?.iter().filter_map(Value::as_f64);
    let numbers: Vec<f64> = numbers.collect();
    let joint = |nth: usize| {
        let [x, y, z, confidence] = *numbers.get(4 * nth..4 * nth + 4)? else {
            return None;
        };
        (confidence > 0.0).then(|| Point3::new(x, y, z) / 100.0)
    };
    Some((person["id"].as_u64()?, JOINTS.map(|nth| joint(nth?))))
}

impl Motion {
    fn read(folder: &Path) -> Self {
        let calibration = folder.join("band1/calibration.json");
        let rig = geometry::files::read(&calibration, &ReadOptions::default()).unwrap();
        let is_hd = |camera: &&Camera| camera.name.starts_with("00_");
        let mut clips = Vec::new();
        for band in ["band1", "band2"] {
            let mut files: Vec<_> = std::fs::read_dir(folder.join(band))
                .unwrap()
                .map(|file| file.unwrap().path())
                .collect();
            files.retain(|file| {
                file.file_name()
                    .is_some_and(|name| name.to_string_lossy().starts_with("body3DScene"))
            });
            files.sort();
            let instants = files.iter().map(|file| {
                let scene: Value =
                    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
                scene["bodies"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .filter_map(body)
                    .collect::<Vec<(u64, Body)>>()
            });
            let instants: Vec<Vec<(u64, Body)>> = instants.collect();
            for (id, _) in &instants[0] {
                let of_id = |people: &Vec<(u64, Body)>| {
                    people.iter().find(|(other, _)| other == id).map(|(_, body)| *body)
                };
                let clip: Vec<Body> = instants.iter().filter_map(of_id).collect();
                if clip.len() == N_INSTANTS {
                    clips.push(clip);
                }
            }
        }
        Self {
            cameras: rig.cameras().iter().filter(is_hd).cloned().collect(),
            clips,
        }
    }

    /// Returns some people in a room: clips, rotated and moved, with a minimum distance between people.
    fn people(&self, n: usize, random: &mut Rng) -> Vec<Vec<Body>> {
        let mut people: Vec<Vec<Body>> = Vec::new();
        let mut places: Vec<Vector3<f64>> = Vec::new();
        while people.len() < n {
            let clip = &self.clips[random.usize(..self.clips.len())];
            let side = |random: &mut Rng| (random.f64() - 0.5) * SQUARE_M;
            let place = Vector3::new(side(random), 0.0, side(random));
            if places.iter().any(|other| (place - other).norm() < APART_M) {
                continue;
            }
            let turn = nalgebra::Rotation3::from_axis_angle(
                &Vector3::y_axis(),
                random.f64() * std::f64::consts::TAU,
            );
            let middle = clip[0][NECK].unwrap().coords.component_mul(&Vector3::new(1.0, 0.0, 1.0));
            let moved =
                |body: &Body| body.map(|joint| joint.map(|point| turn * (point - middle) + place));
            people.push(clip.iter().map(moved).collect());
            places.push(place);
        }
        people
    }
}

/// Returns true if the trunk of another person hides a joint.
fn is_hidden(camera: &Camera, joint: &Point3<f64>, nth: usize, people: &[Body]) -> bool {
    let from = camera.centre_in_world();
    let ray = (joint - from).try_normalize(1e-9).unwrap();
    people.iter().enumerate().filter(|(other, _)| *other != nth).any(|(_, other)| {
        let [Some(neck), Some(right), Some(left)] = [other[NECK], other[HIPS[0]], other[HIPS[1]]]
        else {
            return false;
        };
        let hips = nalgebra::center(&right, &left);
        (0..=8).any(|step| {
            let point = neck + (hips - neck) * (f64::from(step) / 8.0);
            let along = (point - from).dot(&ray);
            along > 0.0
                && along < (joint - from).norm() - TRUNK_M
                && (point - from - ray * along).norm() < TRUNK_M
        })
    })
}

/// Returns the detection of each person in a view; `None` for a hidden person.
fn seen(
    camera: &Camera,
    people: &[Body],
    noise_m: f64,
    random: &mut Rng,
) -> Vec<Option<Detection>> {
    let focal = camera.intrinsics.fx;
    let mut detections = Vec::new();
    for (nth, person) in people.iter().enumerate() {
        let joints = person.map(|joint| {
            let joint = joint.filter(|joint| !is_hidden(camera, joint, nth, people))?;
            let sd_px = noise_m * focal / (joint - camera.centre_in_world()).norm();
            let at = camera.project(&joint)?;
            let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
            let at_px = [at.x + sd_px * normal(), at.y + sd_px * normal()];
            let [width, height] = camera.intrinsics.size.map(f64::from);
            let is_inside = (0.0..width).contains(&at_px[0]) && (0.0..height).contains(&at_px[1]);
            let is_missed = random.f64() < MISSED;
            (is_inside && !is_missed).then_some(Keypoint {
                at_px,
                sd_px,
                heat: 0.8,
            })
        });
        let is_found = joints.iter().flatten().count() >= 5;
        detections.push(is_found.then_some(Detection {
            joints,
            colour: None,
        }));
    }
    detections
}

/// Returns true if two detections have enough joints in common for a comparison.
fn can_be_compared(a: &Detection, b: &Detection) -> bool {
    let both = a.joints.iter().zip(&b.joints);
    both.filter(|(a, b)| a.is_some() && b.is_some()).count() >= 4
}

/// Numbers of pairs of detections in two views: true pairs, found pairs, and pairs that are both true and found.
#[derive(Debug, Clone, Copy, Default)]
struct Pairs {
    true_ones: usize,
    found: usize,
    right: usize,
}

/// A detection in a view: its true person, and the person to whom it was assigned.
struct Shown<'a> {
    detection: &'a Detection,
    person: usize,
    id: Option<u64>,
}

/// Returns the detections in every view.
///
/// * `who`: the true person of each detection.
fn shown<'a>(views: &'a [View], who: &[Vec<usize>], found: &[Person]) -> Vec<Vec<Shown<'a>>> {
    let id = |view: usize, nth: usize| {
        let is_it = |person: &&Person| person.detections[view] == Some(nth);
        found.iter().find(is_it).map(|person| person.id)
    };
    let of_view = |(view, seen): (usize, &'a View)| {
        let each = seen.detections.iter().enumerate();
        let each = each.map(|(nth, detection)| Shown {
            detection,
            person: who[view][nth],
            id: id(view, nth),
        });
        each.collect()
    };
    views.iter().enumerate().map(of_view).collect()
}

impl Pairs {
    fn add(&mut self, views: &[Vec<Shown<'_>>]) {
        for (nth, view) in views.iter().enumerate() {
            let others = || views[nth + 1..].iter().flatten();
            for a in view {
                for b in others().filter(|b| can_be_compared(a.detection, b.detection)) {
                    let is_found = a.id.is_some() && a.id == b.id;
                    let is_true = a.person == b.person;
                    self.true_ones += usize::from(is_true);
                    self.found += usize::from(is_found);
                    self.right += usize::from(is_found && is_true);
                }
            }
        }
    }

    /// Returns F1, precision and recall.
    fn scores(&self) -> [f64; 3] {
        let share = |of: usize| self.right as f64 / of as f64;
        let f1 = 2.0 * self.right as f64 / (self.true_ones + self.found) as f64;
        [f1, share(self.found), share(self.true_ones)]
    }
}

/// Number of people, number of views, and error of the keypoints.
#[derive(Debug, Clone, Copy)]
struct Setting {
    n_people: usize,
    n_views: usize,
    noise_m: f64,
}

/// Follows randomly drawn people for twenty frames. Counts the pairs of every draw from the sixth frame on, when the people have received
/// their identities.
fn pairs(motion: &Motion, setting: Setting, n_draws: u64) -> Vec<Pairs> {
    let draw = |seed: u64| {
        let mut random = Rng::with_seed(seed);
        let people = motion.people(setting.n_people, &mut random);
        let mut cameras = motion.cameras.clone();
        random.shuffle(&mut cameras);
        cameras.truncate(setting.n_views);
        let settings = Settings {
            max: 8,
            ..Settings::default()
        };
        let mut tracker = Tracker::new(cameras.clone(), settings);
        let mut pairs = Pairs::default();
        for instant in 0..N_INSTANTS {
            let bodies: Vec<Body> = people.iter().map(|clip| clip[instant]).collect();
            let mut who = Vec::new();
            let mut views = Vec::new();
            for camera in &cameras {
                let mut order: Vec<usize> = (0..setting.n_people).collect();
                random.shuffle(&mut order);
                let all = seen(camera, &bodies, setting.noise_m, &mut random);
                order.retain(|person| all[*person].is_some());
                views.push(View {
                    detections: order.iter().filter_map(|person| all[*person]).collect(),
                    loose: Vec::new(),
                });
                who.push(order);
            }
            let found = tracker.step(instant as f64 * STEP_S, &views);
            if instant >= FIRST {
                pairs.add(&shown(&views, &who, &found));
            }
        }
        pairs
    };
    (0..n_draws).map(draw).collect()
}

#[test]
#[ignore = "needs ../shared"]
fn two_to_eight_people_are_distinguished_in_the_views_of_real_cameras() {
    let Some(shared) = shared_dir() else { return };
    let motion = Motion::read(&shared.join("data/panoptic_motion"));
    assert_eq!((motion.cameras.len(), motion.clips.len()), (31, 6));
    // For 60 draws: number of people, number of views, error of the keypoints in millimetres, and the smallest F1 of pairs.
    for (n_people, n_views, noise_mm, least) in [
        (8, 5, 20.0, 0.994),
        (8, 5, 50.0, 0.988),
        (8, 3, 20.0, 0.97),
        (4, 5, 50.0, 0.994),
        (2, 5, 50.0, 0.996),
    ] {
        let setting = Setting {
            n_people,
            n_views,
            noise_m: noise_mm / 1e3,
        };
        let draws: Vec<Vec<Pairs>> =
            pairs(&motion, setting, 60).into_iter().map(|pairs| vec![pairs]).collect();
        let of = |nth: usize| {
            move |pairs: &[Pairs]| {
                let sum = |of: fn(&Pairs) -> usize| pairs.iter().map(of).sum();
                let all = Pairs {
                    true_ones: sum(|pairs| pairs.true_ones),
                    found: sum(|pairs| pairs.found),
                    right: sum(|pairs| pairs.right),
                };
                Some(all.scores()[nth])
            }
        };
        let [f1, precision, recall] = [0, 1, 2].map(|nth| of(nth)(&draws.concat()).unwrap());
        let [low, high] = Bootstrap::default().interval_of(&draws, of(0)).unwrap();
        println!(
            "{n_people} people, {n_views} views, {noise_mm} mm: F1 of pairs {f1:.4} ({low:.4} to {high:.4}), precision {precision:.4}, \
             recall {recall:.4}"
        );
        assert!(f1 >= least, "{setting:?}: {f1}");
    }
}
