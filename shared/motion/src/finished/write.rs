//! The files of a smoothed run.

use std::io::{self, Write as _};
use std::path::Path;

use crate::angles::{self, Unknown};
use crate::{Estimate, Motion, Role, lines};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use nalgebra::UnitVector3;
use runfiles::{FrameLine, Line as _, SmoothLine, SmoothReport};

use super::folder::{self, Run};

/// First line of `angles.csv`; a row for every angle follows.
const CSV_HEADER: &str = "frame,time_s,angle,degrees,sd_degrees,state";
/// Its name.
const ANGLES: &str = "angles.csv";

/// Writes all files.
pub(super) fn all(
    folder: &Path,
    run: &Run,
    motion: &Motion,
    report: &SmoothReport,
    up: Option<UnitVector3<f64>>,
) -> Result<(), Failure> {
    let path = folder.join(ANGLES);
    files::replace_by(&path, |out| write_angles(out, run, motion, up))
        .map_err(|error| in_file(&path, &error))?;
    let path = folder.join(SmoothLine::FILE);
    let mut unread = None;
    let written = files::replace_by(&path, |out| {
        let done = folder::read_lines(folder, |at, line| {
            let line = smoothed_line(line, at, run, motion);
            let text = runfiles::to_line(&line).or_fail(ExitKind::Run)?;
            let added = out.write_all(text.as_bytes());
            added.map_err(|error| in_file(&path, &error))
        });
        done.map(drop).map_err(|failure| {
            unread = Some(failure);
            io::Error::other("not written")
        })
    });
    written.map_err(|error| unread.unwrap_or_else(|| in_file(&path, &error)))?;
    let path = folder.join(SmoothReport::FILE);
    let text = report.to_text().or_fail(ExitKind::Run)?;
    files::replace(&path, text.as_bytes()).map_err(|error| in_file(&path, &error))
}

/// The line of an instant with its joints smoothed.
fn smoothed_line(line: FrameLine, at: usize, run: &Run, motion: &Motion) -> SmoothLine {
    let joints = run.recorded.joints.iter().zip(&motion.joints).enumerate();
    let here = joints.filter_map(|(nth, (joint, track))| {
        Some((joint.name.as_str(), nth >= run.n_joints, track.get(at)?))
    });
    lines::smoothed(line, here)
}

/// Writes a row for every angle of every frame; angles between joints that the run does not have are left out.
fn write_angles(
    file: &mut impl io::Write,
    run: &Run,
    motion: &Motion,
    up: Option<UnitVector3<f64>>,
) -> io::Result<()> {
    let roles: Vec<Option<Role>> = run.recorded.joints.iter().map(|it| it.role).collect();
    let known: Vec<Role> = roles.iter().flatten().copied().collect();
    writeln!(file, "{CSV_HEADER}")?;
    for (at, (&frame, time_s)) in run.frames.iter().zip(&run.recorded.times).enumerate() {
        let joints: Vec<(Role, Estimate)> = roles
            .iter()
            .zip(&motion.joints)
            .filter_map(|(role, track)| Some(((*role)?, track[at].ok()?)))
            .collect();
        for (angle, value) in angles::angles(&joints, up) {
            if !angle.roles().iter().all(|it| known.contains(it)) {
                continue;
            }
            let numbers = match value {
                Ok(it) => {
                    let sd = it.sd_degrees.map_or(String::new(), |it| format!("{it:.2}"));
                    format!("{:.2},{sd},{}", it.degrees, it.state.name())
                }
                Err(why) => format!(",,{}", unknown(why, angle, up)),
            };
            writeln!(file, "{frame},{time_s:.6},{angle},{numbers}")?;
        }
    }
    Ok(())
}

/// The word for an angle without a value.
fn unknown(why: Unknown, angle: angles::Angle, up: Option<UnitVector3<f64>>) -> &'static str {
    if up.is_none() && angle.needs_up() {
        return "no vertical";
    }
    why.name()
}
