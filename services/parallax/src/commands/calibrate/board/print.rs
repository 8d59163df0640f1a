//! `--print`: draws a board as PDF or SVG.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calibration::boards::{Board, Drawing, Paper, pdf, svg};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use terminal::output;

/// Writes the board.
pub(super) fn run(board: &Board, paper: Paper, out: Option<&Path>) -> Result<ExitCode, Failure> {
    let drawing = Drawing::new(board, paper).or_fail(ExitKind::Usage)?;
    let [width, height] = drawing.page;
    let mut page = format!("{width:.0} x {height:.0} mm");
    if let Some(name) = drawing.paper() {
        page = format!("{} ({page})", name.to_uppercase());
    }
    let files = if let Some(file) = out {
        vec![file.to_path_buf()]
    } else {
        let name = board.to_string().replace([':', '='], "-");
        ["pdf", "svg"].map(|ending| PathBuf::from(format!("{name}.{ending}"))).to_vec()
    };
    for file in files {
        let ending = file.extension().unwrap_or_default().to_ascii_lowercase();
        let bytes = match ending.to_str() {
            Some("pdf") => pdf(&drawing),
            Some("svg") => svg(&drawing).into_bytes(),
            _ => {
                return Err(Failure::new(
                    ExitKind::Usage,
                    format!(
                        "{}: a board can only be written as .pdf or .svg",
                        file.display()
                    ),
                ));
            }
        };
        files::replace(&file, &bytes).map_err(|error| in_file(&file, &error))?;
        output::message(format_args!(
            "wrote {}: {board} on {page}; print at 100 %, and check the printed ruler",
            file.display()
        ));
    }
    if paper == Paper::Fitting {
        output::message(
            "this is the smallest page that holds the board; use smaller squares for a smaller page, or --paper for another page (a4, letter, 300x400mm)",
        );
    }
    Ok(ExitCode::SUCCESS)
}
