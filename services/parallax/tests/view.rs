//! Tests of the page of `parallax view`: the data that a browser gets of a running deployment and of a finished one, and refused requests.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Instant;

use common::started::WATCHDOG;
use common::started::signal;
use common::{Case, PACED, Started};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client};

/// The browser's end of the connection.
struct Page {
    socket: WebSocket<TcpStream>,
}

/// A running `parallax view`, and its address.
struct View {
    started: Started,
    address: String,
}

impl View {
    fn start(case: &Case, subject: &[&str]) -> Self {
        let arguments = [&["view", "--port", "0", "--json"], subject].concat();
        let mut started = case.start(&arguments);
        let mut address = String::new();
        let out = started.out_file();
        started.until("the address", |_| {
            let text = fs::read_to_string(&out).unwrap_or_default();
            let said: Option<Value> = serde_json::from_str(&text).ok();
            let url = said.and_then(|line| Some(line["url"].as_str()?.to_owned()));
            address = url.unwrap_or_default();
            !address.is_empty()
        });
        let address = address.trim_start_matches("http://");
        Self {
            address: address.trim_end_matches('/').to_owned(),
            started,
        }
    }

    fn open(&self) -> Page {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let (socket, _) = client(format!("ws://{}/ws", self.address), stream).unwrap();
        Page { socket }
    }

    /// Returns status and content of the response to a request.
    fn get(&self, path: &str, host: &str, more: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(WATCHDOG)).unwrap();
        let asked =
            format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n");
        // The server may have refused and closed the connection before everything was sent.
        let _sent = stream.write_all(asked.as_bytes());
        let mut text = Vec::new();
        let _read = stream.read_to_end(&mut text);
        let text = String::from_utf8_lossy(&text).into_owned();
        let status = text.split(' ').nth(1).and_then(|part| part.parse().ok());
        (status.unwrap_or(0), text)
    }

    fn end(self) {
        signal("TERM", self.started.id());
        self.started.wait_among_others().ends(0);
    }
}

impl Page {
    fn ask(&mut self, question: &Value) {
        let text = question.to_string();
        self.socket.send(Message::Text(text.into())).unwrap();
    }

    /// Returns the first result that `take` returns for a message.
    fn until<T>(&mut self, what: &str, mut take: impl FnMut(&Message) -> Option<T>) -> T {
        let begin = Instant::now();
        loop {
            assert!(begin.elapsed() < WATCHDOG, "no {what}");
            let message = self.socket.read().unwrap();
            if let Some(taken) = take(&message) {
                return taken;
            }
        }
    }

    /// Returns the first text of a type that meets a condition.
    fn text(&mut self, kind: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.until(kind, |message| {
            let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
            (value["type"] == kind && is_it(&value)).then_some(value)
        })
    }

    /// Returns the view, the frame and the pixels of the next picture.
    fn picture(&mut self) -> (u8, u64, [u32; 2]) {
        self.until("picture", |message| {
            let Message::Binary(bytes) = message else {
                return None;
            };
            let frame = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
            let read = image::load_from_memory(&bytes[16..]).unwrap();
            Some((bytes[1], frame, [read.width(), read.height()]))
        })
    }
}

#[test]
fn a_page_follows_a_run_from_before_its_start_until_after_its_end() {
    let case = Case::new("view", &[160; 2], PACED);
    let view = View::start(&case, &["deployment.toml"]);
    let mut page = view.open();
    page.text("hello", |value| value["mode"] == "waiting");
    let run = case.start(&["run", "deployment.toml", "--json"]);
    let hello = page.text("hello", |value| value["mode"] == "live");
    assert_eq!(hello["scene"]["views"].as_array().map(Vec::len), Some(2));
    page.ask(&json!({ "pictures": [1, 99] }));
    page.ask(&json!({ "record": true }));
    let first = page.text("moment", |value| value["why"].is_null());
    let n_joints = hello["scene"]["joints"].as_array().map(Vec::len);
    assert_eq!(first["joints"].as_array().map(Vec::len), n_joints);
    let later = page.text("moment", |value| {
        value["why"].is_null() && value["frame"] != first["frame"]
    });
    assert_ne!(later["joints"], first["joints"], "the figure moves");
    let (seen, frame, size) = page.picture();
    assert_eq!(seen, 1, "only that view was asked for");
    let (_, next, same) = page.picture();
    assert!(next > frame && same == size);
    page.ask(&json!({ "epipolar": [[0, [20.0, 30.0]], [7, [0, 0]]] }));
    let lines = page.text("epipolar", |_| true);
    assert_eq!(lines["lines"][0][1], 1, "{lines}");
    assert_eq!(lines["lines"].as_array().map(Vec::len), Some(1));
    let state = page.text("state", |value| value["recording"].is_object());
    assert!(state["processes"].as_array().unwrap().len() >= 7, "{state}");
    page.ask(&json!({ "record": false }));
    let is_kept = |value: &Value| value["what"].as_str().unwrap().starts_with("recorded to");
    page.text("event", is_kept);
    page.text("hello", |value| value["mode"] == "waiting");
    view.end();
    run.wait().ends(0);
    case.assert_nothing_left();
    finished(&case);
}

/// Checks a page about a finished run: its folder, its recording, and truncated versions of both.
fn finished(case: &Case) {
    let out = fs::read_dir(case.path("out")).unwrap();
    let names = out.map(|out| out.unwrap().file_name().into_string().unwrap());
    let recording = names.into_iter().find(|name| name.starts_with("recording-")).unwrap();
    let recording = format!("out/{recording}");
    for (subject, has_pictures) in [("out", false), (recording.as_str(), true)] {
        let view = View::start(case, &[subject]);
        let mut page = view.open();
        let hello = page.text("hello", |value| value["mode"] == "finished");
        let n = hello["n"].as_u64().unwrap();
        assert!(n > 3, "{hello}");
        page.ask(&json!({ "pictures": [0], "at": n / 2 }));
        if has_pictures {
            assert_eq!(page.picture().0, 0);
        }
        let middle = page.text("moment", |_| true);
        assert_eq!(middle["at"], n / 2);
        page.ask(&json!({ "at": 1_000_000 }));
        let last = page.text("moment", |_| true);
        assert_eq!(last["frame"], hello["last"], "beyond the end is the end");
        view.end();
    }
    // The files are truncated in the middle of a line, and in the middle of a message.
    for (name, subject) in [("out/pose3d.jsonl", "out"), (&recording, &recording)] {
        let whole = fs::read(case.path(name)).unwrap();
        case.write(name, &whole[..whole.len() / 2 + 7]);
        let view = View::start(case, &[subject]);
        let hello = view.open().text("hello", |value| value["mode"] == "finished");
        assert!(
            hello["n"].as_u64().is_some_and(|number| number > 0),
            "{hello}"
        );
        view.end();
    }
    fs::create_dir(case.path("empty")).unwrap();
    for wrong in ["empty", "no/such/folder", "rig.toml", "model.plx"] {
        let ended = case.start(&["view", "--port", "0", wrong]).wait_among_others();
        let code = ended.status.code();
        assert!(
            code.is_some_and(|code| (1..=4).contains(&code)),
            "{wrong}: {code:?}"
        );
    }
}

#[test]
fn requests_from_other_sites_and_invalid_requests_are_refused_and_the_page_continues() {
    let case = Case::new("view-refuses", &[1; 2], "");
    let view = View::start(&case, &["--deployment", &case.name]);
    let here = view.address.clone();
    let (status, page) = view.get("/", &here, "");
    assert_eq!(status, 200);
    assert!(page.contains("default-src 'none'"), "{page}");
    for (path, host, more, expected) in [
        ("/", "evil.example", "", 403),
        ("/view.js", &here, "Origin: http://evil.example\r\n", 403),
        ("/../../etc/passwd", &here, "", 404),
        ("/%2e%2e/%2e%2e/etc/passwd", &here, "", 404),
        ("/stage.js", &here, "", 200),
        ("/ws", &here, "", 400),
    ] {
        assert_eq!(view.get(path, host, more).0, expected, "{path} {host}");
    }
    let (status, _) = view.get("/", &here, &format!("X: {}\r\n", "x".repeat(4 << 20)));
    assert!([0, 400, 431].contains(&status), "{status}");
    let mut pages: Vec<Page> = (0..20).map(|_| view.open()).collect();
    for page in &mut pages {
        page.text("hello", |value| value["mode"] == "waiting");
        page.ask(&json!({ "pictures": [0] }));
    }
    let mut wild = view.open();
    wild.ask(&json!({ "at": "never", "x": [] }));
    wild.text("refused", |_| true);
    let huge = "[".repeat(64 << 10);
    let _refused = wild.socket.send(Message::Text(huge.into()));
    let mut deep = view.open();
    for _ in 0..64 {
        let _refused = deep.socket.send(Message::Binary(vec![0; 99].into()));
    }
    view.open().text("hello", |value| value["mode"] == "waiting");
    // Without a token, only the loopback is allowed.
    let short = case.path("short");
    fs::write(&short, "short").unwrap();
    let ended = case
        .start(&[
            "view",
            "--listen",
            "0.0.0.0",
            "--token-file",
            short.to_str().unwrap(),
        ])
        .wait_among_others();
    assert_eq!(ended.status.code(), Some(2));
    view.end();
}
