//! Functions shared by the calibration formats: matrices, distortion lists, rotations and translations.

use std::fmt::Debug;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::{ParseError, Unit};
use crate::{Intrinsics, Lens, LensModel, rotation_from_matrix};

/// Returns an error for a number that is not finite.
pub(super) fn finite(field: &str, value: f64) -> Result<f64, ParseError> {
    if value.is_finite() {
        return Ok(value);
    }
    let requirement = "it must be a finite number";
    Err(ParseError::Value {
        field: field.to_owned(),
        value,
        requirement,
    })
}

/// Returns a whole number of pixels, even if it is written as a float.
pub(super) fn pixels(field: &str, value: f64) -> Result<u32, ParseError> {
    if value.fract() == 0.0 && (1.0..=1e6).contains(&value) {
        return Ok(value as u32);
    }
    let requirement = "it must be a whole number of pixels from 1 to 1000000";
    Err(ParseError::Value {
        field: field.to_owned(),
        value,
        requirement,
    })
}

/// Returns the unit vector along three numbers.
pub(super) fn direction(
    field: &str,
    v: [f64; 3],
) -> Result<nalgebra::UnitVector3<f64>, ParseError> {
    crate::direction(v).ok_or_else(|| ParseError::Value {
        field: field.to_owned(),
        value: Vector3::from(v).norm(),
        requirement: "the length of a direction must be positive and finite",
    })
}

/// Validates the calibration matrix K and splits it into intrinsics.
pub(super) fn intrinsics(
    field: &str,
    k: &Matrix3<f64>,
    size: [u32; 2],
    lens: LensModel,
) -> Result<Intrinsics, ParseError> {
    for &entry in k {
        finite(field, entry)?;
    }
    let place = |row: usize, column: usize| format!("{field}[{row}][{column}]");
    // Skew is not modelled. It is an error if it would move a point at the border by a hundredth of a pixel or more.
    if k[(0, 1)].abs() > 1e-5 * k[(0, 0)].abs() {
        let requirement = "skew is not supported: the skew must be 0";
        return Err(ParseError::Value {
            field: place(0, 1),
            value: k[(0, 1)],
            requirement,
        });
    }
    for (row, column, expect) in [(1, 0, 0.0), (2, 0, 0.0), (2, 1, 0.0), (2, 2, 1.0)] {
        let value = k[(row, column)];
        if value != expect {
            let requirement = "a calibration matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]";
            return Err(ParseError::Value {
                field: place(row, column),
                value,
                requirement,
            });
        }
    }
    let [fx, fy, cx, cy] = [k[(0, 0)], k[(1, 1)], k[(0, 2)], k[(1, 2)]];
    Ok(Intrinsics {
        fx,
        fy,
        cx,
        cy,
        size,
        lens: Lens::new(lens),
    })
}

/// Returns the lens model for a distortion list in `OpenCV`'s order, k1 k2 p1 p2 k3 k4 k5 k6.
pub(super) fn lens(field: &str, list: &[f64], fisheye: bool) -> Result<LensModel, ParseError> {
    for &value in list {
        finite(field, value)?;
    }
    let all_zero = list.iter().all(|&value| value == 0.0);
    if fisheye {
        return match *list {
            [k1, k2, k3, k4] => Ok(LensModel::KannalaBrandt {
                k: [k1, k2, k3, k4],
            }),
            _ => Err(ParseError::Shape {
                field: field.to_owned(),
                expected: "4 coefficients of a fisheye lens",
                found: format!("{} numbers", list.len()),
            }),
        };
    }
    // Coefficients after the eighth describe a thin prism and a tilted sensor, which are not modelled.
    let known = matches!(list.len(), 0 | 2 | 4 | 5 | 8 | 12 | 14);
    if !known || list.iter().skip(8).any(|&value| value != 0.0) {
        return Err(ParseError::Shape {
            field: field.to_owned(),
            expected: "0, 2, 4, 5 or 8 distortion coefficients (all further coefficients must be 0)",
            found: format!("{list:?}"),
        });
    }
    if all_zero {
        return Ok(LensModel::Pinhole);
    }
    let at = |i: usize| list.get(i).copied().unwrap_or(0.0);
    let k = [at(0), at(1), at(4), at(5), at(6), at(7)];
    Ok(LensModel::BrownConrady {
        k,
        p: [at(2), at(3)],
    })
}

/// Returns a distortion list of 4, 5 or 8 numbers in `OpenCV`'s order, and true if the lens is a fisheye.
pub(super) fn distortion(lens: &LensModel) -> (Vec<f64>, bool) {
    match *lens {
        LensModel::Pinhole => (vec![0.0; 4], false),
        LensModel::KannalaBrandt { k } => (k.to_vec(), true),
        LensModel::BrownConrady { k, p } => {
            let mut list = vec![k[0], k[1], p[0], p[1], k[2], k[3], k[4], k[5]];
            if k[3..] == [0.0; 3] {
                list.truncate(if k[2] == 0.0 { 4 } else { 5 });
            }
            (list, false)
        }
    }
}

/// Returns the rotation for a matrix of nine numbers.
pub(super) fn rotation(field: &str, m: &Matrix3<f64>) -> Result<UnitQuaternion<f64>, ParseError> {
    rotation_from_matrix(m).map_err(|source| ParseError::Rotation {
        field: field.to_owned(),
        source,
    })
}

/// Returns the rotation for a Rodrigues vector: its direction is the axis, and its length is the angle in radians.
pub(super) fn rodrigues(field: &str, v: [f64; 3]) -> Result<UnitQuaternion<f64>, ParseError> {
    for value in v {
        finite(field, value)?;
        if value.abs() > 1e3 {
            let requirement = "a rotation vector must be in radians";
            return Err(ParseError::Value {
                field: field.to_owned(),
                value,
                requirement,
            });
        }
    }
    Ok(UnitQuaternion::from_scaled_axis(Vector3::from(v)))
}

/// Returns the world-to-camera pose, with a translation in the file's unit.
pub(super) fn pose(
    field: &str,
    rotation: UnitQuaternion<f64>,
    translation: [f64; 3],
    unit: Unit,
) -> Result<Isometry3<f64>, ParseError> {
    for value in translation {
        finite(field, value)?;
    }
    let metres = Vector3::from(translation) / unit.per_metre();
    Ok(Isometry3::from_parts(Translation3::from(metres), rotation))
}

/// Parses numbers separated by blanks.
pub(super) fn blank_separated(text: &str) -> Result<Vec<f64>, ParseError> {
    let number = |(line, word): (usize, &str)| {
        let Ok(value) = word.parse::<f64>() else {
            return Err(ParseError::Shape {
                field: format!("line {}", line + 1),
                expected: "a number",
                found: format!("{word:?}"),
            });
        };
        finite(&format!("line {}", line + 1), value)
    };
    let words = text.lines().enumerate();
    words
        .flat_map(|(i, line)| line.split_whitespace().map(move |word| (i, word)))
        .map(number)
        .collect()
}

/// Writes numbers with the fewest digits that parse back to the same value, separated by `between`.
pub(super) fn joined(numbers: impl IntoIterator<Item = impl Debug>, between: &str) -> String {
    let words: Vec<String> = numbers.into_iter().map(|number| format!("{number:?}")).collect();
    words.join(between)
}

/// Returns the numbers of a matrix, row by row.
pub(super) fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)]))
}

/// Returns the matrix with three given rows.
pub(super) fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// Returns the matrix of nine numbers, row by row.
pub(super) fn matrix_of_nine(numbers: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_row_slice(numbers)
}
