//! The structures and requests of the kernel's interface (`linux/videodev2.h`), as they are on 64-bit machines.
#![expect(unsafe_code, reason = "ioctl has no safe binding")]

use std::io;
use std::os::fd::{AsRawFd as _, BorrowedFd};

/// A structure of the kernel's interface.
///
/// # Safety
///
/// The type must be plain old data (every pattern of bits is a value, no pointers) in the kernel's layout for [`Self::REQUESTS`].
pub(super) unsafe trait Raw {
    /// The requests that take this structure.
    const REQUESTS: &'static [Request];
}

/// Number of a request, without the size of its structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Request {
    /// Bits 30 and 31: 1 if this process writes, 2 if it reads.
    direction: u32,
    number: u32,
}

macro_rules! raw {
    ($name:ident: $($request:expr),+) => {
        // SAFETY: the structure has only integers and arrays of them, laid out as in linux/videodev2.h. The tests check the sizes.
        unsafe impl Raw for $name {
            const REQUESTS: &'static [Request] = &[$($request),+];
        }
    };
}

const fn read(number: u32) -> Request {
    Request {
        direction: 2,
        number,
    }
}

const fn write(number: u32) -> Request {
    Request {
        direction: 1,
        number,
    }
}

const fn both(number: u32) -> Request {
    Request {
        direction: 3,
        number,
    }
}

pub(super) const QUERYCAP: Request = read(0);
pub(super) const ENUM_FMT: Request = both(2);
pub(super) const G_FMT: Request = both(4);
pub(super) const S_FMT: Request = both(5);
pub(super) const REQBUFS: Request = both(8);
pub(super) const QUERYBUF: Request = both(9);
pub(super) const QBUF: Request = both(15);
pub(super) const DQBUF: Request = both(17);
pub(super) const STREAMON: Request = write(18);
pub(super) const STREAMOFF: Request = write(19);
pub(super) const G_PARM: Request = both(21);
pub(super) const S_PARM: Request = both(22);
pub(super) const G_CTRL: Request = both(27);
pub(super) const S_CTRL: Request = both(28);
pub(super) const QUERYCTRL: Request = both(36);
pub(super) const QUERYMENU: Request = both(37);
pub(super) const ENUM_FRAMESIZES: Request = both(74);
pub(super) const ENUM_FRAMEINTERVALS: Request = both(75);

/// Type of the stream: pictures in a single plane (`V4L2_BUF_TYPE_VIDEO_CAPTURE`); the next constant is memory that the kernel provides
/// (`V4L2_MEMORY_MMAP`).
pub(super) const VIDEO_CAPTURE: u32 = 1;
pub(super) const MEMORY_MMAP: u32 = 1;
pub(super) const CAP_VIDEO_CAPTURE: u32 = 1;
pub(super) const CAP_STREAMING: u32 = 0x0400_0000;
pub(super) const CAP_DEVICE_CAPS: u32 = 0x8000_0000;
pub(super) const BUF_FLAG_ERROR: u32 = 0x40;
pub(super) const BUF_FLAG_TIMESTAMP_MASK: u32 = 0xe000;
pub(super) const BUF_FLAG_TIMESTAMP_MONOTONIC: u32 = 0x2000;
pub(super) const CTRL_FLAG_DISABLED: u32 = 1;
pub(super) const CTRL_FLAG_READ_ONLY: u32 = 4;
pub(super) const CTRL_FLAG_INACTIVE: u32 = 0x10;
pub(super) const CTRL_FLAG_NEXT_CTRL: u32 = 0x8000_0000;

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Capability {
    pub driver: [u8; 16],
    pub card: [u8; 32],
    pub bus_info: [u8; 32],
    pub version: u32,
    pub capabilities: u32,
    pub device_caps: u32,
    pub reserved: [u32; 3],
}
raw!(Capability: QUERYCAP);

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FormatDescription {
    pub index: u32,
    pub kind: u32,
    pub flags: u32,
    pub description: [u8; 32],
    pub pixel_format: u32,
    pub mbus_code: u32,
    pub reserved: [u32; 3],
}
raw!(FormatDescription: ENUM_FMT);

/// `v4l2_format` with `v4l2_pix_format` in its union of 200 bytes, which is aligned to 8.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(super) struct Format {
    pub kind: u32,
    pub padding: u32,
    pub width: u32,
    pub height: u32,
    pub pixels: u32,
    pub field: u32,
    pub bytes_per_line: u32,
    pub size_image: u32,
    pub rest: [u32; 44],
}
raw!(Format: G_FMT, S_FMT);

impl Default for Format {
    fn default() -> Self {
        Self {
            kind: VIDEO_CAPTURE,
            padding: 0,
            width: 0,
            height: 0,
            pixels: 0,
            field: 0,
            bytes_per_line: 0,
            size_image: 0,
            rest: [0; 44],
        }
    }
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RequestBuffers {
    pub count: u32,
    pub kind: u32,
    pub memory: u32,
    pub capabilities: u32,
    pub reserved: [u8; 4],
}
raw!(RequestBuffers: REQBUFS);

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Buffer {
    pub index: u32,
    pub kind: u32,
    pub bytes_used: u32,
    pub flags: u32,
    pub field: u32,
    pub padding: u32,
    pub seconds: i64,
    pub microseconds: i64,
    pub timecode: [u32; 4],
    pub sequence: u32,
    pub memory: u32,
    /// The offset for `mmap`, in a union of 8 bytes.
    pub offset: u32,
    pub offset_high: u32,
    pub length: u32,
    pub reserved: u32,
    pub request_fd: i32,
    pub padding_end: u32,
}
raw!(Buffer: QUERYBUF, QBUF, DQBUF);

/// The kind of a stream, for `STREAMON` and `STREAMOFF`.
#[repr(transparent)]
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind(pub u32);
raw!(Kind: STREAMON, STREAMOFF);

/// `v4l2_streamparm` with `v4l2_captureparm` in its union of 200 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(super) struct StreamParameters {
    pub kind: u32,
    pub capability: u32,
    pub capture_mode: u32,
    /// Numerator of the seconds per frame.
    pub numerator: u32,
    pub denominator: u32,
    pub rest: [u32; 46],
}
raw!(StreamParameters: G_PARM, S_PARM);

impl Default for StreamParameters {
    fn default() -> Self {
        Self {
            kind: VIDEO_CAPTURE,
            capability: 0,
            capture_mode: 0,
            numerator: 0,
            denominator: 0,
            rest: [0; 46],
        }
    }
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Control {
    pub id: u32,
    pub value: i32,
}
raw!(Control: G_CTRL, S_CTRL);

#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct QueryControl {
    pub id: u32,
    pub kind: u32,
    pub name: [u8; 32],
    pub minimum: i32,
    pub maximum: i32,
    pub step: i32,
    pub default: i32,
    pub flags: u32,
    pub reserved: [u32; 2],
}
raw!(QueryControl: QUERYCTRL);

#[repr(C, packed)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct QueryMenu {
    pub id: u32,
    pub index: u32,
    pub name: [u8; 32],
    pub reserved: u32,
}
raw!(QueryMenu: QUERYMENU);

/// A size: `[width, height]` if `kind` is 1, otherwise `[least, most, step]` of both.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameSize {
    pub index: u32,
    pub pixel_format: u32,
    pub kind: u32,
    pub numbers: [u32; 6],
    pub reserved: [u32; 2],
}
raw!(FrameSize: ENUM_FRAMESIZES);

/// Seconds per frame, as fractions: one value if `kind` is 1, otherwise the minimum, the maximum and the step.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameInterval {
    pub index: u32,
    pub pixel_format: u32,
    pub width: u32,
    pub height: u32,
    pub kind: u32,
    pub numbers: [u32; 6],
    pub reserved: [u32; 2],
}
raw!(FrameInterval: ENUM_FRAMEINTERVALS);

/// Sends a request to a device. The answer is written to `it`.
///
/// # Errors
///
/// Returns the error of the kernel.
///
/// # Panics
///
/// Panics if the request takes another structure.
pub(super) fn ask<T: Raw>(device: BorrowedFd<'_>, request: Request, it: &mut T) -> io::Result<()> {
    assert!(
        T::REQUESTS.contains(&request),
        "a request of this structure"
    );
    let code = code::<T>(request);
    let address = core::ptr::from_mut(it);
    loop {
        // SAFETY: `address` points to a living structure, whose size is part of `code`. The kernel
        // reads and writes only this structure, and `Raw` guarantees that any bytes are a value of it.
        let outcome = unsafe { libc::ioctl(device.as_raw_fd(), code, address) };
        if outcome >= 0 {
            return Ok(());
        }
        let error = io::Error::last_os_error();
        if error.kind() != io::ErrorKind::Interrupted {
            return Err(error);
        }
    }
}

fn code<T>(request: Request) -> libc::Ioctl {
    const LETTER: u32 = 'V' as u32;
    let size = size_of::<T>() as u32;
    libc::Ioctl::from(request.direction << 30 | size << 16 | LETTER << 8 | request.number)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// These numbers are those of `linux/videodev2.h` on 64-bit machines.
    #[test]
    fn ioctl_requests_have_the_codes_of_the_kernel() {
        assert_eq!(code::<Capability>(QUERYCAP), 0x8068_5600);
        assert_eq!(code::<FormatDescription>(ENUM_FMT), 0xc040_5602);
        assert_eq!(code::<Format>(G_FMT), 0xc0d0_5604);
        assert_eq!(code::<Format>(S_FMT), 0xc0d0_5605);
        assert_eq!(code::<RequestBuffers>(REQBUFS), 0xc014_5608);
        assert_eq!(code::<Buffer>(QUERYBUF), 0xc058_5609);
        assert_eq!(code::<Buffer>(QBUF), 0xc058_560f);
        assert_eq!(code::<Buffer>(DQBUF), 0xc058_5611);
        assert_eq!(code::<Kind>(STREAMON), 0x4004_5612);
        assert_eq!(code::<Kind>(STREAMOFF), 0x4004_5613);
        assert_eq!(code::<StreamParameters>(G_PARM), 0xc0cc_5615);
        assert_eq!(code::<StreamParameters>(S_PARM), 0xc0cc_5616);
        assert_eq!(code::<Control>(G_CTRL), 0xc008_561b);
        assert_eq!(code::<Control>(S_CTRL), 0xc008_561c);
        assert_eq!(code::<QueryControl>(QUERYCTRL), 0xc044_5624);
        assert_eq!(code::<QueryMenu>(QUERYMENU), 0xc02c_5625);
        assert_eq!(code::<FrameSize>(ENUM_FRAMESIZES), 0xc02c_564a);
        assert_eq!(code::<FrameInterval>(ENUM_FRAMEINTERVALS), 0xc034_564b);
    }

    #[test]
    fn a_regular_file_refuses_every_ioctl_request() {
        use std::os::fd::AsFd as _;
        let file = std::fs::File::open("/dev/null").unwrap();
        let refused = ask(file.as_fd(), QUERYCAP, &mut Capability::default());
        assert_eq!(refused.unwrap_err().raw_os_error(), Some(libc::ENOTTY));
    }
}
