//! `parallax doctor`: checks that this machine has everything that Parallax needs, and advises on missing parts.

use std::process::{Command, ExitCode};

use clap::Args;
use failure::{ExitKind, Failure};
use kernels::Isa;
use runtime::{Namespace, VideoDevice, deployments, free_shared_memory, own_cores};
use rustix::process::{Resource, getrlimit};
use serde_json::json;
use terminal::output;

/// Recommended shared memory, in bytes: twice as much as four cameras of 640x480 pixels need with the shipped network.
const SHARED_MEMORY: u64 = 512 << 20;
/// Recommended limit on open files. No process of a deployment with eight cameras has more files open.
const OPEN_FILES: u64 = 1024;
/// Recommended stack size of the main thread, in bytes.
const STACK: u64 = 1 << 20;

/// Options of `parallax doctor`.
#[derive(Debug, Args)]
#[command(after_help = "\
The exit code is 0 if nothing is missing that Parallax needs, otherwise 3. Optional items do not affect the exit code.

Examples:
    parallax doctor
    parallax doctor --json")]
pub(crate) struct Arguments {
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
}

/// Importance of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Good,
    Note,
    Missing,
}

impl State {
    fn name(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Note => "note",
            Self::Missing => "MISSING",
        }
    }
}

/// Result of one check.
#[derive(Debug)]
struct Finding {
    what: &'static str,
    state: State,
    found: String,
    advice: Option<String>,
}

impl Finding {
    fn good(what: &'static str, found: impl Into<String>) -> Self {
        let found = found.into();
        Self {
            what,
            state: State::Good,
            found,
            advice: None,
        }
    }

    fn but(self, state: State, advice: impl Into<String>) -> Self {
        let advice = Some(advice.into());
        Self {
            state,
            advice,
            ..self
        }
    }
}

/// Checks the machine, and prints the findings.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut findings = vec![
        Finding::good("version", env!("PARALLAX_VERSION")),
        processor(),
        program("ffmpeg", State::Missing),
        program("ffprobe", State::Missing),
        shared_memory(),
        limit("open files", Resource::Nofile, OPEN_FILES, "ulimit -n 4096"),
        limit("stack", Resource::Stack, STACK, "ulimit -s 8192"),
    ];
    findings.extend(cameras());
    findings.extend(adapters());
    findings.push(remains());
    if arguments.json {
        let all = findings.iter().map(|finding| {
            json!({ "what": finding.what, "state": finding.state.name(), "found": finding.found, "advice": finding.advice })
        });
        output::json(&json!({ "schema_version": 1, "findings": all.collect::<Vec<_>>() }))?;
    } else {
        for finding in &findings {
            let (state, what) = (finding.state.name(), finding.what);
            output::line(format_args!("{state:<8} {what:<14} {}", finding.found))?;
            if let Some(advice) = &finding.advice {
                output::line(format_args!("{:<23} -> {advice}", ""))?;
            }
        }
    }
    let is_missing = findings.iter().any(|finding| finding.state == State::Missing);
    Ok(ExitCode::from(if is_missing {
        ExitKind::Config.status()
    } else {
        0
    }))
}

fn processor() -> Finding {
    let cores = own_cores().map_or(0, |cores| cores.len());
    let isa = Isa::best().name();
    let found = Finding::good("processor", format!("{cores} cores, {isa}"));
    if isa == "portable" {
        let advice = "without AVX2, Parallax is several times slower";
        return found.but(State::Note, advice);
    }
    if cores < 2 {
        return found.but(
            State::Note,
            "one core is enough for one or two cameras at a few frames per second",
        );
    }
    found
}

/// Checks that a program can be run.
///
/// * `without`: state to report if the program is missing.
fn program(name: &'static str, without: State) -> Finding {
    let run = Command::new(name).arg("-version").output();
    match run {
        Ok(output) if output.status.success() => {
            let text = String::from_utf8_lossy(&output.stdout);
            let first = text.lines().next().unwrap_or_default();
            let words = first.split(" Copyright").next();
            Finding::good(name, words.unwrap_or_default())
        }
        Ok(output) => Finding::good(name, format!("fails with {}", output.status))
            .but(without, "reinstall ffmpeg (on Debian, the package `ffmpeg`)"),
        Err(error) => Finding::good(name, format!("cannot be run: {error}")).but(
            without,
            "needed for videos and live cameras, but not for folders of pictures: `apt install ffmpeg`",
        ),
    }
}

fn shared_memory() -> Finding {
    let what = "/dev/shm";
    match free_shared_memory() {
        Ok(bytes) => {
            let found = Finding::good(what, format!("{} MB free", bytes / 1_000_000));
            if bytes >= SHARED_MEMORY {
                return found;
            }
            let advice = "four cameras need 100 to 500 MB (`parallax run FILE --dry-run` shows how much): run \
                          `mount -o remount,size=1g /dev/shm`, or in Docker pass --shm-size=1g";
            found.but(State::Note, advice)
        }
        Err(error) => Finding::good(what, error.to_string()).but(
            State::Missing,
            "processes exchange frames in /dev/shm: mount a tmpfs there",
        ),
    }
}

fn limit(what: &'static str, resource: Resource, needed: u64, advice: &str) -> Finding {
    match getrlimit(resource).current {
        None => Finding::good(what, "no limit"),
        Some(limit) if limit >= needed => Finding::good(what, format!("limit {limit}")),
        Some(limit) => Finding::good(what, format!("limit {limit}, but {needed} are needed"))
            .but(State::Missing, format!("raise the limit: `{advice}`")),
    }
}

fn cameras() -> Vec<Finding> {
    let what = "video devices";
    let devices = match runtime::video_devices() {
        Ok(devices) => devices,
        Err(error) => return vec![Finding::good(what, error.to_string())],
    };
    if devices.is_empty() {
        return vec![Finding::good(what, "none")];
    }
    let looked = devices.iter().map(|path| match VideoDevice::open(path) {
        Ok(_) => Finding::good(what, path.display().to_string()),
        Err(error) => Finding::good(what, format!("{}: {error}", path.display())).but(
            State::Note,
            "`parallax cameras` shows the reason; often the user must be a member of the group `video`",
        ),
    });
    looked.collect()
}

/// Returns a finding per graphics card, best card first.
fn adapters() -> Vec<Finding> {
    let what = "GPU";
    if !gpu::IS_BUILT {
        return vec![Finding::good(
            what,
            "not used: this build has no GPU support",
        )];
    }
    let all = gpu::adapters();
    if all.is_empty() {
        let advice = "to use a graphics card, install its driver and Vulkan (Debian's package is `libvulkan1`)";
        return vec![Finding::good(what, "no Vulkan adapter").but(State::Note, advice)];
    }
    let found = |adapter: &gpu::Adapter| {
        let found = Finding::good(what, adapter.to_string());
        if adapter.kind == gpu::Kind::Software {
            return found.but(
                State::Note,
                "software rendering on the processor, for tests only",
            );
        }
        found
    };
    all.iter().map(found).collect()
}

fn remains() -> Finding {
    let what = "deployments";
    let all = match deployments(&Namespace::usual_base()) {
        Ok(all) => all,
        Err(error) => return Finding::good(what, error.to_string()),
    };
    let running = all.iter().filter(|deployment| deployment.supervisor.is_some()).count();
    let dead = all.len() - running;
    let found = Finding::good(
        what,
        format!("{running} running, {dead} left by dead processes"),
    );
    if dead > 0 {
        return found.but(
            State::Note,
            "`parallax clean` removes the leftovers of dead deployments",
        );
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_and_a_low_limit_are_reported_with_advice() {
        let finding = program("parallax-no-such-program", State::Missing);
        assert_eq!(finding.state, State::Missing);
        assert!(finding.advice.is_some());
        let finding = limit("open files", Resource::Nofile, u64::MAX, "ulimit -n 4096");
        let is_limited = getrlimit(Resource::Nofile).current.is_some();
        assert_eq!(finding.state == State::Missing, is_limited);
    }
}
