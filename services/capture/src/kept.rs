//! Sends the original pictures of a live camera to the recording.

use std::sync::Arc;

use failure::{Failure, now_nanos};
use messages::{MAX_NAME, PictureHeader, Stamp, Status, Timing, topic};
use runtime::{SendError, Service, SlicePublisher};

use crate::job::Job;
use crate::live::{Grid, LiveJob, Original, Originals};

/// Number of pictures that are sent per iteration of the main loop, so that the other work of the loop is not delayed.
const MOST_IN_TURN: usize = 16;

/// Sends original pictures to their topic.
pub(crate) struct Kept {
    publisher: SlicePublisher<u8, PictureHeader>,
    originals: Arc<Originals>,
    /// Fields that all headers have in common.
    common: PictureHeader,
    has_warned: bool,
}

impl Kept {
    /// Opens the topic. Returns `None` if nothing is to be kept.
    pub(crate) fn open(
        service: &Service,
        job: &Job,
        live: &LiveJob,
        grid: &Grid,
    ) -> Result<Option<Self>, Failure> {
        if !live.is_kept {
            return Ok(None);
        }
        let publisher = service.bus().slice_publisher(&topic::picture(job.view))?;
        publisher.wait_for_subscribers(1, service.patience_at_start(job.patience));
        let mut name = [0; MAX_NAME];
        let n = live.name.floor_char_boundary(MAX_NAME);
        name[..n].copy_from_slice(&live.name.as_bytes()[..n]);
        Ok(Some(Self {
            publisher,
            originals: Arc::default(),
            common: PictureHeader {
                stamp: Stamp {
                    session: service.session(),
                    view: job.view as u32,
                    epoch: service.epoch(),
                    ..Stamp::default()
                },
                grid_start_nanos: grid.due_nanos(0),
                grid_rate_hz: live.rate_hz,
                name,
                ..PictureHeader::default()
            },
            has_warned: false,
        }))
    }

    /// Returns the queue into which the camera puts its pictures.
    pub(crate) fn originals(&self) -> Arc<Originals> {
        Arc::clone(&self.originals)
    }

    /// Sends all waiting pictures. A picture that cannot be sent is lost. The recording notices this from the picture numbers.
    pub(crate) fn send_all(&mut self) -> Result<(), Failure> {
        for _ in 0..MOST_IN_TURN {
            let Some((number, original)) = self.originals.take() else {
                return Ok(());
            };
            self.send(number, &original)?;
        }
        Ok(())
    }

    fn send(&mut self, number: u64, original: &Original) -> Result<(), Failure> {
        let mut loan = match self.publisher.loan(original.bytes.len().max(1)) {
            Ok(loan) => loan,
            Err(error @ SendError::TooLong { .. }) => {
                if !core::mem::replace(&mut self.has_warned, true) {
                    tracing::warn!(%error, "a picture of the camera is not recorded");
                }
                return Ok(());
            }
            Err(error) => return Err(error.into()),
        };
        loan.payload_mut().fill(0);
        loan.payload_mut()[..original.bytes.len()].copy_from_slice(&original.bytes);
        *loan.header_mut() = PictureHeader {
            stamp: Stamp {
                frame: number,
                captured_at_nanos: original.at_nanos,
                ..self.common.stamp
            },
            timing: Timing {
                received_at_nanos: original.arrived_at_nanos,
                sent_at_nanos: now_nanos(),
            },
            width: original.size.width as u32,
            height: original.size.height as u32,
            status: if original.is_whole {
                Status::OK
            } else {
                Status::DAMAGED
            },
            format: original.format,
            sequence: original.sequence,
            presented_nanos: original.presented_nanos,
            bytes_per_row: original.bytes_per_row,
            connection: original.connection,
            ..self.common
        };
        loan.send()?;
        Ok(())
    }

    /// Sends the pictures that still wait, and the number of all pictures.
    pub(crate) fn end(&mut self) -> Result<(), Failure> {
        while let Some((number, original)) = self.originals.take() {
            self.send(number, &original)?;
        }
        let mut loan = self.publisher.loan(1)?;
        loan.payload_mut().fill(0);
        *loan.header_mut() = PictureHeader {
            stamp: Stamp {
                frame: self.originals.n_all(),
                captured_at_nanos: now_nanos(),
                ..self.common.stamp
            },
            timing: Timing {
                received_at_nanos: now_nanos(),
                sent_at_nanos: now_nanos(),
            },
            status: Status::END,
            ..self.common
        };
        loan.send()?;
        Ok(())
    }
}
