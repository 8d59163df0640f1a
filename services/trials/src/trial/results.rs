//! What a run left in its folder about every frame, read again.

use std::collections::BTreeMap;
use std::path::Path;

use runfiles::{CameraTimes, FrameLine, Line, PoseTimes, TimesLine};
use runtime::Failure;
use skeleton::PARSE14;

use super::Point;

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
    pub shot: Option<CameraTimes>,
    /// The answer of its pose process.
    pub answer: Option<PoseTimes>,
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
    let frames: Vec<FrameLine> = lines(folder)?;
    let times: Vec<TimesLine> = lines(folder)?;
    Ok(join(&frames, times, cameras))
}

/// Reads a file of lines.
fn lines<L: Line>(folder: &Path) -> Result<Vec<L>, Failure> {
    let file = folder.join(L::FILE);
    let text = runtime::read_text(&file)?;
    let lines = runfiles::lines(&text).collect::<Result<_, _>>();
    lines.map_err(|error| runtime::in_file(&file, &error))
}

/// Results that stand in one of the two files only are left out: they were not written.
fn join(frames: &[FrameLine], times: Vec<TimesLine>, cameras: &[String]) -> Vec<Moment> {
    let times = times.into_iter().map(|it| (it.frame, it));
    let times: BTreeMap<u64, TimesLine> = times.collect();
    let both = frames
        .iter()
        .filter_map(|it| Some((it, times.get(&it.frame)?)));
    both.map(|(line, time)| {
        let joint = |name: &str| Some(line.joints.get(name)?.placed()?.position_m);
        let view = |name: &String| Seen {
            missing: line.views_missing.get(name).map(ToString::to_string),
            shot: time.views.get(name).and_then(|it| it.camera),
            answer: time.views.get(name).and_then(|it| it.pose),
        };
        Moment {
            frame: line.frame,
            epoch: time.epoch,
            sent_ms: time.sent_ms,
            joints: PARSE14.joints.iter().map(|it| joint(it.name)).collect(),
            views: cameras.iter().map(view).collect(),
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: &str = r#"{"facing_margin":null,"frame":4,"joints":{"head":{"covariance_m2":[1,0,0,1,0,1],"position_m":[1.0,2.0,3.0],"reprojection_px":1.5,"views":["c1"]},"neck":{"status":"too few views"}},"pairs":1,"status":"ok","time_s":null,"views_missing":{"c2":"late"},"views_present":["c1"],"views_used":["c1"]}
{"facing_margin":null,"frame":5,"joints":{},"pairs":0,"reason":"late","status":"no result","time_s":null,"views_missing":{},"views_present":[],"views_used":[]}
"#;
    const TIMES: &str = r#"{"frame":4,"sent_ms":50.5,"epoch":3,"views":{"c1":{"camera":{"epoch":1,"captured_ms":10.0,"sent_ms":12.0},"pose":{"epoch":2,"sent_ms":20.0}},"c2":{"camera":null,"pose":null}}}
"#;

    fn parse(poses: &str, times: &str, cameras: &[String]) -> Result<Vec<Moment>, Failure> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("pose3d.jsonl"), poses).unwrap();
        std::fs::write(folder.path().join("times.jsonl"), times).unwrap();
        read(folder.path(), cameras)
    }

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
        let wrong = TIMES.replace("\"epoch\":3", "\"epoch\":-3");
        let error = parse(POSES, &wrong, &[]).unwrap_err().to_string();
        for told in ["times.jsonl", "line 1", "`epoch`", "-3"] {
            assert!(error.contains(told), "{error}");
        }
    }
}
