//! Detection of a board in a picture.

use crate::boards::board::Kind;
use crate::boards::chess;
use crate::boards::fit::agreeing;
use crate::boards::grow::{Known, grow};
use crate::boards::marker::{Codes, Sighting};
use crate::boards::quads::quads;
use crate::boards::{Board, Corner, Layout, Nothing, Picture};

/// Maximum side of a picture, in pixels, up to which the picture is also searched at twice its size.
const DOUBLED_UP_TO: usize = 2000;
/// Minimum side of a picture, in pixels, from which the picture is also searched at half its size.
const HALVED_FROM: usize = 900;

/// A board found in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Corners of the board, by number.
    pub corners: Vec<Corner>,
    /// Index of the board in [`Finder::variants`].
    pub variant: usize,
    /// True if black and white are swapped.
    pub is_inverted: bool,
    /// True if left and right are swapped. This can only be detected with markers.
    pub is_mirrored: bool,
    /// Number of markers that were read.
    pub n_markers: usize,
}

/// Hints from other pictures of the same camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Hints {
    /// True if black and white are swapped.
    pub is_inverted: Option<bool>,
    /// Index of the board's variant.
    pub variant: Option<usize>,
}

/// A possible form of a board whose description may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// The board in this form.
    pub board: Board,
    /// Layout of the board.
    pub layout: Layout,
    /// Difference from the description, as a sentence; `None` if there is no difference.
    pub note: Option<String>,
}

/// Finds a board in pictures.
#[derive(Debug, Clone)]
pub struct Finder {
    variants: Vec<Variant>,
    codes: Option<Codes>,
}

impl Finder {
    /// Creates a finder for a board and for boards that may be confused with it: with rows and columns swapped, with the older pattern of
    /// `OpenCV`, or with tags counted from below.
    pub fn new(board: &Board) -> Self {
        let codes = board.codes().map(|dictionary| {
            Codes::new(
                dictionary.marker_size(),
                &dictionary.codes()[..board.n_markers().min(dictionary.codes().len())],
            )
        });
        Self {
            variants: variants(board),
            codes,
        }
    }

    /// Returns the board as described, then its other possible forms.
    pub fn variants(&self) -> &[Variant] {
        &self.variants
    }

    /// Returns the rotations after which the board looks the same; for each, the number that every corner then has.
    pub fn look_alikes(&self) -> Vec<Vec<usize>> {
        match &self.variants[0].board {
            board if board.kind == Kind::Chessboard => chess::look_alikes(board),
            _ => Vec::new(),
        }
    }

    /// Finds the board.
    ///
    /// # Errors
    ///
    /// Fails with [`Nothing`], which states what was seen instead.
    pub fn find(&self, picture: &Picture, hints: Hints) -> Result<Found, Nothing> {
        if let Some(codes) = &self.codes {
            return self.by_markers(codes, picture, hints);
        }
        let Variant { board, layout, .. } = &self.variants[0];
        chess::find(picture, board, layout).map(|corners| Found {
            corners,
            variant: 0,
            is_inverted: false,
            is_mirrored: false,
            n_markers: 0,
        })
    }

    fn by_markers(&self, codes: &Codes, picture: &Picture, hints: Hints) -> Result<Found, Nothing> {
        let mut best: Option<(bool, usize, Vec<Sighting>)> = None;
        let mut nothing = Nothing::NoMarkers;
        for is_inverted in [false, true] {
            if hints.is_inverted.is_some_and(|inverted| inverted != is_inverted) {
                continue;
            }
            let seen = if is_inverted {
                picture.inverted()
            } else {
                picture.clone()
            };
            let mut sightings = Vec::new();
            for scale in scales(picture) {
                sightings.extend(read(codes, &seen, scale, self.frames()));
                let Some((variant, agreed)) = self.agreed(&sightings, hints) else {
                    continue;
                };
                let n_best = best.as_ref().map_or(0, |best| best.2.len());
                if agreed.len() > n_best {
                    best = Some((is_inverted, variant, agreed));
                }
                if 2 * n_best.max(best.as_ref().map_or(0, |best| best.2.len())) >= self.n_markers()
                {
                    break;
                }
            }
            if sightings.len() >= 2 {
                nothing = nothing.or(Nothing::Elsewhere {
                    n_markers: sightings.len(),
                });
            }
        }
        let (is_inverted, variant, agreed) = best.ok_or(nothing)?;
        let seen = if is_inverted {
            picture.inverted()
        } else {
            picture.clone()
        };
        let Variant { board, layout, .. } = &self.variants[variant];
        let known: Vec<Known> = agreed
            .iter()
            .filter_map(|sighting| Some((layout.marker(sighting.id)?, sighting)))
            .flat_map(|(marker, it)| (0..4).map(|i| (marker.corners[i], it.corners[i], 1.0)))
            .collect();
        let corners = grow(&seen, board, layout, &known);
        if corners.is_empty() {
            return Err(Nothing::NoCorners);
        }
        Ok(Found {
            corners,
            variant,
            is_inverted,
            is_mirrored: agreed.iter().any(|sighting| sighting.is_mirrored),
            n_markers: agreed.len(),
        })
    }

    fn n_markers(&self) -> usize {
        self.variants[0].layout.markers.len()
    }

    /// Returns the frame widths of a marker to try, in cells; Kalibr's tags have two.
    fn frames(&self) -> &'static [usize] {
        match self.variants[0].board.kind {
            Kind::Grid => &[1, 2],
            Kind::Charuco | Kind::Chessboard => &[1],
        }
    }

    /// Returns the variant of the board with which most detected markers agree, and these markers.
    fn agreed(&self, sightings: &[Sighting], hints: Hints) -> Option<(usize, Vec<Sighting>)> {
        let mut best: Option<(usize, Vec<Sighting>)> = None;
        for (index, variant) in self.variants.iter().enumerate() {
            if hints.variant.is_some_and(|variant| variant != index) {
                continue;
            }
            let agreed = agreeing(&variant.layout, sightings);
            if agreed.len() > best.as_ref().map_or(1, |best| best.1.len()) {
                best = Some((index, agreed));
            }
        }
        best
    }
}

/// Returns the scales at which a picture is searched: 1, then 2 unless the picture is too large, then 0.5 unless it is too small.
fn scales(picture: &Picture) -> Vec<f64> {
    let side = picture.width().max(picture.height());
    let mut scales = vec![1.0];
    if side <= DOUBLED_UP_TO {
        scales.push(2.0);
    }
    if side >= HALVED_FROM {
        scales.push(0.5);
    }
    scales
}

fn read(codes: &Codes, picture: &Picture, scale: f64, frames: &[usize]) -> Vec<Sighting> {
    let scaled = match scale {
        2.0 => picture.doubled(),
        0.5 => match picture.halved() {
            Some(half) => half,
            None => return Vec::new(),
        },
        _ => picture.clone(),
    };
    let mut sightings = codes.read(&scaled, &quads(&scaled), frames);
    for sighting in &mut sightings {
        for corner in &mut sighting.corners {
            *corner = corner.map(|corner| (corner + 0.5) / scale - 0.5);
        }
    }
    sightings
}

fn variants(board: &Board) -> Vec<Variant> {
    let mut list: Vec<Variant> = Vec::new();
    let mut add = |board: Board, layout: Layout, note: Option<String>| {
        if list.iter().all(|variant| variant.layout != layout) {
            list.push(Variant {
                board,
                layout,
                note,
            });
        }
    };
    let counts = |board: &Board| format!("{}x{}", board.columns, board.rows);
    for told in [board.clone(), board.turned()] {
        let turned = (told != *board).then(|| {
            format!(
                "the board has {} squares, corners or tags, not {}",
                counts(&told),
                counts(board)
            )
        });
        match board.kind {
            Kind::Chessboard => {
                if turned.is_none() {
                    add(told.clone(), Layout::of(&told), None);
                }
            }
            Kind::Charuco => {
                for is_legacy in [board.is_legacy, !board.is_legacy] {
                    let it = Board {
                        is_legacy,
                        ..told.clone()
                    };
                    let pattern = (is_legacy != board.is_legacy).then(|| {
                        let which = if is_legacy { "before 4.6" } else { "since 4.6" };
                        format!("the board has the layout of OpenCV {which}: its upper left square is {}",
                            if is_legacy { "white" } else { "black" })
                    });
                    let notes: Vec<String> = turned.iter().cloned().chain(pattern).collect();
                    let note = (!notes.is_empty()).then(|| notes.join("; "));
                    add(it.clone(), Layout::of(&it), note);
                }
            }
            Kind::Grid => {
                for is_from_below in [false, true] {
                    for turn in 0..4 {
                        let layout =
                            regrouped(Layout::of(&told), told.columns, is_from_below, turn);
                        // The description does not state where tags are counted from or how they are rotated.
                        add(told.clone(), layout, turned.clone());
                    }
                }
            }
        }
    }
    list
}

/// Returns a grid whose tags may be counted from the lowest row, and are rotated by quarter turns.
fn regrouped(layout: Layout, columns: usize, is_from_below: bool, turn: usize) -> Layout {
    let rows = layout.markers.len() / columns;
    let mut markers = layout.markers.clone();
    for marker in &mut markers {
        let [column, row] = [marker.id % columns, marker.id / columns];
        let row = if is_from_below { rows - 1 - row } else { row };
        let place = &layout.markers[row * columns + column].corners;
        marker.corners = [0, 1, 2, 3].map(|nth| place[(nth + turn) % 4]);
    }
    Layout {
        points: markers.iter().flat_map(|marker| marker.corners).collect(),
        markers,
        ..layout
    }
}
