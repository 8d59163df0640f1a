//! Reading of data sets of all supported layouts.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::datasets::check::{Row, validate};
use crate::datasets::mat_files::Annotation;
use crate::datasets::{
    MatLayoutError, People, Person, Problem, ReadOptions, SelectError, Selection, parse_joints,
    parse_labels, parse_line,
};

/// Reason why a data set cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The layout is unknown.
    #[error(
        "{} is not a data set: expected a folder with labels.mat (PARSE) or joints.mat (LSP), one of these files, or a \
         file of JSON lines",
        path.display()
    )]
    Unrecognised {
        /// The folder or file.
        path: PathBuf,
    },
    /// The folder has files of two layouts.
    #[error("{} contains both labels.mat and joints.mat: give the path of one of them", path.display())]
    Ambiguous {
        /// The folder.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The MATLAB file is not an annotation.
    #[error("{} cannot be read", path.display())]
    Mat {
        /// The file.
        path: PathBuf,
        /// Error of the file's layout.
        source: MatLayoutError,
    },
    /// The number of images in the list differs from the number of people in the data set.
    #[error("{} lists {got} images for {expected} people", path.display())]
    ImageList {
        /// Path of the list.
        path: PathBuf,
        /// Number of images in the list.
        got: usize,
        /// Number of people.
        expected: usize,
    },
    /// The selection is invalid.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// People have a fault of a fatal kind.
    #[error("{n_fatal} of {n_people} people have a fault of a fatal kind")]
    Fatal {
        /// Number of people with a fault of a fatal kind.
        n_fatal: usize,
        /// Number of people in the data set.
        n_people: usize,
        /// The first fault.
        #[source]
        first: Box<Problem>,
    },
}

/// Reads and validates a data set.
///
/// The layout is detected from the files:
/// * PARSE: `labels.mat`, images `im0001.jpg`... beside it (Ramanan 2006);
/// * LSP: `joints.mat`, and images in `images/`. Their names are `im0001.jpg`... or `im00001.jpg`..., or are listed in
///   `images.txt` beside it, one per person (Johnson & Everingham 2010, 2011);
/// * Parallax: a file of JSON lines.
///
/// All images of the selected people are decoded once, to check them. The result
/// does not depend on the number of threads.
///
/// * `path`: the folder, or the annotation file in it.
///
/// # Errors
///
/// Fails with [`DatasetError`]. A person with a fault is listed in [`People::problems`]. The fault is an error only if its kind is
/// in [`ReadOptions::fatal`].
pub fn read(path: &Path, options: &ReadOptions) -> Result<People, DatasetError> {
    let file = annotation_file(path)?;
    let bytes = fs::read(&file).map_err(|source| DatasetError::Io {
        path: file.clone(),
        source,
    })?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let mat = |parsed: Result<_, _>| {
        parsed.map_err(|source| DatasetError::Mat {
            path: file.clone(),
            source,
        })
    };
    let mut rows = if is_called(&file, LABELS) {
        let people = mat(parse_labels(&bytes))?;
        with_images(people, |_| Ok(numbered_images(folder, &[4])))?
    } else if is_called(&file, JOINTS) {
        let people = mat(parse_joints(&bytes))?;
        with_images(people, |n_people| lsp_images(folder, n_people))?
    } else {
        rows_of_lines(&bytes, folder)
    };
    select(&file, &mut rows, options)?;
    let n_people = rows.len();
    let mut people = validate(&file, rows, options);
    let is_fatal = |problem: &Problem| options.fatal.contains(&problem.fault.kind());
    let n_fatal = people.problems.iter().filter(|problem| is_fatal(problem)).count();
    match people.problems.iter().position(is_fatal) {
        None => Ok(people),
        Some(first) => Err(DatasetError::Fatal {
            n_fatal,
            n_people,
            first: Box::new(people.problems.swap_remove(first)),
        }),
    }
}

const LABELS: &str = "labels.mat";
const JOINTS: &str = "joints.mat";

/// Returns the path of a person's image. People are numbered from 0.
type ImageOf = Box<dyn Fn(usize) -> PathBuf>;

fn is_called(file: &Path, name: &str) -> bool {
    file.file_name().is_some_and(|file_name| file_name == name)
}

/// Finds the file with the annotations: `path` itself or, if it is a folder, the file in it with a known name.
fn annotation_file(path: &Path) -> Result<PathBuf, DatasetError> {
    let unrecognised = || DatasetError::Unrecognised {
        path: path.to_owned(),
    };
    if path.is_dir() {
        return match [LABELS, JOINTS].map(|file| path.join(file).is_file()) {
            [true, false] => Ok(path.join(LABELS)),
            [false, true] => Ok(path.join(JOINTS)),
            [true, true] => Err(DatasetError::Ambiguous {
                path: path.to_owned(),
            }),
            [false, false] => Err(unrecognised()),
        };
    }
    let has_known_name = is_called(path, LABELS) || is_called(path, JOINTS);
    let has_lines = path
        .extension()
        .is_some_and(|extension| extension == "jsonl" || extension == "json");
    if has_known_name || has_lines {
        Ok(path.to_owned())
    } else {
        Err(unrecognised())
    }
}

fn with_images(
    people: Vec<Annotation>,
    images: impl FnOnce(usize) -> Result<ImageOf, DatasetError>,
) -> Result<Vec<Row>, DatasetError> {
    let image_of = images(people.len())?;
    let row = |(person, (joints, visible))| Row {
        number: person + 1,
        place: format!("person {}", person + 1),
        name: None,
        person: Ok(Person {
            image: image_of(person),
            row: String::new(),
            joints,
            visible,
        }),
    };
    Ok(people.into_iter().enumerate().map(row).collect())
}

/// Paths of numbered images, from 1. The number of digits is the first one for which a file exists.
fn numbered_images(folder: &Path, digits: &[usize]) -> ImageOf {
    let names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    let is_used = |n_digits: usize, ending: &str| {
        names.iter().any(|name| {
            let number = name.strip_prefix("im").and_then(|rest| rest.strip_suffix(ending));
            number.is_some_and(|digits| {
                digits.len() == n_digits && digits.bytes().all(|byte| byte.is_ascii_digit())
            })
        })
    };
    let shapes = [".jpg", ".png"]
        .into_iter()
        .flat_map(|ending| digits.iter().map(move |&digit| (digit, ending)));
    let default = (digits.first().copied().unwrap_or(4), ".jpg");
    let used = shapes.clone().find(|&(it, ending)| is_used(it, ending));
    let (n_digits, ending) = used.unwrap_or(default);
    let folder = folder.to_owned();
    Box::new(move |person| folder.join(format!("im{:0n_digits$}{ending}", person + 1)))
}

fn lsp_images(folder: &Path, n_people: usize) -> Result<ImageOf, DatasetError> {
    let path = folder.join("images.txt");
    let images = folder.join("images");
    let list = match fs::read_to_string(&path) {
        Ok(list) => list,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Ok(numbered_images(&images, &[5, 4]));
        }
        Err(source) => return Err(DatasetError::Io { path, source }),
    };
    let names: Vec<PathBuf> = list
        .lines()
        .map(str::trim)
        .filter(|name| !name.is_empty())
        .map(|name| images.join(name))
        .collect();
    if names.len() != n_people {
        return Err(DatasetError::ImageList {
            path,
            got: names.len(),
            expected: n_people,
        });
    }
    Ok(Box::new(move |person| names[person].clone()))
}

fn rows_of_lines(bytes: &[u8], folder: &Path) -> Vec<Row> {
    let text = String::from_utf8_lossy(bytes);
    (1..)
        .zip(text.lines())
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(number, line)| {
            let parsed = parse_line(line);
            let mut name = None;
            let person = parsed.map(|(mut person, its_name)| {
                person.image = folder.join(person.image);
                name = its_name;
                person
            });
            Row {
                number,
                place: format!("line {number}"),
                name,
                person,
            }
        })
        .collect()
}

/// Keeps the selected rows.
fn select(file: &Path, rows: &mut Vec<Row>, options: &ReadOptions) -> Result<(), SelectError> {
    let image = |row: &Row| match &row.person {
        Ok(person) => person.image.clone(),
        Err(_) => PathBuf::new(),
    };
    let selections = [&options.only, &options.without];
    if selections.iter().all(|selection| selection.is_none()) {
        return Ok(());
    }
    let people: BTreeMap<usize, PathBuf> =
        rows.iter().map(|row| (row.number, image(row))).collect();
    for selection in selections.into_iter().flatten() {
        selection.check(file, &people)?;
    }
    rows.retain(|row| {
        let is_in = |selection: &Selection| selection.contains(row.number, &people[&row.number]);
        options.only.as_ref().is_none_or(is_in) && !options.without.as_ref().is_some_and(is_in)
    });
    Ok(())
}
