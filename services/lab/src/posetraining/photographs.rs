//! People in photographs, from their marked joints and a teacher.

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use kernels::Rgb8View;
use posenetwork::{JointMaps, MapSettings, PoseNetwork, Workspace};
use training::datasets::{Person as Annotated, Picture, ReadOptions, Sides, SkeletonTable};
use training::networks::pose::{
    EXTRAS, MIRROR, Marks, N_JOINTS, N_KEYPOINTS, Person, SIDE, Source, Target, exchange_sides,
};

use super::People;
use super::crop::Crop;
use crate::failures::dataset_failure;
use crate::orientation::facing;
use crate::person::{deal, read_options, sides_of};
use crate::prepared::on_threads;

/// Pairs of joints that show whether a person is seen from behind: hips and shoulders, the right one first.
const PAIRS: [[usize; 2]; 2] = [[2, 3], [8, 9]];
const NECK: usize = 12;
/// Length of the shortest trunk that is used, in pixels of the square picture.
const MIN_TRUNK: f32 = 8.0;
/// Largest enlargement, in pixels of the network's window per pixel of the picture. People who would have to be enlarged more show too
/// little detail.
const MOST_ENLARGED: f64 = 4.0;
/// Distance up to which two detections of the teacher count as the same keypoint, as a fraction of the window.
const SAME: f32 = 0.05;
/// Distance by which a joint may be outside the picture, in pixels. In manual annotations, invisible joints can be anywhere.
const ANYWHERE_PX: f64 = 1e5;

type Point = [f32; 2];

/// A keypoint that the teacher does not find.
const UNKNOWN: (Point, f32) = ([f32::NAN; 2], 0.0);

/// Returns all usable people, with their positions in the data set.
pub(super) fn people(
    people: &People,
    (stop, console): (&Stop, &dyn Console),
) -> Result<Vec<(usize, Person)>, Failure> {
    let chosen = &people.photographs;
    let table = SkeletonTable::published();
    let options = read_options(chosen, &table)?;
    let sides = deal(&chosen.datasets, "--sides", &chosen.sides, true)?;
    let mut all = Vec::new();
    for ((path, options), sides) in chosen.datasets.iter().zip(options).zip(sides) {
        let sides = sides_of(&sides)?;
        let options = ReadOptions {
            outside_px: ANYWHERE_PX,
            ..options
        };
        let read = training::datasets::read(path, &options).map_err(dataset_failure)?;
        for problem in &read.problems {
            let cause = &problem.fault;
            console.message(&format!("left out: {problem}: {cause}"));
        }
        let n = read.people.len();
        console.begin(&crate::eval::pictures::name(path), "people");
        console.set(0, n);
        let task = "prepares the images of people";
        let found = on_threads(&read.people, &people.teachers, task, |person, teachers| {
            stop.check("stopped")?;
            let found = of_person(person, sides, teachers.map_or(&[], Vec::as_slice))?;
            console.advance(1);
            Ok(found)
        });
        console.finish();
        let before = all.len();
        let found = found?.into_iter().enumerate();
        all.extend(found.filter_map(|(nth, person)| Some((nth, person?))));
        let used = all.len() - before;
        console.message(&format!(
            "{}: {used} of {n} people can be used",
            crate::eval::pictures::name(path)
        ));
    }
    Ok(all)
}

/// Returns a person; `None` if the trunk is unknown or the person is too small.
fn of_person(
    person: &Annotated,
    sides: Sides,
    teachers: &[PoseNetwork],
) -> Result<Option<Person>, Failure> {
    let joints = visible(person);
    let lean = lean(&joints);
    if !lean.is_finite() {
        return Ok(None);
    }
    let (Some(upright), Some(crop)) = (Crop::around(&joints, -lean), Crop::around(&joints, 0.0))
    else {
        return Ok(None);
    };
    let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
    let marked = joints.map(|at| upright.inside(at).map(|value| value as f32));
    let trunk = length(trunk(&marked));
    if !trunk.is_finite() || trunk < MIN_TRUNK || upright.enlarges() > MOST_ENLARGED {
        return Ok(None);
    }
    let rgb = upright.rgb(picture.view());
    let mut taught = teachers.iter().map(|teacher| taught(teacher, &rgb, &marked));
    let first = taught.next().transpose()?;
    let mut of_all = [[f32::NAN; 2]; N_KEYPOINTS];
    of_all[..N_JOINTS].copy_from_slice(&marked);
    let mut marks = Marks {
        marked: of_all,
        taught: first.unwrap_or([UNKNOWN; N_KEYPOINTS]),
        trunk,
    };
    marks.mend_sides();
    for other in taught {
        marks.add_extras(&other?);
    }
    let Some(across) = across(&marks) else {
        return Ok(None);
    };
    let front = match sides {
        Sides::Marked => front(&marks, across, lean as f32),
        Sides::Seen => [0.0; 3],
    };
    if across < 0.0 {
        marks.exchange();
    }
    let back = |at: Point| {
        let at = crop.inside(upright.outside(at.map(f64::from)));
        at.map(|at| at as f32)
    };
    let targets = marks.targets().map(|target| Target {
        at: back(target.at),
        or: target.or.map(back),
        ..target
    });
    Ok(Some(Person {
        source: Source::Photograph,
        name: format!("{}, {}", person.image.display(), person.row),
        rgb: crop.rgb(picture.view()),
        targets,
        front,
    }))
}

/// Returns the joints that are marked as visible; all other joints are not finite.
fn visible(person: &Annotated) -> [[f64; 2]; N_JOINTS] {
    core::array::from_fn(|joint| {
        let is_visible = person.visible.get(joint).is_some_and(|visible| *visible);
        let at = person.joints.get(joint).filter(|_| is_visible);
        at.copied().unwrap_or([f64::NAN; 2])
    })
}

/// Returns the direction in which a person faces, from the marks in the upright picture; 0 if this direction contradicts the order of left
/// and right at the hips and shoulders.
fn front(marks: &Marks, across: f32, lean: f32) -> [f32; 3] {
    let marked = |joint: usize| marks.marked[joint].map(f64::from);
    let joints: [[f64; 2]; N_JOINTS] = core::array::from_fn(marked);
    let [aside, towards] = facing(&joints);
    if (towards > 0.0) == (across > 0.0) {
        in_picture([aside, towards], lean)
    } else {
        [0.0; 3]
    }
}

/// Converts a direction relative to an upright trunk to a direction in the picture, in which the trunk leans.
fn in_picture([aside, towards]: [f32; 2], lean: f32) -> [f32; 3] {
    let aside = if aside.is_finite() { aside } else { 0.0 };
    let towards = if towards.is_finite() { towards } else { 0.0 };
    [aside * lean.cos(), aside * lean.sin(), towards]
}

/// Returns the angle of the trunk from upright, clockwise, in radians.
fn lean(joints: &[[f64; 2]; N_JOINTS]) -> f64 {
    let [right, left] = PAIRS[0].map(|pair| joints[pair]);
    let shoulders = PAIRS[1].map(|pair| joints[pair]);
    let neck = if joints[NECK][0].is_finite() {
        joints[NECK]
    } else {
        [0, 1].map(|axis| f64::midpoint(shoulders[0][axis], shoulders[1][axis]))
    };
    let [x, y] = [0, 1].map(|axis| neck[axis] - f64::midpoint(right[axis], left[axis]));
    x.atan2(-y)
}

fn trunk(joints: &[Point; N_JOINTS]) -> Point {
    let [right, left] = PAIRS[0].map(|pair| joints[pair]);
    let shoulders = PAIRS[1].map(|pair| joints[pair]);
    let neck = if joints[NECK][0].is_finite() {
        joints[NECK]
    } else {
        [0, 1].map(|axis| f32::midpoint(shoulders[0][axis], shoulders[1][axis]))
    };
    [0, 1].map(|axis| neck[axis] - f32::midpoint(right[axis], left[axis]))
}

fn length([x, y]: Point) -> f32 {
    x.hypot(y)
}

/// Returns the mean distance by which the left hip and shoulder are to the right of the right hip and shoulder, in the upright picture. The
/// distance is negative for a person seen from behind. Joints without a mark are taken from the teacher. Returns `None` if the teacher does
/// not have them either.
fn across(marks: &Marks) -> Option<f32> {
    let widths = PAIRS.iter().filter_map(|[right, left]| {
        let is_marked = [right, left].iter().all(|joint| marks.marked[**joint][0].is_finite());
        let x = |joint: usize| {
            if is_marked {
                marks.marked[joint][0]
            } else {
                marks.taught[joint].0[0]
            }
        };
        let width = x(*left) - x(*right);
        width.is_finite().then_some(width)
    });
    let widths: Vec<f32> = widths.collect();
    (!widths.is_empty()).then(|| widths.iter().sum::<f32>() / widths.len() as f32)
}

/// Returns the keypoints that the teacher finds in the upright picture, merged with those of its mirror image.
fn taught(
    teacher: &PoseNetwork,
    rgb: &[u8],
    marked: &[Point; N_JOINTS],
) -> Result<[(Point, f32); N_KEYPOINTS], Failure> {
    let last = (SIDE - 1) as f64;
    let known = marked.iter().filter(|marked| marked[0].is_finite()).map(|at| at.map(f64::from));
    let Some([left, top, right, bottom]) = posenetwork::outline_of(known) else {
        return Ok([UNKNOWN; N_KEYPOINTS]);
    };
    let plain = find(teacher, rgb, [left, top, right, bottom])?;
    let rows = rgb.chunks_exact(3 * SIDE);
    let mirrored: Vec<u8> =
        rows.flat_map(|row| row.chunks_exact(3).rev().flatten().copied()).collect();
    let other = find(teacher, &mirrored, [last - right, top, last - left, bottom])?;
    let other = exchange_sides(&other).map(|([x, y], score)| ([last as f32 - x, y], score));
    let near = SAME * SIDE as f32;
    Ok(core::array::from_fn(|joint| {
        let [(a, of_a), (b, of_b)] = [plain[joint], other[joint]];
        let off = length([a[0] - b[0], a[1] - b[1]]);
        if off < near {
            let at = [0, 1].map(|axis| f32::midpoint(a[axis], b[axis]));
            (at, f32::midpoint(of_a, of_b))
        } else if of_a >= of_b {
            (a, 0.5 * of_a)
        } else {
            (b, 0.5 * of_b)
        }
    }))
}

fn find(
    teacher: &PoseNetwork,
    rgb: &[u8],
    outline: [f64; 4],
) -> Result<[(Point, f32); N_KEYPOINTS], Failure> {
    let picture = Rgb8View::new(SIDE, SIDE, rgb).or_fail(ExitKind::Run)?;
    let mut workspace = Workspace::default();
    let sight = teacher.look(picture, outline, &mut workspace);
    let Some(sight) = sight.or_fail(ExitKind::Input)? else {
        return Ok([UNKNOWN; N_KEYPOINTS]);
    };
    let mut maps = JointMaps::default();
    maps.read(&sight, &MapSettings::default()).or_fail(ExitKind::Input)?;
    Ok(core::array::from_fn(|keypoint| {
        let peak = match keypoint.checked_sub(N_JOINTS) {
            None => maps.peaks().get(keypoint).copied().flatten(),
            Some(extra) => {
                let mut names = teacher.names().iter();
                let at = names.position(|name| name == EXTRAS[extra]);
                let found = at.and_then(|at| maps.keypoint(at));
                found.map(|(keypoint, _)| keypoint)
            }
        };
        peak.map_or(UNKNOWN, |peak| {
            (peak.at.map(|at| at as f32), peak.score as f32)
        })
    }))
}

/// The pairs of joints must be left-right pairs of the mirror image.
const _: () = {
    assert!(MIRROR[PAIRS[0][0]] == PAIRS[0][1], "hips");
    assert!(MIRROR[PAIRS[1][0]] == PAIRS[1][1], "shoulders");
};
