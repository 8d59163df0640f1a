//! `parallax-lab model show` for a detector of people.

use std::path::Path;
use std::process::ExitCode;

use failure::{ExitKind, Failure, OrFail as _};
use inference::Description;
use inputs::cards::CardPlace;
use inputs::detector::{self, DetectorFile};
use keypoints::{Boxes, DetectorCard, PersonBox};
use posenetwork::Detector;
use serde_json::{Value, json};
use terminal::output;

use super::{Arguments, first_picture, ports, ports_in_words, prepared};

/// Shows a detector.
pub(super) fn show(
    file: &Path,
    read: DetectorFile,
    as_json: bool,
    arguments: &Arguments,
) -> Result<ExitCode, Failure> {
    if arguments.outline.is_some() {
        let message = format!(
            "{}: --box is for networks that find keypoints; a detector uses the whole picture",
            file.display()
        );
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let description = read.description().clone();
    let card = read.card().cloned();
    let fitted = read.fitted();
    let found = match (&fitted, &arguments.image) {
        (Ok(detector), Some(image)) => Some(look(detector, image, arguments.out.as_deref())?),
        _ => None,
    };
    if as_json {
        let mut value = json!({
            "schema_version": 1,
            "file": file,
            "inputs": ports(&description.inputs),
            "outputs": ports(&description.outputs),
            "detector_card": card.as_ref().map(|(card, place)| card_json(card, place)),
            "misfit": fitted.as_ref().err().map(ToString::to_string),
        });
        if let Some(found) = &found {
            let each = found.iter();
            let boxes = each.map(|person| json!({ "box": person.outline, "score": person.score }));
            value["boxes"] = boxes.collect();
        }
        output::json(&value)?;
    } else {
        in_words(file, &description, card.as_ref())?;
        if fitted.is_ok() {
            output::line("  the detector fits its card")?;
        }
        if let (Some(found), Some((card, _))) = (&found, &card) {
            boxes_in_words(found, card)?;
        }
    }
    if let (Some(out), Some(_)) = (&arguments.out, &found) {
        output::message(format_args!("wrote {}", out.display()));
    }
    fitted.map(|_| ExitCode::SUCCESS)
}

/// Returns the boxes that a detector finds in a picture, and draws them.
fn look(detector: &Detector, image: &Path, out: Option<&Path>) -> Result<Vec<PersonBox>, Failure> {
    let picture = first_picture(image)?;
    let found = detector::people(detector, &picture, &mut Vec::new())?;
    if let Some(out) = out {
        let drawn = detector::drawn(&picture, &found);
        drawn.save_png(out).or_fail(ExitKind::Input)?;
    }
    Ok(found)
}

fn card_json(card: &DetectorCard, place: &CardPlace) -> Value {
    json!({
        "from": place.to_string(),
        "name": card.name,
        "licence": card.licence,
        "weights": card.weights,
        "input": card.input,
        "fill": card.fill,
        "output": card.output,
        "least_score": card.least_score,
        "most_overlap": card.most_overlap,
    })
}

fn in_words(
    file: &Path,
    description: &Description,
    card: Option<&(DetectorCard, CardPlace)>,
) -> Result<(), Failure> {
    output::line(format_args!("{}: a detector of people", file.display()))?;
    ports_in_words(description)?;
    let Some((card, place)) = card else {
        return Ok(());
    };
    output::line(format_args!("  card   {place}: {}", card.name))?;
    output::line(format_args!(
        "  takes  {}; the whole picture, its aspect ratio kept, placed at the top-left corner; the rest is filled with {}",
        prepared(&card.input),
        card.fill
    ))?;
    output::line(format_args!("  gives  {}", given(card)))?;
    output::line(format_args!(
        "  keeps  boxes with a score of at least {}; of two boxes that share more than {} of their union, only the better one",
        card.least_score, card.most_overlap
    ))?;
    for (what, text) in [("licence", &card.licence), ("weights", &card.weights)] {
        if !text.is_empty() {
            output::line(format_args!("  {what} {text}"))?;
        }
    }
    Ok(())
}

fn given(card: &DetectorCard) -> String {
    match &card.output {
        Boxes::Yolox {
            strides,
            person,
            decoded,
            ..
        } => {
            let cells = card.n_cells(strides);
            let unit = if *decoded { "pixels" } else { "cells" };
            format!(
                "{cells} boxes of grids with strides {strides:?}, in {unit}; people are class {person}"
            )
        }
        Boxes::Centres { stride, .. } => format!(
            "a box for each cell of {stride} pixels with a higher score than its neighbours"
        ),
        Boxes::List { boxes } => format!("`{boxes}`, a list of boxes of people with scores"),
    }
}

fn boxes_in_words(found: &[PersonBox], card: &DetectorCard) -> Result<(), Failure> {
    if found.is_empty() {
        output::line(format_args!(
            "  finds nobody: no box has a score of {} or more",
            card.least_score
        ))?;
    }
    for it in found {
        let [left, top, right, bottom] = it.outline;
        output::line(format_args!(
            "  box ({left:7.1}, {top:7.1}) to ({right:7.1}, {bottom:7.1})  {:.2}",
            it.score
        ))?;
    }
    Ok(())
}
