//! Who may ask, and the files of the page.
//!
//! On the loopback any process of this machine may ask, but no page of another site: the name in `Host` has to be that of
//! the loopback, which a site cannot have even if it makes its own name mean 127.0.0.1, and what a browser asks for on behalf
//! of another site has that site in `Origin`. With a token, which is needed on any other address, pages have to know it
//! instead. The files of the page hold no data: what does, goes over the one web socket.

use core::net::IpAddr;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{ConnectInfo, RawQuery, Request, State};
use axum::http::header::{HOST, ORIGIN};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;

use crate::door::{Peer, Seat};
use crate::site::Site;
use crate::socket;

/// The largest message of a page, bytes.
const LARGEST_QUESTION: usize = 16 << 10;
/// Most pages at the same time.
pub(crate) const MOST_PAGES: usize = 64;

const INDEX: &str = include_str!("../page/index.html");
const STYLE: &str = include_str!("../page/view.css");
/// The modules of the page, but for the stage that it shares with reports.
const MODULES: [(&str, &str); 4] = [
    ("/view.js", include_str!("../page/view.js")),
    ("/pictures.js", include_str!("../page/pictures.js")),
    ("/panels.js", include_str!("../page/panels.js")),
    ("/link.js", include_str!("../page/link.js")),
];

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The files of the page and its web socket.
pub(crate) fn router(site: Site) -> Router {
    let script = |text: &'static str| get(move || async move { file("text/javascript", text) });
    let mut router = Router::new()
        .route("/", get(|| async { file("text/html", INDEX) }))
        .route(
            "/look.css",
            get(|| async { file("text/css", ::report::STYLE) }),
        )
        .route("/view.css", get(|| async { file("text/css", STYLE) }))
        .route("/stage.js", script(::report::STAGE));
    for (path, text) in MODULES {
        router = router.route(path, script(text));
    }
    router
        .route("/ws", get(upgrade))
        .fallback(|| async { (StatusCode::NOT_FOUND, "there is no such file") })
        .layer(from_fn(with_headers))
        .layer(from_fn_with_state(site.clone(), guard))
        .with_state(site)
}

fn file(kind: &'static str, text: &'static str) -> Response {
    let kind = format!("{kind}; charset=utf-8");
    ([("content-type", kind)], text).into_response()
}

async fn upgrade(
    State(site): State<Site>,
    ConnectInfo(peer): ConnectInfo<Peer>,
    RawQuery(asked): RawQuery,
    socket: WebSocketUpgrade,
) -> Response {
    if let Some(token) = &site.token
        && !is_same(token, token_in(asked.as_deref()))
    {
        return (StatusCode::FORBIDDEN, "the token is missing or wrong").into_response();
    }
    let Some(seat) = Seat::take(site.board.pages(), MOST_PAGES) else {
        let what = format!("{MOST_PAGES} pages are open already");
        return (StatusCode::SERVICE_UNAVAILABLE, what).into_response();
    };
    let may_record = site.token.is_some() || peer.is_same_user();
    let socket = socket.max_message_size(LARGEST_QUESTION);
    let socket = socket.max_frame_size(LARGEST_QUESTION);
    socket.on_upgrade(move |socket| {
        peer.become_page();
        socket::talk(socket, site, seat, may_record)
    })
}

/// The token in what stands behind `?`; tokens have no characters that are written in another way there.
fn token_in(query: Option<&str>) -> &str {
    let pairs = query.unwrap_or_default().split('&');
    let mut tokens = pairs.filter_map(|it| it.strip_prefix("token="));
    tokens.next().unwrap_or_default()
}

/// Compares in a time that does not tell how much of it is right.
fn is_same(token: &str, other: &str) -> bool {
    let differences = token.bytes().zip(other.bytes());
    let differences = differences.fold(0, |sum, (a, b)| sum | (a ^ b));
    token.len() == other.len() && differences == 0
}

/// Refuses what a page of another site asks for.
async fn guard(State(site): State<Site>, request: Request, next: Next) -> Response {
    match check(request.headers(), site.token.is_some()) {
        Ok(()) => next.run(request).await,
        Err(why) => (StatusCode::FORBIDDEN, why).into_response(),
    }
}

/// * `has_token`: whether pages have to know a token, so that any name of this machine will do.
fn check(headers: &HeaderMap, has_token: bool) -> Result<(), &'static str> {
    let mut hosts = headers.get_all(HOST).iter();
    let host = hosts.next().and_then(|it| it.to_str().ok());
    let host = host.filter(|_| hosts.next().is_none());
    let host = host.ok_or("the request has no host, or several")?;
    if !has_token && !is_loopback(host) {
        return Err("this page is for this machine: ask for it as localhost or 127.0.0.1");
    }
    let Some(origin) = headers.get(ORIGIN) else {
        return Ok(());
    };
    let origin = origin.to_str().unwrap_or_default();
    let site = ["http://", "https://"]
        .iter()
        .find_map(|it| origin.strip_prefix(it));
    if site == Some(host) {
        Ok(())
    } else {
        Err("pages of other sites may not ask")
    }
}

/// Whether a host, with its port, is a name of the loopback. Any port: a tunnel has its own.
fn is_loopback(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|it| it.is_ascii_digit()) => name,
        _ => host,
    };
    let is_address = |name: &str| name.parse().is_ok_and(|it: IpAddr| it.is_loopback());
    let inner = name.strip_prefix('[').and_then(|it| it.strip_suffix(']'));
    name.eq_ignore_ascii_case("localhost") || is_address(inner.unwrap_or(name))
}

async fn with_headers(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    for (name, value) in [
        ("content-security-policy", POLICY),
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cross-origin-resource-policy", "same-origin"),
        ("cache-control", "no-store"),
    ] {
        let name = HeaderName::from_static(name);
        response
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
    }
    response
}

#[cfg(test)]
mod tests {
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
    fn with_a_token_any_name_of_the_machine_will_do_and_other_sites_still_not() {
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
    fn the_page_loads_files_that_are_served_and_finds_every_element_that_it_asks_for() {
        let scripts = MODULES.map(|it| it.1);
        for text in scripts.iter().chain([&INDEX]) {
            for piece in text.split("\"./").skip(1) {
                let name = format!("/{}", piece.split('"').next().unwrap());
                let is_served = MODULES.iter().any(|it| it.0 == name)
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
