//! The newest content for the pages. One thread updates it. Every page fetches the messages that it has not received yet.

use std::collections::VecDeque;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use messages::MAX_VIEWS;
use rustix::event::{EventfdFlags, eventfd};
use serde_json::{Value, json};
use tungstenite::Message;

use crate::date::unix_ms;
use crate::scene::Scene;

/// Largest number of events that are kept for pages that open later.
const MOST_EVENTS: usize = 200;

/// Severity of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weight {
    /// Information.
    Note,
    /// Data was lost.
    Warning,
    /// Something failed.
    Error,
}

impl Weight {
    fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// The newest content for the pages.
#[derive(Debug)]
pub(crate) struct Board {
    inner: Mutex<Inner>,
    /// Number of pages that show the pictures of each view.
    wanted: [AtomicUsize; MAX_VIEWS],
    n_pages: Arc<AtomicUsize>,
    n_opened: AtomicUsize,
}

#[derive(Debug, Default)]
struct Inner {
    version: u64,
    hello: Slot,
    state: Slot,
    moment: Slot,
    pictures: [Slot; MAX_VIEWS],
    events: VecDeque<(u64, Message)>,
    scene: Option<Arc<Scene>>,
    /// Event file descriptors (`eventfd`) that are signalled after every change.
    bells: Vec<Weak<OwnedFd>>,
    /// Request to start or end a recording, for the thread that follows the deployment.
    record: Option<bool>,
    /// The page that last requested a recording.
    recorder: Option<usize>,
}

/// A message to all pages, with the sequence number of the change that added it.
#[derive(Debug, Clone, Default)]
struct Slot {
    version: u64,
    message: Option<Message>,
}

impl Board {
    /// Creates an empty board.
    pub(crate) fn new() -> Self {
        Self {
            inner: Mutex::default(),
            wanted: Default::default(),
            n_pages: Arc::default(),
            n_opened: AtomicUsize::new(0),
        }
    }

    /// Shows a new run, or the message that there is no run. The content of the previous run is removed.
    pub(crate) fn begin(&self, hello: &Value, scene: Option<Arc<Scene>>) {
        self.change(|inner, version| {
            inner.hello = Slot::new(version, text(hello));
            for slot in [&mut inner.state, &mut inner.moment].into_iter().chain(&mut inner.pictures)
            {
                *slot = Slot::default();
            }
            inner.record = None;
            inner.scene = scene;
        });
    }

    /// Shows a frame.
    pub(crate) fn moment(&self, text: String) {
        self.change(|inner, version| {
            inner.moment = Slot::new(version, Message::Text(text.into()));
        });
    }

    /// Shows the state of the processes.
    pub(crate) fn state(&self, state: &Value) {
        self.change(|inner, version| inner.state = Slot::new(version, text(state)));
    }

    /// Shows a picture ([`crate::picture::message`]).
    pub(crate) fn picture(&self, view: usize, message: Vec<u8>) {
        self.change(|inner, version| {
            if let Some(slot) = inner.pictures.get_mut(view) {
                *slot = Slot::new(version, Message::Binary(message.into()));
            }
        });
    }

    /// Adds an event.
    pub(crate) fn event(&self, weight: Weight, what: &str) {
        let event = json!({
            "type": "event", "weight": weight.name(), "unix_ms": unix_ms(), "what": what,
        });
        self.change(|inner, version| {
            inner.events.push_back((version, text(&event)));
            if inner.events.len() > MOST_EVENTS {
                inner.events.pop_front();
            }
        });
    }

    /// Returns the messages that were added after a change, and the number of the last change.
    ///
    /// * `pictures`: for each view, true if the page shows its pictures.
    pub(crate) fn since(&self, seen: u64, pictures: &[bool; MAX_VIEWS]) -> (u64, Vec<Message>) {
        let inner = self.lock();
        let mut new = Vec::new();
        let mut take = |slot: &Slot| {
            if slot.version > seen {
                new.extend(slot.message.clone());
            }
        };
        take(&inner.hello);
        take(&inner.state);
        take(&inner.moment);
        let shown = inner.pictures.iter().zip(pictures);
        shown.filter(|shown| *shown.1).for_each(|slot| take(slot.0));
        let events = inner.events.iter().filter(|event| event.0 > seen);
        new.extend(events.map(|event| event.1.clone()));
        (inner.version, new)
    }

    /// Returns an event file that becomes readable after every change, until it is dropped.
    ///
    /// # Errors
    ///
    /// Fails if the system cannot create an event file.
    pub(crate) fn bell(&self) -> io::Result<Arc<OwnedFd>> {
        let bell = Arc::new(eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)?);
        self.lock().bells.push(Arc::downgrade(&bell));
        Ok(bell)
    }

    /// Returns the cameras and joints of the run.
    pub(crate) fn scene(&self) -> Option<Arc<Scene>> {
        self.lock().scene.clone()
    }

    /// Requests to start or end a recording of the run, on behalf of a page.
    pub(crate) fn ask_to_record(&self, on: bool, page: usize) {
        let mut inner = self.lock();
        inner.record = Some(on);
        inner.recorder = on.then_some(page);
    }

    /// Repeats the request for a recording that could not be started yet.
    pub(crate) fn ask_again(&self) {
        let mut inner = self.lock();
        inner.record = inner.recorder.map(|_| true);
    }

    /// Returns a number for a new page.
    pub(crate) fn open_page(&self) -> usize {
        self.n_opened.fetch_add(1, Ordering::Relaxed)
    }

    /// Ends the recording that a page requested, when the page closes.
    pub(crate) fn leave_page(&self, page: usize) {
        let mut inner = self.lock();
        if inner.recorder == Some(page) {
            inner.record = Some(false);
            inner.recorder = None;
        }
    }

    /// Returns the request for a recording that arrived since the last call.
    pub(crate) fn take_record(&self) -> Option<bool> {
        self.lock().record.take()
    }

    /// Returns the counter of open pages.
    pub(crate) fn pages(&self) -> &Arc<AtomicUsize> {
        &self.n_pages
    }

    /// Returns true if a page is open.
    pub(crate) fn has_pages(&self) -> bool {
        self.n_pages.load(Ordering::Relaxed) > 0
    }

    /// Returns the counter of pages that show the pictures of a view; `None` for a view that does not exist.
    pub(crate) fn wanted(&self, view: usize) -> Option<&AtomicUsize> {
        self.wanted.get(view)
    }

    /// Returns true if a page shows the pictures of a view.
    pub(crate) fn wants(&self, view: usize) -> bool {
        self.wanted(view).is_some_and(|count| count.load(Ordering::Relaxed) > 0)
    }

    fn change(&self, change: impl FnOnce(&mut Inner, u64)) {
        let mut inner = self.lock();
        inner.version += 1;
        let version = inner.version;
        change(&mut inner, version);
        inner.bells.retain(|bell| bell.upgrade().is_some_and(|bell| ring(&bell)));
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Signals an event file. If its counter is full, it has already been signalled.
fn ring(bell: &OwnedFd) -> bool {
    match rustix::io::write(bell, &1_u64.to_ne_bytes()) {
        Ok(_) | Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => true,
        Err(_) => false,
    }
}

impl Slot {
    fn new(version: u64, message: Message) -> Self {
        Self {
            version,
            message: Some(message),
        }
    }
}

fn text(value: &Value) -> Message {
    Message::Text(value.to_string().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [bool; MAX_VIEWS] = [false; MAX_VIEWS];

    #[test]
    fn a_slow_page_gets_the_newest_frame_and_never_an_older_one() {
        let board = Board::new();
        for n in 0..100 {
            board.moment(n.to_string());
        }
        let (seen, new) = board.since(0, &NONE);
        assert_eq!(new, [Message::Text("99".into())]);
        assert_eq!(board.since(seen, &NONE), (seen, Vec::new()));
    }

    #[test]
    fn pictures_are_sent_only_to_pages_that_show_them() {
        let board = Board::new();
        board.picture(2, vec![7]);
        board.picture(MAX_VIEWS, vec![8]);
        let mut shown = NONE;
        assert_eq!(board.since(0, &shown).1, []);
        shown[2] = true;
        assert_eq!(board.since(0, &shown).1, [Message::Binary(vec![7].into())]);
    }

    #[test]
    fn a_new_run_clears_the_page() {
        let board = Board::new();
        board.moment("old".to_owned());
        board.begin(&json!({ "type": "hello" }), None);
        let new = board.since(0, &NONE).1;
        assert_eq!(new.len(), 1);
        assert!(new[0].to_text().is_ok_and(|text| text.contains("hello")));
    }

    #[test]
    fn a_page_that_opens_later_gets_a_limited_number_of_earlier_events() {
        let board = Board::new();
        for n in 0..2 * MOST_EVENTS {
            board.event(Weight::Error, &format!("event {n}"));
        }
        let new = board.since(0, &NONE).1;
        assert_eq!(new.len(), MOST_EVENTS);
        let last = new.last().map(|message| message.to_text().unwrap_or_default());
        assert!(last.is_some_and(|text| text.contains("event 399")));
    }
}
