//! What a model takes for each type of its parts, cut out of images.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::model_page::Examples;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::{Layout, Model, Pose, Search};
use footage::{Canvas, Fill, Size, Warp, resize_map};
use rayon::prelude::*;
use training::datasets::Picture;

/// Most examples of a type.
const MOST: usize = 4;

/// Side of an example, pixels, and in boxes of the part.
const SIDE_PX: usize = 64;
const SIDE_BOXES: f64 = 1.5;

/// What is seen of a part.
struct Seen {
    score: f32,
    part: usize,
    mixture: usize,
    png: Vec<u8>,
}

/// Cuts out what the best detections of the images are made of, on rayon's current pool: of every type those on the
/// people the model is most certain of.
///
/// # Errors
///
/// An image cannot be read.
pub fn gather(model: &Arc<Model>, images: &[PathBuf]) -> Result<Examples, Failure> {
    let search = Search::new(Arc::clone(model));
    let seen: Result<Vec<_>, Failure> = images.par_iter().map(|it| of_image(&search, it)).collect();
    let mut seen: Vec<Seen> = seen?.into_iter().flatten().collect();
    seen.sort_by(|a, b| b.score.total_cmp(&a.score));
    let parts = 0..model.n_parts();
    let mut png: Vec<_> = parts
        .map(|it| vec![Vec::new(); model.n_types(it)])
        .collect();
    for it in seen {
        let examples = &mut png[it.part][it.mixture];
        if examples.len() < MOST {
            examples.push(it.png);
        }
    }
    Ok(Examples { png })
}

/// The parts of the best detection; none if there is no detection.
fn of_image(search: &Search, path: &Path) -> Result<Vec<Seen>, Failure> {
    let picture = Picture::read(path).or_fail(ExitKind::Input)?;
    let size = picture.size();
    let Search { model, solver, .. } = search;
    let Ok(layout) = Layout::new(model, size.width, size.height) else {
        return Ok(Vec::new());
    };
    let best = search.on(picture.view(), &layout, |it| solver.best(it, None));
    let threshold = model.detection_threshold();
    let Some(pose) = best.filter(|it| f64::from(it.score) >= threshold) else {
        return Ok(Vec::new());
    };
    let parts = 0..model.n_parts();
    parts
        .filter_map(|part| cut(&picture, &pose, pose.part_box(model, &layout, part), part))
        .collect()
}

/// A part and a little of what is around it; `None` if that leaves the image.
fn cut(
    picture: &Picture,
    pose: &Pose,
    [x1, y1, x2, y2]: [f64; 4],
    part: usize,
) -> Option<Result<Seen, Failure>> {
    let half = SIDE_BOXES * (x2 - x1).max(y2 - y1) / 2.0;
    let [x, y] = [f64::midpoint(x1, x2), f64::midpoint(y1, y2)];
    let around = [x - half, y - half, x + half, y + half];
    let Size { width, height } = picture.size();
    let inside = around[0] >= 0.0
        && around[1] >= 0.0
        && around[2] < width as f64
        && around[3] < height as f64;
    inside.then(|| {
        let (crop, _) = picture.crop(around);
        Ok(Seen {
            score: pose.score,
            part,
            mixture: usize::from(pose.parts[part].mixture),
            png: thumbnail(&crop)?,
        })
    })
}

fn thumbnail(crop: &Picture) -> Result<Vec<u8>, Failure> {
    let size = Size::new(SIDE_PX, SIDE_PX);
    let map = resize_map(crop.size(), size);
    let mut pixels = vec![0; size.rgb_bytes()];
    let warp = Warp::new(crop.size(), size, &map, Fill::Replicate);
    warp.or_fail(ExitKind::Input)?
        .apply(crop.rgb(), &mut pixels);
    let canvas = Canvas::from_rgb(size, &pixels);
    canvas.png().or_fail(ExitKind::Input)
}
