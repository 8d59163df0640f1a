//! The people that a view sees with the network method, and their maps.

use messages::{EvidenceHeader, GridMessage, MAX_CANDIDATES, NO_COLOUR, Sightings, Status};
use pipeline::{ExtraKeypoint, Sighting, ViewSightings};
use posenetwork::{MapGrid, MapKind, MapSettings, PersonMaps};

use crate::error::{count, equal, finite};
use crate::{
    WireError, extras_from_message, extras_to_message, front_from_message, front_to_message,
    skew_from_message,
};

/// Maximum distance of a position from the first pixel, in pixels.
const MOST_PX: f64 = 1e6;
/// Maximum time since the network last ran on a person, in seconds.
const MOST_AGE_S: f32 = 60.0;
/// Maximum number of columns or rows of a map.
const MOST_CELLS: u32 = 1 << 16;

/// Writes the people that a view sees, and the image size `[width, height]`. The caller fills in stamp and timing.
///
/// If there are no people, the status is [`Status::NO_DETECTION`].
///
/// * `n_extras`: number of extra keypoints of a person.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more people or keypoints than fit, or if a number is not finite.
pub fn sightings_to_message(
    people: &[Sighting],
    n_extras: usize,
    image_size: [usize; 2],
) -> Result<Sightings, WireError> {
    let n = count("n_candidates", people.len(), MAX_CANDIDATES)?;
    let mut message = Sightings {
        status: if n == 0 {
            Status::NO_DETECTION
        } else {
            Status::OK
        },
        n_candidates: n as u32,
        width: image_size[0] as u32,
        height: image_size[1] as u32,
        ..Sightings::default()
    };
    for (nth, person) in people.iter().enumerate() {
        message.candidates[nth].score = person.score;
        message.colours[nth] = person.colour.unwrap_or(NO_COLOUR);
        message.ages_s[nth] = person.age_s;
        message.heats[nth][..person.heats.len()].copy_from_slice(&person.heats);
        for (slot, at) in message.joints[nth].iter_mut().zip(&person.joints) {
            *slot = at.unwrap_or_default();
        }
    }
    let fronts: Vec<[f32; 2]> = people.iter().map(|person| person.front).collect();
    front_to_message(&mut message, &fronts)?;
    let extras: Vec<ExtraKeypoint> =
        people.iter().flat_map(|person| person.extras.clone()).collect();
    extras_to_message(&mut message, n_extras, &extras)?;
    Ok(message)
}

/// Reads the people that a view sees; `None` unless the status is [`Status::OK`] and there is a person.
///
/// * `n_extras`: number of extra keypoints of a person. The last people in the list may have no extra keypoints, because the room in a
///   message is limited.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more people than fit, or if a number or the time of the picture is impossible.
pub fn sightings_from_message(
    message: &Sightings,
    n_extras: usize,
) -> Result<Option<ViewSightings>, WireError> {
    if message.status != Status::OK {
        return Ok(None);
    }
    let n = message.n_candidates as usize;
    let n = count("n_candidates", n, MAX_CANDIDATES)?;
    let fronts = front_from_message(message, n)?;
    let extras = extras_from_message(message, n_extras, n)?;
    let mut extras = extras.chunks_exact(n_extras.max(1));
    let mut people = Vec::with_capacity(n);
    for (nth, front) in fronts.into_iter().enumerate() {
        finite("score", nth, f64::from(message.candidates[nth].score))?;
        let mut person = Sighting {
            joints: Default::default(),
            heats: Default::default(),
            score: message.candidates[nth].score,
            front,
            extras: extras.next().unwrap_or_default().to_vec(),
            colour: colour_from_message(message, nth)?,
            age_s: age_from_message(message, nth)?,
        };
        for joint in 0..person.joints.len() {
            let heat = message.heats[nth][joint];
            if !(0.0..=1.0).contains(&heat) {
                return Err(refused("heats", nth, f64::from(heat), "0 to 1"));
            }
            if heat > 0.0 {
                let at = message.joints[nth][joint];
                if let Some(far) = at.into_iter().find(|side| !is_place(f64::from(*side))) {
                    return Err(refused("joints", nth, f64::from(far), "a place in pixels"));
                }
                (person.joints[joint], person.heats[joint]) = (Some(at), heat);
            }
        }
        people.push(person);
    }
    let skew_s = skew_from_message(message)?;
    Ok((n > 0).then_some(ViewSightings { people, skew_s }))
}

/// Reads the colour of a person's trunk.
fn colour_from_message(message: &Sightings, nth: usize) -> Result<Option<[f32; 3]>, WireError> {
    let colour = message.colours[nth];
    if colour.map(f32::to_bits) == NO_COLOUR.map(f32::to_bits) {
        return Ok(None);
    }
    match colour.into_iter().find(|value| !(0.0..=1.0).contains(value)) {
        Some(value) => Err(refused("colours", nth, f64::from(value), "0 to 1")),
        None => Ok(Some(colour)),
    }
}

/// Reads the time since the network last ran on a person.
fn age_from_message(message: &Sightings, nth: usize) -> Result<f32, WireError> {
    let age_s = message.ages_s[nth];
    if (0.0..=MOST_AGE_S).contains(&age_s) {
        return Ok(age_s);
    }
    Err(refused("ages_s", nth, f64::from(age_s), "0 to 60 s"))
}

/// Writes the grids of the maps of the people in a view. The caller fills in stamp and timing, and sends the map values one person after
/// the other.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more people than fit.
pub fn maps_to_message(
    people: &[MapGrid],
    image_size: [usize; 2],
) -> Result<EvidenceHeader, WireError> {
    let n_people = count("n_people", people.len(), MAX_CANDIDATES)?;
    let mut message = EvidenceHeader {
        width: image_size[0] as u32,
        height: image_size[1] as u32,
        status: Status::OK,
        n_people: n_people as u32,
        ..EvidenceHeader::default()
    };
    for (slot, grid) in message.people.iter_mut().zip(people) {
        *slot = GridMessage {
            first_px: grid.first_px,
            cell_px: grid.cell_px,
            size: grid.size.map(|side| side as u32),
            kind: match grid.kind {
                MapKind::Cells => 0,
                MapKind::Peaks => 1,
            },
            padding: 0,
        };
    }
    Ok(message)
}

/// Reads the maps that were sent with `message`, without copying them.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more people than fit, or if a grid is not valid. It also returns an error if the number of values
/// differs from the number of cells, or if a value is not finite.
pub fn maps_from_message<'a>(
    message: &EvidenceHeader,
    values: &'a [f32],
) -> Result<Vec<PersonMaps<'a>>, WireError> {
    let grids = grids_from_message(message)?;
    equal("values", values.len(), n_values(&grids))?;
    check_maps(values)?;
    let floor = MapSettings::default().floor();
    let mut left = values;
    let mut maps = Vec::with_capacity(grids.len());
    for grid in grids {
        let (own, others) = left.split_at(grid.n_values());
        left = others;
        let own = PersonMaps::new(grid, own, floor);
        check_peaks(&own)?;
        maps.push(own);
    }
    Ok(maps)
}

/// Reads the grids of the maps of the people of a view.
///
/// # Errors
///
/// Returns a [`WireError`] if there are more people than fit, or if a grid is not valid.
pub fn grids_from_message(message: &EvidenceHeader) -> Result<Vec<MapGrid>, WireError> {
    let n = count("n_people", message.n_people as usize, MAX_CANDIDATES)?;
    let people = message.people[..n].iter().enumerate();
    let grid = |(nth, grid): (usize, &GridMessage)| {
        if let Some(side) = grid.size.into_iter().find(|side| !(1..=MOST_CELLS).contains(side)) {
            return Err(refused("grid.size", nth, f64::from(side), "1 to 65536"));
        }
        if let Some(far) = grid.first_px.into_iter().find(|side| !is_place(*side)) {
            return Err(refused("grid.first_px", nth, far, "a place in pixels"));
        }
        if let Some(step) = grid.cell_px.into_iter().find(|step| !(*step > 0.0 && is_place(*step)))
        {
            return Err(refused("grid.cell_px", nth, step, "pixels above 0"));
        }
        let kind = match grid.kind {
            0 => MapKind::Cells,
            1 => MapKind::Peaks,
            other => return Err(refused("grid.kind", nth, f64::from(other), "0 or 1")),
        };
        Ok(MapGrid {
            kind,
            first_px: grid.first_px,
            cell_px: grid.cell_px,
            size: grid.size.map(|side| side as usize),
        })
    };
    people.map(grid).collect()
}

/// Returns the number of values of the maps of several people.
pub fn n_values(grids: &[MapGrid]) -> usize {
    let each = grids.iter().map(MapGrid::n_values);
    each.fold(0, usize::saturating_add)
}

/// Checks that received values are finite, because a single value that is not finite could affect every sum over the maps.
fn check_maps(values: &[f32]) -> Result<(), WireError> {
    // This avoids a branch for each value, because a frame has up to a million values.
    if values.iter().fold(0.0_f32, |sum, value| sum + value * 0.0) == 0.0 {
        return Ok(());
    }
    let entry = values.iter().position(|value| !value.is_finite());
    let entry = entry.unwrap_or_default();
    Err(refused(
        "maps",
        entry,
        f64::from(values[entry]),
        "a finite number",
    ))
}

/// Checks the numbers of the peaks of a person's joints.
fn check_peaks(maps: &PersonMaps<'_>) -> Result<(), WireError> {
    for (joint, peak) in maps.peaks().into_iter().flatten().enumerate() {
        if peak.sigma <= 0.0 {
            return Err(refused(
                "peak.sigma",
                joint,
                f64::from(peak.sigma),
                "cells above 0",
            ));
        }
    }
    Ok(())
}

fn is_place(px: f64) -> bool {
    px.abs() <= MOST_PX
}

fn refused(field: &'static str, entry: usize, got: f64, expected: &'static str) -> WireError {
    WireError::Value {
        field,
        entry,
        got,
        expected,
    }
}

#[cfg(test)]
mod tests;
