//! Every key of a deployment file, what it means, its value and where that came from.

use toml::{Table, Value};

use super::Loaded;

/// Who said a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Origin {
    /// Nobody.
    Default,
    /// The deployment file.
    File,
    /// `--set` or another option.
    CommandLine,
}

impl Origin {
    /// In words.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::File => "file",
            Self::CommandLine => "command line",
        }
    }
}

/// One key.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(crate) struct Entry {
    /// With its section.
    pub key: &'static str,
    /// As TOML; `None` if it is not set and has no default.
    pub value: Option<Value>,
    /// Who said it.
    pub origin: Origin,
    /// What it means.
    pub meaning: &'static str,
}

/// Keys in the order in which they are shown.
pub(super) const KEYS: &[(&str, &str)] = &[
    (
        "name",
        "name of the deployment: its processes share memory under it",
    ),
    ("rig", "calibration of the cameras"),
    (
        "unit",
        "unit of the lengths in that file, m, cm or mm, where it is not what its format says",
    ),
    (
        "up",
        "direction against gravity in the world of that file, [x, y, z]; replaces what it says; found from cameras and people \
         where neither says",
    ),
    (
        "model",
        "trained model; without it the one that ships with Parallax",
    ),
    ("output", "folder for the results"),
    (
        "data",
        "where the footage comes from, and how to get it: said where a file that is named here is missing",
    ),
    (
        "camera",
        "name in the rig, source (video, image, folder, glob, synth://...), source_offset_px of a cropped source, fault = \"freeze@30+20\" for a test",
    ),
    (
        "capture.mode",
        "lossless: nothing is dropped; realtime: the latest frame wins",
    ),
    (
        "capture.pace",
        "fast: as fast as frames are taken; realtime: at the frame rate",
    ),
    (
        "capture.size",
        "[width, height] of the frames that the pipeline sees, pixels",
    ),
    (
        "capture.scale",
        "the same as a share of the camera's image; without either: the camera's size",
    ),
    (
        "capture.upright",
        "turn frames until the world's up points up",
    ),
    (
        "capture.frame_rate_hz",
        "frames per second of images, and of a video that does not say",
    ),
    ("capture.start_frame", "first frame to use, from 0"),
    ("capture.frame_step", "use every n-th frame"),
    ("capture.n_frames", "most frames to use; all without it"),
    (
        "capture.frozen_after",
        "repetitions of a picture, bit for bit, from which on its camera is called frozen; 0: never",
    ),
    (
        "pose.evidence_window",
        "levels either side of every candidate's that fusion may use, or \"all\"",
    ),
    (
        "pose.candidates",
        "most distinct candidates that a view offers to fusion",
    ),
    (
        "pose.min_separation",
        "least mean distance of two candidates' parts, in box sides",
    ),
    ("pose.threads", "threads of one pose process"),
    (
        "pose.precision",
        "f32: the same bits everywhere; bf16: faster and less exact, needs a processor with AMX",
    ),
    (
        "pose.search",
        "full: every frame everywhere; tracked: near the last pose, faster and approximate",
    ),
    (
        "pose.tracked_levels",
        "tracked: levels either side of the last pose's that are searched",
    ),
    (
        "pose.tracked_margin",
        "tracked: how far around the last pose's box is searched, as a share of its longer side",
    ),
    (
        "pose.tracked_full_every",
        "tracked: every n-th frame is searched in full",
    ),
    (
        "pose.tracked_max_gap",
        "tracked: largest step from frame to frame that is followed; 1: no frame may be left out",
    ),
    (
        "pose.tracked_max_drop",
        "tracked: fall of the score since the last full search that asks for another, of the same frame",
    ),
    (
        "pose.tracked_speed",
        "tracked: how far a pose may move in a second, as a share of its box's longer side",
    ),
    (
        "pose.tracked_max_gap_ms",
        "tracked: longest time from frame to frame that is followed; longer ones are searched in full",
    ),
    (
        "pose.tracked_full_every_ms",
        "tracked: a frame so long after the last full search is searched in full",
    ),
    (
        "quality.network",
        "network that predicts the errors of every view, an ONNX file, or \"shipped\", the one that ships; in place of a table",
    ),
    (
        "quality.onnx_runtime",
        "libonnxruntime.so, to run the network in place of what is built in; needs --features ort",
    ),
    (
        "quality.device",
        "what that library runs it on, \"cpu\" or \"cuda\"",
    ),
    (
        "quality.deadline_ms",
        "realtime: how long a frame waits for expected errors",
    ),
    (
        "quality.max_age_ms",
        "how old the last expected errors of a view may be to be used instead; else its parts count",
    ),
    (
        "quality.table",
        "expected errors: subject, action, frame, camera, then one per part, pixels",
    ),
    (
        "quality.subject",
        "subject in that table; not set where it names none",
    ),
    (
        "quality.action",
        "action in that table; not set where it names none",
    ),
    (
        "quality.views",
        "what cameras are called in that table, { camera = \"name\" }; by their own names without it",
    ),
    (
        "quality.frame_offset",
        "number of the footage's frame 0 in that table",
    ),
    (
        "quality.frame_step",
        "frames of that table per frame of the footage",
    ),
    (
        "fuse.energy",
        "paper, or released: what the authors' program computes",
    ),
    (
        "fuse.views",
        "pairs: pairs of views, then combined, as in the paper; all: every view with all others at once",
    ),
    (
        "fuse.consistency",
        "what `parallax train consistency` learned, or \"shipped\": part-type tables, weights, thresholds, joints",
    ),
    (
        "fuse.consistency_rig",
        "rig of that file whose cameras these are; tables go by the angle between two cameras without it",
    ),
    (
        "fuse.alpha",
        "weight of the geometric term; as learned, else 0.002 per squared cell (paper), 0.07 (released)",
    ),
    (
        "fuse.beta",
        "weight of the part-type term; as learned, else 0.03",
    ),
    (
        "fuse.max_distance_cells",
        "distance beyond which the geometric term grows no more; as learned, else none",
    ),
    (
        "fuse.compatibility",
        "part-type tables: views = [a, b], files = [a wrt b, b wrt a]",
    ),
    (
        "fuse.tau",
        "expected error that switches a part off: none, learned, humaneva, humaneva-median, umpm, umpm-median, one per part or { file = ... }, pixels of the footage",
    ),
    (
        "fuse.switch",
        "whose expected error switches a part off: either view's (the paper), the support's, or the support's \
         where it is the worse of the two",
    ),
    (
        "fuse.facing",
        "decide for every view whether it sees the person from behind",
    ),
    (
        "fuse.workers",
        "most fusion processes; pairs of views are dealt to them in turn, all views at once need one",
    ),
    (
        "fuse.max_iterations",
        "most single-view solutions of a pair; of all views at once, half as many of every view",
    ),
    (
        "fuse.epsilon_px",
        "mean movement below which a view counts as settled",
    ),
    (
        "fuse.pairs",
        "pairs of cameras to fuse, by name; all if empty",
    ),
    ("triangulate.joints", "parse14, umpm15 or humaneva20"),
    (
        "triangulate.combine",
        "one pose per view out of its pairs': mean, as in the paper, or consensus",
    ),
    (
        "triangulate.loss_px",
        "reprojection error at which an observation begins to count less",
    ),
    (
        "triangulate.error_weight",
        "how much of its expected error makes a view uncertain about a joint, with [quality]; 0 none",
    ),
    ("results.trc", "write pose3d.trc for OpenSim"),
    (
        "results.overlay_every",
        "draw every n-th frame of every view; 0 draws none",
    ),
    (
        "results.epipolar_part",
        "part whose epipolar lines are drawn, from 1",
    ),
    (
        "supervise.deadline_ms",
        "how long a stage waits for a late view; 10000 lossless, 200 realtime",
    ),
    (
        "supervise.hang_limit_s",
        "how long a process may stand still before it is killed, seconds; 120 lossless, 10 realtime",
    ),
    (
        "supervise.missed_beats",
        "signs of life, one every 150 ms, that a stopped process (SIGSTOP) may miss before it is killed; realtime: and \
         for how many of them a turn of any but results and record may compute, however short those before it were",
    ),
    (
        "supervise.max_restarts",
        "restarts of one process within the window before it is given up",
    ),
    ("supervise.restart_window_s", "that window, seconds"),
    (
        "supervise.latency_budget_ms",
        "a run fails if 1 frame in 100 takes longer from capture to result; none without it",
    ),
    (
        "runtime.spin",
        "stages look for messages without pause: least latency, a whole core each, for machines with cores to spare",
    ),
    (
        "runtime.cores",
        "cores that a service or one of its processes may run on, { pose = [0, 1], fuse-0 = [2] }",
    ),
    (
        "runtime.priority",
        "real-time priority of a service or one of its processes, { pose = 10 }, 1 to 99",
    ),
    (
        "runtime.policy",
        "fifo or round-robin: who runs of those with the same real-time priority",
    ),
    (
        "runtime.lock_memory",
        "keep in memory what processes have once used",
    ),
];

impl Loaded {
    /// Every key with its value, in order.
    pub(crate) fn entries(&self) -> Result<Vec<Entry>, toml::ser::Error> {
        let table = Table::try_from(&self.deployment)?;
        Ok(KEYS
            .iter()
            .map(|&(key, meaning)| Entry {
                key,
                value: lookup(&table, key).cloned(),
                origin: self.origin(key),
                meaning,
            })
            .collect())
    }

    fn origin(&self, key: &str) -> Origin {
        if lookup(&self.on_command_line, key).is_some() {
            Origin::CommandLine
        } else if lookup(&self.in_file, key).is_some() {
            Origin::File
        } else {
            Origin::Default
        }
    }
}

fn lookup<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        Some((section, rest)) => lookup(table.get(section)?.as_table()?, rest),
        None => table.get(key),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deployment::Deployment;

    const MINIMAL: &str = "name = 'a'\nrig = 'r'\nmodel = 'm'\noutput = 'o'\ncamera = []\n";

    fn defaults() -> Deployment {
        toml::from_str(MINIMAL).unwrap()
    }

    #[test]
    fn every_key_that_has_a_value_is_explained() {
        for (section, value) in &Table::try_from(defaults()).unwrap() {
            let keys: Vec<String> = match value {
                Value::Table(inner) => inner.keys().map(|it| format!("{section}.{it}")).collect(),
                _ => vec![section.clone()],
            };
            for key in keys {
                assert!(KEYS.iter().any(|it| it.0 == key), "{key} is not explained");
            }
        }
    }

    #[test]
    fn every_explained_key_exists() {
        // A key that the file format does not know is refused as unknown; any other complaint about
        // the value proves that the key was found.
        for (key, _) in KEYS {
            let nested = key
                .rsplit('.')
                .fold(Value::Array(vec![Value::Integer(-1); 9]), |inner, name| {
                    Value::Table(Table::from_iter([(name.to_owned(), inner)]))
                });
            let Value::Table(table) = nested else {
                continue;
            };
            let mut whole: Table = MINIMAL.parse().unwrap();
            whole.extend(table);
            if let Err(error) = whole.try_into::<Deployment>() {
                assert!(!error.message().contains("unknown field"), "{key}: {error}");
            }
        }
    }
}
