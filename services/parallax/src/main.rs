//! Parallax: calibrated, synchronised cameras in, 3D human skeletons out. This is the start page of the API.
//!
//! The executable parses the command line, and runs a command or a process of a deployment (`parallax service <name>`).
//! `docs/` is the book: guide, reference, the method, and `docs/architecture.md`, which explains where to make changes.
//! The crates, by layer (dependencies go downwards):
//!
//! | layer | crates |
//! |---|---|
//! | trials | [`trials`](../trials/index.html): fault injection, benchmarks and the demo; [`view`](../view/index.html): the page in the browser |
//! | whole runs | [`launch`](../launch/index.html): prepares and runs a deployment, and reports on it |
//! | processes | [`bridge`](../bridge/index.html), [`capture`](../capture/index.html), [`pose`](../pose/index.html), [`quality`](../quality/index.html), [`fuse`](../fuse/index.html), [`triangulate`](../triangulate/index.html), [`results`](../results/index.html), [`record`](../record/index.html), [`replay`](../replay/index.html), [`supervise`](../supervise/index.html), [`publish`](../publish/index.html) |
//! | the loop of a stage | [`stage`](../stage/index.html): wait, receive, check, join, compute, send, account, end |
//! | at the wire | [`wire`](../wire/index.html): messages to domain types and back, checked |
//! | the deployment | [`deployment`](../deployment/index.html): keys, defaults, rules, processes |
//! | pages | [`report`](../report/index.html) |
//! | offline | [`offline`](../offline/index.html): work from files to files; [`training`](../training/index.html), [`networktraining`](../networktraining/index.html), [`sequences`](../sequences/index.html), [`experiment`](../experiment/index.html): training and evaluation |
//! | composition | [`pipeline`](../pipeline/index.html): all steps in one process; [`evaluation`](../evaluation/index.html), [`datasets`](../datasets/index.html), [`consistency`](../consistency/index.html) |
//! | method | [`orientation`](../orientation/index.html): which way a person faces; [`multiview`](../multiview/index.html), [`viewquality`](../viewquality/index.html), [`posenetwork`](../posenetwork/index.html), [`calibration`](../calibration/index.html), [`fmp`](../fmp/index.html): the paper |
//! | transport | [`runtime`](../runtime/index.html), [`join`](../join/index.html); [`client`](../client/index.html): the door for other programs |
//! | tools | [`body`](../body/index.html), [`boards`](../boards/index.html), [`geometry`](../geometry/index.html), [`footage`](../footage/index.html), [`scene`](../scene/index.html), [`hosts`](../hosts/index.html), [`messages`](../messages/index.html), [`metrics`](../metrics/index.html), [`recording`](../recording/index.html), [`runfiles`](../runfiles/index.html), [`trc`](../trc/index.html), [`exports`](../exports/index.html), [`motion`](../motion/index.html), [`mat5`](../mat5/index.html), [`c3d`](../c3d/index.html), [`keypoints`](../keypoints/index.html), [`keypointfiles`](../keypointfiles/index.html), [`synchronisation`](../synchronisation/index.html), [`inference`](../inference/index.html) |
//! | ground | [`skeleton`](../skeleton/index.html), [`wording`](../wording/index.html), [`statistics`](../statistics/index.html), [`checksum`](../checksum/index.html), [`causes`](../causes/index.html), [`files`](../files/index.html), [`kernels`](../kernels/index.html), [`onnx`](../onnx/index.html); for tests only: [`testkit`](../testkit/index.html) |
//!
//! Start with [`pipeline`](../pipeline/index.html) for the path of a frame, [`multiview`](../multiview/index.html) for the
//! energy, [`messages`](../messages/index.html) for the messages between processes.
#![forbid(unsafe_code)]

mod cli;
mod commands;
mod describe;
mod stage;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    if let Err(error) = failure::guard_process() {
        return failure::Failure::new(failure::ExitKind::Run, error).exit();
    }
    let cli = cli::Cli::parse();
    failure::run_command(|| commands::run(cli))
}
