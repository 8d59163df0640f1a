//! Evaluation of the keypoints of a network on sequences, with and without disturbances: compares the 3D solution over the network's maps
//! with common methods.

use crate::evaluation::{
    Film, FilmSettings, Method, NetworkView, Stress, cover_half, joints_by, name_sides, parse14,
    projected,
};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use geometry::Camera;
use kernels::Rgb8View;
use keypoints::Sides;
use multiview::{SeenPerson, same_person};
use posenetwork::{Detector, JointMaps, LookMemory, Looker, MapSettings, PoseNetwork};
use skeleton::PARSE14;
use statistics::score::{Bootstrap, Point, Share, joint_errors, segment_errors, segments};
use training::datasets::sequences::{Frame, Sequence};

use super::as_run::{self, AsRun};

/// Largest error of a segment's ends for which the segment counts as found, as a fraction of its length (eq. 13 of the paper).
const GAMMA: f64 = 0.5;
/// Limit on the error of a joint, in metres. A missing joint counts as having this error.
const MOST_M: f64 = 2.0;
/// Number of joints of the limbs, which are the first of `skeleton::PARSE14`.
const N_LIMB_JOINTS: usize = 12;
/// Reprojection error above which cameras are left out, as a fraction of the picture's height. Pose2Sim's default is 15 px, at a height of
/// 1080.
const LIMIT: f64 = 15.0 / 1080.0;

/// Name of the table row for the result of `parallax run`.
const AS_RUN: &str = "as run";

/// Methods and disturbances to evaluate.
#[derive(Debug)]
pub struct EvidenceJob<'a> {
    /// The network that finds keypoints.
    pub network: &'a PoseNetwork,
    /// Detector that finds the boxes.
    pub detector: &'a Detector,
    /// Solves the undisturbed sequences as `parallax run` does, for comparison.
    pub as_run: &'a AsRun<'a>,
    /// Disturbances to add.
    pub stress: &'a [Stress],
    /// Settings of the frames.
    pub film: FilmSettings,
    /// Bootstrap that computes the confidence intervals.
    pub bootstrap: Bootstrap,
    /// Stop request.
    pub stop: Stop,
}

/// Scores of one method with one disturbance.
#[derive(Debug, Clone, Default)]
struct Tally {
    /// Percentage of segments that were found, for each frame.
    found: Vec<Share>,
    /// Errors of the joints of the limbs, in millimetres, for each frame.
    errors: Vec<Share>,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EvidenceRow {
    /// Name of the disturbance.
    pub stress: String,
    /// Name of the method.
    pub method: &'static str,
    /// Number of frames.
    pub n_frames: usize,
    /// Segments found (PCP3D), in percent.
    pub pcp3d: f64,
    /// Confidence interval of `pcp3d`.
    pub pcp3d_interval: [f64; 2],
    /// Mean error of the twelve joints of the limbs, in millimetres.
    pub limbs_mm: f64,
    /// Confidence interval of `limbs_mm`.
    pub limbs_mm_interval: [f64; 2],
    /// PCP3D of the last method of the table minus that of this row, in percentage points, with the confidence interval over the same
    /// frames.
    pub last_finds_more: [f64; 3],
    /// Mean error of this row minus that of the last method of the table, in millimetres, with its confidence interval.
    pub last_errs_less_mm: [f64; 3],
}

/// A person found by the network in a view, and the network's evidence about this person.
type Seen = (SeenPerson, NetworkView);

/// A frame before a disturbance is added.
struct Instant<'a> {
    nth: usize,
    images: Vec<Option<Rgb8View<'a>>>,
    cameras: &'a [Camera],
    /// True joints of `skeleton::PARSE14`.
    truth: Vec<Option<Point>>,
}

impl EvidenceJob<'_> {
    /// Evaluates all frames.
    ///
    /// # Errors
    ///
    /// Fails if footage cannot be read, or the network cannot be run.
    pub fn run(
        &self,
        sequences: &[Sequence],
        console: &dyn Console,
    ) -> Result<Vec<EvidenceRow>, Failure> {
        let mut tallies = vec![vec![Tally::default(); Method::ALL.len()]; self.stress.len()];
        let n_frames: usize = sequences.iter().map(|sequence| sequence.frames.len()).sum();
        console.begin("frames", "");
        let mut done = 0;
        for sequence in sequences {
            let mut film = Film::open(sequence, &self.film).or_fail(ExitKind::Input)?;
            let cameras = film.cameras();
            for (nth, frame) in sequence.frames.iter().enumerate() {
                self.stop.check("interrupted")?;
                let images = film.at(frame.index).or_fail(ExitKind::Input)?;
                let instant = Instant {
                    nth,
                    images,
                    cameras: &cameras,
                    truth: truth(sequence, frame),
                };
                self.judge(&instant, &mut tallies)?;
                done += 1;
                console.details(&sequence.name);
                console.set(done, n_frames);
            }
        }
        console.finish();
        let mut rows = self.rows(&tallies);
        if let Some(undisturbed) = self.stress.iter().position(|stress| *stress == Stress::Clean) {
            let tally = self.as_run(sequences, console)?;
            let last = tallies[undisturbed].last().unwrap_or(&tally);
            rows.push(self.row(&Stress::Clean, AS_RUN, &tally, last));
        }
        Ok(rows)
    }

    /// Solves all frames as `parallax run` does.
    fn as_run(&self, sequences: &[Sequence], console: &dyn Console) -> Result<Tally, Failure> {
        let n_frames: usize = sequences.iter().map(|sequence| sequence.frames.len()).sum();
        console.begin("frames solved as in a run", "");
        let (mut tally, mut done) = (Tally::default(), 0);
        for sequence in sequences {
            let mut film = Film::open(sequence, &self.film).or_fail(ExitKind::Input)?;
            let mut estimator = self.as_run.estimator(sequence, &film.cameras())?;
            for frame in &sequence.frames {
                self.stop.check("interrupted")?;
                let joints = as_run::joints(&mut estimator, &mut film, frame.index)?;
                tally.add(&joints, &truth(sequence, frame));
                done += 1;
                console.details(&sequence.name);
                console.set(done, n_frames);
            }
        }
        console.finish();
        Ok(tally)
    }

    fn judge(&self, instant: &Instant<'_>, tallies: &mut [Vec<Tally>]) -> Result<(), Failure> {
        let n_views = instant.cameras.len();
        let mut memory = (LookMemory::default(), Vec::new());
        let plain = (0..n_views)
            .map(|view| self.people(instant, view, None, &mut memory))
            .collect::<Result<Vec<_>, Failure>>()?;
        for (stress, tallies) in self.stress.iter().zip(tallies) {
            let mut seen = Vec::with_capacity(n_views);
            for view in stress.views(instant.nth, n_views) {
                let covers = matches!(stress, Stress::Covered(_));
                let is_hit = stress.hits(instant.nth, view, n_views);
                let people = if covers && is_hit {
                    self.people(instant, view, Some(instant.nth + view), &mut memory)?
                } else {
                    plain[view].clone()
                };
                seen.push((view, people));
            }
            let as_seen = self.network.card().keypoints.sides == Sides::Seen;
            let mut chosen = chosen(instant, seen, (*stress, as_seen));
            if as_seen {
                name_sides(&mut chosen);
            }
            let views: Vec<(&Camera, &NetworkView)> =
                chosen.iter().map(|view| (&view.0, &view.1)).collect();
            let height = instant.cameras.iter().map(|camera| camera.intrinsics.size[1]).max();
            let limit_px = LIMIT * f64::from(height.unwrap_or(0));
            for (method, tally) in Method::ALL.into_iter().zip(tallies) {
                tally.add(&joints_by(method, &views, limit_px), &instant.truth);
            }
        }
        Ok(())
    }

    /// Returns the people that the network finds in a view.
    ///
    /// * `covered`: the half of the person that is covered, if any.
    fn people(
        &self,
        instant: &Instant<'_>,
        view: usize,
        covered: Option<usize>,
        (memory, values): &mut (LookMemory, Vec<f32>),
    ) -> Result<Vec<Seen>, Failure> {
        let Some(image) = instant.images[view] else {
            return Ok(Vec::new());
        };
        let size = [image.width(), image.height()];
        let mut rgb = Vec::new();
        let image = match (covered, outline(instant, view)) {
            (Some(half), Some(outline)) => {
                rgb.extend_from_slice(image.data());
                cover_half(&mut rgb, size, outline, half);
                Rgb8View::new(size[0], size[1], &rgb).or_fail(ExitKind::Input)?
            }
            _ => image,
        };
        let looker = Looker {
            network: self.network,
            settings: &MapSettings::default(),
        };
        let boxes = self.detector.people(image, values);
        let boxes = boxes.or_fail(ExitKind::Input)?;
        let mut people = Vec::new();
        for outline in boxes.into_iter().take(MOST_PEOPLE).map(|bounds| bounds.outline) {
            let mut maps = JointMaps::default();
            let seen = looker.look((image, outline), memory, &mut maps);
            let Some(seen) = seen.or_fail(ExitKind::Input)? else {
                continue;
            };
            let look = looker.look_closer((image, seen), memory, &mut maps);
            let look = look.or_fail(ExitKind::Input)?;
            let height = (look.outline[3] - look.outline[1]) / size[1] as f64;
            let view = NetworkView::new(maps).with_front(look.front);
            people.push((view.person(height), view));
        }
        Ok(people)
    }

    fn rows(&self, tallies: &[Vec<Tally>]) -> Vec<EvidenceRow> {
        let mut rows = Vec::new();
        for (stress, tallies) in self.stress.iter().zip(tallies) {
            let Some(last) = tallies.last() else { continue };
            for (method, tally) in Method::ALL.into_iter().zip(tallies) {
                rows.push(self.row(stress, method.name(), tally, last));
            }
        }
        rows
    }

    /// * `last`: the method with which the other methods are compared.
    fn row(
        &self,
        stress: &Stress,
        method: &'static str,
        tally: &Tally,
        last: &Tally,
    ) -> EvidenceRow {
        let mean = |of: &[Share]| Share::mean(of).unwrap_or(f64::NAN);
        let interval = |of: &[Share]| self.bootstrap.interval(of).unwrap_or([f64::NAN; 2]);
        let change = |a: &[Share], b: &[Share]| {
            let each = a.iter().zip(b);
            let each: Vec<Share> = each
                .map(|(a, b)| Share {
                    sum: a.sum - b.sum,
                    n: a.n,
                })
                .collect();
            let [from, to] = interval(&each);
            [mean(&each), from, to]
        };
        EvidenceRow {
            stress: stress.to_string(),
            method,
            n_frames: tally.found.len(),
            pcp3d: mean(&tally.found),
            pcp3d_interval: interval(&tally.found),
            limbs_mm: mean(&tally.errors),
            limbs_mm_interval: interval(&tally.errors),
            last_finds_more: change(&last.found, &tally.found),
            last_errs_less_mm: change(&tally.errors, &last.errors),
        }
    }
}

/// Largest number of people in a view that the network is applied to.
const MOST_PEOPLE: usize = 4;

/// Chooses the same person in every view, and adds the disturbance. Also returns the cameras, which the disturbance may have changed.
fn chosen(
    instant: &Instant<'_>,
    seen: Vec<(usize, Vec<Seen>)>,
    (stress, as_seen): (Stress, bool),
) -> Vec<(Camera, NetworkView)> {
    let n_views = instant.cameras.len();
    let people: Vec<Vec<SeenPerson>> = seen
        .iter()
        .map(|view| view.1.iter().map(|person| person.0.clone()).collect())
        .collect();
    let each: Vec<(&Camera, &[SeenPerson])> = seen
        .iter()
        .zip(&people)
        .map(|((view, _), people)| (&instant.cameras[*view], &people[..]))
        .collect();
    let same = same_person(&each, as_seen);
    let of_view = |((view, people), who): ((usize, Vec<Seen>), Option<usize>)| {
        let (person, found) = people.into_iter().nth(who?)?;
        let camera = &instant.cameras[view];
        if !stress.hits(instant.nth, view, n_views) {
            return Some((camera.clone(), found));
        }
        let mut maps = found.maps().clone();
        match stress {
            Stress::Exchanged => maps.exchange_sides(),
            Stress::Bystander => {
                let height = person.height * f64::from(camera.intrinsics.size[1]);
                maps.shift([height / 2.0, 0.0]);
            }
            _ => {}
        }
        let view = NetworkView::new(maps).with_front(found.front());
        Some((stress.calibrated(camera), view))
    };
    seen.into_iter().zip(same).filter_map(of_view).collect()
}

/// Returns the true joints of `skeleton::PARSE14`.
fn truth(sequence: &Sequence, frame: &Frame) -> Vec<Option<Point>> {
    parse14(sequence.joints, &frame.joints)
}

/// Returns the box around the true joints in a view, in pixels of the frame.
fn outline(instant: &Instant<'_>, view: usize) -> Option<[f64; 4]> {
    let joints = projected(&instant.cameras[view], [0.0; 2], &instant.truth)?;
    let far = [f64::INFINITY, f64::NEG_INFINITY];
    let ends = [0, 1].map(|axis| {
        let each = joints.iter().map(|joint| joint[axis]);
        each.fold(far, |[from, to], it| [from.min(it), to.max(it)])
    });
    Some([ends[0][0], ends[1][0], ends[0][1], ends[1][1]])
}

impl Tally {
    fn add(&mut self, found: &[Option<Point>], truth: &[Option<Point>]) {
        let segments = segments(&PARSE14).map_or_else(Vec::new, Vec::from);
        let errors = segment_errors(&segments, found, truth);
        let hits = errors.iter().flatten();
        self.found.push(Share::of(
            hits.map(|hit| if *hit <= GAMMA { 100.0 } else { 0.0 }),
        ));
        let errors = joint_errors(found, truth);
        let limbs = errors.iter().take(N_LIMB_JOINTS).flatten();
        self.errors.push(Share::of(limbs.map(|limb| limb.min(MOST_M) * 1000.0)));
    }
}

/// Returns the table as text.
pub fn evidence_text(rows: &[EvidenceRow]) -> String {
    use core::fmt::Write as _;
    let mut text = format!(
        "{:<12} {:<16} {:>7} {:<15} {:>7} {:<15} {:<24}\n",
        "stress", "method", "PCP3D", "(95 %)", "mm", "(95 %)", "maps and bones better by"
    );
    for it in rows {
        let [gain, from, to] = it.last_errs_less_mm;
        let less = if it.method == Method::Space.name() {
            String::new()
        } else {
            format!("{gain:.1} ({from:.1} to {to:.1})")
        };
        let interval = |[from, to]: [f64; 2]| format!("({from:.1}-{to:.1})");
        // Writing to a string cannot fail.
        let _written = writeln!(
            text,
            "{:<12} {:<16} {:>7.1} {:<15} {:>7.1} {:<15} {}",
            it.stress,
            it.method,
            it.pcp3d,
            interval(it.pcp3d_interval),
            it.limbs_mm,
            interval(it.limbs_mm_interval),
            less
        );
    }
    text
}
