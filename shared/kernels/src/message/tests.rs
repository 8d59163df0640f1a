//! Tests the properties of messages, on small grids with few distinct scores so that ties are common.

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::sized;

/// A small problem: types, sizes, scores and springs.
#[derive(Debug, Clone)]
struct Case {
    rule: MessageRule,
    grid: Grid,
    child: Vec<f32>,
    parent: Vec<f32>,
}

impl Case {
    fn ranges(&self) -> Vec<ScoreRange> {
        let planes = 0..self.child.len() / self.grid.len(1).max(1);
        planes.map(|plane| range(self.grid, &self.child, plane)).collect()
    }

    fn scores<'a>(&'a self, ranges: &'a [ScoreRange]) -> ChildScores<'a> {
        ChildScores {
            grid: self.grid,
            planes: &self.child,
            ranges,
        }
    }

    /// The parent's planes and their ranges after the message.
    fn add_message(
        &self,
        isa: Isa,
        workspace: &mut MessageWorkspace,
    ) -> (Vec<f32>, Vec<ScoreRange>) {
        let mut parent = self.parent.clone();
        let mut of_parent = vec![ScoreRange::NONE; self.rule.choices.len()];
        let ranges = self.ranges();
        let child = self.scores(&ranges);
        self.rule.add_message(isa, child, (&mut parent, &mut of_parent), workspace);
        (parent, of_parent)
    }

    /// Converts planes to the layout in memory, without the margin after the last one.
    fn padded(grid: Grid, dense: &[f32]) -> Vec<f32> {
        let mut all = Vec::new();
        for plane in dense.chunks_exact(grid.rows * grid.cols) {
            all.resize(all.len() + grid.margin(), f32::NEG_INFINITY);
            for row in plane.chunks_exact(grid.cols) {
                all.extend_from_slice(row);
                all.resize(all.len() + grid.stride() - grid.cols, f32::NEG_INFINITY);
            }
        }
        all
    }
}

/// The smallest and the largest score of a plane, by definition.
fn range(grid: Grid, planes: &[f32], plane: usize) -> ScoreRange {
    let cells = (0..grid.rows).flat_map(|y| (0..grid.cols).map(move |x| grid.at(plane, y, x)));
    let ScoreRange { mut min, mut max } = ScoreRange::NONE;
    for cell in cells {
        (min, max) = (min.min(planes[cell]), max.max(planes[cell]));
    }
    ScoreRange { min, max }
}

fn springs() -> impl Strategy<Value = Spring> {
    let quadratic = prop_oneof![Just(0.01), Just(0.25), 0.01..0.1];
    let linear = prop_oneof![Just(0.0), -0.05..0.05];
    (
        (quadratic.clone(), linear.clone(), quadratic, linear),
        [-9..10_i32, -9..10_i32],
    )
        .prop_map(|(w, anchor)| Spring {
            w: w.into(),
            anchor,
        })
}

/// Scores that have one of four values, one of sixteen values, or any value. Sometimes a cell or a whole plane is impossible.
fn scores() -> impl Strategy<Value = f32> {
    prop_oneof![
        30 => (-8..8_i8).prop_map(|value| f32::from(value) * 0.25),
        10 => -1.0..1.0_f32,
    ]
}

fn cases(
    rows: std::ops::Range<usize>,
    cols: std::ops::Range<usize>,
) -> impl Strategy<Value = Case> {
    (1..4_usize, 1..4_usize, rows, cols).prop_flat_map(|(parents, children, rows, cols)| {
        let grid = Grid { rows, cols };
        let bias = prop_oneof![5 => scores(), 1 => Just(f32::NEG_INFINITY)];
        (
            vec(springs(), children + 2),
            vec(
                vec(prop::option::weighted(0.8, bias), children + 2),
                parents,
            ),
            vec(scores(), children * rows * cols),
            vec(scores(), parents * rows * cols),
            prop::option::weighted(0.2, 0..children * rows * cols),
            prop::bool::weighted(0.2),
        )
            .prop_map(
                move |(springs, biases, mut child, parent, hole, whole_plane)| {
                    if let Some(hole) = hole {
                        child[hole] = f32::NEG_INFINITY;
                        if whole_plane {
                            child[..rows * cols].fill(f32::NEG_INFINITY);
                        }
                    }
                    let choices = biases.into_iter().map(|row| {
                        row.into_iter()
                            .enumerate()
                            .filter_map(|(s, bias)| Some((s, bias?)))
                            .collect()
                    });
                    let springs = springs.into_iter().enumerate();
                    Case {
                        rule: MessageRule::new(
                            children,
                            springs.map(|(s, spring)| (s % children, spring)).collect(),
                            choices.collect(),
                        ),
                        grid,
                        child: with_margin(grid, &child),
                        parent: Case::padded(grid, &parent),
                    }
                },
            )
    })
}

proptest! {
    #[test]
    fn every_instruction_set_equals_the_exhaustive_reference(
        case in prop_oneof![
            cases(1..7, 1..sized(70, 20)),
            cases(1..sized(70, 20), 1..7),
            cases(10..sized(30, 12), 10..sized(30, 12)),
        ],
    ) {
        let mut want = case.parent.clone();
        reference::add_message(&case.rule, case.grid, &case.child, &mut want);
        let mut workspace = MessageWorkspace::default();
        for isa in Isa::available() {
            let (parent, ranges) = case.add_message(isa, &mut workspace);
            prop_assert_eq!(&parent, &want, "{:?}", isa);
            for (l, it) in ranges.into_iter().enumerate() {
                prop_assert_eq!(it, range(case.grid, &want, l), "{:?}", isa);
            }
        }
    }

    #[test]
    fn own_scores_are_added_cell_by_cell(
        (grid, map, term) in (1..12_usize, 1..40_usize).prop_flat_map(|(rows, cols)| {
            let cells = rows * cols;
            (Just(Grid { rows, cols }), vec(scores(), cells), vec(scores(), cells))
        }),
        with_term: bool,
        constant in prop::option::of(scores()),
    ) {
        let sum = |cell: usize| {
            let score = if with_term { map[cell] + term[cell] } else { map[cell] };
            constant.map_or(score, |constant| score + constant)
        };
        let want: Vec<f32> = (0..map.len()).map(sum).collect();
        let want = Case::padded(grid, &want);
        let own = OwnScores { map: &map, term: with_term.then_some(&term), constant };
        for isa in Isa::available() {
            let mut plane = vec![f32::NAN; grid.len(1)];
            let found = own.write(isa, grid, &mut plane);
            prop_assert_eq!(&plane, &want, "{:?}", isa);
            prop_assert_eq!(found, range(grid, &want, 0), "{:?}", isa);
        }
    }

    #[test]
    fn a_workspace_has_no_effect_on_later_messages(a in cases(1..9, 1..sized(40, 9)), b in cases(1..9, 1..sized(40, 9))) {
        let mut used = MessageWorkspace::default();
        a.add_message(Isa::best(), &mut used);
        let fresh = b.add_message(Isa::best(), &mut MessageWorkspace::default()).0;
        prop_assert_eq!(b.add_message(Isa::best(), &mut used).0, fresh);
    }

    #[test]
    fn a_trace_finds_the_first_child_with_the_value_of_the_message(case in cases(1..sized(12, 5), 1..sized(20, 6))) {
        let after = case.add_message(Isa::best(), &mut MessageWorkspace::default()).0;
        let (grid, ranges) = (case.grid, case.ranges());
        for l in 0..case.rule.choices.len() {
            for (y, x) in (0..grid.rows).flat_map(|y| (0..grid.cols).map(move |x| (y, x))) {
                let at = grid.at(l, y, x);
                let found = case.rule.trace(case.scores(&ranges), l, [y, x]);
                let value = found.map_or(f32::NEG_INFINITY, |found| found.score);
                prop_assert_eq!(case.parent[at] + value, after[at]);
                let Some(found) = found else { continue };
                let score = case.child[grid.at(found.child_type, found.y, found.x)];
                let again = case.rule.value(score, [l, found.child_type], [y, x], [found.y, found.x]);
                prop_assert!(again >= found.score);
                let first = first_by_hand(&case, l, [y, x]);
                prop_assert_eq!((found.child_type, found.x, found.y), first);
            }
        }
    }
}

/// `(child type, column, row)` of the best child, the first one in this order, found by an exhaustive search.
fn first_by_hand(case: &Case, l: usize, [y, x]: [usize; 2]) -> (usize, usize, usize) {
    let (grid, rule) = (case.grid, &case.rule);
    let mut best = (f32::NEG_INFINITY, (0, 0, 0));
    for &(spring, bias) in &rule.choices[l] {
        let (k, spring) = &rule.springs[spring];
        let mut of_plane = (f32::NEG_INFINITY, (0, 0, 0));
        for cx in 0..grid.cols {
            let mut of_column = (f32::NEG_INFINITY, 0);
            for cy in 0..grid.rows {
                let score =
                    case.child[grid.at(*k, cy, cx)] + spring.y().score(cy as isize - y as isize);
                if score > of_column.0 {
                    of_column = (score, cy);
                }
            }
            let score = of_column.0 + spring.x().score(cx as isize - x as isize);
            if score > of_plane.0 {
                of_plane = (score, (*k, cx, of_column.1));
            }
        }
        if of_plane.0 + bias > best.0 {
            best = (of_plane.0 + bias, of_plane.1);
        }
    }
    best.1
}

/// Converts planes to the layout in memory, with the margin after the last one.
fn with_margin(grid: Grid, dense: &[f32]) -> Vec<f32> {
    let mut all = Case::padded(grid, dense);
    all.resize(all.len() + grid.margin(), f32::NEG_INFINITY);
    all
}

#[test]
fn an_impossible_child_makes_its_parent_impossible() {
    let grid = Grid { rows: 2, cols: 3 };
    let spring = Spring {
        w: [0.1, 0.0, 0.1, 0.0],
        anchor: [0, 0],
    };
    let case = Case {
        rule: MessageRule::new(1, vec![(0, spring)], vec![vec![(0, 0.5)]]),
        grid,
        child: with_margin(grid, &[f32::NEG_INFINITY; 6]),
        parent: Case::padded(grid, &[1.0; 6]),
    };
    let mut workspace = MessageWorkspace::default();
    let (parent, ranges) = case.add_message(Isa::best(), &mut workspace);
    assert!(parent.iter().all(|&score| score == f32::NEG_INFINITY));
    assert!(ranges[0].spread().is_nan());
    let ranges = case.ranges();
    assert_eq!(case.rule.trace(case.scores(&ranges), 0, [1, 1]), None);
}
