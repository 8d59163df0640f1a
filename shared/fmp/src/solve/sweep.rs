//! Computes all max-sum messages on one level, from the leaves to the root, and backtracks the best tree.

use std::sync::atomic::Ordering;

use kernels::{ChildScores, Grid, MessageWorkspace, OwnScores, ScoreBuffer, ScoreRange};

use super::{ExtraTerms, Root, Solver};
use crate::{Placement, Pose, Responses, Window};

/// Score planes of one level, reused from level to level.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// One plane for each part and type, part by part, with the messages of the children added; a margin follows the last plane.
    planes: ScoreBuffer,
    /// Score ranges of the planes.
    ranges: Vec<ScoreRange>,
    /// The level of the planes, if they may be reused.
    level: Option<u16>,
    /// The slack under which the planes were computed.
    slack: f64,
    /// The keys of every part's terms.
    keys: Vec<Option<u64>>,
    /// True for a part whose planes can be reused because all terms of its subtree are unchanged.
    stays: Vec<bool>,
    /// True for a part whose own score has been written.
    begun: Vec<bool>,
    /// Sum, over all parts, of the part's largest own score.
    own: f64,
    /// Number of message entries that the last sweep computed.
    n_computed: usize,
    /// A part's position term, `rows x cols`.
    term: Vec<f32>,
    messages: MessageWorkspace,
}

/// A level on which all messages have been computed.
#[derive(Debug)]
pub(super) struct Sweep<'a> {
    solver: &'a Solver,
    level: u16,
    /// The searched cells of the level; rows and columns are counted from its corner.
    window: Window,
    grid: Grid,
    workspace: &'a Workspace,
}

/// The problem to solve on a level.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    solver: &'a Solver,
    evidence: &'a Responses<'a>,
    extra: Option<&'a dyn ExtraTerms>,
    level: u16,
    window: Window,
    /// The response maps of the level.
    maps: &'a [f32],
    grid: Grid,
    slack: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        solver: &'a Solver,
        evidence: &'a Responses<'a>,
        extra: Option<&'a dyn ExtraTerms>,
        level: u16,
    ) -> Self {
        let window = evidence.window(usize::from(level));
        let offered = evidence.scope().levels().contains(&level);
        Self {
            solver,
            evidence,
            extra,
            level,
            window,
            maps: if offered {
                evidence.maps(usize::from(level))
            } else {
                &[]
            },
            grid: Grid {
                rows: window.rows,
                cols: window.cols,
            },
            slack: f64::INFINITY,
        }
    }

    /// Limits the problem to poses whose score is below the bound of the level by less than `slack`; other poses may get a score that is
    /// too low.
    ///
    /// Terms can then be raised to a minimum: a pose that loses more than `slack` by one term is still ruled out if the term is raised so
    /// that it loses exactly `slack`. This makes the differences between scores smaller, and with them the windows of the transforms.
    pub(super) fn with_slack(self, slack: f64) -> Self {
        Self { slack, ..self }
    }

    fn responses(&self, part: usize, mixture: usize) -> &'a [f32] {
        let filter = self.solver.model.spec().parts[part].filter_of_type[mixture];
        let area = self.grid.rows * self.grid.cols;
        &self.maps[filter * area..][..area]
    }

    /// Returns the part's position term at all cells of the window, if it has one.
    fn position_term<'b>(&self, part: usize, buffer: &'b mut [f32]) -> Option<&'b [f32]> {
        let extra = self.extra?;
        buffer.fill(0.0);
        let level = usize::from(self.level);
        let cols = self.evidence.layout().levels[level].cols;
        let Window { top, left, .. } = self.window;
        if self.grid.cols == cols {
            let has_one = extra.add_position(part, level, top * cols, buffer);
            return has_one.then_some(buffer);
        }
        let mut has_one = false;
        for (y, row) in buffer.chunks_exact_mut(self.grid.cols).enumerate() {
            has_one = extra.add_position(part, level, (top + y) * cols + left, row);
            if !has_one {
                break;
            }
        }
        has_one.then_some(buffer)
    }

    /// Returns the part's position term at one placement, if it has one.
    fn term_at(&self, part: usize, at: Placement) -> Option<f32> {
        let level = usize::from(self.level);
        let cols = self.evidence.layout().levels[level].cols;
        let cell = usize::from(at.y) * cols + usize::from(at.x);
        let mut term = [0.0];
        let has_one = self.extra?.add_position(part, level, cell, &mut term);
        has_one.then_some(term[0])
    }

    /// Returns the minimum position term that a part can have in a pose that loses less than `slack`; `None` if no term is lower.
    fn worst_term(&self, part: usize, slack: f64) -> Option<f32> {
        let extra = self.extra?;
        let types = 0..self.solver.model.n_types(part);
        let types = types.map(|kind| f64::from(extra.of_type(part, kind)));
        let best_type = types.fold(f64::NEG_INFINITY, f64::max);
        let worst = f64::from(extra.max_gain(part)) - best_type - slack;
        let worst = (worst as f32).next_down();
        worst.is_finite().then_some(worst)
    }

    /// Returns the number of message entries of a full sweep.
    pub(super) fn n_entries(&self) -> usize {
        (self.solver.model.n_parts() - 1) * self.n_cells()
    }

    fn n_cells(&self) -> usize {
        self.grid.rows * self.grid.cols
    }

    /// Memory needed by the planes of the level, in bytes.
    pub(super) fn bytes(&self) -> usize {
        let n_planes = self.solver.first_planes[self.solver.model.n_parts()];
        (self.grid.len(n_planes) + self.grid.margin()) * size_of::<f32>()
    }
}

impl<'a> Sweep<'a> {
    /// Computes all messages, except those that the workspace still contains.
    pub(super) fn run(problem: &Problem<'a>, workspace: &'a mut Workspace) -> Self {
        let (solver, grid) = (problem.solver, problem.grid);
        solver.n_sweeps.fetch_add(1, Ordering::Relaxed);
        workspace.prepare(problem);
        for part in (0..solver.model.n_parts()).rev() {
            workspace.begin(problem, part);
            let edge = solver.model.spec().parts[part].edge.as_ref();
            if let (Some(edge), Some(rule)) = (edge, &solver.rules[part])
                && !workspace.stays[edge.parent]
            {
                workspace.begin(problem, edge.parent);
                let [of_parent, of_child] = [edge.parent, part].map(|part| solver.planes(part));
                let planes = workspace.planes.scores_mut();
                let (before, child) = planes.split_at_mut(grid.len(of_child.start));
                let (ranges, child_ranges) = workspace.ranges.split_at_mut(of_child.start);
                let child = ChildScores {
                    grid,
                    planes: &child[..grid.len(of_child.len()) + grid.margin()],
                    ranges: &child_ranges[..of_child.len()],
                };
                let parent = &mut before[grid.len(of_parent.start)..grid.len(of_parent.end)];
                let parent = (parent, &mut ranges[of_parent]);
                rule.add_message(solver.isa, child, parent, &mut workspace.messages);
                workspace.n_computed += problem.n_cells();
            }
        }
        Self::of(problem, workspace)
    }

    /// Reads a level on which the messages have been computed.
    pub(super) fn of(problem: &Problem<'a>, workspace: &'a Workspace) -> Self {
        Self {
            solver: problem.solver,
            level: problem.level,
            window: problem.window,
            grid: problem.grid,
            workspace,
        }
    }

    pub(super) fn level(&self) -> u16 {
        self.level
    }

    /// Returns the number of message entries that were computed.
    pub(super) fn n_computed(&self) -> usize {
        self.workspace.n_computed
    }

    /// Returns the score of the best root of the level.
    pub(super) fn highest(&self) -> f32 {
        let ranges = &self.workspace.ranges[self.solver.planes(0)];
        let most = ranges.iter().map(|range| range.max + self.solver.root_bias());
        most.fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns the sum, over all parts, of the part's largest own score, if all scores are new.
    pub(super) fn own(&self) -> f64 {
        self.workspace.own
    }

    /// Returns the best root of the level; ties go to the first cell in row-major order, then to the first type.
    pub(super) fn best_root(&self) -> Option<Root> {
        let better = |a: Root, b: Root| if b.score > a.score { b } else { a };
        self.roots().reduce(better).filter(|root| root.score > f32::NEG_INFINITY)
    }

    /// Returns the best type of the root at every cell of the window, in row-major order.
    pub(super) fn roots(&self) -> impl Iterator<Item = Root> {
        let bias = self.solver.root_bias();
        let planes = self.planes(0);
        let n_types = self.solver.model.n_types(0);
        let cells = (0..self.grid.rows).flat_map(|y| (0..self.grid.cols).map(move |x| (y, x)));
        cells.map(move |(y, x)| {
            let scores = (0..n_types).map(|i| planes[self.grid.at(i, y, x)] + bias);
            let first = (0, f32::NEG_INFINITY);
            let (mixture, score) =
                scores.enumerate().fold(first, |best, it| if it.1 > best.1 { it } else { best });
            Root {
                score,
                level: self.level,
                y,
                x,
                mixture,
            }
        })
    }

    /// Returns the best tree with the given root.
    pub(super) fn backtrack(&self, root: Root) -> Option<Pose> {
        let model = &*self.solver.model;
        let mut parts = Vec::with_capacity(model.n_parts());
        let Window { top, left, .. } = self.window;
        parts.push(placement(top + root.y, left + root.x, root.mixture));
        for part in 1..model.n_parts() {
            let edge = model.spec().parts[part].edge.as_ref()?;
            let parent: Placement = parts[edge.parent];
            let child = ChildScores {
                grid: self.grid,
                planes: self.planes(part),
                ranges: &self.workspace.ranges[self.solver.planes(part)],
            };
            let found = self.solver.rules[part].as_ref()?.trace(
                child,
                usize::from(parent.mixture),
                [usize::from(parent.y) - top, usize::from(parent.x) - left],
            )?;
            parts.push(placement(top + found.y, left + found.x, found.child_type));
        }
        Some(Pose {
            score: root.score,
            level: self.level,
            parts,
        })
    }

    /// Returns the part's planes and the margin after them.
    fn planes(&self, part: usize) -> &[f32] {
        let planes = self.solver.planes(part);
        let [first, end] = [planes.start, planes.end].map(|plane| self.grid.len(plane));
        &self.workspace.planes.scores()[first..end + self.grid.margin()]
    }
}

impl Workspace {
    /// Memory held by the planes, in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.planes.bytes()
    }

    /// Discards the contents, so that nothing is reused.
    pub(super) fn forget(&mut self) {
        self.level = None;
    }

    fn prepare(&mut self, problem: &Problem<'_>) {
        let (solver, grid) = (problem.solver, problem.grid);
        let n_parts = solver.model.n_parts();
        let n_planes = solver.first_planes[n_parts];
        self.planes.resize(grid.len(n_planes) + grid.margin());
        let margin = &mut self.planes.scores_mut()[grid.len(n_planes)..];
        margin.fill(f32::NEG_INFINITY);
        self.ranges.resize(n_planes, ScoreRange::NONE);
        self.term.resize(grid.rows * grid.cols, 0.0);
        self.own = 0.0;
        self.n_computed = 0;
        self.keys.resize(n_parts, None);
        self.stays.clear();
        let same_level = self.level.replace(problem.level) == Some(problem.level);
        // Planes computed with a larger slack can be reused.
        let same_level = same_level && problem.slack <= self.slack;
        if !same_level {
            self.slack = problem.slack;
        }
        for (part, before) in self.keys.iter_mut().enumerate() {
            let key = problem.extra.and_then(|extra| extra.key(part));
            let same = std::mem::replace(before, key) == key && key.is_some();
            self.stays.push(same_level && same);
        }
        for part in (0..n_parts).rev() {
            if let Some(edge) = &solver.model.spec().parts[part].edge {
                self.stays[edge.parent] &= self.stays[part];
            }
        }
        self.begun.clear();
        self.begun.extend_from_slice(&self.stays);
    }

    /// Writes the part's own score, unless it has already been written on this level.
    fn begin(&mut self, problem: &Problem<'_>, part: usize) {
        if std::mem::replace(&mut self.begun[part], true) {
            return;
        }
        let (solver, grid) = (problem.solver, problem.grid);
        let has_term = problem.position_term(part, &mut self.term).is_some();
        if has_term && let Some(worst) = problem.worst_term(part, self.slack) {
            for it in &mut self.term {
                *it = it.max(worst);
            }
        }
        let mut most = f32::NEG_INFINITY;
        for (mixture, plane) in solver.planes(part).enumerate() {
            let own = OwnScores {
                map: problem.responses(part, mixture),
                term: has_term.then_some(&self.term),
                constant: problem.extra.map(|extra| extra.of_type(part, mixture)),
            };
            let scores = &mut self.planes.scores_mut()[grid.len(plane)..grid.len(plane + 1)];
            self.ranges[plane] = own.write(solver.isa, grid, scores);
            most = most.max(self.ranges[plane].max);
        }
        self.own += f64::from(most.max(0.0));
    }
}

/// Computes the score of a given pose; see [`Solver::score`].
pub(super) fn score(problem: &Problem<'_>, pose: &Pose, scores: &mut Vec<f32>) -> f32 {
    let (solver, grid) = (problem.solver, problem.grid);
    let model = &*solver.model;
    assert_eq!(pose.parts.len(), model.n_parts(), "a pose of this model");
    let own = |part: usize| {
        let (at, mixture) = (pose.parts[part], usize::from(pose.parts[part].mixture));
        assert!(problem.window.contains(at), "a placement on the level");
        let (y, x) = (usize::from(at.y), usize::from(at.x));
        let cell = (y - problem.window.top) * grid.cols + (x - problem.window.left);
        let response = problem.responses(part, mixture)[cell];
        let term = problem.term_at(part, at);
        let score = term.map_or(response, |term| response + term);
        let extra = problem.extra;
        extra.map_or(score, |extra| score + extra.of_type(part, mixture))
    };
    scores.clear();
    scores.extend((0..model.n_parts()).map(own));
    for part in (1..model.n_parts()).rev() {
        let edge = model.spec().parts[part].edge.as_ref();
        if let (Some(edge), Some(rule)) = (edge, &solver.rules[part]) {
            let [of_parent, of_child] = [edge.parent, part].map(|i| pose.parts[i]);
            let cell = |placement: Placement| [usize::from(placement.y), usize::from(placement.x)];
            let types = [of_parent, of_child].map(|placement| usize::from(placement.mixture));
            let value = rule.value(scores[part], types, cell(of_parent), cell(of_child));
            scores[edge.parent] += value;
        }
    }
    scores[0] + solver.root_bias()
}

fn placement(y: usize, x: usize, mixture: usize) -> Placement {
    Placement {
        x: x as u16,
        y: y as u16,
        mixture: mixture as u8,
    }
}
