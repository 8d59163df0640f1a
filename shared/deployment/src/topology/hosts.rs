//! The part of a deployment's processes that runs on one of its hosts.

use messages::topic;

use super::{BRIDGE, Process, RECORD, Role, Stage, Topology, process};
use crate::Deployment;
use crate::hosts::{Carry, Host};

impl Topology {
    /// Returns the processes that run on a host, from the topology of the whole deployment.
    ///
    /// A bridge replaces the processes of the other hosts. On the fusing host, it publishes the topics of those processes. On the other
    /// hosts, it subscribes to the topics that they publish.
    ///
    /// * `host`: a host of the deployment.
    #[must_use]
    pub fn on_host(mut self, deployment: &Deployment, host: &Host) -> Self {
        let own = deployment.views_of(host);
        let carry = deployment.link.carry;
        let crosses = |view: &usize| crossing(*view, deployment);
        if host.fuses {
            let remote = (0..self.n_views).filter(|view| !own.contains(view));
            let outputs: Vec<String> = remote.flat_map(|view| crosses(&view)).collect();
            let is_here = |process: &Process| {
                let view = process.index.filter(|view| !own.contains(view));
                view.is_none() || !is_at_camera(process.service, carry)
            };
            self.processes.retain(is_here);
            // If this host has two or more views of its own, they can be triangulated without the bridge.
            let role = if own.len() > 1 {
                Role::Optional
            } else {
                Role::Essential
            };
            let bridge = process(BRIDGE, None, role, Vec::new(), outputs);
            self.processes.push(bridge);
        } else {
            let is_here = |process: &Process| {
                let is_own = process.index.is_some_and(|index| own.contains(&index));
                process.service == RECORD || is_at_camera(process.service, carry) && is_own
            };
            self.processes.retain(is_here);
            self.n_workers = 0;
            let outputs: Vec<String> =
                self.processes.iter().flat_map(|process| process.outputs.clone()).collect();
            for it in &mut self.processes {
                it.inputs.retain(|input| outputs.contains(input));
            }
            let inputs = own.iter().flat_map(crosses).collect();
            let bridge = process(BRIDGE, None, Role::Essential, inputs, Vec::new());
            self.processes.insert(0, bridge);
        }
        self
    }
}

impl Topology {
    /// Returns the topics that none of these processes publishes. With several hosts, these topics stay on the other hosts.
    pub fn topics_elsewhere(&self) -> Vec<String> {
        let of_views = (0..self.n_views).flat_map(|view| {
            let small = [topic::sightings(view), topic::view_quality(view)];
            let large = [
                topic::frame(view),
                topic::evidence(view),
                topic::picture(view),
            ];
            small.into_iter().chain(large)
        });
        let fused = self.fused().into_iter();
        let is_published = |text: &String| {
            let mut processes = self.processes.iter();
            processes.any(|process| process.outputs.contains(text))
        };
        let mut all: Vec<String> = of_views.chain(fused).chain([topic::skeletons()]).collect();
        all.retain(|topic| !is_published(topic));
        all
    }
}

/// Returns true if a service runs on the host of the camera.
fn is_at_camera(service: &str, carry: Carry) -> bool {
    let with_poses = [Stage::Pose, Stage::Quality].map(Stage::name);
    service == Stage::Capture.name() || (carry == Carry::Poses && with_poses.contains(&service))
}

/// Returns the topics of a view that are sent from its host to the fusing host.
fn crossing(view: usize, deployment: &Deployment) -> Vec<String> {
    match deployment.link.carry {
        Carry::Frames => vec![topic::frame(view)],
        Carry::Poses => {
            let quality = deployment.has_quality();
            let mut topics = vec![topic::sightings(view)];
            topics.extend(quality.then(|| topic::view_quality(view)));
            topics.extend(deployment.maps_cross().then(|| topic::evidence(view)));
            topics
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{AnyMachine, Loaded};

    fn deployment(more: &str) -> Deployment {
        solved("pairs", more)
    }

    fn solved(views: &str, more: &str) -> Deployment {
        let method = if views == "space" {
            "method = 'network'\n".to_owned()
        } else {
            format!("method = 'paper'\npaper.views = '{views}'\n")
        };
        let text = format!(
            "name = 'a'\nrig = 'r'\noutput = 'o'\n{method}\
             [[camera]]\nname = 'c0'\nsource = 's'\n[[camera]]\nname = 'c1'\nsource = 's'\n\
             [[camera]]\nname = 'c2'\nsource = 's'\n\
             [capture]\nmode = 'realtime'\nframe_rate_hz = 5.0\n\
             [[host]]\nname = 'desk'\nfuses = true\naddress = 'x:1'\nviews = ['c1']\n\
             [[host]]\nname = 'far'\nviews = ['c0', 'c2']\n[link]\ninsecure = true\n{more}"
        );
        let loaded = Loaded::parse(&text, Path::new("d.toml"), &[], &AnyMachine);
        loaded.unwrap().deployment
    }

    fn names(it: &Topology) -> Vec<&str> {
        it.processes().iter().map(|process| process.name.as_str()).collect()
    }

    #[test]
    fn every_process_of_the_deployment_runs_on_exactly_one_host() {
        for more in ["", "carry = 'poses'\n"] {
            let it = deployment(more);
            let whole = Topology::new(&it, None, None);
            let mut all = Vec::new();
            for host in &it.hosts {
                let part = whole.clone().on_host(&it, host);
                all.extend(names(&part).into_iter().map(str::to_owned));
            }
            all.retain(|name| name != BRIDGE);
            all.sort();
            let mut expected: Vec<&str> = names(&whole);
            expected.sort_unstable();
            assert_eq!(all, expected, "{more}");
        }
    }

    #[test]
    fn the_bridge_publishes_the_topics_that_it_receives_from_other_hosts() {
        for (more, topics) in [
            ("", vec!["frame/v1/0", "frame/v1/2"]),
            (
                "carry = 'poses'\n",
                vec!["sightings/v1/0", "sightings/v1/2"],
            ),
        ] {
            let it = deployment(more);
            let whole = Topology::new(&it, None, None);
            let [desk, far] = [0, 1].map(|host| whole.clone().on_host(&it, &it.hosts[host]));
            assert_eq!(desk.process(BRIDGE).unwrap().outputs, topics);
            assert_eq!(far.process(BRIDGE).unwrap().inputs, topics);
            // On the fusing host, a topic has the same receivers as on a single machine.
            for topic in topics {
                assert_eq!(desk.receivers_of(topic), whole.receivers_of(topic));
                assert_eq!(far.receivers_of(topic), 1);
            }
        }
    }

    #[test]
    fn a_host_with_cameras_has_only_its_topics_and_the_transferred_ones() {
        let it = deployment("");
        let far = Topology::new(&it, None, None).on_host(&it, &it.hosts[1]);
        assert_eq!(names(&far), ["bridge", "capture-0", "capture-2"]);
        let it = deployment("carry = 'poses'\n");
        let far = Topology::new(&it, None, None).on_host(&it, &it.hosts[1]);
        let expected = ["bridge", "pose-0", "pose-2", "capture-0", "capture-2"];
        assert_eq!(names(&far), expected);
        assert_eq!(far.receivers_of("evidence/v5/0"), 0);
    }

    #[test]
    fn the_maps_of_a_network_are_transferred_with_its_poses() {
        let it = solved("space", "carry = 'poses'\n");
        let whole = Topology::new(&it, None, None);
        let [desk, far] = [0, 1].map(|host| whole.clone().on_host(&it, &it.hosts[host]));
        let crosses = [0, 2].map(|view| [topic::sightings(view), topic::evidence(view)]);
        assert_eq!(
            desk.process(BRIDGE).unwrap().outputs,
            crosses.as_flattened()
        );
        assert_eq!(far.process(BRIDGE).unwrap().inputs, crosses.as_flattened());
        assert_eq!(far.receivers_of(&topic::evidence(0)), 1);
        assert_eq!(desk.receivers_of(&topic::evidence(0)), 1, "fusion");
    }

    #[test]
    fn a_host_records_what_its_own_processes_send() {
        let it = deployment("");
        let recording = crate::RecordingPlan::default();
        let whole = Topology::new(&it, Some(&recording), None);
        let [desk, far] = [0, 1].map(|host| whole.clone().on_host(&it, &it.hosts[host]));
        let inputs = |topology: &Topology| topology.process(RECORD).unwrap().inputs.clone();
        assert_eq!(inputs(&far), [0, 2].map(topic::frame));
        assert_eq!(
            far.receivers_of(&topic::frame(0)),
            2,
            "the bridge, and what records"
        );
        assert!(far.topics_elsewhere().contains(&topic::frame(1)));
        assert!(inputs(&desk).contains(&topic::frame(0)), "from the bridge");
        assert!(!desk.topics_elsewhere().contains(&topic::frame(0)));
        assert!(
            desk.topics_elsewhere().contains(&topic::picture(1)),
            "no live camera"
        );
        assert_eq!(
            whole.topics_elsewhere().len(),
            6,
            "pictures and expected errors"
        );
    }

    #[test]
    fn hosts_do_not_change_the_processes_of_the_deployment() {
        let with = deployment("");
        let without = Deployment {
            hosts: Vec::new(),
            ..with.clone()
        };
        let [with, without] =
            [with, without].map(|deployment| Topology::new(&deployment, None, None));
        assert_eq!(with, without);
    }
}
