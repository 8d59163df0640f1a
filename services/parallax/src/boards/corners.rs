//! Tables of corners with the columns of Caliscope: `sync_index, cam_id, ..., keypoint_id, img_loc_x, img_loc_y, board_loc_x, board_loc_y`.

use core::fmt::Write as _;
use std::collections::BTreeMap;
use std::path::Path;

use calibration::board::Sight;
use failure::{ExitKind, Failure};
use nalgebra::Point2;

/// Upper limit of corner numbers.
const MOST_CORNERS: usize = 100_000;

/// Sights of all cameras, and the points of the board.
type Read = (Vec<Sight>, Vec<Point2<f64>>);

/// Corners with their numbers on the board.
type Corners = Vec<(usize, Point2<f64>)>;

/// Reads a table of corners that this or another program has found.
///
/// * `names`: the names of the cameras. A `cam_id` is one of these names, or the number at the end of a name.
/// * Returns the sights, and the points of the board in metres, indexed by their numbers. A number that does not occur has the point (0,
///   0).
///
/// # Errors
///
/// Fails if the file cannot be read, lacks a column, or has an invalid row. The message names the column or row.
pub fn read_corners(path: &Path, names: &[String]) -> Result<Read, Failure> {
    let text = failure::read_text(path)?;
    parse_corners(&text, names)
        .map_err(|error| Failure::new(ExitKind::Input, format!("{}: {error}", path.display())))
}

/// Parses the text of a table of corners, like [`read_corners`].
///
/// # Errors
///
/// Fails with a description of the mistake in the table.
pub fn parse_corners(text: &str, names: &[String]) -> Result<Read, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| error.to_string())?.clone();
    let column = |wanted: &[&str]| {
        let found = header.iter().position(|title| wanted.contains(&title.trim()));
        found.ok_or_else(|| format!("the column {} is missing", wanted[0]))
    };
    let columns = [
        column(&["sync_index", "frame"])?,
        column(&["cam_id", "port", "camera"])?,
        column(&["keypoint_id", "point_id"])?,
        column(&["img_loc_x"])?,
        column(&["img_loc_y"])?,
        column(&["board_loc_x", "obj_loc_x"])?,
        column(&["board_loc_y", "obj_loc_y"])?,
    ];
    let mut board: Vec<Point2<f64>> = Vec::new();
    let mut groups: BTreeMap<(usize, usize), Corners> = BTreeMap::new();
    for (nth, row) in reader.records().enumerate() {
        let row = row.map_err(|error| error.to_string())?;
        let cell = |which: usize| row.get(columns[which]).unwrap_or_default().trim();
        let wrong = |which: usize| format!("row {}: {:?} is not a number", nth + 2, cell(which));
        let whole = |which: usize| {
            without_fraction(cell(which))
                .parse::<usize>()
                .map_err(|_not_whole| wrong(which))
        };
        let number = |which: usize| {
            let number = cell(which).parse::<f64>().ok().filter(|value| value.is_finite());
            number.ok_or_else(|| wrong(which))
        };
        let Some(camera) = camera_named(names, cell(1)) else {
            continue;
        };
        let (frame, id) = (whole(0)?, whole(2)?);
        if id >= MOST_CORNERS {
            return Err(format!("row {}: {id} is not a corner number", nth + 2));
        }
        if board.len() <= id {
            board.resize(id + 1, Point2::origin());
        }
        board[id] = Point2::new(number(5)?, number(6)?);
        let at = Point2::new(number(3)?, number(4)?);
        groups.entry((camera, frame)).or_default().push((id, at));
    }
    if groups.is_empty() {
        return Err(format!(
            "the table has no corners of the cameras {}",
            names.join(", ")
        ));
    }
    let sights = groups
        .into_iter()
        .map(|((camera, frame), points)| Sight::new(camera, frame, points.into_iter(), &board));
    Ok((sights.collect(), board))
}

/// Removes the zero fraction of a whole number in a floating-point column: `3.0` becomes `3`.
pub(super) fn without_fraction(number: &str) -> &str {
    match number.split_once('.') {
        Some((whole, zeros)) if is_digits(whole) && zeros.bytes().all(|byte| byte == b'0') => whole,
        _ => number,
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

fn camera_named(names: &[String], id: &str) -> Option<usize> {
    let exactly = names.iter().position(|name| name == id);
    let id = without_fraction(id);
    exactly.or_else(|| {
        let number = |name: &String| {
            let before = name.trim_end_matches(|letter: char| letter.is_ascii_digit()).len();
            name[before..].to_owned()
        };
        names.iter().position(|name| number(name) == id)
    })
}

/// Writes sights as a table of corners.
///
/// # Errors
///
/// Fails if the file cannot be written.
pub fn write_corners(path: &Path, sights: &[Sight], names: &[String]) -> Result<(), Failure> {
    let text = corners_text(sights, names);
    files::replace(path, text.as_bytes()).map_err(|error| failure::in_file(path, &error))
}

/// Returns the text of a table of corners.
///
/// # Panics
///
/// Panics if the camera index of a sight has no name in `names`.
pub fn corners_text(sights: &[Sight], names: &[String]) -> String {
    let mut text =
        "sync_index,cam_id,keypoint_id,img_loc_x,img_loc_y,board_loc_x,board_loc_y\n".to_owned();
    for sight in sights {
        for ((id, at), on_board) in sight.points.iter().zip(&sight.on_board) {
            let (frame, camera) = (sight.frame, &names[sight.camera]);
            let [x, y] = [on_board.x, on_board.y];
            // Writing to a string cannot fail.
            writeln!(
                text,
                "{frame},{camera},{id},{:.4},{:.4},{x},{y}",
                at.x, at.y
            )
            .unwrap_or_default();
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_survives_a_round_trip_and_a_truncated_table_is_refused() {
        let names = ["left".to_owned(), "cam_7".to_owned()];
        let board: Vec<_> = (0..4).map(|i| Point2::new(f64::from(i) * 0.05, 0.05)).collect();
        let corners = (0..4).map(|id| (id, Point2::new(10.5 + id as f64, 20.25)));
        let sights = vec![Sight::new(1, 35, corners, &board)];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("corners.csv");
        write_corners(&path, &sights, &names).unwrap();
        assert_eq!(read_corners(&path, &names).unwrap(), (sights, board));
        let text = std::fs::read_to_string(&path).unwrap();
        parse_corners(&text.replace("cam_7", "7"), &names).unwrap();
        // Pandas writes whole numbers like this if the column has a gap.
        let floats = text.replace("35,cam_7,0,", "35.0,7.0,0.00,");
        assert_ne!(floats, text);
        let floats = parse_corners(&floats.replace("cam_7", "7.0"), &names).unwrap();
        assert_eq!(floats.0.len(), 1);
        for wrong in [
            "",
            "a,b\n",
            &text.replace("10.5", "NaN"),
            &text.replace("cam_7", "cam_8"),
        ] {
            assert!(parse_corners(wrong, &names).is_err(), "{wrong:?}");
        }
    }
}
