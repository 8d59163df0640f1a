//! A trained flexible mixture of parts, validated at construction.

mod check;

/// A linear template over feature cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// Height, cells.
    pub rows: usize,
    /// Width, cells.
    pub cols: usize,
    /// `rows x cols x N_CHANNELS` weights, channel fastest, then column.
    pub weights: Vec<f64>,
}

/// A quadratic spring between a child and its parent.
///
/// With the parent at cell `p` and the child at `v`, `d = p + anchor - v` and the spring adds
/// `-(w[0] d_x^2 + w[1] d_x + w[2] d_y^2 + w[3] d_y)` to the score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// `[d_x^2, d_x, d_y^2, d_y]`, score per cell^2 and per cell; the quadratic ones are positive.
    pub w: [f64; 4],
    /// Offset `[x, y]` of the child from its parent at which `d` is zero, cells. The released files
    /// count it from 1: `anchor = file - 1`.
    pub anchor: [i32; 2],
}

/// The springs of a child.
#[derive(Debug, Clone, PartialEq)]
pub enum Springs {
    /// One spring per type of the child (the paper's models).
    PerChildType(Vec<Spring>),
    /// One spring per pair of types, `[parent type][child type]`; `None` where the pair never occurs.
    PerTypePair(Vec<Vec<Option<Spring>>>),
}

/// The connection of a part to its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The parent's index; always smaller than the child's.
    pub parent: usize,
    /// Score of a pair of types, `[parent type][child type]`; `-inf` where the pair never occurs.
    pub bias: Vec<Vec<f64>>,
    /// The springs.
    pub springs: Springs,
}

/// One part of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct PartSpec {
    /// Name in tables and pictures.
    pub name: String,
    /// Index of the filter of every type; its length is the number of types.
    pub filter_of_type: Vec<usize>,
    /// The parent; `None` for the root, which is part 0.
    pub edge: Option<Edge>,
}

/// A model as read from a file, not yet validated.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSpec {
    /// Where the model comes from, for people.
    pub name: String,
    /// The parts, parents before children.
    pub parts: Vec<PartSpec>,
    /// All filters.
    pub filters: Vec<Filter>,
    /// Score of every root placement.
    pub root_bias: f64,
    /// Levels per octave of the pyramid.
    pub interval: usize,
    /// Side of a feature cell, pixels of its level.
    pub cell_px: usize,
    /// Score above which training found its positives; detection uses `min(threshold, -1)`.
    pub threshold: f64,
    /// The part on the other side of the body for every part; `None` if the model does not know.
    pub mirror: Option<Vec<usize>>,
}

/// Why a model was rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A model finds at least one part.
    #[error("the model has no parts")]
    NoParts,
    /// Part 0 must be the root, and the only one.
    #[error("part {part} has {} parent: part 1 and only part 1 is the root", if *.part == 1 { "a" } else { "no" })]
    Root {
        /// 1-based part.
        part: usize,
    },
    /// The parents do not form a tree in which every parent comes before its children.
    #[error(
        "part {part} names part {parent} as its parent: the tree has a cycle or is out of order"
    )]
    Tree {
        /// 1-based part.
        part: usize,
        /// 1-based parent.
        parent: usize,
    },
    /// An index of a part is out of range.
    #[error("part {part} names {what} {index}, but there are {count}")]
    Missing {
        /// 1-based part.
        part: usize,
        /// The kind of thing.
        what: &'static str,
        /// 1-based index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// The size of an array does not match the header or other arrays.
    #[error("{what} of {whose} has {got} entries, expected {expected}")]
    Size {
        /// The array.
        what: &'static str,
        /// Part or filter, 1-based.
        whose: String,
        /// Entries found.
        got: usize,
        /// Entries expected.
        expected: usize,
    },
    /// A count is out of range.
    #[error("{what} of {whose} is {got}, expected {min} to {max}")]
    Limit {
        /// The count.
        what: &'static str,
        /// The model, or a part or filter, 1-based.
        whose: String,
        /// Its value.
        got: usize,
        /// Least accepted.
        min: usize,
        /// Most accepted.
        max: usize,
    },
    /// A type of the parent forbids all types of the child, so that no pose could contain it.
    #[error("no type of part {part} goes with type {parent_type} of its parent")]
    DeadEnd {
        /// 1-based part.
        part: usize,
        /// 1-based type of its parent.
        parent_type: usize,
    },
    /// A pair of types may occur, but has no spring.
    #[error(
        "part {part} has a bias but no spring for type {parent_type} of its parent and its type {own_type}"
    )]
    NoSpring {
        /// 1-based part.
        part: usize,
        /// 1-based type of its parent.
        parent_type: usize,
        /// 1-based type.
        own_type: usize,
    },
    /// The mirror is not an exchange that leaves the tree as it is.
    #[error(
        "part {part} mirrors part {other}, but not the other way round or not on the same tree"
    )]
    Mirror {
        /// 1-based part.
        part: usize,
        /// 1-based mirror part.
        other: usize,
    },
    /// A number is not finite or too large, or a spring is not stiff enough.
    #[error("{what} of {whose} is {value}, expected {expected}")]
    Value {
        /// The number.
        what: &'static str,
        /// Part or filter, 1-based.
        whose: String,
        /// Its value.
        value: f64,
        /// The accepted values.
        expected: &'static str,
    },
}

/// A model whose tree, sizes and numbers have been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Model(ModelSpec);

impl Model {
    /// Most parts, and most types of a part, that a model may have.
    pub const MAX_PARTS: usize = 64;
    /// See [`Self::MAX_PARTS`].
    pub const MAX_TYPES: usize = 32;
    /// Largest side of a filter, cells.
    pub const MAX_FILTER: usize = 16;

    /// Checks `spec`.
    ///
    /// # Errors
    ///
    /// See [`ModelError`].
    pub fn new(spec: ModelSpec) -> Result<Self, ModelError> {
        check::check(&spec)?;
        Ok(Self(spec))
    }

    /// Returns the specification that the model is made of.
    pub fn spec(&self) -> &ModelSpec {
        &self.0
    }

    /// Number of parts.
    pub fn n_parts(&self) -> usize {
        self.0.parts.len()
    }

    /// Number of types of a part.
    pub fn n_types(&self, part: usize) -> usize {
        self.0.parts[part].filter_of_type.len()
    }

    /// Number of filters.
    pub fn n_filters(&self) -> usize {
        self.0.filters.len()
    }

    /// The filter of a part's type.
    pub fn filter(&self, part: usize, mixture: usize) -> &Filter {
        &self.0.filters[self.0.parts[part].filter_of_type[mixture]]
    }

    /// Largest `[rows, cols]` over all filters, cells.
    pub fn max_filter(&self) -> [usize; 2] {
        let largest = |side: fn(&Filter) -> usize| self.0.filters.iter().map(side).max();
        [
            largest(|filter| filter.rows).unwrap_or(0),
            largest(|filter| filter.cols).unwrap_or(0),
        ]
    }

    /// Detection threshold: the trained one, but never above -1 (the reference programs' rule).
    pub fn detection_threshold(&self) -> f64 {
        self.0.threshold.min(-1.0)
    }
}
