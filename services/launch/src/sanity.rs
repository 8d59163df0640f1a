//! Checks footage and calibration of a deployment before any process is started.

use std::path::PathBuf;

use capture::{Blank, Feed};
use deployment::Deployment;
use failure::{ExitKind, Failure};
use footage::{LiveAddress, SourceSpec};
use geometry::Rig;
use geometry::files::{Finding, Severity, check as check_rig};
use rayon::prelude::*;
use scene::Address;

use crate::keypoints;
use crate::resolved::Resolved;

/// The largest ratio of two frame rates at which frames can be paired by number.
const MAX_RATE_RATIO: f64 = 1.02;
/// Minimum range of brightness over the cells of an image, on a scale from 0 to 255. Images with less contrast are not compared.
const MIN_CONTRAST: f64 = 16.0;
/// Warning about footage whose frame rate is unknown.
const NO_RATE: &str = "the frame rate of the footage is not known: times, speeds and pose3d.trc are left out; \
    set `capture.frame_rate_hz`";
/// A picture whose brightest value is below this value (from 0 to 255) uses only a small part of the range.
const LEAST_BRIGHTEST: u8 = 64;
/// Two images count as similar if the mean brightness difference of their cells is below this value (from 0 to 255).
const MIN_DIFFERENCE: f64 = 1.0;
/// Number of cells of the brightness grid, in each direction.
const CELLS: usize = 32;

/// Checks footage and calibration, and returns warnings.
///
/// # Errors
///
/// Fails if joints cannot be located in 3D, because there is only one camera, cameras are at the same place, the unit of the calibration is
/// wrong, two cameras have the same source, or frame rates differ.
fn check(resolved: &Resolved, lengths: &[Option<u64>]) -> Result<Vec<String>, Failure> {
    let deployment = &resolved.deployment;
    let mut warnings = deployment.doubts(n_cores());
    check_number(deployment)?;
    if resolved.host.is_some() {
        // With several hosts, sources are not compared: devices of two machines may have the same name, and footage of another machine
        // cannot be read.
        warnings.extend(check_cameras(deployment)?);
        return Ok(warnings);
    }
    check_sources(deployment)?;
    warnings.extend(check_cameras(deployment)?);
    warnings.extend(check_rates(resolved)?);
    warnings.extend(check_lengths(resolved));
    warnings.extend(check_images(resolved)?);
    warnings.extend(keypoints::check_lengths(resolved, lengths));
    Ok(warnings)
}

/// Refuses a single camera.
fn check_number(deployment: &Deployment) -> Result<(), Failure> {
    let [camera] = &deployment.cameras[..] else {
        return Ok(());
    };
    let message = format!(
        "the deployment has only one camera, {:?}: a single camera cannot locate anything in space",
        camera.name
    );
    let failure = Failure::new(ExitKind::Config, message);
    Err(failure.with_hint(
        "add a [[camera]] that sees the same people from another position; `parallax detect` finds people in single images",
    ))
}

/// Refuses two cameras with the same source.
fn check_sources(deployment: &Deployment) -> Result<(), Failure> {
    let canonical = |source: &str| -> PathBuf {
        let path = PathBuf::from(source);
        if Address::is_address(source) {
            return path;
        }
        if let Some(LiveAddress::Device(device)) = LiveAddress::parse(source) {
            return device.canonicalize().unwrap_or(device);
        }
        path.canonicalize().unwrap_or(path)
    };
    let all: Vec<PathBuf> =
        deployment.cameras.iter().map(|camera| canonical(&camera.source)).collect();
    for (nth, source) in all.iter().enumerate() {
        let is_blank = Blank::is_blank(&deployment.cameras[nth].source);
        let Some(first) = all[..nth].iter().position(|other| other == source && !is_blank) else {
            continue;
        };
        let [a, b] = [first, nth].map(|i| &deployment.cameras[i].name);
        let message = format!(
            "cameras {a:?} and {b:?} have the same source, {}",
            footage::without_passwords(&source.to_string_lossy())
        );
        let failure = Failure::new(ExitKind::Config, message);
        return Err(failure.with_hint("every [[camera]] needs the footage of its own camera"));
    }
    Ok(())
}

/// Applies the checks of `parallax calib check` to the cameras of the deployment.
fn check_cameras(deployment: &Deployment) -> Result<Vec<String>, Failure> {
    let rig = inputs::rig_of(deployment)?;
    let named = deployment.cameras.iter().filter_map(|camera| rig.camera(&camera.name));
    let used = Rig::new(named.cloned().collect(), rig.up_in_world(), rig.source());
    // A camera that is missing from the rig is reported by another check, with its name.
    let Ok(used) = used else {
        return Ok(Vec::new());
    };
    let findings = check_rig(&used);
    let is_confirmed = |finding: &Finding| {
        let is_distance = matches!(finding, Finding::Distance { .. });
        is_distance && deployment.unit.is_some()
    };
    let (refused, rest): (Vec<&Finding>, Vec<&Finding>) = findings
        .iter()
        .partition(|finding| finding.severity() == Severity::Error && !is_confirmed(finding));
    if let Some(first) = refused.first() {
        let more = match refused.len() - 1 {
            0 => String::new(),
            n => format!(" (and {n} more: `parallax calib check` prints them)"),
        };
        let message = format!("{}: {first}{more}", deployment.rig.display());
        let failure = Failure::new(ExitKind::Calibration, message);
        return Err(failure.with_hint(hint(first)));
    }
    let warnings = rest.into_iter().filter(|finding| finding.severity() >= Severity::Warning);
    Ok(warnings
        .map(|warning| format!("{}: {warning}", deployment.rig.display()))
        .collect())
}

/// Returns the hint for a finding.
fn hint(finding: &Finding) -> String {
    match finding {
        Finding::Distance { metres, .. } => format!(
            "set the unit of the file in the deployment: with `unit = \"mm\"` this is {:.3} m, with `unit = \"cm\"` {:.3} m; \
             use `unit = \"m\"` if the distance is right",
            metres / 1000.0,
            metres / 100.0
        ),
        Finding::OnePlace { .. } => {
            "to locate joints in space, cameras must be apart, best by a metre or more; `unit` in the deployment sets the unit of \
             the file"
                .to_owned()
        }
        _ => "`parallax calib check` shows details; calibrate again, or leave the camera out".to_owned(),
    }
}

/// Refuses footage with different frame rates, unless the rate is given. Warns of drift.
fn check_rates(resolved: &Resolved) -> Result<Option<String>, Failure> {
    let deployment = &resolved.deployment;
    let step = deployment.capture.frame_step as f64;
    let views = deployment.cameras.iter().zip(&resolved.footage);
    let known: Vec<(&str, f64)> = views
        .filter_map(|(camera, footage)| Some((camera.name.as_str(), footage.frame_rate_hz? * step)))
        .collect();
    let slowest = known.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let fastest = known.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let (Some((slow, low)), Some((fast, high))) = (slowest, fastest) else {
        return Ok(Some(NO_RATE.to_owned()));
    };
    let rates = format!("{slow} has {low:.6} frames per second, {fast} {high:.6}");
    if resolved.has_live() {
        return of_live_rates(resolved, &rates, high / low);
    }
    let drift = resolved.n_frames() as f64 * step * (high / low - 1.0);
    let text = format!(
        "{rates}: frames are paired by their numbers, so at the end they are {drift:.1} frames apart"
    );
    if high / low <= MAX_RATE_RATIO || deployment.capture.frame_rate_hz.is_some() {
        return Ok((drift >= 0.5).then_some(text).or_else(|| without_rate(resolved)));
    }
    let failure = Failure::new(ExitKind::Input, text);
    Err(failure.with_hint(
        "if the cameras have separate clocks, set `offset_ms` in each [[camera]]: use the values from `parallax sync estimate`, or 0 if the cameras \
         began at the same time. A run then brings cameras of any rates to common instants. If a file states a wrong rate, set the \
         right one as `capture.frame_rate_hz`",
    ))
}

/// Returns a warning about the cameras whose frame rate is unknown, if the rate of other cameras is known.
fn without_rate(resolved: &Resolved) -> Option<String> {
    let views = resolved.deployment.cameras.iter().zip(&resolved.footage);
    let unknown = views.filter(|view| view.1.frame_rate_hz.is_none());
    let names: Vec<&str> = unknown.map(|unknown| unknown.0.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the frame rate of {} is not known: the rate of the other cameras is used; `capture.frame_rate_hz` sets another rate",
            names.join(", ")
        )
    })
}

/// Warns of live cameras with different rates. Their pictures are paired by time, so different rates only mean that a slower camera has no
/// picture for some frames.
fn of_live_rates(resolved: &Resolved, rates: &str, ratio: f64) -> Result<Option<String>, Failure> {
    if ratio <= MAX_RATE_RATIO || resolved.deployment.capture.frame_rate_hz.is_some() {
        return Ok(None);
    }
    let failure = Failure::new(ExitKind::Config, rates.to_owned());
    Err(failure.with_hint(
        "set the same `frame_rate_hz` in each [[camera]], or set `capture.frame_rate_hz` to the rate of the common instants: a slower camera then has no picture at some instants",
    ))
}

/// Warns of cameras whose footage is much shorter than that of another camera.
fn check_lengths(resolved: &Resolved) -> Option<String> {
    if resolved.has_live() {
        return None;
    }
    let names = resolved.deployment.cameras.iter().map(|camera| camera.name.as_str());
    let lengths = resolved.footage.iter().map(|footage| footage.n_frames);
    shorter(&names.zip(lengths).collect::<Vec<_>>())
}

/// Describes the cameras whose footage is much shorter than the longest, and by how much. Returns `None` if there are none.
fn shorter(all: &[(&str, u64)]) -> Option<String> {
    const LEAST_FRAMES: u64 = 5;
    const LEAST_SHARE: f64 = 0.05;
    let (long, many) = *all.iter().max_by_key(|camera| camera.1)?;
    let is_short = |few: u64| {
        let missing = many - few;
        missing >= LEAST_FRAMES && missing as f64 > LEAST_SHARE * many as f64
    };
    let short = all.iter().filter(|camera| is_short(camera.1));
    let short: Vec<String> = short
        .map(|(name, few)| {
            let share = 100.0 * (many - few) as f64 / many as f64;
            format!(
                "{name} has {few} frames, {} ({share:.0} %) fewer",
                many - few
            )
        })
        .collect();
    (!short.is_empty()).then(|| {
        format!(
            "{} than {long} with {many}: frames are paired by their numbers; do all cameras begin at the same time, with the same rate?",
            short.join(", ")
        )
    })
}

/// Refuses cameras whose first images are identical. Warns of cameras whose first images are almost identical.
fn check_images(resolved: &Resolved) -> Result<Vec<String>, Failure> {
    let deployment = &resolved.deployment;
    let first = deployment
        .cameras
        .par_iter()
        .map(|camera| FirstImages::read(camera, &deployment.capture));
    let first: Vec<Option<FirstImages>> = first.collect();
    let cameras = deployment.cameras.iter().zip(&first);
    let mut warnings: Vec<String> = cameras
        .filter_map(|(camera, first)| {
            let brightest = first.as_ref()?.brightest();
            (brightest < LEAST_BRIGHTEST).then(|| {
                format!(
                    "the first pictures of {} ({}) use a small part of their range: the brightest value is {brightest} of 255; do \
                     they have 10 or 12 bits, stored in 16?",
                    camera.name, camera.source
                )
            })
        })
        .collect();
    for (nth, own) in first.iter().enumerate() {
        for (other, theirs) in first[..nth].iter().enumerate() {
            let (Some(own), Some(theirs)) = (own, theirs) else {
                continue;
            };
            if !(own.has_contrast && theirs.has_contrast) {
                continue;
            }
            let [a, b] = [other, nth].map(|i| &deployment.cameras[i].name);
            if own.rgb == theirs.rgb {
                let message = format!(
                    "the first {} pictures of cameras {a:?} and {b:?} are equal, bit for bit, so they come from one camera",
                    own.rgb.len()
                );
                let failure = Failure::new(ExitKind::Input, message);
                return Err(
                    failure.with_hint("every [[camera]] needs the footage of its own camera")
                );
            }
            let difference = own.difference(theirs);
            if difference < MIN_DIFFERENCE {
                warnings.push(format!(
                    "the first pictures of {a} and {b} differ by only {difference:.1} of 255 on average: was one video given for two cameras?"
                ));
            }
        }
    }
    Ok(warnings)
}

/// The first images of a camera.
struct FirstImages {
    rgb: Vec<Vec<u8>>,
    /// True if the first image has enough contrast.
    has_contrast: bool,
    /// Mean brightness of the cells of the first image, row by row.
    grid: Vec<f64>,
}

impl FirstImages {
    /// Reads the first images. Returns `None` for a live or synthetic camera, a camera without pictures, and unreadable footage.
    fn read(
        camera: &deployment::capture::Camera,
        capture: &deployment::capture::Config,
    ) -> Option<Self> {
        let is_made = Address::is_address(&camera.source) || Blank::is_blank(&camera.source);
        if is_made || crate::cameras::is_live(&camera.source) {
            return None;
        }
        let spec = SourceSpec {
            step: 5,
            count: Some(2),
            most_shrink: 4,
            ..crate::cameras::source(camera, capture)
        };
        // Unreadable footage is reported when it is read.
        let mut feed = Feed::open(&spec).ok()?;
        let mut rgb = Vec::new();
        while let Ok(Some(frame)) = feed.next_frame() {
            rgb.push(frame.rgb.to_vec());
        }
        let size = feed.info().size;
        let grid = grid(rgb.first()?, [size.width, size.height]);
        let most = grid.iter().copied().fold(f64::MIN, f64::max);
        let least = grid.iter().copied().fold(f64::MAX, f64::min);
        Some(Self {
            has_contrast: most - least >= MIN_CONTRAST,
            rgb,
            grid,
        })
    }

    fn brightest(&self) -> u8 {
        self.rgb.iter().flatten().copied().max().unwrap_or(0)
    }

    /// Returns the mean absolute difference of brightness over the cells.
    fn difference(&self, other: &Self) -> f64 {
        let pairs = self.grid.iter().zip(&other.grid);
        let sum: f64 = pairs.map(|(a, b)| (a - b).abs()).sum();
        sum / self.grid.len() as f64
    }
}

/// Returns the mean brightness of the cells of an image, row by row.
///
/// * `rgb`: the pixels, three bytes each.
fn grid(rgb: &[u8], [width, height]: [usize; 2]) -> Vec<f64> {
    let mut cells = vec![[0.0, 0.0]; CELLS * CELLS];
    for (row, line) in rgb.chunks_exact(3 * width).enumerate() {
        for (column, pixel) in line.chunks_exact(3).enumerate() {
            let cell = &mut cells[row * CELLS / height * CELLS + column * CELLS / width];
            let sum: u32 = pixel.iter().map(|pixel| u32::from(*pixel)).sum();
            *cell = [cell[0] + f64::from(sum) / 3.0, cell[1] + 1.0];
        }
    }
    let mean = |[sum, n]: [f64; 2]| if n > 0.0 { sum / n } else { 0.0 };
    cells.into_iter().map(mean).collect()
}

/// Runs the checks and logs the warnings.
///
/// * `lengths`: number of frames in the keypoints of each camera, if it has keypoints.
///
/// # Errors
///
/// Fails like [`check`].
pub(crate) fn warn(resolved: &Resolved, lengths: &[Option<u64>]) -> Result<(), Failure> {
    for warning in check(resolved, lengths)? {
        tracing::warn!("{warning}");
    }
    Ok(())
}

/// Returns the number of cores that this process may use, if it is known.
pub(crate) fn n_cores() -> Option<usize> {
    let known = std::thread::available_parallelism();
    known.ok().map(usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_camera_with_much_shorter_footage_is_named_with_the_missing_length() {
        assert_eq!(shorter(&[("a", 100), ("b", 96)]), None);
        assert_eq!(shorter(&[("a", 6), ("b", 3)]), None, "too few to say");
        let text = shorter(&[("a", 30), ("b", 100), ("c", 90)]).unwrap();
        let due =
            "a has 30 frames, 70 (70 %) fewer, c has 90 frames, 10 (10 %) fewer than b with 100";
        assert!(text.starts_with(due), "{text}");
    }
}
