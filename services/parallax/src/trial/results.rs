//! What a run left in its folder about every frame, read again.

use std::collections::BTreeMap;
use std::path::Path;

use runtime::Failure;
use serde::Deserialize;
use skeleton::PARSE14;

use super::Point;
use crate::inputs;

/// One result.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Moment {
    pub frame: u64,
    /// How often the process that made it had been restarted.
    pub epoch: u32,
    /// When it was sent, milliseconds since the run was planned.
    pub sent_ms: f64,
    /// The joints of `skeleton::PARSE14` that were found, metres in the world.
    pub joints: Vec<Option<Point>>,
    /// The views, in the order of the rig.
    pub views: Vec<Seen>,
}

/// What is known of one view of a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Seen {
    /// Why it has no part in the result, if it has none.
    pub missing: Option<String>,
    /// The frame that its camera sent.
    pub shot: Option<Shot>,
    /// The answer of its pose process.
    pub answer: Option<Answer>,
}

/// An answer of a pose process.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(crate) struct Answer {
    /// How often the process had been restarted.
    pub epoch: u32,
    /// Milliseconds since the run was planned.
    pub sent_ms: f64,
}

/// A frame that a camera sent; milliseconds since the run was planned.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(crate) struct Shot {
    /// How often the camera's process had been restarted.
    pub epoch: u32,
    pub captured_ms: f64,
    pub sent_ms: f64,
}

impl Moment {
    /// Whether anything was found.
    pub(crate) fn is_posed(&self) -> bool {
        self.joints.iter().any(Option::is_some)
    }

    /// When the first of its pictures was taken.
    pub(crate) fn captured_ms(&self) -> Option<f64> {
        let shots = self.views.iter().filter_map(|it| it.shot);
        shots.map(|it| it.captured_ms).reduce(f64::min)
    }
}

/// Reads the results of a run, in the order in which they came.
///
/// * `cameras`: names, in the order of the rig.
pub(crate) fn read(folder: &Path, cameras: &[String]) -> Result<Vec<Moment>, Failure> {
    let text = |name: &str| inputs::text(&folder.join(name));
    let [poses, times] = [text("pose3d.jsonl")?, text("times.jsonl")?];
    parse(&poses, &times, cameras).map_err(|error| inputs::in_file(folder, &error))
}

/// A line of `pose3d.jsonl`.
#[derive(Debug, Deserialize)]
struct PoseLine {
    frame: u64,
    joints: BTreeMap<String, Joint>,
    views_missing: BTreeMap<String, String>,
}

#[derive(Debug, Deserialize)]
struct Joint {
    position_m: Option<Point>,
}

/// A line of `times.jsonl`.
#[derive(Debug, Deserialize)]
struct TimeLine {
    frame: u64,
    epoch: u32,
    sent_ms: f64,
    views: BTreeMap<String, TimesOfView>,
}

#[derive(Debug, Deserialize)]
struct TimesOfView {
    camera: Option<Shot>,
    pose: Option<Answer>,
}

/// Results that stand in one of the two texts only are left out: they were not written.
fn parse(poses: &str, times: &str, cameras: &[String]) -> Result<Vec<Moment>, serde_json::Error> {
    let times = times.lines().map(serde_json::from_str::<TimeLine>);
    let times = times.map(|it| it.map(|it| (it.frame, it)));
    let times: BTreeMap<u64, TimeLine> = times.collect::<Result<_, _>>()?;
    let mut moments = Vec::new();
    for line in poses.lines() {
        let line: PoseLine = serde_json::from_str(line)?;
        let Some(time) = times.get(&line.frame) else {
            continue;
        };
        let joint = |name: &str| line.joints.get(name).and_then(|it| it.position_m);
        let view = |name: &String| Seen {
            missing: line.views_missing.get(name).cloned(),
            shot: time.views.get(name).and_then(|it| it.camera),
            answer: time.views.get(name).and_then(|it| it.pose),
        };
        moments.push(Moment {
            frame: line.frame,
            epoch: time.epoch,
            sent_ms: time.sent_ms,
            joints: PARSE14.joints.iter().map(|it| joint(it.name)).collect(),
            views: cameras.iter().map(view).collect(),
        });
    }
    Ok(moments)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: &str = r#"{"frame":4,"joints":{"head":{"position_m":[1.0,2.0,3.0]},"neck":{"status":"too few views"}},"views_missing":{"c2":"late"},"pairs":1}
{"frame":5,"joints":{},"views_missing":{}}
"#;
    const TIMES: &str = r#"{"frame":4,"sent_ms":50.5,"epoch":3,"views":{"c1":{"camera":{"epoch":1,"captured_ms":10.0,"sent_ms":12.0},"pose":{"epoch":2,"sent_ms":20.0}},"c2":{"camera":null,"pose":null}}}
"#;

    #[test]
    fn both_files_say_what_is_known_of_a_frame() {
        let cameras = ["c1", "c2"].map(str::to_owned);
        let got = parse(POSES, TIMES, &cameras).unwrap();
        let [moment] = &got[..] else {
            panic!("frame 5 has no times: {got:?}")
        };
        assert_eq!((moment.frame, moment.sent_ms), (4, 50.5));
        assert_eq!(moment.joints[13], Some([1.0, 2.0, 3.0]));
        assert_eq!(moment.joints.iter().flatten().count(), 1);
        assert_eq!(moment.views[0].shot.unwrap().epoch, 1);
        assert_eq!(moment.views[0].answer.unwrap().epoch, 2);
        assert_eq!(moment.epoch, 3);
        assert_eq!(moment.captured_ms(), Some(10.0));
        assert_eq!(moment.views[1].missing.as_deref(), Some("late"));
    }

    #[test]
    fn a_line_that_is_none_is_an_error() {
        parse("{\"frame\":1", TIMES, &[]).unwrap_err();
        parse(POSES, "x\n", &[]).unwrap_err();
    }
}
