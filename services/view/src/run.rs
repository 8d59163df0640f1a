//! Serves the page until a stop is requested.

use core::net::SocketAddr;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _, Stop};

use crate::board::Board;
use crate::door;
use crate::finished::Finished;
use crate::live;
use crate::options::{Listen, Options, Subject};
use crate::server;
use crate::site::Site;

/// Serves a page until a stop is requested.
///
/// The process has a lower priority than the deployment: if processor time is scarce, the page waits.
///
/// * `say`: called once with the address of the page, when the page can be opened.
///
/// # Errors
///
/// Fails if the folder or recording cannot be read, if the address is in use or does not belong to this machine, or if it is not the
/// loopback and there is no token.
pub fn run(options: &Options, stop: &Stop, say: &mut dyn FnMut(&str)) -> Result<(), Failure> {
    check(&options.listen)?;
    let finished = match &options.subject {
        Subject::Deployment(_) => None,
        Subject::Folder(path) => Some(Finished::folder(path)?),
        Subject::Recording(path) => Some(Finished::tape(path)?),
    };
    runtime::give_way();
    let listener = bind(&options.listen)?;
    let address = listener.local_addr().or_fail(ExitKind::Run)?;
    let board = Arc::new(Board::new());
    if let Some(finished) = &finished {
        board.begin(&finished.hello(), Some(finished.scene()));
    }
    let site = Site {
        board: Arc::clone(&board),
        finished: finished.map(Arc::new),
        reading: Arc::default(),
        token: options.listen.token.clone(),
    };
    let looker = match &options.subject {
        Subject::Deployment(named) => {
            let (named, most) = (named.clone(), options.pictures_per_second);
            let (board, stop) = (Arc::clone(&board), stop.clone());
            let look = move || live::follow(named.as_deref(), most, &board, &stop);
            let thread = std::thread::Builder::new().name("look".to_owned());
            Some(thread.spawn(look).or_fail(ExitKind::Run)?)
        }
        _ => None,
    };
    say(&url(address, options.listen.token.as_deref()));
    let served = door::open(&listener, stop, move |stream| server::talk(stream, &site));
    stop.request();
    if let Some(looker) = looker {
        let panicked = |_| {
            Failure::new(
                ExitKind::Run,
                "the thread that watches the deployment panicked",
            )
        };
        looker.join().map_err(panicked)?;
    }
    served.or_fail(ExitKind::Run)
}

fn check(listen: &Listen) -> Result<(), Failure> {
    if listen.address.ip().is_loopback() || listen.token.is_some() {
        return Ok(());
    }
    let text = format!(
        "{} is not a loopback address, so a token is needed",
        listen.address
    );
    Err(Failure::new(ExitKind::Usage, text))
}

fn bind(listen: &Listen) -> Result<TcpListener, Failure> {
    let mut bound = TcpListener::bind(listen.address);
    let is_taken = |error: &io::Error| error.kind() == io::ErrorKind::AddrInUse;
    if listen.may_move && bound.as_ref().is_err_and(is_taken) {
        bound = TcpListener::bind(SocketAddr::new(listen.address.ip(), 0));
    }
    bound.map_err(|error| {
        let text = format!("cannot listen on {}: {error}", listen.address);
        Failure::new(ExitKind::Run, text).with_hint("--port 0 uses any free port")
    })
}

/// Returns the URL of the page.
fn url(address: SocketAddr, token: Option<&str>) -> String {
    let token = token.map_or_else(String::new, |token| format!("?token={token}"));
    format!("http://{address}/{token}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_loopback_needs_no_token() {
        let mut listen = Listen::usual();
        check(&listen).unwrap();
        listen.address.set_ip([0, 0, 0, 0].into());
        assert_eq!(check(&listen).unwrap_err().kind(), ExitKind::Usage);
        listen.token = Some("secret".to_owned());
        check(&listen).unwrap();
    }

    #[test]
    fn a_port_in_use_is_an_error_or_is_replaced_by_another_if_allowed() {
        let other = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut listen = Listen {
            address: other.local_addr().unwrap(),
            ..Listen::usual()
        };
        let moved = bind(&listen).unwrap().local_addr().unwrap();
        assert_ne!(moved.port(), listen.address.port());
        listen.may_move = false;
        let refused = bind(&listen).unwrap_err().to_string();
        assert!(refused.contains("cannot listen on 127.0.0.1"), "{refused}");
    }
}
