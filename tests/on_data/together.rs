//! Who is who among several people: real motion, real cameras, made keypoints.

use std::path::Path;

use fastrand::Rng;
use geometry::Camera;
use geometry::files::ReadOptions;
use nalgebra::{Point3, Vector3};
use people::{Detection, Keypoint, Settings, Tracker, View};
use serde_json::Value;

use crate::shared_dir;

const N_JOINTS: usize = 14;
/// Joints of `skeleton::PARSE14` among the 19 of the set; it has no top of the head.
const JOINTS: [Option<usize>; N_JOINTS] = [
    Some(14), Some(13), Some(12), Some(6), Some(7), Some(8), Some(11), Some(10), Some(9), Some(3), Some(4), Some(5), Some(0), None,
];
const HIPS: [usize; 2] = [2, 3];
const NECK: usize = 12;
/// Side of the square in which people are, metres, and their least distance.
const SQUARE_M: f64 = 3.6;
const APART_M: f64 = 0.45;
/// A trunk hides what lies behind it so near to its middle line, metres.
const TRUNK_M: f64 = 0.15;
/// Share of the joints that the detector misses.
const MISSED: f64 = 0.1;
/// Instants of a clip, and seconds between two.
const N_INSTANTS: usize = 20;
const STEP_S: f64 = 1.0 / 29.97;

/// A person's joints, metres.
type Body = [Option<Point3<f64>>; N_JOINTS];

/// What is known of a set of two stretches of film.
struct Motion {
    cameras: Vec<Camera>,
    /// Every person of every stretch, instant by instant.
    clips: Vec<Vec<Body>>,
}

fn body(person: &Value) -> Option<(u64, Body)> {
    let numbers = person["joints19"].as_array()?.iter().filter_map(Value::as_f64);
    let numbers: Vec<f64> = numbers.collect();
    let joint = |nth: usize| {
        let [x, y, z, confidence] = *numbers.get(4 * nth..4 * nth + 4)? else { return None };
        (confidence > 0.0).then(|| Point3::new(x, y, z) / 100.0)
    };
    Some((person["id"].as_u64()?, JOINTS.map(|nth| joint(nth?))))
}

impl Motion {
    fn read(folder: &Path) -> Self {
        let calibration = folder.join("band1/calibration.json");
        let rig = geometry::files::read(&calibration, &ReadOptions::default()).unwrap();
        let is_hd = |camera: &&Camera| camera.intrinsics.size == [1920, 1080];
        let mut clips = Vec::new();
        for band in ["band1", "band2"] {
            let mut files: Vec<_> = std::fs::read_dir(folder.join(band)).unwrap().map(|file| file.unwrap().path()).collect();
            files.retain(|file| file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("body3DScene")));
            files.sort();
            let instants = files.iter().map(|file| {
                let scene: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
                scene["bodies"].as_array().unwrap().iter().filter_map(body).collect::<Vec<(u64, Body)>>()
            });
            let instants: Vec<Vec<(u64, Body)>> = instants.collect();
            for (id, _) in &instants[0] {
                let of_id = |people: &Vec<(u64, Body)>| people.iter().find(|it| it.0 == *id).map(|it| it.1);
                let clip: Vec<Body> = instants.iter().filter_map(of_id).collect();
                if clip.len() == N_INSTANTS {
                    clips.push(clip);
                }
            }
        }
        Self { cameras: rig.cameras().iter().filter(is_hd).cloned().collect(), clips }
    }

    /// Some people in a room: clips turned and moved, not too near to each other.
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
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), random.f64() * std::f64::consts::TAU);
            let middle = clip[0][NECK].unwrap().coords.component_mul(&Vector3::new(1.0, 0.0, 1.0));
            let moved = |body: &Body| body.map(|joint| joint.map(|point| turn * (point - middle) + place));
            people.push(clip.iter().map(moved).collect());
            places.push(place);
        }
        people
    }
}

/// Whether another's trunk is before a joint.
fn is_hidden(camera: &Camera, joint: &Point3<f64>, nth: usize, people: &[Body]) -> bool {
    let from = camera.centre_in_world();
    let ray = (joint - from).normalize();
    people.iter().enumerate().filter(|it| it.0 != nth).any(|(_, other)| {
        let [Some(neck), Some(right), Some(left)] = [other[NECK], other[HIPS[0]], other[HIPS[1]]] else { return false };
        let hips = nalgebra::center(&right, &left);
        (0..=8).any(|step| {
            let point = neck + (hips - neck) * (f64::from(step) / 8.0);
            let along = (point - from).dot(&ray);
            along > 0.0 && along < (joint - from).norm() - TRUNK_M && (point - from - ray * along).norm() < TRUNK_M
        })
    })
}

/// What a view sees of each person; nothing of one who is hidden.
fn seen(camera: &Camera, people: &[Body], noise_m: f64, random: &mut Rng) -> Vec<Option<Detection>> {
    let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
    let focal = camera.intrinsics.fx;
    let mut detections = Vec::new();
    for (nth, person) in people.iter().enumerate() {
        let joints = person.map(|joint| {
            let joint = joint.filter(|joint| !is_hidden(camera, joint, nth, people))?;
            let sd_px = noise_m * focal / (joint - camera.centre_in_world()).norm();
            let at = camera.project(&joint)?;
            let at_px = [at.x + sd_px * normal(), at.y + sd_px * normal()];
            let [width, height] = camera.intrinsics.size.map(f64::from);
            let is_inside = (0.0..width).contains(&at_px[0]) && (0.0..height).contains(&at_px[1]);
            (is_inside && normal().abs() > 0.125_66 * f64::from(MISSED > 0.0)).then_some(Keypoint { at_px, sd_px, heat: 0.8 })
        });
        let is_found = joints.iter().flatten().count() >= 5;
        detections.push(is_found.then_some(Detection { joints, colour: None }));
    }
    detections
}

/// Pairs of detections of two views: of one person in truth, as found, and both.
#[derive(Debug, Clone, Copy, Default)]
struct Pairs {
    true_ones: usize,
    found: usize,
    right: usize,
}

impl Pairs {
    fn add(&mut self, truth: &[Vec<usize>], found: &[Vec<Option<u64>>]) {
        for a in 0..truth.len() {
            for b in a + 1..truth.len() {
                for (one, id) in truth[a].iter().zip(&found[a]) {
                    for (other, other_id) in truth[b].iter().zip(&found[b]) {
                        let is_found = id.is_some() && id == other_id;
                        self.true_ones += usize::from(one == other);
                        self.found += usize::from(is_found);
                        self.right += usize::from(is_found && one == other);
                    }
                }
            }
        }
    }

    fn f1(&self) -> f64 {
        2.0 * self.right as f64 / (self.true_ones + self.found) as f64
    }
}

/// A setting, and what came of it.
struct Outcome {
    pairs: Pairs,
    switches: usize,
    ids: usize,
    slowest_ms: Vec<f64>,
}

fn outcome(motion: &Motion, n_people: usize, n_views: usize, noise_m: f64, n_draws: u64) -> Outcome {
    let mut outcome = Outcome { pairs: Pairs::default(), switches: 0, ids: 0, slowest_ms: Vec::new() };
    for seed in 0..n_draws {
        let mut random = Rng::with_seed(seed);
        let people = motion.people(n_people, &mut random);
        let mut cameras = motion.cameras.clone();
        random.shuffle(&mut cameras);
        cameras.truncate(n_views);
        let mut tracker = Tracker::new(cameras.clone(), Settings { max: 8, ..Settings::default() });
        let mut last = vec![None; n_people];
        for instant in 0..N_INSTANTS {
            let bodies: Vec<Body> = people.iter().map(|clip| clip[instant]).collect();
            let mut truth = Vec::new();
            let mut views = Vec::new();
            for camera in &cameras {
                let mut order: Vec<usize> = (0..n_people).collect();
                random.shuffle(&mut order);
                let all = seen(camera, &bodies, noise_m, &mut random);
                order.retain(|person| all[*person].is_some());
                views.push(View { detections: order.iter().filter_map(|person| all[*person]).collect(), loose: Vec::new() });
                truth.push(order);
            }
            let start = std::time::Instant::now();
            let found = tracker.step(instant as f64 * STEP_S, &views);
            outcome.slowest_ms.push(1e3 * start.elapsed().as_secs_f64());
            let mut ids: Vec<Vec<Option<u64>>> = truth.iter().map(|view| vec![None; view.len()]).collect();
            for person in &found {
                let mut votes = vec![0; n_people];
                for (view, detection) in person.detections.iter().enumerate() {
                    if let Some(detection) = detection {
                        ids[view][*detection] = Some(person.id);
                        votes[truth[view][*detection]] += 1;
                    }
                }
                let most = (0..n_people).max_by_key(|nth| votes[*nth]).unwrap();
                if votes[most] >= 2 {
                    outcome.switches += usize::from(last[most].is_some_and(|id| id != person.id));
                    last[most] = Some(person.id);
                }
            }
            outcome.pairs.add(&truth, &ids);
        }
        outcome.ids += tracker.memory().last_id as usize;
    }
    outcome.slowest_ms.sort_by(f64::total_cmp);
    outcome
}
