//! The command line: commands, global options and help texts.

use clap::{Parser, Subcommand};

use crate::commands::{
    bench, calib, calibrate, cameras, chaos, config, demo, deployments, detect, doctor, export,
    hosts, messages, new, publish, record, replay, run, service, smooth, sync, top, view,
};
use terminal::{EXIT_CODES, Globals, completions};

const LONG_ABOUT: &str = "\
Computes 3D human skeletons from calibrated, synchronised cameras.

A deployment file describes a run in about ten lines: the cameras, their calibration, an output folder.
A run has one process per stage and camera. `parallax run` starts and watches all of them:

    capture -> pose -> (quality) -> fuse -> triangulate -> results

Training, evaluation and synthetic sequences are in `parallax-lab`.";

const EXAMPLES: &str = "\
Examples:
    parallax doctor                                     check this machine
    parallax demo                                       run four synthetic cameras, and write a report
    parallax run my.toml                                run a deployment: from its cameras to 3D
    parallax run my.toml --set capture.n_frames=20      run it with one value replaced
    parallax run my.toml --dry-run                      show the processes and their memory, but start nothing
    parallax run my.toml --latency-budget-ms 150        fail if more than 1 frame in 100 takes longer
    parallax demo --view                                run the demo, and watch it in the browser
    parallax view my.toml                               watch a running deployment in the browser
    parallax publish my.toml udp://127.0.0.1:9000       send its skeletons as datagrams to another program
    parallax top                                        watch the times of a running deployment
    parallax record my.toml --out run.mcap              run a deployment, and record every message
    parallax replay run.mcap --from fuse --set paper.alpha=2     run the later stages again, with another value
    parallax export out/my --to c3d,glb,bvh             export a run to the formats of other tools
    parallax chaos                                      inject faults into a deployment, and check limits
    parallax bench transport                            measure the time of a message between processes
    parallax config show my.toml                        print every setting and its origin
    parallax config schema > parallax.schema.json       get completion and checks in an editor
    parallax detect photo.jpg --model parse.mat --json  find people in single images
    parallax smooth out/run                             smooth the trajectories of a run, and compute joint angles
    parallax cameras view /dev/video0 --out shot.png    take a picture with a live camera
    parallax sync estimate my.toml --write              find the clock offsets of recorded cameras
    parallax calibrate people my.toml --height-m 1.78 --out rig.toml   make a rig from a person walking about
    parallax calibrate board --board charuco:7x5:40mm a.mp4 b.mp4 --out rig.toml    make a rig from a board
    parallax calib show Calib.toml                      print the content of a calibration file
";

/// Computes 3D human skeletons from calibrated cameras.
#[derive(Debug, Parser)]
#[command(
    name = "parallax",
    version = env!("PARALLAX_VERSION"),
    about,
    long_about = LONG_ABOUT,
    after_help = EXIT_CODES,
    after_long_help = format!("{EXAMPLES}\n{EXIT_CODES}"),
    propagate_version = true,
    max_term_width = 100
)]
pub(crate) struct Cli {
    /// Global options, accepted by all commands.
    #[command(flatten)]
    pub globals: Globals,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The command.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a demo with four synthetic cameras, kill one of its processes, and write a report.
    Demo(demo::Arguments),
    /// Run a deployment: start all its processes, from footage to 3D.
    Run(run::Arguments),
    /// Run a deployment, and record every message in one file.
    Record(record::Arguments),
    /// Run the later stages of a recorded run again.
    Replay(replay::Arguments),
    /// Export a finished run or a recording to the formats of other tools.
    Export(export::Arguments),
    /// Inject faults into a deployment (kill and stop processes, disturb cameras), and check that it stays within limits.
    Chaos(chaos::Arguments),
    /// Measure the speed of messages between processes, and of whole deployments.
    #[command(subcommand)]
    Bench(bench::Command),
    /// Find people in single images.
    Detect(detect::Arguments),
    /// Create a deployment from footage, step by step.
    New(Box<new::Arguments>),
    /// Read, show, check and convert calibrations.
    #[command(subcommand)]
    Calib(calib::Command),
    /// Find the positions and orientations of cameras from their footage.
    #[command(subcommand)]
    Calibrate(calibrate::Command),
    /// List the video devices of this machine, or take a picture with a live camera.
    Cameras(cameras::Arguments),
    /// Smooth the trajectories of a finished run, and compute joint angles.
    Smooth(Box<smooth::Arguments>),
    /// Find the clock offsets between the cameras of recorded footage.
    #[command(subcommand)]
    Sync(sync::Command),
    /// Show and check deployment files.
    #[command(subcommand)]
    Config(config::Command),
    /// Send the skeletons of a running deployment as datagrams: JSON lines or OSC.
    Publish(publish::Arguments),
    /// Print the layout of messages, for programs in other languages.
    Messages(messages::Arguments),
    /// Show the state of a deployment that runs on several machines, or create its keys.
    #[command(subcommand)]
    Hosts(hosts::Command),
    /// List running deployments and the shared memory left by dead deployments, or show the processes of one deployment.
    Status(deployments::StatusArguments),
    /// Watch the processes of a running deployment: rates, times, lost messages, memory.
    Top(top::Arguments),
    /// Watch a running deployment, a finished run or a recording in the browser: skeleton, pictures, processes.
    View(view::Arguments),
    /// Remove the shared memory that dead deployments left behind.
    Clean(deployments::CleanArguments),
    /// Check that this machine has everything that Parallax needs, and explain how to fix each problem.
    Doctor(doctor::Arguments),
    /// Print the completion script for a shell.
    Completions(completions::Arguments),
    /// Write the manual pages, one per command.
    Man(completions::ManArguments),
    /// Run one process of a deployment. `run` starts these processes.
    #[command(hide = true)]
    Service(service::Arguments),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_has_a_manual_page_and_every_shell_has_a_completion_script() {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Cli::command();
        command.build();
        completions::write_pages(command, folder.path()).unwrap();
        for (page, word) in [
            ("parallax.1", "parallax\\-run(1)"),
            ("parallax-run.1", "dry\\-run"),
            ("parallax-calibrate-board.1", "charuco"),
        ] {
            let text = std::fs::read_to_string(folder.path().join(page)).unwrap();
            assert!(text.contains(word), "{page} lacks {word}");
        }
        assert!(!folder.path().join("parallax-service.1").exists());
        for shell in [
            clap_complete::Shell::Bash,
            clap_complete::Shell::Zsh,
            clap_complete::Shell::Fish,
        ] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "parallax", &mut script);
            let script = String::from_utf8(script).unwrap();
            assert!(script.contains("dry-run"), "{shell}");
        }
    }
}
