//! Tables: CSV with a row for each frame (wide), or for each point of each frame (long).

use std::io;

use crate::sink::{Notes, Sink};
use crate::{Point, Trial};

/// Columns of the long table: those of `pose3d.csv`, and the standard deviation.
const LONG: [&str; 17] = [
    "frame",
    "time_s",
    "person",
    "joint",
    "x_m",
    "y_m",
    "z_m",
    "sd_m",
    "cov_xx_m2",
    "cov_xy_m2",
    "cov_xz_m2",
    "cov_yy_m2",
    "cov_yz_m2",
    "cov_zz_m2",
    "reprojection_px",
    "views",
    "status",
];

/// Returns the shortest text that still represents the same number; empty if there is none.
fn cell(number: Option<f64>) -> String {
    let number = number.filter(|number| number.is_finite());
    number.map_or(String::new(), |number| number.to_string())
}

fn place(point: Option<&Point>) -> [String; 4] {
    let axis = |axis: usize| cell(point.map(|point| point.in_world[axis]));
    let deviation = cell(point.and_then(Point::deviation_m));
    [axis(0), axis(1), axis(2), deviation]
}

/// Writes a row for each frame, with four columns for each point.
pub(crate) fn wide(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    let mut table = csv::Writer::from_writer(out);
    let mut head = ["frame", "time_s", "person", "status"].map(str::to_owned).to_vec();
    for name in trial.labels() {
        head.extend(["x_m", "y_m", "z_m", "sd_m"].map(|column| format!("{name}_{column}")));
    }
    table.write_record(&head)?;
    for slot in 0..trial.slots.len() {
        let mut row = vec![
            trial.frame(slot).to_string(),
            cell(trial.time_s(slot)),
            person(trial, slot),
            status(trial, slot).to_owned(),
        ];
        row.extend(trial.points(slot).flat_map(place));
        table.write_record(&row)?;
    }
    table.flush()?;
    Ok(Notes::new())
}

/// Writes a row for each point of each frame.
pub(crate) fn long(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    let mut table = csv::Writer::from_writer(out);
    table.write_record(LONG)?;
    let names: Vec<&str> = trial.names().collect();
    for slot in 0..trial.slots.len() {
        let [frame, time_s] = [trial.frame(slot).to_string(), cell(trial.time_s(slot))];
        let person = person(trial, slot);
        for (nth, name) in names.iter().enumerate() {
            let point = trial.point(slot, nth);
            let mut row = vec![
                frame.clone(),
                time_s.clone(),
                person.clone(),
                (*name).to_owned(),
            ];
            row.extend(place(point));
            row.extend((0..6).map(|i| cell(point.map(|point| point.covariance[i]))));
            row.push(cell(point.and_then(|point| point.reprojection_px)));
            row.push(point.map_or(String::new(), |point| views(trial, point)));
            row.push(state(trial, slot, nth).to_owned());
            table.write_record(&row)?;
        }
    }
    table.flush()?;
    Ok(Notes::new())
}

/// Returns the id of the person; empty if it is not known.
fn person(trial: &Trial, slot: usize) -> String {
    let id = trial.id_at(slot);
    id.map_or(String::new(), |id| id.to_string())
}

/// Returns the status of a frame.
fn status(trial: &Trial, slot: usize) -> &str {
    let status = &trial.slots[slot].status;
    if status.is_empty() { "no line" } else { status }
}

/// Returns the state of a point: `ok`, `filled`, or the reason why it has no position.
pub(crate) fn state(trial: &Trial, slot: usize, point: usize) -> &str {
    match trial.slots[slot].points.get(point) {
        Some(Ok(point)) if point.is_filled => "filled",
        Some(Ok(_)) => "ok",
        Some(Err(gap)) if !gap.0.is_empty() => &gap.0,
        _ => status(trial, slot),
    }
}

/// Returns the views from which a point was triangulated.
pub(crate) fn views(trial: &Trial, point: &Point) -> String {
    let named = trial.views.iter().enumerate();
    let seen = named.filter(|named| named.0 < 32 && point.views >> named.0 & 1 == 1);
    seen.map(|view| view.1.as_str()).collect::<Vec<_>>().join("+")
}
