//! Contact sheets: pages of thumbnails with the skeletons that were found.

use std::path::PathBuf;

use failure::{ExitKind, Failure, OrFail as _};
use fmp::Model;
use footage::{Canvas, Fill, Limb, Side, Size, Tile, Warp, compose, draw_limbs, resize_map};

/// Number of thumbnails in a row, and on a page.
const N_COLUMNS: usize = 8;
const N_TILES: usize = 40;

/// Length of the longer side of a thumbnail, in pixels.
const SIDE_PX: usize = 220;

/// Skeleton to draw on a thumbnail.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Points of the skeleton, in pixels of the image.
    pub points: Vec<[f64; 2]>,
    /// Lines between the points.
    pub limbs: Vec<Limb>,
    /// Score to show in the caption.
    pub score: f32,
}

/// Returns a line from every part to its parent, in the colour for the left or right side of the body.
pub fn limbs(model: &Model) -> Vec<Limb> {
    let limb = |(to, part): (usize, &fmp::PartSpec)| {
        let side = match &part.name {
            name if name.starts_with("left") => Side::Left,
            name if name.starts_with("right") => Side::Right,
            _ => Side::Centre,
        };
        part.edge.as_ref().map(|edge| Limb {
            from: edge.parent,
            to,
            side,
        })
    };
    let parts = model.spec().parts.iter().enumerate();
    parts.filter_map(limb).collect()
}

/// A contact sheet, with thumbnails of the current page.
#[derive(Debug)]
pub struct Sheet {
    path: PathBuf,
    n_pages: usize,
    page: usize,
    waiting: Vec<(Canvas, String)>,
}

impl Sheet {
    /// Begins the first page.
    ///
    /// * `path`: path of the PNG file; several pages are numbered before the ending.
    /// * `n_images`: number of images that will be added.
    pub fn new(path: PathBuf, n_images: usize) -> Self {
        Self {
            path,
            n_pages: n_images.div_ceil(N_TILES),
            page: 1,
            waiting: Vec::new(),
        }
    }

    /// Adds an image. Writes the page if it is full.
    ///
    /// * `name`: name for the caption.
    /// * `rgb`: pixels of an image of `size`, row by row.
    ///
    /// # Errors
    ///
    /// Fails if the page cannot be written.
    pub fn add(
        &mut self,
        name: &str,
        size: Size,
        rgb: &[u8],
        found: Option<&Skeleton>,
    ) -> Result<(), Failure> {
        let (thumbnail, scale) = shrunk(size);
        let map = resize_map(size, thumbnail);
        let mut pixels = vec![0; thumbnail.rgb_bytes()];
        let warp = Warp::new(size, thumbnail, &map, Fill::Replicate);
        warp.or_fail(ExitKind::Input)?.apply(rgb, &mut pixels);
        let mut canvas = Canvas::from_rgb(thumbnail, &pixels);
        let caption = match found {
            None => format!("{name} -"),
            Some(skeleton) => {
                let smaller = |point: &[f64; 2]| point.map(|value| (value + 0.5) * scale - 0.5);
                let points: Vec<_> = skeleton.points.iter().map(smaller).collect();
                draw_limbs(&mut canvas, &points, &skeleton.limbs);
                format!("{name} {:.2}", skeleton.score)
            }
        };
        self.waiting.push((canvas, caption));
        if self.waiting.len() == N_TILES {
            self.write()?;
        }
        Ok(())
    }

    /// Writes the last page, if it has any images.
    ///
    /// # Errors
    ///
    /// Fails if the page cannot be written.
    pub fn finish(mut self) -> Result<(), Failure> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.write()
    }

    fn write(&mut self) -> Result<(), Failure> {
        let waiting = std::mem::take(&mut self.waiting);
        let tiles: Vec<Tile<'_>> =
            waiting.iter().map(|(picture, caption)| Tile { picture, caption }).collect();
        let page = compose(&tiles, N_COLUMNS);
        page.save_png(&self.path_of_page()).or_fail(ExitKind::Input)?;
        self.page += 1;
        Ok(())
    }

    /// Returns `sheet.png`, or `sheet-1.png` and so on if there are several pages.
    fn path_of_page(&self) -> PathBuf {
        if self.n_pages <= 1 {
            return self.path.clone();
        }
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let ending = self.path.extension().map(|extension| extension.to_string_lossy());
        let ending = ending.map_or(String::new(), |ending| format!(".{ending}"));
        let name = format!("{stem}-{}{ending}", self.page);
        self.path.with_file_name(name)
    }
}

/// Returns the size of the thumbnail of an image, and the number of thumbnail pixels per pixel of the image.
fn shrunk(size: Size) -> (Size, f64) {
    let scale = SIDE_PX as f64 / size.width.max(size.height).max(1) as f64;
    let side = |value: usize| ((value as f64 * scale).round() as usize).max(1);
    (Size::new(side(size.width), side(size.height)), scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_thumbnails_have_the_same_longer_side() {
        assert_eq!(shrunk(Size::new(440, 100)), (Size::new(220, 50), 0.5));
        assert_eq!(shrunk(Size::new(11, 110)), (Size::new(22, 220), 2.0));
        assert_eq!(shrunk(Size::new(9000, 1)).0, Size::new(220, 1));
    }

    #[test]
    fn pages_are_numbered_and_every_image_is_on_exactly_one() {
        let dir = tempfile::tempdir().unwrap();
        let size = Size::new(20, 10);
        for (n_images, expected) in [(40, vec!["s.png"]), (41, vec!["s-1.png", "s-2.png"])] {
            let folder = dir.path().join(n_images.to_string());
            std::fs::create_dir(&folder).unwrap();
            let mut sheet = Sheet::new(folder.join("s.png"), n_images);
            for _ in 0..n_images {
                sheet.add("a.png", size, &[90; 600], None).unwrap();
            }
            sheet.finish().unwrap();
            let entries = std::fs::read_dir(&folder).unwrap();
            let mut names: Vec<_> =
                entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            assert_eq!(names, expected);
        }
    }

    #[test]
    fn the_skeleton_is_drawn_at_its_place_in_the_image() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("s.png");
        let mut sheet = Sheet::new(path.clone(), 1);
        let skeleton = Skeleton {
            points: vec![[100.0, 40.0], [340.0, 40.0]],
            limbs: vec![Limb {
                from: 0,
                to: 1,
                side: Side::Left,
            }],
            score: 0.5,
        };
        let size = Size::new(440, 100);
        sheet.add("a.png", size, &vec![90; size.rgb_bytes()], Some(&skeleton)).unwrap();
        sheet.finish().unwrap();
        let page = image::open(path).unwrap().into_rgb8();
        let blue: Vec<[u32; 2]> = page
            .enumerate_pixels()
            .filter(|(_, _, it)| it.0 == footage::LEFT)
            .map(|(x, y, _)| [x, y])
            .collect();
        let ends = |axis: usize| {
            let values = || blue.iter().map(|blue| blue[axis]);
            (values().min().unwrap(), values().max().unwrap())
        };
        let top = page.height() - 50 - 8;
        let ((left, right), (above, below)) = (ends(0), ends(1));
        assert!(
            (56..=59).contains(&left) && (176..=180).contains(&right),
            "{left} {right}"
        );
        assert!(above >= top + 17 && below <= top + 23, "{above} {below}");
    }
}
