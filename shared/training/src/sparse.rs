//! Sparse vectors made of runs.

/// Consecutive coordinates that are not zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Span {
    start: u32,
    len: u32,
}

/// A sparse vector, as runs of values in ascending order.
///
/// Vectors that meet (in [`Self::dot_sparse`], [`Self::minus`]) are made of the same kinds of runs: two
/// runs begin at the same coordinate and have the same length, or share no coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    spans: Box<[Span]>,
    values: Box<[f32]>,
}

impl Sparse {
    /// Makes a vector of runs `(start, values)`, in ascending order and without overlap.
    pub fn new<R: AsRef<[f32]>>(runs: impl IntoIterator<Item = (usize, R)>) -> Self {
        let mut spans: Vec<Span> = Vec::new();
        let mut values = Vec::new();
        for (start, run) in runs {
            let run = run.as_ref();
            spans.push(Span {
                start: start as u32,
                len: run.len() as u32,
            });
            values.extend_from_slice(run);
        }
        Self {
            spans: spans.into(),
            values: values.into(),
        }
    }

    /// Bytes that the vector holds.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.spans) + size_of_val(&*self.values)
    }

    /// The runs, each with where it begins.
    pub fn runs(&self) -> impl Iterator<Item = (usize, &[f32])> {
        let mut at = 0;
        self.spans.iter().map(move |it| {
            let run = &self.values[at..at + it.len as usize];
            at += run.len();
            (it.start as usize, run)
        })
    }

    /// The square of its norm.
    pub fn squared_norm(&self) -> f64 {
        sum_of_products(&self.values, &self.values)
    }

    /// The product with a dense vector.
    pub fn dot(&self, dense: &[f32]) -> f64 {
        self.runs()
            .map(|(start, run)| sum_of_products(run, &dense[start..start + run.len()]))
            .sum()
    }

    /// The product with another sparse vector.
    pub fn dot_sparse(&self, other: &Self) -> f64 {
        let mut theirs = other.runs().peekable();
        let mut sum = 0.0;
        for (start, run) in self.runs() {
            while theirs.next_if(|it| it.0 < start).is_some() {}
            if let Some((_, their_run)) = theirs.next_if(|it| it.0 == start) {
                sum += sum_of_products(run, their_run);
            }
        }
        sum
    }

    /// Adds `factor` times this vector to a dense one.
    pub fn add_to(&self, dense: &mut [f64], factor: f64) {
        for (start, run) in self.runs() {
            for (sum, x) in dense[start..start + run.len()].iter_mut().zip(run) {
                *sum += factor * f64::from(*x);
            }
        }
    }

    /// The vector with its sign changed.
    #[must_use]
    pub fn negated(mut self) -> Self {
        for it in &mut self.values {
            *it = -*it;
        }
        self
    }

    /// This vector less another.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        let mut runs: Vec<(usize, Vec<f32>)> = Vec::new();
        let mut theirs = other.runs().peekable();
        let negative =
            |(start, run): (usize, &[f32])| (start, run.iter().map(|it| -it).collect::<Vec<_>>());
        for (start, run) in self.runs() {
            while let Some(it) = theirs.next_if(|it| it.0 < start) {
                runs.push(negative(it));
            }
            let run = match theirs.next_if(|it| it.0 == start) {
                Some((_, their_run)) => run.iter().zip(their_run).map(|(a, b)| a - b).collect(),
                None => run.to_vec(),
            };
            runs.push((start, run));
        }
        runs.extend(theirs.map(negative));
        Self::new(runs)
    }
}

/// Sums in sixteen strands, so that the compiler can keep them side by side.
fn sum_of_products(a: &[f32], b: &[f32]) -> f64 {
    const STRANDS: usize = 16;
    let mut sums = [0.0_f32; STRANDS];
    let (a, b) = (a.chunks_exact(STRANDS), b.chunks_exact(STRANDS));
    let rest = a.remainder().iter().zip(b.remainder());
    let rest: f64 = rest.map(|(a, b)| f64::from(a * b)).sum();
    for (a, b) in a.zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().map(|it| f64::from(*it)).sum::<f64>() + rest
}
