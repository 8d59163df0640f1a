//! The scenario `kill-random`: randomly chosen processes are killed one after the other.

use failure::{Failure, now_nanos};
use serde_json::json;

use super::judge::{self, RandomKillsOutcome};
use super::options::Options;
use super::random_kills::{Kill, RandomKills};
use super::resources::{self, ResourceMonitor};
use super::scenario::Scenario;
use super::series;
use super::target::{epoch_source_of, frame_at};
use super::testbed::Testbed;
use super::verdict::{self, Verdict};
use crate::spread::Spread;

/// Fraction of the frames after which no more processes are killed.
const UNTIL: f64 = 0.8;
/// Time between two kills, in nanoseconds.
const PERIOD: u64 = 2_000_000_000;

/// Runs the deployment, kills processes, and checks the limits.
pub(super) fn attempt(testbed: &Testbed, options: &Options) -> Result<Verdict, Failure> {
    let scenario = Scenario::Random.name();
    let planned = testbed.plan(&scenario, &[])?;
    let until = frame_at(&planned, UNTIL) as u64;
    let mut random_kills = RandomKills::new(options.seed, PERIOD, until);
    let mut monitor = ResourceMonitor::default();
    let namespace = &planned.plan().namespace;
    let run = testbed.run(&planned, &mut |event| {
        let now = now_nanos();
        monitor.handle(event, now, |pids| resources::measure(namespace, pids));
        random_kills.handle(event, now, runtime::kill)
    });
    let kills = random_kills.kills();
    let n_faults = |name: &str| kills.iter().filter(|kill| kill.process == name).count() as u32;
    let outcome = run.outcome(n_faults);
    let session = planned.session();
    let downtime_ms =
        |kill: &Kill| kill.downtime_ms(epoch_source_of(&kill.process), session, &run.results);
    let each = kills
        .iter()
        .map(|kill| json!({ "process": kill.process, "back_ms": downtime_ms(kill) }));
    let each: Vec<_> = each.collect();
    let measured = RandomKillsOutcome {
        n_kills: kills.len(),
        downtime_ms: Spread::of(kills.iter().filter_map(downtime_ms).collect()),
        resources: monitor.ends(),
    };
    let length = u64::from(options.part_seconds) * 1_000_000_000;
    let parts = series::parts(length, session, kills, &monitor, &run.results);
    Ok(Verdict {
        scenario,
        measured: verdict::of_random_kills(&measured, outcome.n_results),
        numbers: json!({
            "kills": each,
            "back_ms": measured.downtime_ms,
            "first_and_last": measured.resources,
            "parts": parts,
        }),
        details: series::table(&parts),
        limits: judge::random(&options.limits, &measured, &outcome),
        run: run.json(),
    })
}
