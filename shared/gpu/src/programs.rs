//! The kernels, compiled for a model.

use wgpu::{BindingType, BufferBindingType, ComputePipeline, ShaderModule, ShaderStages};

use crate::device::Device;
use crate::expand::expand;
use crate::{Unsuitable, spirv};

/// Names of the kernels.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kernel {
    Shrink,
    Halve,
    Gradient,
    Histograms,
    Energies,
    Describe,
    Responses,
    Combine,
    Transform,
    Roots,
    Peaks,
    Trace,
}

/// Name of a kernel in its text, and its buffers.
struct Entry {
    name: &'static str,
    n_buffers: usize,
    written: &'static [usize],
}

const fn entry(name: &'static str, n_buffers: usize, written: &'static [usize]) -> Entry {
    Entry {
        name,
        n_buffers,
        written,
    }
}

/// Every source text and its kernels, in the order of [`Kernel`].
const SOURCES: [(&str, &[Entry]); 3] = [
    (
        include_str!("shaders/features.wgsl"),
        &[
            entry("shrink", 7, &[6]),
            entry("halve", 3, &[2]),
            entry("gradient", 5, &[3, 4]),
            entry("histograms", 6, &[5]),
            entry("energies", 4, &[3]),
            entry("describe", 5, &[4]),
        ],
    ),
    (
        include_str!("shaders/responses.wgsl"),
        &[entry("responses", 5, &[4])],
    ),
    (
        include_str!("shaders/messages.wgsl"),
        &[
            entry("combine", 9, &[7, 8]),
            entry("transform", 8, &[7]),
            entry("roots", 5, &[4]),
            entry("peaks", 4, &[3]),
            entry("trace", 11, &[10]),
        ],
    ),
];

/// Maximum number of buffers that a kernel binds.
pub(crate) const MAX_BUFFERS: u32 = 11;

/// Numbers that are inserted into the texts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    /// Side of a filter, in cells.
    pub(crate) side: usize,
    /// Number of parts.
    pub(crate) parts: usize,
    /// Number of types of each part.
    pub(crate) types: usize,
    /// Longest offset in the tables of costs, in cells.
    pub(crate) reach: usize,
    /// Number of parts that are traced together.
    pub(crate) slots: usize,
}

/// The kernels, in the order of [`Kernel`].
#[derive(Debug)]
pub(crate) struct Programs(Vec<ComputePipeline>);

impl Programs {
    /// Compiles all kernels.
    pub(crate) fn new(device: &Device, sizes: Sizes) -> Result<Self, Unsuitable> {
        let mut all = Vec::new();
        for (text, kernels) in SOURCES {
            let text = expand(&filled(text, sizes));
            let module = module(device, &text, kernels)?;
            all.extend(kernels.iter().map(|entry| pipeline(device, &module, entry)));
        }
        match device.complaint() {
            None => Ok(Self(all)),
            Some(why) => Err(Unsuitable::Refused { why }),
        }
    }

    /// A compiled kernel.
    pub(crate) fn get(&self, kernel: Kernel) -> &ComputePipeline {
        &self.0[kernel as usize]
    }
}

/// Inserts the numbers into a text.
fn filled(text: &str, sizes: Sizes) -> String {
    let numbers = [
        ("@SIDE@", sizes.side),
        ("@PARTS@", sizes.parts),
        ("@TYPES@", sizes.types),
        ("@PLANES@", sizes.parts * sizes.types),
        ("@REACH@", sizes.reach),
        ("@SLOTS@", sizes.slots),
    ];
    numbers.iter().fold(text.to_owned(), |text, (name, number)| {
        text.replace(name, &number.to_string())
    })
}

/// Compiles a text. If the device accepts SPIR-V, all arithmetic is marked as not to be fused.
#[expect(unsafe_code, reason = "wgpu passes SPIR-V to the driver unchanged")]
fn module(device: &Device, text: &str, kernels: &[Entry]) -> Result<ShaderModule, Unsuitable> {
    if !device.takes_spirv() {
        return Ok(
            device.raw().create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl(text.into()),
            }),
        );
    }
    let words = spirv::from_wgsl(text).map_err(|why| Unsuitable::Refused { why })?;
    let entry_points = kernels.iter().map(|entry| wgpu::PassthroughShaderEntryPoint {
        name: entry.name.into(),
        workgroup_size: (1, 1, 1),
    });
    let module = wgpu::ShaderModuleDescriptorPassthrough {
        spirv: Some(words.into()),
        entry_points: entry_points.collect::<Vec<_>>().into(),
        ..Default::default()
    };
    // SAFETY: naga translated and validated the module from a text of this crate, whose kernels stay within their buffers.
    // Decorations of results change no access to memory.
    Ok(unsafe { device.raw().create_shader_module_passthrough(module) })
}

fn pipeline(device: &Device, module: &ShaderModule, entry: &Entry) -> ComputePipeline {
    let name = entry.name;
    let binding = |binding: usize| wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility: ShaderStages::COMPUTE,
        ty: BindingType::Buffer {
            ty: BufferBindingType::Storage {
                read_only: !entry.written.contains(&binding),
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..entry.n_buffers).map(binding).collect();
    let raw = device.raw();
    let bindings = raw.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(name),
        entries: &entries,
    });
    let layout = raw.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(&bindings)],
        immediate_size: 0,
    });
    raw.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..Default::default()
        },
        cache: None,
    })
}
