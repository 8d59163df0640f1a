//! Search for the board in the pictures of every camera.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use calibration::board::Sight;
use calibration::boards::{Board, Finder, Found, Hints, Nothing, Picture};
use failure::{Console, ExitKind, Failure, Stop};
use footage::{Source, SourceInfo, SourceSpec};
use rayon::prelude::*;

use super::frames::{beside, by_clock, slowest};
use super::{CameraFootage, FrameTable, Looked, Seen, footage_failure};

/// Number of pictures that must agree on a property (mirrored, inverted) before it is assumed for all pictures of the camera.
const SURE: usize = 3;

/// Settings of the search.
#[derive(Debug, Clone, Default)]
pub struct LookSettings {
    /// Search every n-th frame. If not set, chosen so that at most `most` pictures are searched.
    pub every: Option<usize>,
    /// Maximum number of pictures to search, per camera.
    pub most: usize,
    /// Number of pictures to search in each path, from the first. If not set, all pictures are searched.
    pub first: Option<u64>,
    /// Assignment of pictures to frames. If not set, the table beside the first video is used.
    pub frames: Option<FrameTable>,
}

/// A picture in which the board was found.
struct Sighting {
    frame: usize,
    /// Index of the path, and index of the picture in that path.
    picture: [usize; 2],
    found: Found,
}

/// Result of the search in one camera's footage.
struct Raw {
    size: [u32; 2],
    n_pictures: usize,
    found: Vec<Sighting>,
    nothing: BTreeMap<Nothing, usize>,
}

/// Searches all footage for a board.
///
/// # Errors
///
/// Fails if footage cannot be read, or a table does not fit the footage. Fails with [`ExitKind::Interrupted`] on a stop request.
pub fn look(
    board: &Board,
    cameras: &[CameraFootage],
    settings: &LookSettings,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Looked, Failure> {
    let finder = Finder::new(board);
    let frames = frame_table(cameras, settings, console)?;
    let infos: Vec<Vec<SourceInfo>> = cameras
        .iter()
        .map(|camera| {
            let each = camera.paths.iter().map(|path| {
                let source = Source::open(&SourceSpec::upright(path)).map_err(footage_failure)?;
                Ok(source.info().clone())
            });
            each.collect()
        })
        .collect::<Result<_, Failure>>()?;
    let rates: Vec<Option<f64>> = infos.iter().map(|info| info[0].frame_rate_hz).collect();
    let slowest_hz = slowest(&rates);
    let n_pictures =
        |infos: &Vec<SourceInfo>| infos.iter().map(|info| info.n_frames as usize).sum();
    let longest: usize = infos.iter().map(n_pictures).max().unwrap_or(0);
    let every = settings.every.unwrap_or_else(|| longest.div_ceil(settings.most.max(1)).max(1));
    console.begin("", "looking for the board");
    let total: usize = infos.iter().map(n_pictures).sum::<usize>();
    console.set(0, total);
    let is_over = AtomicBool::new(false);
    let raw: Vec<Result<Raw, Failure>> = cameras
        .par_iter()
        .map(|camera| {
            let table = match &frames {
                None => None,
                Some(table) => {
                    Some(table.of(&camera.name).ok_or_else(|| unknown(table, &camera.name))?)
                }
            };
            let task = CameraTask {
                finder: &finder,
                camera,
                table,
                slowest_hz,
                every,
                first: settings.first,
                console,
                is_over: &|| is_over.load(Ordering::Relaxed) || stop.is_requested(),
            };
            let found = task.look();
            if found.is_err() {
                is_over.store(true, Ordering::Relaxed);
            }
            found
        })
        .collect();
    console.finish();
    let raw = raw.into_iter().collect::<Result<Vec<Raw>, Failure>>()?;
    stop.check("stopped")?;
    Ok(agreed(&finder, raw))
}

/// Returns the table that assigns pictures to frames, if there is one.
fn frame_table(
    cameras: &[CameraFootage],
    settings: &LookSettings,
    console: &dyn Console,
) -> Result<Option<FrameTable>, Failure> {
    Ok(match (&settings.frames, cameras.first()) {
        (Some(table), _) => Some(table.clone()),
        (None, Some(first)) if cameras.len() > 1 => {
            let table = beside(&first.paths[0])?;
            if table.is_some() {
                console.message(
                    "pictures are assigned to frames by timestamps.csv beside the footage",
                );
            }
            table
        }
        _ => None,
    })
}

fn unknown(table: &FrameTable, camera: &str) -> Failure {
    let known: Vec<&str> = table.cameras().collect();
    Failure::new(
        ExitKind::Input,
        format!(
            "the table of timestamps has the cameras {}, but not {camera}",
            known.join(", ")
        ),
    )
    .with_hint("pass the footage as NAME=PATH, with the name or number from the table")
}

struct CameraTask<'a> {
    finder: &'a Finder,
    camera: &'a CameraFootage,
    table: Option<&'a [usize]>,
    slowest_hz: Option<f64>,
    every: usize,
    first: Option<u64>,
    console: &'a dyn Console,
    is_over: &'a (dyn Fn() -> bool + Sync),
}

impl CameraTask<'_> {
    fn look(&self) -> Result<Raw, Failure> {
        let mut raw = Raw {
            size: [0; 2],
            n_pictures: 0,
            found: Vec::new(),
            nothing: BTreeMap::new(),
        };
        let mut before = 0;
        for (nth_path, path) in self.camera.paths.iter().enumerate() {
            let mut source = Source::open(&SourceSpec::upright(path)).map_err(footage_failure)?;
            let size = [
                source.info().size.width as u32,
                source.info().size.height as u32,
            ];
            if raw.size != [0; 2] && raw.size != size {
                return Err(Failure::new(
                    ExitKind::Input,
                    format!(
                        "{path}: {}x{} pixels, but other pictures of {} have {}x{}",
                        size[0], size[1], self.camera.name, raw.size[0], raw.size[1]
                    ),
                ));
            }
            raw.size = size;
            let mut count = 0;
            while let Some(picture) = source.next_frame().map_err(footage_failure)? {
                if (self.is_over)() {
                    return Ok(raw);
                }
                if self.first.is_some_and(|value| picture.index >= value) {
                    break;
                }
                count += 1;
                self.console.advance(1);
                let nth = before + picture.index as usize;
                let frame = match self.table {
                    Some(table) => table.get(nth).copied(),
                    None if self.camera.paths.len() > 1 => Some(nth),
                    None => Some(by_clock(picture.index, picture.time_s, self.slowest_hz)),
                };
                let Some(frame) = frame.filter(|frame| frame.is_multiple_of(self.every)) else {
                    continue;
                };
                let grey = Picture::of_rgb(size[0] as usize, size[1] as usize, picture.rgb);
                if let Some(grey) = grey {
                    let picture = [nth_path, picture.index as usize];
                    self.look_at(&mut raw, (frame, picture), &grey);
                }
            }
            before += count;
        }
        Ok(raw)
    }

    fn look_at(&self, raw: &mut Raw, (frame, picture): (usize, [usize; 2]), grey: &Picture) {
        raw.n_pictures += 1;
        match self.finder.find(grey, hints(&raw.found)) {
            Ok(found) => raw.found.push(Sighting {
                frame,
                picture,
                found,
            }),
            Err(nothing) => *raw.nothing.entry(nothing).or_default() += 1,
        }
    }
}

/// Returns the properties on which all pictures of a camera agree so far.
fn hints(found: &[Sighting]) -> Hints {
    let all_same = |property: &dyn Fn(&Found) -> usize| {
        let first = property(&found.first()?.found);
        (found.len() >= SURE && found.iter().all(|one| property(&one.found) == first))
            .then_some(first)
    };
    Hints {
        is_inverted: all_same(&|found| usize::from(found.is_inverted)).map(|value| value == 1),
        variant: all_same(&|found| found.variant),
    }
}

/// Chooses the variant of the board that most pictures show, and collects each camera's sights of this variant.
fn agreed(finder: &Finder, raw: Vec<Raw>) -> Looked {
    let mut votes = vec![0; finder.variants().len()];
    for it in raw.iter().flat_map(|camera| &camera.found) {
        votes[it.found.variant] += it.found.corners.len();
    }
    // If votes are equal, the first variant is chosen, which is the board that the user named.
    let best = (0..votes.len()).rev().max_by_key(|i| votes[*i]).unwrap_or(0);
    let variant = &finder.variants()[best];
    let cameras = raw.into_iter().enumerate().map(|(camera, raw)| {
        let own: Vec<&Sighting> =
            raw.found.iter().filter(|sighting| sighting.found.variant == best).collect();
        let count =
            |is: &dyn Fn(&Found) -> bool| own.iter().filter(|sighting| is(&sighting.found)).count();
        let mut nothing: Vec<(Nothing, usize)> = raw.nothing.into_iter().collect();
        nothing.sort_by_key(|entry| core::cmp::Reverse(entry.1));
        Seen {
            size: raw.size,
            n_pictures: raw.n_pictures,
            n_inverted: count(&|found| found.is_inverted),
            n_mirrored: count(&|found| found.is_mirrored),
            sights: own
                .iter()
                .map(|sighting| {
                    let corners =
                        sighting.found.corners.iter().map(|corner| (corner.id, corner.at));
                    Sight::new(camera, sighting.frame, corners, &variant.layout.points)
                })
                .collect(),
            nothing,
            pictures: own.iter().map(|sighting| (sighting.frame, sighting.picture)).collect(),
        }
    });
    Looked {
        board: variant.board.clone(),
        note: variant.note.clone(),
        cameras: cameras.collect(),
        layout: variant.layout.clone(),
    }
}
