//! Parallax turns the pictures of calibrated, synchronised cameras into 3D human skeletons. This is the start page of the API.
//!
//! The executable parses the command line, then runs a command or one process of a deployment (`parallax service <name>`).
//! The book in `docs/` has the guide, the reference and the method. Its page `docs/architecture.md` explains where to make changes.
//! The table lists the crates by layer; each layer depends only on layers below it:
//!
//! | wing | crates |
//! |---|---|
//! | whole runs | [`launch`](../launch/index.html), [`trials`](../trials/index.html), [`view`](../view/index.html) |
//! | processes | [`bridge`](../bridge/index.html), [`capture`](../capture/index.html), [`steps`](../steps/index.html) (`pose`, `quality`, `fuse`, `triangulate`), [`results`](../results/index.html), [`record`](../record/index.html), [`supervise`](../supervise/index.html) |
//! | frame | [`stage`](../stage/index.html), [`wire`](../wire/index.html), [`runtime`](../runtime/index.html), [`client`](../parallax_client/index.html), [`pipeline`](../pipeline/index.html), [`posenetwork`](../posenetwork/index.html), [`inputs`](../inputs/index.html) |
//! | paper | [`fmp`](../fmp/index.html), [`gpu`](../gpu/index.html), [`multiview`](../multiview/index.html), [`viewquality`](../viewquality/index.html) |
//! | tools | [`geometry`](../geometry/index.html), [`calibration`](../calibration/index.html), [`footage`](../footage/index.html), [`scene`](../scene/index.html), [`messages`](../parallax_messages/index.html), [`recording`](../recording/index.html), [`runfiles`](../runfiles/index.html), [`exports`](../exports/index.html), [`motion`](../motion/index.html), [`people`](../people/index.html), [`keypoints`](../keypoints/index.html), [`inference`](../inference/index.html), [`deployment`](../deployment/index.html), [`failure`](../failure/index.html), [`terminal`](../terminal/index.html) |
//! | ground | [`skeleton`](../skeleton/index.html), [`kernels`](../kernels/index.html), [`formats`](../formats/index.html), [`files`](../files/index.html), [`statistics`](../statistics/index.html) |
//! | laboratory | [`lab`](../lab/index.html), [`training`](../training/index.html) |
//!
//! The crate `testkit`, in `tests/harness`, is for tests only.
//!
//! Start with [`pipeline`](../pipeline/index.html) for the path of a frame, [`multiview`](../multiview/index.html) for the
//! energy, or [`messages`](../parallax_messages/index.html) for the messages between processes.
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
