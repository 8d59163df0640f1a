//! A trained flexible mixture of parts, validated at construction.

mod check;

/// A linear template over feature cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// Height of the filter, in cells.
    pub rows: usize,
    /// Width of the filter, in cells.
    pub cols: usize,
    /// The weights: `rows x cols x N_CHANNELS`, channel fastest, then column.
    pub weights: Vec<f64>,
}

/// A quadratic spring between a child and its parent.
///
/// If the parent is at cell `p` and the child at `v`, then `d = p + anchor - v`, and the spring adds
/// `-(w[0] d_x^2 + w[1] d_x + w[2] d_y^2 + w[3] d_y)` to the score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Weights `[d_x^2, d_x, d_y^2, d_y]`, score per cell^2 and per cell; the quadratic weights are positive.
    pub w: [f64; 4],
    /// Offset `[x, y]` of the child from its parent at which `d` is zero, in cells. The released files
    /// count it from 1: `anchor = file - 1`.
    pub anchor: [i32; 2],
}

/// The springs of a child.
#[derive(Debug, Clone, PartialEq)]
pub enum Springs {
    /// One spring per type of the child (the paper's models).
    PerChildType(Vec<Spring>),
    /// One spring per pair of types, `[parent type][child type]`; `None` if the pair never occurs.
    PerTypePair(Vec<Vec<Option<Spring>>>),
}

/// The connection of a part to its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The connection between a part and its parent.
    pub parent: usize,
    /// Score of a pair of types, `[parent type][child type]`; `-inf` if the pair never occurs.
    pub bias: Vec<Vec<f64>>,
    /// Springs between the part and its parent.
    pub springs: Springs,
}

/// One part of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct PartSpec {
    /// Name used in tables and pictures.
    pub name: String,
    /// Index of the filter of every type; one entry per type.
    pub filter_of_type: Vec<usize>,
    /// The parent; `None` for the root, which is part 0.
    pub edge: Option<Edge>,
}

/// A model as read from a file, not yet validated.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSpec {
    /// Description of the model's origin, for human readers.
    pub name: String,
    /// The parts, parents before children.
    pub parts: Vec<PartSpec>,
    /// All filters of the model.
    pub filters: Vec<Filter>,
    /// Score of every root placement.
    pub root_bias: f64,
    /// Levels per octave of the pyramid.
    pub interval: usize,
    /// Side of a feature cell, in pixels of its level.
    pub cell_px: usize,
    /// Minimum score of the positive examples in training; detection uses `min(threshold, -1)`.
    pub threshold: f64,
    /// For every part, the same part on the other side of the body; `None` if unknown.
    pub mirror: Option<Vec<usize>>,
}

/// Reason why a model was rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The model has no parts.
    #[error("the model has no parts")]
    NoParts,
    /// Part 0 has a parent, or another part has none.
    #[error("part {part} has {} parent: part 1 and only part 1 is the root", if *.part == 1 { "a" } else { "no" })]
    Root {
        /// The part in question, counted from 1.
        part: usize,
    },
    /// The parents do not form a tree in which every parent comes before its children.
    #[error(
        "part {part} names part {parent} as its parent: the tree has a cycle or is out of order"
    )]
    Tree {
        /// The part in question, counted from 1.
        part: usize,
        /// The parent of the part, counted from 1.
        parent: usize,
    },
    /// An index in a part is out of range.
    #[error("part {part} names {what} {index}, but the model has only {count}")]
    Missing {
        /// The part in question, counted from 1.
        part: usize,
        /// Kind of item that is indexed.
        what: &'static str,
        /// Index of the item, counted from 1.
        index: usize,
        /// Number of such items in the model.
        count: usize,
    },
    /// The size of an array does not match the header or other arrays.
    #[error("{what} of {whose} has {got} entries, expected {expected}")]
    Size {
        /// Name of the array in question.
        what: &'static str,
        /// The part or filter in question, counted from 1.
        whose: String,
        /// Number of entries found.
        got: usize,
        /// Number of entries expected.
        expected: usize,
    },
    /// A count is out of range.
    #[error("{what} of {whose} is {got}, expected {min} to {max}")]
    Limit {
        /// Name of the count.
        what: &'static str,
        /// The model, or the part or filter (counted from 1), to which the count belongs.
        whose: String,
        /// Value of the count.
        got: usize,
        /// Minimum accepted value.
        min: usize,
        /// Maximum accepted value.
        max: usize,
    },
    /// A type of the parent excludes all types of the child, so no pose can contain it.
    #[error("no type of part {part} is compatible with type {parent_type} of its parent")]
    DeadEnd {
        /// The part in question, counted from 1.
        part: usize,
        /// Type of the parent, counted from 1.
        parent_type: usize,
    },
    /// A pair of types may occur, but has no spring.
    #[error(
        "part {part} has a bias but no spring for type {parent_type} of its parent and its type {own_type}"
    )]
    NoSpring {
        /// The part in question, counted from 1.
        part: usize,
        /// Type of the parent, counted from 1.
        parent_type: usize,
        /// Type of the part, counted from 1.
        own_type: usize,
    },
    /// The mirror permutation does not swap parts in pairs, or does not preserve the tree.
    #[error(
        "part {part} mirrors part {other}, but part {other} does not mirror it, or their parents do not mirror each other"
    )]
    Mirror {
        /// The part in question, counted from 1.
        part: usize,
        /// Mirrored part, counted from 1.
        other: usize,
    },
    /// A number is not finite or too large, or a spring is not stiff enough.
    #[error("{what} of {whose} is {value}, expected {expected}")]
    Value {
        /// Name of the number.
        what: &'static str,
        /// The part or filter in question, counted from 1.
        whose: String,
        /// Value of the number.
        value: f64,
        /// The accepted values.
        expected: &'static str,
    },
}

/// A validated model: its tree, sizes and numbers have been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Model(ModelSpec);

impl Model {
    /// Maximum number of parts in a model.
    pub const MAX_PARTS: usize = 64;
    /// Maximum number of types of a part.
    pub const MAX_TYPES: usize = 32;
    /// Maximum side of a filter, in cells.
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

    /// Returns the specification of the model.
    pub fn spec(&self) -> &ModelSpec {
        &self.0
    }

    /// Returns the number of parts.
    pub fn n_parts(&self) -> usize {
        self.0.parts.len()
    }

    /// Returns the number of types of a part.
    pub fn n_types(&self, part: usize) -> usize {
        self.0.parts[part].filter_of_type.len()
    }

    /// Returns the number of filters.
    pub fn n_filters(&self) -> usize {
        self.0.filters.len()
    }

    /// Returns the filter of a part's type.
    pub fn filter(&self, part: usize, mixture: usize) -> &Filter {
        &self.0.filters[self.0.parts[part].filter_of_type[mixture]]
    }

    /// Returns the largest `[rows, cols]` over all filters, in cells.
    pub fn max_filter(&self) -> [usize; 2] {
        let largest = |side: fn(&Filter) -> usize| self.0.filters.iter().map(side).max();
        [
            largest(|filter| filter.rows).unwrap_or(0),
            largest(|filter| filter.cols).unwrap_or(0),
        ]
    }

    /// Returns the detection threshold: the trained threshold, but never above -1, as in the reference programs.
    pub fn detection_threshold(&self) -> f64 {
        self.0.threshold.min(-1.0)
    }
}
