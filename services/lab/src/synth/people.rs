//! Annotations of the people in the pictures.

use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _};
use training::datasets::Person;

use super::files;

/// Annotated people: the person, the name, and whether the person is seen from behind.
#[derive(Debug, Default)]
pub(super) struct People(Vec<(Person, String, bool)>);

/// Index of the same joint on the other side of the body, in the order of `skeleton::PARSE14`.
const MIRROR: [usize; 14] = [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13];

impl People {
    /// Adds a person.
    pub(super) fn add(&mut self, person: Person, name: String, is_from_behind: bool) {
        self.0.push((person, name, is_from_behind));
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Adds the people of a sequence, whose files are in the folder of this name.
    pub(super) fn append(&mut self, folder: &str, others: Self) {
        self.0.extend(others.0.into_iter().map(|(mut person, name, behind)| {
            person.image = Path::new(folder).join(&person.image);
            (person, name, behind)
        }));
    }

    /// Writes both files of annotations; no files if there are no people.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Failure> {
        if self.0.is_empty() {
            return Ok(());
        }
        let (mut anatomical, mut as_seen) = (String::new(), String::new());
        for (person, name, behind) in &self.0 {
            let line = training::datasets::to_line(person, Some(name)).or_fail(ExitKind::Run)?;
            anatomical += &(line.clone() + "\n");
            let line = if *behind {
                let mirrored = Person {
                    joints: MIRROR.map(|mirror| person.joints[mirror]).to_vec(),
                    visible: MIRROR.map(|mirror| person.visible[mirror]).to_vec(),
                    ..person.clone()
                };
                training::datasets::to_line(&mirrored, Some(name)).or_fail(ExitKind::Run)?
            } else {
                line
            };
            as_seen += &(line + "\n");
        }
        files::text(&folder.join("people.jsonl"), &anatomical)?;
        files::text(&folder.join("people-as-seen.jsonl"), &as_seen)
    }
}
