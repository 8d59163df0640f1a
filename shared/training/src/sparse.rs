//! Sparse vectors made of runs of consecutive values.

use std::sync::Arc;

/// Consecutive non-zero coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Span {
    start: u32,
    len: u32,
    /// Start of the values in the vector's own array or in the shared array.
    at: u32,
    shared: bool,
}

/// A sparse vector, as runs of values in ascending order, times 1 or -1.
///
/// The values of a run belong to the vector, or are stored in an array that many vectors share. The shared array holds the features of one
/// image; each example refers to different windows of it.
///
/// Two vectors in one operation ([`Self::dot_sparse`], [`Self::minus`]) must have the same kinds of runs. Any two
/// runs either begin at the same coordinate and have the same length, or share no coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    spans: Box<[Span]>,
    own: Box<[f32]>,
    shared: Option<Arc<[f32]>>,
    sign: f32,
}

/// The values of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Run {
    /// A copy of the values.
    Own(Vec<f32>),
    /// A range of the shared array.
    Shared {
        /// First index of the range.
        at: usize,
        /// Length of the range.
        len: usize,
    },
}

impl Sparse {
    /// Makes a vector of runs `(start, values)`, which must be in ascending order and must not overlap.
    pub fn new<R: AsRef<[f32]>>(runs: impl IntoIterator<Item = (usize, R)>) -> Self {
        let runs = runs.into_iter();
        Self::sharing(
            None,
            runs.map(|(start, run)| (start, Run::Own(run.as_ref().to_vec()))),
        )
    }

    /// Makes a vector of runs, some of which refer to `shared`.
    ///
    /// # Panics
    ///
    /// Panics if a run would end beyond the end of `shared`.
    pub fn sharing(
        shared: Option<Arc<[f32]>>,
        runs: impl IntoIterator<Item = (usize, Run)>,
    ) -> Self {
        let n_shared = shared.as_ref().map_or(0, |shared| shared.len());
        let mut own = Vec::new();
        let span = |(start, run): (usize, Run)| {
            let (at, len, shared) = match run {
                Run::Own(values) => {
                    own.extend_from_slice(&values);
                    (own.len() - values.len(), values.len(), false)
                }
                Run::Shared { at, len } => {
                    assert!(
                        at + len <= n_shared,
                        "the run must be within the shared values"
                    );
                    (at, len, true)
                }
            };
            Span {
                start: start as u32,
                len: len as u32,
                at: at as u32,
                shared,
            }
        };
        Self {
            spans: runs.into_iter().map(span).collect(),
            own: own.into(),
            shared,
            sign: 1.0,
        }
    }

    /// Memory used by the vector, without the shared array, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.spans) + size_of_val(&*self.own)
    }

    /// The runs with their first coordinates, before the sign is applied.
    fn runs(&self) -> impl Iterator<Item = (usize, &[f32])> {
        let shared = self.shared.as_deref().unwrap_or_default();
        self.spans.iter().map(move |span| {
            let values = if span.shared { shared } else { &self.own };
            let at = span.at as usize;
            (span.start as usize, &values[at..at + span.len as usize])
        })
    }

    /// First coordinate and length of every run.
    pub fn spans(&self) -> impl Iterator<Item = (usize, usize)> {
        let spans = self.spans.iter();
        spans.map(|span| (span.start as usize, span.len as usize))
    }

    /// The values of the run that begins at `start`.
    pub fn run(&self, start: usize) -> Option<Vec<f32>> {
        let found = self.runs().find(|run| run.0 == start);
        found.map(|(_, run)| run.iter().map(|value| self.sign * value).collect())
    }

    /// The squared norm.
    pub fn squared_norm(&self) -> f64 {
        self.runs().map(|(_, run)| sum_of_products(run, run)).sum()
    }

    /// The product with a dense vector.
    pub fn dot(&self, dense: &[f32]) -> f64 {
        let products = self
            .runs()
            .map(|(start, run)| sum_of_products(run, &dense[start..start + run.len()]));
        f64::from(self.sign) * products.sum::<f64>()
    }

    /// The product with another sparse vector.
    pub fn dot_sparse(&self, other: &Self) -> f64 {
        let mut theirs = other.runs().peekable();
        let mut sum = 0.0;
        for (start, run) in self.runs() {
            while theirs.next_if(|theirs| theirs.0 < start).is_some() {}
            if let Some((_, their_run)) = theirs.next_if(|theirs| theirs.0 == start) {
                sum += sum_of_products(run, their_run);
            }
        }
        f64::from(self.sign * other.sign) * sum
    }

    /// Adds `factor` times this vector to a dense one.
    pub fn add_to(&self, dense: &mut [f64], factor: f64) {
        let factor = factor * f64::from(self.sign);
        for (start, run) in self.runs() {
            for (sum, x) in dense[start..start + run.len()].iter_mut().zip(run) {
                *sum += factor * f64::from(*x);
            }
        }
    }

    /// The vector with opposite sign.
    #[must_use]
    pub fn negated(mut self) -> Self {
        self.sign = -self.sign;
        self
    }

    /// This vector minus another.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        let signed =
            |run: &[f32], sign: f32| run.iter().map(|value| sign * value).collect::<Vec<_>>();
        let mut runs: Vec<(usize, Vec<f32>)> = Vec::new();
        let mut theirs = other.runs().peekable();
        for (start, run) in self.runs() {
            while let Some((start, run)) = theirs.next_if(|theirs| theirs.0 < start) {
                runs.push((start, signed(run, -other.sign)));
            }
            let mut run = signed(run, self.sign);
            if let Some((_, their_run)) = theirs.next_if(|theirs| theirs.0 == start) {
                for (a, b) in run.iter_mut().zip(their_run) {
                    *a -= other.sign * b;
                }
            }
            runs.push((start, run));
        }
        runs.extend(theirs.map(|(start, run)| (start, signed(run, -other.sign))));
        Self::new(runs)
    }
}

/// Sums products in sixteen accumulators, so that the compiler can vectorise the loop.
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
    sums.iter().map(|sum| f64::from(*sum)).sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LEN: usize = 40;

    /// Generates runs that begin at multiples of 4 and are 1 to 4 long. Runs at the same position have the same length.
    fn vector() -> impl Strategy<Value = Sparse> {
        let run = (any::<bool>(), prop::collection::vec(-9_i8..9, 4));
        (prop::collection::vec(run, LEN / 4), any::<bool>()).prop_map(|(runs, negated)| {
            let runs = runs.into_iter().enumerate().filter(|run| run.1.0);
            let runs = runs.map(|(at, (_, values))| {
                let values = values[..=at % 4].iter().map(|value| f32::from(*value));
                (4 * at, values.collect::<Vec<_>>())
            });
            let it = Sparse::new(runs);
            if negated { it.negated() } else { it }
        })
    }

    fn dense(it: &Sparse) -> Vec<f64> {
        let mut dense = vec![0.0; LEN];
        it.add_to(&mut dense, 1.0);
        dense
    }

    fn product(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    proptest! {
        #[test]
        fn products_and_differences_equal_those_of_dense_vectors(a in vector(), b in vector()) {
            let (da, db) = (dense(&a), dense(&b));
            let single: Vec<f32> = db.iter().map(|db| *db as f32).collect();
            prop_assert_eq!(a.dot(&single), product(&da, &db));
            prop_assert_eq!(a.dot_sparse(&b), product(&da, &db));
            prop_assert_eq!(a.squared_norm(), product(&da, &da));
            let difference: Vec<f64> = da.iter().zip(&db).map(|(a, b)| a - b).collect();
            prop_assert_eq!(dense(&a.minus(&b)), difference);
        }
    }

    #[test]
    fn shared_values_give_the_same_products() {
        let shared: Arc<[f32]> = [7.0, 1.0, 2.0, 3.0, 8.0].into();
        let runs = [(2, Run::Shared { at: 1, len: 3 }), (9, Run::Own(vec![4.0]))];
        let it = Sparse::sharing(Some(Arc::clone(&shared)), runs);
        let same = Sparse::new([(2, vec![1.0, 2.0, 3.0]), (9, vec![4.0])]);
        assert_eq!(dense(&it), dense(&same));
        assert_eq!(it.dot_sparse(&same), 30.0);
        assert!(
            it.bytes() < same.bytes(),
            "the shared values are not counted"
        );
    }
}
