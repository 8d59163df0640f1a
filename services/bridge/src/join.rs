//! Joins a run: checks that the fusing host has the same files, and determines the time at which the run began, by this host's clock.

use core::time::Duration;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::hosts::{
    Answer, Clock, Difference, Exchange, Fingerprint, Hello, Signal, VERSION, Welcome,
};
use failure::{Stop, now_nanos};

use crate::address::{Address, LinkError};
use crate::link::Link;
use crate::topics::Topics;

/// Number of time exchanges before a run.
const N_EXCHANGES: usize = 12;
const ASK_EVERY: Duration = Duration::from_millis(50);
/// Interval between messages to the user while the other host does not answer.
const SAY_EVERY: Duration = Duration::from_secs(10);

/// Error if a host cannot join the run.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// The link cannot be opened.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The files of this host differ from those of the fusing host.
    #[error("the fusing host does not accept this host: {}", listed(.0))]
    Refused(Vec<Difference>),
}

/// Lists the differences between the hosts. In the answer of the fusing host, `here` is that host; in this list, it is this host.
pub(crate) fn listed(all: &[Difference]) -> String {
    let each = all.iter().map(|difference| {
        let (there, here) = (&difference.here, &difference.there);
        format!(
            "{} is {here} on this host, but {there} on the fusing host",
            difference.what
        )
    });
    each.collect::<Vec<_>>().join("; ")
}

#[derive(Debug, Default)]
struct Heard {
    clock: Clock,
    n_exchanges: usize,
    answer: Option<Answer>,
}

/// Waits for the fusing host. Returns the time at which the run began, in nanoseconds by this host's clock; `None` on a stop request.
///
/// * `say`: called with messages for the user while the other host does not answer.
///
/// # Errors
///
/// Fails with [`JoinError`] if the host cannot join.
pub fn join(
    address: &Address,
    fingerprint: &Fingerprint,
    stop: &Stop,
    say: &mut dyn FnMut(&str),
) -> Result<Option<u64>, JoinError> {
    let link = Link::open(address)?;
    let topics = Topics::of(&address.deployment);
    let heard = Arc::new(Mutex::new(Heard::default()));
    let origin = fastrand::u64(..);
    listen(&link, &topics, &address.host, &heard)?;
    let hello = Hello {
        version: VERSION,
        host: address.host.clone(),
        origin,
        fingerprint: fingerprint.clone(),
    };
    let mut said = None::<Instant>;
    let welcome = loop {
        if stop.is_requested() {
            return Ok(None);
        }
        let lock = heard.lock().unwrap_or_else(PoisonError::into_inner);
        match (&lock.answer, lock.n_exchanges) {
            (Some(Answer::Refused(why)), _) => return Err(JoinError::Refused(why.clone())),
            (Some(Answer::Welcome(welcome)), N_EXCHANGES..) => break *welcome,
            _ => {}
        }
        drop(lock);
        if said.is_none_or(|said| said.elapsed() > SAY_EVERY) {
            if said.is_some() {
                let what = if address.keys.is_some() {
                    "; check that it is running and reachable, that its keys come from the same authority, and that the certificate of \
                     this host contains its name"
                } else {
                    ""
                };
                say(&format!("{} does not answer yet{what}", address.address));
            }
            said = Some(Instant::now());
        }
        link.send(&topics.hello(&address.host), hello.to_bytes(), true);
        let ping = Signal::Ping {
            origin,
            asked_at: now_nanos(),
        };
        link.send(&topics.up(&address.host), ping.to_bytes().to_vec(), true);
        std::thread::sleep(ASK_EVERY);
    };
    let clock = heard.lock().unwrap_or_else(PoisonError::into_inner).clock.clone();
    link.close();
    Ok(Some(begin(&clock, welcome)))
}

/// Returns the time at which a run began, by this host's clock.
fn begin(clock: &Clock, welcome: Welcome) -> u64 {
    let now = now_nanos();
    clock.estimate(now).map_or(now, |estimate| estimate.ours(welcome.session))
}

fn listen(
    link: &Link,
    topics: &Topics,
    host: &str,
    heard: &Arc<Mutex<Heard>>,
) -> Result<(), LinkError> {
    let of_answers = Arc::clone(heard);
    link.subscribe(&topics.answer(host), move |_, bytes| {
        if let Ok(answer) = Answer::parse(bytes) {
            let mut heard = of_answers.lock().unwrap_or_else(PoisonError::into_inner);
            heard.answer = Some(answer);
        }
    })?;
    let of_signals = Arc::clone(heard);
    link.subscribe(&topics.down(host), move |_, bytes| {
        let heard_at = now_nanos();
        if let Ok(Signal::Pong {
            asked_at,
            received_at,
            answered_at,
            ..
        }) = Signal::parse(bytes)
        {
            let mut heard = of_signals.lock().unwrap_or_else(PoisonError::into_inner);
            let exchange = Exchange {
                asked_at,
                received_at,
                answered_at,
                heard_at,
            };
            heard.n_exchanges += usize::from(heard.clock.add(exchange).is_ok());
        }
    })
}

/// Returns the state of all hosts, as reported by the fusing host; `None` if it does not answer within `limit`.
///
/// # Errors
///
/// Fails if the link cannot be opened.
pub fn status(address: &Address, limit: Duration) -> Result<Option<String>, LinkError> {
    let link = Link::open(address)?;
    let key = Topics::of(&address.deployment).status();
    let begin = Instant::now();
    let mut answer = None;
    while answer.is_none() && begin.elapsed() < limit {
        answer = link.ask(&key, Duration::from_millis(500));
        if answer.is_none() {
            std::thread::sleep(Duration::from_millis(100));
        }
    }
    link.close();
    Ok(answer.and_then(|answer| String::from_utf8(answer).ok()))
}
