//! Removes user names and passwords from the addresses of cameras, so that they never appear in messages and files.

/// Text that replaces a password.
const HIDDEN: &str = "***";
/// Keys of an address whose values are secret.
const SECRET_KEYS: [&str; 14] = [
    "user",
    "usr",
    "username",
    "login",
    "pass",
    "passwd",
    "password",
    "pwd",
    "token",
    "key",
    "auth",
    "secret",
    "passphrase",
    "loginpas",
];

/// Removes secrets from the addresses in a text: user names and passwords before the host, and the values of keys such as `password` after
/// the path.
///
/// ```
/// let text = footage::without_passwords("no picture from rtsp://me:secret@10.0.0.5/a?pwd=1&x=2");
/// assert_eq!(text, "no picture from rtsp://10.0.0.5/a?pwd=***&x=2");
/// ```
pub fn without_passwords(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("://") {
        let (before, after) = rest.split_at(at + 3);
        out.push_str(before);
        let end = after.find(is_end).unwrap_or(after.len());
        let (address, following) = after.split_at(end);
        push_address(&mut out, address);
        rest = following;
    }
    out.push_str(rest);
    out
}

/// Returns true if an address in a text ends before this character.
fn is_end(it: char) -> bool {
    it.is_whitespace() || it == '"'
}

/// Returns the position at which the host of an address ends, with its port.
///
/// * `address`: the address without its scheme.
fn end_of_host(address: &str) -> usize {
    let separators = ['/', '?', '#'];
    let end = address.find(separators).unwrap_or(address.len());
    let host = &address[..end];
    // Text after a colon that is not a port is part of a password with separators.
    let is_password = !host.contains(['@', ']'])
        && host.split_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_err());
    match address.rfind('@').filter(|_| is_password) {
        Some(at) => address[at..].find(separators).map_or(address.len(), |after| at + after),
        None => end,
    }
}

/// Appends an address without its secrets.
///
/// * `address`: the address without its scheme.
fn push_address(out: &mut String, address: &str) {
    let (host, path) = address.split_at(end_of_host(address));
    out.push_str(host.rsplit_once('@').map_or(host, |parts| parts.1));
    let Some((path, query)) = path.split_once('?') else {
        out.push_str(path);
        return;
    };
    out.push_str(path);
    for (nth, pair) in query.split('&').enumerate() {
        out.push(if nth == 0 { '?' } else { '&' });
        match pair.split_once('=') {
            Some((key, _)) if SECRET_KEYS.contains(&&*key.to_ascii_lowercase()) => {
                out.extend([key, "=", HIDDEN]);
            }
            _ => out.push_str(pair),
        }
    }
}

/// Minimum length of a secret that is searched for, in characters; a shorter text may occur by chance.
const SHORTEST: usize = 3;

/// Removes the password of one address from a message, even if the message repeats only the password.
pub(crate) fn without_password_of(address: &str, message: &str) -> String {
    let shown = without_passwords(address);
    let mut message = without_passwords(&message.replace(address, &shown));
    let host = address.split_once("://").map_or("", |parts| parts.1);
    let host = &host[..end_of_host(host)];
    let before = host.rsplit_once('@').map_or("", |parts| parts.0);
    let password = before.split_once(':').map_or("", |parts| parts.1);
    for secret in [before, password] {
        if secret.len() >= SHORTEST {
            message = message.replace(secret, HIDDEN);
        }
    }
    message
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn passwords_are_not_shown() {
        for (text, expected) in [
            ("rtsp://10.0.0.5/a@b", "rtsp://10.0.0.5/a@b"),
            ("udp://@:5000", "udp://:5000"),
            ("rtsp://me:secret@10.0.0.5:554/a", "rtsp://10.0.0.5:554/a"),
            ("rtsp://me:s@cret@10.0.0.5", "rtsp://10.0.0.5"),
            ("rtsp://me:se/c?r#et@10.0.0.5/a", "rtsp://10.0.0.5/a"),
            ("rtsp://10.0.0.5:554/a@b", "rtsp://10.0.0.5:554/a@b"),
            (
                "http://c/v.cgi?user=me&PWD=888&res=1",
                "http://c/v.cgi?user=***&PWD=***&res=1",
            ),
            (
                r#"{"source":"rtsp://me:it's@a/b","other":"x@y"}"#,
                r#"{"source":"rtsp://a/b","other":"x@y"}"#,
            ),
            ("a.mp4 and /dev/video0", "a.mp4 and /dev/video0"),
            (
                "rtsp://a:1@b/c, then http://d:2@e",
                "rtsp://b/c, then http://e",
            ),
            ("://", "://"),
        ] {
            assert_eq!(without_passwords(text), expected);
        }
    }

    #[test]
    fn a_repeated_password_without_address_is_hidden_too() {
        let hidden = |message: &str| without_password_of("rtsp://me:secret@10.0.0.5/a", message);
        assert_eq!(hidden("auth me:secret failed"), "auth *** failed");
        assert_eq!(
            hidden("rtsp://me:secret@10.0.0.5/a: no"),
            "rtsp://10.0.0.5/a: no"
        );
        assert_eq!(hidden("tcp://secret"), "tcp://***");
        let odd = without_password_of("rtsp://me:s/ret@10.0.0.5/a", "auth s/ret failed");
        assert_eq!(odd, "auth *** failed");
        assert_eq!(without_password_of("rtsp://a/b", "as it is"), "as it is");
    }

    proptest! {
        #[test]
        fn addresses_without_a_password_are_unchanged(text in "[a-z /.:@-]{0,40}") {
            prop_assume!(!text.contains("://"));
            prop_assert_eq!(without_passwords(&text), text);
        }
    }
}
