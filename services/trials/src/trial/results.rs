//! Reads the results of a run, frame by frame, from its output folder.

use std::collections::BTreeMap;
use std::path::Path;

use failure::Failure;
use runfiles::{CameraTimes, FrameLine, Line, PersonLine, PoseTimes, TimesLine};
use skeleton::PARSE14;

use super::Point;

/// The result of one frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameResult {
    pub frame: u64,
    /// Epoch of the process that made the result.
    pub epoch: u32,
    /// Time at which the result was sent, in milliseconds since the planning of the run.
    pub sent_ms: f64,
    /// Joints of `skeleton::PARSE14` of each person in world coordinates, in metres; `None` for a joint that was not found.
    pub people: Vec<Joints>,
    /// Views in the order of the rig.
    pub views: Vec<ViewResult>,
}

/// Joints of a person, in metres; `None` for a joint that was not found.
pub(crate) type Joints = Vec<Option<Point>>;

/// One view of a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ViewResult {
    /// Reason why the view was not used in the result; `None` if it was used.
    pub missing: Option<String>,
    /// Times of the view's camera.
    pub camera: Option<CameraTimes>,
    /// Times of the view's pose process.
    pub pose: Option<PoseTimes>,
}

impl FrameResult {
    /// Returns true if any joint was found.
    pub(crate) fn is_posed(&self) -> bool {
        self.people.iter().flatten().any(Option::is_some)
    }

    /// Returns the joints of the person who is nearest to a true one, on average over the joints that were found. Returns joints that were
    /// not found if there is nobody.
    pub(crate) fn nearest(&self, truth: &[Point]) -> Joints {
        let away = |joints: &Joints| {
            let both =
                joints.iter().zip(truth).filter_map(|(found, truth)| Some(((*found)?, truth)));
            let (n, sum) = both.fold((0.0, 0.0), |(n, sum), (found, truth)| {
                let squared: f64 = (0..3).map(|axis| (found[axis] - truth[axis]).powi(2)).sum();
                (n + 1.0, sum + squared.sqrt())
            });
            if n > 0.0 { sum / n } else { f64::INFINITY }
        };
        let nearest = self.people.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.cloned().unwrap_or_else(|| vec![None; truth.len()])
    }

    /// Returns the time at which the first picture of the result was captured, in milliseconds since the planning of the run.
    pub(crate) fn captured_ms(&self) -> Option<f64> {
        let shots = self.views.iter().filter_map(|view| view.camera);
        shots.map(|shot| shot.captured_ms).reduce(f64::min)
    }
}

/// Reads the results of a run, in the order of the file.
///
/// * `folder`: the output folder of the run.
/// * `cameras`: names of the cameras, in the order of the rig.
///
/// # Errors
///
/// Fails if a file cannot be read, or has an invalid line.
pub(crate) fn read(folder: &Path, cameras: &[String]) -> Result<Vec<FrameResult>, Failure> {
    let frames: Vec<FrameLine> = lines(folder)?;
    let times: Vec<TimesLine> = lines(folder)?;
    Ok(join(&frames, times, cameras))
}

/// Reads a JSON-lines file of the output folder.
fn lines<L: Line>(folder: &Path) -> Result<Vec<L>, Failure> {
    let file = folder.join(L::FILE);
    let text = failure::read_text(&file)?;
    let lines = runfiles::lines(&text).collect::<Result<_, _>>();
    lines.map_err(|error| failure::in_file(&file, &error))
}

/// Joins the lines of both files by frame. A frame that is in only one of the files has no result.
fn join(frames: &[FrameLine], times: Vec<TimesLine>, cameras: &[String]) -> Vec<FrameResult> {
    let times = times.into_iter().map(|time| (time.frame, time));
    let times: BTreeMap<u64, TimesLine> = times.collect();
    let both = frames.iter().filter_map(|line| Some((line, times.get(&line.frame)?)));
    both.map(|(line, time)| {
        let joints = |person: &PersonLine| -> Joints {
            let joint = |name: &str| Some(person.joints.get(name)?.placed()?.position_m);
            PARSE14.joints.iter().map(|named| joint(named.name)).collect()
        };
        let view = |name: &String| ViewResult {
            missing: line.views_missing.get(name).map(ToString::to_string),
            camera: time.views.get(name).and_then(|view| view.camera),
            pose: time.views.get(name).and_then(|view| view.pose),
        };
        FrameResult {
            frame: line.frame,
            epoch: time.epoch,
            sent_ms: time.sent_ms,
            people: line.people.iter().map(joints).collect(),
            views: cameras.iter().map(view).collect(),
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: &str = r#"{"frame":4,"people":[{"facing_margin":null,"id":1,"joints":{"head":{"covariance_m2":[1,0,0,1,0,1],"position_m":[1.0,2.0,3.0],"reprojection_px":1.5,"views":["c1"]},"neck":{"status":"too few views"}},"pairs":1,"status":"ok","views_used":["c1"]},{"facing_margin":null,"id":9,"joints":{"head":{"covariance_m2":[1,0,0,1,0,1],"position_m":[9.0,9.0,9.0],"reprojection_px":1.5,"views":["c1"]}},"pairs":1,"status":"ok","views_used":["c1"]}],"status":"ok","time_s":null,"views_missing":{"c2":"late"},"views_present":["c1"]}
{"frame":5,"people":[],"reason":"late","status":"no result","time_s":null,"views_missing":{},"views_present":[]}
"#;
    const TIMES: &str = r#"{"frame":4,"sent_ms":50.5,"epoch":3,"views":{"c1":{"camera":{"epoch":1,"captured_ms":10.0,"sent_ms":12.0},"pose":{"epoch":2,"sent_ms":20.0}},"c2":{"camera":null,"pose":null}}}
"#;

    fn parse(poses: &str, times: &str, cameras: &[String]) -> Result<Vec<FrameResult>, Failure> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("pose3d.jsonl"), poses).unwrap();
        std::fs::write(folder.path().join("times.jsonl"), times).unwrap();
        read(folder.path(), cameras)
    }

    #[test]
    fn both_files_are_joined_by_frame() {
        let cameras = ["c1", "c2"].map(str::to_owned);
        let got = parse(POSES, TIMES, &cameras).unwrap();
        let [moment] = &got[..] else {
            panic!("frame 5 has no times: {got:?}")
        };
        assert_eq!((moment.frame, moment.sent_ms), (4, 50.5));
        assert_eq!(moment.people[0][13], Some([1.0, 2.0, 3.0]));
        assert_eq!(moment.people[0].iter().flatten().count(), 1);
        assert_eq!(moment.nearest(&[[7.0; 3]; 14])[13], Some([9.0; 3]));
        let nobody = FrameResult {
            people: Vec::new(),
            ..moment.clone()
        };
        assert_eq!(nobody.nearest(&[[7.0; 3]; 14]), vec![None; 14]);
        assert_eq!(moment.views[0].camera.unwrap().epoch, 1);
        assert_eq!(moment.views[0].pose.unwrap().epoch, 2);
        assert_eq!(moment.epoch, 3);
        assert_eq!(moment.captured_ms(), Some(10.0));
        assert_eq!(moment.views[1].missing.as_deref(), Some("late"));
    }

    #[test]
    fn an_invalid_line_is_an_error() {
        parse("{\"frame\":1", TIMES, &[]).unwrap_err();
        parse(POSES, "x\n", &[]).unwrap_err();
        let wrong = TIMES.replace("\"epoch\":3", "\"epoch\":-3");
        let error = parse(POSES, &wrong, &[]).unwrap_err().to_string();
        for expected in ["times.jsonl", "line 1", "`epoch`", "-3"] {
            assert!(error.contains(expected), "{error}");
        }
    }
}
