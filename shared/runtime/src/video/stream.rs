//! The pictures of a video device, in buffers of the kernel that this process maps.
#![expect(unsafe_code, reason = "buffers of the kernel are mapped")]

use core::ffi::c_void;
use core::ptr::NonNull;
use core::time::Duration;
use std::io;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use super::raw::{self, Buffer};
use super::{VideoDevice, VideoError, VideoMode};

/// Number of buffers, which is enough for a reader that is delayed by a tenth of a second at 60 Hz.
const N_BUFFERS: u32 = 6;

/// A picture as delivered by the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VideoPicture<'a> {
    /// Bytes of the picture, in the format of the stream.
    pub bytes: &'a [u8],
    /// Time at which the kernel received the picture, `CLOCK_MONOTONIC`, in nanoseconds; `None` if the driver uses another clock.
    pub at_nanos: Option<u64>,
    /// Number that the driver has given to the picture; lost pictures are numbered, too.
    pub sequence: u32,
    /// True if the driver marked the picture as damaged.
    pub is_damaged: bool,
    /// True if all buffers were full before this picture was read. The next picture may then be lost because there was no buffer for it.
    pub was_full: bool,
}

/// A device that streams. Streaming stops when this value is dropped.
#[derive(Debug)]
pub struct VideoStream {
    // Declared before the device, so that the buffers are unmapped first.
    buffers: Vec<Mapping>,
    device: VideoDevice,
    mode: VideoMode,
    /// Index of the buffer that was handed out last, and that must be returned to the driver.
    lent: Option<u32>,
}

impl VideoDevice {
    /// Starts streaming in the current format.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::Request`] if the device is in use or has no buffers.
    pub fn start(self) -> Result<VideoStream, VideoError> {
        let mode = self.mode()?;
        let mut request = raw::RequestBuffers {
            count: N_BUFFERS,
            kind: raw::VIDEO_CAPTURE,
            memory: raw::MEMORY_MMAP,
            ..raw::RequestBuffers::default()
        };
        self.ask(
            raw::REQBUFS,
            "provide buffers (another program may be using it)",
            &mut request,
        )?;
        let mut stream = VideoStream {
            buffers: Vec::new(),
            device: self,
            mode,
            lent: None,
        };
        for index in 0..request.count {
            let buffer = stream.map(index)?;
            stream.buffers.push(buffer);
            stream.give_back(index)?;
        }
        let mut kind = raw::Kind(raw::VIDEO_CAPTURE);
        stream.device.ask(raw::STREAMON, "start to stream", &mut kind)?;
        Ok(stream)
    }
}

impl VideoStream {
    /// Returns the mode in which the device delivers pictures.
    pub fn mode(&self) -> VideoMode {
        self.mode
    }

    /// Returns the device.
    pub fn device(&self) -> &VideoDevice {
        &self.device
    }

    fn map(&self, index: u32) -> Result<Mapping, VideoError> {
        let mut buffer = empty(index);
        let what = "report the positions of its buffers";
        self.device.ask(raw::QUERYBUF, what, &mut buffer)?;
        let mapped = Mapping::new(&self.device, buffer.offset, buffer.length as usize);
        mapped.map_err(|source| VideoError::Request {
            path: self.device.path().to_owned(),
            what: "allow its buffers to be mapped",
            source,
        })
    }

    fn give_back(&self, index: u32) -> Result<(), VideoError> {
        let mut buffer = empty(index);
        raw::ask(self.device.fd(), raw::QBUF, &mut buffer).map_err(|error| self.gone(error))
    }

    fn gone(&self, source: io::Error) -> VideoError {
        VideoError::Gone {
            path: self.device.path().to_owned(),
            source,
        }
    }

    /// Returns the next picture; `None` if none arrives within `patience`.
    ///
    /// The previous picture goes back to the driver.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::Gone`] if the device was unplugged or the driver gave up.
    pub fn next(&mut self, patience: Duration) -> Result<Option<VideoPicture<'_>>, VideoError> {
        if let Some(index) = self.lent.take() {
            self.give_back(index)?;
        }
        if !self.is_ready(patience)? {
            return Ok(None);
        }
        let was_full = self.is_full();
        let mut buffer = empty(0);
        match raw::ask(self.device.fd(), raw::DQBUF, &mut buffer) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            Err(error) => return Err(self.gone(error)),
        }
        self.lent = Some(buffer.index);
        let mapping = self.buffers.get(buffer.index as usize);
        let bytes = mapping.map_or(&[][..], Mapping::bytes);
        let clock = buffer.flags & raw::BUF_FLAG_TIMESTAMP_MASK;
        let nanos = buffer.seconds.max(0) as u64 * 1_000_000_000
            + buffer.microseconds.clamp(0, 999_999) as u64 * 1000;
        Ok(Some(VideoPicture {
            bytes: &bytes[..bytes.len().min(buffer.bytes_used as usize)],
            at_nanos: (clock == raw::BUF_FLAG_TIMESTAMP_MONOTONIC).then_some(nanos),
            sequence: buffer.sequence,
            is_damaged: buffer.flags & raw::BUF_FLAG_ERROR != 0,
            was_full,
        }))
    }

    /// Returns true if there is a picture within `patience`.
    fn is_ready(&self, patience: Duration) -> Result<bool, VideoError> {
        let mut fds = [PollFd::from_borrowed_fd(self.device.fd(), PollFlags::IN)];
        let timeout = Timespec {
            tv_sec: patience.as_secs() as i64,
            tv_nsec: i64::from(patience.subsec_nanos()),
        };
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(self.gone(error.into())),
        }
        let events = fds[0].revents();
        let is_ready = events.contains(PollFlags::IN);
        if !is_ready && events.intersects(PollFlags::ERR | PollFlags::HUP | PollFlags::NVAL) {
            return Err(self.gone(io::ErrorKind::NotConnected.into()));
        }
        Ok(is_ready)
    }

    /// Returns true if every buffer holds a picture, so that the driver has to drop the next picture.
    fn is_full(&self) -> bool {
        const DONE: u32 = 4;
        let is_done = |index: usize| {
            let mut buffer = empty(index as u32);
            let asked = raw::ask(self.device.fd(), raw::QUERYBUF, &mut buffer);
            asked.is_ok() && buffer.flags & DONE != 0
        };
        (0..self.buffers.len()).all(is_done)
    }
}

impl Drop for VideoStream {
    fn drop(&mut self) {
        let mut kind = raw::Kind(raw::VIDEO_CAPTURE);
        // The request fails only if the device is gone, and then nothing streams.
        raw::ask(self.device.fd(), raw::STREAMOFF, &mut kind).ok();
    }
}

fn empty(index: u32) -> Buffer {
    Buffer {
        index,
        kind: raw::VIDEO_CAPTURE,
        memory: raw::MEMORY_MMAP,
        ..Buffer::default()
    }
}

/// A buffer of the kernel in the memory of this process.
#[derive(Debug)]
struct Mapping {
    address: NonNull<c_void>,
    len: usize,
}

// SAFETY: nothing else in this process owns the mapping, and it is only read.
unsafe impl Send for Mapping {}

impl Mapping {
    fn new(device: &VideoDevice, offset: u32, len: usize) -> io::Result<Self> {
        // SAFETY: the kernel chooses a free address, so no Rust object uses it.
        let mapped = unsafe {
            mmap(
                core::ptr::null_mut(),
                len,
                ProtFlags::READ,
                MapFlags::SHARED,
                device.fd(),
                u64::from(offset),
            )
        };
        let address = NonNull::new(mapped?).ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self { address, len })
    }

    /// Returns the bytes, which the driver does not change while the buffer is dequeued.
    fn bytes(&self) -> &[u8] {
        // SAFETY: `len` bytes are mapped at `address` for as long as `self` lives, and any byte is a `u8`.
        unsafe { core::slice::from_raw_parts(self.address.as_ptr().cast::<u8>(), self.len) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: `new` mapped the buffer, it has not been unmapped, and no slice of it outlives `self`.
        let unmapped = unsafe { munmap(self.address.as_ptr(), self.len) };
        // The call fails only for addresses that were never mapped.
        unmapped.ok();
    }
}
