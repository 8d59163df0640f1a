//! Computes a rig from footage of a board: searches the pictures, calibrates the cameras, and judges the result.

use std::path::PathBuf;

use calibration::board::{
    BoardError, LensKind, Outcome, Sight, Task, Together, calibrate as adjust,
};
use calibration::boards::{Board, Kind, dictionary_names};
use exports::report::boards::Page;
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use geometry::{Camera, Rig};
use nalgebra::Point2;

use super::{CameraFootage, LookSettings, Looked, Overlay, look, read_corners, worst};

/// Number of worst-fitting pictures in the report.
const WORST: usize = 8;
/// Number of pictures per camera that are searched for other boards if the named board is not found.
const GUESSED_PICTURES: usize = 6;

/// Number of pictures of each side that are needed to prove that a board has two sides. The pictures may be from one camera that sees both
/// sides, or from two cameras.
const LEAST_OF_EACH: usize = 3;

/// Settings of a calibration from a board.
#[derive(Debug, Clone)]
pub struct BoardSettings {
    /// The board that the user named.
    pub board: Board,
    /// Footage of the cameras.
    pub cameras: Vec<CameraFootage>,
    /// Settings of the search for the board.
    pub look: LookSettings,
    /// Table of corners to read instead of searching the pictures.
    pub corners: Option<PathBuf>,
    /// Rig with intrinsics to keep. Its cameras are matched by name.
    pub known: Option<Rig>,
    /// Lens model to estimate.
    pub lens: LensKind,
    /// True if camera poses are estimated, not only intrinsics.
    pub wants_rig: bool,
    /// Maximum number of frames to use.
    pub most_frames: usize,
    /// True if the user knows that all footage is mirrored.
    pub is_mirrored: bool,
    /// Back of the board, if the user specifies it.
    pub back: Option<Back>,
}

/// The back of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Back {
    /// The mirror image of the front: seen through the board, each corner on the back coincides with the same corner on the front.
    Mirrored,
    /// The back is blank. If the codes in a picture look mirrored, the picture itself is mirrored.
    Blank,
}

/// Explanation of mirrored codes.
enum Mirrored {
    /// Nothing needs to be decided: no mirrored codes were seen, an option explains them, or a camera saw both sides.
    Known,
    /// Either the board has two sides, or the pictures of these cameras are mirrored. The adjustment decides which.
    Asked(Vec<usize>),
}

/// A calibration with its inputs.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// Input of the adjustment.
    pub task: Task,
    /// Sights of the board; `None` if the corners were read from a table.
    pub looked: Option<Looked>,
    /// Result of the adjustment.
    pub outcome: Outcome,
    /// The board that was found.
    pub board: Board,
    /// Notes for the user, for example about inverted pictures, or a board that differs from the named one.
    pub notes: Vec<String>,
}

/// Calibrates cameras from a board.
///
/// # Errors
///
/// Fails if inputs cannot be read or are inconsistent, or if [`adjust`] refuses them. Each message says what to try.
pub fn calibrate(
    settings: &BoardSettings,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Calibrated, Failure> {
    let names: Vec<String> = settings.cameras.iter().map(|camera| camera.name.clone()).collect();
    refuse_twins(&names)?;
    let (looked, sights, points, sizes) = sighted(settings, &names, stop, console)?;
    let mut notes = Vec::new();
    let mut asked = Mirrored::Known;
    let mut task = Task {
        known: known(settings.known.as_ref(), &names, &sizes)?,
        names,
        sizes,
        lens: settings.lens,
        look_alikes: calibration::boards::Finder::new(&settings.board).look_alikes(),
        board: points,
        sights,
        wants_rig: settings.wants_rig,
        most_frames: settings.most_frames,
    };
    if let Some(looked) = &looked {
        notes.extend(looked.note.clone());
        asked = mirrored(settings, looked, &mut task, &mut notes)?;
        for (name, seen) in task.names.iter().zip(&looked.cameras) {
            if 2 * seen.n_inverted > seen.sights.len() {
                notes.push(format!(
                    "{name}: black and white are swapped in the pictures"
                ));
            }
        }
    }
    console.begin("", "adjusting");
    let outcome = adjust(&task);
    console.finish();
    if let Mirrored::Asked(cameras) = &asked {
        let agrees = |outcome: &Outcome| sides_agree(outcome, cameras);
        if !outcome.as_ref().is_ok_and(agrees) {
            return Err(left_is_right(&task.names, cameras));
        }
        notes.push(two_sided(&task.names, cameras));
    }
    let outcome = outcome.map_err(|error| refused(&error, looked.as_ref(), &task))?;
    if let Some(it) = outcome.out_of_step {
        notes.push(format!(
            "the residual of the boards is {:.2} px in each camera alone, but {:.2} px in all cameras together, where focal lengths change \
             by up to {:.1} %: the pictures of a frame were not taken at the same time. The lens of each camera was found from its own \
             pictures, and the poses of the cameras from the frames in which the board moves least",
            it.alone_px,
            it.together_px,
            100.0 * it.bent
        ));
    }
    Ok(Calibrated {
        board: looked
            .as_ref()
            .map_or_else(|| settings.board.clone(), |looked| looked.board.clone()),
        task,
        looked,
        outcome,
        notes,
    })
}

/// Fails if two cameras have the same name.
fn refuse_twins(names: &[String]) -> Result<(), Failure> {
    for (nth, name) in names.iter().enumerate() {
        if names[..nth].contains(name) {
            return Err(
                Failure::new(ExitKind::Usage, format!("two cameras are named {name}"))
                    .with_hint("give them different names: NAME=PATH"),
            );
        }
    }
    Ok(())
}

/// Result of the search, sights, points of the board, and picture size of each camera.
type Sighted = (Option<Looked>, Vec<Sight>, Vec<Point2<f64>>, Vec<[u32; 2]>);

/// Returns the sights of the board, read from a table or found in the pictures.
fn sighted(
    settings: &BoardSettings,
    names: &[String],
    stop: &Stop,
    console: &dyn Console,
) -> Result<Sighted, Failure> {
    if let Some(file) = &settings.corners {
        let (sights, points) = read_corners(file, names)?;
        let sizes = settings.cameras.iter().map(CameraFootage::size);
        let sizes = sizes.collect::<Result<Vec<_>, Failure>>()?;
        return Ok((None, sights, points, sizes));
    }
    let cameras = &settings.cameras;
    let looked = look(&settings.board, cameras, &settings.look, stop, console)?;
    let sights = looked.sights();
    if sights.is_empty() {
        return Err(nowhere(settings, &looked, stop));
    }
    let sizes = looked.cameras.iter().map(|camera| camera.size).collect();
    let points = looked.layout.points.clone();
    Ok((Some(looked), sights, points, sizes))
}

/// Explains mirrored codes. They are correct if the back of the board shows the mirror image of the front, because a camera behind the
/// board then sees every corner at its true position. They are an error if the footage is mirrored, unless the user says so. In that case,
/// the board is replaced by its mirror image.
fn mirrored(
    settings: &BoardSettings,
    looked: &Looked,
    task: &mut Task,
    notes: &mut Vec<String>,
) -> Result<Mirrored, Failure> {
    let cameras = looked.mirrored();
    let sees_both = |seen: &&super::Seen| {
        let n_front = seen.sights.len() - seen.n_mirrored;
        seen.n_mirrored.min(n_front) >= LEAST_OF_EACH
    };
    let is_all = cameras.len() == task.names.len();
    if settings.back == Some(Back::Mirrored) {
        return Ok(Mirrored::Known);
    }
    if settings.back.is_none() && !settings.is_mirrored {
        if looked.cameras.iter().any(|seen| sees_both(&seen)) {
            notes.push(
                "a camera saw both normal and mirrored codes: the back of the board has the mirror image of its front".to_owned(),
            );
            return Ok(Mirrored::Known);
        }
        if !cameras.is_empty() && !is_all && settings.wants_rig {
            return Ok(Mirrored::Asked(cameras));
        }
    }
    if cameras.is_empty() {
        return Ok(Mirrored::Known);
    }
    if !settings.is_mirrored || !is_all {
        return Err(left_is_right(&task.names, &cameras));
    }
    let turned =
        |points: &mut Vec<Point2<f64>>| points.iter_mut().for_each(|point| point.x = -point.x);
    turned(&mut task.board);
    task.sights.iter_mut().for_each(|sight| turned(&mut sight.on_board));
    notes.push(
        "all footage is mirrored: results with this rig have left and right swapped".to_owned(),
    );
    Ok(Mirrored::Known)
}

/// Returns true if the cameras that see the back of the board are behind it, according to the cameras that see the front. If the board has
/// only one side and the pictures are mirrored, every picture gives a different camera position.
fn sides_agree(outcome: &Outcome, behind: &[usize]) -> bool {
    let crosses = |pair: &&Together| {
        pair.cameras.iter().filter(|camera| behind.contains(camera)).count() == 1
    };
    let (mut n, mut n_agree) = (0, 0);
    for it in outcome.pairs.iter().filter(crosses) {
        n += it.n;
        n_agree += it.n_agree;
    }
    n >= LEAST_OF_EACH && 5 * n_agree >= 3 * n
}

fn two_sided(names: &[String], behind: &[usize]) -> String {
    let names: Vec<&str> = behind.iter().map(|behind| names[*behind].as_str()).collect();
    format!(
        "{} saw the back of the board: it has the mirror image of the front, and the positions of the cameras confirm this",
        names.join(", ")
    )
}

/// Returns the failure for mirrored codes that a board with two sides does not explain.
fn left_is_right(names: &[String], cameras: &[usize]) -> Failure {
    let is_all = cameras.len() == names.len();
    let named: Vec<&str> = cameras.iter().map(|camera| names[*camera].as_str()).collect();
    let which = if is_all {
        "all cameras".to_owned()
    } else {
        named.join(", ")
    };
    let message = format!(
        "{which} saw mirrored codes: either the back of the board has the mirror image of the front, or the pictures are mirrored"
    );
    let more = if is_all {
        "; or, if all recordings are mirrored, pass --mirrored to calibrate mirrored footage"
    } else {
        ""
    };
    Failure::new(ExitKind::Input, message).with_hint(format!(
        "for a board with two sides, pass --back mirrored; if the pictures are mirrored (as in a webcam preview), switch mirroring off in the camera and record again{more}"
    ))
}

/// Returns the intrinsics to keep, by camera.
fn known(
    rig: Option<&Rig>,
    names: &[String],
    sizes: &[[u32; 2]],
) -> Result<Vec<Option<geometry::Intrinsics>>, Failure> {
    let each = names.iter().zip(sizes).map(|(name, size)| {
        let camera = rig.and_then(|rig| rig.cameras().iter().find(|camera| camera.name == *name));
        match camera {
            Some(camera) if camera.intrinsics.size != *size => {
                let known = camera.intrinsics.size;
                Err(Failure::new(
                    ExitKind::Calibration,
                    format!(
                        "camera {name}: the intrinsics are for {}x{} pixels, but the footage has {}x{}",
                        known[0], known[1], size[0], size[1]
                    ),
                ))
            }
            camera => Ok(camera.map(|camera| camera.intrinsics)),
        }
    });
    let known: Vec<_> = each.collect::<Result<_, _>>()?;
    match rig {
        Some(rig) if known.iter().all(Option::is_none) => {
            let there: Vec<&str> =
                rig.cameras().iter().map(|camera| camera.name.as_str()).collect();
            Err(Failure::new(
                ExitKind::Usage,
                format!(
                    "the calibration in --known has the cameras {}, but none of {}",
                    there.join(", "),
                    names.join(", ")
                ),
            )
            .with_hint("pass the footage as NAME=PATH, with the names from the calibration"))
        }
        _ => Ok(known),
    }
}

/// Returns the failure if no picture shows the board, with a hint about what the pictures may show instead.
fn nowhere(settings: &BoardSettings, looked: &Looked, stop: &Stop) -> Failure {
    let pictures: usize = looked.cameras.iter().map(|camera| camera.n_pictures).sum();
    let failure = Failure::new(
        ExitKind::Input,
        format!(
            "none of {pictures} pictures shows the board {}",
            settings.board
        ),
    );
    let guess = guessed(settings, looked, stop);
    failure.with_hint(guess.unwrap_or_else(|| reasons(looked)))
}

/// Looks for markers of another dictionary, and describes them.
fn guessed(settings: &BoardSettings, looked: &Looked, stop: &Stop) -> Option<String> {
    if settings.board.kind == Kind::Chessboard {
        return None;
    }
    let quiet = failure::Silent;
    let most = looked.cameras.iter().map(|camera| camera.n_pictures).max()?;
    let settings_of = LookSettings {
        every: Some(most.div_ceil(GUESSED_PICTURES).max(1)),
        ..settings.look.clone()
    };
    // The largest dictionary of each family contains the codes of the smaller dictionaries.
    let largest = dictionary_names().filter(|dictionary_name| {
        !["_50", "_100", "_250"].iter().any(|small| dictionary_name.ends_with(small))
    });
    for name in largest {
        let text = settings.board.to_string();
        let mut parts: Vec<&str> = text.split(':').collect();
        parts[3] = &name;
        let Ok(board) = parts.join(":").parse::<Board>() else {
            continue;
        };
        let found = look(&board, &settings.cameras[..1], &settings_of, stop, &quiet).ok()?;
        if !found.sights().is_empty() {
            return Some(format!(
                "the pictures show markers of {name}: try --board {}",
                found.board
            ));
        }
    }
    None
}

/// Returns a hint that explains why the board was not found.
fn reasons(looked: &Looked) -> String {
    use calibration::boards::Nothing;

    let most = looked.cameras.iter().flat_map(|camera| &camera.nothing).max_by_key(|reason| {
        // More informative reasons come first.
        let says = !matches!(reason.0, Nothing::NoGrid | Nothing::NoMarkers);
        (says, reason.1)
    });
    match most.map(|most| most.0) {
        Some(Nothing::OtherGrid { columns, rows }) => format!(
            "the pictures show a chessboard with {columns}x{rows} inner corners: give the number of inner corners, not of squares"
        ),
        Some(Nothing::Elsewhere { n_markers }) => format!(
            "there are markers (up to {n_markers} in a picture), but not in the positions of this board: are the numbers of squares and \
             the dictionary of --board right?"
        ),
        Some(Nothing::NoCorners) => {
            "there is a board, but its corners are not sharp: move it more slowly, or use more light".to_owned()
        }
        _ => "is this the right kind of board, and is it large enough in the pictures (squares of at least 15 px)?".to_owned(),
    }
}

fn refused(error: &BoardError, looked: Option<&Looked>, task: &Task) -> Failure {
    let hint = match error {
        BoardError::TooFewBoards { camera, .. } => {
            let nth = task.names.iter().position(|name| name == camera);
            let seen = nth.and_then(|nth| looked?.cameras.get(nth));
            seen.map_or_else(String::new, |seen| {
                let n = seen.sights.len();
                format!("{n} of {} pictures show a part of the board; {}", seen.n_pictures, looked.map_or_else(String::new, reasons))
            })
        }
        BoardError::NoStart { .. } => "for a wide lens, try --lens fisheye".to_owned(),
        BoardError::Apart { .. } => {
            "if two cameras saw the board at the same time, their pictures are assigned to wrong frames: pass --timestamps, or start the videos at the same time".to_owned()
        }
        BoardError::NotFinite => "try fewer coefficients (--lens five), or known intrinsics (--known)".to_owned(),
    };
    let failure = Failure::new(ExitKind::Calibration, error.clone());
    if hint.is_empty() {
        failure
    } else {
        failure.with_hint(hint)
    }
}

impl Calibrated {
    /// Returns the reasons not to trust the calibration, as sentences.
    pub fn doubts(&self) -> Vec<String> {
        let each = self.outcome.doubts.iter();
        each.map(|doubt| doubt.text(&self.task.names)).collect()
    }

    /// Returns the cameras as a rig. If poses were not estimated, all cameras are at the origin.
    ///
    /// # Errors
    ///
    /// Fails if the calibration contains values that are impossible for a camera.
    pub fn rig(&self) -> Result<Rig, Failure> {
        let cameras: Vec<Camera> =
            self.outcome.cameras.iter().map(|camera| camera.camera.clone()).collect();
        let mut source = format!("calibrate board {}", self.board);
        if !self.task.wants_rig {
            source += "; intrinsics only, without poses";
        }
        if !self.outcome.doubts.is_empty() {
            source += "; the calibration is doubtful: ";
            source += &self.doubts().join("; ");
        }
        Rig::new(cameras, None, source).or_fail(ExitKind::Calibration)
    }

    /// Returns the report as a page.
    ///
    /// # Errors
    ///
    /// Fails if the footage of the worst pictures cannot be read again.
    pub fn page(
        &self,
        cameras: &[CameraFootage],
        about: &[(String, String)],
    ) -> Result<String, Failure> {
        let overlays: Vec<Overlay> = match &self.looked {
            Some(looked) => worst(&self.outcome, cameras, &looked.cameras, WORST)?,
            None => Vec::new(),
        };
        let worst: Vec<(String, Vec<u8>)> = overlays
            .into_iter()
            .map(|overlay| {
                let caption = format!(
                    "{}, frame {}: {:.2} px",
                    self.task.names[overlay.camera], overlay.frame, overlay.rms_px
                );
                (caption, overlay.jpeg)
            })
            .collect();
        let [width, height] = self.board.size_metres();
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        Ok(exports::report::boards::html(&Page {
            names: &self.task.names,
            outcome: &self.outcome,
            has_rig: self.task.wants_rig,
            outline: corners.map(Point2::from),
            about,
            more_doubts: &[],
            worst: &worst,
        }))
    }
}
