//! What the processes of a deployment ask of the scheduler, and what the system does not grant: reported once, and then
//! gone without.

use deployment::{Policy, Runtime};
use runtime::{Denied, RealTime, Scheduling};
use supervise::ProcessSpec;

/// Those that somebody waits for: a camera waits for its clock, and nobody for the recorder.
const SPINNING: [&str; 4] = ["pose", "quality", "fuse", "triangulate"];

/// What a process asks of the system's scheduler.
pub(crate) fn asked(settings: &Runtime, service: &str, process: &str) -> Scheduling {
    let policy = match settings.policy {
        Policy::Fifo => runtime::Policy::Fifo,
        Policy::RoundRobin => runtime::Policy::RoundRobin,
    };
    let cores = settings.cores.get(process).or(settings.cores.get(service));
    let priority = settings.priority.get(process);
    let priority = priority.or(settings.priority.get(service));
    Scheduling {
        cores: cores.cloned().unwrap_or_default(),
        real_time: priority.map(|&priority| RealTime { policy, priority }),
        lock_memory: settings.lock_memory,
        spin: settings.spin && SPINNING.contains(&service),
    }
}

/// Takes from processes what the system would not grant them.
///
/// Returns a warning for every thing that is not granted: whom it concerns, why, and what to try.
///
/// * `rehearse`: what the system would not grant, [`Scheduling::rehearse`].
pub(crate) fn permit(
    processes: &mut [ProcessSpec],
    rehearse: impl Fn(&Scheduling) -> Vec<Denied>,
) -> Vec<String> {
    let mut known: Vec<(Scheduling, Vec<Denied>)> = Vec::new();
    let mut concerned: Vec<(Denied, Vec<String>)> = Vec::new();
    for process in processes.iter_mut() {
        let asked = process.scheduling.clone();
        let denied = match known.iter().find(|it| it.0 == asked) {
            Some((_, denied)) => denied.clone(),
            None => rehearse(&asked),
        };
        for it in &denied {
            match concerned.iter_mut().find(|other| other.0 == *it) {
                Some((_, names)) => names.push(process.name.clone()),
                None => concerned.push((it.clone(), vec![process.name.clone()])),
            }
        }
        process.scheduling = asked.clone().without(&denied);
        known.push((asked, denied));
    }
    let warning = |(denied, names): &(Denied, Vec<String>)| {
        let reason = core::error::Error::source(denied).map(|it| format!(" ({it})"));
        format!(
            "{}: {denied}{}; going on without. Try: {}",
            names.join(", "),
            reason.unwrap_or_default(),
            denied.hint()
        )
    };
    concerned.iter().map(warning).collect()
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;

    use supervise::Role;

    use super::*;

    fn spec(name: &str, scheduling: &str) -> ProcessSpec {
        ProcessSpec {
            name: name.to_owned(),
            service: name.to_owned(),
            args: Vec::new(),
            role: Role::Optional,
            senders: Vec::new(),
            scheduling: scheduling.parse().unwrap(),
            most_work: None,
        }
    }

    /// A system with cores 0 and 1, where nobody has a real-time priority.
    fn rehearse(asked: &Scheduling) -> Vec<Denied> {
        let allowed = vec![0, 1];
        let too_many = asked.cores.iter().any(|it| !allowed.contains(it));
        let cores = too_many.then(|| Denied::Cores {
            asked: asked.cores.clone(),
            allowed,
            source: None,
        });
        let real_time = asked.real_time.map(|asked: RealTime| Denied::RealTime {
            asked,
            source: ErrorKind::PermissionDenied.into(),
        });
        cores.into_iter().chain(real_time).collect()
    }

    #[test]
    fn every_denial_is_said_once_and_names_whom_it_concerns() {
        let mut processes = [
            spec("pose-0", "fifo=50 cores=1"),
            spec("pose-1", "fifo=50 cores=1,7 spin"),
            spec("results", ""),
        ];
        let said = permit(&mut processes, rehearse);
        let [priority, cores] = &said[..] else {
            panic!("{said:#?}")
        };
        assert!(
            priority
                .starts_with("pose-0, pose-1: cannot run at real-time priority 50 (SCHED_FIFO)"),
            "{priority}"
        );
        assert!(priority.contains("permission denied"), "{priority}");
        assert!(priority.contains("ulimit -r"), "{priority}");
        assert!(
            cores.starts_with("pose-1: cannot run on cores 1,7: 0,1 may be used; going on without"),
            "{cores}"
        );
        let got = processes.map(|it| it.scheduling.to_string());
        assert_eq!(got, ["cores=1", "cores=1 spin", ""]);
    }

    #[test]
    fn who_is_granted_everything_is_not_warned() {
        let mut processes = [spec("pose-0", "cores=0,1 spin"), spec("fuse-0", "")];
        assert_eq!(permit(&mut processes, rehearse), Vec::<String>::new());
        assert_eq!(processes[0].scheduling.to_string(), "cores=0,1 spin");
    }

    fn of(text: &str, process: &str) -> String {
        let it: Runtime = toml::from_str(text).unwrap();
        let service = process.split('-').next().unwrap();
        asked(&it, service, process).to_string()
    }

    #[test]
    fn nothing_is_asked_for_by_default() {
        for process in ["capture-0", "pose-1", "triangulate"] {
            assert_eq!(of("", process), "");
        }
    }

    #[test]
    fn what_is_said_of_a_process_wins_over_what_is_said_of_its_service() {
        let text = "cores = { pose = [0, 1], pose-2 = [3] }\npriority = { pose-2 = 9, fuse = 4 }";
        assert_eq!(of(text, "pose-0"), "cores=0,1");
        assert_eq!(of(text, "pose-2"), "cores=3 fifo=9");
        assert_eq!(of(text, "fuse-0"), "fifo=4");
        assert_eq!(of(text, "results"), "");
    }

    #[test]
    fn who_waits_for_a_clock_and_who_nobody_waits_for_do_not_spin() {
        let text = "spin = true\npolicy = \"round-robin\"\npriority = { capture = 2 }";
        for process in ["pose-0", "quality-0", "fuse-1", "triangulate"] {
            assert_eq!(of(text, process), "spin");
        }
        assert_eq!(of(text, "capture-0"), "round-robin=2");
        assert_eq!(of(text, "results"), "");
    }
}
