//! The fields that all messages share.

use messages::{
    EvidenceHeader, FrameHeader, PairPose, People, Sightings, Skeletons, Stamp, Status, Timing,
    ViewQuality,
};

/// A message with a stamp, a timing and a status.
pub trait Stamped: Copy {
    /// Name of the type, as used in log messages about rejected messages.
    const NAME: &'static str;

    /// Returns the stamp: session, frame, capture time, view, epoch.
    fn stamp(&self) -> &Stamp;
    /// Returns the times at which the sender received its input and sent the message.
    fn timing(&self) -> &Timing;
    /// Returns the status: whether the message carries a result, is the end of the stream, or states why there is no result.
    fn status(&self) -> Status;
    /// Returns the same message with another stamp and timing.
    #[must_use]
    fn with(self, stamp: Stamp, timing: Timing) -> Self;
    /// Returns the message that ends a stream.
    #[must_use]
    fn end(stamp: Stamp) -> Self;
}

macro_rules! stamped {
    ($($message:ty => $name:literal, $end:expr);* $(;)?) => {$(
        impl Stamped for $message {
            const NAME: &'static str = $name;

            fn stamp(&self) -> &Stamp {
                &self.stamp
            }

            fn timing(&self) -> &Timing {
                &self.timing
            }

            fn status(&self) -> Status {
                self.status
            }

            fn with(self, stamp: Stamp, timing: Timing) -> Self {
                Self { stamp, timing, ..self }
            }

            fn end(stamp: Stamp) -> Self {
                Self { stamp, status: Status::END, ..$end }
            }
        }
    )*};
}

stamped! {
    Sightings => "sightings", Self::default();
    ViewQuality => "view-quality", Self::default();
    PairPose => "pair-pose", Self::default();
    People => "people", Self::default();
    Skeletons => "skeletons", wire::end_of_results(0);
}

/// The header of bulk data (a large array).
pub trait BulkHeader: runtime::Header {
    /// Name of the type, as used in log messages about rejected messages.
    const NAME: &'static str;

    /// Returns the stamp: session, frame, capture time, view, epoch.
    fn stamp(&self) -> &Stamp;
}

impl BulkHeader for FrameHeader {
    const NAME: &'static str = "frame";

    fn stamp(&self) -> &Stamp {
        &self.stamp
    }
}

impl BulkHeader for EvidenceHeader {
    const NAME: &'static str = "evidence";

    fn stamp(&self) -> &Stamp {
        &self.stamp
    }
}
