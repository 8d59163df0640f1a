//! A person of a frame as bundles of Open Sound Control 1.0.

use crate::publish::MOST_BYTES;
use crate::publish::frame::Frame;

/// Time tag that means "immediately".
const AT_ONCE: u64 = 1;

/// Returns bundles about a person of a frame. Each is at most [`MOST_BYTES`] long and begins with `/parallax/frame`.
///
/// | address | arguments | |
/// |---|---|---|
/// | `/parallax/frame` | `s h h i i i s s i` | deployment, session, frame, person, people, seen, status, sides, missed |
/// | `/parallax/joint/right_wrist` | `f f f f` | x, y, z, standard deviation, metres |
/// | `/parallax/absent` | `s s` | joint, and the reason why it has no position |
///
/// A joint without a position is never sent as zeros.
pub fn osc_datagrams(frame: &Frame<'_>) -> Vec<Vec<u8>> {
    let head = head(frame);
    let mut datagrams = Vec::new();
    let mut bundle = begin(&head);
    for (name, found) in &frame.joints {
        let message = match found {
            Ok(place) => {
                let [x, y, z] = place.in_world;
                let mut message =
                    Message::new(&format!("/parallax/joint/{}", plain(name)), ",ffff");
                for number in [x, y, z, place.deviation_m] {
                    message.0.extend((number as f32).to_be_bytes());
                }
                message
            }
            Err(why) => {
                let mut message = Message::new("/parallax/absent", ",ss");
                message.text(name);
                message.text(why);
                message
            }
        };
        if bundle.len() + 4 + message.0.len() > MOST_BYTES {
            datagrams.push(core::mem::replace(&mut bundle, begin(&head)));
        }
        push(&mut bundle, &message);
    }
    datagrams.push(bundle);
    datagrams
}

struct Message(Vec<u8>);

impl Message {
    fn new(address: &str, types: &str) -> Self {
        let mut message = Self(Vec::new());
        message.text(address);
        message.text(types);
        message
    }

    /// Writes a count, limited to the largest value of the format.
    fn count(&mut self, n: u64) {
        let n = i32::try_from(n).unwrap_or(i32::MAX);
        self.0.extend(n.to_be_bytes());
    }

    /// Writes a text, padded with zeros to a multiple of four bytes.
    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().filter(|byte| *byte != 0));
        self.0.push(0);
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }
}

fn head(frame: &Frame<'_>) -> Message {
    let mut message = Message::new("/parallax/frame", ",shhiiissi");
    message.text(frame.deployment);
    message.0.extend(frame.session.to_be_bytes());
    message.0.extend(frame.frame.to_be_bytes());
    message.count(frame.person);
    message.count(u64::from(frame.n_people));
    message.count(u64::from(frame.n_seen));
    message.text(frame.status);
    message.text(frame.sides);
    message.count(frame.n_missed);
    message
}

fn begin(head: &Message) -> Vec<u8> {
    let mut bundle = b"#bundle\0".to_vec();
    bundle.extend(AT_ONCE.to_be_bytes());
    push(&mut bundle, head);
    bundle
}

fn push(bundle: &mut Vec<u8>, message: &Message) {
    bundle.extend((message.0.len() as u32).to_be_bytes());
    bundle.extend(&message.0);
}

/// Returns a name as part of an address. Underscores replace characters with a meaning in addresses and characters that are not ASCII.
fn plain(name: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
    name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::json::tests::frame;

    /// Returns the address and the argument bytes of each message of a bundle, parsed according to the specification.
    fn messages(bundle: &[u8]) -> Vec<(String, Vec<u8>)> {
        assert_eq!(&bundle[..8], b"#bundle\0");
        let mut rest = &bundle[16..];
        let mut found = Vec::new();
        while !rest.is_empty() {
            let size = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize;
            assert_eq!(size % 4, 0);
            let message = &rest[4..4 + size];
            let end = message.iter().position(|byte| *byte == 0).unwrap();
            let address = String::from_utf8(message[..end].to_vec()).unwrap();
            let types = &message[(end + 1).next_multiple_of(4)..];
            let end = types.iter().position(|kind| *kind == 0).unwrap();
            assert_eq!(types[0], b',');
            found.push((address, types[(end + 1).next_multiple_of(4)..].to_vec()));
            rest = &rest[4 + size..];
        }
        found
    }

    #[test]
    fn a_joint_is_sent_as_four_numbers_and_a_missing_joint_as_none() {
        let datagrams = osc_datagrams(&frame(&["head", "right wrist", "neck"]));
        assert_eq!(datagrams.len(), 1);
        let messages = messages(&datagrams[0]);
        let addresses: Vec<&str> = messages.iter().map(|message| message.0.as_str()).collect();
        let expected = [
            "/parallax/frame",
            "/parallax/joint/head",
            "/parallax/joint/right_wrist",
            "/parallax/absent",
        ];
        assert_eq!(addresses, expected);
        assert_eq!(messages[1].1.len(), 16);
        assert_eq!(messages[1].1[4..8], 0.5_f32.to_be_bytes());
        assert!(messages[3].1.starts_with(b"neck\0"));
    }

    #[test]
    fn joints_that_do_not_fit_are_sent_in_another_bundle_with_the_same_header() {
        let many: Vec<String> = (0..128).map(|i| format!("joint/{i}")).collect();
        let names: Vec<&str> = many.iter().map(String::as_str).collect();
        let datagrams = osc_datagrams(&frame(&names));
        assert!(datagrams.len() > 1);
        let mut n = 0;
        for it in &datagrams {
            assert!(it.len() <= MOST_BYTES && it.len() % 4 == 0);
            let messages = messages(it);
            assert_eq!(messages[0].0, "/parallax/frame");
            n += messages.len() - 1;
        }
        assert_eq!(n, 128);
    }
}
