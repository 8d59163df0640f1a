//! The message layouts as a table.

use core::mem::offset_of;

use messages::{
    CameraCounts, EvidenceHeader, FrameHeader, FusedView, GridMessage, Health, Joint3d, Kept,
    LocalMessage, Metrics, MetricsRow, PairHypothesis, PairPose, People, PersonMessage,
    PictureHeader, PoseMessage, Searched, Sides, Sightings, SkeletonMessage, Skeletons, Span,
    Stamp, Status, TimedBy, Timing, ViewQuality, topic,
};

/// The type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A little-endian number, by its `NumPy` name, such as `<u4`.
    Number(&'static str),
    /// One of the structs, by its name.
    Struct(&'static str),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    /// Name of the field.
    pub(super) name: &'static str,
    /// Offset of the field in its struct, in bytes.
    pub(super) offset: usize,
    /// Size of the whole field, in bytes.
    #[cfg(test)]
    size: usize,
    /// Type of the field's elements.
    pub(super) kind: Kind,
    /// Lengths of the array, outermost first; empty for a single value.
    pub(super) lengths: Vec<usize>,
}

/// The layout of a struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Layout {
    /// Name of the struct in the crate `messages`.
    pub(super) name: &'static str,
    /// Name of the type in the transport, which includes its version.
    pub(super) type_name: &'static str,
    /// Size of the struct, in bytes.
    pub(super) size: usize,
    /// Alignment of the struct, in bytes.
    pub(super) align: usize,
    /// Fields of the struct, in order.
    pub(super) fields: Vec<Field>,
}

/// Topics of one kind, with their messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Topic {
    /// Name of the topics, with `{}` in place of the view, worker or process.
    pub(super) name: String,
    /// Subject of the messages, such as `frame`.
    pub(super) about: String,
    /// Version in the name of the topics.
    pub(super) version: u32,
    /// The message type, or the type of the header before an array.
    pub(super) message: &'static str,
    /// Type of the array elements after the header; `None` if there is no array.
    pub(super) elements: Option<Kind>,
}

/// A type that a field may have.
trait Shape {
    /// Returns the type of the elements, and the lengths of the array.
    fn shape() -> (Kind, Vec<usize>);
}

macro_rules! numbers {
    ($($rust:ty, $numpy:literal;)*) => {
        $(impl Shape for $rust {
            fn shape() -> (Kind, Vec<usize>) {
                (Kind::Number($numpy), Vec::new())
            }
        })*
    };
}

numbers! {
    u8, "|u1";
    u16, "<u2";
    u32, "<u4";
    u64, "<u8";
    i64, "<i8";
    f32, "<f4";
    f64, "<f8";
}

impl<T: Shape, const N: usize> Shape for [T; N] {
    fn shape() -> (Kind, Vec<usize>) {
        let (kind, mut lengths) = T::shape();
        lengths.insert(0, N);
        (kind, lengths)
    }
}

/// Types that wrap a number are plain numbers in other languages.
macro_rules! names_of_numbers {
    ($number:ty: $($name:ty),*) => {
        $(impl Shape for $name {
            fn shape() -> (Kind, Vec<usize>) {
                <$number>::shape()
            }
        })*
    };
}

names_of_numbers!(u32: Status, Searched, Sides, Kept, Span);
names_of_numbers!(u64: TimedBy);

/// Returns the field that `_place` selects. The compiler infers the type.
fn field<S, T: Shape>(name: &'static str, offset: usize, _place: fn(&S) -> &T) -> Field {
    let (kind, lengths) = T::shape();
    Field {
        name,
        offset,
        #[cfg(test)]
        size: size_of::<T>(),
        kind,
        lengths,
    }
}

macro_rules! structs {
    ($($name:ident, $type_name:literal: $($field:ident)*;)*) => {
        $(impl Shape for $name {
            fn shape() -> (Kind, Vec<usize>) {
                (Kind::Struct(stringify!($name)), Vec::new())
            }
        })*

        /// Returns the layouts of all structs. Each struct comes after the structs that it contains.
        pub(super) fn layouts() -> Vec<Layout> {
            vec![$(Layout {
                name: stringify!($name),
                type_name: $type_name,
                size: size_of::<$name>(),
                align: align_of::<$name>(),
                fields: vec![$(field(
                    stringify!($field),
                    offset_of!($name, $field),
                    |message: &$name| &message.$field,
                )),*],
            }),*]
        }
    };
}

structs! {
    Stamp, "Stamp.v1": session frame captured_at_nanos view epoch;
    Timing, "Timing.v1": received_at_nanos sent_at_nanos;
    FrameHeader, "FrameHeader.v1":
        stamp timing width height status reserved n_dropped skew_nanos reserved_end;
    PictureHeader, "PictureHeader.v1":
        stamp timing width height status format sequence presented_nanos grid_start_nanos grid_rate_hz bytes_per_row
        connection name reserved;
    PoseMessage, "PoseMessage.v1": score level n_parts x y mixture;
    LocalMessage, "LocalMessage.v1": response contrast margin;
    Sightings, "Sightings.v1":
        stamp timing status n_candidates width height evidence_bytes skew_nanos searched n_keypoints candidates joints
        local front heats colours ages_s keypoints;
    GridMessage, "GridMessage.v2": first_px cell_px size kind padding;
    EvidenceHeader, "EvidenceHeader.v5":
        stamp timing width height status n_levels n_people padding people x y scope_levels levels best size reserved;
    ViewQuality, "ViewQuality.v2":
        stamp timing status n_parts sigma_px n_thresholds network tau_px tile took_nanos;
    PairHypothesis, "PairHypothesis.v1":
        energy n_iterations converged exchanged start reserved active_parts poses;
    PairPose, "PairPose.v3":
        stamp timing status n_hypotheses views hypotheses views_present sigma_age sigma_px;
    PersonMessage, "PersonMessage.v1": id candidates;
    People, "People.v1": stamp timing status n_people n_seen views_present people;
    Joint3d, "Joint3d.v1": in_world covariance reprojection_px views_used status;
    FusedView, "FusedView.v1": energy n_pairs status exchanged n_parts centres_px single_score;
    SkeletonMessage, "SkeletonMessage.v1":
        id status n_joints n_keypoints n_views views_used n_pairs sides kept facing_margin sides_margin stature_m
        body_deviation joints views keypoints;
    Skeletons, "Skeletons.v1": stamp timing status views_present n_seen n_people people;
    Health, "Health.v6":
        session pid epoch n_loops at_nanos n_received n_sent n_dropped last_frame p50_micros p99_micros
        peak_memory_bytes finished cpu_millis n_total n_without_gpu n_waiting refused;
    CameraCounts, "CameraCounts.v3":
        n_connections n_made n_lost n_delivered n_used n_surplus n_overtaken n_refused rate_microhertz off_grid_nanos
        skew_nanos drift_ppb delay_nanos timed_by;
    MetricsRow, "MetricsRow.v1": span view count millihertz p50_nanos p99_nanos p99_9_nanos max_nanos;
    Metrics, "Metrics.v5":
        session pid epoch began_at_nanos at_nanos n_received n_sent sent_millihertz n_dropped evidence_bytes
        memory_bytes peak_memory_bytes queue longest_queue view finished name n_rows n_people camera rows;
}

/// Placeholder for the view, worker or process in the name of a topic.
const ANY: usize = 7_777_777;

/// Returns the topics of all kinds, with their messages.
pub(super) fn topics() -> Vec<Topic> {
    let number = |shape: (Kind, Vec<usize>)| Some(shape.0);
    let any = ANY.to_string();
    let all = [
        (topic::frame(ANY), "FrameHeader", number(u8::shape())),
        (topic::picture(ANY), "PictureHeader", number(u8::shape())),
        (topic::sightings(ANY), "Sightings", None),
        (topic::evidence(ANY), "EvidenceHeader", number(f32::shape())),
        (topic::view_quality(ANY), "ViewQuality", None),
        (topic::pair_pose(ANY), "PairPose", None),
        (topic::people(), "People", None),
        (topic::skeletons(), "Skeletons", None),
        (topic::health(&any), "Health", None),
        (topic::metrics(&any), "Metrics", None),
    ];
    let topics = all.into_iter().map(|(name, message, elements)| {
        let (about, rest) = name.split_once("/v").unwrap_or((&name, ""));
        let version = rest.split('/').next().unwrap_or_default();
        Topic {
            about: about.to_owned(),
            version: version.parse().unwrap_or(0),
            name: name.replace(&any, "{}"),
            message,
            elements,
        }
    });
    topics.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_fill_every_struct_without_a_gap() {
        for layout in layouts() {
            let mut end = 0;
            for field in &layout.fields {
                assert_eq!(field.offset, end, "{}.{}", layout.name, field.name);
                end += field.size;
            }
            assert_eq!(end, layout.size, "{}: a field is missing here", layout.name);
        }
    }

    /// The sources that define the structs.
    const SOURCES: [&str; 10] = [
        include_str!("../../../../../shared/messages/src/evidence.rs"),
        include_str!("../../../../../shared/messages/src/frame.rs"),
        include_str!("../../../../../shared/messages/src/health.rs"),
        include_str!("../../../../../shared/messages/src/metrics.rs"),
        include_str!("../../../../../shared/messages/src/people.rs"),
        include_str!("../../../../../shared/messages/src/picture.rs"),
        include_str!("../../../../../shared/messages/src/pose.rs"),
        include_str!("../../../../../shared/messages/src/skeletons.rs"),
        include_str!("../../../../../shared/messages/src/quality.rs"),
        include_str!("../../../../../shared/messages/src/stamp.rs"),
    ];

    #[test]
    fn type_names_equal_those_of_the_transport() {
        for layout in layouts() {
            let head = format!("pub struct {} {{\n", layout.name);
            let mut sources = SOURCES.iter();
            let found = sources.find_map(|source| Some((source, source.find(&head)?)));
            let (source, at) = found.unwrap();
            let before = source[..at].rfind("#[type_name(\"").unwrap();
            let name = source[before..at].split('"').nth(1);
            assert_eq!(name, Some(layout.type_name));
        }
    }

    #[test]
    fn every_topic_has_a_version_and_a_message() {
        let layouts = layouts();
        for topic in topics() {
            assert!(topic.version > 0, "{topic:?}");
            assert!(
                layouts.iter().any(|layout| layout.name == topic.message),
                "{topic:?}"
            );
        }
        let names: Vec<String> = topics().into_iter().map(|topic| topic.name).collect();
        assert!(names.contains(&"frame/v1/{}".to_owned()), "{names:?}");
        assert!(names.contains(&"skeletons/v1".to_owned()), "{names:?}");
    }
}
