//! Operations on lists: values and gradients.

use super::matrix::{Matrix, add_product};
use super::record::{At, Back, Record, each};
use crate::networks::ops::joined;

impl<'a> Record<'a> {
    pub(super) fn centre(&mut self, list: At, name: &str) -> At {
        let [mean, factor] =
            self.parameters(name, ["mean", "factor"]).map(|at| self.of_parameter(at));
        let values = self.values(list).iter();
        let columns = mean.iter().zip(factor).cycle();
        let values = values.zip(columns).map(|(value, (mean, factor))| (value - mean) * factor);
        let (dims, values) = (self.dims(list).to_vec(), values.collect());
        self.derived(list, (dims, values), move |_, gradient| {
            let columns = factor.iter().cycle();
            gradient.iter().zip(columns).map(|(a, b)| a * b).collect()
        })
    }

    pub(super) fn concatenate(&mut self, lists: &[At]) -> At {
        let dims: Vec<&[usize]> = lists.iter().map(|list| self.dims(*list)).collect();
        let dims = joined(&dims);
        let sizes: Vec<usize> = lists.iter().map(|list| self.size(*list)).collect();
        let size: usize = sizes.iter().sum();
        let mut values = Vec::with_capacity(self.n * size);
        for sample in 0..self.n {
            for (list, size) in lists.iter().zip(&sizes) {
                values.extend(&self.values(*list)[sample * size..(sample + 1) * size]);
            }
        }
        let lists = lists.to_vec();
        let leads = lists.iter().any(|list| self.leads(*list));
        let back = leads.then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let mut from = 0;
                for (list, of_list) in lists.iter().zip(&sizes) {
                    if record.leads(*list) {
                        let rows = gradient.chunks_exact(size);
                        let part = rows.flat_map(|row| &row[from..from + of_list]);
                        all.add(*list, part.copied().collect());
                    }
                    from += of_list;
                }
            })
        });
        self.record(dims, values, back)
    }

    pub(super) fn connect(&mut self, list: At, name: &str, n_values: usize) -> At {
        let [weight, bias] = self.parameters(name, ["weight", "bias"]);
        let size = self.size(list);
        let weights = Matrix::new(self.of_parameter(weight), size);
        let mut values = self.of_parameter(bias).repeat(self.n);
        let from = Matrix::new(self.values(list), size);
        add_product(&mut values, from, weights.transposed());
        let (learns, leads) = (self.learns(&[weight, bias]), self.leads(list));
        let back = (learns || leads).then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let of = Matrix::new(gradient, n_values);
                if leads {
                    let mut of_list = vec![0.0; record.n * size];
                    add_product(&mut of_list, of, weights);
                    all.add(list, of_list);
                }
                if learns {
                    let mut of_weights = vec![0.0; n_values * size];
                    let from = Matrix::new(record.values(list), size);
                    add_product(&mut of_weights, of.transposed(), from);
                    all.of_parameter(weight, of_weights);
                    all.of_parameter(bias, columns(gradient, n_values));
                }
            })
        });
        self.record(vec![n_values], values, back)
    }

    pub(super) fn slope(&mut self, list: At, name: &str) -> At {
        let slope = self.parameter(name);
        let slopes = self.of_parameter(slope).repeat(self.n);
        let bent = |value: f32, slope: f32| if value > 0.0 { value } else { value * slope };
        let values = each(self.values(list), &slopes, bent);
        let dims = self.dims(list).to_vec();
        let (learns, leads) = (self.learns(&[slope]), self.leads(list));
        let n_values = dims[0];
        let back = (learns || leads).then(|| -> Back<'a> {
            Box::new(move |record, gradient, all| {
                let from = record.values(list);
                if learns {
                    let below = |value: f32, gradient: f32| value.min(0.0) * gradient;
                    let of = each(from, gradient, below);
                    all.of_parameter(slope, columns(&of, n_values));
                }
                if leads {
                    let factors = |value: f32, slope: f32| if value > 0.0 { 1.0 } else { slope };
                    let factors = each(from, &slopes, factors);
                    all.add(list, each(&factors, gradient, |a, b| a * b));
                }
            })
        });
        self.record(dims, values, back)
    }

    pub(super) fn drop_out(&mut self, list: At, share: f32) -> At {
        let kept = 1.0 / (1.0 - share);
        let n = self.n * self.size(list);
        let Some(dice) = &mut self.dice else {
            return list;
        };
        let factors: Vec<f32> =
            (0..n).map(|_| if dice.f32() < share { 0.0 } else { kept }).collect();
        let values = each(self.values(list), &factors, |a, b| a * b);
        let dims = self.dims(list).to_vec();
        self.derived(list, (dims, values), move |_, gradient| {
            each(gradient, &factors, |a, b| a * b)
        })
    }
}

/// The sums of columns.
fn columns(values: &[f32], n: usize) -> Vec<f32> {
    let mut sums = vec![0.0; n];
    for row in values.chunks_exact(n) {
        super::matrix::add_to(&mut sums, row);
    }
    sums
}
