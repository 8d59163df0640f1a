//! Formats of points over time: C3D and TRC.

use std::io;

use formats::c3d::{Heading, Marker};

use crate::sink::{Notes, Sink};
use crate::{Point, Trial};

/// Maximum number of cameras per point in C3D.
const C3D_CAMERAS: u32 = 0x7f;
/// Finest step of C3D's residuals, in millimetres.
const FINEST_MM: f64 = 0.01;

/// Returns the frame rate. The table of formats states that it is needed, and the caller has checked that it is known.
pub(crate) fn rate(trial: &Trial) -> io::Result<f64> {
    let unknown = || io::Error::new(io::ErrorKind::InvalidInput, "the frame rate is not known");
    trial.rate_hz.ok_or_else(unknown)
}

/// Writes C3D: millimetres, z up.
pub(crate) fn c3d(trial: &Trial, mut out: &mut Sink<'_>) -> io::Result<Notes> {
    let all = (0..trial.slots.len()).flat_map(|slot| trial.points(slot).flatten());
    let deviations = all.filter_map(Point::deviation_m);
    let largest_mm = 1e3 * deviations.fold(0.0, f64::max);
    let labels = trial.labels();
    let too_many = |_| io::Error::other("C3D has no room for so many frames");
    let n_frames = u32::try_from(trial.slots.len()).map_err(too_many)?;
    let first_frame = (trial.first_frame / trial.frame_step).saturating_add(1);
    let heading = Heading {
        rate_hz: rate(trial)?,
        units: "mm",
        up: "+Z",
        descriptions: &vec!["joint centre, triangulated".to_owned(); labels.len()],
        labels: &labels,
        n_frames,
        first_frame: u32::try_from(first_frame).unwrap_or(1),
        residual_step: (largest_mm / 255.0).max(FINEST_MM),
        software: ["Parallax", env!("CARGO_PKG_VERSION")],
    };
    let turn = trial.z_up_from_world();
    let marker = |point: &Point| Marker {
        position: (turn * point.in_world * 1e3).into(),
        // In C3D, a residual of 0 means that the point was not measured.
        residual: if point.is_filled {
            0.0
        } else {
            1e3 * point.deviation_m().unwrap_or(0.0)
        },
        cameras: (point.views & C3D_CAMERAS) as u8,
    };
    let frames = (0..trial.slots.len()).map(|slot| {
        let points = trial.points(slot).map(|point| point.map(marker));
        points.collect()
    });
    formats::c3d::write(&mut out, &heading, frames)?;
    let last = first_frame.saturating_add(trial.slots.len() as u64 - 1);
    let mut notes = Notes::new();
    if last > u64::from(u16::MAX) && first_frame > 1 {
        notes.push(format!(
            "frames are numbered from 1 instead of {first_frame}: the format counts to 65535"
        ));
    }
    if trial.views.len() > 7 {
        notes.push("only the first seven cameras are named for each point".to_owned());
    }
    Ok(notes)
}

/// Writes TRC: metres, y up, like `pose3d.trc` of a run.
pub(crate) fn trc(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    labelled_trc(trial, trial.labels(), out)?;
    Ok(Notes::new())
}

/// Writes TRC with other names of the points.
pub(crate) fn labelled_trc(
    trial: &Trial,
    labels: Vec<String>,
    out: &mut Sink<'_>,
) -> io::Result<()> {
    let labels = labels.into_iter().map(|label| label.replace(['\t', '\n', '\r'], "_"));
    let labels: Vec<String> = labels.collect();
    let heading = formats::trc::Heading {
        file_name: &format!("{}.trc", trial.name),
        rate_hz: rate(trial)?,
        units: "m",
        markers: &labels.iter().map(String::as_str).collect::<Vec<_>>(),
        n_rows: trial.slots.len() as u64,
    };
    write!(out, "{heading}")?;
    let turn = trial.y_up_from_world();
    for slot in 0..trial.slots.len() {
        let points = trial
            .points(slot)
            .map(|point| point.map(|point| (turn * point.in_world).into()));
        let time_s = trial.time_s(slot).unwrap_or(0.0);
        out.write_all(formats::trc::row(slot as u64 + 1, time_s, points).as_bytes())?;
    }
    Ok(())
}
