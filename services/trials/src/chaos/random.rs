//! One process after the other killed, chosen at random.

use runtime::{Failure, now_nanos};
use serde_json::json;

use super::aim::{frame_at, trace_of};
use super::barrage::{Barrage, Kill};
use super::census::{self, Census};
use super::ground::Ground;
use super::judge::{self, Barraged};
use super::options::Options;
use super::scenario::Scenario;
use super::series;
use super::verdict::{self, Verdict};
use crate::spread::Spread;

/// Nobody is killed after this share of the frames.
const UNTIL: f64 = 0.8;
/// Nanoseconds between two kills.
const PERIOD: u64 = 2_000_000_000;

/// Kills one process after the other, chosen at random, and judges what became of the run.
pub(super) fn attempt(ground: &Ground, options: &Options) -> Result<Verdict, Failure> {
    let scenario = Scenario::Random.name();
    let planned = ground.plan(&scenario, &[])?;
    let until = frame_at(&planned, UNTIL) as u64;
    let mut barrage = Barrage::new(options.seed, PERIOD, until);
    let mut census = Census::default();
    let namespace = &planned.plan().namespace;
    let ran = ground.watch(&planned, &mut |event| {
        let now = now_nanos();
        census.note(event, now, |pids| census::look(namespace, pids));
        barrage.note(event, now, runtime::kill)
    });
    let kills = barrage.kills();
    let struck = |name: &str| kills.iter().filter(|it| it.process == name).count() as u32;
    let after = ran.aftermath(struck);
    let session = planned.session();
    let away_ms = |it: &Kill| it.away_ms(trace_of(&it.process), session, &ran.moments);
    let each = kills
        .iter()
        .map(|it| json!({ "process": it.process, "back_ms": away_ms(it) }));
    let each: Vec<_> = each.collect();
    let it = Barraged {
        n_kills: kills.len(),
        away_ms: Spread::of(kills.iter().filter_map(away_ms).collect()),
        held: census.ends(),
    };
    let length = u64::from(options.part_seconds) * 1_000_000_000;
    let parts = series::parts(length, session, kills, &census, &ran.moments);
    Ok(Verdict {
        scenario,
        measured: verdict::of_barrage(&it, after.n_results),
        numbers: json!({
            "kills": each,
            "back_ms": it.away_ms,
            "first_and_last": it.held,
            "parts": parts,
        }),
        more: series::table(&parts),
        limits: judge::random(&options.limits, &it, &after),
        run: ran.json(),
    })
}
