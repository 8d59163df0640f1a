//! A group of as many pyramid levels as the device can access at once, with the computation of their responses, messages, roots and traces.

use std::ops::Range;

use fmp::Layout;
use wgpu::Buffer;

use crate::Unsuitable;
use crate::device::{Device, Piece};
use crate::dispatch::{Dispatch, ROW};
use crate::programs::{Kernel, Programs};
use crate::tree::{PANEL, Tree};

/// Number of cells in a workgroup of the kernels `responses`, `combine` and `roots`. The last constant is the side of a tile of the kernel
/// `transform`.
const RESPONSES: usize = 64;
const COMBINE: usize = 512;
const ROOTS: usize = 128;
const TILE: usize = 32;
/// Number of roots whose trees are traced at once.
pub(crate) const BATCH: usize = 64;
/// Number of values in a range: the maximum score, the inverted minimum score, and the maximum of the part's own score.
const RANGE: usize = 3;

/// A level, in the layout that the kernels expect.
#[derive(Debug, Clone, Copy, bytemuck_derive::Pod, bytemuck_derive::Zeroable)]
#[repr(C)]
struct Level {
    rows: u32,
    cols: u32,
    area: u32,
    cell0: u32,
    feature0: u32,
    stride: u32,
    map0: u32,
    unused: u32,
}

/// A group of levels on the device.
#[derive(Debug)]
pub(crate) struct Group {
    /// Indices of the levels in the layout.
    pub(crate) levels: Range<usize>,
    /// First cell of every level, followed by the number of cells.
    pub(crate) cells: Vec<usize>,
    pub(crate) memory: Memory,
    /// Kernel from features to responses; the kernels for messages and roots follow.
    pub(crate) responses: Dispatch,
    pub(crate) messages: Vec<Dispatch>,
    pub(crate) trace: Dispatch,
    n_planes: usize,
}

/// The buffers of a group.
#[derive(Debug)]
pub(crate) struct Memory {
    levels: Buffer,
    level_of_cell: Buffer,
    /// Responses, `[level][plane][row][col]`.
    pub(crate) maps: Buffer,
    /// Transformed scores, followed by the scores themselves in the same order.
    moved: Buffer,
    scores: Buffer,
    /// Ranges, `[level][plane][range]`.
    pub(crate) ranges: Buffer,
    /// Roots, `[cell][score, type]`. In `peaks`, cells that are not peaks have no type.
    roots: Buffer,
    pub(crate) peaks: Buffer,
    /// Cell and type of each root to trace.
    pub(crate) wanted: Buffer,
    /// Traced trees, `[root][part][x, y, type]`.
    pub(crate) poses: Buffer,
}

/// The buffers of a model, shared by all groups.
#[derive(Debug)]
pub(crate) struct Shared {
    weights: Buffer,
    bias: Buffer,
    springs: Buffer,
    costs: Buffer,
    parents: Buffer,
    children: Buffer,
    depths: Buffer,
    root_bias: Buffer,
}

impl Shared {
    pub(crate) fn new(device: &Device, tree: &Tree) -> Self {
        Self {
            weights: device.table(&tree.weights),
            bias: device.table(&tree.bias),
            springs: device.table(&tree.springs),
            costs: device.table(&tree.costs),
            parents: device.table(&tree.parents),
            children: device.table(&tree.children),
            depths: device.table(&tree.groups),
            root_bias: device.table(&[tree.root_bias]),
        }
    }
}

/// Splits the levels into groups whose maps the device can access.
pub(crate) fn split(device: &Device, layout: &Layout) -> Result<Vec<Range<usize>>, Unsuitable> {
    let bytes_of_cell = (layout.n_filters * size_of::<f32>()) as u64;
    let most = device.max_binding().min(u64::from(ROW) * RESPONSES as u64 * bytes_of_cell);
    let (mut groups, mut first, mut held) = (Vec::new(), 0, 0);
    for (level, size) in layout.levels.iter().enumerate() {
        let needed = (size.rows * size.cols) as u64 * bytes_of_cell;
        if needed > most {
            return Err(Unsuitable::TooSmall {
                what: "bytes for the responses of a level",
                needed,
                has: most,
            });
        }
        if held + needed > most {
            groups.push(first..level);
            (first, held) = (level, 0);
        }
        held += needed;
    }
    groups.push(first..layout.levels.len());
    Ok(groups)
}

/// Arguments from which a group is made.
pub(crate) struct Parts<'a> {
    pub(crate) device: &'a Device,
    pub(crate) programs: &'a Programs,
    pub(crate) tree: &'a Tree,
    pub(crate) shared: &'a Shared,
    pub(crate) layout: &'a Layout,
    /// The features of all levels.
    pub(crate) features: &'a Buffer,
}

/// The tables of the levels of a group.
#[derive(Debug, Default)]
struct Tables {
    levels: Vec<Level>,
    level_of_cell: Vec<u32>,
    blocks: Vec<[u32; 2]>,
    tiles: Vec<[u32; 4]>,
    cells: Vec<usize>,
}

impl Tables {
    fn new(layout: &Layout, range: Range<usize>) -> Self {
        let padded = |level: usize| layout.levels[level].padded[0] * layout.levels[level].padded[1];
        let mut feature0: usize = (0..range.start).map(padded).sum();
        let mut tables = Self::default();
        for level in range {
            let size = &layout.levels[level];
            let area = size.rows * size.cols;
            let within = tables.levels.len() as u32;
            let cell0 = tables.level_of_cell.len();
            tables.levels.push(Level {
                rows: size.rows as u32,
                cols: size.cols as u32,
                area: area as u32,
                cell0: cell0 as u32,
                feature0: feature0 as u32,
                stride: size.padded[1] as u32,
                map0: (cell0 * layout.n_filters) as u32,
                unused: 0,
            });
            tables.cells.push(cell0);
            tables.level_of_cell.extend(std::iter::repeat_n(within, area));
            let blocks = (0..area).step_by(COMBINE);
            tables.blocks.extend(blocks.map(|first| [within, first as u32]));
            for y in (0..size.rows).step_by(TILE) {
                let tiles = (0..size.cols).step_by(TILE);
                tables.tiles.extend(tiles.map(|x| [within, y as u32, x as u32, 0]));
            }
            feature0 += padded(level);
        }
        tables.cells.push(tables.level_of_cell.len());
        tables
    }
}

impl Memory {
    fn new(parts: &Parts<'_>, tables: &Tables) -> Self {
        let device = parts.device;
        let (n_cells, n_planes) = (tables.level_of_cell.len(), parts.layout.n_filters);
        let [maps, moved, scores] = [0; 3].map(|_| device.space((n_cells * n_planes * 4) as u64));
        Self {
            levels: device.table(&tables.levels),
            level_of_cell: device.table(&tables.level_of_cell),
            maps,
            moved,
            scores,
            ranges: device.space((tables.levels.len() * n_planes * RANGE * 4) as u64),
            roots: device.space(n_cells as u64 * 8),
            peaks: device.space(n_cells as u64 * 8),
            wanted: device.space(BATCH as u64 * 4),
            poses: device.space((BATCH * parts.tree.n_parts * 3 * 4) as u64),
        }
    }
}

impl Parts<'_> {
    fn bind(&self, kernel: Kernel, buffers: &[&Buffer], groups: [usize; 2]) -> Dispatch {
        Dispatch::new(self.device, self.programs.get(kernel), buffers, groups)
    }

    /// Makes the kernel from features to responses.
    fn responses(&self, memory: &Memory, n_cells: usize) -> Dispatch {
        let Memory {
            levels,
            level_of_cell,
            maps,
            ..
        } = memory;
        let buffers = [
            levels,
            level_of_cell,
            self.features,
            &self.shared.weights,
            maps,
        ];
        let panels = self.layout.n_filters.div_ceil(PANEL);
        let groups = [n_cells.div_ceil(RESPONSES), panels];
        self.bind(Kernel::Responses, &buffers, groups)
    }

    /// Makes the kernels for the messages, from the leaves to the root, and for the peaks of the root.
    fn messages(&self, memory: &Memory, tables: &Tables) -> Vec<Dispatch> {
        let Memory {
            levels,
            level_of_cell,
            maps,
            moved,
            scores,
            ranges,
            roots,
            peaks,
            ..
        } = memory;
        let Shared {
            children,
            bias,
            springs,
            costs,
            root_bias,
            ..
        } = self.shared;
        let blocks = self.device.table(&tables.blocks);
        let tiles = self.device.table(&tables.tiles);
        let mut all = Vec::new();
        for step in &self.tree.steps {
            let jobs = self.device.table(&step.jobs);
            let buffers = [
                levels, &blocks, &jobs, children, bias, maps, moved, scores, ranges,
            ];
            let groups = [tables.blocks.len(), step.jobs.len()];
            all.push(self.bind(Kernel::Combine, &buffers, groups));
            if !step.planes.is_empty() {
                let planes = self.device.table(&step.planes);
                let buffers = [
                    levels, &tiles, &planes, springs, costs, ranges, scores, moved,
                ];
                let groups = [tables.tiles.len(), step.planes.len()];
                all.push(self.bind(Kernel::Transform, &buffers, groups));
            }
        }
        let buffers = [levels, level_of_cell, root_bias, scores, roots];
        let groups = [tables.level_of_cell.len().div_ceil(ROOTS), 1];
        all.push(self.bind(Kernel::Roots, &buffers, groups));
        let buffers = [levels, level_of_cell, roots, peaks];
        all.push(self.bind(Kernel::Peaks, &buffers, groups));
        all
    }

    /// Makes the kernel that traces trees from their roots.
    fn trace(&self, memory: &Memory) -> Dispatch {
        let Memory {
            levels,
            level_of_cell,
            scores,
            ranges,
            wanted,
            poses,
            ..
        } = memory;
        let Shared {
            parents,
            bias,
            costs,
            springs,
            depths,
            ..
        } = self.shared;
        let buffers = [
            levels,
            level_of_cell,
            wanted,
            parents,
            bias,
            costs,
            scores,
            ranges,
            springs,
            depths,
            poses,
        ];
        self.bind(Kernel::Trace, &buffers, [BATCH, 1])
    }
}

impl Group {
    /// Prepares the kernels for a range of levels.
    pub(crate) fn new(parts: &Parts<'_>, range: Range<usize>) -> Self {
        let tables = Tables::new(parts.layout, range.clone());
        let memory = Memory::new(parts, &tables);
        Self {
            levels: range,
            responses: parts.responses(&memory, tables.level_of_cell.len()),
            messages: parts.messages(&memory, &tables),
            trace: parts.trace(&memory),
            cells: tables.cells,
            memory,
            n_planes: parts.layout.n_filters,
        }
    }

    /// The maps of a level of the layout.
    pub(crate) fn maps_of(&self, level: usize) -> Piece<'_> {
        let within = level - self.levels.start;
        let [first, end] =
            [within, within + 1].map(|at| (self.cells[at] * self.n_planes * 4) as u64);
        Piece {
            buffer: &self.memory.maps,
            at: first,
            n: end - first,
        }
    }
}

/// Converts an order-preserving integer back to its number; see `key` in the kernels.
pub(crate) fn number(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 {
        key & 0x7fff_ffff
    } else {
        !key
    })
}

/// The ranges of a level: the best score, and the largest own score of every part.
pub(crate) fn extremes(ranges: &[u32], tree: &Tree) -> (f32, Vec<f32>) {
    let of = |part: usize, which: usize| {
        let planes = part * tree.n_types..(part + 1) * tree.n_types;
        planes.map(move |plane| number(ranges[plane * RANGE + which]))
    };
    let best = of(0, 0).map(|most| most + tree.root_bias);
    let largest = (0..tree.n_parts).map(|part| of(part, 2).fold(f32::NEG_INFINITY, f32::max));
    (best.fold(f32::NEG_INFINITY, f32::max), largest.collect())
}
