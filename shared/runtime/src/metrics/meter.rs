//! Collects durations and counts of one process.

use hdrhistogram::Histogram;
use messages::{
    CameraCounts, Cause, MAX_NAME, MAX_ROWS, Metrics, MetricsRow, N_CAUSES, NO_PEOPLE, NO_QUEUE,
    NO_VIEW, Span,
};

/// Longest measurable duration, in nanoseconds: an hour.
const LONGEST_NANOS: u64 = 3_600_000_000_000;

/// The times of one frame in a process, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Passage {
    /// Time from the sending of the frame's message to the start of the work, if there was a message.
    pub waiting: Option<u64>,
    /// Time spent on computing.
    pub computing: u64,
    /// Time to loan memory for the result and send it.
    pub publishing: u64,
    /// Time from capture to result, if known.
    pub since_capture: Option<u64>,
}

/// Collects durations and counts of one process.
///
/// The first duration of a stage and view creates a histogram. After that, nothing is allocated.
/// Durations that need more than [`MAX_ROWS`] rows are ignored.
#[derive(Debug)]
pub struct Meter {
    rows: Vec<Row>,
    n_dropped: [u64; N_CAUSES],
    evidence_bytes: u64,
    queue: Option<[u32; 2]>,
    n_people: u32,
    view: u32,
    name: [u8; MAX_NAME],
    camera: CameraCounts,
}

#[derive(Debug)]
struct Row {
    span: Span,
    view: u32,
    histogram: Histogram<u32>,
}

impl Default for Meter {
    fn default() -> Self {
        Self {
            rows: Vec::with_capacity(MAX_ROWS),
            n_dropped: [0; N_CAUSES],
            evidence_bytes: 0,
            queue: None,
            n_people: NO_PEOPLE,
            view: NO_VIEW,
            name: [0; MAX_NAME],
            camera: CameraCounts::default(),
        }
    }
}

impl Meter {
    /// Sets the view that the process works for.
    ///
    /// * `name`: name of the camera, truncated if it does not fit into a message.
    pub fn belongs_to(&mut self, view: usize, name: &str) {
        self.view = number_of(Some(view));
        self.name = cut(name);
    }

    /// Records a duration.
    ///
    /// * `view`: view that the duration belongs to, if there is one.
    pub fn spent(&mut self, span: Span, view: Option<usize>, nanos: u64) {
        let view = number_of(view);
        let existing = self.rows.iter().position(|row| row.span == span && row.view == view);
        let index = existing.unwrap_or(self.rows.len());
        if index == self.rows.len() {
            if index == MAX_ROWS {
                return;
            }
            self.rows.push(Row {
                span,
                view,
                histogram: histogram(),
            });
        }
        let nanos = nanos.clamp(1, LONGEST_NANOS);
        self.rows[index].histogram.saturating_record(nanos);
    }

    /// Records the times of a frame.
    pub fn passed(&mut self, passage: &Passage) {
        if let Some(nanos) = passage.waiting {
            self.spent(Span::WAITING, None, nanos);
        }
        self.spent(Span::COMPUTING, None, passage.computing);
        self.spent(Span::PUBLISHING, None, passage.publishing);
        if let Some(nanos) = passage.since_capture {
            self.spent(Span::SINCE_CAPTURE, None, nanos);
        }
    }

    /// Counts losses.
    pub fn dropped(&mut self, cause: Cause, n: u64) {
        self.n_dropped[cause as usize] += n;
    }

    /// Returns the number of losses of all causes together.
    pub fn n_dropped(&self) -> u64 {
        self.n_dropped.iter().sum()
    }

    /// Records the number of frames or results that wait in the process.
    pub fn queued(&mut self, n: usize) {
        let n = u32::try_from(n).unwrap_or(NO_QUEUE - 1).min(NO_QUEUE - 1);
        let longest = self.queue.map_or(0, |[_, longest]| longest);
        self.queue = Some([n, longest.max(n)]);
    }

    /// Records the number of people in a result.
    pub fn counted_people(&mut self, n: u32) {
        self.n_people = n;
    }

    /// Records the counts of the pictures of a live camera.
    pub fn camera(&mut self, counts: CameraCounts) {
        self.camera = counts;
    }

    /// Counts bytes of evidence that was sent.
    pub fn sent_evidence(&mut self, bytes: u64) {
        self.evidence_bytes += bytes;
    }

    /// Returns the number of rows.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Returns a row of the message, without its rate; `None` beyond [`Self::n_rows`].
    pub fn row(&self, index: usize) -> Option<MetricsRow> {
        let Row {
            span,
            view,
            histogram,
        } = self.rows.get(index)?;
        // The histogram returns the upper end of a bucket, which may exceed the longest duration.
        let at = |quantile| histogram.value_at_quantile(quantile).min(histogram.max());
        Some(MetricsRow {
            span: *span,
            view: *view,
            count: histogram.len(),
            millihertz: 0,
            p50_nanos: at(0.5),
            p99_nanos: at(0.99),
            p99_9_nanos: at(0.999),
            max_nanos: histogram.max(),
        })
    }

    /// Returns the message without the rows and the process's own fields.
    pub fn head(&self) -> Metrics {
        let [queue, longest_queue] = self.queue.unwrap_or([NO_QUEUE; 2]);
        Metrics {
            n_dropped: self.n_dropped,
            evidence_bytes: self.evidence_bytes,
            queue,
            longest_queue,
            n_people: self.n_people,
            view: self.view,
            name: self.name,
            camera: self.camera,
            ..Metrics::default()
        }
    }
}

fn number_of(view: Option<usize>) -> u32 {
    view.and_then(|view| u32::try_from(view).ok()).unwrap_or(NO_VIEW)
}

/// Truncates a name to the available length, without splitting a character.
fn cut(name: &str) -> [u8; MAX_NAME] {
    let mut bytes = [0; MAX_NAME];
    let len = name.floor_char_boundary(MAX_NAME);
    bytes[..len].copy_from_slice(&name.as_bytes()[..len]);
    bytes
}

#[expect(clippy::expect_used, reason = "the arguments are constants")]
fn histogram() -> Histogram<u32> {
    Histogram::new_with_bounds(1, LONGEST_NANOS, 2).expect("1 <= 2 * low <= high, 2 digits")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The histogram has two significant digits: its buckets are at most a hundredth wide.
        #[test]
        fn percentiles_are_exact_to_a_hundredth(
            mut nanos in proptest::collection::vec(1_u64..10_000_000_000, 1..300)
        ) {
            let mut meter = Meter::default();
            for &duration in &nanos {
                meter.spent(Span::COMPUTING, None, duration);
            }
            let row = meter.row(0).unwrap();
            nanos.sort_unstable();
            let n = nanos.len();
            prop_assert_eq!(row.count, n as u64);
            for (share, got) in [(0.5, row.p50_nanos), (0.99, row.p99_nanos), (0.999, row.p99_9_nanos)] {
                let rank = ((share * n as f64).ceil() as usize).clamp(1, n);
                let true_one = nanos[rank - 1] as f64;
                prop_assert!((got as f64 - true_one).abs() <= 0.011 * true_one, "{} {}", got, true_one);
            }
            let longest = nanos[n - 1] as f64;
            prop_assert!((row.max_nanos as f64 - longest).abs() <= 0.011 * longest);
        }
    }

    #[test]
    fn stages_and_views_are_kept_apart() {
        let mut meter = Meter::default();
        meter.spent(Span::WAITING, Some(1), 1000);
        meter.spent(Span::WAITING, Some(0), 2000);
        meter.spent(Span::COMPUTING, None, 3000);
        meter.spent(Span::WAITING, Some(1), 1000);
        let rows: Vec<_> = (0..meter.n_rows()).filter_map(|index| meter.row(index)).collect();
        let counts: Vec<_> = rows.iter().map(|row| (row.span, row.view, row.count)).collect();
        let expected = [
            (Span::WAITING, 1, 2),
            (Span::WAITING, 0, 1),
            (Span::COMPUTING, NO_VIEW, 1),
        ];
        assert_eq!(counts, expected);
    }

    #[test]
    fn durations_without_a_free_row_are_ignored() {
        let mut meter = Meter::default();
        for view in 0..2 * MAX_ROWS {
            meter.spent(Span::WAITING, Some(view), 1);
        }
        assert_eq!(meter.n_rows(), MAX_ROWS);
        assert_eq!(meter.row(MAX_ROWS), None);
    }

    #[test]
    fn durations_are_clamped_to_a_nanosecond_and_an_hour() {
        let mut meter = Meter::default();
        meter.spent(Span::COMPUTING, None, u64::MAX);
        meter.spent(Span::PUBLISHING, None, 0);
        let hour = meter.row(0).unwrap().max_nanos as f64;
        assert!((hour / LONGEST_NANOS as f64 - 1.0).abs() < 0.01, "{hour}");
        assert_eq!(meter.row(1).unwrap().max_nanos, 1);
    }

    #[test]
    fn losses_are_counted_by_cause_and_the_longest_queue_is_kept() {
        let mut meter = Meter::default();
        meter.dropped(Cause::Late, 2);
        meter.dropped(Cause::Malformed, 1);
        meter.dropped(Cause::Late, 3);
        meter.queued(7);
        meter.queued(2);
        let head = meter.head();
        assert_eq!(head.n_dropped, [0, 0, 5, 0, 1]);
        assert_eq!(meter.n_dropped(), 6);
        assert_eq!([head.queue, head.longest_queue], [2, 7]);
    }

    #[test]
    fn a_long_name_is_cut_between_characters() {
        let mut meter = Meter::default();
        meter.belongs_to(3, &"\u{e4}".repeat(17));
        let head = meter.head();
        assert_eq!(head.view, 3);
        assert_eq!(
            core::str::from_utf8(&head.name).unwrap(),
            "\u{e4}".repeat(16)
        );
        meter.belongs_to(3, &format!("x{}", "\u{e4}".repeat(16)));
        assert_eq!(meter.head().name[31], 0, "no part of a character is kept");
    }
}
