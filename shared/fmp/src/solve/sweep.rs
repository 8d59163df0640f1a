//! All votes on one level, from the leaves to the root, and the way back.

use kernels::{ChildScores, Grid, Isa, OwnScores, ScoreBuffer, VoteWorkspace};

use super::{Extra, Root, Solver};
use crate::{Model, Placement, Pose, Responses};

/// Score planes of one level, used again from level to level.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// One plane per part and type, part by part, and the margin after the last one; their
    /// children's votes are added.
    planes: ScoreBuffer,
    /// One per plane.
    spreads: Vec<f32>,
    /// Whether the part's own score has been written.
    begun: Vec<bool>,
    /// A part's position term, `rows x cols`.
    term: Vec<f32>,
    votes: VoteWorkspace,
}

/// A level on which all votes have been cast.
#[derive(Debug)]
pub(super) struct Sweep<'a> {
    solver: &'a Solver,
    level: u16,
    grid: Grid,
    workspace: &'a Workspace,
}

/// What there is to solve on a level.
#[derive(Clone, Copy)]
struct Problem<'a> {
    model: &'a Model,
    evidence: &'a Responses<'a>,
    extra: Option<&'a dyn Extra>,
    level: usize,
    grid: Grid,
    isa: Isa,
}

impl<'a> Problem<'a> {
    fn new(
        solver: &'a Solver,
        evidence: &'a Responses<'a>,
        extra: Option<&'a dyn Extra>,
        level: u16,
    ) -> Self {
        let level = usize::from(level);
        let it = &evidence.layout().levels[level];
        Self {
            model: &solver.model,
            isa: solver.isa,
            evidence,
            extra,
            level,
            grid: Grid {
                rows: it.rows,
                cols: it.cols,
            },
        }
    }

    fn responses(&self, part: usize, mixture: usize) -> &'a [f32] {
        let filter = self.model.spec().parts[part].filter_of_type[mixture];
        self.evidence.map(self.level, filter)
    }

    /// The part's position term, `rows x cols`, if it has one.
    fn position_term<'b>(&self, part: usize, buffer: &'b mut Vec<f32>) -> Option<&'b [f32]> {
        let extra = self.extra?;
        buffer.clear();
        buffer.resize(self.grid.rows * self.grid.cols, 0.0);
        extra
            .add_position(part, self.level, buffer)
            .then_some(buffer)
    }
}

impl<'a> Sweep<'a> {
    pub(super) fn run(
        solver: &'a Solver,
        evidence: &Responses<'_>,
        level: u16,
        extra: Option<&dyn Extra>,
        workspace: &'a mut Workspace,
    ) -> Self {
        let model = &*solver.model;
        let problem = Problem::new(solver, evidence, extra, level);
        let grid = problem.grid;
        let n_planes = first_plane(model, model.n_parts());
        workspace.planes.resize(grid.len(n_planes) + grid.margin());
        let margin = &mut workspace.planes.scores_mut()[grid.len(n_planes)..];
        margin.fill(f32::NEG_INFINITY);
        workspace.spreads.resize(n_planes, 0.0);
        workspace.begun.clear();
        workspace.begun.resize(model.n_parts(), false);
        for part in (0..model.n_parts()).rev() {
            workspace.begin(&problem, part);
            let edge = model.spec().parts[part].edge.as_ref();
            if let (Some(edge), Some(rule)) = (edge, &solver.rules[part]) {
                workspace.begin(&problem, edge.parent);
                let [of_parent, of_child] = [edge.parent, part]
                    .map(|it| first_plane(model, it)..first_plane(model, it + 1));
                let planes = workspace.planes.scores_mut();
                let (before, child) = planes.split_at_mut(grid.len(of_child.start));
                let (spreads, of_child_spreads) = workspace.spreads.split_at_mut(of_child.start);
                let child = ChildScores {
                    grid,
                    planes: &child[..grid.len(of_child.len()) + grid.margin()],
                    spreads: &of_child_spreads[..of_child.len()],
                };
                let parent = &mut before[grid.len(of_parent.start)..grid.len(of_parent.end)];
                let parent = (parent, &mut spreads[of_parent]);
                rule.cast(solver.isa, child, parent, &mut workspace.votes);
            }
        }
        Self {
            solver,
            level,
            grid,
            workspace,
        }
    }

    pub(super) fn level(&self) -> u16 {
        self.level
    }

    /// The best root of the level: first cell in row-major order, then first type.
    pub(super) fn best_root(&self) -> Option<Root> {
        let better = |a: Root, b: Root| if b.score > a.score { b } else { a };
        self.roots()
            .reduce(better)
            .filter(|it| it.score > f32::NEG_INFINITY)
    }

    /// The best type of the root at every cell, in row-major order.
    pub(super) fn roots(&self) -> impl Iterator<Item = Root> {
        let bias = self.solver.model.spec().root_bias as f32;
        let planes = self.planes(0);
        let n_types = self.solver.model.n_types(0);
        let cells = (0..self.grid.rows).flat_map(|y| (0..self.grid.cols).map(move |x| (y, x)));
        cells.map(move |(y, x)| {
            let scores = (0..n_types).map(|it| planes[self.grid.at(it, y, x)] + bias);
            let first = (0, f32::NEG_INFINITY);
            let (mixture, score) = scores
                .enumerate()
                .fold(first, |best, it| if it.1 > best.1 { it } else { best });
            Root {
                score,
                level: self.level,
                y,
                x,
                mixture,
            }
        })
    }

    /// The tree that hangs on `root`.
    pub(super) fn backtrack(&self, root: Root) -> Option<Pose> {
        let model = &*self.solver.model;
        let mut parts = Vec::with_capacity(model.n_parts());
        parts.push(placement(root.y, root.x, root.mixture));
        for part in 1..model.n_parts() {
            let edge = model.spec().parts[part].edge.as_ref()?;
            let parent: Placement = parts[edge.parent];
            let planes = first_plane(model, part)..first_plane(model, part + 1);
            let child = ChildScores {
                grid: self.grid,
                planes: self.planes(part),
                spreads: &self.workspace.spreads[planes],
            };
            let found = self.solver.rules[part].as_ref()?.trace(
                child,
                usize::from(parent.mixture),
                [usize::from(parent.y), usize::from(parent.x)],
            )?;
            parts.push(placement(found.y, found.x, found.child_type));
        }
        Some(Pose {
            score: root.score,
            level: self.level,
            parts,
        })
    }

    /// The part's planes and the margin after them.
    fn planes(&self, part: usize) -> &[f32] {
        let model = &*self.solver.model;
        let [first, end] = [part, part + 1].map(|it| self.grid.len(first_plane(model, it)));
        &self.workspace.planes.scores()[first..end + self.grid.margin()]
    }
}

impl Workspace {
    /// Writes the part's own score, unless that has been done on this level.
    fn begin(&mut self, problem: &Problem<'_>, part: usize) {
        if std::mem::replace(&mut self.begun[part], true) {
            return;
        }
        let (model, grid) = (problem.model, problem.grid);
        let term = problem.position_term(part, &mut self.term);
        let first = first_plane(model, part);
        for mixture in 0..model.n_types(part) {
            let own = OwnScores {
                map: problem.responses(part, mixture),
                term,
                constant: problem.extra.map(|it| it.of_type(part, mixture)),
            };
            let plane = first + mixture;
            let scores = &mut self.planes.scores_mut()[grid.len(plane)..grid.len(plane + 1)];
            self.spreads[plane] = own.write(problem.isa, grid, scores);
        }
    }
}

/// See [`Solver::score`].
pub(super) fn score(
    solver: &Solver,
    evidence: &Responses<'_>,
    pose: &Pose,
    extra: Option<&dyn Extra>,
) -> f32 {
    let model = &*solver.model;
    let problem = Problem::new(solver, evidence, extra, pose.level);
    let grid = problem.grid;
    assert_eq!(pose.parts.len(), model.n_parts(), "a pose of this model");
    let mut buffer = Vec::new();
    let mut own = |part: usize| {
        let (at, mixture) = (pose.parts[part], usize::from(pose.parts[part].mixture));
        assert!(
            usize::from(at.y) < grid.rows && usize::from(at.x) < grid.cols,
            "a placement on the level"
        );
        let cell = usize::from(at.y) * grid.cols + usize::from(at.x);
        let response = problem.responses(part, mixture)[cell];
        let term = problem.position_term(part, &mut buffer);
        let score = term.map_or(response, |term| response + term[cell]);
        extra.map_or(score, |it| score + it.of_type(part, mixture))
    };
    let mut scores: Vec<f32> = (0..model.n_parts()).map(&mut own).collect();
    for part in (1..model.n_parts()).rev() {
        let edge = model.spec().parts[part].edge.as_ref();
        if let (Some(edge), Some(rule)) = (edge, &solver.rules[part]) {
            let [of_parent, of_child] = [edge.parent, part].map(|it| pose.parts[it]);
            let cell = |it: Placement| [usize::from(it.y), usize::from(it.x)];
            let types = [of_parent, of_child].map(|it| usize::from(it.mixture));
            let vote = rule.vote(scores[part], types, cell(of_parent), cell(of_child));
            scores[edge.parent] += vote;
        }
    }
    scores[0] + model.spec().root_bias as f32
}

/// Number of planes before those of `part`.
fn first_plane(model: &Model, part: usize) -> usize {
    (0..part).map(|it| model.n_types(it)).sum()
}

fn placement(y: usize, x: usize, mixture: usize) -> Placement {
    Placement {
        x: x as u16,
        y: y as u16,
        mixture: mixture as u8,
    }
}
