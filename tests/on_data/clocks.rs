//! Tests with known clocks of cameras: the keypoints of the balancing person are shifted in time and slowed down.

use calibration::synchronisation::{Film, Joint, Person, Settings, Shot, estimate};
use geometry::files::ReadOptions;
use keypoints::files::NameSet;
use keypoints::keypointfiles::KeypointSource;

use crate::shared_dir;

const RATE_HZ: f64 = 60.0;
const N_SEEDS: u64 = 20;

/// Returns the keypoints of the four cameras, and the number of keypoints of a person.
pub(crate) fn recorded(shared: &std::path::Path) -> (Vec<Film>, usize) {
    let (mut films, mut n_joints) = (Vec::new(), 0);
    for camera in ["cam01", "cam02", "cam03", "cam04"] {
        let folder = format!("data/pose2sim_balancing/openpose/{camera}_json");
        let names = NameSet::of_set("body-25b").unwrap();
        n_joints = names.n();
        let source = KeypointSource::open(&shared.join(folder), Some(names)).unwrap();
        let mut found = Vec::new();
        let shots = (0..source.n_frames()).map(|frame| {
            source.of_frame(frame, &mut found).unwrap();
            let joint = |keypoint: &keypoints::Keypoint| Joint {
                at: keypoint.at,
                score: keypoint.score,
            };
            let people = found.iter().map(|person| Person {
                joints: person
                    .keypoints
                    .iter()
                    .map(|keypoint| keypoint.as_ref().map(joint))
                    .collect(),
            });
            Shot {
                time_s: frame as f64 / RATE_HZ,
                people: people.collect(),
            }
        });
        films.push(Film {
            shots: shots.collect(),
        });
    }
    (films, n_joints)
}

/// Returns the film of a camera with another clock: it starts `first` frames later, and its frames are `pace` original frames apart.
fn resampled(film: &Film, first: f64, pace: f64) -> Film {
    let last = film.shots.len() - 1;
    let times = (0..).map(|nth| first + pace * f64::from(nth));
    let times = times.take_while(|time| *time <= last as f64);
    let shots = times.enumerate().map(|(nth, at)| {
        let (frame, share) = (at.floor() as usize, at.fract());
        let next = &film.shots[(frame + 1).min(last)];
        let people = film.shots[frame].people.iter();
        Shot {
            time_s: nth as f64 / RATE_HZ,
            people: people.filter_map(|person| between(person, &next.people, share)).collect(),
        }
    });
    Film {
        shots: shots.collect(),
    }
}

/// Interpolates a person between two frames; the nearest person in the next frame is assumed to be the same person.
fn between(person: &Person, next: &[Person], share: f64) -> Option<Person> {
    if share < 1e-9 {
        return Some(person.clone());
    }
    let pairs = |other: &Person| -> Vec<(Joint, Joint)> {
        let both = person.joints.iter().zip(&other.joints);
        both.filter_map(|(a, b)| (*a).zip(*b)).collect()
    };
    let apart = |other: &&Person| {
        let each = pairs(other);
        let away = each.iter().map(|(a, b)| (a.at[0] - b.at[0]).hypot(a.at[1] - b.at[1]));
        away.sum::<f64>() / each.len().max(1) as f64
    };
    let other = next.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    let joint = |(a, b): (&Option<Joint>, &Option<Joint>)| {
        let (a, b) = ((*a)?, (*b)?);
        Some(Joint {
            at: [0, 1].map(|axis| a.at[axis] + share * (b.at[axis] - a.at[axis])),
            score: a.score.min(b.score),
        })
    };
    let joints = person.joints.iter().zip(&other.joints).map(joint);
    Some(Person {
        joints: joints.collect(),
    })
}

#[test]
#[ignore = "needs ../shared"]
fn shifts_of_the_balancing_cameras_are_found_within_five_milliseconds() {
    let Some(shared) = shared_dir() else { return };
    let own = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .join("configs/rigs/pose2sim-balancing.toml");
    let rig = geometry::files::read(&own, &ReadOptions::default()).unwrap();
    let (films, n_joints) = recorded(&shared);
    let (mut errors, mut n_refused) = (Vec::new(), 0);
    for seed in 0..N_SEEDS {
        let mut random = fastrand::Rng::with_seed(seed);
        let clocks: Vec<[f64; 2]> = (0..films.len())
            .map(|camera| {
                let whole = f64::from(random.u32(0..10));
                let part = if seed % 2 == 0 && camera > 0 {
                    random.f64()
                } else {
                    0.0
                };
                let drift = if seed % 4 == 0 && camera > 0 {
                    4e-4 * (random.f64() - 0.5)
                } else {
                    0.0
                };
                [whole + part, 1.0 + drift]
            })
            .collect();
        let shifted = films.iter().zip(&clocks);
        let shifted: Vec<Film> =
            shifted.map(|(film, [first, pace])| resampled(film, *first, *pace)).collect();
        let settings = Settings {
            reference: 0,
            window_s: if seed < 15 { 2.0 } else { 10.0 },
            mirror: None,
            n_joints,
        };
        let outcome = estimate(rig.cameras(), &shifted, &settings).unwrap();
        let off_ms: Vec<f64> = outcome
            .cameras
            .iter()
            .zip(&clocks)
            .map(|(clock, [first, _])| 1e3 * (clock.offset_s - (first - clocks[0][0]) / RATE_HZ))
            .collect();
        println!("seed {seed}: off by {off_ms:.2?} ms; {:?}", outcome.doubts);
        if outcome.doubts.is_empty() {
            errors.extend(off_ms[1..].iter().map(|off_ms| off_ms.abs()));
        } else {
            n_refused += 1;
        }
    }
    errors.sort_by(f64::total_cmp);
    let (median, most) = (errors[errors.len() / 2], errors[errors.len() - 1]);
    println!("{n_refused} of {N_SEEDS} refused; errors: median {median:.2}, most {most:.2} ms");
    assert!(
        median <= 5.0 && most <= 17.0,
        "median {median}, most {most}"
    );
    assert!(n_refused <= 2, "{n_refused} refused");
}
