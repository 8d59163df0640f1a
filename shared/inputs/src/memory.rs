//! Check that there is enough memory to search an image.

use fmp::Layout;

/// Memory that a whole search needs, in bytes per byte of the responses. The measured value is 1.53.
const SHARE_OF_RESPONSES: f64 = 1.6;

/// Error for a search that needs more memory than this machine has free.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the search of the whole picture of {width}x{height} pixels needs about {needed_gb:.1} GB of memory, but only {free_gb:.1} GB are free"
)]
pub(crate) struct TooLarge {
    width: usize,
    height: usize,
    needed_gb: f64,
    free_gb: f64,
}

/// Returns the memory available without swapping, in bytes, as the kernel estimates it; `None` if the kernel does not report it.
fn available_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kib)
}

/// Checks that this machine has enough free memory for a search.
///
/// # Errors
///
/// Fails if more memory is needed than is free.
pub(crate) fn check_memory(layout: &Layout) -> Result<(), TooLarge> {
    let needed = SHARE_OF_RESPONSES * (layout.n_responses() * size_of::<f32>()) as f64;
    let [width, height] = layout.image_size;
    match available_bytes() {
        Some(free) if needed > free as f64 => Err(TooLarge {
            width,
            height,
            needed_gb: needed / 1e9,
            free_gb: free as f64 / 1e9,
        }),
        _ => Ok(()),
    }
}
