//! A photograph as the background.

use footage::{FootageError, Size};
use nalgebra::Vector2;
use std::path::{Path, PathBuf};

use crate::colour::{Linear, srgb};

/// The pixels of a photograph.
#[derive(Debug, Clone)]
pub(crate) struct Photo {
    size: Size,
    rgb: Vec<u8>,
}

impl Photo {
    pub(crate) fn read(path: &Path) -> Result<Self, FootageError> {
        let (size, rgb) = footage::read_image(path)?;
        Ok(Self { size, rgb })
    }

    /// Returns the colour at fractions of the width and the height, with bilinear interpolation.
    pub(crate) fn at(&self, share: Vector2<f32>) -> Linear {
        let Size { width, height } = self.size;
        if width == 0 || height == 0 {
            return Linear::zeros();
        }
        let x = (share.x * width as f32 - 0.5).clamp(0.0, width as f32 - 1.0);
        let y = (share.y * height as f32 - 0.5).clamp(0.0, height as f32 - 1.0);
        let pixel = |x: usize, y: usize| {
            let at = 3 * (y.min(height - 1) * width + x.min(width - 1));
            srgb([self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]])
        };
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x.fract(), y.fract());
        let line = |row: usize| pixel(column, row) * (1.0 - u) + pixel(column + 1, row) * u;
        line(row) * (1.0 - v) + line(row + 1) * v
    }
}

/// Returns the photographs in a folder, sorted by name.
///
/// # Errors
///
/// [`FootageError`] if the folder cannot be read, or contains no photographs.
pub fn photos_in(folder: &Path) -> Result<Vec<PathBuf>, FootageError> {
    let failed = |source: std::io::Error| FootageError::Io {
        path: folder.to_owned(),
        source,
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let ending = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        if ["png", "jpg", "jpeg", "bmp"]
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known))
        {
            found.push(path);
        }
    }
    if found.is_empty() {
        return Err(FootageError::NoImages {
            path: folder.display().to_string(),
        });
    }
    found.sort();
    Ok(found)
}
