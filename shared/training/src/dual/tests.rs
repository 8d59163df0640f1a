//! Properties of the machine on problems with a known solution or gap.

use proptest::prelude::*;

use super::{Constraint, Cost, Effort, Gap, Machine};
use crate::sparse::Sparse;

const EXACT: Effort = Effort {
    tolerance: 1e-9,
    max_passes: 5000,
};

fn demand(x: &[f32], margin: f64) -> Constraint {
    let x = Sparse::new([(0, x)]);
    Constraint { x, margin }
}

fn solve<K: Ord + Clone + Sync, T: Sync>(machine: &mut Machine<K, T>, effort: Effort) -> Gap {
    machine.solve(effort, &mut fastrand::Rng::with_seed(3), &mut |_| true)
}

fn cost(group: usize, of_unit: f64) -> Cost<usize> {
    Cost { group, of_unit }
}

#[test]
fn two_points_are_separated_at_the_midpoint() {
    // The model is w x + b, with a negative example at 1 and a positive one at 3. Without regularisation of b, w = 1 and b = -2. As b is
    // regularised too, the problem is min w^2 + b^2 with w + b <= -1 and 3 w + b >= 1.
    let mut machine = Machine::new(2, 0..0);
    machine.add(cost(0, 1e6), (), demand(&[3.0, 1.0], 1.0), 0.0);
    machine.add(cost(1, 1e6), (), demand(&[-1.0, -1.0], 1.0), 0.0);
    let gap = solve(&mut machine, EXACT);
    let v = machine.solution();
    assert!(
        (v[0] - 1.0).abs() < 1e-3 && (v[1] + 2.0).abs() < 1e-3,
        "{v:?} {gap:?}"
    );
}

#[test]
fn an_example_with_low_cost_is_violated() {
    let mut machine = Machine::new(1, 0..0);
    machine.add(cost(0, 10.0), (), demand(&[1.0], 1.0), 0.0);
    machine.add(cost(1, 0.1), (), demand(&[-1.0], 1.0), 0.0);
    solve(&mut machine, EXACT);
    // The minimum of v^2 / 2 + 10 max(0, 1 - v) + 0.1 max(0, 1 + v) is at v = 1.
    assert!((machine.solution()[0] - 1.0).abs() < 1e-6);
}

#[test]
fn only_the_worst_example_of_a_group_counts() {
    let value_with = |n: usize| {
        let mut machine = Machine::new(1, 0..0);
        for _ in 0..n {
            machine.add(cost(0, 0.5), (), demand(&[1.0], 1.0), 0.0);
        }
        solve(&mut machine, EXACT);
        machine.solution()[0]
    };
    assert!((value_with(1) - 0.5).abs() < 1e-9);
    assert!((value_with(4) - 0.5).abs() < 1e-9);
}

#[test]
fn an_example_of_zeros_takes_the_whole_cost_of_its_group() {
    // No solution meets the margin, so the loss equals the cost. The dual objective reaches it when the share is the full cost.
    let mut machine = Machine::new(1, 0..0);
    machine.add(cost(0, 0.3), "zeros", demand(&[0.0], 1.0), 0.0);
    let gap = solve(&mut machine, EXACT);
    assert_eq!((gap.primal, gap.dual, gap.n_support), (0.3, 0.3, 1));
    machine.add(
        cost(0, 0.3),
        "zeros that miss more",
        demand(&[0.0], 2.0),
        0.0,
    );
    let gap = solve(&mut machine, EXACT);
    assert_eq!((gap.primal, gap.dual, gap.n_support), (0.6, 0.6, 1));
}

#[test]
fn non_negative_coordinates_stay_non_negative() {
    let mut machine = Machine::new(2, 1..2);
    machine.add(cost(0, 5.0), (), demand(&[1.0, -1.0], 1.0), 0.0);
    let x = Sparse::new([(0, vec![1.0]), (1, vec![-1.0])]);
    machine.add(cost(1, 5.0), (), Constraint { x, margin: 1.0 }, 0.0);
    let mut bounded = Machine::new(2, 1..2);
    let x = Sparse::new([(0, vec![1.0]), (1, vec![-1.0])]);
    bounded.add(cost(0, 5.0), (), Constraint { x, margin: 1.0 }, 0.0);
    solve(&mut bounded, EXACT);
    let v = bounded.solution();
    assert_eq!(v[1], 0.0);
    assert!((v[0] - 1.0).abs() < 1e-6, "the other does the work: {v:?}");
}

/// Random examples: group, features, margin.
fn examples() -> impl Strategy<Value = Vec<(usize, Vec<i8>, i8)>> {
    let example = (0_usize..6, prop::collection::vec(-4_i8..5, 5), 0_i8..3);
    prop::collection::vec(example, 1..30)
}

fn filled(examples: &[(usize, Vec<i8>, i8)]) -> Machine<usize, usize> {
    let mut machine = Machine::new(5, 4..5);
    for (it, (group, x, margin)) in examples.iter().enumerate() {
        let x: Vec<f32> = x.iter().map(|value| f32::from(*value)).collect();
        let x = Sparse::new([(0, &x[..4]), (4, &x[4..])]);
        let demand = Constraint {
            x,
            margin: f64::from(*margin),
        };
        machine.add(cost(*group, 0.3), it, demand, 0.0);
    }
    machine
}

proptest! {
    #[test]
    fn the_gap_closes_and_is_never_negative(examples in examples()) {
        let mut machine = filled(&examples);
        let before = machine.gap();
        prop_assert!(before.dual <= before.primal + 1e-9);
        // The descent converges slowly if groups compete along a direction in which the objective hardly changes. A few of ten thousand
        // such problems need more than 3000 passes.
        let gap = solve(&mut machine, Effort { tolerance: 1e-4, max_passes: 100_000 });
        prop_assert!(gap.dual <= gap.primal + 1e-6);
        prop_assert!(gap.relative() <= 1e-4 || gap.primal < 1e-9, "{gap:?}");
    }

    #[test]
    fn shares_never_exceed_the_cost_of_their_group(examples in examples()) {
        let mut machine = filled(&examples);
        solve(&mut machine, Effort { tolerance: 1e-3, max_passes: 50 });
        let mut totals = [0.0; 6];
        for (it, share) in machine.entries() {
            prop_assert!(share >= 0.0);
            totals[examples[*it].0] += share;
        }
        prop_assert!(totals.iter().all(|total| *total <= 0.3 + 1e-6), "{totals:?}");
    }

    #[test]
    fn the_svm_can_be_restored_from_its_entries(examples in examples(), cut in 0_usize..6) {
        let effort = Effort { tolerance: 1e-4, max_passes: 20 };
        let mut machine = filled(&examples);
        solve(&mut machine, effort);
        machine.retain(|i| examples[*i].0 != cut);
        machine.forget(0.1, usize::MAX, |_| true);
        let mut again = Machine::new(5, 4..5);
        for (it, share) in machine.entries() {
            let (group, x, margin) = &examples[*it];
            let x: Vec<f32> = x.iter().map(|value| f32::from(*value)).collect();
            let x = Sparse::new([(0, &x[..4]), (4, &x[4..])]);
            let margin = f64::from(*margin);
            again.add(cost(*group, 0.3), *it, Constraint { x, margin }, share);
        }
        solve(&mut machine, effort);
        solve(&mut again, effort);
        prop_assert_eq!(machine.solution(), again.solution());
        prop_assert_eq!(machine.gap(), again.gap());
    }

    #[test]
    fn removed_examples_were_not_support_vectors(examples in examples()) {
        let mut machine = filled(&examples);
        solve(&mut machine, Effort { tolerance: 1e-6, max_passes: 2000 });
        let (before, solution) = (machine.gap(), machine.solution());
        machine.forget(0.0, 0, |_| true);
        prop_assert_eq!(machine.len(), before.n_support);
        prop_assert_eq!(machine.solution(), solution);
        let after = machine.gap();
        prop_assert!((after.dual - before.dual).abs() < 1e-9);
    }

    #[test]
    fn protected_examples_are_never_removed(examples in examples()) {
        let mut machine = filled(&examples);
        solve(&mut machine, Effort { tolerance: 1e-6, max_passes: 2000 });
        let even: Vec<usize> = (0..examples.len()).step_by(2).collect();
        machine.forget(0.0, 0, |tag| tag % 2 == 1);
        let kept: Vec<usize> = machine.entries().map(|entry| *entry.0).filter(|tag| tag % 2 == 0).collect();
        prop_assert_eq!(kept, even);
    }
}
