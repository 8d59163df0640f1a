//! Positions of joints relative to the parts of a model, learned on photographs of annotated people.

use std::path::Path;
use std::sync::Arc;

use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use fmp::{Model, Search};
use multiview::learned::{
    JointFile, JointsLearned, LearnedSet, Marked, best_local, mean_error, try_all,
};
use rayon::prelude::*;
use training::datasets::{Person, SkeletonTable};

use crate::failures::dataset_failure;
use crate::judged;
use crate::person::{Chosen, deal, read_options, sides_of};

/// Smallest number of people who must be found in a data set; fewer cannot be divided for cross-validation.
const FEWEST: usize = 20;

/// A learned joint map.
#[derive(Debug)]
pub struct Learned {
    /// Content of the file.
    pub file: JointFile,
    /// Settings that were tried: reach, ridge, and the cross-validation error in every data set.
    pub tried: Vec<multiview::learned::Tried>,
}

/// A data set and the people found in it.
struct Found {
    name: String,
    n_people: usize,
    people: Vec<Marked>,
}

/// Searches all people, learns their joints, and writes the file, on rayon's current pool.
///
/// * `fingerprint`: fingerprint of the model file.
///
/// # Errors
///
/// Fails if a data set or a picture cannot be read, if too few people are found, if the file cannot be written, or on a stop request
/// ([`ExitKind::Interrupted`]).
pub fn train(
    chosen: &Chosen,
    out: &Path,
    (model, fingerprint): (&Arc<Model>, u64),
    (stop, console): (&Stop, &dyn Console),
) -> Result<Learned, Failure> {
    let search = Search::new(Arc::clone(model));
    let sets = found(chosen, &search, stop, console)?;
    let people: Vec<Vec<Marked>> = sets.iter().map(|set| set.people.clone()).collect();
    let tried = try_all(&people);
    stop.check("stopped")?;
    let Some((settings, errors)) = best_local(&tried) else {
        return Err(Failure::new(ExitKind::Run, "there are no settings to try"));
    };
    let all: Vec<Vec<&Marked>> = people.iter().map(|person| person.iter().collect()).collect();
    let rows = settings.learn(&all);
    let of_set = |((set, people), after): ((&Found, &Vec<&Marked>), &f64)| LearnedSet {
        name: set.name.clone(),
        people: set.n_people as u64,
        found: set.people.len() as u64,
        error_before: rounded(mean_error(None, people).unwrap_or(0.0)),
        error_after: rounded(*after),
    };
    let learned = JointsLearned {
        reach: settings.reach,
        ridge: settings.ridge,
        sets: sets.iter().zip(&all).zip(errors).map(of_set).collect(),
    };
    let file = JointFile::new(format!("{fingerprint:016x}"), rows, learned);
    let text = file.write().or_fail(ExitKind::Run)?;
    files::replace(out, text.as_bytes()).map_err(|error| failure::in_file(out, &error))?;
    Ok(Learned { file, tried })
}

/// Reads and searches all data sets.
fn found(
    chosen: &Chosen,
    search: &Search,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Vec<Found>, Failure> {
    let table = SkeletonTable::published();
    let options = read_options(chosen, &table)?;
    let sides = deal(&chosen.datasets, "--sides", &chosen.sides, true)?;
    let mut sets = Vec::new();
    for ((path, options), sides) in chosen.datasets.iter().zip(&options).zip(sides) {
        let sides = sides_of(&sides)?;
        let read = training::datasets::read(path, options).map_err(dataset_failure)?;
        for problem in &read.problems {
            console.message(&format!("left out: {problem}: {}", problem.fault));
        }
        let people = read.people.into_iter();
        let people: Vec<Person> =
            people.map(|person| sides.of(person, table.joint_mirror())).collect();
        let marked: Result<Vec<Option<Marked>>, Failure> = people
            .par_iter()
            .map(|person| {
                stop.check("stopped")?;
                marked(search, person)
            })
            .collect();
        let set = Found {
            name: crate::eval::pictures::name(path),
            n_people: people.len(),
            people: marked?.into_iter().flatten().collect(),
        };
        let (name, n, n_found) = (&set.name, set.n_people, set.people.len());
        console.message(&format!("{name}: {n} people, {n_found} of them found"));
        if n_found < FEWEST {
            let message = format!(
                "{}: only {n_found} people were found, expected {FEWEST} or more",
                path.display()
            );
            return Err(Failure::new(ExitKind::Input, message));
        }
        sets.push(set);
    }
    Ok(sets)
}

/// Returns the best detection that covers the person, if there is one.
fn marked(search: &Search, person: &Person) -> Result<Option<Marked>, Failure> {
    let [_, on_person] = judged::find(search, person)?;
    let centres = on_person.and_then(|on_person| on_person.try_into().ok());
    Ok(centres.map(|centres| Marked {
        centres,
        joints: judged::truth(person),
    }))
}

/// Rounds a percentage to four decimals.
fn rounded(percent: f64) -> f64 {
    (percent * 1e4).round() / 1e4
}
