//! What a view shows of one person: the maps of a network near the candidate, as evidence for joints.

use fmp::{Placement, Pose, Responses, Window};
use multiview::{JointEvidence, ViewPlan};
use nalgebra::Vector2;
use posenetwork::interpolate;
use skeleton::PARSE14;

/// Number of joints.
const N: usize = PARSE14.joints.len();
/// Most places of a joint that a view offers.
const N_MAXIMA: usize = 3;
/// How far beyond the parts of a candidate its person is looked for, share of the longer side of the rectangle around them.
const BEYOND: f64 = 0.3;
/// The window of a network about a person, as a multiple of the longer side of the rectangle around the parts.
const WINDOW: f64 = 1.375;

/// The responses of a view near one person, as evidence for joints.
pub(crate) struct PersonEvidence<'a> {
    /// The responses of the level, joint by joint.
    maps: &'a [f32],
    window: Window,
    /// The pixel at the centre of the window's first cell, and pixels for each cell.
    first_px: [f64; 2],
    cell_px: f64,
    /// The part of the picture where the person may be: left, top, right, bottom, pixels.
    near: [f64; 4],
    floor: f32,
    maxima: Vec<Vec<([f64; 2], f32)>>,
    /// By how much every joint had moved from the instant of the frame when the picture was taken, pixels; empty if that was then.
    since_instant: Vec<Vector2<f64>>,
    /// Height of the window of a network about the person, pixels.
    pub(crate) window_px: f64,
}

impl<'a> PersonEvidence<'a> {
    pub(crate) fn new(plan: &ViewPlan, responses: &Responses<'a>, pose: &Pose, floor: f32) -> Self {
        let mut near = [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ];
        for [x, y] in plan.centres(pose) {
            near = [
                near[0].min(x),
                near[1].min(y),
                near[2].max(x),
                near[3].max(y),
            ];
        }
        let longer = (near[2] - near[0]).max(near[3] - near[1]);
        let level = usize::from(pose.level);
        let window = responses.window(level);
        let more = BEYOND * longer;
        let mut evidence = Self {
            maps: responses.maps(level),
            first_px: first_cell(plan, level, &window),
            cell_px: plan.scale(level),
            window,
            near: [
                near[0] - more,
                near[1] - more,
                near[2] + more,
                near[3] + more,
            ],
            floor,
            maxima: Vec::new(),
            since_instant: Vec::new(),
            window_px: WINDOW * longer,
        };
        evidence.maxima = (0..N).map(|joint| evidence.highest(joint)).collect();
        evidence
    }

    /// Moves all that it shows to the instant of the frame.
    ///
    /// * `since_instant`: by joint.
    pub(crate) fn move_to_instant(&mut self, since_instant: Vec<Vector2<f64>>) {
        for (maxima, by) in self.maxima.iter_mut().zip(&since_instant) {
            for (at, _) in maxima {
                *at = [at[0] - by.x, at[1] - by.y];
            }
        }
        self.since_instant = since_instant;
    }

    /// The highest maxima of a joint's map near the person: pixels of the frame, and the evidence there.
    fn highest(&self, joint: usize) -> Vec<([f64; 2], f32)> {
        let window = &self.window;
        let map = self.map(joint);
        let least = self.floor + 1e-3;
        let mut found: Vec<([f64; 2], f32)> = Vec::new();
        for (row, line) in map.chunks_exact(window.cols.max(1)).enumerate() {
            // Most of a map is the floor.
            let above = line.iter().enumerate().filter(|(_, here)| **here > least);
            for (column, here) in above {
                let at = self.pixel(row, column);
                if !self.is_near(at) {
                    continue;
                }
                let mut rows = row.saturating_sub(1)..(row + 2).min(window.rows);
                let is_highest = rows.all(|it| {
                    let first = it * window.cols;
                    let columns = column.saturating_sub(1)..(column + 2).min(window.cols);
                    map[first + columns.start..first + columns.end]
                        .iter()
                        .all(|other| other <= here)
                });
                if is_highest {
                    found.push((at, *here));
                }
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.truncate(N_MAXIMA);
        found
    }

    fn map(&self, joint: usize) -> &'a [f32] {
        let area = self.window.rows * self.window.cols;
        &self.maps[joint * area..(joint + 1) * area]
    }

    /// The centre of a cell of the window, pixels of the frame.
    fn pixel(&self, row: usize, column: usize) -> [f64; 2] {
        let cell = [column as f64, row as f64];
        [0, 1].map(|axis| self.first_px[axis] + cell[axis] * self.cell_px)
    }

    fn is_near(&self, [x, y]: [f64; 2]) -> bool {
        let [left, top, right, bottom] = self.near;
        (left..=right).contains(&x) && (top..=bottom).contains(&y)
    }
}

/// The centre of the first cell of a window, pixels of the frame.
fn first_cell(plan: &ViewPlan, level: usize, window: &Window) -> [f64; 2] {
    let at = Placement {
        x: window.left as u16,
        y: window.top as u16,
        mixture: 0,
    };
    plan.layout().centre(level, [1, 1], at)
}

impl JointEvidence for PersonEvidence<'_> {
    fn at(&self, joint: usize, mut point: [f64; 2]) -> f32 {
        if let Some(by) = self.since_instant.get(joint) {
            point = [point[0] + by.x, point[1] + by.y];
        }
        if !self.is_near(point) {
            return self.floor;
        }
        let cell = [0, 1].map(|axis| (point[axis] - self.first_px[axis]) / self.cell_px);
        let map = self.map(joint);
        interpolate(map, [self.window.cols, self.window.rows], cell).unwrap_or(self.floor)
    }

    fn maxima(&self, joint: usize) -> &[([f64; 2], f32)] {
        &self.maxima[joint]
    }

    fn floor(&self) -> f32 {
        self.floor
    }
}
