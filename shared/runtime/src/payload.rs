//! Types that can be sent: plain data without pointers.

use core::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

/// A type of fixed size that is copied into and out of shared memory.
pub trait Message: Copy + Debug + ZeroCopySend + 'static {}

impl<T: Copy + Debug + ZeroCopySend + 'static> Message for T {}

/// A [`Message`] that is sent before an array.
pub trait Header: Message + Default {}

impl<T: Message + Default> Header for T {}

/// An element of an array that is sent in place.
///
/// The trait is sealed, because every bit pattern must be valid: a reused chunk contains old data.
pub trait Element: Message + sealed::EveryBitPattern {}

impl Element for u8 {}
impl Element for f32 {}

mod sealed {
    pub trait EveryBitPattern {}
    impl EveryBitPattern for u8 {}
    impl EveryBitPattern for f32 {}
}
