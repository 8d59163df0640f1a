//! Ports, wake-ups, stop requests, heartbeats and logging. This is the only crate that calls iceoryx2 and the
//! operating system.

mod delivery;
pub mod metrics;
mod namespace;
mod preflight;
mod topic;

mod beneath;
mod bus;
mod bus_error;
mod clean;
mod copies;
mod erased;
mod lock;
mod losses;
mod mapped;
mod memory;
mod onlookers;
mod payload;
mod private;
mod publisher;
mod reserve;
mod room;
mod service;
mod subscriber;
mod waiter;

mod child;
mod guest;
mod health;
mod launch;
mod log;
mod observer;
mod place;
mod process;
mod progress;
mod remains;
mod scheduling;
mod video;

pub use bus::Bus;
pub use bus_error::BusError;
pub use child::{Child, freeze, kill, thaw, wait_for_any};
pub use clean::Cleaner;
pub use copies::Copies;
pub use delivery::{Delivery, Limits};
pub use guest::{Guest, GuestError, GuestPort, MOST_GUESTS, Seen, running_deployments};
pub use health::{HEARTBEAT, Health, HealthError};
pub use launch::{Launch, LaunchError};
pub use lock::{DeploymentLock, LockError, SUPERVISOR};
pub use losses::{Losses, Patience};
pub use mapped::{Mapped, mapped_at};
pub use memory::{MemoryError, free_shared_memory, free_space, peak_memory};
pub use namespace::{Namespace, NamespaceError};
pub use observer::{ObservedProcess, Observer, ObserverError, wait_for_description};
pub use payload::{Element, Header, Message};
pub use place::Place;
pub use preflight::{PreflightError, needed_bytes, preflight, process_topics};
pub use private::PrivacyError;
pub use process::{Service, raise_file_limit, run_service};
pub use progress::Progress;
pub use publisher::{Loan, Publisher, SendError, SlicePublisher};
pub use remains::{Remains, deployments};
pub use scheduling::{
    Denied, MAX_CORES, Policy, RealTime, Refusal, Scheduling, SchedulingError, give_way, own_cores,
};
pub use service::PortError;
pub use subscriber::{ReceiveError, Sample, SliceSubscriber, Subscriber};
pub use topic::{Topic, TopicPlan};
pub use video::{
    FourCc, VideoAbout, VideoControl, VideoDevice, VideoError, VideoFormat, VideoMode,
    VideoPicture, VideoSize, VideoStream, VideoWish, video_devices,
};
pub use waiter::{WaitError, Waiter, Woken};
