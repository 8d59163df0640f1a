//! Follows a running deployment, and puts its messages on the board.

mod events;
mod session;
mod tape;

use core::time::Duration;
use std::time::Instant;

use failure::{Failure, Stop};
use serde_json::{Value, json};

use crate::board::{Board, Weight};
use session::{Look, Session};

/// Pause between two checks of the deployment while a page is open; shorter than the frame period of any camera.
const TURN: Duration = Duration::from_millis(12);
/// Pause between two checks of the deployment while no page is open.
const IDLE_TURN: Duration = Duration::from_millis(150);
/// Pause between two attempts to find the deployment.
const ABSENT: Duration = Duration::from_millis(250);

/// Follows a deployment until a stop is requested: waits for a run, follows it until it ends, and waits for the next run.
///
/// * `named`: name of the deployment; if `None`, the only running deployment.
/// * `pictures_per_second`: largest number of pictures per second for each view.
pub(crate) fn follow(named: Option<&str>, pictures_per_second: u32, board: &Board, stop: &Stop) {
    let mut said = None;
    while !stop.is_requested() {
        let why = match Session::open(named, pictures_per_second, stop) {
            Ok(session) => {
                let ended = watch(session, board, stop);
                said = None;
                ended.err().map(|error| error.to_string())
            }
            Err(why) => Some(why.to_string()),
        };
        let why = why.unwrap_or_else(|| "the deployment has ended".to_owned());
        if said.as_ref() != Some(&why) {
            board.begin(&waiting(named, &why), None);
            said = Some(why);
        }
        std::thread::sleep(ABSENT);
    }
}

/// Returns the first message to a page while no deployment runs.
fn waiting(named: Option<&str>, why: &str) -> Value {
    json!({ "type": "hello", "mode": "waiting", "name": named, "why": why })
}

/// Follows the deployment until it ends.
fn watch(mut session: Session, board: &Board, stop: &Stop) -> Result<(), Failure> {
    board.begin(&session.hello(), Some(session.scene()));
    board.event(Weight::Note, "connected to the deployment");
    while !stop.is_requested() {
        let turned = Instant::now();
        if session.look(board)? == Look::Over {
            break;
        }
        let pause = if board.has_pages() { TURN } else { IDLE_TURN };
        std::thread::sleep(pause.saturating_sub(turned.elapsed()).max(TURN / 4));
    }
    session.leave(board);
    Ok(())
}
