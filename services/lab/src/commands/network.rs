//! `parallax-lab model show` for a network that finds keypoints: its inputs and outputs, its card, and its keypoints in a picture.

mod detector;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _};
use inference::{Description, Port, written};
use inputs::cards::CardPlace;
use inputs::described::Described;
use inputs::network::{self, NetworkFile};
use inputs::pictures::{Frames, Picture, Pictures};
use keypoints::{Card, Codec, Fit, Input, joint_rows};
use posenetwork::{PoseNetwork, Turn, Workspace};
use serde_json::{Value, json};
use skeleton::PARSE14;
use terminal::{Outline, outline, output};

/// Options of `model show` for networks.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Card of a network (.onnx). If not given, the .toml file of the same name beside the network, or the network's entry `parallax.card`.
    #[arg(long, value_name = "CARD", conflicts_with = "html")]
    card: Option<PathBuf>,
    /// Picture to apply the network to. For a network that finds keypoints, the picture shows one person; for a detector, it may show
    /// several.
    #[arg(
        long,
        value_name = "PICTURE",
        requires = "out",
        conflicts_with = "html"
    )]
    image: Option<PathBuf>,
    /// Box around the person, in pixels of the picture: left, top, right, bottom. If not given, the whole picture.
    #[arg(long = "box", value_name = "X1,Y1,X2,Y2", value_parser = outline, requires = "image", allow_hyphen_values = true)]
    outline: Option<Outline>,
    /// Draw the joints and their maps, or the boxes of a detector, into this PNG file.
    #[arg(long, value_name = "FILE", requires = "image")]
    out: Option<PathBuf>,
}

impl Arguments {
    /// Returns true if any option is given.
    pub(crate) fn is_given(&self) -> bool {
        self.card.is_some() || self.image.is_some()
    }
}

/// Shows a network or a detector, depending on its card.
pub(crate) fn show(file: &Path, as_json: bool, arguments: &Arguments) -> Result<ExitCode, Failure> {
    match Described::open(file, arguments.card.as_deref())? {
        Described::Network(it) => show_network(file, it, as_json, arguments),
        Described::Detector(it) => detector::show(file, it, as_json, arguments),
    }
}

fn show_network(
    file: &Path,
    read: NetworkFile,
    as_json: bool,
    arguments: &Arguments,
) -> Result<ExitCode, Failure> {
    let description = read.description().clone();
    let card = read.card().cloned();
    let run_by = read.run_by().to_string();
    let fitted = card.is_some().then(|| read.fitted()).transpose();
    let found = match (&fitted, &arguments.image) {
        (Ok(Some(network)), Some(image)) => Some(look(network, image, arguments)?),
        _ => None,
    };
    if as_json {
        let mut value = json!({
            "schema_version": 1,
            "file": file,
            "inputs": ports(&description.inputs),
            "outputs": ports(&description.outputs),
            "run_by": run_by,
            "card": card.as_ref().map(|(card, place)| card_json(card, place)),
            "misfit": fitted.as_ref().err().map(ToString::to_string),
        });
        if card.is_none() {
            value["nearest_cards"] = json!(network::nearest(&description));
            value["nearest_detector_cards"] = json!(network::nearest_detectors(&description));
        }
        if let Some(found) = &found {
            value["keypoints"] = json!(found);
        }
        output::json(&value)?;
    } else {
        in_words(file, &description, card.as_ref())?;
        output::line(format_args!("  run by {run_by}"))?;
        if fitted.is_ok() && card.is_some() {
            output::line("  the network fits its card")?;
        }
        for it in found.iter().flatten() {
            output::line(format_args!(
                "  {:<20} ({:8.1}, {:8.1})  {:.2}",
                it["name"].as_str().unwrap_or_default(),
                it["x"].as_f64().unwrap_or_default(),
                it["y"].as_f64().unwrap_or_default(),
                it["score"].as_f64().unwrap_or_default()
            ))?;
        }
    }
    if let (Some(out), Some(_)) = (&arguments.out, &found) {
        output::message(format_args!("wrote {}", out.display()));
    }
    let fitted = fitted?;
    if fitted.is_none() && arguments.image.is_some() {
        let message = format!(
            "{}: a network without a card cannot be applied to a picture",
            file.display()
        );
        return Err(Failure::new(ExitKind::Input, message).with_hint("give a card with --card"));
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the keypoints that a network finds in a picture, and draws them.
fn look(network: &PoseNetwork, image: &Path, arguments: &Arguments) -> Result<Vec<Value>, Failure> {
    let picture = first_picture(image)?;
    let whole = [picture.size.width as f64, picture.size.height as f64];
    let whole = [0.0, 0.0, whole[0] - 1.0, whole[1] - 1.0];
    let outline = arguments.outline.map_or(whole, |outline| outline.0);
    let mut workspace = Workspace::default();
    let sight = network::look(network, &picture, (outline, Turn::Up), &mut workspace)?;
    if let Some(out) = &arguments.out {
        let sheet = network::sheet(&picture, &sight).or_fail(ExitKind::Input)?;
        sheet.save_png(out).or_fail(ExitKind::Input)?;
    }
    network::keypoints_json(&sight)
}

/// Reads a picture file, or the first picture of a file with several pictures.
fn first_picture(file: &Path) -> Result<Picture, Failure> {
    let one = Frames {
        every: 1,
        most: Some(1),
    };
    let picture = Pictures::open(file, one)?.next_picture()?;
    picture.ok_or_else(|| {
        Failure::new(
            ExitKind::Input,
            format!("{}: the file has no picture", file.display()),
        )
    })
}

fn ports(ports: &[Port]) -> Vec<Value> {
    let each = ports.iter();
    each.map(|port| {
        let sides: Vec<String> = port.sides.iter().map(ToString::to_string).collect();
        json!({ "name": port.name, "sides": sides })
    })
    .collect()
}

fn card_json(card: &Card, place: &CardPlace) -> Value {
    let rows = joint_rows(&card.names());
    let joints = PARSE14.joints.iter().zip(rows);
    let missing: Vec<&str> =
        joints.filter(|joint| joint.1.is_none()).map(|joint| joint.0.name).collect();
    json!({
        "from": place.to_string(),
        "name": card.name,
        "licence": card.licence,
        "weights": card.weights,
        "input": card.input,
        "crop": card.crop,
        "output": card.output,
        "keypoints": card.names(),
        "sides": card.keypoints.sides,
        "missing_joints": missing,
    })
}

fn in_words(
    file: &Path,
    description: &Description,
    card: Option<&(Card, CardPlace)>,
) -> Result<(), Failure> {
    output::line(format_args!("{}: a network", file.display()))?;
    ports_in_words(description)?;
    let Some((card, place)) = card else {
        return without_card(file, description);
    };
    output::line(format_args!("  card   {place}: {}", card.name))?;
    output::line(format_args!("  takes  {}", taken(card)))?;
    output::line(format_args!("  gives  {}", given(card)))?;
    let names = card.names();
    output::line(format_args!(
        "  {} keypoints: {}",
        names.len(),
        names.join(", ")
    ))?;
    joints_in_words(&names)?;
    for (what, text) in [("licence", &card.licence), ("weights", &card.weights)] {
        if !text.is_empty() {
            output::line(format_args!("  {what} {text}"))?;
        }
    }
    Ok(())
}

fn ports_in_words(description: &Description) -> Result<(), Failure> {
    for (what, ports) in [
        ("input", &description.inputs),
        ("output", &description.outputs),
    ] {
        for it in ports {
            let sides = match &it.sides[..] {
                [] => "of unknown shape".to_owned(),
                sides => written(sides),
            };
            output::line(format_args!("  {what:<6} `{}` {sides}", it.name))?;
        }
    }
    Ok(())
}

fn without_card(file: &Path, description: &Description) -> Result<(), Failure> {
    let mut entries = description.metadata.iter();
    if entries.any(|entry| entry.0 == viewquality::key::VERSION) {
        return output::line(
            "  the network predicts the errors of single views (`errors` in [paper] of a deployment) and does not find keypoints",
        );
    }
    output::line(
        "  no card: no card was given, and there is no card in the network file or beside it",
    )?;
    let networks = network::nearest(description);
    let detectors = network::nearest_detectors(description);
    if networks.is_empty() && detectors.is_empty() {
        output::line("  no card in configs/networks or configs/detectors is similar")?;
    }
    for (folder, of, nearest) in [
        ("networks", "networks that find keypoints", networks),
        ("detectors", "detectors of people", detectors),
    ] {
        let files: Vec<String> = nearest
            .iter()
            .map(|nearest| format!("configs/{folder}/{nearest}.toml"))
            .collect();
        let come = match &files[..] {
            [] => continue,
            [_] => "is the closest",
            _ => "are equally close",
        };
        output::line(format_args!(
            "  among the cards for {of}, {} {come} (judged by the shapes of inputs and outputs)",
            files.join(", ")
        ))?;
    }
    output::line(format_args!(
        "  copy a card to {}, change the differences (see docs/networks.md), and show the network again",
        file.with_extension("toml").display()
    ))
}

fn taken(card: &Card) -> String {
    let fit = match card.crop.fit {
        Fit::Widen => "widened to the shape of the input",
        Fit::Stretch => "stretched to the input",
    };
    let margin = card.crop.margin;
    format!(
        "{}; the box, enlarged by a factor of {margin}, {fit}",
        prepared(&card.input)
    )
}

fn prepared(input: &Input) -> String {
    format!(
        "{} wide, {} high, {}, {}, {}; (colour x {} - {:?}) / {:?}",
        input.width,
        input.height,
        word(&json!(input.colour)),
        word(&json!(input.layout)),
        word(&json!(input.numbers)),
        input.scale,
        input.mean,
        input.std,
    )
}

fn given(card: &Card) -> String {
    match &card.output {
        Codec::HeatMap {
            udp,
            centred,
            refine,
            score,
            further,
            ..
        } => format!(
            "a map for every keypoint and {further} further maps; centres of corner cells on centres of corner pixels (udp): {udp}; \
             cells centred on the pixels that they cover: {centred}; maxima refined: {}; values: {}",
            word(&json!(refine)),
            word(&json!(score))
        ),
        Codec::Simcc {
            x,
            y,
            bins_per_pixel,
            ..
        } => format!("`{x}` for columns, `{y}` for rows, {bins_per_pixel} bins per pixel"),
        Codec::Keypoints {
            fields,
            unit,
            score,
            ..
        } => {
            let fields = fields.iter().map(|field| json!(field));
            let fields: Vec<String> = fields.map(|field| word(&field).to_owned()).collect();
            format!(
                "a list of {}; unit: {}; scores: {}",
                fields.join(", "),
                word(&json!(unit)),
                word(&json!(score))
            )
        }
    }
}

/// Returns a value as it is spelled in a card.
fn word(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn joints_in_words(names: &[String]) -> Result<(), Failure> {
    let rows = joint_rows(names);
    let joints = PARSE14.joints.iter().zip(&rows);
    let missing = joints.clone().filter(|joint| joint.1.is_none());
    let missing: Vec<&str> = missing.map(|missing| missing.0.name).collect();
    let derived = joints.filter_map(|(joint, row)| match row.as_deref() {
        Some(several @ [_, _, ..]) => {
            let from: Vec<String> = several
                .iter()
                .map(|(keypoint, weight)| format!("{weight:+.2} {}", names[*keypoint]))
                .collect();
            Some(format!("{} = {}", joint.name, from.join(" ")))
        }
        _ => None,
    });
    let n = PARSE14.joints.len();
    output::line(format_args!("  joints {} of {n}", n - missing.len()))?;
    if !missing.is_empty() {
        output::line(format_args!("    missing: {}", missing.join(", ")))?;
    }
    for line in derived {
        output::line(format_args!("    {line}"))?;
    }
    Ok(())
}
