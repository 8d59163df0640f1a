//! What the system does not grant the processes of a deployment: said once, and then gone without.

use runtime::{Denied, Scheduling};
use supervise::ProcessSpec;

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

    use runtime::RealTime;
    use supervise::Role;

    use super::*;

    fn spec(name: &str, scheduling: &str) -> ProcessSpec {
        ProcessSpec {
            name: name.to_owned(),
            service: name.to_owned(),
            args: Vec::new(),
            role: Role::Optional,
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
}
