//! Files of a sequence.

use std::fmt::Write as _;
use std::path::Path;

use failure::{ExitKind, Failure, OrFail as _, in_file};
use footage::Size;
use geometry::files::Format as RigFormat;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use scene::truth::{Frame, Header};
use scene::{Address, Scene};

use super::{Job, absolute_path};

const JPEG_QUALITY: u8 = 95;

/// File format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// PNG, which is lossless.
    Png,
    /// JPEG with quality 95, as most cameras write it. The files are smaller than PNG files.
    Jpg,
}

/// Returns the name of a picture with its extension.
pub(super) fn name(stem: &str, format: Format) -> String {
    match format {
        Format::Png => format!("{stem}.png"),
        Format::Jpg => format!("{stem}.jpg"),
    }
}

/// Writes a picture.
pub(super) fn picture(
    folder: &Path,
    stem: &str,
    format: Format,
    size: Size,
    rgb: &[u8],
) -> Result<(), Failure> {
    let mut bytes = Vec::new();
    let [width, height] = [size.width as u32, size.height as u32];
    let written = match format {
        Format::Png => png(&mut bytes).write_image(rgb, width, height, ExtendedColorType::Rgb8),
        Format::Jpg => JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).write_image(
            rgb,
            width,
            height,
            ExtendedColorType::Rgb8,
        ),
    };
    written.or_fail(ExitKind::Run)?;
    put(&folder.join(name(stem, format)), &bytes)
}

/// Writes a mask.
pub(super) fn mask(file: &Path, size: Size, mask: &[u8]) -> Result<(), Failure> {
    let mut bytes = Vec::new();
    png(&mut bytes)
        .write_image(
            mask,
            size.width as u32,
            size.height as u32,
            ExtendedColorType::L8,
        )
        .or_fail(ExitKind::Run)?;
    put(file, &bytes)
}

fn png(bytes: &mut Vec<u8>) -> PngEncoder<&mut Vec<u8>> {
    PngEncoder::new_with_quality(bytes, CompressionType::Fast, FilterType::Sub)
}

/// Writes the ground truth.
pub(super) fn truth(file: &Path, header: &Header, frames: &[Frame]) -> Result<(), Failure> {
    let mut lines = header.to_line().or_fail(ExitKind::Run)? + "\n";
    for frame in frames {
        lines += &frame.to_line().or_fail(ExitKind::Run)?;
        lines.push('\n');
    }
    text(file, &lines)
}

/// Writes the rig that a user would have (with calibration errors, if requested), and the exact rig.
pub(super) fn rigs(folder: &Path, scene: &Scene) -> Result<(), Failure> {
    let written = scene.written_rig().or_fail(ExitKind::Usage)?;
    for (name, rig) in [("rig.toml", &written), ("rig-exact.toml", scene.rig())] {
        let file = folder.join(name);
        geometry::files::write(&file, RigFormat::Own, rig).or_fail(ExitKind::Input)?;
    }
    Ok(())
}

/// Writes the deployment.
///
/// * `name`: name of the sequence.
pub(super) fn deployment(
    folder: &Path,
    name: &str,
    job: &Job,
    scene: &Scene,
) -> Result<(), Failure> {
    let settings = scene.settings();
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let model = job.model.as_deref().map_or(String::new(), |model| {
        let file = absolute_path(model).display().to_string();
        format!("method = \"paper\"\npaper.model = {}\n", quoted(&file))
    });
    let (rate, seed) = (settings.rate_hz, settings.seed);
    let mut text = format!(
        "# Written by `parallax-lab synth`: subject {}, {}, seed {seed}. The truth is in truth.jsonl.\n\n\
         name = {}\nrig = \"rig.toml\"\n{model}output = \"out\"\n",
        settings.subject,
        scene.action(),
        quoted(&format!("synth-{name}-{seed}")),
    );
    for (nth, camera) in scene.rig().cameras().iter().enumerate() {
        let source = if job.live {
            let address = Address {
                settings: settings.clone(),
                camera: camera.name.clone(),
                n_frames: job.n_frames,
            };
            address.to_string()
        } else {
            format!("cameras/{}", camera.name)
        };
        let (name, source) = (quoted(&camera.name), quoted(&source));
        write!(text, "\n[[camera]]\nname = {name}\nsource = {source}\n").or_fail(ExitKind::Run)?;
        // With `live`, the address of the scene contains the skew.
        let skew_ms = settings.skews_ms.get(nth).filter(|skews_ms| **skews_ms != 0.0 && !job.live);
        if let Some(skew_ms) = skew_ms {
            writeln!(text, "skew_ms = {skew_ms:?}").or_fail(ExitKind::Run)?;
        }
    }
    text += if job.live {
        "\n[capture]\nmode = \"realtime\"\n"
    } else {
        "\n[capture]\n"
    };
    writeln!(text, "frame_rate_hz = {rate:?}").or_fail(ExitKind::Run)?;
    self::text(&folder.join("deployment.toml"), &text)
}

/// Writes a text file.
pub(super) fn text(file: &Path, text: &str) -> Result<(), Failure> {
    put(file, text.as_bytes())
}

fn put(file: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace_unsynced(file, bytes).map_err(|error| in_file(file, &error))
}
