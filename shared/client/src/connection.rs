//! The ports of one run of a deployment.

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::time::Instant;

use messages::{FrameHeader, Sightings, Skeletons, Status, topic};
use runfiles::Running;
use runtime::{
    Guest, GuestError, GuestPort, Namespace, ReceiveError, running_deployments,
    wait_for_description,
};

use crate::check;
use crate::error::ClientError;
use crate::joiner::Joiner;
use crate::moment::{Buffers, Picture};
use crate::wish::Wish;

/// Maximum number of messages that are taken from a port before the next port's turn.
const MOST_A_TURN: usize = 64;
/// Time that a deployment may take to start.
const STARTING: Duration = Duration::from_secs(5);

/// The ports of one run of a deployment. The description and the session stay the same during the run.
#[derive(Debug)]
pub(crate) struct Connection {
    skeletons: Option<GuestPort<Skeletons, ()>>,
    views: Vec<ViewPorts>,
    pub(crate) running: Arc<Running>,
    buffers: Option<Buffers>,
    /// Number of messages that belong to another run or are malformed.
    pub(crate) n_refused: u64,
    // Dropped last, because it owns the ports.
    guest: Guest,
}

#[derive(Debug)]
struct ViewPorts {
    view: usize,
    poses: Option<GuestPort<Sightings, ()>>,
    pictures: Option<GuestPort<u8, FrameHeader>>,
}

/// Outcome of taking the pictures in one pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Turn {
    /// All available pictures were taken.
    Done,
    /// A picture waits until the caller drops another one.
    Held,
}

impl Connection {
    /// Joins a deployment. If it is about to start, waits for its description and all its topics.
    pub(crate) fn open(deployment: &str, wish: &Wish) -> Result<Self, ClientError> {
        let namespace = Namespace::new(deployment)?;
        // If there is no description, `Guest::open` returns the reason.
        wait_for_description(&namespace, STARTING);
        let guest = Guest::open(&namespace)?;
        let text = namespace.description().map_err(|error| unreadable(deployment, error))?;
        let running = Running::read(&text)?;
        let skeletons = if wish.skeletons {
            Some(guest.port(&topic::skeletons())?)
        } else {
            None
        };
        let mut views = Vec::new();
        if wish.has_views() {
            for view in numbers(&running, wish)? {
                views.push(ViewPorts::open(&guest, wish, view)?);
            }
        }
        Ok(Self {
            skeletons,
            views,
            running: Arc::new(running),
            buffers: wish.skeletons.then(Buffers::default),
            n_refused: 0,
            guest,
        })
    }

    /// Returns the indices of the requested views.
    pub(crate) fn views(&self) -> impl Iterator<Item = usize> + Clone {
        self.views.iter().map(|view| view.view)
    }

    /// Returns true if the deployment is ending.
    pub(crate) fn is_over(&self) -> bool {
        self.guest.is_over()
    }

    /// Takes all messages that are available.
    pub(crate) fn turn(
        &mut self,
        joiner: &mut Joiner<Picture>,
        now: Instant,
    ) -> Result<Turn, ClientError> {
        // Skeletons are sent last. When the views are read, all messages that belong to these skeletons are therefore available.
        let skeletons = self.skeletons()?;
        let mut turn = Turn::Done;
        for nth in 0..self.views.len() {
            self.poses(nth, joiner, now)?;
            if self.pictures(nth, joiner, now)? == Turn::Held {
                turn = Turn::Held;
            }
        }
        for message in skeletons {
            joiner.add_skeletons(message, now);
        }
        Ok(turn)
    }

    fn skeletons(&mut self) -> Result<Vec<Box<Skeletons>>, ClientError> {
        let mut taken = Vec::new();
        let Some(port) = &self.skeletons else {
            return Ok(taken);
        };
        for _ in 0..MOST_A_TURN {
            let Some(seen) = port.receive()? else { break };
            let Some(message) = seen.payload().first() else {
                continue;
            };
            let is_ours = message.stamp.session == self.running.session;
            if is_ours && message.status == Status::END {
                continue;
            }
            if is_ours && check::skeletons(message, &self.running) {
                taken.push(Box::new(*message));
            } else {
                self.n_refused += 1;
            }
        }
        Ok(taken)
    }

    fn poses(
        &mut self,
        nth: usize,
        joiner: &mut Joiner<Picture>,
        now: Instant,
    ) -> Result<(), ClientError> {
        let ports = &self.views[nth];
        let Some(port) = &ports.poses else {
            return Ok(());
        };
        for _ in 0..MOST_A_TURN {
            let Some(seen) = port.receive()? else { break };
            let Some(message) = seen.payload().first() else {
                continue;
            };
            if !check::stamp(&message.stamp, &self.running, ports.view) || !check::pose(message) {
                self.n_refused += 1;
            } else if message.status != Status::END {
                joiner.add_pose(nth, Box::new(*message), now);
            }
        }
        Ok(())
    }

    fn pictures(
        &mut self,
        nth: usize,
        joiner: &mut Joiner<Picture>,
        now: Instant,
    ) -> Result<Turn, ClientError> {
        let ports = &self.views[nth];
        let Some(port) = &ports.pictures else {
            return Ok(Turn::Done);
        };
        for _ in 0..MOST_A_TURN {
            let seen = match port.receive() {
                Ok(Some(seen)) => seen,
                Ok(None) => break,
                Err(ReceiveError::TooManyHeld { .. }) => return Ok(Turn::Held),
                Err(error) => return Err(error.into()),
            };
            let header = *seen.header();
            let is_ours = check::stamp(&header.stamp, &self.running, ports.view);
            if !is_ours || !check::picture(&header, seen.payload().len()) {
                self.n_refused += 1;
                continue;
            }
            if header.status == Status::END {
                continue;
            }
            // A picture that waits for its skeleton would block the sender's memory for too long.
            let picture = match &self.buffers {
                Some(buffers) => Picture::copied(&seen, buffers),
                None => Picture::in_place(seen),
            };
            joiner.add_picture(nth, &header.stamp, picture, now);
        }
        Ok(Turn::Done)
    }
}

impl ViewPorts {
    fn open(guest: &Guest, wish: &Wish, view: usize) -> Result<Self, GuestError> {
        Ok(Self {
            view,
            poses: if wish.poses {
                Some(guest.port(&topic::sightings(view))?)
            } else {
                None
            },
            pictures: if wish.pictures {
                Some(guest.port(&topic::frame(view))?)
            } else {
                None
            },
        })
    }
}

fn numbers(running: &Running, wish: &Wish) -> Result<Vec<usize>, ClientError> {
    let Some(cameras) = &wish.cameras else {
        return Ok((0..running.views.len()).collect());
    };
    let mut numbers = Vec::new();
    for camera in cameras {
        let number = running.views.iter().position(|view| view.name == *camera);
        numbers.push(number.ok_or_else(|| ClientError::NoCamera {
            deployment: running.name.clone(),
            camera: camera.clone(),
            cameras: running.views.iter().map(|view| view.name.clone()).collect(),
        })?);
    }
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}

/// Returns the reason why there is no description: the deployment has ended in the meantime, or its file cannot be read.
fn unreadable(name: &str, source: io::Error) -> GuestError {
    let name = name.to_owned();
    if source.kind() == io::ErrorKind::NotFound {
        let running = running_deployments().unwrap_or_default();
        GuestError::NotRunning { name, running }
    } else {
        GuestError::Directory { name, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::tests::running;

    #[test]
    fn cameras_are_found_by_name_and_missing_ones_are_named() {
        let of = |names: &[&str]| numbers(&running(), &Wish::views().of_cameras(names));
        assert_eq!(of(&["right", "left", "right"]).unwrap(), [0, 1]);
        assert_eq!(numbers(&running(), &Wish::views()).unwrap(), [0, 1]);
        let error = of(&["middle"]).unwrap_err().to_string();
        assert_eq!(
            error,
            "deployment \"walk\" has no camera \"middle\"; its cameras are left, right"
        );
    }
}
