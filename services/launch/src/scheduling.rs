//! The scheduling that processes of a deployment request. Requests that the system would deny are removed.

use deployment::Runtime;
use runtime::{Denied, RealTime, Scheduling};
use supervise::ProcessSpec;

/// The services that may poll: other stages wait for their results. `capture` is left out because it waits for its clock, and `results`
/// because no stage waits for it.
const POLLING: [&str; 4] = ["pose", "quality", "fuse", "triangulate"];

/// Returns the scheduling that a process requests. Settings of the process take precedence over settings of its service.
pub(crate) fn requested(settings: &Runtime, service: &str, process: &str) -> Scheduling {
    let policy = runtime::Policy::Fifo;
    let cores = settings.cores.get(process).or(settings.cores.get(service));
    let priority = settings.priority.get(process);
    let priority = priority.or(settings.priority.get(service));
    Scheduling {
        cores: cores.cloned().unwrap_or_default(),
        real_time: priority.map(|&priority| RealTime { policy, priority }),
        lock_memory: settings.lock_memory,
        spin: settings.spin && POLLING.contains(&service),
    }
}

/// Removes requests that the system would deny. Returns a warning for each denial, with the processes, the reason, and what to try.
///
/// * `rehearse`: returns the requests that the system would deny, as [`Scheduling::rehearse`] does.
pub(crate) fn remove_denied(
    processes: &mut [ProcessSpec],
    rehearse: impl Fn(&Scheduling) -> Vec<Denied>,
) -> Vec<String> {
    let mut known: Vec<(Scheduling, Vec<Denied>)> = Vec::new();
    let mut denials: Vec<(Denied, Vec<String>)> = Vec::new();
    for process in processes.iter_mut() {
        let requested = process.scheduling.clone();
        let denied = match known.iter().find(|entry| entry.0 == requested) {
            Some((_, denied)) => denied.clone(),
            None => rehearse(&requested),
        };
        for denial in &denied {
            match denials.iter_mut().find(|entry| entry.0 == *denial) {
                Some((_, names)) => names.push(process.name.clone()),
                None => denials.push((denial.clone(), vec![process.name.clone()])),
            }
        }
        process.scheduling = requested.clone().without(&denied);
        known.push((requested, denied));
    }
    let warning = |(denied, names): &(Denied, Vec<String>)| {
        let reason = core::error::Error::source(denied).map(|source| format!(" ({source})"));
        format!(
            "{}: {denied}{}; continuing without this setting. Try: {}",
            names.join(", "),
            reason.unwrap_or_default(),
            denied.hint()
        )
    };
    denials.iter().map(warning).collect()
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
            completes_files: false,
        }
    }

    /// Simulates a system with cores 0 and 1 that denies real-time priorities.
    fn rehearse(requested: &Scheduling) -> Vec<Denied> {
        let allowed = vec![0, 1];
        let too_many = requested.cores.iter().any(|core| !allowed.contains(core));
        let cores = too_many.then(|| Denied::Cores {
            asked: requested.cores.clone(),
            allowed,
            source: None,
        });
        let real_time = requested.real_time.map(|asked: RealTime| Denied::RealTime {
            asked,
            source: ErrorKind::PermissionDenied.into(),
        });
        cores.into_iter().chain(real_time).collect()
    }

    #[test]
    fn every_denial_is_reported_once_with_its_processes() {
        let mut processes = [
            spec("pose-0", "fifo=50 cores=1"),
            spec("pose-1", "fifo=50 cores=1,7 spin"),
            spec("results", ""),
        ];
        let warnings = remove_denied(&mut processes, rehearse);
        let [priority, cores] = &warnings[..] else {
            panic!("{warnings:#?}")
        };
        assert!(
            priority
                .starts_with("pose-0, pose-1: cannot run at real-time priority 50 (SCHED_FIFO)"),
            "{priority}"
        );
        assert!(priority.contains("permission denied"), "{priority}");
        assert!(priority.contains("ulimit -r"), "{priority}");
        assert!(
            cores.starts_with(
                "pose-1: cannot run on cores 1,7: only 0,1 may be used; continuing without this setting"
            ),
            "{cores}"
        );
        let got = processes.map(|process| process.scheduling.to_string());
        assert_eq!(got, ["cores=1", "cores=1 spin", ""]);
    }

    #[test]
    fn without_denials_there_are_no_warnings() {
        let mut processes = [spec("pose-0", "cores=0,1 spin"), spec("fuse-0", "")];
        assert_eq!(
            remove_denied(&mut processes, rehearse),
            Vec::<String>::new()
        );
        assert_eq!(processes[0].scheduling.to_string(), "cores=0,1 spin");
    }

    fn scheduling_of(text: &str, process: &str) -> String {
        let settings: Runtime = toml::from_str(text).unwrap();
        let service = process.split('-').next().unwrap();
        requested(&settings, service, process).to_string()
    }

    #[test]
    fn nothing_is_requested_by_default() {
        for process in ["capture-0", "pose-1", "triangulate"] {
            assert_eq!(scheduling_of("", process), "");
        }
    }

    #[test]
    fn settings_of_a_process_take_precedence_over_those_of_its_service() {
        let text = "cores = { pose = [0, 1], pose-2 = [3] }\npriority = { pose-2 = 9, fuse = 4 }";
        assert_eq!(scheduling_of(text, "pose-0"), "cores=0,1");
        assert_eq!(scheduling_of(text, "pose-2"), "cores=3 fifo=9");
        assert_eq!(scheduling_of(text, "fuse-0"), "fifo=4");
        assert_eq!(scheduling_of(text, "results"), "");
    }

    #[test]
    fn the_processes_capture_and_results_do_not_poll() {
        let text = "spin = true\npriority = { capture = 2 }";
        for process in ["pose-0", "quality-0", "fuse-1", "triangulate"] {
            assert_eq!(scheduling_of(text, process), "spin");
        }
        assert_eq!(scheduling_of(text, "capture-0"), "fifo=2");
        assert_eq!(scheduling_of(text, "results"), "");
    }
}
