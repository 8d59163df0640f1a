//! Recordings of runs: every message in a file can be read, or is refused.
#![no_main]

use std::io::Cursor;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let mut file = Cursor::new(input);
    let Ok(recording) = recording::scan(&mut file) else {
        return;
    };
    let extent = &recording.extent;
    assert!(extent.whole_bytes <= extent.file_bytes);
    assert!(recording.n_messages() * 22 <= extent.file_bytes);
    let mut buffer = recording::Buffer::default();
    for track in recording.tracks.values() {
        for entry in &track.entries {
            if let Ok(message) = recording::read(&mut file, track.kind, entry, &mut buffer) {
                assert_eq!(message.head.len(), track.kind.head_bytes());
                let mut head = message.head.to_vec();
                if let Some(envelope) = recording::Envelope::of(track.kind, &head) {
                    envelope.put(track.kind, &mut head);
                    assert_eq!(head, message.head);
                }
            }
        }
    }
});
