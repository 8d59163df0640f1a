//! The thread that reads a deployment and passes moments to the caller.

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use runfiles::Running;

use crate::connection::{Connection, Turn};
use crate::error::ClientError;
use crate::joiner::{Gathered, Joiner};
use crate::lock::lock;
use crate::moment::{Moment, Picture, Skeletons, ViewMoment};
use crate::wish::Wish;

/// Pause between two checks of the ports, because no sender wakes a client.
const PAUSE: Duration = Duration::from_millis(1);
/// Interval at which the reader checks that the deployment is still running. The reader has a second to disconnect.
const CHECK: Duration = Duration::from_millis(100);
/// Pause between two attempts to connect to a deployment that is not running.
const RETRY: Duration = Duration::from_millis(200);

/// Reads a deployment.
///
/// Dropping the client leaves the deployment.
#[derive(Debug)]
pub struct Client {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Session and frame of the last [`Moment`] that the reader returned.
    last: Option<(u64, u64)>,
}

/// State of the connection to the deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The deployment is running, and the client reads it.
    Connected,
    /// The deployment is not running. The client connects to it when it starts.
    Waiting,
}

/// Counts of messages and moments that were not given to the caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Messages of another run, or with impossible counts or numbers.
    pub refused: u64,
    /// Parts that arrived after their frame had passed, and frames whose requested skeleton did not arrive.
    pub late: u64,
    /// Moments that were dropped because newer moments arrived before the caller took them. When the deployment ends, moments that hold its
    /// pictures are dropped as well.
    pub passed_over: u64,
}

#[derive(Debug)]
struct Shared {
    inner: Mutex<Inner>,
    changed: Condvar,
}

#[derive(Debug)]
struct Inner {
    ready: VecDeque<Moment>,
    losses: Losses,
    running: Option<Arc<Running>>,
    state: State,
    problem: Option<ClientError>,
    is_leaving: bool,
}

impl Client {
    /// Connects to a running deployment.
    ///
    /// # Errors
    ///
    /// Returns a [`ClientError`] if the client cannot connect. If the deployment is not running, the error names the deployments that are.
    pub fn open(deployment: &str, wish: &Wish) -> Result<Self, ClientError> {
        check_wish(wish)?;
        let connection = Connection::open(deployment, wish)?;
        Self::start(deployment, wish, Some(connection))
    }

    /// Connects to a deployment now, or as soon as it is running.
    ///
    /// # Errors
    ///
    /// Returns a [`ClientError`] if the client cannot connect. It is not an error if the deployment is not running.
    pub fn wait_for(deployment: &str, wish: &Wish) -> Result<Self, ClientError> {
        check_wish(wish)?;
        match Connection::open(deployment, wish) {
            Ok(connection) => Self::start(deployment, wish, Some(connection)),
            Err(error) if error.is_not_running() => Self::start(deployment, wish, None),
            Err(error) => Err(error),
        }
    }

    fn start(
        deployment: &str,
        wish: &Wish,
        connection: Option<Connection>,
    ) -> Result<Self, ClientError> {
        let running = connection.as_ref().map(|connection| Arc::clone(&connection.running));
        let shared = Arc::new(Shared {
            inner: Mutex::new(Inner {
                ready: VecDeque::new(),
                losses: Losses::default(),
                state: state_of(running.as_ref()),
                running,
                problem: None,
                is_leaving: false,
            }),
            changed: Condvar::new(),
        });
        let reader = Reader {
            deployment: deployment.to_owned(),
            wish: wish.clone(),
            shared: Arc::clone(&shared),
        };
        let thread = std::thread::Builder::new().name("parallax-client".to_owned());
        let thread = thread.spawn(move || reader.run(connection));
        Ok(Self {
            shared,
            thread: Some(thread.map_err(ClientError::Thread)?),
            last: None,
        })
    }

    /// Returns the next moment; `None` if none arrived in time, or while the deployment does not run.
    ///
    /// # Errors
    ///
    /// Fails if the running deployment cannot be read, for example because it is of another version, or if a port fails. The client
    /// keeps trying, so the caller may call this function again.
    pub fn next(&mut self, patience: Duration) -> Result<Option<Moment>, ClientError> {
        let inner = lock(&self.shared.inner);
        let is_idle = |inner: &mut Inner| inner.ready.is_empty() && inner.problem.is_none();
        let waited = self.shared.changed.wait_timeout_while(inner, patience, is_idle);
        let (mut inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let Some(mut moment) = inner.ready.pop_front() else {
            return inner.problem.take().map_or(Ok(None), Err);
        };
        drop(inner);
        let step = moment.running.frame_step.max(1);
        let session = moment.running.session;
        let before = self.last.filter(|last| last.0 == session).map(|last| last.1);
        moment.n_missed = before.map_or(0, |before| {
            (moment.frame.saturating_sub(before) / step).saturating_sub(1)
        });
        self.last = Some((session, moment.frame));
        Ok(Some(moment))
    }

    /// Returns the state of the connection to the deployment.
    pub fn state(&self) -> State {
        lock(&self.shared.inner).state
    }

    /// Returns the description that the deployment published in its last run; `None` before the first run.
    pub fn running(&self) -> Option<Arc<Running>> {
        lock(&self.shared.inner).running.clone()
    }

    /// Returns the losses since the client was created.
    pub fn losses(&self) -> Losses {
        lock(&self.shared.inner).losses
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        lock(&self.shared.inner).is_leaving = true;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            // The panic has already been reported on standard error.
        }
    }
}

fn check_wish(wish: &Wish) -> Result<(), ClientError> {
    if wish.skeletons || wish.has_views() {
        Ok(())
    } else {
        Err(ClientError::NoWish)
    }
}

fn state_of(running: Option<&Arc<Running>>) -> State {
    match running {
        Some(_) => State::Connected,
        None => State::Waiting,
    }
}

struct Reader {
    deployment: String,
    wish: Wish,
    shared: Arc<Shared>,
}

impl Reader {
    fn run(&self, mut connection: Option<Connection>) {
        while !lock(&self.shared.inner).is_leaving {
            let Some(open) = connection.take().or_else(|| self.join()) else {
                std::thread::sleep(RETRY);
                continue;
            };
            self.read(open);
        }
    }

    /// Tries to join the deployment. Failures are passed to the caller, unless the deployment just does not run.
    fn join(&self) -> Option<Connection> {
        match Connection::open(&self.deployment, &self.wish) {
            Ok(connection) => {
                let mut inner = lock(&self.shared.inner);
                inner.running = Some(Arc::clone(&connection.running));
                inner.state = State::Connected;
                inner.problem = None;
                Some(connection)
            }
            Err(error) => {
                if !error.is_not_running() {
                    self.tell(error);
                }
                None
            }
        }
    }

    fn tell(&self, error: ClientError) {
        lock(&self.shared.inner).problem = Some(error);
        self.shared.changed.notify_all();
    }

    /// Reads one run until it ends or the client leaves.
    fn read(&self, mut connection: Connection) {
        let views: Vec<usize> = connection.views().collect();
        let mut joiner = Joiner::new(self.wish.clone(), views.len());
        let before = lock(&self.shared.inner).losses;
        let mut checked = Instant::now();
        loop {
            let now = Instant::now();
            let turn = connection.turn(&mut joiner, now);
            let given = joiner.take(now);
            let is_new = !given.is_empty();
            {
                let mut inner = lock(&self.shared.inner);
                if matches!(turn, Ok(Turn::Held)) && self.wish.newest_wins() && given.is_empty() {
                    // Moments that wait here keep the newest picture from being taken.
                    inner.losses.passed_over += inner.ready.len() as u64;
                    inner.ready.clear();
                    joiner.clear();
                }
                for it in given {
                    inner.hand_over(moment(it, &views, &connection.running), self.wish.waiting);
                }
                inner.losses.refused = before.refused + connection.n_refused;
                inner.losses.late = before.late + joiner.n_late;
                if inner.is_leaving {
                    return;
                }
            }
            if is_new {
                self.shared.changed.notify_all();
            }
            if let Err(error) = turn {
                self.tell(error);
            }
            if now.saturating_duration_since(checked) >= CHECK {
                checked = now;
                if connection.is_over() {
                    break;
                }
            }
            std::thread::sleep(PAUSE);
        }
        let mut inner = lock(&self.shared.inner);
        inner.state = State::Waiting;
        // The deployment cannot end while pictures in its memory are held.
        let n_ready = inner.ready.len();
        inner.ready.retain(|moment| !moment.is_in_place());
        inner.losses.passed_over += (n_ready - inner.ready.len()) as u64;
    }
}

impl Inner {
    /// Adds a moment to those that wait. Drops the oldest ones if more than `most` would wait.
    fn hand_over(&mut self, moment: Moment, most: usize) {
        while self.ready.len() >= most {
            self.ready.pop_front();
            self.losses.passed_over += 1;
        }
        self.ready.push_back(moment);
    }
}

fn moment(gathered: Gathered<Picture>, views: &[usize], running: &Arc<Running>) -> Moment {
    let skeletons = gathered.skeletons;
    let parts = views.iter().zip(gathered.views);
    Moment {
        running: Arc::clone(running),
        frame: gathered.frame,
        captured_at_nanos: gathered.captured_at_nanos,
        skeletons: skeletons.map(|message| Skeletons::new(message, Arc::clone(running))),
        views: parts
            .map(|(view, parts)| ViewMoment {
                view: *view,
                pose: parts.pose,
                picture: parts.picture,
            })
            .collect(),
        is_complete: gathered.is_complete,
        n_missed: 0,
    }
}
