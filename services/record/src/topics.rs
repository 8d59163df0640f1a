//! The topics of a deployment, and what their messages tell of other topics.

use messages::topic;
use recording::{Kind, Without};

/// What decides the topics of a deployment.
#[derive(Debug, Clone)]
pub struct Topics {
    /// Number of views.
    pub n_views: usize,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
    /// Names of all processes.
    pub processes: Vec<String>,
}

/// A topic, and the process that publishes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) kind: Kind,
    pub(crate) name: String,
    /// None where the heartbeats of its sender do not count this topic.
    sender: Option<String>,
}

impl Topics {
    /// All topics, heartbeats first: a message that a heartbeat counts has been received by then, if it came at all.
    pub(crate) fn channels(&self, without: Without) -> Vec<Channel> {
        let mut channels = Vec::new();
        let mut add = |kind, name, sender| channels.push(Channel { kind, name, sender });
        for process in &self.processes {
            add(Kind::Health, topic::health(process), None);
        }
        for view in 0..self.n_views {
            let from = |service: &str| Some(format!("{service}-{view}"));
            add(Kind::Frame, topic::frame(view), from("capture"));
            if !without.evidence {
                add(Kind::Evidence, topic::evidence(view), None);
            }
            add(Kind::ViewPose, topic::view_pose(view), from("pose"));
            if self.has_quality {
                add(
                    Kind::ViewQuality,
                    topic::view_quality(view),
                    from("quality"),
                );
            }
        }
        for worker in 0..self.n_workers {
            let sender = Some(format!("fuse-{worker}"));
            add(Kind::PairPose, topic::pair_pose(worker), sender);
        }
        add(
            Kind::Pose3d,
            topic::pose3d(),
            Some("triangulate".to_owned()),
        );
        channels
    }
}

/// The topics that a topic tells of: heartbeats count what their process sent, and poses announce their evidence.
pub(crate) fn told_by(it: &Channel, channels: &[Channel]) -> Vec<usize> {
    let is_told = |other: &Channel| match it.kind {
        Kind::Health => {
            let sender = other.sender.as_ref();
            sender.is_some_and(|sender| topic::health(sender) == it.name)
        }
        Kind::ViewPose => {
            let view = |name: &str| name.rsplit('/').next().map(str::to_owned);
            other.kind == Kind::Evidence && view(&other.name) == view(&it.name)
        }
        _ => false,
    };
    let numbered = channels.iter().enumerate();
    numbered.filter(|it| is_told(it.1)).map(|it| it.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(without: Without) -> Vec<Channel> {
        let topics = Topics {
            n_views: 2,
            n_workers: 1,
            has_quality: true,
            processes: ["results", "pose-1", "fuse-0"].map(str::to_owned).into(),
        };
        topics.channels(without)
    }

    #[test]
    fn every_topic_is_recorded_with_its_kind() {
        let all = channels(Without::default());
        assert_eq!(all.len(), 3 + 2 * 4 + 1 + 1);
        for it in &all {
            assert_eq!(Kind::of_topic(&it.name), Some(it.kind));
        }
        let without = channels(Without {
            evidence: true,
            pixels: true,
        });
        assert!(without.iter().all(|it| it.kind != Kind::Evidence));
        assert_eq!(without.len(), all.len() - 2);
    }

    #[test]
    fn heartbeats_tell_of_the_topics_of_their_process_and_poses_of_their_evidence() {
        let all = channels(Without::default());
        let told = |name: &str| {
            let it = all.iter().find(|it| it.name == name).unwrap();
            let told = told_by(it, &all).into_iter();
            told.map(|it| all[it].name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(told(&topic::health("pose-1")), [topic::view_pose(1)]);
        assert_eq!(told(&topic::health("fuse-0")), [topic::pair_pose(0)]);
        assert_eq!(told(&topic::view_pose(1)), [topic::evidence(1)]);
        assert_eq!(told(&topic::health("results")), Vec::<String>::new());
    }
}
