//! The MATLAB files of PARSE and LSP.

use formats::mat5::{ContainerError, Numbers, Value};

/// Joints of one person, and flags for visible joints.
pub type Annotation = (Vec<[f64; 2]>, Vec<bool>);

/// Reason why a MATLAB file is not an annotation.
#[derive(Debug, thiserror::Error)]
pub enum MatLayoutError {
    /// The MATLAB file cannot be read.
    #[error("not a readable MATLAB level 5 file")]
    Container(#[from] ContainerError),
    /// The variable is missing, or not an array of real numbers.
    #[error("the file contains no array of real numbers called `{variable}`")]
    Missing {
        /// Name of the variable.
        variable: &'static str,
    },
    /// The array has unexpected sizes.
    #[error("`{variable}` is {}, expected {expected}", times(.got))]
    Size {
        /// Name of the variable.
        variable: &'static str,
        /// Sizes of the array.
        got: Vec<usize>,
        /// Expected sizes.
        expected: &'static str,
    },
}

/// Reads PARSE's `labels.mat`: `ptsAll`, joints x 2 x people, in pixels from 1.
///
/// * Returns one annotation per person, in pixels counted from 0; all joints are visible.
///
/// # Errors
///
/// Fails with [`MatLayoutError`]. The values are not validated.
pub fn parse_labels(file: &[u8]) -> Result<Vec<Annotation>, MatLayoutError> {
    const NAME: &str = "ptsAll";
    with_numbers(file, NAME, |numbers| match three_sizes(numbers) {
        [n_joints, 2, n_people] if n_joints > 0 => {
            let values = numbers.values();
            let at = |joint, axis, person| values[joint + n_joints * (axis + 2 * person)];
            Ok(annotations([n_joints, n_people], |joint, person| {
                ([at(joint, 0, person), at(joint, 1, person)], true)
            }))
        }
        _ => Err(MatLayoutError::Size {
            variable: NAME,
            got: numbers.sizes().to_vec(),
            expected: "joints x 2 x people",
        }),
    })
}

/// Reads LSP's `joints.mat`: `joints`, in pixels from 1.
///
/// The original set is 3 x joints x people, with a flag that is 1 if the joint is hidden. The extended
/// set is joints x 3 x people, with a flag that is 1 if the joint is visible (Johnson & Everingham 2010, 2011).
/// An array of 3 x 3 x people is read in the original layout.
///
/// * Returns one annotation per person, in pixels counted from 0.
///
/// # Errors
///
/// Fails with [`MatLayoutError`]. The values are not validated.
pub fn parse_joints(file: &[u8]) -> Result<Vec<Annotation>, MatLayoutError> {
    const NAME: &str = "joints";
    with_numbers(file, NAME, |numbers| {
        let sizes = three_sizes(numbers);
        let values = numbers.values();
        match sizes {
            [3, n_joints, n_people] if n_joints > 0 => {
                let at = |row, joint, person| values[row + 3 * (joint + n_joints * person)];
                Ok(annotations([n_joints, n_people], |joint, person| {
                    let point = [at(0, joint, person), at(1, joint, person)];
                    (point, at(2, joint, person) == 0.0)
                }))
            }
            [n_joints, 3, n_people] if n_joints > 0 => {
                let at = |joint, column, person| values[joint + n_joints * (column + 3 * person)];
                Ok(annotations([n_joints, n_people], |joint, person| {
                    let point = [at(joint, 0, person), at(joint, 1, person)];
                    (point, at(joint, 2, person) == 1.0)
                }))
            }
            _ => Err(MatLayoutError::Size {
                variable: NAME,
                got: numbers.sizes().to_vec(),
                expected: "3 x joints x people, or joints x 3 x people",
            }),
        }
    })
}

/// Finds the variable and reads its numbers.
fn with_numbers(
    file: &[u8],
    variable: &'static str,
    read: impl Fn(&Numbers<'_>) -> Result<Vec<Annotation>, MatLayoutError>,
) -> Result<Vec<Annotation>, MatLayoutError> {
    for bytes in &formats::mat5::variables(file)? {
        let (name, value) = formats::mat5::variable(bytes)?;
        if let (true, Value::Numbers(numbers)) = (name == variable, &value) {
            return read(numbers);
        }
    }
    Err(MatLayoutError::Missing { variable })
}

/// The three sizes of the array, or zeros if there are more. MATLAB omits a last size of 1.
fn three_sizes(numbers: &Numbers<'_>) -> [usize; 3] {
    match *numbers.sizes() {
        [rows, columns] => [rows, columns, 1],
        [rows, columns, planes] => [rows, columns, planes],
        _ => [0; 3],
    }
}

fn annotations(
    [n_joints, n_people]: [usize; 2],
    read: impl Fn(usize, usize) -> ([f64; 2], bool),
) -> Vec<Annotation> {
    (0..n_people)
        .map(|person| {
            (0..n_joints)
                .map(|joint| {
                    let (point, is_visible) = read(joint, person);
                    (point.map(|value| value - 1.0), is_visible)
                })
                .unzip()
        })
        .collect()
}

fn times(sizes: &[usize]) -> String {
    let sizes: Vec<String> = sizes.iter().map(ToString::to_string).collect();
    sizes.join("x")
}
