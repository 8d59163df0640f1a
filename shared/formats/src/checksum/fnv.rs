//! Hash function of Fowler, Noll and Vo, variant 1a.

/// Computes the 64-bit FNV-1a hash.
///
/// The hash is used to tell files and settings apart; it does not protect against forgery. Every step is a bijection of the state, so two
/// inputs of the same length that differ in one byte never have the same hash.
///
/// ```
/// assert_eq!(formats::checksum::fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
/// ```
pub fn fnv1a(bytes: &[u8]) -> u64 {
    fnv1a_of(bytes.iter().copied())
}

/// Computes [`fnv1a`] of bytes that are not contiguous in memory.
///
/// ```
/// let parts = b"foo".iter().chain(b"bar").copied();
/// assert_eq!(formats::checksum::fnv1a_of(parts), formats::checksum::fnv1a(b"foobar"));
/// ```
pub fn fnv1a_of(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Computes the 32-bit FNV-1a hash, for fields of messages that have no space for 64 bits.
///
/// ```
/// assert_eq!(formats::checksum::fnv1a_32(b"foobar"), 0xbf9c_f968);
/// ```
pub fn fnv1a_32(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash, &byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hashes_are_the_published_ones() {
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
        assert_eq!(fnv1a_32(b""), 0x811c_9dc5);
        assert_eq!(fnv1a_32(b"foobar"), 0xbf9c_f968);
    }
}
