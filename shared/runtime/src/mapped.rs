//! Location of data in shared memory; it is the same in all processes that map the data.

use std::io;
use std::path::PathBuf;

/// A location in shared memory: two processes with the same location see the same bytes, not copies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mapped {
    /// The file that is mapped.
    pub file: PathBuf,
    /// Number of the file in its file system.
    pub inode: u64,
    /// Offset in the file, in bytes.
    pub offset: u64,
    /// True if this process may write to the location.
    pub is_writable: bool,
}

/// Returns the location of an array in shared memory; `None` if the array is in the process's own memory.
///
/// The function reads the memory map of the process (`/proc/self/maps`). It is meant for tests and diagnosis, and is too slow for
/// every message.
///
/// # Errors
///
/// Fails if the memory map cannot be read.
pub fn mapped_at<T>(array: &[T]) -> io::Result<Option<Mapped>> {
    let maps = std::fs::read_to_string("/proc/self/maps")?;
    let range = array.as_ptr_range();
    let place = find(&maps, range.start.addr(), range.end.addr());
    Ok(place)
}

fn find(maps: &str, begin: usize, end: usize) -> Option<Mapped> {
    let mut mappings = maps.lines().filter_map(Mapping::parse);
    let mapping = mappings
        .find(|mapping| mapping.address <= begin && end <= mapping.address + mapping.len)?;
    mapping.shared.then(|| Mapped {
        file: PathBuf::from(mapping.path),
        inode: mapping.inode,
        offset: mapping.offset + (begin - mapping.address) as u64,
        is_writable: mapping.writable,
    })
}

/// One line of `/proc/self/maps` that is about a file.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Mapping<'a> {
    pub(crate) address: usize,
    pub(crate) len: usize,
    /// True if the memory is shared with the file.
    pub(crate) shared: bool,
    pub(crate) writable: bool,
    pub(crate) offset: u64,
    pub(crate) inode: u64,
    pub(crate) path: &'a str,
}

impl<'a> Mapping<'a> {
    /// Parses a line such as `7f0000000000-7f0000001000 rw-s 00000000 00:1a 42    /dev/shm/name`.
    pub(crate) fn parse(line: &'a str) -> Option<Self> {
        let mut words = line.split_ascii_whitespace();
        let (begin, end) = words.next()?.split_once('-')?;
        let permissions = words.next()?;
        let offset = u64::from_str_radix(words.next()?, 16).ok()?;
        let _device = words.next()?;
        let inode = words.next()?.parse().ok()?;
        let path = words.next()?;
        let address = usize::from_str_radix(begin, 16).ok()?;
        let end = usize::from_str_radix(end, 16).ok()?;
        Some(Self {
            address,
            len: end.checked_sub(address)?,
            shared: permissions.ends_with('s'),
            writable: permissions.starts_with("rw"),
            offset,
            inode,
            path,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPS: &str = "\
7f0000000000-7f0000003000 rw-s 00002000 00:1a 42                     /dev/shm/px1_2.data
7f0000003000-7f0000004000 r--s 00000000 00:1a 43                     /dev/shm/px1_3.data
7f0000008000-7f0000009000 r-xp 00000000 00:1a 44                     /usr/bin/sh
7f000000a000-7f000000b000 rw-p 00000000 00:00 0
";

    #[test]
    fn a_line_of_the_memory_map_is_parsed() {
        let expected = Mapping {
            address: 0x7f00_0000_0000,
            len: 0x3000,
            shared: true,
            writable: true,
            offset: 0x2000,
            inode: 42,
            path: "/dev/shm/px1_2.data",
        };
        assert_eq!(MAPS.lines().next().and_then(Mapping::parse), Some(expected));
    }

    #[test]
    fn an_anonymous_mapping_has_no_path() {
        assert_eq!(Mapping::parse("7f0-7f1 rw-p 00000000 00:00 0 "), None);
    }

    #[test]
    fn the_offset_counts_from_the_start_of_the_file() {
        let place = find(MAPS, 0x7f00_0000_1040, 0x7f00_0000_3000).unwrap();
        assert_eq!((place.inode, place.offset), (42, 0x3040));
        assert!(place.is_writable);
        let place = find(MAPS, 0x7f00_0000_3000, 0x7f00_0000_3001).unwrap();
        assert_eq!((place.inode, place.offset), (43, 0));
        assert!(!place.is_writable);
    }

    #[test]
    fn private_or_partly_mapped_memory_has_no_location() {
        for (begin, end) in [
            (0x7f00_0000_2fff, 0x7f00_0000_3001),
            (0x7f00_0000_8000, 0x7f00_0000_8001),
            (0x7f00_0000_a000, 0x7f00_0000_a001),
            (0x10, 0x20),
        ] {
            assert_eq!(find(MAPS, begin, end), None, "{begin:x}");
        }
    }

    #[test]
    fn private_memory_of_the_process_has_no_location() {
        let own: Vec<u8> = (0..100).collect();
        assert_eq!(mapped_at(&own).unwrap(), None);
    }
}
