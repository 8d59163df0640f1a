//! Checks whether the kernels support a model and a device. If they do not support them, the search runs on the CPU.

use fmp::{Edge, Layout, Model, Spring, Springs};

use crate::Unsuitable;
use crate::device::Device;
use crate::programs::MAX_BUFFERS;

/// Maximum number of types per part. Cell and type of a root are packed into one number, which has room for this many types.
const MAX_TYPES: usize = 8;
/// Side of a cell, in pixels.
const CELL_PX: usize = 4;
/// Shared memory of the largest kernel, in bytes.
const SHARED: u32 = 16 * 1024;

/// The shape that all parts of a model have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    pub(crate) n_types: usize,
    /// Side of every filter, in cells.
    pub(crate) side: usize,
}

fn without(what: &'static str) -> Unsuitable {
    Unsuitable::Model { what }
}

/// Returns the shape of a model; fails if its parts have different shapes.
pub(crate) fn shape(model: &Model) -> Result<Shape, Unsuitable> {
    let spec = model.spec();
    let n_types = model.n_types(0);
    let [side, cols] = model.max_filter();
    if (0..model.n_parts()).any(|part| model.n_types(part) != n_types) {
        return Err(without("parts with different numbers of types"));
    }
    if n_types > MAX_TYPES {
        return Err(without("parts with more than 8 types"));
    }
    let numbered = spec.parts.iter().flat_map(|part| &part.filter_of_type);
    if !numbered.copied().eq(0..model.n_filters()) {
        return Err(without("filters that are not numbered part by part"));
    }
    if spec.filters.iter().any(|filter| [filter.rows, filter.cols] != [side; 2]) || side != cols {
        return Err(without("filters of different sizes"));
    }
    if spec.cell_px != CELL_PX {
        return Err(without("cells with a side other than 4 pixels"));
    }
    Ok(Shape { n_types, side })
}

/// A part with a parent.
#[derive(Debug)]
pub(crate) struct Child<'a> {
    pub(crate) part: usize,
    pub(crate) edge: &'a Edge,
    /// Springs by type.
    pub(crate) springs: &'a [Spring],
}

/// Every part with a parent.
pub(crate) fn children(model: &Model) -> Result<Vec<Child<'_>>, Unsuitable> {
    let parts = model.spec().parts.iter().enumerate();
    let edges = parts.filter_map(|(part, spec)| Some((part, spec.edge.as_ref()?)));
    let edges = edges.map(|(part, edge)| match &edge.springs {
        Springs::PerChildType(springs) => Ok(Child {
            part,
            edge,
            springs,
        }),
        Springs::PerTypePair(_) => Err(without("springs per pair of types")),
    });
    edges.collect()
}

/// Checks the requirements that do not depend on the model. Returns how many parts the device can trace together.
pub(crate) fn device(device: &Device, n_types: usize) -> Result<usize, Unsuitable> {
    let limits = device.limits();
    let enough = |what, needed: u32, has: u32| {
        if needed <= has {
            return Ok(());
        }
        let [needed, has] = [needed, has].map(u64::from);
        Err(Unsuitable::TooSmall { what, needed, has })
    };
    enough(
        "buffers per kernel",
        MAX_BUFFERS,
        limits.max_storage_buffers_per_shader_stage,
    )?;
    enough(
        "bytes of shared memory per workgroup",
        SHARED,
        limits.max_compute_workgroup_storage_size,
    )?;
    let threads = limits
        .max_compute_invocations_per_workgroup
        .min(limits.max_compute_workgroup_size_x);
    let needed = 32 * n_types as u32;
    enough("threads per workgroup", needed.max(128), threads)?;
    Ok(match threads / needed {
        1 => 1,
        2 | 3 => 2,
        _ => 4,
    })
}

/// Checks that a kernel can access the whole of a buffer.
pub(crate) fn fits(device: &Device, what: &'static str, n_bytes: u64) -> Result<(), Unsuitable> {
    let has = device.max_binding();
    if n_bytes <= has {
        return Ok(());
    }
    Err(Unsuitable::TooSmall {
        what,
        needed: n_bytes,
        has,
    })
}

/// Checks that every level has cells.
pub(crate) fn layout(layout: &Layout) -> Result<(), Unsuitable> {
    if layout.levels.iter().any(|level| level.rows * level.cols == 0) {
        return Err(without("levels without cells"));
    }
    Ok(())
}
