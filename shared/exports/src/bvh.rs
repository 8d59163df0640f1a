//! BVH: a skeleton whose bones have fixed lengths, and its rotations over time; centimetres, y up.

use std::io;

use nalgebra::{UnitQuaternion, Vector3};

use crate::Trial;
use crate::points::rate;
use crate::sink::{Notes, Sink};
use crate::tree::{N_NODES, NODES, Posed, Poser, lengths};

/// Centimetres in a metre.
const CM: f64 = 100.0;
/// Maximum number of runs of frames that are listed.
const MAX_LISTED: usize = 5;

/// Writes the tree, and a line for each frame.
///
/// The lengths are medians. A bone that was never seen is left out, with everything that depends on it.
pub(crate) fn write(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    let lengths = lengths(trial);
    let is_there = is_there(&lengths);
    let mut poser = Poser::new(trial, &lengths);
    if !(0..trial.slots.len()).any(|slot| poser.pose(slot).seen[0].is_some()) {
        let why = "BVH: no frame has both hips, which are the root of the skeleton";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    }
    writeln!(out, "HIERARCHY")?;
    node(out, 0, 0, &lengths, &is_there)?;
    writeln!(
        out,
        "MOTION\nFrames: {}\nFrame Time: {:.9}",
        trial.slots.len(),
        1.0 / rate(trial)?
    )?;
    let mut poser = Poser::new(trial, &lengths);
    let mut angles = [[0.0; 3]; N_NODES];
    let mut held = Held::default();
    for slot in 0..trial.slots.len() {
        let posed = poser.pose(slot);
        held.take(slot, posed, &is_there);
        let root = posed.place[0] * CM;
        write!(out, "{:.5} {:.5} {:.5}", root.x, root.y, root.z)?;
        for index in (0..N_NODES).filter(|&i| has_channels(i, &is_there)) {
            let next = unwrapped(zxy(&posed.turn[index]), angles[index]);
            angles[index] = next;
            let [z, x, y] = next.map(f64::to_degrees);
            write!(out, " {z:.6} {x:.6} {y:.6}")?;
        }
        writeln!(out)?;
    }
    Ok(notes(trial, &lengths, &is_there, &held))
}

/// Returns which nodes are written: those that were seen, and those that point towards a seen node.
fn is_there(lengths: &[Option<f64>; N_NODES]) -> [bool; N_NODES] {
    let mut is_there = [true; N_NODES];
    for (index, node) in NODES.iter().enumerate().skip(1) {
        let parent = node.parent.is_none_or(|parent| is_there[parent]);
        let own = match (node.landmark, node.aim) {
            (None, Some(child)) => lengths[child].is_some(),
            _ => lengths[index].is_some(),
        };
        is_there[index] = parent && own;
    }
    is_there
}

fn children(index: usize, is_there: &[bool; N_NODES]) -> impl Iterator<Item = usize> {
    (0..N_NODES).filter(move |&i| is_there[i] && NODES[i].parent == Some(index))
}

/// Returns true if a node has channels. Ends of the tree have none.
fn has_channels(index: usize, is_there: &[bool; N_NODES]) -> bool {
    is_there[index] && (index == 0 || children(index, is_there).next().is_some())
}

fn node(
    out: &mut Sink<'_>,
    index: usize,
    depth: usize,
    lengths: &[Option<f64>; N_NODES],
    is_there: &[bool; N_NODES],
) -> io::Result<()> {
    let tab = "\t".repeat(depth);
    let offset = Vector3::from(NODES[index].rest) * lengths[index].unwrap_or(0.0) * CM;
    let name = NODES[index].name;
    let has_channels = has_channels(index, is_there);
    match (index, has_channels) {
        (0, _) => writeln!(out, "{tab}ROOT {name}")?,
        (_, true) => writeln!(out, "{tab}JOINT {name}")?,
        (_, false) => writeln!(out, "{tab}End Site")?,
    }
    writeln!(out, "{tab}{{")?;
    writeln!(
        out,
        "{tab}\tOFFSET {:.5} {:.5} {:.5}",
        offset.x, offset.y, offset.z
    )?;
    if has_channels {
        let place = match index {
            0 => "6 Xposition Yposition Zposition",
            _ => "3",
        };
        writeln!(out, "{tab}\tCHANNELS {place} Zrotation Xrotation Yrotation")?;
    }
    for child in children(index, is_there) {
        node(out, child, depth + 1, lengths, is_there)?;
    }
    writeln!(out, "{tab}}}")
}

/// Returns the angles of a rotation as `Rz Rx Ry`, in radians: `[z, x, y]`.
fn zxy(turn: &UnitQuaternion<f64>) -> [f64; 3] {
    let turn = turn.to_rotation_matrix();
    let m = turn.matrix();
    let x = m[(2, 1)].clamp(-1.0, 1.0).asin();
    if m[(2, 1)].abs() > 1.0 - 1e-12 {
        // The axes of z and y coincide, so the whole rotation is assigned to z.
        return [m[(1, 0)].atan2(m[(0, 0)]), x, 0.0];
    }
    [
        (-m[(0, 1)]).atan2(m[(1, 1)]),
        x,
        (-m[(2, 0)]).atan2(m[(2, 2)]),
    ]
}

/// Returns the same angles, shifted by whole turns to be as near as possible to the last ones, because programs may interpolate between
/// them.
fn unwrapped(angles: [f64; 3], last: [f64; 3]) -> [f64; 3] {
    let turn = core::f64::consts::TAU;
    core::array::from_fn(|i| angles[i] + ((last[i] - angles[i]) / turn).round() * turn)
}

/// Frames in which a bone or the whole body keeps its last rotation.
#[derive(Debug, Default)]
struct Held {
    /// First and last frame of each run in which any bone keeps its last rotation.
    runs: Vec<[usize; 2]>,
    /// Number of frames in which the whole body keeps its last rotations.
    n_whole: usize,
    n_frames: usize,
}

impl Held {
    fn take(&mut self, slot: usize, posed: &Posed, is_there: &[bool; N_NODES]) {
        let turning = (0..N_NODES).filter(|&i| has_channels(i, is_there));
        let n_held = turning.clone().filter(|&turning| !posed.is_turn_seen[turning]).count();
        if n_held == 0 && posed.seen[0].is_some() {
            return;
        }
        self.n_frames += 1;
        self.n_whole += usize::from(posed.seen.iter().all(Option::is_none));
        match self.runs.last_mut() {
            Some(run) if run[1] + 1 == slot => run[1] = slot,
            _ => self.runs.push([slot; 2]),
        }
    }
}

fn notes(
    trial: &Trial,
    lengths: &[Option<f64>; N_NODES],
    is_there: &[bool; N_NODES],
    held: &Held,
) -> Notes {
    let mut notes = vec![
        "the joints do not show how a bone turns about its own axis: it turns with its parent"
            .to_owned(),
    ];
    if trial.first_frame > 0 {
        let (frame, time_s) = (trial.first_frame, trial.time_s(0).unwrap_or_default());
        notes.push(format!(
            "the format counts from 0: its first line is frame {frame} of the run, at {time_s:.3} s"
        ));
    }
    if held.n_frames > 0 {
        let named = held.runs.iter().take(MAX_LISTED).map(|run| {
            let [first, last] = run.map(|slot| trial.frame(slot));
            if first == last {
                first.to_string()
            } else {
                format!("{first}-{last}")
            }
        });
        let named = named.collect::<Vec<_>>().join(", ");
        let more = held.runs.len().saturating_sub(MAX_LISTED);
        let more = if more > 0 {
            format!(" and {more} more runs")
        } else {
            String::new()
        };
        notes.push(format!(
            "the format cannot mark gaps: in {} of {} frames ({} of them without any joints), missing bones keep their last rotation; \
             these \
             are the frames {named}{more}",
            held.n_frames,
            trial.slots.len(),
            held.n_whole
        ));
    }
    let missing = NODES.iter().enumerate().filter(|node| !is_there[node.0]);
    let missing: Vec<&str> = missing.filter_map(|node| node.1.landmark).collect();
    if !missing.is_empty() {
        notes.push(format!(
            "left out, because they were never seen together with their parent joint: {}",
            missing.join(", ")
        ));
    }
    if !trial.extras.is_empty() {
        notes.push("extra keypoints are left out: they belong to no bone".to_owned());
    }
    let known = lengths.iter().zip(NODES).filter_map(|bone| Some((bone.1.name, (*bone.0)?)));
    let known = known.map(|(name, length)| format!("{name} {:.1}", CM * length));
    notes.push(format!(
        "fixed lengths of the bones that end in each joint (medians), cm: {}",
        known.collect::<Vec<_>>().join(", ")
    ));
    notes
}

#[cfg(test)]
mod tests;
