//! Identity, status and times of a message.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// Run, frame and times to which a message belongs. Stages match messages by session and frame, never by time of arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Stamp.v1")]
#[repr(C)]
pub struct Stamp {
    /// Run of the deployment; a message of another session is ignored.
    pub session: u64,
    /// Index of the frame in the footage, counted from 0; the same in all synchronised views.
    pub frame: u64,
    /// Time at which the frame was captured, `CLOCK_MONOTONIC`, in nanoseconds.
    pub captured_at_nanos: u64,
    /// Index of the view in the rig, or of the pair in a [`PairPose`](crate::PairPose); 0 in a
    /// message about all views.
    pub view: u32,
    /// Number of restarts of the sender.
    pub epoch: u32,
}

/// State of a message: it carries a result, or the reason why it is missing.
///
/// A transparent number rather than an enum: any received bit pattern is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Status.v1")]
#[repr(C)]
pub struct Status(pub u32);

impl Status {
    /// The message carries a result.
    pub const OK: Self = Self(0);
    /// End of stream: nothing follows. The rest of the message is empty.
    pub const END: Self = Self(1);
    /// The source could not deliver this frame.
    pub const NO_FRAME: Self = Self(2);
    /// No pose scored above the threshold.
    pub const NO_DETECTION: Self = Self(3);
    /// There is no prediction of errors for this frame.
    pub const NO_PREDICTION: Self = Self(4);
    /// Too few views arrived in time.
    pub const TOO_FEW_VIEWS: Self = Self(5);
    /// A message that was needed for this one was malformed.
    pub const BAD_INPUT: Self = Self(6);

    /// The picture is bit-identical to many before it: the camera is frozen.
    pub const FROZEN: Self = Self(7);
    /// The camera reports the same time as for the frame before.
    pub const TIME_REPEATED: Self = Self(8);
    /// The camera reports an earlier time than for the frame before.
    pub const TIME_WENT_BACK: Self = Self(9);
    /// The camera's time is not consistent with that of the frame before.
    pub const CLOCK_JUMPED: Self = Self(10);
    /// The size of the picture has changed since the run began.
    pub const WRONG_SIZE: Self = Self(11);
    /// There is no camera, or it does not answer.
    pub const UNPLUGGED: Self = Self(12);
    /// The camera skipped this frame.
    pub const LEFT_OUT: Self = Self(13);
    /// The picture cannot be decoded.
    pub const DAMAGED: Self = Self(14);

    /// The body that was found cannot be that of a person.
    pub const IMPLAUSIBLE: Self = Self(15);

    /// The frame did not arrive from its host in time.
    pub const LATE: Self = Self(16);
    /// The host of the camera does not answer.
    pub const HOST_GONE: Self = Self(17);

    /// Camera faults: all reasons for a frame without a picture that a camera itself can cause.
    pub const CAMERA_FAULTS: [Self; 11] = [
        Self::NO_FRAME,
        Self::FROZEN,
        Self::TIME_REPEATED,
        Self::TIME_WENT_BACK,
        Self::CLOCK_JUMPED,
        Self::WRONG_SIZE,
        Self::UNPLUGGED,
        Self::LEFT_OUT,
        Self::DAMAGED,
        Self::LATE,
        Self::HOST_GONE,
    ];

    /// Returns the text for messages to users.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::OK => "ok",
            Self::END => "end of footage",
            Self::NO_FRAME => "no frame",
            Self::NO_DETECTION => "no detection",
            Self::NO_PREDICTION => "no prediction",
            Self::TOO_FEW_VIEWS => "too few views",
            Self::BAD_INPUT => "malformed input",
            Self::FROZEN => "frozen picture",
            Self::TIME_REPEATED => "repeated timestamp",
            Self::TIME_WENT_BACK => "timestamp went back",
            Self::CLOCK_JUMPED => "clock jumped",
            Self::WRONG_SIZE => "wrong size",
            Self::UNPLUGGED => "camera gone",
            Self::LEFT_OUT => "left out by the camera",
            Self::DAMAGED => "damaged picture",
            Self::IMPLAUSIBLE => "implausible",
            Self::LATE => "late from its host",
            Self::HOST_GONE => "host gone",
            Self(_) => "unknown",
        }
    }
}

/// Times at which a stage received its last input and sent its result; `CLOCK_MONOTONIC`, in nanoseconds.
///
/// The difference is computing time. The time from one stage's `sent_at_nanos` to the next stage's
/// `received_at_nanos` is transport.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Timing.v1")]
#[repr(C)]
pub struct Timing {
    /// Time at which the last input arrived. For `capture`, the time at which the pixels were requested.
    pub received_at_nanos: u64,
    /// Time just before the message was sent.
    pub sent_at_nanos: u64,
}
