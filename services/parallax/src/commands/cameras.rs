//! `parallax cameras`: lists the video devices of this machine, and takes pictures with live cameras.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use capture::{LiveCamera, take_picture};
use clap::{Args, Subcommand};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use footage::{Canvas, LiveAddress};
use launch::load;
use runtime::{
    VideoAbout, VideoControl, VideoDevice, VideoError, VideoFormat, VideoMode, video_devices,
};
use serde_json::{Value, json};
use terminal::output;

/// Options of `parallax cameras`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Take a picture with a live camera.
    View(ViewArguments),
}

/// Options of `parallax cameras view`.
#[derive(Debug, Args)]
struct ViewArguments {
    /// The camera: a source such as `/dev/video0` or `rtsp://...`, or its name in the deployment of --deployment.
    camera: String,
    /// Deployment file that describes the camera: format, size, rate and controls.
    #[arg(long, value_name = "FILE")]
    deployment: Option<PathBuf>,
    /// The PNG file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Number of pictures to skip first, so that the exposure can settle.
    #[arg(long, value_name = "N", default_value_t = 5)]
    skip: usize,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        Some(Command::View(it)) => view(it),
        None => list(arguments.json),
    }
}

fn view(arguments: &ViewArguments) -> Result<ExitCode, Failure> {
    let camera = wanted(arguments)?;
    let (size, rgb) = take_picture(&camera, arguments.skip).or_fail(ExitKind::Input)?;
    let saved = Canvas::from_rgb(size, &rgb).save_png(&arguments.out);
    saved.map_err(|error| in_file(&arguments.out, &error))?;
    output::line(format!(
        "{}: {size}, {}",
        camera.address,
        arguments.out.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the camera that the arguments name.
fn wanted(arguments: &ViewArguments) -> Result<LiveCamera, Failure> {
    let name = &arguments.camera;
    let Some(file) = &arguments.deployment else {
        let address = LiveAddress::parse(name).ok_or_else(|| {
            let message = format!("{name:?} is not a live camera");
            Failure::new(ExitKind::Usage, message).with_hint(
                "a live camera is /dev/video0, rtsp://..., udp://... or http://...; to name a camera of a deployment, \
                 also pass --deployment my.toml",
            )
        })?;
        return Ok(LiveCamera::new(address));
    };
    let deployment = load::read(file, &[])?.deployment;
    let entry = deployment.cameras.iter().find(|camera| camera.name == *name);
    let live = entry.and_then(launch::cameras::live_camera);
    live.ok_or_else(|| {
        let live = deployment
            .cameras
            .iter()
            .filter(|camera| launch::cameras::is_live(&camera.source));
        let names: Vec<&str> = live.map(|camera| camera.name.as_str()).collect();
        let message = format!("{} has no live camera {name:?}", file.display());
        let hint = if names.is_empty() {
            "the deployment has no live cameras".to_owned()
        } else {
            format!("the live cameras are {}", names.join(", "))
        };
        Failure::new(ExitKind::Usage, message).with_hint(hint)
    })
}

/// A video device with its formats and controls.
struct Found {
    path: PathBuf,
    stable: Vec<PathBuf>,
    about: VideoAbout,
    formats: Vec<VideoFormat>,
    controls: Vec<VideoControl>,
    mode: VideoMode,
}

fn list(as_json: bool) -> Result<ExitCode, Failure> {
    let paths = video_devices().or_fail(ExitKind::Input)?;
    let (mut found, mut others) = (Vec::new(), Vec::new());
    for path in &paths {
        match look(path) {
            Ok(it) => found.push(it),
            Err(error) => others.push((path, failure::wording::in_one_line(&error))),
        }
    }
    if as_json {
        let cameras: Vec<Value> = found.iter().map(described).collect();
        let others: Vec<Value> =
            others.iter().map(|(path, why)| json!({ "path": path, "why": why })).collect();
        output::json(&json!({ "schema_version": 1, "cameras": cameras, "not_usable": others }))?;
        return Ok(ExitCode::SUCCESS);
    }
    if found.is_empty() {
        output::line(
            "there are no video devices (/dev/video*): plug in a camera; in a container, pass its device in. Network cameras are not \
             listed: `parallax cameras view rtsp://... --out shot.png` takes a picture with one",
        )?;
    }
    for it in &found {
        output::line(text(it))?;
    }
    for (path, why) in others {
        output::line(format!("{}: cannot be used: {why}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn look(path: &Path) -> Result<Found, VideoError> {
    let device = VideoDevice::open(path)?;
    Ok(Found {
        path: path.to_owned(),
        stable: stable_names(path),
        about: device.about()?,
        formats: device.formats()?,
        controls: device.controls(),
        mode: device.mode()?,
    })
}

/// Returns the names of a device that do not change when it is plugged in again.
fn stable_names(path: &Path) -> Vec<PathBuf> {
    let folders = ["/dev/v4l/by-id", "/dev/v4l/by-path"];
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let links = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut names: Vec<PathBuf> = links
        .filter(|link| link.canonicalize().is_ok_and(|target| target == path))
        .collect();
    names.sort();
    names
}

fn described(it: &Found) -> Value {
    let formats = it.formats.iter().map(|format| {
        let sizes = format.sizes.iter().map(
            |size| json!({ "least": size.least, "most": size.most, "rates_hz": size.rates_hz }),
        );
        json!({
            "format": format.format.to_string(),
            "description": format.description,
            "sizes": sizes.collect::<Vec<_>>(),
        })
    });
    let controls = it.controls.iter().map(|control| {
        let [least, most, step] = control.range;
        json!({
            "name": control.name, "least": least, "most": most, "step": step,
            "default": control.default, "value": control.value, "fixed": control.is_fixed,
            "choices": control.choices.iter().map(|(n, name)| json!({ "value": n, "name": name })).collect::<Vec<_>>(),
        })
    });
    json!({
        "path": it.path,
        "stable": it.stable,
        "card": it.about.card,
        "driver": it.about.driver,
        "bus": it.about.bus,
        "now": { "format": it.mode.format.to_string(), "size": it.mode.size, "rate_hz": it.mode.rate_hz },
        "formats": formats.collect::<Vec<_>>(),
        "controls": controls.collect::<Vec<_>>(),
    })
}

fn text(it: &Found) -> String {
    let [width, height] = it.mode.size;
    let rate = it.mode.rate_hz.map_or_else(String::new, |rate_hz| {
        format!(", {rate_hz:.2} frames per second")
    });
    let about = &it.about;
    let mut lines = vec![
        format!(
            "{}: {} ({}, {})",
            it.path.display(),
            about.card,
            about.driver,
            about.bus
        ),
        format!("  now           {} {width}x{height}{rate}", it.mode.format),
    ];
    lines.extend(it.stable.iter().map(|stable| format!("  stable name   {}", stable.display())));
    for format in &it.formats {
        let is_read = footage::PixelFormat::of_letters(format.format.0).is_some();
        let note = if is_read { "" } else { " (not read)" };
        lines.push(format!(
            "  format        {}{note}: {}",
            format.format, format.description
        ));
        for size in format.sizes.iter().filter(|_| is_read) {
            let rates: Vec<String> =
                size.rates_hz.iter().map(|rates_hz| format!("{rates_hz:.2}")).collect();
            lines.push(format!(
                "    {} at {} frames per second",
                size.text(),
                rates.join(", ")
            ));
        }
    }
    lines.extend(it.controls.iter().map(|control| {
        let value = control.value.map_or_else(|| "-".to_owned(), |value| value.to_string());
        let fixed = if control.is_fixed {
            ", cannot be set now"
        } else {
            ""
        };
        let (name, takes, default) = (&control.name, control.takes(), control.default);
        format!("  control       {name} = {value}: {takes}, default {default}{fixed}")
    }));
    lines.join("\n")
}
