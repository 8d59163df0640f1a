//! The conversation with one page.

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::sync::Arc;

use axum::extract::ws::{Message, WebSocket};
use messages::MAX_VIEWS;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::timeout;

use crate::board::Board;
use crate::finished::Finished;
use crate::site::Site;

/// How long a page may take to accept a message.
const PATIENCE: Duration = Duration::from_secs(10);
/// Messages that make no sense before a page is left.
const MOST_REFUSED: u32 = 20;
/// Most points whose lines are asked for at once.
const MOST_POINTS: usize = 64;

/// What a page may ask; everything that it leaves out stays.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    /// The views whose pictures it shows.
    pictures: Option<Vec<usize>>,
    /// The frame of a finished run that it shows, from 0.
    at: Option<usize>,
    /// Whether to record what runs.
    record: Option<bool>,
    /// Points whose lines in other views it shows: view, and pixel in it.
    epipolar: Option<Vec<(usize, [f64; 2])>>,
}

/// A page, counted while it is open.
struct Page {
    site: Site,
    shown: [bool; MAX_VIEWS],
    seen: u64,
    n_refused: u32,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.show(&[]);
        self.board().pages().fetch_sub(1, Ordering::Relaxed);
    }
}

/// Talks with a page until it goes, takes too long, or makes no sense.
pub(crate) async fn talk(mut socket: WebSocket, site: Site) {
    site.board.pages().fetch_add(1, Ordering::Relaxed);
    let mut changes = site.board.changes();
    let mut page = Page {
        site,
        shown: [false; MAX_VIEWS],
        seen: 0,
        n_refused: 0,
    };
    loop {
        let (seen, new) = page.board().since(page.seen, &page.shown);
        page.seen = seen;
        for message in new {
            if !send(&mut socket, message).await {
                return;
            }
        }
        tokio::select! {
            changed = changes.changed() => if changed.is_err() { return },
            asked = socket.recv() => match asked {
                Some(Ok(Message::Text(text))) => {
                    for answer in page.answer(&text).await {
                        if !send(&mut socket, answer).await {
                            return;
                        }
                    }
                }
                Some(Ok(Message::Binary(_))) => page.n_refused += 1,
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
            },
        }
        if page.n_refused > MOST_REFUSED {
            return;
        }
    }
}

/// Whether the page has taken it.
async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(timeout(PATIENCE, socket.send(message)).await, Ok(Ok(())))
}

fn text(value: &Value) -> Message {
    Message::Text(value.to_string().into())
}

impl Page {
    fn board(&self) -> &Board {
        &self.site.board
    }

    async fn answer(&mut self, question: &str) -> Vec<Message> {
        let question: Question = match serde_json::from_str(question) {
            Ok(question) => question,
            Err(why) => {
                self.n_refused += 1;
                let why = format!("not a question: {why}");
                return vec![text(&json!({ "type": "refused", "why": why }))];
            }
        };
        if let Some(views) = &question.pictures {
            self.show(views);
        }
        if let Some(on) = question.record.filter(|_| self.site.finished.is_none()) {
            self.board().ask_to_record(on);
        }
        let mut answers = Vec::new();
        if let Some(points) = &question.epipolar {
            answers.push(self.lines(points));
        }
        if let Some((at, finished)) = question.at.zip(self.site.finished.clone()) {
            let shown = self.shown;
            let read = tokio::task::spawn_blocking(move || read(&finished, at, &shown)).await;
            answers.extend(read.unwrap_or_default());
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
        let lines = scene.map_or_else(Vec::new, |it| it.epipolar_lines(points));
        text(&json!({ "type": "epipolar", "lines": lines }))
    }
}

/// A frame of a finished run and its pictures, the frame last: with it the answer is complete.
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
    let mut messages: Vec<Message> = pictures.map(|it| Message::Binary(it.into())).collect();
    messages.push(Message::Text(moment.text().into()));
    messages
}
