//! Messages to and from one page.

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::io;
use std::net::TcpStream;
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use messages::MAX_VIEWS;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Deserialize;
use serde_json::{Value, json};
use tungstenite::handshake::server::Response;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use crate::board::Board;
use crate::door::Seat;
use crate::finished::Finished;
use crate::site::Site;

/// Longest time that a page may take to accept a message.
const PATIENCE: Duration = Duration::from_secs(10);
/// Largest size of a message from a page, in bytes.
const LARGEST_QUESTION: usize = 16 << 10;
/// Longest wait if the page requests nothing and nothing changes.
const LONGEST_SLEEP: Duration = Duration::from_secs(10);
/// Number of invalid messages after which the connection is closed.
const MOST_REFUSED: u32 = 20;
/// Largest number of points in one request for lines.
const MOST_POINTS: usize = 64;

/// Request of a page; fields that are left out do not change.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    /// Views whose pictures the page shows.
    pictures: Option<Vec<usize>>,
    /// Index of the frame of a finished run that the page shows.
    at: Option<usize>,
    /// True to start a recording, false to end it.
    record: Option<bool>,
    /// Points whose lines in other views the page shows: view, and pixel in this view.
    epipolar: Option<Vec<(usize, [f64; 2])>>,
}

/// An open page.
struct Page {
    site: Site,
    number: usize,
    /// True if the page may start and end recordings. Pages of another user without a token may not.
    may_record: bool,
    shown: [bool; MAX_VIEWS],
    seen: u64,
    n_refused: u32,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.show(&[]);
        self.board().leave_page(self.number);
    }
}

/// A page that has passed the access rules.
#[derive(Debug)]
pub(crate) struct Opened {
    /// First response to the page.
    pub(crate) response: Response,
    /// Bytes that the page has already sent.
    pub(crate) rest: Vec<u8>,
    /// Counts the page while it is open.
    pub(crate) seat: Seat,
    /// True if the page may start and end recordings.
    pub(crate) may_record: bool,
}

impl Opened {
    /// Exchanges messages with a page until it closes, takes too long, or sends too many invalid messages.
    pub(crate) fn talk(self, stream: TcpStream, site: Site) {
        let bell = stream
            .set_nonblocking(true)
            .and_then(|()| stream.set_nodelay(true))
            .and_then(|()| site.board.bell());
        let bell = match bell {
            Ok(bell) => bell,
            Err(error) => {
                tracing::debug!(%error, "cannot exchange messages with a page");
                return;
            }
        };
        let mut page = Page {
            number: site.board.open_page(),
            may_record: self.may_record,
            site,
            shown: [false; MAX_VIEWS],
            seen: 0,
            n_refused: 0,
        };
        let config = WebSocketConfig::default()
            .max_message_size(Some(LARGEST_QUESTION))
            .max_frame_size(Some(LARGEST_QUESTION));
        let mut socket =
            WebSocket::from_partially_read(stream, self.rest, Role::Server, Some(config));
        while page.turn(&mut socket, &bell).is_ok() && page.n_refused <= MOST_REFUSED {}
        drop(self.seat);
    }
}

/// Sends a message; fails if the page does not accept it in time.
fn send(socket: &mut WebSocket<TcpStream>, message: Message) -> Result<(), Error> {
    let until = Instant::now() + PATIENCE;
    let mut sent = socket.write(message);
    loop {
        match sent.and_then(|()| socket.flush()) {
            Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => {
                let left = until.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(io::Error::from(io::ErrorKind::TimedOut).into());
                }
                wait(&[(socket.get_ref().as_fd(), PollFlags::OUT)], left)?;
            }
            sent => return sent,
        }
        sent = Ok(());
    }
}

/// Waits for one of several files, but not longer than `limit`.
fn wait(files: &[(BorrowedFd<'_>, PollFlags)], limit: Duration) -> io::Result<()> {
    let watched = files.iter().map(|(file, flags)| PollFd::new(file, *flags));
    let mut watched: Vec<PollFd<'_>> = watched.collect();
    let limit = Timespec::try_from(limit).map_err(io::Error::other)?;
    match poll(&mut watched, Some(&limit)) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

fn text(value: &Value) -> Message {
    Message::Text(value.to_string().into())
}

impl Page {
    fn board(&self) -> &Board {
        &self.site.board
    }

    /// Sends new messages and responds to requests. Waits if there are no messages or requests.
    ///
    /// * `bell`: event file that is signalled when the board has changed.
    fn turn(&mut self, socket: &mut WebSocket<TcpStream>, bell: &OwnedFd) -> Result<(), Error> {
        // The event file is cleared before the board is read, so later changes signal it again.
        let _rung = rustix::io::read(bell, &mut [0; 8]).is_ok();
        let (seen, new) = self.board().since(self.seen, &self.shown);
        self.seen = seen;
        for message in new {
            send(socket, message)?;
        }
        match socket.read() {
            Ok(Message::Text(text)) => {
                for answer in self.answer(&text) {
                    send(socket, answer)?;
                }
            }
            Ok(Message::Binary(_)) => self.n_refused += 1,
            Ok(Message::Close(_)) => {
                socket.flush()?;
                return Err(Error::ConnectionClosed);
            }
            Ok(_) => {}
            Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => {
                let page = socket.get_ref().as_fd();
                let sides = [(page, PollFlags::IN), (bell.as_fd(), PollFlags::IN)];
                wait(&sides, LONGEST_SLEEP)?;
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn answer(&mut self, question: &str) -> Vec<Message> {
        let question: Question = match serde_json::from_str(question) {
            Ok(question) => question,
            Err(why) => {
                self.n_refused += 1;
                let why = format!("not a valid request: {why}");
                return vec![text(&json!({ "type": "refused", "why": why }))];
            }
        };
        if let Some(views) = &question.pictures {
            self.show(views);
        }
        let mut answers = Vec::new();
        match question.record.filter(|_| self.site.finished.is_none()) {
            Some(on) if self.may_record => self.board().ask_to_record(on, self.number),
            Some(_) => answers.push(text(&json!({
                "type": "refused",
                "why": "only the user who runs the view, or a page with a token (`--token`), can record",
            }))),
            None => {}
        }
        if let Some(points) = &question.epipolar {
            answers.push(self.lines(points));
        }
        if let Some((at, finished)) = question.at.zip(self.site.finished.clone()) {
            let turn = self.site.reading.lock();
            let _turn = turn.unwrap_or_else(PoisonError::into_inner);
            answers.extend(read(&finished, at, &self.shown));
        }
        answers
    }

    /// Changes the views whose pictures are shown.
    fn show(&mut self, views: &[usize]) {
        for view in 0..MAX_VIEWS {
            let on = views.contains(&view);
            let count = self.board().wanted(view).filter(|_| on != self.shown[view]);
            match count {
                Some(count) if on => drop(count.fetch_add(1, Ordering::Relaxed)),
                Some(count) => drop(count.fetch_sub(1, Ordering::Relaxed)),
                None => {}
            }
            self.shown[view] = on;
        }
    }

    fn lines(&self, points: &[(usize, [f64; 2])]) -> Message {
        let points = &points[..points.len().min(MOST_POINTS)];
        let scene = self.board().scene();
        let lines = scene.map_or_else(Vec::new, |scene| scene.epipolar_lines(points));
        text(&json!({ "type": "epipolar", "lines": lines }))
    }
}

/// Reads a frame of a finished run and its pictures. The frame is sent last, and completes the response.
fn read(finished: &Arc<Finished>, at: usize, shown: &[bool; MAX_VIEWS]) -> Vec<Message> {
    let moment = match finished.moment(at) {
        Ok(moment) => moment,
        Err(why) => {
            return vec![text(
                &json!({ "type": "unread", "at": at, "why": why.to_string() }),
            )];
        }
    };
    let views = (0..MAX_VIEWS).filter(|view| shown[*view]);
    let pictures = views.filter_map(|view| finished.picture(moment.frame, view));
    let mut messages: Vec<Message> =
        pictures.map(|picture| Message::Binary(picture.into())).collect();
    messages.push(Message::Text(moment.text().into()));
    messages
}

#[cfg(test)]
mod tests {
    use geometry::{Camera, Intrinsics, Lens};
    use nalgebra::{Isometry3, Vector3};
    use skeleton::PARSE14;

    use super::*;
    use crate::scene::{Scene, View};

    /// Requests of pages.
    const QUESTIONS: [&str; 8] = [
        r#"{"pictures":[0,1]}"#,
        r#"{"pictures":[]}"#,
        r#"{"pictures":[18446744073709551615,0,0,7]}"#,
        r#"{"record":true}"#,
        r#"{"at":12}"#,
        r#"{"epipolar":[[0,[320.5,240.25]],[1,[-1e300,0]],[9,[0,0]]]}"#,
        r#"{"pictures":[1],"at":0,"record":false,"epipolar":[[1,[1e308,-1e308]]]}"#,
        r#"{"epipolar":[[0,[0,0]],[0,[639,479]],[0,[1e5,1e5]],[1,[320,240]]]}"#,
    ];

    fn page() -> Page {
        let intrinsics = Intrinsics {
            size: [640, 480],
            fx: 500.0,
            fy: 500.0,
            cx: 319.5,
            cy: 239.5,
            lens: Lens::default(),
        };
        let view = |x: f64| View {
            name: x.to_string(),
            size: [640, 480],
            camera: Some(Camera {
                name: x.to_string(),
                intrinsics,
                camera_from_world: Isometry3::new(
                    Vector3::new(x, 0.0, 3.0),
                    Vector3::new(0.0, x, 0.0),
                ),
            }),
        };
        let scene = Scene {
            name: "test".to_owned(),
            views: vec![view(0.0), view(0.5)],
            joints: &PARSE14,
            up: [0.0, 0.0, 1.0],
            frame_rate_hz: None,
            tells_facing: true,
            problem: None,
        };
        let board = Board::new();
        board.begin(&json!({ "type": "hello" }), Some(Arc::new(scene)));
        Page {
            number: board.open_page(),
            may_record: true,
            site: Site {
                board: Arc::new(board),
                finished: None,
                reading: Arc::default(),
                token: None,
            },
            shown: [false; MAX_VIEWS],
            seen: 0,
            n_refused: 0,
        }
    }

    /// Returns the responses to a request, after checking that they are JSON and that only invalid requests are refused.
    fn ask(page: &mut Page, question: &str) -> Vec<Value> {
        let refused_before = page.n_refused;
        let answers = page.answer(question);
        let is_question = serde_json::from_str::<Question>(question).is_ok();
        assert_eq!(
            page.n_refused - refused_before,
            u32::from(!is_question),
            "{question:?}"
        );
        let answers = answers.iter().map(|answer| serde_json::from_str(answer.to_text().unwrap()));
        let answers: Vec<Value> = answers.collect::<Result<_, _>>().unwrap();
        assert!(answers.len() <= 1, "{question:?}: {answers:?}");
        answers
    }

    #[test]
    fn epipolar_lines_are_drawn_for_existing_points_and_invalid_requests_are_refused() {
        let mut page = page();
        let lines = ask(&mut page, QUESTIONS[5]);
        assert_eq!(lines[0]["type"], "epipolar");
        let between: Vec<[u64; 2]> = lines[0]["lines"]
            .as_array()
            .unwrap()
            .iter()
            .map(|array| [array[0].as_u64().unwrap(), array[1].as_u64().unwrap()])
            .collect();
        assert!(
            between.contains(&[0, 1])
                && between.iter().all(|pair| pair.iter().all(|value| *value < 2)),
            "{between:?}"
        );
        let refused = ask(&mut page, r#"{"pictures":[-1]}"#);
        assert_eq!(refused[0]["type"], "refused");
        assert_eq!(ask(&mut page, r#"{"record":true}"#), Vec::<Value>::new());
        assert_eq!(page.board().take_record(), Some(true));
    }

    #[test]
    fn a_recording_ends_with_its_page_and_a_page_of_another_user_cannot_start_one() {
        let mut first = page();
        let board = Arc::clone(&first.site.board);
        ask(&mut first, r#"{"record":true}"#);
        assert_eq!(board.take_record(), Some(true));
        let mut stranger = Page {
            number: board.open_page(),
            may_record: false,
            site: first.site.clone(),
            shown: [false; MAX_VIEWS],
            seen: 0,
            n_refused: 0,
        };
        for asked in [r#"{"record":true}"#, r#"{"record":false}"#] {
            let refused = ask(&mut stranger, asked);
            assert_eq!(refused[0]["type"], "refused");
        }
        drop(stranger);
        assert_eq!(board.take_record(), None);
        drop(first);
        assert_eq!(board.take_record(), Some(false));
    }

    #[test]
    fn a_page_survives_any_requests_and_leaves_no_counts_behind() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut page = page();
        for _ in 0..4000 {
            let seed = *random.choice(&QUESTIONS).unwrap();
            let mut bytes = seed.as_bytes().to_vec();
            for _ in 0..random.usize(0..4) {
                let at = random.usize(0..=bytes.len());
                let end = (at + random.usize(0..6)).min(bytes.len());
                let other = random.choice(&QUESTIONS).unwrap().as_bytes();
                let from = random.usize(0..other.len());
                match random.u8(0..4) {
                    0 => drop(bytes.drain(at..end)),
                    1 => drop(bytes.splice(at..end, other[from..].iter().copied().take(9))),
                    2 => drop(bytes.splice(
                        at..at,
                        b"-9e]["[random.usize(0..5)..].iter().copied().take(1),
                    )),
                    _ => bytes[at..end].fill(random.u8(b' '..b'~')),
                }
            }
            ask(&mut page, &String::from_utf8_lossy(&bytes));
        }
        let site = page.site.clone();
        assert!((0..MAX_VIEWS).any(|i| site.board.wants(i)));
        drop(page);
        assert!((0..MAX_VIEWS).all(|i| !site.board.wants(i)));
    }
}
