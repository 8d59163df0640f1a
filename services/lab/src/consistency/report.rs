//! Report on learned consistency.

use std::path::Path;

use serde_json::{Value, json};

use super::work::Done;
use multiview::learned::{Appearance, Point};

/// Schema version of the JSON.
const SCHEMA: u32 = 1;

impl Done {
    /// Returns the report as JSON.
    ///
    /// * `out`: the written file.
    pub fn json(&self, out: &Path) -> Value {
        json(out, self)
    }

    /// Returns the report as text.
    ///
    /// * `out`: the written file.
    pub fn text(&self, out: &Path) -> String {
        text(out, self)
    }
}

fn json(out: &Path, done: &Done) -> Value {
    let bins = done.bins.iter();
    let joints = done.joints.iter();
    json!({
        "schema_version": SCHEMA,
        "file": out,
        "learned_from": done.learned.learned,
        "weights": done.learned.weights,
        "tau_tenths": done.learned.tau_tenths,
        "single": done.single,
        "surface": done.surface,
        "bins": bins.map(|(n, lift)| json!({"half_circle": n, "lift": lift})).collect::<Vec<_>>(),
        "joints": joints.map(|(ridge, error)| json!({"ridge": ridge, "rms": error})).collect::<Vec<_>>(),
        "seconds": done.seconds,
    })
}

fn text(out: &Path, done: &Done) -> String {
    let from = done.learned.learned;
    let mut lines = vec![format!(
        "{}: learned from {} views of {} instants, weights chosen on {} more instants, in {:.0} s",
        out.display(),
        from.views,
        from.instants,
        from.held_out,
        done.seconds
    )];
    lines.push(
        "number of bins per half circle, and the score of tables with this number of bins on held-out people:"
            .to_owned(),
    );
    for (n, lift) in &done.bins {
        let lift = lift.map_or_else(|| "-".to_owned(), |lift| format!("{lift:.4}"));
        lines.push(format!("    {n:3}  {lift}"));
    }
    lines.push("joints: error relative to the person's size".to_owned());
    for (ridge, error) in &done.joints {
        let ridge = ridge.map_or_else(
            || "parts only".to_owned(),
            |ridge| format!("ridge {ridge:e}"),
        );
        lines.push(format!("    {ridge:12} {error:.4}"));
    }
    lines.push(format!(
        "{:>8} {:>6} {:>6} {:>6} {:>7} {:>7} {:>6}",
        "alpha", "cap", "form", "beta", "area", "PCP3D", "iter."
    ));
    lines.extend(done.single.iter().map(|single| row(single, "")));
    for it in &done.surface {
        let is_chosen = it.weights == done.learned.weights;
        lines.push(row(it, if is_chosen { "  <- chosen" } else { "" }));
    }
    lines.join("\n")
}

fn row(point: &Point, mark: &str) -> String {
    let it = &point.weights;
    let cap = it.max_distance_cells.map_or_else(|| "-".to_owned(), |cells| cells.to_string());
    let form = match (it.beta > 0.0, it.appearance) {
        (false, _) => "-",
        (true, Appearance::Joint) => "joint",
        (true, Appearance::Lift) => "lift",
    };
    format!(
        "{:8} {cap:>6} {form:>6} {:6} {:7.2} {:7.2} {:6.2}{mark}",
        it.alpha, it.beta, point.area, point.pcp3d, point.iterations
    )
}
