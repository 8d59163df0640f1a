//! Comparison of a problem's derivatives with numeric derivatives.

use super::{Problem, Step, Term};

/// Returns the largest difference between a derivative of the problem and the central difference, relative to 1 + its size. This is for
/// tests: it takes as long as two evaluations for every unknown.
pub fn derivative_error<P: Problem>(problem: &P, step: f64) -> f64 {
    let locals = problem.locals();
    let none = Step {
        shared: vec![0.0; problem.n_shared()],
        locals: locals.iter().map(|size| vec![0.0; *size]).collect(),
    };
    let mut worst: f64 = 0.0;
    for parameter in 0..none.shared.len() {
        let mut by = none.clone();
        by.shared[parameter] = step;
        let of = |term: &Term| {
            sum(
                &mut term.shared_columns(),
                parameter,
                term.residuals().len(),
            )
        };
        worst = worst.max(compared(problem, &by, step, None, &of));
    }
    for (local, size) in locals.into_iter().enumerate() {
        for coordinate in 0..size {
            let mut by = none.clone();
            by.locals[local][coordinate] = step;
            let of = |term: &Term| {
                sum(
                    &mut term.local_columns(),
                    coordinate,
                    term.residuals().len(),
                )
            };
            worst = worst.max(compared(problem, &by, step, Some(local), &of));
        }
    }
    worst
}

/// Returns the sum of the columns of one unknown.
fn sum(columns: &mut dyn Iterator<Item = (usize, &[f64])>, wanted: usize, rows: usize) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    for (_, column) in columns.filter(|column| column.0 == wanted) {
        for (sum, it) in sum.iter_mut().zip(column) {
            *sum += it;
        }
    }
    sum
}

fn compared<P: Problem>(
    problem: &P,
    by: &Step,
    step: f64,
    local: Option<usize>,
    of: &dyn Fn(&Term) -> Vec<f64>,
) -> f64 {
    let back = Step {
        shared: by.shared.iter().map(|shared| -shared).collect(),
        locals: by
            .locals
            .iter()
            .map(|local| local.iter().map(|value| -value).collect())
            .collect(),
    };
    let analytic = terms(problem, local, of);
    let forwards = terms(&problem.moved(by), local, &|term| term.residuals().to_vec());
    let backwards = terms(&problem.moved(&back), local, &|term| {
        term.residuals().to_vec()
    });
    let each = analytic.iter().zip(forwards.iter().zip(&backwards));
    each.map(|(analytic, (a, b))| {
        let numeric = (a - b) / (2.0 * step);
        (analytic - numeric).abs() / (1.0 + numeric.abs())
    })
    .fold(0.0, f64::max)
}

/// Returns the values of all terms, or of the terms of one block.
fn terms<P: Problem>(
    problem: &P,
    local: Option<usize>,
    of: &dyn Fn(&Term) -> Vec<f64>,
) -> Vec<f64> {
    let mut all = Vec::new();
    let mut take = |term: &Term| all.extend(of(term));
    if let Some(local) = local {
        problem.terms_of(local, &mut take);
    } else {
        for local in 0..problem.locals().len() {
            problem.terms_of(local, &mut take);
        }
        problem.priors(&mut take);
    }
    all
}
