//! Times and counts that another process sends.
#![no_main]

use messages::{Metrics, MetricsRow, Span};
use runtime::metrics::Reading;

/// Arbitrary bytes in shared memory, read as numbers. After the end, all numbers are zero.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (now, rest) = self.0.split_at(N.min(self.0.len()));
        self.0 = rest;
        let mut all = [0; N];
        all[..now.len()].copy_from_slice(now);
        all
    }

    fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn short(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn row(&mut self) -> MetricsRow {
        MetricsRow {
            span: Span(self.short()),
            view: self.short(),
            count: self.long(),
            millihertz: self.long(),
            p50_nanos: self.long(),
            p99_nanos: self.long(),
            p99_9_nanos: self.long(),
            max_nanos: self.long(),
        }
    }

    fn message(mut self) -> Metrics {
        let it = &mut self;
        Metrics {
            n_rows: it.short(),
            finished: it.short(),
            view: it.short(),
            queue: it.short(),
            longest_queue: it.short(),
            name: it.take(),
            rows: core::array::from_fn(|_| it.row()),
            session: it.long(),
            pid: it.short(),
            epoch: it.short(),
            began_at_nanos: it.long(),
            at_nanos: it.long(),
            n_received: it.long(),
            n_sent: it.long(),
            sent_millihertz: it.long(),
            n_dropped: core::array::from_fn(|_| it.long()),
            evidence_bytes: it.long(),
            memory_bytes: it.long(),
            peak_memory_bytes: it.long(),
            reserved: it.short(),
        }
    }
}

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    if let Ok(read) = Reading::from_message(&Bytes(input).message()) {
        assert_eq!(Reading::from_message(&read.to_message()), Ok(read));
    }
});
