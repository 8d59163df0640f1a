//! One run of a deployment, as seen by an observer that is not part of it.

use core::time::Duration;
use std::sync::Arc;
use std::time::Instant;

use failure::{Failure, Stop};
use launch::Resolved;
use launch::live::{self, Live};
use messages::{FrameHeader, MAX_VIEWS, Skeletons, Status, topic};
use runtime::{Bus, Namespace, SliceSubscriber, Subscriber};
use serde_json::{Value, json};

use super::events::Events;
use super::tape::Tape;
use crate::board::{Board, Weight};
use crate::moment::Moment;
use crate::picture;
use crate::scene::Scene;

/// Time between two readings of the state of the processes.
const STATE_PERIOD: Duration = Duration::from_millis(500);
/// Longest pause between two checks of the cameras while there is no result.
const PATIENCE: Duration = Duration::from_millis(90);

/// State of the deployment: still running, or over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Look {
    /// The deployment still runs.
    On,
    /// The deployment ends; the session must be dropped.
    Over,
}

/// An observer of one run.
#[derive(Debug)]
pub(crate) struct Session {
    scene: Arc<Scene>,
    resolved: Resolved,
    live: Live,
    poses: Subscriber<Skeletons>,
    cameras: Vec<Camera>,
    events: Events,
    tape: Option<Tape>,
    /// Time at which the state of the processes was last read.
    told: Option<Instant>,
    /// Time at which the pictures of the cameras were last read.
    looked: Option<Instant>,
    /// Session number of the run; `None` until a process has reported it.
    run: Option<u64>,
    namespace: Namespace,
    // Dropped last, because the subscribers use its ports.
    _bus: Bus,
}

/// The frames of one view.
#[derive(Debug)]
struct Camera {
    frames: SliceSubscriber<u8, FrameHeader>,
    /// Shortest time between two pictures.
    pause: Duration,
    /// Time at which the last picture was due.
    due: Instant,
}

impl Session {
    /// Starts to follow a run.
    ///
    /// # Errors
    ///
    /// Fails if the deployment is not running or has too many observers, or if its model or calibration cannot be read.
    pub(crate) fn open(
        named: Option<&str>,
        pictures_per_second: u32,
        stop: &Stop,
    ) -> Result<Self, Failure> {
        let namespace = live::namespace(named)?;
        // Fails if the deployment is not running, before any file is created in its folder.
        let live = Live::open(&namespace)?;
        let resolved = live::description(&namespace)?;
        let scene = Scene::of_frames(&resolved)?;
        let name = format!("view-{}", std::process::id());
        let bus = Bus::open(&namespace, &name, stop)?.as_onlooker();
        let mut waiter = bus.waiter();
        let poses = bus.subscriber(&topic::skeletons(), &mut waiter)?;
        let n_views = scene.views.len().min(MAX_VIEWS);
        let pause = Duration::from_secs(1) / pictures_per_second.max(1);
        let mut cameras = Vec::new();
        for view in 0..n_views {
            let frames = bus.slice_subscriber(&topic::frame(view), &mut waiter)?;
            let due = Instant::now();
            cameras.push(Camera { frames, pause, due });
        }
        Ok(Self {
            events: Events::new(&scene),
            scene: Arc::new(scene),
            resolved,
            live,
            poses,
            cameras,
            tape: None,
            told: None,
            looked: None,
            run: None,
            namespace,
            _bus: bus,
        })
    }

    /// Returns the cameras and joints.
    pub(crate) fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }

    /// Returns the first message to a page.
    pub(crate) fn hello(&self) -> Value {
        json!({
            "type": "hello", "mode": "live", "name": self.scene.name, "scene": self.scene.json(),
            "can_record": true,
        })
    }

    /// Puts new messages on the board. The pictures of the cameras are read right after a result, because scaling them down takes processor
    /// time, and the deployment is most likely to be idle at this moment.
    ///
    /// # Errors
    ///
    /// Fails if messages cannot be received.
    pub(crate) fn look(&mut self, board: &Board) -> Result<Look, Failure> {
        let has_come = self.look_at_poses(board)?;
        if has_come || self.looked.is_none_or(|looked| looked.elapsed() >= PATIENCE) {
            self.looked = Some(Instant::now());
            for view in 0..self.cameras.len() {
                self.look_at(view, board)?;
            }
        }
        if self.told.is_none_or(|at| at.elapsed() >= STATE_PERIOD) {
            self.told = Some(Instant::now());
            self.look_at_processes(board)?;
            if self.live.is_over() {
                return Ok(Look::Over);
            }
        }
        Ok(Look::On)
    }

    /// Ends a recording, if there is one.
    pub(crate) fn leave(&mut self, board: &Board) {
        if let Some(tape) = self.tape.take() {
            tape.finish(board);
        }
    }

    /// Returns true if a result has arrived.
    fn look_at_poses(&mut self, board: &Board) -> Result<bool, Failure> {
        let Some(message) = self.poses.latest_boxed()? else {
            return Ok(false);
        };
        let scene = &self.scene;
        if message.status == Status::END {
            board.event(Weight::Note, "the footage has ended");
            return Ok(true);
        }
        let n_joints = scene.joints.joints.len();
        if let Err(why) = wire::check_skeletons(&message, scene.views.len(), n_joints) {
            self.events.refused(board, &why.to_string());
            return Ok(true);
        }
        let moment = Moment::of_message(scene, &message);
        self.events.result(board, &moment);
        if board.has_pages() {
            board.moment(moment.text());
        }
        Ok(true)
    }

    fn look_at(&mut self, view: usize, board: &Board) -> Result<(), Failure> {
        let camera = &mut self.cameras[view];
        let Some(sample) = camera.frames.latest()? else {
            return Ok(());
        };
        let head = sample.header();
        self.events.frame(board, &self.scene, view, head.status);
        let now = Instant::now();
        let is_due = now >= camera.due && board.wants(view) && head.status == Status::OK;
        if !is_due {
            return Ok(());
        }
        let earlier = now.checked_sub(camera.pause / 2).unwrap_or(now);
        // The due time advances by the period, so that a picture that arrives slightly early is not left out.
        camera.due = (camera.due + camera.pause).max(earlier);
        let size = [head.width as usize, head.height as usize];
        let frame = head.stamp.frame;
        if let Some(message) = picture::message(view, frame, size, sample.payload(), false) {
            board.picture(view, message);
        }
        Ok(())
    }

    fn look_at_processes(&mut self, board: &Board) -> Result<(), Failure> {
        let snapshot = self.live.snapshot()?;
        self.events.processes(board, &snapshot);
        let sessions = snapshot.processes.iter();
        let mut sessions =
            sessions.filter_map(|session| session.reading.as_ref().map(|reading| reading.session));
        self.run = self.run.or_else(|| sessions.next());
        let described = live::describe(&snapshot);
        self.record(board);
        let recording = self.tape.as_ref().map(Tape::json);
        if board.has_pages() {
            board.state(&json!({
                "type": "state", "processes": described["processes"], "recording": recording,
            }));
        }
        Ok(())
    }

    /// Starts or ends a recording, if requested.
    fn record(&mut self, board: &Board) {
        if self.tape.as_ref().is_some_and(Tape::is_finished)
            && let Some(tape) = self.tape.take()
        {
            tape.finish(board);
        }
        match board.take_record() {
            Some(true) if self.tape.is_none() => {
                let Some(run) = self.run else {
                    // No process has reported yet. Each process reports every second.
                    board.ask_again();
                    return;
                };
                match Tape::start(&self.namespace, &self.resolved, run) {
                    Ok(tape) => {
                        board.event(
                            Weight::Note,
                            &format!("recording to {}", tape.file().display()),
                        );
                        self.tape = Some(tape);
                    }
                    Err(why) => board.event(Weight::Error, &format!("cannot record: {why}")),
                }
            }
            Some(false) => self.leave(board),
            _ => {}
        }
    }
}
