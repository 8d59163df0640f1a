//! Messages from another host: packets, maps, signals, introductions.

use bridge::hosts::{
    Answer, Clock, Content, Exchange, Expected, Head, Hello, Maps, Packet, Signal,
};
use messages::Status;

const EXPECTED: Expected<'static> = Expected {
    views: &[0, 3],
    sizes: &[[48, 32]; 4],
    max_body: 4096,
};

/// Arbitrary bytes from another host are either accepted completely or refused.
pub fn host_messages(input: &[u8]) {
    if let Ok(packet) = Packet::parse(input, &EXPECTED) {
        assert_eq!(packet.to_bytes(), input);
    }
    if let Ok(signal) = Signal::parse(input) {
        assert_eq!(signal.to_bytes()[..], *input);
    }
    if let Ok(hello) = Hello::parse(input) {
        assert_eq!(Hello::parse(&hello.to_bytes()).ok().as_ref(), Some(&hello));
        let welcome = bridge::hosts::Welcome {
            origin: 1,
            session: 2,
        };
        let answer = hello.answer(false, &hello.fingerprint, welcome);
        assert!(matches!(answer, Answer::Refused(_)));
    }
    if let Ok(answer) = Answer::parse(input) {
        assert_eq!(Answer::parse(&answer.to_bytes()).ok(), Some(answer));
    }
    if let Ok(maps) = Maps::parse(input) {
        assert_eq!(maps.to_bytes(), input);
    }
    let numbers = Numbers(input);
    packet_of(numbers, input);
    clock_of(numbers);
}

/// Arbitrary numbers in a packet with a correct hash: the packet is either refused, or read as it was sent.
fn packet_of(mut it: Numbers<'_>, body: &[u8]) {
    let contents = [Content::Frame, Content::Sightings, Content::ViewQuality];
    let head = Head {
        content: contents[(it.next() % 3) as usize],
        view: it.next() as u32,
        status: Status(it.next() as u32),
        origin: it.next(),
        sequence: it.next(),
        frame: it.next(),
        instant_nanos: it.next(),
        captured_at_nanos: it.next(),
        received_at_nanos: it.next(),
        sent_at_nanos: it.next(),
        packed_at_nanos: it.next(),
        skew_nanos: it.next().cast_signed(),
        n_dropped: it.next(),
        n_overtaken: it.next(),
        size: [it.next() as u32, it.next() as u32],
    };
    let sent = Packet { head, body }.to_bytes();
    if let Ok(got) = Packet::parse(&sent, &EXPECTED) {
        assert_eq!((got.head, got.body), (head, body));
        assert!(EXPECTED.views.contains(&(head.view as usize)));
    }
}

/// Estimates another host's clock from arbitrary times.
fn clock_of(mut it: Numbers<'_>) {
    let mut clock = Clock::default();
    for _ in 0..8 {
        let _taken = clock.add(Exchange {
            asked_at: it.next(),
            received_at: it.next(),
            answered_at: it.next(),
            heard_at: it.next(),
        });
    }
    let now = it.next();
    if let Some(got) = clock.estimate(now) {
        assert!(got.drift_ppb.is_finite());
        let _times = (got.ours(now), got.theirs(now));
    }
}

/// The numbers in the input. After the last one, all numbers are zero.
#[derive(Clone, Copy)]
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next(&mut self) -> u64 {
        let (now, rest) = self.0.split_at(8.min(self.0.len()));
        self.0 = rest;
        let mut bytes = [0; 8];
        bytes[..now.len()].copy_from_slice(now);
        u64::from_le_bytes(bytes)
    }
}
