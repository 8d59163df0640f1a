//! Laws of the votes, on small grids of few distinct scores so that ties are common.

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

/// A small problem: types, sizes, scores and springs.
#[derive(Debug, Clone)]
struct Case {
    rule: VoteRule,
    grid: Grid,
    child: Vec<f32>,
    parent: Vec<f32>,
}

impl Case {
    fn spreads(&self) -> Vec<f32> {
        let planes = self.child.chunks_exact(self.grid.plane().max(1));
        planes.map(|it| spread(self.grid, it)).collect()
    }

    fn scores<'a>(&'a self, spreads: &'a [f32]) -> ChildScores<'a> {
        ChildScores {
            grid: self.grid,
            planes: &self.child,
            spreads,
        }
    }

    fn cast(&self, isa: Isa, workspace: &mut VoteWorkspace) -> Vec<f32> {
        let mut parent = self.parent.clone();
        let spreads = self.spreads();
        self.rule
            .cast(isa, self.scores(&spreads), &mut parent, workspace);
        parent
    }

    fn padded(grid: Grid, dense: &[f32]) -> Vec<f32> {
        let mut all = Vec::new();
        for row in dense.chunks_exact(grid.cols) {
            all.extend_from_slice(row);
            all.resize(all.len() + grid.stride() - grid.cols, f32::NEG_INFINITY);
        }
        all
    }
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

/// Four values, sixteen of them and real ones; sometimes an impossible cell or an impossible plane.
fn scores() -> impl Strategy<Value = f32> {
    prop_oneof![
        30 => (-8..8_i8).prop_map(|it| f32::from(it) * 0.25),
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
                    let choices = biases.into_iter().map(|it| {
                        it.into_iter()
                            .enumerate()
                            .filter_map(|(s, bias)| Some((s, bias?)))
                            .collect()
                    });
                    let springs = springs.into_iter().enumerate();
                    Case {
                        rule: VoteRule::new(
                            children,
                            springs.map(|(s, spring)| (s % children, spring)).collect(),
                            choices.collect(),
                        ),
                        grid,
                        child: Case::padded(grid, &child),
                        parent: Case::padded(grid, &parent),
                    }
                },
            )
    })
}

proptest! {
    #[test]
    fn every_instruction_set_equals_the_exhaustive_reference(
        case in prop_oneof![cases(1..7, 1..70), cases(1..70, 1..7), cases(10..30, 10..30)],
    ) {
        let mut want = case.parent.clone();
        reference::cast(&case.rule, case.grid, &case.child, &mut want);
        let mut workspace = VoteWorkspace::default();
        for isa in Isa::available() {
            prop_assert_eq!(&case.cast(isa, &mut workspace), &want, "{:?}", isa);
        }
    }

    #[test]
    fn a_workspace_remembers_nothing(a in cases(1..9, 1..40), b in cases(1..9, 1..40)) {
        let mut used = VoteWorkspace::default();
        a.cast(Isa::best(), &mut used);
        let fresh = b.cast(Isa::best(), &mut VoteWorkspace::default());
        prop_assert_eq!(b.cast(Isa::best(), &mut used), fresh);
    }

    #[test]
    fn a_trace_finds_what_was_cast_and_the_first_of_equals(case in cases(1..12, 1..20)) {
        let after = case.cast(Isa::best(), &mut VoteWorkspace::default());
        let (grid, spreads) = (case.grid, case.spreads());
        for l in 0..case.rule.choices.len() {
            for (y, x) in (0..grid.rows).flat_map(|y| (0..grid.cols).map(move |x| (y, x))) {
                let at = l * grid.plane() + grid.at(y, x);
                let found = case.rule.trace(case.scores(&spreads), l, [y, x]);
                let vote = found.map_or(f32::NEG_INFINITY, |it| it.score);
                prop_assert_eq!(case.parent[at] + vote, after[at]);
                let Some(found) = found else { continue };
                let score = case.child[found.child_type * grid.plane() + grid.at(found.y, found.x)];
                let again = case.rule.vote(score, [l, found.child_type], [y, x], [found.y, found.x]);
                prop_assert!(again >= found.score);
                let first = first_by_hand(&case, l, [y, x]);
                prop_assert_eq!((found.child_type, found.x, found.y), first);
            }
        }
    }
}

/// `(child type, column, row)` of the best child, the first one in this order, by looking at all.
fn first_by_hand(case: &Case, l: usize, [y, x]: [usize; 2]) -> (usize, usize, usize) {
    let (grid, rule) = (case.grid, &case.rule);
    let mut best = (f32::NEG_INFINITY, (0, 0, 0));
    for &(spring, bias) in &rule.choices[l] {
        let (k, spring) = &rule.springs[spring];
        let plane = &case.child[k * grid.plane()..][..grid.plane()];
        let mut of_plane = (f32::NEG_INFINITY, (0, 0, 0));
        for cx in 0..grid.cols {
            let mut of_column = (f32::NEG_INFINITY, 0);
            for cy in 0..grid.rows {
                let score = plane[grid.at(cy, cx)] + spring.y().score(cy as isize - y as isize);
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

#[test]
fn the_spread_leaves_the_row_padding_out() {
    let grid = Grid { rows: 2, cols: 3 };
    let plane = Case::padded(grid, &[1.0, 4.0, 2.0, -3.0, 0.0, 1.0]);
    assert!((7.0..7.001).contains(&spread(grid, &plane)));
    let grid = Grid { rows: 1, cols: 18 };
    let mut row = [1.0; 18];
    (row[5], row[17]) = (9.0, -2.0);
    assert!((11.0..11.001).contains(&spread(grid, &Case::padded(grid, &row))));
}

#[test]
fn an_impossible_child_makes_its_parent_impossible() {
    let grid = Grid { rows: 2, cols: 3 };
    let spring = Spring {
        w: [0.1, 0.0, 0.1, 0.0],
        anchor: [0, 0],
    };
    let rule = VoteRule::new(1, vec![(0, spring)], vec![vec![(0, 0.5)]]);
    let child = vec![f32::NEG_INFINITY; grid.plane()];
    let mut parent = Case::padded(grid, &[1.0; 6]);
    let spreads = [spread(grid, &child)];
    let mut workspace = VoteWorkspace::default();
    let scores = ChildScores {
        grid,
        planes: &child,
        spreads: &spreads,
    };
    rule.cast(Isa::best(), scores, &mut parent, &mut workspace);
    assert!(parent.iter().all(|&it| it == f32::NEG_INFINITY));
    assert_eq!(rule.trace(scores, 0, [1, 1]), None);
}
