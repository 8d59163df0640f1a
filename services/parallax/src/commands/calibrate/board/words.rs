//! Prints the result of a calibration from a board, as a table or as JSON.

use calibration::board::CameraOutcome;
use failure::Failure;
use failure::wording::Table;
use rigs::boards::Calibrated;
use serde_json::{Map, Value, json};
use terminal::output;

use super::Arguments;

/// Prints the table.
pub(super) fn table(calibrated: &Calibrated) -> Result<(), Failure> {
    for note in &calibrated.notes {
        output::line(format_args!("note: {note}"))?;
    }
    let outcome = &calibrated.outcome;
    let mut table = Table::new([
        "<camera",
        "pictures",
        "boards",
        "used",
        "corners",
        "left out",
        "rms, px",
        "covered",
        "focal, px",
        "+-",
    ]);
    for (nth, camera) in outcome.cameras.iter().enumerate() {
        let wrong = camera.residuals.iter().filter(|corner| corner.is_wrong);
        let wrong = wrong.count();
        table.row([
            calibrated.task.names[nth].clone(),
            pictures(calibrated, nth).map_or("-".to_owned(), |n| n.to_string()),
            camera.n_boards[0].to_string(),
            camera.n_boards[1].to_string(),
            (camera.residuals.len() - wrong).to_string(),
            wrong.to_string(),
            format!("{:.3}", camera.rms_px),
            format!("{:.0} %", 100.0 * camera.coverage),
            format!("{:.1}", camera.camera.intrinsics.fx),
            focal_sd(camera).map_or("given".to_owned(), |sd| format!("{sd:.2}")),
        ]);
    }
    output::line(table)?;
    for it in &outcome.pairs {
        let [a, b] = it.cameras.map(|nth| &calibrated.task.names[nth]);
        output::line(format_args!(
            "{:<29} seen together in {:>5} frames, {} of them agree, cameras {:.4} m apart",
            format!("{a} - {b}"),
            it.n,
            it.n_agree,
            distance(calibrated, it.cameras)
        ))?;
    }
    Ok(())
}

fn pictures(calibrated: &Calibrated, camera: usize) -> Option<usize> {
    calibrated.looked.as_ref().map(|looked| looked.cameras[camera].n_pictures)
}

fn focal_sd(camera: &CameraOutcome) -> Option<f64> {
    let focal = camera.numbers.iter().find(|number| number.name == "focal length");
    focal.map(|focal| focal.sd)
}

fn distance(calibrated: &Calibrated, [a, b]: [usize; 2]) -> f64 {
    let centre = |nth: usize| calibrated.outcome.cameras[nth].camera.centre_in_world();
    (centre(a) - centre(b)).norm()
}

/// Returns the result as one JSON object.
pub(super) fn json(calibrated: &Calibrated) -> Value {
    let doubts = calibrated.doubts();
    let finite = |value: f64| value.is_finite().then_some(value);
    let cameras = calibrated.outcome.cameras.iter().enumerate().map(|(nth, camera)| {
        let wrong = camera.residuals.iter().filter(|residual| residual.is_wrong).count();
        let number = |known: &calibration::board::Known| {
            let value = json!({ "value": finite(known.value), "sd": finite(known.sd) });
            (known.name.clone(), value)
        };
        let numbers: Map<String, Value> = camera.numbers.iter().map(number).collect();
        json!({
            "name": calibrated.task.names[nth],
            "size_px": camera.camera.intrinsics.size,
            "pictures": pictures(calibrated, nth),
            "boards": camera.n_boards[0],
            "boards_used": camera.n_boards[1],
            "corners": camera.residuals.len() - wrong,
            "left_out": wrong,
            "rms_px": finite(camera.rms_px),
            "rms_of_all_px": finite(camera.rms_of_all_px),
            "coverage": camera.coverage,
            "numbers": numbers,
        })
    });
    let pairs = calibrated.outcome.pairs.iter().map(|pair| {
        json!({
            "cameras": pair.cameras.map(|nth| &calibrated.task.names[nth]),
            "together": pair.n,
            "agree": pair.n_agree,
            "distance_m": finite(distance(calibrated, pair.cameras)),
        })
    });
    json!({
        "schema_version": 1,
        "is_trusted": doubts.is_empty(),
        "doubts": doubts,
        "notes": calibrated.notes,
        "board": calibrated.board.to_string(),
        "sigma_px": finite(calibrated.outcome.sigma_px),
        "cameras": cameras.collect::<Vec<_>>(),
        "pairs": pairs.collect::<Vec<_>>(),
    })
}

/// Returns facts about the command for the report.
pub(super) fn about(arguments: &Arguments, calibrated: &Calibrated) -> Vec<(String, String)> {
    let mut about = vec![
        ("board".to_owned(), calibrated.board.to_string()),
        ("footage".to_owned(), arguments.footage.join(", ")),
    ];
    if let Some(corners) = &arguments.corners {
        about.push(("corners of".to_owned(), corners.display().to_string()));
    }
    if let Some(known) = &arguments.known {
        about.push((
            "intrinsics kept for".to_owned(),
            known.display().to_string(),
        ));
    }
    about.extend(calibrated.notes.iter().map(|note| ("note".to_owned(), note.clone())));
    about
}
