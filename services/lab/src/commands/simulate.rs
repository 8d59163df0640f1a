//! `parallax-lab simulate`: predicts the resources of a deployment from measured costs.

mod report;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use failure::Failure;
use failure::wording::Table;
use lab::forecast::{Costs, Forecast, Load, forecast};
use serde_json::json;
use terminal::output;

/// Costs of the machine in the guide, with the shipped network.
const DEFAULT: Costs = Costs {
    capture_ms: 3.0,
    pose_ms: 30.0,
    encode_ms: 4.0,
    decode_ms: 2.0,
    fuse_ms_per_view: 3.0,
    fuse_ms: 2.0,
    frame_bytes: 30_000.0,
    pose_bytes: 4_400.0,
    network_ms: 0.5,
};

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Predict the processor cores, network capacity and latency of cameras on several machines.
    Hosts(Arguments),
}

/// Options of `parallax-lab simulate hosts`.
#[derive(Debug, Args)]
#[command(after_help = "\
The result is a prediction, not a measurement. It is computed from the costs of one frame of one view.
Without --report, these are the costs of the machine in the guide. With --report, they come from a run of yours, which
should last at least a minute: the processor time of every stage and, with several hosts, the bytes and times of the link.
Options for single costs, such as --pose-ms, take precedence.

Examples:
    parallax run my.toml --json > run.json
    parallax-lab simulate hosts --report run.json --cameras 8,16 --cores 8
    parallax-lab simulate hosts --cameras 16 --hosts 1,2,3,4 --cores 16 --rate 30 --pose-ms 20")]
pub(crate) struct Arguments {
    /// Numbers of cameras to simulate, separated by commas.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "8,16,32,64", value_parser = clap::value_parser!(u16).range(1..=1024))]
    cameras: Vec<u16>,
    /// Numbers of hosts, separated by commas, including the fusing host.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,3,4", value_parser = clap::value_parser!(u16).range(1..=256))]
    hosts: Vec<u16>,
    /// Views of the fusing host. If not given, views are spread evenly by work.
    #[arg(long, value_name = "N")]
    near: Option<u16>,
    /// Number of processor cores of each host.
    #[arg(long, value_name = "N", default_value_t = 16.0)]
    cores: f64,
    /// Frames per second.
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    rate: f64,
    /// Capacity of the network, in megabits per second.
    #[arg(long, value_name = "MBIT", default_value_t = 1000.0)]
    network: f64,
    /// File with the costs of a run: the output of `parallax run --json`, on the fusing host if there are several hosts.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Processor time of `capture` for a frame of a view, in milliseconds.
    #[arg(long, value_name = "MS")]
    capture_ms: Option<f64>,
    /// Processor time of `pose` for a frame of a view, in milliseconds.
    #[arg(long, value_name = "MS")]
    pose_ms: Option<f64>,
    /// Processor time to encode a frame as JPEG, in milliseconds.
    #[arg(long, value_name = "MS")]
    encode_ms: Option<f64>,
    /// Processor time to decode a frame from JPEG, in milliseconds.
    #[arg(long, value_name = "MS")]
    decode_ms: Option<f64>,
    /// Processor time of fusion for each view of a frame, in milliseconds.
    #[arg(long, value_name = "MS")]
    fuse_ms: Option<f64>,
    /// Size of a frame as JPEG, in bytes.
    #[arg(long, value_name = "N")]
    frame_bytes: Option<f64>,
    /// Size of the poses of a view, in bytes.
    #[arg(long, value_name = "N")]
    pose_bytes: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs a command.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    let Command::Hosts(it) = command;
    let measured = it.report.as_deref().map(report::costs).transpose()?;
    let known = measured.unwrap_or(DEFAULT);
    let costs = Costs {
        capture_ms: it.capture_ms.unwrap_or(known.capture_ms),
        pose_ms: it.pose_ms.unwrap_or(known.pose_ms),
        encode_ms: it.encode_ms.unwrap_or(known.encode_ms),
        decode_ms: it.decode_ms.unwrap_or(known.decode_ms),
        fuse_ms_per_view: it.fuse_ms.unwrap_or(known.fuse_ms_per_view),
        frame_bytes: it.frame_bytes.unwrap_or(known.frame_bytes),
        pose_bytes: it.pose_bytes.unwrap_or(known.pose_bytes),
        ..known
    };
    let mut rows = Vec::new();
    for &n_cameras in &it.cameras {
        for &n_hosts in &it.hosts {
            for with_poses in [false, true] {
                if with_poses && n_hosts == 1 {
                    continue;
                }
                let load = Load {
                    n_cameras: usize::from(n_cameras),
                    n_hosts: usize::from(n_hosts),
                    n_cores: it.cores,
                    rate_hz: it.rate,
                    network_bytes_s: it.network * 1e6 / 8.0,
                    with_poses,
                    near: it.near.map(usize::from),
                };
                rows.push((load, forecast(&costs, &load)));
            }
        }
    }
    if it.json {
        let all = rows.iter().map(|(load, got)| json!({ "load": load, "forecast": got }));
        let all: Vec<_> = all.collect();
        output::json(&json!({ "schema_version": 1, "costs": costs, "rows": all }))?;
        return Ok(ExitCode::SUCCESS);
    }
    table(&rows)
}

/// Prints a row for each number of cameras and hosts.
fn table(rows: &[(Load, Forecast)]) -> Result<ExitCode, Failure> {
    let mut table = Table::new([
        "cameras",
        "hosts",
        "crosses",
        "views fusing",
        "other",
        "cores fusing",
        "other",
        "MB/s in",
        "latency ms",
        "<fits",
    ]);
    for (load, got) in rows {
        let crosses = match (load.n_hosts, load.with_poses) {
            (1, _) => "-",
            (_, true) => "poses",
            (_, false) => "frames",
        };
        table.row([
            load.n_cameras.to_string(),
            load.n_hosts.to_string(),
            crosses.to_owned(),
            got.views[0].to_string(),
            got.views[1].to_string(),
            format!("{:.1}", got.cores[0]),
            format!("{:.1}", got.cores[1]),
            format!("{:.2}", got.bytes_s[0] / 1e6),
            format!("{:.0}", got.latency_ms),
            if got.fits { "yes" } else { "no" }.to_owned(),
        ]);
    }
    output::line(table)?;
    Ok(ExitCode::SUCCESS)
}
