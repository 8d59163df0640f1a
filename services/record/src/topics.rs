//! The topics of a deployment, and the topics that report the number of messages on other topics.

use messages::topic;
use recording::{Kind, Without};

/// The properties of a deployment that determine its topics.
#[derive(Debug, Clone)]
pub struct Topics {
    /// Number of views.
    pub n_views: usize,
    /// Topics of the fusion processes, by process.
    pub fused: Vec<String>,
    /// True if there are processes that send expected errors.
    pub has_quality: bool,
    /// Views with live cameras whose original pictures are kept.
    pub pictures: Vec<usize>,
    /// Names of all processes.
    pub processes: Vec<String>,
    /// Topics that no process of this machine publishes, in a deployment of several hosts. They are not recorded.
    pub elsewhere: Vec<String>,
}

/// A topic, and the process that publishes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) kind: Kind,
    pub(crate) name: String,
    /// The process that publishes the topic; `None` if its heartbeats do not count this topic.
    sender: Option<String>,
}

impl Topics {
    /// Returns all topics, heartbeats first. When a heartbeat has been read, all messages that it counts can be received.
    pub(crate) fn channels(&self, without: Without) -> Vec<Channel> {
        let mut channels = Vec::new();
        // The bridge publishes the messages from other hosts. Its heartbeats count all these messages together.
        let is_here = |text: &String| self.processes.contains(text);
        let mut add = |kind, name: String, sender: Option<String>| {
            if !self.elsewhere.contains(&name) {
                let sender = sender.filter(is_here);
                channels.push(Channel { kind, name, sender });
            }
        };
        for process in &self.processes {
            add(Kind::Health, topic::health(process), None);
        }
        for view in 0..self.n_views {
            let from = |service: &str| Some(format!("{service}-{view}"));
            if self.pictures.contains(&view) {
                add(Kind::Picture, topic::picture(view), None);
            }
            add(Kind::Frame, topic::frame(view), from("capture"));
            if !without.evidence {
                add(Kind::Evidence, topic::evidence(view), None);
            }
            add(Kind::Sightings, topic::sightings(view), from("pose"));
            if self.has_quality {
                add(
                    Kind::ViewQuality,
                    topic::view_quality(view),
                    from("quality"),
                );
            }
        }
        for (worker, name) in self.fused.iter().enumerate() {
            if let Some(kind) = Kind::of_topic(name) {
                add(kind, name.clone(), Some(format!("fuse-{worker}")));
            }
        }
        add(
            Kind::Skeletons,
            topic::skeletons(),
            Some("triangulate".to_owned()),
        );
        channels
    }
}

/// Returns the indices of the topics whose messages a topic counts. Heartbeats count the messages of their process, poses announce their
/// evidence, and pictures are numbered.
pub(crate) fn counted_by(counter: &Channel, channels: &[Channel]) -> Vec<usize> {
    let is_counted = |other: &Channel| match counter.kind {
        // The numbers of the pictures show how many are missing.
        Kind::Picture => other.name == counter.name,
        Kind::Health => {
            let sender = other.sender.as_ref();
            sender.is_some_and(|sender| topic::health(sender) == counter.name)
        }
        Kind::Sightings => {
            let view = |name: &str| name.rsplit('/').next().map(str::to_owned);
            other.kind == Kind::Evidence && view(&other.name) == view(&counter.name)
        }
        _ => false,
    };
    let numbered = channels.iter().enumerate();
    let counted = numbered.filter(|(_, channel)| is_counted(channel));
    counted.map(|(index, _)| index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(without: Without) -> Vec<Channel> {
        let topics = Topics {
            n_views: 2,
            fused: vec![topic::pair_pose(0)],
            has_quality: true,
            pictures: vec![1],
            processes: ["results", "pose-1", "fuse-0"].map(str::to_owned).into(),
            elsewhere: Vec::new(),
        };
        topics.channels(without)
    }

    #[test]
    fn topics_of_other_hosts_are_neither_recorded_nor_counted() {
        let topics = Topics {
            n_views: 2,
            fused: Vec::new(),
            has_quality: false,
            pictures: Vec::new(),
            processes: ["bridge", "pose-0"].map(str::to_owned).into(),
            elsewhere: vec![topic::frame(1), topic::evidence(1), topic::skeletons()],
        };
        let all = topics.channels(Without::default());
        let names: Vec<&str> = all.iter().map(|channel| channel.name.as_str()).collect();
        let [near, far] = [0, 1].map(topic::sightings);
        assert!(names.contains(&near.as_str()) && names.contains(&far.as_str()));
        assert!(!names.contains(&topic::frame(1).as_str()), "{names:?}");
        let sender =
            |name: &str| all.iter().find(|channel| channel.name == name).unwrap().sender.clone();
        assert_eq!(sender(&near).as_deref(), Some("pose-0"));
        assert_eq!(sender(&far), None);
    }

    #[test]
    fn every_topic_is_recorded_with_its_kind() {
        let all = channels(Without::default());
        assert_eq!(all.len(), 3 + 2 * 4 + 1 + 1 + 1);
        for channel in &all {
            assert_eq!(Kind::of_topic(&channel.name), Some(channel.kind));
        }
        let without = channels(Without {
            evidence: true,
            pixels: true,
        });
        assert!(without.iter().all(|channel| channel.kind != Kind::Evidence));
        assert_eq!(without.len(), all.len() - 2);
    }

    #[test]
    fn heartbeats_count_the_messages_of_their_process_and_poses_count_their_evidence() {
        let all = channels(Without::default());
        let counted = |name: &str| {
            let counter = all.iter().find(|channel| channel.name == name).unwrap();
            let counted = counted_by(counter, &all).into_iter();
            counted.map(|index| all[index].name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(counted(&topic::health("pose-1")), [topic::sightings(1)]);
        assert_eq!(counted(&topic::health("fuse-0")), [topic::pair_pose(0)]);
        assert_eq!(counted(&topic::sightings(1)), [topic::evidence(1)]);
        assert_eq!(counted(&topic::picture(1)), [topic::picture(1)]);
        assert_eq!(counted(&topic::health("results")), Vec::<String>::new());
    }
}
