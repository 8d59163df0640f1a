//! The message types of topics: their sizes and schemas.

use messages::{
    EvidenceHeader, FrameHeader, Health, MAX_PEOPLE, PairPose, People, PictureHeader, Sightings,
    SkeletonMessage, Skeletons, ViewQuality, topic,
};

/// A type of message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Pixels of a view.
    Frame,
    /// Response maps of a view.
    Evidence,
    /// Single-view candidates.
    Sightings,
    /// Expected errors of a view.
    ViewQuality,
    /// Results of a fusion worker.
    PairPose,
    /// The people in a frame.
    People,
    /// The final result.
    Skeletons,
    /// Heartbeats of a process.
    Health,
    /// Pictures of a live camera in their original form.
    Picture,
}

/// The types that a schema may refer to.
const PARTS: [(&str, &str); 10] = [
    ("Stamp", include_str!("../msg/Stamp.msg")),
    ("Timing", include_str!("../msg/Timing.msg")),
    ("Grid", include_str!("../msg/Grid.msg")),
    ("Pose", include_str!("../msg/Pose.msg")),
    ("Local", include_str!("../msg/Local.msg")),
    ("PairHypothesis", include_str!("../msg/PairHypothesis.msg")),
    ("Person", include_str!("../msg/Person.msg")),
    ("Joint3d", include_str!("../msg/Joint3d.msg")),
    ("FusedView", include_str!("../msg/FusedView.msg")),
    ("Skeleton", include_str!("../msg/Skeleton.msg")),
];

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::Frame,
        Self::Evidence,
        Self::Sightings,
        Self::ViewQuality,
        Self::PairPose,
        Self::People,
        Self::Skeletons,
        Self::Health,
        Self::Picture,
    ];

    /// Returns the message type of a topic; `None` for an unknown topic.
    pub fn of_topic(name: &str) -> Option<Self> {
        let family = |name: &str| name.rsplit_once('/').map(|parts| parts.0.to_owned());
        Self::ALL.into_iter().find(|kind| match kind {
            Self::People | Self::Skeletons => name == kind.example(),
            _ => family(name).is_some_and(|own| Some(own) == family(&kind.example())),
        })
    }

    /// Returns true if a topic has this kind, but in another version.
    pub fn is_of_another_version(self, name: &str) -> bool {
        let base = |name: &str| name.split('/').next().map(str::to_owned);
        Self::of_topic(name).is_none() && base(&self.example()) == base(name)
    }

    /// Returns the name of a topic of this kind.
    fn example(self) -> String {
        match self {
            Self::Frame => topic::frame(0),
            Self::Evidence => topic::evidence(0),
            Self::Sightings => topic::sightings(0),
            Self::ViewQuality => topic::view_quality(0),
            Self::PairPose => topic::pair_pose(0),
            Self::People => topic::people(),
            Self::Skeletons => topic::skeletons(),
            Self::Health => topic::health("any"),
            Self::Picture => topic::picture(0),
        }
    }

    /// Returns the size of the message without its array, in bytes. The list of people in a skeletons message is written as an array; for
    /// such a message, this is the size of the fields before the count of people.
    pub fn head_bytes(self) -> usize {
        match self {
            Self::Frame => size_of::<FrameHeader>(),
            Self::Evidence => size_of::<EvidenceHeader>(),
            Self::Sightings => size_of::<Sightings>(),
            Self::ViewQuality => size_of::<ViewQuality>(),
            Self::PairPose => size_of::<PairPose>(),
            Self::People => size_of::<People>(),
            Self::Skeletons => core::mem::offset_of!(Skeletons, n_people),
            Self::Health => size_of::<Health>(),
            Self::Picture => size_of::<PictureHeader>(),
        }
    }

    /// Returns the size of an element of the message's array, in bytes; `None` if it has no array.
    pub fn element_bytes(self) -> Option<usize> {
        match self {
            Self::Frame | Self::Picture => Some(size_of::<u8>()),
            Self::Evidence => Some(size_of::<f32>()),
            Self::Skeletons => Some(size_of::<SkeletonMessage>()),
            _ => None,
        }
    }

    /// Returns the maximum number of elements of the message's array.
    pub(crate) fn most_elements(self) -> u64 {
        match self {
            Self::Skeletons => MAX_PEOPLE as u64,
            _ => u64::from(u32::MAX),
        }
    }

    /// Returns the offset of the message's status, in bytes; `None` if it has no stamp.
    pub(crate) fn status_at(self) -> Option<usize> {
        match self {
            Self::Frame => Some(core::mem::offset_of!(FrameHeader, status)),
            Self::Evidence => Some(core::mem::offset_of!(EvidenceHeader, status)),
            Self::Sightings => Some(core::mem::offset_of!(Sightings, status)),
            Self::ViewQuality => Some(core::mem::offset_of!(ViewQuality, status)),
            Self::PairPose => Some(core::mem::offset_of!(PairPose, status)),
            Self::People => Some(core::mem::offset_of!(People, status)),
            Self::Skeletons => Some(core::mem::offset_of!(Skeletons, status)),
            Self::Picture => Some(core::mem::offset_of!(PictureHeader, status)),
            Self::Health => None,
        }
    }

    /// Returns the name of the message's schema.
    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Frame => "parallax/msg/Frame",
            Self::Evidence => "parallax/msg/Evidence",
            Self::Sightings => "parallax/msg/Sightings",
            Self::ViewQuality => "parallax/msg/ViewQuality",
            Self::PairPose => "parallax/msg/PairPose",
            Self::People => "parallax/msg/People",
            Self::Skeletons => "parallax/msg/Skeletons",
            Self::Health => "parallax/msg/Health",
            Self::Picture => "parallax/msg/Picture",
        }
    }

    fn own_schema(self) -> &'static str {
        match self {
            Self::Frame => include_str!("../msg/Frame.msg"),
            Self::Evidence => include_str!("../msg/Evidence.msg"),
            Self::Sightings => include_str!("../msg/Sightings.msg"),
            Self::ViewQuality => include_str!("../msg/ViewQuality.msg"),
            Self::PairPose => include_str!("../msg/PairPose.msg"),
            Self::People => include_str!("../msg/People.msg"),
            Self::Skeletons => include_str!("../msg/Skeletons.msg"),
            Self::Health => include_str!("../msg/Health.msg"),
            Self::Picture => include_str!("../msg/Picture.msg"),
        }
    }

    /// Returns the message's schema in the format `ros2msg`: its definition, and the definitions of all types that it refers to.
    pub fn schema(self) -> String {
        let mut text = self.own_schema().to_owned();
        let rule = "=".repeat(80);
        let mut next = 0;
        let mut used = Vec::new();
        loop {
            let found = PARTS
                .iter()
                .filter(|(name, _)| text[next..].contains(&format!("parallax/{name}")))
                .filter(|part| !used.contains(&part.0));
            let found: Vec<_> = found.collect();
            next = text.len();
            if found.is_empty() {
                return text;
            }
            for (name, definition) in found {
                used.push(*name);
                for piece in [&rule, "\nMSG: parallax/", name, "\n", definition] {
                    text.push_str(piece);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the size and alignment of a type in CDR, in bytes. An array of variable length counts as 0.
    fn size(kind: &str) -> [usize; 2] {
        if let Some((one, n)) = kind.strip_suffix(']').and_then(|rest| rest.rsplit_once('[')) {
            let [size, alignment] = size(one);
            return [size * n.parse::<usize>().unwrap_or(0), alignment];
        }
        if let Some(name) = kind.strip_prefix("parallax/") {
            let part = PARTS.iter().find(|part| part.0 == name).unwrap();
            return size_of_text(part.1);
        }
        let digits = kind.trim_start_matches(|letter: char| letter.is_ascii_alphabetic());
        let bytes = digits.parse::<usize>().unwrap() / 8;
        [bytes, bytes]
    }

    fn size_of_text(text: &str) -> [usize; 2] {
        let mut at = 0;
        let mut most = 1;
        for line in text.lines() {
            let [bytes, alignment] = size(line.split_whitespace().next().unwrap());
            // The number of elements of a list is stored before the list.
            let begin = at + if line.contains("[] ") { 4 } else { 0 };
            assert_eq!(
                begin % alignment,
                0,
                "CDR would leave a gap before {line:?}"
            );
            at += bytes;
            most = most.max(alignment);
        }
        [at, most]
    }

    #[test]
    fn a_schema_describes_every_byte_of_its_message() {
        for kind in Kind::ALL {
            assert_eq!(
                size_of_text(kind.own_schema())[0],
                kind.head_bytes(),
                "{kind:?}"
            );
            let has_array = kind.own_schema().contains("[] ");
            assert_eq!(has_array, kind.element_bytes().is_some(), "{kind:?}");
        }
    }

    #[test]
    fn a_schema_contains_every_type_that_it_refers_to_once() {
        for kind in Kind::ALL {
            let schema = kind.schema();
            for (name, _) in PARTS {
                let is_used = schema.contains(&format!("parallax/{name} "))
                    || schema.contains(&format!("parallax/{name}["));
                let n_defined = schema.matches(&format!("MSG: parallax/{name}\n")).count();
                assert_eq!(n_defined, usize::from(is_used), "{name} in {kind:?}");
            }
        }
    }

    #[test]
    fn a_topic_of_another_version_is_distinguished_from_an_unknown_topic() {
        assert!(Kind::Sightings.is_of_another_version("sightings/v5/0"));
        assert!(Kind::Skeletons.is_of_another_version("skeletons/v0"));
        for other in ["sightings/v1/0", "skeletons/v0", "metrics/v0/a", "camera"] {
            assert!(!Kind::Sightings.is_of_another_version(other), "{other}");
        }
    }

    #[test]
    fn the_kind_follows_from_the_topic_and_unknown_topics_have_none() {
        for kind in Kind::ALL {
            assert_eq!(Kind::of_topic(&kind.example()), Some(kind));
        }
        assert_eq!(Kind::of_topic("frame/v1/12"), Some(Kind::Frame));
        assert_eq!(Kind::of_topic("health/v5/pose-3"), Some(Kind::Health));
        for other in [
            "frame/v2/0",
            "frame/v1",
            "skeletons/v2",
            "skeletons/v1/0",
            "skeletons",
            "",
            "/",
            "x/frame/v1/0",
        ] {
            assert_eq!(Kind::of_topic(other), None, "{other}");
        }
    }
}
