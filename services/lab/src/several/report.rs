//! Summary of a run in numbers.

use std::collections::BTreeMap;

use serde::Serialize;
use statistics::Sorted;
use statistics::score::{Bootstrap, Share};

use super::Run;
use super::judge::{ACTORS, Actor, PartsOfFrame};

/// Number of consecutive frames in a block of the bootstrap: one second.
const BLOCK: usize = 25;

/// A number with its 95 % interval, by bootstrap over blocks of 25 frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measured {
    /// The number.
    pub value: f64,
    /// Lower and upper end of the interval.
    pub interval: [f64; 2],
}

/// The score of a person.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActorReport {
    /// Id of the person, counted from 1 as in publications.
    pub actor: usize,
    /// Number of frames in which the person is present.
    pub frames: usize,
    /// Number of frames in which the person was found.
    pub found: usize,
    /// Correct parts, in percent.
    pub pcp3d: Option<Measured>,
    /// Correct parts by the name of the part, in percent.
    pub parts: BTreeMap<&'static str, f64>,
    /// Mean distance of the twelve joints of the limbs, in millimetres.
    pub mpjpe_mm: Option<Measured>,
    /// Number of id changes.
    pub switches: usize,
}

/// The score of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Views that were used, counted from 0.
    pub views: Vec<usize>,
    /// Number of frames.
    pub frames: usize,
    /// Mean PCP3D of the first three actors, in percent.
    pub mean_pcp3d: Option<Measured>,
    /// Results for each true person.
    pub actors: Vec<ActorReport>,
    /// Number of id changes.
    pub switches: usize,
    /// Number of different ids in the output.
    pub ids: usize,
    /// Mean number of people in the output of a frame.
    pub put_out: f64,
    /// Time of the association alone, in milliseconds per frame: median and 99th percentile.
    pub association_ms: [f64; 2],
}

impl Report {
    /// Summarises a run.
    ///
    /// * `views`: the views of the set that were used.
    pub fn new(run: &Run, views: &[usize]) -> Self {
        let score = &run.score;
        let times: Vec<f64> = run.association.iter().map(|time| 1e3 * time.as_secs_f64()).collect();
        let times = Sorted::new(times);
        let time = |share: f64| times.nearest_rank(share).unwrap_or(0.0);
        let actors: Vec<ActorReport> =
            score.actors.iter().map(|(id, actor)| of_actor(*id, actor)).collect();
        Self {
            views: views.to_vec(),
            frames: score.frames.len(),
            mean_pcp3d: mean(&score.frames),
            switches: actors.iter().map(|actor| actor.switches).sum(),
            actors,
            ids: score.ids.len(),
            put_out: score.n_put as f64 / score.frames.len().max(1) as f64,
            association_ms: [time(0.5), time(0.99)],
        }
    }
}

pub(super) fn of_actor(id: usize, actor: &Actor) -> ActorReport {
    let parts = actor
        .by_part
        .iter()
        .map(|(name, share)| (*name, 100.0 * share.sum / share.n.max(1.0)));
    ActorReport {
        actor: id + 1,
        frames: actor.parts.len(),
        found: actor.n_found,
        pcp3d: measured(&actor.parts, 100.0),
        parts: parts.collect(),
        mpjpe_mm: measured(&actor.errors_m, 1e3),
        switches: actor.switches,
    }
}

pub(super) fn measured(frames: &[Share], scale: f64) -> Option<Measured> {
    let bootstrap = Bootstrap {
        block: BLOCK,
        ..Bootstrap::default()
    };
    Some(Measured {
        value: scale * Share::mean(frames)?,
        interval: bootstrap.interval(frames)?.map(|end| scale * end),
    })
}

/// Returns the mean percentage of the first actors; `None` if one of them is never present.
fn mean(frames: &[Vec<PartsOfFrame>]) -> Option<Measured> {
    let of_parts = |parts: &[PartsOfFrame]| {
        let of_actor = |id: usize| {
            let own = parts.iter().filter(|part| part.actor == id).map(|part| part.right);
            Share::mean(&own.collect::<Vec<Share>>())
        };
        let each: Option<Vec<f64>> = (0..ACTORS).map(of_actor).collect();
        Some(100.0 * each?.iter().sum::<f64>() / ACTORS as f64)
    };
    let blocks: Vec<Vec<PartsOfFrame>> = frames.chunks(BLOCK).map(<[_]>::concat).collect();
    Some(Measured {
        value: of_parts(&blocks.concat())?,
        interval: Bootstrap::default().interval_of(&blocks, of_parts)?,
    })
}
