//! An open GPU: its memory, its queue, and whether it still responds.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use wgpu::util::DeviceExt as _;
use wgpu::{Buffer, BufferUsages, CommandEncoder, Limits, MapMode, PollType};

use crate::open::{self, Opened};
use crate::{Adapter, Choice, DeviceLost, Kind, OpenError};

/// Longest time that a card may take for a frame.
const PATIENCE: Duration = Duration::from_secs(2);
/// Longest time that a software adapter may take for a frame.
const PATIENCE_WITH_SOFTWARE: Duration = Duration::from_mins(2);

/// An open GPU. Several views of a process share one.
#[derive(Debug)]
pub struct Device {
    raw: wgpu::Device,
    queue: wgpu::Queue,
    adapter: Adapter,
    limits: Limits,
    takes_spirv: bool,
    max_binding: u64,
    patience: Duration,
    is_lost: Arc<AtomicBool>,
    /// The first error that the driver has reported.
    complaint: Arc<Mutex<Option<String>>>,
}

/// A range of bytes in a buffer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece<'a> {
    pub(crate) buffer: &'a Buffer,
    /// First byte; a multiple of 4.
    pub(crate) at: u64,
    /// Number of bytes; a multiple of 4.
    pub(crate) n: u64,
}

impl<'a> Piece<'a> {
    /// All bytes of a buffer.
    pub(crate) fn whole(buffer: &'a Buffer) -> Self {
        Self {
            buffer,
            at: 0,
            n: buffer.size(),
        }
    }
}

impl Device {
    /// Opens the best adapter. A graphics card comes first, then a part of the processor, then other kinds.
    ///
    /// # Errors
    ///
    /// Fails with [`OpenError`].
    pub fn open(choice: Choice) -> Result<Self, OpenError> {
        let Opened {
            device,
            queue,
            adapter,
            limits,
            takes_spirv,
        } = open::open(choice)?;
        let is_lost = Arc::new(AtomicBool::new(false));
        let lost = Arc::clone(&is_lost);
        device.set_device_lost_callback(move |_, _| lost.store(true, Ordering::Relaxed));
        let complaint = Arc::new(Mutex::new(None));
        let (lost, heard) = (Arc::clone(&is_lost), Arc::clone(&complaint));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            lost.store(true, Ordering::Relaxed);
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            heard.get_or_insert(error.to_string());
        }));
        let is_software = adapter.kind == Kind::Software;
        Ok(Self {
            raw: device,
            queue,
            patience: if is_software {
                PATIENCE_WITH_SOFTWARE
            } else {
                PATIENCE
            },
            adapter,
            max_binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            limits,
            takes_spirv,
            is_lost,
            complaint,
        })
    }

    /// Returns the same device with a lower limit for the size of the buffers that a kernel can access, to emulate a smaller device.
    #[must_use]
    pub fn with_max_binding(self, max_binding: u64) -> Self {
        Self {
            max_binding: max_binding.min(self.max_binding),
            ..self
        }
    }

    /// Returns the same device, changed to pass kernels to the driver as text, with a bounds check for every access. This emulates a device
    /// that does not accept SPIR-V.
    #[must_use]
    pub fn without_spirv(self) -> Self {
        Self {
            takes_spirv: false,
            ..self
        }
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Gives up the device. Every later search fails with [`DeviceLost`].
    pub fn destroy(&self) {
        self.is_lost.store(true, Ordering::Relaxed);
        self.raw.destroy();
    }

    pub(crate) fn raw(&self) -> &wgpu::Device {
        &self.raw
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    pub(crate) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Returns true if the device accepts kernels in SPIR-V, in which arithmetic can be marked as not to be fused.
    pub(crate) fn takes_spirv(&self) -> bool {
        self.takes_spirv
    }

    /// Maximum number of bytes of a buffer that a kernel can access.
    pub(crate) fn max_binding(&self) -> u64 {
        self.max_binding
    }

    /// Fails if the device no longer responds.
    pub(crate) fn check(&self) -> Result<(), DeviceLost> {
        if self.is_lost.load(Ordering::Relaxed) {
            return Err(DeviceLost);
        }
        Ok(())
    }

    /// The first error reported by the driver, if any.
    pub(crate) fn complaint(&self) -> Option<String> {
        let complaint = self.complaint.lock();
        complaint.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Makes a buffer with constant contents.
    pub(crate) fn table<T: bytemuck::Pod>(&self, contents: &[T]) -> Buffer {
        self.raw.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(contents),
            usage: BufferUsages::STORAGE,
        })
    }

    /// Makes a buffer to which the CPU or kernels write, and which can be read.
    pub(crate) fn space(&self, n_bytes: u64) -> Buffer {
        self.raw.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: n_bytes.next_multiple_of(4),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }

    /// Runs the recorded commands, then reads ranges of bytes, one after the other.
    ///
    /// * `staging`: memory that the CPU and the device can access; enlarged if necessary.
    pub(crate) fn read(
        &self,
        mut recorded: CommandEncoder,
        pieces: &[Piece<'_>],
        staging: &mut Option<Buffer>,
        take: &mut dyn FnMut(&[u8]),
    ) -> Result<(), DeviceLost> {
        self.check()?;
        let size: u64 = pieces.iter().map(|piece| piece.n).sum();
        if staging.as_ref().is_none_or(|buffer| buffer.size() < size) {
            *staging = Some(self.raw.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
        let Some(shared) = staging.as_ref() else {
            return Ok(());
        };
        let mut at = 0;
        for piece in pieces {
            recorded.copy_buffer_to_buffer(piece.buffer, piece.at, shared, at, piece.n);
            at += piece.n;
        }
        let submission_index = Some(self.queue.submit([recorded.finish()]));
        self.check()?;
        let is_mapped = Arc::new(AtomicBool::new(false));
        let mapped = Arc::clone(&is_mapped);
        shared.map_async(MapMode::Read, ..size, move |result| {
            mapped.store(result.is_ok(), Ordering::Relaxed);
        });
        let wait = PollType::Wait {
            submission_index,
            timeout: Some(self.patience),
        };
        let is_done = self.raw.poll(wait).is_ok() && is_mapped.load(Ordering::Relaxed);
        if !is_done || self.check().is_err() {
            self.is_lost.store(true, Ordering::Relaxed);
            return Err(DeviceLost);
        }
        let Ok(bytes) = shared.get_mapped_range(..size) else {
            return Err(DeviceLost);
        };
        take(&bytes);
        drop(bytes);
        shared.unmap();
        Ok(())
    }
}
