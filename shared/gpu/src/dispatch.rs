//! A kernel with its buffers.

use wgpu::{BindGroup, Buffer, ComputePass, ComputePipeline};

use crate::device::Device;

/// Number of workgroups along the first dimension if this dimension alone cannot hold all of them. The kernels contain the same constant.
pub(crate) const ROW: u32 = 32768;

/// A kernel, its buffers, and its number of workgroups.
#[derive(Debug)]
pub(crate) struct Dispatch {
    pipeline: ComputePipeline,
    buffers: BindGroup,
    groups: [u32; 2],
}

impl Dispatch {
    /// Binds buffers to a kernel, in the order of the kernel's bindings.
    ///
    /// * `groups`: number of workgroups in both dimensions. If the first number is too large and the second is 1, the groups are divided
    ///   into rows.
    pub(crate) fn new(
        device: &Device,
        pipeline: &ComputePipeline,
        buffers: &[&Buffer],
        groups: [usize; 2],
    ) -> Self {
        let resources = buffers.iter().map(|buffer| buffer.as_entire_binding());
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        let bound = device.raw().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let groups = groups.map(|n| n as u32);
        Self {
            pipeline: pipeline.clone(),
            buffers: bound,
            groups: if groups[0] > ROW {
                [ROW, groups[0].div_ceil(ROW)]
            } else {
                groups
            },
        }
    }

    /// Records the kernel.
    pub(crate) fn record(&self, pass: &mut ComputePass<'_>) {
        self.record_some(pass, self.groups[0]);
    }

    /// Records the kernel with only its first `n` workgroups.
    pub(crate) fn record_some(&self, pass: &mut ComputePass<'_>, n: u32) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.buffers, &[]);
        pass.dispatch_workgroups(n, self.groups[1], 1);
    }
}
