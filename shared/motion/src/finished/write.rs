//! The files of a smoothed run.

use std::io::{self, Write as _};
use std::path::Path;

use crate::angles::{self, Unknown};
use crate::{Estimate, Motion, Role, lines};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use nalgebra::UnitVector3;
use runfiles::{FrameLine, MOST_PEOPLE, PersonLine, SmoothReport};

use super::folder::{self, Person, Run};

/// First line of `angles.csv`; after it, there is one row for each angle, person and frame.
const CSV_HEADER: &str = "frame,time_s,person,angle,degrees,sd_degrees,state";
/// Name of the file with the angles.
const ANGLES: &str = "angles.csv";

/// Writes all files.
///
/// * `motions`: one for each person.
pub(super) fn all(
    folder: &Path,
    run: &Run,
    motions: &[Motion],
    report: &SmoothReport,
    up: Option<UnitVector3<f64>>,
) -> Result<(), Failure> {
    let path = folder.join(ANGLES);
    files::replace_by(&path, |out| write_angles(out, run, motions, up))
        .map_err(|error| in_file(&path, &error))?;
    let path = folder.join(FrameLine::SMOOTHED_FILE);
    let mut unread = None;
    let written = files::replace_by(&path, |out| {
        let done = folder::read_lines(folder, |at, line| {
            let line = smoothed_line(line, at, run, motions);
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

/// Returns the line of an instant with smoothed joints; people who were not measured at this instant come last.
fn smoothed_line(mut line: FrameLine, at: usize, run: &Run, motions: &[Motion]) -> FrameLine {
    let smoothed = |person: &Person, motion: &Motion, measured: Option<PersonLine>| {
        let joints = person.recorded.joints.iter().zip(&motion.joints);
        let here = joints.enumerate().filter_map(|(nth, (joint, track))| {
            Some((joint.name.as_str(), nth >= person.n_joints, track.get(at)?))
        });
        lines::smoothed(person.id_at[at], measured, here)
    };
    let measured = core::mem::take(&mut line.people);
    let ids: Vec<u64> = measured.iter().map(|person| person.id).collect();
    let known = |id: u64| run.people.iter().position(|person| person.ids.contains(&id));
    let there = measured.into_iter().filter_map(|person| {
        let nth = known(person.id)?;
        smoothed(&run.people[nth], &motions[nth], Some(person))
    });
    let everybody = run.people.iter().zip(motions);
    let filled = everybody
        .filter(|(person, _)| !person.ids.iter().any(|id| ids.contains(id)))
        .filter_map(|(person, motion)| smoothed(person, motion, None));
    let people = there.chain(filled).take(MOST_PEOPLE).collect();
    lines::with_people(line, people)
}

/// Writes a row for every angle of every person and frame. Angles that need a joint that the person does not have are left out.
fn write_angles(
    file: &mut impl io::Write,
    run: &Run,
    motions: &[Motion],
    up: Option<UnitVector3<f64>>,
) -> io::Result<()> {
    writeln!(file, "{CSV_HEADER}")?;
    for at in 0..run.frames.len() {
        for (person, motion) in run.people.iter().zip(motions) {
            write_angles_at(file, (run, at), (person, motion), up)?;
        }
    }
    Ok(())
}

fn write_angles_at(
    file: &mut impl io::Write,
    (run, at): (&Run, usize),
    (person, motion): (&Person, &Motion),
    up: Option<UnitVector3<f64>>,
) -> io::Result<()> {
    let roles = || person.recorded.joints.iter().map(|joint| joint.role);
    let joints: Vec<(Role, Estimate)> = roles()
        .zip(&motion.joints)
        .filter_map(|(role, track)| Some((role?, track[at].ok()?)))
        .collect();
    let is_known = |role: &Role| roles().any(|known| known == Some(*role));
    let (frame, time_s, id) = (run.frames[at], run.times[at], person.id_at[at]);
    for (angle, value) in angles::angles(&joints, up) {
        if !angle.roles().iter().all(is_known) {
            continue;
        }
        let numbers = match value {
            Ok(it) => {
                let sd = it.sd_degrees.map_or(String::new(), |sd_degree| format!("{sd_degree:.2}"));
                format!("{:.2},{sd},{}", it.degrees, it.state.name())
            }
            Err(why) => format!(",,{}", unknown(why, angle, up)),
        };
        writeln!(file, "{frame},{time_s:.6},{id},{angle},{numbers}")?;
    }
    Ok(())
}

/// Returns the name used in files for an angle without a value.
fn unknown(why: Unknown, angle: angles::Angle, up: Option<UnitVector3<f64>>) -> &'static str {
    if up.is_none() && angle.needs_up() {
        return "no vertical";
    }
    why.name()
}
