//! The checked content of another process's metrics message.

use messages::{
    CameraCounts, Cause, MAX_NAME, MAX_ROWS, MAX_VIEWS, Metrics, MetricsRow, N_CAUSES, NO_PEOPLE,
    NO_QUEUE, NO_VIEW, Span,
};

/// Reason why a metrics message is malformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReadingError {
    /// There are more rows than a message can hold.
    #[error("{rows} rows, but a message has room for {MAX_ROWS}")]
    TooManyRows {
        /// Number of rows in the message.
        rows: u32,
    },
    /// A row has a stage that does not exist.
    #[error("row {row} has the unknown stage {span}")]
    UnknownSpan {
        /// Index of the row.
        row: usize,
        /// Number of the unknown stage.
        span: u32,
    },
    /// The index of a view is too large.
    #[error("the index of the view is {view}, but there are at most {MAX_VIEWS} views")]
    UnknownView {
        /// Index of the view.
        view: u32,
    },
    /// Percentiles are not ascending.
    #[error("row {row} has percentiles that decrease, or none for {count} durations")]
    Disordered {
        /// Index of the row.
        row: usize,
        /// Number of durations in the message.
        count: u64,
    },
    /// Two rows have the same stage and view.
    #[error("rows {first} and {second} have the same stage and view")]
    Twice {
        /// Index of the first row.
        first: usize,
        /// Index of the second row.
        second: usize,
    },
    /// The name of the view is not UTF-8.
    #[error("the name of the view is not UTF-8, or has text after its end")]
    Name,
    /// A flag is neither 0 nor 1.
    #[error("finished is {finished}, expected 0 or 1")]
    Flag {
        /// Value of the flag.
        finished: u32,
    },
    /// Counts or times contradict each other.
    #[error("counts contradict each other: {what}")]
    Contradiction {
        /// Description of the contradiction.
        what: &'static str,
    },
}

/// The metrics of another process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reading {
    /// Session of the run.
    pub session: u64,
    /// Process id.
    pub pid: u32,
    /// Number of restarts of the process.
    pub restarts: u32,
    /// Time at which the process started, `CLOCK_MONOTONIC`, in nanoseconds.
    pub began_at_nanos: u64,
    /// Time at which the message was sent, `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    /// Number of messages received.
    pub n_received: u64,
    /// Number of messages sent.
    pub n_sent: u64,
    /// Recent rate of messages sent per second, in thousandths.
    pub sent_millihertz: u64,
    /// Number of messages or frames lost, in the order of [`Cause::ALL`].
    pub n_dropped: [u64; N_CAUSES],
    /// Size of the evidence sent, in bytes.
    pub evidence_bytes: u64,
    /// Physical memory, in bytes; 0 if the system does not report it.
    pub memory_bytes: u64,
    /// Peak physical memory, in bytes.
    pub peak_memory_bytes: u64,
    /// Current and maximum length of the queue of frames or results, if there is a queue.
    pub queue: Option<[u32; 2]>,
    /// Number of people in the last result, if the process counts people.
    pub n_people: Option<u32>,
    /// View that the process works for, if there is one.
    pub view: Option<ViewName>,
    /// True if the process has received the end of stream and sent it on.
    pub is_finished: bool,
    /// Counts of the pictures of the process's live camera, if it has one.
    pub camera: Option<CameraCounts>,
    /// Statistics of the durations, by stage and view.
    pub times: Vec<Timed>,
}

/// The view that a process works for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewName {
    /// Index of the view.
    pub index: usize,
    /// Name of the view's camera; empty if unknown.
    pub name: String,
}

/// Statistics of the durations of one stage, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timed {
    /// Stage that was measured.
    pub span: Span,
    /// View that the durations belong to, if there is one.
    pub view: Option<usize>,
    /// Number of measured durations.
    pub count: u64,
    /// Recent rate of measurements, in thousandths of a hertz.
    pub millihertz: u64,
    /// Median duration.
    pub p50_nanos: u64,
    /// 99th percentile of the durations.
    pub p99_nanos: u64,
    /// 99.9th percentile of the durations.
    pub p99_9_nanos: u64,
    /// Longest duration.
    pub max_nanos: u64,
}

impl Reading {
    /// Reads a message. Rows beyond the stated number are ignored.
    ///
    /// # Errors
    ///
    /// Returns a [`ReadingError`] on failure.
    pub fn from_message(message: &Metrics) -> Result<Self, ReadingError> {
        let rows = message.rows.get(..message.n_rows as usize);
        let rows = rows.ok_or(ReadingError::TooManyRows {
            rows: message.n_rows,
        })?;
        let mut times: Vec<Timed> = Vec::with_capacity(rows.len());
        for (second, row) in rows.iter().enumerate() {
            let timed = timed(second, row)?;
            let same = |other: &Timed| other.span == timed.span && other.view == timed.view;
            if let Some(first) = times.iter().position(same) {
                return Err(ReadingError::Twice { first, second });
            }
            times.push(timed);
        }
        if message.finished > 1 {
            return Err(ReadingError::Flag {
                finished: message.finished,
            });
        }
        if message.at_nanos < message.began_at_nanos {
            let what = "it was sent before the process began";
            return Err(ReadingError::Contradiction { what });
        }
        let view = view_of(message.view)?;
        let name = name_of(&message.name)?;
        Ok(Self {
            session: message.session,
            pid: message.pid,
            restarts: message.epoch,
            began_at_nanos: message.began_at_nanos,
            at_nanos: message.at_nanos,
            n_received: message.n_received,
            n_sent: message.n_sent,
            sent_millihertz: message.sent_millihertz,
            n_dropped: message.n_dropped,
            evidence_bytes: message.evidence_bytes,
            memory_bytes: message.memory_bytes,
            peak_memory_bytes: message.peak_memory_bytes,
            queue: queue_of(message)?,
            n_people: Some(message.n_people).filter(|n| *n != NO_PEOPLE),
            view: view.map(|index| ViewName { index, name }),
            is_finished: message.finished == 1,
            camera: Some(message.camera).filter(|camera| camera.n_connections > 0),
            times,
        })
    }

    /// Writes a message, without rows beyond [`MAX_ROWS`] and bytes of a name beyond [`MAX_NAME`].
    pub fn to_message(&self) -> Metrics {
        let mut rows = [MetricsRow::default(); MAX_ROWS];
        for (row, it) in rows.iter_mut().zip(&self.times) {
            *row = MetricsRow {
                span: it.span,
                view: it.view.map_or(NO_VIEW, |view| view as u32),
                count: it.count,
                millihertz: it.millihertz,
                p50_nanos: it.p50_nanos,
                p99_nanos: it.p99_nanos,
                p99_9_nanos: it.p99_9_nanos,
                max_nanos: it.max_nanos,
            };
        }
        let mut name = [0; MAX_NAME];
        let text = self.view.as_ref().map_or("", |view| &view.name);
        for (byte, character) in name.iter_mut().zip(text.bytes()) {
            *byte = character;
        }
        let [queue, longest_queue] = self.queue.unwrap_or([NO_QUEUE; 2]);
        Metrics {
            session: self.session,
            pid: self.pid,
            epoch: self.restarts,
            began_at_nanos: self.began_at_nanos,
            at_nanos: self.at_nanos,
            n_received: self.n_received,
            n_sent: self.n_sent,
            sent_millihertz: self.sent_millihertz,
            n_dropped: self.n_dropped,
            evidence_bytes: self.evidence_bytes,
            memory_bytes: self.memory_bytes,
            peak_memory_bytes: self.peak_memory_bytes,
            queue,
            longest_queue,
            view: self.view.as_ref().map_or(NO_VIEW, |view| view.index as u32),
            finished: u32::from(self.is_finished),
            name,
            n_rows: self.times.len().min(MAX_ROWS) as u32,
            n_people: self.n_people.unwrap_or(NO_PEOPLE),
            camera: self.camera.unwrap_or_default(),
            rows,
        }
    }

    /// Returns the number of losses of one cause.
    pub fn n_dropped_by(&self, cause: Cause) -> u64 {
        self.n_dropped[cause as usize]
    }
}

fn timed(row: usize, row_message: &MetricsRow) -> Result<Timed, ReadingError> {
    if !Span::ALL.contains(&row_message.span) {
        let span = row_message.span.0;
        return Err(ReadingError::UnknownSpan { row, span });
    }
    let rising = [
        row_message.p50_nanos,
        row_message.p99_nanos,
        row_message.p99_9_nanos,
        row_message.max_nanos,
    ];
    if !rising.is_sorted() || (row_message.count == 0) != (row_message.max_nanos == 0) {
        let count = row_message.count;
        return Err(ReadingError::Disordered { row, count });
    }
    Ok(Timed {
        span: row_message.span,
        view: view_of(row_message.view)?,
        count: row_message.count,
        millihertz: row_message.millihertz,
        p50_nanos: row_message.p50_nanos,
        p99_nanos: row_message.p99_nanos,
        p99_9_nanos: row_message.p99_9_nanos,
        max_nanos: row_message.max_nanos,
    })
}

fn view_of(view: u32) -> Result<Option<usize>, ReadingError> {
    match view {
        NO_VIEW => Ok(None),
        view if (view as usize) < MAX_VIEWS => Ok(Some(view as usize)),
        view => Err(ReadingError::UnknownView { view }),
    }
}

fn queue_of(message: &Metrics) -> Result<Option<[u32; 2]>, ReadingError> {
    match [message.queue, message.longest_queue] {
        [NO_QUEUE, NO_QUEUE] => Ok(None),
        both @ [now, longest] if now <= longest && longest != NO_QUEUE => Ok(Some(both)),
        _ => Err(ReadingError::Contradiction {
            what: "the queue is longer than its stated maximum",
        }),
    }
}

fn name_of(bytes: &[u8; MAX_NAME]) -> Result<String, ReadingError> {
    let len = bytes.iter().position(|byte| *byte == 0).unwrap_or(MAX_NAME);
    let (name, rest) = bytes.split_at(len);
    let name = core::str::from_utf8(name).ok().filter(|_| rest.iter().all(|byte| *byte == 0));
    name.map(str::to_owned).ok_or(ReadingError::Name)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_times() -> impl Strategy<Value = Vec<Timed>> {
        let view = proptest::option::of(0..MAX_VIEWS);
        let keys = proptest::collection::btree_set((0..Span::ALL.len(), view), 0..=MAX_ROWS);
        keys.prop_flat_map(|keys| {
            let n = keys.len();
            let nanos = proptest::collection::vec(any::<[u64; 4]>(), n);
            (Just(keys), nanos, proptest::collection::vec(1_u64.., n))
        })
        .prop_map(|(keys, nanos, counts)| {
            let rows = keys.into_iter().zip(nanos).zip(counts);
            let row = |(((span, view), mut nanos), count): (((usize, _), [u64; 4]), u64)| {
                nanos.sort_unstable();
                Timed {
                    span: Span::ALL[span],
                    view,
                    count,
                    millihertz: count / 3,
                    p50_nanos: nanos[0],
                    p99_nanos: nanos[1],
                    p99_9_nanos: nanos[2],
                    max_nanos: nanos[3].max(1),
                }
            };
            rows.map(row).collect()
        })
    }

    fn any_view() -> impl Strategy<Value = Option<ViewName>> {
        let view = (0..MAX_VIEWS, "[a-z\u{e4}]{0,16}");
        proptest::option::of(view.prop_map(|(index, name)| ViewName { index, name }))
    }

    prop_compose! {
        fn any_reading()(
            counts in any::<[u64; 12]>(),
            ids in any::<[u32; 2]>(),
            queue in proptest::option::of((0_u32..1000, 0_u32..1000)),
            n_people in proptest::option::of(0_u32..1000),
            view in any_view(),
            is_finished in any::<bool>(),
            times in any_times(),
        ) -> Reading {
            Reading {
                session: counts[0],
                pid: ids[0],
                restarts: ids[1],
                began_at_nanos: counts[1].min(counts[2]),
                at_nanos: counts[1].max(counts[2]),
                n_received: counts[3],
                n_sent: counts[4],
                sent_millihertz: counts[5],
                n_dropped: core::array::from_fn(|i| counts[6].rotate_left(i as u32)),
                evidence_bytes: counts[7],
                memory_bytes: counts[8],
                peak_memory_bytes: counts[9],
                queue: queue.map(|(now, more)| [now, now + more]),
                n_people,
                view,
                is_finished,
                camera: (counts[10] > 0).then(|| CameraCounts {
                    n_connections: counts[10],
                    off_grid_nanos: counts[11].cast_signed(),
                    ..CameraCounts::default()
                }),
                times,
            }
        }
    }

    proptest! {
        #[test]
        fn a_reading_survives_a_round_trip(it in any_reading()) {
            prop_assert_eq!(Reading::from_message(&it.to_message()), Ok(it));
        }

        /// Any message is either read or rejected; a message that was read can be written again.
        #[test]
        fn any_message_is_refused_or_survives_a_round_trip(
            it in any_reading(), n_rows in any::<u32>(), name in any::<[u8; MAX_NAME]>(),
            words in any::<[u32; 6]>(), row in 0..MAX_ROWS,
        ) {
            let mut message = it.to_message();
            let changed = words[5];
            if changed & 1 != 0 { message.n_rows = n_rows; }
            if changed & 2 != 0 { message.name = name; }
            if changed & 4 != 0 { message.view = words[0]; }
            if changed & 8 != 0 { message.rows[row].span = Span(words[1]); }
            if changed & 16 != 0 { message.rows[row].view = words[2]; }
            if changed & 32 != 0 { message.rows[row].p99_nanos = u64::from(words[3]); }
            if changed & 64 != 0 { message.queue = words[4]; }
            if let Ok(read) = Reading::from_message(&message) {
                prop_assert_eq!(Reading::from_message(&read.to_message()), Ok(read));
            }
        }
    }

    fn message() -> Metrics {
        let row = |view| MetricsRow {
            span: Span::WAITING,
            view,
            count: 3,
            millihertz: 1,
            p50_nanos: 1,
            p99_nanos: 2,
            p99_9_nanos: 2,
            max_nanos: 3,
        };
        let mut it = Metrics {
            n_rows: 2,
            ..Metrics::default()
        };
        (it.rows[0], it.rows[1]) = (row(0), row(NO_VIEW));
        it
    }

    /// Returns the error for a changed message.
    fn refused(change: impl FnOnce(&mut Metrics)) -> ReadingError {
        let mut it = message();
        change(&mut it);
        Reading::from_message(&it).unwrap_err()
    }

    #[test]
    fn an_unchanged_message_is_read() {
        assert_eq!(Reading::from_message(&message()).unwrap().times.len(), 2);
    }

    #[test]
    fn refuses_too_many_rows() {
        let rows = MAX_ROWS as u32 + 1;
        let error = refused(|message| message.n_rows = rows);
        assert_eq!(error, ReadingError::TooManyRows { rows });
        assert_eq!(error.to_string(), "25 rows, but a message has room for 24");
    }

    #[test]
    fn refuses_an_unknown_stage() {
        let error = refused(|message| message.rows[1].span = Span(5));
        assert_eq!(error, ReadingError::UnknownSpan { row: 1, span: 5 });
    }

    #[test]
    fn refuses_an_invalid_view() {
        let expected = ReadingError::UnknownView { view: 16 };
        assert_eq!(refused(|message| message.rows[0].view = 16), expected);
        assert_eq!(refused(|message| message.view = 16), expected);
    }

    #[test]
    fn refuses_descending_percentiles_and_percentiles_without_durations() {
        let expected = |count| ReadingError::Disordered { row: 0, count };
        assert_eq!(
            refused(|message| message.rows[0].p50_nanos = 3),
            expected(3)
        );
        assert_eq!(
            refused(|message| message.rows[0].max_nanos = 1),
            expected(3)
        );
        assert_eq!(refused(|message| message.rows[0].count = 0), expected(0));
    }

    #[test]
    fn refuses_two_rows_of_the_same_stage_and_view() {
        let error = refused(|message| message.rows[1].view = 0);
        let expected = ReadingError::Twice {
            first: 0,
            second: 1,
        };
        assert_eq!(error, expected);
    }

    #[test]
    fn refuses_a_name_that_is_not_utf8_or_continues_after_its_end() {
        assert_eq!(
            refused(|message| message.name[0] = 0xff),
            ReadingError::Name
        );
        assert_eq!(
            refused(|message| message.name[5] = b'x'),
            ReadingError::Name
        );
    }

    #[test]
    fn refuses_counts_that_contradict_each_other() {
        let is_contradiction = |error| matches!(error, ReadingError::Contradiction { .. });
        assert!(is_contradiction(refused(|message| message.queue = 3)));
        assert!(is_contradiction(refused(|message| (
            message.queue,
            message.longest_queue
        ) = (3, 2))));
        assert!(is_contradiction(refused(
            |message| message.began_at_nanos = 1
        )));
        let error = refused(|message| message.finished = 2);
        assert_eq!(error, ReadingError::Flag { finished: 2 });
    }
}
