//! The springs between joints, learned of marked people: the tree that holds the maps of a network together.

use std::path::Path;

use failure::{Console, ExitKind, Failure, OrFail as _};
use posenetwork::springs::{SpringSettings, WINDOW_CELLS, learn};
use training::datasets::SkeletonTable;

use crate::failures::dataset_failure;
use crate::judged;
use crate::person::{Chosen, deal, read_options, sides_of};

/// Fewest people: each of the types needs some of them.
const FEWEST: usize = 50;
/// Shape of the window around a person, width over height, and its size over that of the box: those of most networks.
const WINDOW: [f64; 2] = [0.75, 1.25];

/// What was learned.
#[derive(Debug)]
pub struct Learned {
    /// Data sets, and how many people of each were used.
    pub sets: Vec<(String, usize)>,
    /// Parts of the tree.
    pub n_parts: usize,
    /// Size of the file, bytes.
    pub n_bytes: usize,
}

/// Reads the marks of people, learns the springs of them and their mirror images, and writes them as a model file.
///
/// # Errors
///
/// A data set cannot be read, there are too few people, or the file cannot be written.
pub fn train(
    chosen: &Chosen,
    settings: &SpringSettings,
    out: &Path,
    console: &dyn Console,
) -> Result<Learned, Failure> {
    let table = SkeletonTable::published();
    let options = read_options(chosen, &table)?;
    let sides = deal(&chosen.datasets, "--sides", &chosen.sides, true)?;
    let (mut people, mut sets) = (Vec::new(), Vec::new());
    for ((path, options), sides) in chosen.datasets.iter().zip(&options).zip(sides) {
        let sides = sides_of(&sides)?;
        let read = training::datasets::read(path, options).map_err(dataset_failure)?;
        for problem in &read.problems {
            console.message(&format!("left out: {problem}: {}", problem.fault));
        }
        let before = people.len();
        for person in read.people {
            let person = sides.of(person, table.joint_mirror());
            people.extend(in_cells(&judged::truth(&person)));
        }
        sets.push((crate::eval::pictures::name(path), people.len() - before));
    }
    if people.len() < FEWEST {
        let message = format!("only {} people, expected {FEWEST} or more", people.len());
        return Err(Failure::new(ExitKind::Input, message));
    }
    let mirrored = people.iter().map(|it| mirrored(it, table.joint_mirror()));
    let mirrored: Vec<_> = mirrored.collect();
    people.extend(mirrored);
    let model = learn(&people, settings).or_fail(ExitKind::Input)?;
    let bytes = fmp::files::own::encode(&model).or_fail(ExitKind::Run)?;
    files::replace(out, &bytes).map_err(|error| failure::in_file(out, &error))?;
    Ok(Learned {
        sets,
        n_parts: model.n_parts(),
        n_bytes: bytes.len(),
    })
}

/// The joints of a person in a mirror: what was on the left of the picture is on the right, and of the other side of the body.
///
/// * `other_side`: the joint on the other side of the body, of every joint.
fn mirrored(joints: &[[f64; 2]; 14], other_side: &[usize]) -> [[f64; 2]; 14] {
    core::array::from_fn(|joint| {
        let [x, y] = joints[other_side[joint]];
        [-x, y]
    })
}

/// The joints of a person in cells of the window that a network sees; `None` if they have no extent.
fn in_cells(joints: &[[f64; 2]; 14]) -> Option<[[f64; 2]; 14]> {
    let [left, top, right, bottom] = posenetwork::outline_of(*joints)?;
    let [shape, margin] = WINDOW;
    let height = (bottom - top).max((right - left) / shape) * margin;
    Some(joints.map(|at| at.map(|it| it * WINDOW_CELLS / height)))
}

#[cfg(test)]
mod tests {
    use skeleton::PARSE14;

    use super::*;

    #[test]
    fn a_mirror_exchanges_left_and_right_of_picture_and_body() {
        let table = SkeletonTable::published();
        let named = |of: &str| PARSE14.joints.iter().position(|it| it.name == of).unwrap();
        let mut joints = [[0.0; 2]; 14];
        joints[named("right wrist")] = [-8.0, 3.0];
        joints[named("left wrist")] = [5.0, 1.0];
        joints[named("head")] = [1.0, -20.0];
        let image = mirrored(&joints, table.joint_mirror());
        assert_eq!(image[named("left wrist")], [8.0, 3.0]);
        assert_eq!(image[named("right wrist")], [-5.0, 1.0]);
        assert_eq!(image[named("head")], [-1.0, -20.0]);
        assert_eq!(mirrored(&image, table.joint_mirror()), joints);
    }
}
