//! Tables of a model: filters, springs and biases, and the order of the messages.

use fmp::{Layout, Model, N_CHANNELS};

use crate::Unsuitable;
use crate::suits::{self, Child};

/// Number of filters that a workgroup of `responses` computes.
pub(crate) const PANEL: usize = 160;
/// Value used instead of minus infinity.
const NEVER: f32 = -1.0e30;
/// Maximum number of parts that are traced together.
const GROUP: usize = 4;

/// Parts whose subtrees have equal height: their messages are computed together.
#[derive(Debug)]
pub(crate) struct Step {
    /// For each part: its index, its number of children, and its first child in [`Tree::children`].
    pub(crate) jobs: Vec<[u32; 4]>,
    /// Indices of the planes to transform.
    pub(crate) planes: Vec<u32>,
}

/// Tables of a model for layouts of one size.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) n_parts: usize,
    pub(crate) n_types: usize,
    /// Side of every filter, in cells.
    pub(crate) side: usize,
    /// Longest offset in the tables of costs, in cells.
    pub(crate) reach: usize,
    /// Filter weights, `[panel][tap][channel / 4][filter of the panel][channel % 4]`.
    pub(crate) weights: Vec<f32>,
    /// Biases, `[part][type of the parent][type]`.
    pub(crate) bias: Vec<f32>,
    /// Stiffness and best offset of every plane, first vertical, then horizontal.
    pub(crate) springs: Vec<[f32; 4]>,
    /// Costs, `[plane][vertical, horizontal][offset + reach]`.
    pub(crate) costs: Vec<f32>,
    pub(crate) parents: Vec<u32>,
    pub(crate) children: Vec<u32>,
    /// Steps of the messages, from the leaves to the root.
    pub(crate) steps: Vec<Step>,
    /// Parts of equal depth, from the root to the leaves; 0 marks an empty slot.
    pub(crate) groups: Vec<[u32; GROUP]>,
    pub(crate) root_bias: f32,
}

impl Tree {
    /// Makes the tables.
    ///
    /// * `slots`: number of parts that are traced together.
    pub(crate) fn new(model: &Model, layout: &Layout, slots: usize) -> Result<Self, Unsuitable> {
        let shape = suits::shape(model)?;
        let children = suits::children(model)?;
        let longest = layout.levels.iter().map(|level| level.rows.max(level.cols)).max();
        let mut tree = Self {
            n_parts: model.n_parts(),
            n_types: shape.n_types,
            side: shape.side,
            reach: longest.unwrap_or(0) + 16,
            weights: weights(model, shape.side),
            bias: vec![NEVER; model.n_parts() * shape.n_types * shape.n_types],
            springs: vec![[1.0, 0.0, 1.0, 0.0]; model.n_filters()],
            costs: Vec::new(),
            parents: vec![0; model.n_parts()],
            children: Vec::new(),
            steps: Vec::new(),
            groups: Vec::new(),
            root_bias: model.spec().root_bias as f32,
        };
        tree.costs = vec![0.0; model.n_filters() * 4 * tree.reach];
        for child in children {
            tree.parents[child.part] = child.edge.parent as u32;
            tree.tie(&child);
        }
        tree.order(slots);
        Ok(tree)
    }

    /// Writes the biases, springs and costs of a part.
    fn tie(&mut self, child: &Child<'_>) {
        let Child {
            part,
            edge,
            springs,
        } = *child;
        for (own, spring) in springs.iter().enumerate() {
            let plane = part * self.n_types + own;
            let [xx, x, yy, y] = spring.w;
            let axes = [(yy, y, spring.anchor[1]), (xx, x, spring.anchor[0])];
            for (axis, (quadratic, linear, anchor)) in axes.into_iter().enumerate() {
                let anchor = f64::from(anchor);
                let centre = anchor + linear / (2.0 * quadratic);
                self.springs[plane][2 * axis] = quadratic as f32;
                self.springs[plane][2 * axis + 1] = centre as f32;
                let first = (plane * 2 + axis) * 2 * self.reach;
                for (at, cost) in self.costs[first..][..2 * self.reach].iter_mut().enumerate() {
                    let d = anchor - (at as f64 - self.reach as f64);
                    *cost = -(quadratic * d * d + linear * d) as f32;
                }
            }
            for (of_parent, bias) in edge.bias.iter().enumerate() {
                let at = (part * self.n_types + of_parent) * self.n_types + own;
                self.bias[at] = (bias[own] as f32).max(NEVER);
            }
        }
    }

    /// Determines the steps of the messages and the groups of the traces.
    fn order(&mut self, slots: usize) {
        let (n_parts, n_types) = (self.n_parts, self.n_types);
        let (mut height, mut depth) = (vec![0; n_parts], vec![0; n_parts]);
        for part in 1..n_parts {
            depth[part] = depth[self.parents[part] as usize] + 1;
        }
        for part in (1..n_parts).rev() {
            let parent = self.parents[part] as usize;
            height[parent] = height[parent].max(height[part] + 1);
        }
        for wanted in 0..=height[0] {
            let parts: Vec<usize> = (0..n_parts).filter(|part| height[*part] == wanted).collect();
            let planes = parts.iter().filter(|part| **part > 0);
            let planes = planes.flat_map(|part| part * n_types..(part + 1) * n_types);
            let planes = planes.map(|plane| plane as u32).collect();
            let jobs = parts.iter().map(|part| self.job(*part)).collect();
            self.steps.push(Step { jobs, planes });
        }
        let deepest = depth.iter().copied().max().unwrap_or(0);
        for wanted in 1..=deepest {
            let parts: Vec<usize> = (1..n_parts).filter(|part| depth[*part] == wanted).collect();
            for some in parts.chunks(slots) {
                let mut group = [0; GROUP];
                for (slot, part) in group.iter_mut().zip(some) {
                    *slot = *part as u32;
                }
                self.groups.push(group);
            }
        }
        // Buffers on the device must not be empty.
        if self.groups.is_empty() {
            self.groups.push([0; GROUP]);
        }
        self.children.push(0);
    }

    /// Returns the part, its number of children, and the index of the first child. The children are in descending order. This is the order
    /// in which `fmp::Solver` adds their messages.
    fn job(&mut self, part: usize) -> [u32; 4] {
        let first = self.children.len();
        let children = (1..self.n_parts).rev();
        let children = children.filter(|child| self.parents[*child] as usize == part);
        let children: Vec<u32> = children.map(|child| child as u32).collect();
        self.children.extend(&children);
        [part as u32, children.len() as u32, first as u32, 0]
    }
}

fn weights(model: &Model, side: usize) -> Vec<f32> {
    let filters = &model.spec().filters;
    let quads = side * side * N_CHANNELS / 4;
    let mut weights = vec![0.0; filters.len().div_ceil(PANEL) * quads * PANEL * 4];
    for (filter_idx, filter) in filters.iter().enumerate() {
        let (panel, within) = (filter_idx / PANEL, filter_idx % PANEL);
        for (at, weight) in filter.weights.iter().enumerate() {
            let quad = panel * quads + at / 4;
            weights[(quad * PANEL + within) * 4 + at % 4] = *weight as f32;
        }
    }
    weights
}
