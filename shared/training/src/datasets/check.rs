//! Validates every annotation, and reports at most one fault per person.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use footage::{FootageError, Size};
use rayon::prelude::*;

use crate::datasets::{Fault, People, Person, Problem, ReadOptions};

/// A person of a data set before validation.
#[derive(Debug)]
pub(crate) struct Row {
    /// Number of the row in the data set, from 1.
    pub(crate) number: usize,
    /// Position of the row, as text for messages.
    pub(crate) place: String,
    /// Name of the person, if given.
    pub(crate) name: Option<String>,
    /// The person, or the fault of the row.
    pub(crate) person: Result<Person, Fault>,
}

/// Minimum extent of a person, in pixels; a smaller extent is a fault.
const MIN_EXTENT_PX: f64 = 1.0;

/// Separates the valid people from those with a fault.
pub(crate) fn validate(file: &Path, rows: Vec<Row>, options: &ReadOptions) -> People {
    let mut sizes = image_sizes(&rows);
    let mut validator = Validator {
        options,
        n_joints: options.n_joints,
        names: BTreeMap::new(),
        seen: BTreeMap::new(),
    };
    let mut people = People::default();
    for entry in rows {
        let row = entry.place.clone();
        match validator.person(entry, &mut sizes) {
            Ok(person) => people.people.push(person),
            Err(fault) => people.problems.push(Problem {
                file: file.to_owned(),
                row,
                fault,
            }),
        }
    }
    people
}

type Sizes = BTreeMap<PathBuf, Result<Size, FootageError>>;

/// Decodes every image once as a check, and returns the sizes.
fn image_sizes(rows: &[Row]) -> Sizes {
    let mut images: Vec<&Path> = rows
        .iter()
        .filter_map(|row| row.person.as_ref().ok())
        .map(|person| person.image.as_path())
        .collect();
    images.sort_unstable();
    images.dedup();
    images
        .into_par_iter()
        .map(|path| {
            let size = footage::read_image(path).map(|(size, _)| size);
            (path.to_owned(), size)
        })
        .collect()
}

/// State during the validation of a data set.
struct Validator<'a> {
    options: &'a ReadOptions,
    n_joints: Option<usize>,
    names: BTreeMap<String, String>,
    seen: BTreeMap<(PathBuf, Vec<[u64; 2]>), String>,
}

impl Validator<'_> {
    fn person(&mut self, entry: Row, sizes: &mut Sizes) -> Result<Person, Fault> {
        let Row {
            place,
            name,
            person,
            ..
        } = entry;
        let mut person = person?;
        person.row = place;
        self.count(&person)?;
        self.numbers(&person)?;
        let size = match sizes.get(&person.image) {
            Some(Ok(size)) => *size,
            // Errors cannot be cloned, so an invalid image is decoded again for each further person on it.
            _ => match sizes.remove(&person.image) {
                Some(size) => size?,
                None => footage::read_image(&person.image)?.0,
            },
        };
        self.inside(&person, size)?;
        self.unique(&person, name)?;
        Ok(person)
    }

    fn count(&mut self, person: &Person) -> Result<(), Fault> {
        let got = person.joints.len();
        if self.n_joints.is_none() && got > 0 {
            self.n_joints = Some(got);
        }
        if self.n_joints == Some(got) && got > 0 {
            return Ok(());
        }
        Err(Fault::Count {
            what: "joints",
            got,
            expected: self.n_joints.unwrap_or(1),
        })
    }

    fn numbers(&self, person: &Person) -> Result<(), Fault> {
        for (joint, &at) in (1..).zip(&person.joints) {
            if at.iter().all(|value| value.is_nan()) {
                if !self.options.unknown_joints {
                    return Err(Fault::Unknown { joint });
                }
            } else if !at.iter().all(|value| value.is_finite()) {
                return Err(Fault::NotFinite { joint, at });
            }
        }
        let ends = [0, 1].map(|axis| {
            let values = person.joints.iter().map(|joint| joint[axis]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        });
        let extent_px = ends.map(|[low, high]| high - low);
        let extent_px = extent_px[0].max(extent_px[1]);
        if extent_px < MIN_EXTENT_PX {
            let at = ends.map(|[low, high]| f64::midpoint(low, high));
            return Err(Fault::ZeroSize { at, extent_px });
        }
        Ok(())
    }

    fn inside(&self, person: &Person, size: Size) -> Result<(), Fault> {
        let limit_px = self.options.outside_px;
        let beyond = |at: [f64; 2]| {
            let sides = [size.width, size.height];
            let by_axis = [0, 1].map(|axis| {
                let last = sides[axis] as f64 - 0.5;
                (-0.5 - at[axis]).max(at[axis] - last).max(0.0)
            });
            by_axis[0].max(by_axis[1])
        };
        let farthest = (1..)
            .zip(&person.joints)
            .map(|(joint, &at)| (joint, at, beyond(at)))
            .max_by(|a, b| a.2.total_cmp(&b.2));
        match farthest {
            Some((joint, at, by_px)) if by_px > limit_px => Err(Fault::Outside {
                joint,
                at,
                size,
                by_px,
                limit_px,
            }),
            _ => Ok(()),
        }
    }

    fn unique(&mut self, person: &Person, name: Option<String>) -> Result<(), Fault> {
        let bits = person.joints.iter().map(|joint| joint.map(f64::to_bits)).collect();
        match self.seen.entry((person.image.clone(), bits)) {
            Entry::Occupied(before) => {
                let before = before.get().clone();
                return Err(Fault::Twice { before });
            }
            Entry::Vacant(free) => free.insert(person.row.clone()),
        };
        let Some(name) = name else { return Ok(()) };
        match self.names.entry(name) {
            Entry::Occupied(before) => Err(Fault::SameName {
                name: before.key().clone(),
                before: before.get().clone(),
            }),
            Entry::Vacant(free) => {
                free.insert(person.row.clone());
                Ok(())
            }
        }
    }
}
