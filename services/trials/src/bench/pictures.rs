//! Renders the pictures of synthetic cameras in advance.

use std::path::Path;
use std::sync::Arc;

use failure::{ExitKind, Failure, OrFail as _, Stop};
use image::ExtendedColorType;
use indicatif::ProgressBar;
use rayon::prelude::*;
use scene::{Scene, Settings, View};
use terminal::output;

/// Writes the first pictures of every camera into a subfolder with the name of the camera. Returns false if the benchmark was interrupted.
///
/// * `quiet`: true to show no progress.
pub(super) fn draw(
    settings: &Settings,
    n_frames: u64,
    folder: &Path,
    stop: &Stop,
    quiet: bool,
) -> Result<bool, Failure> {
    let scene = Arc::new(Scene::new(settings).or_fail(ExitKind::Run)?);
    let cameras = scene.rig().cameras();
    let n_pictures = n_frames * cameras.len() as u64;
    if !quiet {
        output::message(format_args!("making {n_pictures} pictures ..."));
    }
    let bar = if quiet || !output::is_terminal() {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(n_pictures)
    };
    let drawn: Result<Vec<()>, Failure> = (0..cameras.len())
        .into_par_iter()
        .map(|camera| {
            let folder = folder.join(&cameras[camera].name);
            let mut view = View::new(&scene, camera).or_fail(ExitKind::Run)?;
            draw_view(&mut view, n_frames, &folder, &mut || {
                bar.inc(1);
                stop.is_requested()
            })
        })
        .collect();
    bar.finish_and_clear();
    drawn?;
    Ok(!stop.is_requested())
}

/// Writes the pictures of a camera, and removes pictures of an earlier benchmark.
///
/// * `is_enough`: called after every picture. Returns true to end the rendering.
fn draw_view(
    view: &mut View,
    n_frames: u64,
    folder: &Path,
    is_enough: &mut dyn FnMut() -> bool,
) -> Result<(), Failure> {
    results::remove_pictures(folder).or_fail(ExitKind::Input)?;
    inputs::make_folder(folder)?;
    let size = view.size();
    let mut rgb = vec![0; size.rgb_bytes()];
    for frame in 0..n_frames {
        view.picture(frame, &mut rgb);
        let file = folder.join(format!("{frame:06}.png"));
        let [width, height] = [size.width as u32, size.height as u32];
        image::save_buffer(&file, &rgb, width, height, ExtendedColorType::Rgb8)
            .map_err(|error| failure::in_file(&file, &error))?;
        if is_enough() {
            break;
        }
    }
    Ok(())
}
