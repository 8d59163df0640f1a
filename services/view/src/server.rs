//! Access rules, and the files of the page.
//!
//! On the loopback, any process of this machine can request the page, but pages of other sites cannot. The name in `Host` must be a name of
//! the loopback; this refuses other host names that resolve to 127.0.0.1. If a browser makes a request for another site, `Origin` names
//! that site, and the request is refused. If a token is set, which is required on any other address, pages must know the token instead. The
//! files of the page contain no data; all data is sent through the web socket.

use core::net::IpAddr;

use std::io;
use std::net::TcpStream;
use std::time::Instant;

use tungstenite::handshake::server::{create_response, write_response};
use tungstenite::http::HeaderMap;
use tungstenite::http::header::{HOST, ORIGIN};

use crate::door::{LONGEST_REQUEST, Peer, Seat};
use crate::http::{self, Answer, Asked, Timed};
use crate::site::Site;
use crate::socket::Opened;

/// Largest number of simultaneous pages.
pub(crate) const MOST_PAGES: usize = 64;

const INDEX: &str = include_str!("../page/index.html");
const STYLE: &str = include_str!("../page/view.css");
/// Modules of the page, except the module `stage`, which reports use as well.
const MODULES: [(&str, &str); 4] = [
    ("/view.js", include_str!("../page/view.js")),
    ("/pictures.js", include_str!("../page/pictures.js")),
    ("/panels.js", include_str!("../page/panels.js")),
    ("/link.js", include_str!("../page/link.js")),
];

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Headers of every response.
const HEADERS: [(&str, &str); 5] = [
    ("Content-Security-Policy", POLICY),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cache-Control", "no-store"),
];

/// Responds to the request of a connection. If the request opens a page, messages are exchanged until the page closes.
pub(crate) fn talk(stream: TcpStream, site: &Site) {
    let mut timed = Timed {
        stream: &stream,
        until: Instant::now() + LONGEST_REQUEST,
    };
    let page = http::read(&mut timed).and_then(|asked| {
        let answer = match asked {
            Ok(asked) => match answer(&stream, asked, site) {
                Ok(page) => {
                    write_response(&mut timed, &page.response).map_err(io::Error::other)?;
                    return Ok(Some(page));
                }
                Err(answer) => answer,
            },
            Err(answer) => answer,
        };
        answer.write(&mut timed, &HEADERS)?;
        Ok(None)
    });
    match page {
        Ok(Some(page)) => page.talk(stream, site.clone()),
        Ok(None) => {}
        Err(error) => tracing::debug!(%error, "a connection ended before its response"),
    }
}

/// Opens a page, or returns another response.
fn answer(stream: &TcpStream, asked: Asked, site: &Site) -> Result<Opened, Answer> {
    let request = &asked.request;
    check(request.headers(), site.token.is_some()).map_err(|why| Answer::text(403, why))?;
    if request.uri().path() != "/ws" {
        return Err(file(request.uri().path()));
    }
    let response = create_response(request).map_err(|why| Answer::text(400, &why.to_string()))?;
    if let Some(token) = &site.token
        && !is_same(token, token_in(request.uri().query()))
    {
        return Err(Answer::text(403, "the token is missing or wrong"));
    }
    let seat = Seat::take(site.board.pages(), MOST_PAGES)
        .ok_or_else(|| Answer::text(503, &format!("{MOST_PAGES} pages are open already")))?;
    let is_own = || Peer::new(stream).is_ok_and(Peer::is_same_user);
    Ok(Opened {
        response,
        rest: asked.rest,
        seat,
        may_record: site.token.is_some() || is_own(),
    })
}

/// Returns a file of the page.
fn file(path: &str) -> Answer {
    let script = |text| Answer::file("text/javascript", text);
    match path {
        "/" => Answer::file("text/html", INDEX),
        "/look.css" => Answer::file("text/css", exports::report::STYLE),
        "/view.css" => Answer::file("text/css", STYLE),
        "/stage.js" => script(exports::report::STAGE),
        _ => match MODULES.iter().find(|module| module.0 == path) {
            Some((_, text)) => script(text),
            None => Answer::text(404, "there is no such file"),
        },
    }
}

/// Returns the token in the query string; tokens have no characters that need escaping.
fn token_in(query: Option<&str>) -> &str {
    let pairs = query.unwrap_or_default().split('&');
    let mut tokens = pairs.filter_map(|pair| pair.strip_prefix("token="));
    tokens.next().unwrap_or_default()
}

/// Compares tokens in constant time, so that the time does not reveal how many characters are correct.
fn is_same(token: &str, other: &str) -> bool {
    let differences = token.bytes().zip(other.bytes());
    let differences = differences.fold(0, |sum, (a, b)| sum | (a ^ b));
    token.len() == other.len() && differences == 0
}

/// Refuses requests that pages of other sites make.
///
/// * `has_token`: true if pages must know a token; then any host name of this machine is allowed.
fn check(headers: &HeaderMap, has_token: bool) -> Result<(), &'static str> {
    let mut hosts = headers.get_all(HOST).iter();
    let host = hosts.next().and_then(|host| host.to_str().ok());
    let host = host.filter(|_| hosts.next().is_none());
    let host = host.ok_or("the request must have exactly one Host header")?;
    if !has_token && !is_loopback(host) {
        return Err("this page is only for this machine: open it as localhost or 127.0.0.1");
    }
    let Some(origin) = headers.get(ORIGIN) else {
        return Ok(());
    };
    let origin = origin.to_str().unwrap_or_default();
    let site = ["http://", "https://"].iter().find_map(|name| origin.strip_prefix(name));
    if site == Some(host) {
        Ok(())
    } else {
        Err("requests from pages of other sites are refused")
    }
}

/// Returns true if a host, with an optional port, is a name of the loopback. Any port is allowed, because tunnels use their own.
fn is_loopback(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let is_address = |name: &str| name.parse().is_ok_and(|value: IpAddr| value.is_loopback());
    let inner = name.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    name.eq_ignore_ascii_case("localhost") || is_address(inner.unwrap_or(name))
}

#[cfg(test)]
mod tests {
    use tungstenite::http::HeaderValue;

    use super::*;

    fn checked(host: &str, origin: Option<&str>, has_token: bool) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, HeaderValue::from_str(host).unwrap());
        if let Some(origin) = origin {
            headers.insert(ORIGIN, HeaderValue::from_str(origin).unwrap());
        }
        check(&headers, has_token).is_ok()
    }

    #[test]
    fn pages_of_other_sites_are_refused() {
        for host in [
            "127.0.0.1:7878",
            "127.0.0.2:7878",
            "localhost:9",
            "LOCALHOST",
            "[::1]:80",
        ] {
            assert!(checked(host, None, false), "{host}");
        }
        for host in [
            "evil.example:7878",
            "127.0.0.1.evil.example",
            "10.0.0.1",
            "",
            "localhost:x",
        ] {
            assert!(!checked(host, None, false), "{host}");
        }
        let here = "localhost:7878";
        assert!(checked(here, Some("http://localhost:7878"), false));
        for origin in [
            "http://localhost:3000",
            "http://evil.example",
            "null",
            "localhost:7878",
        ] {
            assert!(!checked(here, Some(origin), false), "{origin}");
        }
        assert!(check(&HeaderMap::new(), true).is_err());
    }

    #[test]
    fn with_a_token_any_host_name_is_accepted_and_other_sites_are_refused() {
        assert!(checked(
            "desk.example:7878",
            Some("http://desk.example:7878"),
            true
        ));
        assert!(!checked(
            "desk.example:7878",
            Some("http://evil.example"),
            true
        ));
        assert_eq!(token_in(Some("x=1&token=abc")), "abc");
        assert_eq!(token_in(None), "");
        assert!(is_same("abc", "abc"));
        for other in ["", "ab", "abd", "abcd"] {
            assert!(!is_same("abc", other), "{other}");
        }
    }

    #[test]
    fn all_files_and_elements_that_the_page_uses_exist() {
        let scripts = MODULES.map(|module| module.1);
        for text in scripts.iter().chain([&INDEX]) {
            for piece in text.split("\"./").skip(1) {
                let name = format!("/{}", piece.split('"').next().unwrap());
                let is_served = MODULES.iter().any(|module| module.0 == name)
                    || ["/stage.js", "/look.css", "/view.css"].contains(&name.as_str());
                assert!(is_served, "{name}");
            }
            for piece in text.split("element(\"").skip(1) {
                let id = piece.split('"').next().unwrap();
                assert!(INDEX.contains(&format!("id=\"{id}\"")), "{id}");
            }
        }
        for outside in ["http:", "https:", "//cdn", "onclick=", "style=\""] {
            assert!(!INDEX.contains(outside), "{outside}");
        }
    }
}
