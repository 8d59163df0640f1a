//! A deployment that runs, as seen from outside: its processes, and where their time goes.

mod board;
mod describe;
mod table;

use core::time::Duration;
use std::time::Instant;

use runtime::{Failure, Namespace, Observer, now_nanos};

pub use board::{Board, Member, Standing};
pub use describe::{describe, measured};
pub use table::table;

/// How long the first words of all processes are waited for.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(20);

/// Looks at a deployment for as long as it runs.
#[derive(Debug)]
pub struct Live {
    name: String,
    observer: Observer,
}

impl Live {
    /// Begins to look.
    ///
    /// # Errors
    ///
    /// The deployment does not run, or cannot be looked into.
    pub fn open(namespace: &Namespace) -> Result<Self, Failure> {
        Ok(Self {
            name: namespace.name().to_owned(),
            observer: Observer::open(namespace)?,
        })
    }

    /// What is to be seen now.
    ///
    /// # Errors
    ///
    /// What it says cannot be received.
    pub fn look(&mut self) -> Result<Board, Failure> {
        let supervisor = self.observer.supervisor();
        let seen = self.observer.observe()?;
        Ok(Board::new(&self.name, supervisor, &seen, now_nanos()))
    }

    /// The same once everybody has said something, or two seconds are over.
    ///
    /// # Errors
    ///
    /// As of [`Self::look`].
    pub fn first_look(&mut self) -> Result<Board, Failure> {
        let begin = Instant::now();
        loop {
            let board = self.look()?;
            if board.is_complete() || begin.elapsed() > PATIENCE || self.is_over() {
                return Ok(board);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Whether the deployment ends, and this has to be dropped.
    pub fn is_over(&self) -> bool {
        self.observer.is_over()
    }
}
