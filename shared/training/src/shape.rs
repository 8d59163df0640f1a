//! The layout of a model's parameters in the trained vector.

use fmp::{Edge, Filter, Model, ModelError, ModelSpec, N_CHANNELS, PartSpec, Spring, Springs};

/// The smallest quadratic coefficient of a trained spring, in score per cell^2. It keeps every spring convex (Yang
/// & Ramanan 2013).
pub const MIN_STIFFNESS: f64 = 0.01;

/// Scale of the root's bias. In the norm, the square of the bias is multiplied by the square of this factor, so that the bias is
/// regularised only weakly.
const ROOT_BIAS_SCALE: f64 = 0.01;

/// The fixed properties of a model: tree, sizes, names, and rest positions of the springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The source of the model, as text.
    pub name: String,
    /// Names of the parts, root first.
    pub part_names: Vec<String>,
    /// Parent of every part, with a smaller index than the part; `None` for the root.
    pub parents: Vec<Option<usize>>,
    /// For each part, the corresponding part on the other side of the body.
    pub mirror: Option<Vec<usize>>,
    /// Rest position of each type of a part relative to its parent, `[x, y]` in cells: `[part][type]`.
    pub anchors: Vec<Vec<[i32; 2]>>,
    /// Side of every filter, in cells.
    pub side: usize,
    /// Side of a cell, in pixels of its level.
    pub cell_px: usize,
    /// Levels per octave of the pyramid that the model is used with.
    pub interval: usize,
}

/// Layout of the vector of a [`Shape`]: all filters, the quadratic and the linear coefficients of all springs,
/// the biases of all pairs of types, and the root's bias.
///
/// The trained vector is not the model's parameter `w` but `v = (w - w_0) r`, where `w_0` is the least stiffness and `r` the scale of the
/// root's bias. The norm that is minimised is the norm of `v`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates {
    first_type: Vec<usize>,
    first_bias: Vec<usize>,
    filter_len: usize,
    quadratic: usize,
    linear: usize,
    biases: usize,
    root: usize,
}

impl Shape {
    /// Number of parts.
    pub fn n_parts(&self) -> usize {
        self.parents.len()
    }

    /// Number of types of a part.
    pub fn n_types(&self, part: usize) -> usize {
        self.anchors[part].len()
    }

    /// The layout of the trained vector.
    pub fn coordinates(&self) -> Coordinates {
        let mut first_type = vec![0];
        let mut first_bias = vec![0];
        for (part, parent) in self.parents.iter().enumerate() {
            first_type.push(first_type[part] + self.n_types(part));
            let pairs = parent.map_or(0, |parent| self.n_types(parent) * self.n_types(part));
            first_bias.push(first_bias[part] + pairs);
        }
        let n_types = first_type[self.n_parts()];
        let filter_len = self.side * self.side * N_CHANNELS;
        let quadratic = n_types * filter_len;
        let linear = quadratic + 2 * n_types;
        let biases = linear + 2 * n_types;
        Coordinates {
            root: biases + first_bias[self.n_parts()],
            first_type,
            first_bias,
            filter_len,
            quadratic,
            linear,
            biases,
        }
    }

    /// The model with the trained vector `v`.
    ///
    /// # Errors
    ///
    /// Fails with [`ModelError`] if the shape is not a tree or a number is not finite.
    ///
    /// # Panics
    ///
    /// Panics if the length of `v` is not the number of coordinates of the shape.
    pub fn model(&self, v: &[f64], threshold: f64) -> Result<Model, ModelError> {
        let at = self.coordinates();
        assert_eq!(v.len(), at.len(), "the vector must have this shape");
        let n_types = at.first_type[self.n_parts()];
        let filters = (0..n_types).map(|i| Filter {
            rows: self.side,
            cols: self.side,
            weights: v[i * at.filter_len..(i + 1) * at.filter_len].to_vec(),
        });
        Model::new(ModelSpec {
            name: self.name.clone(),
            filters: filters.collect(),
            parts: (0..self.n_parts()).map(|i| self.part(&at, v, i)).collect(),
            root_bias: v[at.root] / ROOT_BIAS_SCALE,
            interval: self.interval,
            cell_px: self.cell_px,
            threshold,
            mirror: self.mirror.clone(),
        })
    }

    fn part(&self, at: &Coordinates, v: &[f64], part: usize) -> PartSpec {
        let (n_types, first) = (self.n_types(part), at.first_type[part]);
        let spring = |k: usize| {
            let quadratic = &v[at.quadratic + 2 * (first + k)..][..2];
            let linear = &v[at.linear + 2 * (first + k)..][..2];
            Spring {
                w: [
                    MIN_STIFFNESS + quadratic[0],
                    linear[0],
                    MIN_STIFFNESS + quadratic[1],
                    linear[1],
                ],
                anchor: self.anchors[part][k],
            }
        };
        let edge = self.parents[part].map(|parent| Edge {
            parent,
            bias: v[at.biases + at.first_bias[part]..at.biases + at.first_bias[part + 1]]
                .chunks(n_types)
                .map(<[f64]>::to_vec)
                .collect(),
            springs: Springs::PerChildType((0..n_types).map(spring).collect()),
        });
        PartSpec {
            name: self.part_names[part].clone(),
            filter_of_type: (first..first + n_types).collect(),
            edge,
        }
    }
}

impl Coordinates {
    /// Length of the vector.
    pub fn len(&self) -> usize {
        self.root + 1
    }

    /// Returns true if the vector is empty. This is never the case, since the root has a bias.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of values in a filter.
    pub fn filter_len(&self) -> usize {
        self.filter_len
    }

    /// Total number of types of all parts.
    pub fn n_types(&self) -> usize {
        self.quadratic / self.filter_len
    }

    /// First index of the filter for a type of a part.
    pub fn filter(&self, part: usize, mixture: usize) -> usize {
        (self.first_type[part] + mixture) * self.filter_len
    }

    /// First index of the two quadratic coefficients `[x, y]` of a spring.
    pub fn quadratic(&self, part: usize, mixture: usize) -> usize {
        self.quadratic + 2 * (self.first_type[part] + mixture)
    }

    /// First index of the two linear coefficients `[x, y]` of a spring.
    pub fn linear(&self, part: usize, mixture: usize) -> usize {
        self.linear + 2 * (self.first_type[part] + mixture)
    }

    /// Index of the bias of a pair of types.
    pub fn bias(&self, part: usize, parent_type: usize, mixture: usize) -> usize {
        let n_types = self.first_type[part + 1] - self.first_type[part];
        self.biases + self.first_bias[part] + parent_type * n_types + mixture
    }

    /// Index of the root's bias, and the value of its feature.
    pub fn root(&self) -> (usize, f32) {
        (self.root, (1.0 / ROOT_BIAS_SCALE) as f32)
    }

    /// The coordinates that must not become negative: the quadratic coefficients above their least value.
    pub fn non_negative(&self) -> std::ops::Range<usize> {
        self.quadratic..self.linear
    }
}
