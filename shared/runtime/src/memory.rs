//! Allocation of shared memory before it is written to.
#![expect(unsafe_code, reason = "madvise has no safe binding")]

use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{FallocateFlags, fallocate, statvfs};
use rustix::io::Errno;
use rustix::mm::{Advice, madvise};
use rustix::process::{Resource, getrlimit};

use crate::mapped::Mapping;
use crate::reserve::{self, Refused};

/// The file system of shared memory.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// Reason why the memory of a pool cannot be allocated.
#[derive(Debug, thiserror::Error)]
pub enum MemoryError {
    /// The file system of shared memory is full.
    #[error(
        "{path:?} needs {needed_bytes} bytes of shared memory, but only {free_bytes} are free in /dev/shm"
    )]
    Full {
        /// File of the pool.
        path: PathBuf,
        /// Size of the pool.
        needed_bytes: u64,
        /// Number of free bytes.
        free_bytes: u64,
    },
    /// The pool exceeds the limit on the size of a file.
    #[error(
        "{path:?} needs {needed_bytes} bytes of shared memory, but a file may have at most {limit_bytes}"
    )]
    Limited {
        /// File of the pool.
        path: PathBuf,
        /// Size of the pool.
        needed_bytes: u64,
        /// The limit of this process (`ulimit -f`).
        limit_bytes: u64,
    },
    /// The pool cannot be opened or extended.
    #[error("cannot reserve pool {path:?}")]
    Reserve {
        /// File of the pool.
        path: PathBuf,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
    /// The process's own memory map cannot be read.
    #[error("cannot read /proc/self/maps")]
    Maps(#[source] io::Error),
}

/// Returns the number of free bytes in the file system of shared memory.
///
/// # Errors
///
/// Fails if the file system cannot be queried.
pub fn free_shared_memory() -> io::Result<u64> {
    free_space(Path::new(SHARED_MEMORY))
}

/// Returns the number of free bytes in the file system of an existing file or folder.
///
/// # Errors
///
/// Fails if the path does not exist.
pub fn free_space(path: &Path) -> io::Result<u64> {
    let status = statvfs(path)?;
    Ok(status.f_bavail * status.f_frsize)
}

/// Returns the peak physical memory of this process, in bytes (`VmHWM`); `None` if the system does not report it.
pub fn peak_memory() -> Option<u64> {
    memory_now().map(|[_, peak]| peak)
}

/// Returns the current (`VmRSS`) and peak (`VmHWM`) physical memory of this process, in bytes; `None` if the system does not report it.
pub(crate) fn memory_now() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let bytes = |key: &str| -> Option<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix(key))?;
        let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
        Some(kib * 1024)
    };
    Some([bytes("VmRSS:")?, bytes("VmHWM:")?])
}

/// Allocates every page of a publisher's pool, and maps the pages of its first chunks. The publisher reuses these chunks as long as they
/// are enough.
///
/// The first write to a page costs a page fault and the zeroing of the page (20 ms instead of 0.4 ms for a frame of 6 megabytes). If the
/// file system is full at that time, the kernel kills the process with SIGBUS. This function pays the cost in advance, and reports a
/// full file system as an error.
///
/// * `port`: number of the publisher in iceoryx2, which is part of its pool's file name.
/// * `mapped`: number of mapped chunks, and number of all chunks.
pub(crate) fn populate(
    (prefix, port): (&str, u128),
    mapped: [usize; 2],
) -> Result<(), MemoryError> {
    let maps = std::fs::read_to_string("/proc/self/maps").map_err(MemoryError::Maps)?;
    let begin = format!("{SHARED_MEMORY}/{prefix}");
    let name = port.to_string();
    for mapping in maps.lines().filter_map(Mapping::parse) {
        let own = mapping.writable
            && mapping.shared
            && mapping.path.starts_with(&begin)
            && Path::new(mapping.path).extension().is_some_and(|extension| extension == "data")
            && mapping.path.contains(&name);
        if own {
            reserve(&mapping)?;
            mapping.touch(mapped);
        }
    }
    Ok(())
}

/// Returns the reason why the pool of a publisher was not created, if memory was the reason.
///
/// * `prefix`: prefix of the files of the deployment.
pub(crate) fn refused(prefix: &str) -> Option<MemoryError> {
    let path = Path::new(SHARED_MEMORY).join(prefix);
    Some(match reserve::refused()? {
        Refused::NoRoom { wanted_bytes } => MemoryError::Full {
            path,
            needed_bytes: wanted_bytes,
            free_bytes: free_shared_memory().unwrap_or(0),
        },
        Refused::TooLarge { wanted_bytes } => MemoryError::Limited {
            path,
            needed_bytes: wanted_bytes,
            limit_bytes: getrlimit(Resource::Fsize).current.unwrap_or(u64::MAX),
        },
    })
}

impl Mapping<'_> {
    /// Maps the given fraction of the pages, starting at the first page. Kernels before 5.14 do not support this; the pages are then mapped
    /// when they are first used.
    fn touch(&self, [share, of]: [usize; 2]) {
        let len = if share < of {
            self.len / of * share
        } else {
            self.len
        };
        let address = core::ptr::with_exposed_provenance_mut(self.address);
        // SAFETY: the range is the start of a shared mapping that iceoryx2 made in this process a moment
        // ago. iceoryx2 keeps the mapping for the life of the publisher, which the caller holds. `MADV_POPULATE_WRITE` changes no
        // byte of it.
        let result = unsafe { madvise(address, len, Advice::LinuxPopulateWrite) };
        if let Err(error) = result {
            tracing::debug!(%error, path = self.path, "the pool must be mapped before it is used");
        }
    }
}

/// Allocates the pages of a pool in its file system.
fn reserve(mapping: &Mapping<'_>) -> Result<(), MemoryError> {
    let failed = |source: io::Error| MemoryError::Reserve {
        path: PathBuf::from(mapping.path),
        source,
    };
    let file = std::fs::OpenOptions::new()
        .read(true)
        .write(true)
        .open(mapping.path)
        .map_err(failed)?;
    let len = file.metadata().map_err(failed)?.len();
    match fallocate(&file, FallocateFlags::KEEP_SIZE, 0, len) {
        Ok(()) => Ok(()),
        Err(Errno::NOSPC) => Err(MemoryError::Full {
            path: PathBuf::from(mapping.path),
            needed_bytes: len,
            free_bytes: free_shared_memory().map_err(failed)?,
        }),
        Err(error) => Err(failed(error.into())),
    }
}
