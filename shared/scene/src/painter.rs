//! Renders a person in front of a background: shades samples, casts shadows, writes pixels.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector3};

use geometry::Camera;

use crate::backdrop::Backdrop;
use crate::body::N_BONES;
use crate::colour::{Curve, Linear};
use crate::light::Light;
use crate::mesh::{Mesh, Posed};
use crate::raster::{Corner, NOTHING, SUB, Samples, between, point_between, shares};
use crate::shadow::Shadow;
use crate::wear::Wear;

/// A person as a surface with clothes.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    pub(crate) mesh: Mesh,
    pub(crate) wear: Wear,
}

/// The renderer; its buffers are reused from picture to picture.
#[derive(Debug, Clone)]
pub(crate) struct Painter {
    posed: Posed,
    corners: Vec<Corner>,
    pub(crate) samples: Samples,
    shadow: Shadow,
    curve: Curve,
    /// By bone, the rotation of directions at rest.
    turns: [Matrix3<f32>; N_BONES],
    eye: Vector3<f32>,
}

/// The input of a picture, all in the frame of the stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Subject<'a> {
    pub(crate) figure: &'a Figure,
    pub(crate) frames: &'a [Isometry3<f64>; N_BONES],
    pub(crate) camera: &'a Camera,
    pub(crate) backdrop: &'a Backdrop,
    pub(crate) light: &'a Light,
}

impl Painter {
    pub(crate) fn new() -> Self {
        Self {
            posed: Posed::default(),
            corners: Vec::new(),
            samples: Samples::default(),
            shadow: Shadow::default(),
            curve: Curve::new(),
            turns: [Matrix3::identity(); N_BONES],
            eye: Vector3::zeros(),
        }
    }

    /// Determines which samples see the person.
    pub(crate) fn draw(&mut self, of: &Subject<'_>) {
        let mesh = &of.figure.mesh;
        mesh.pose(of.frames, &mut self.posed);
        self.turns = mesh.turns(of.frames);
        let camera = of.camera;
        self.eye = camera.centre_in_world().coords.cast();
        self.corners.clear();
        self.corners.extend(self.posed.points.iter().map(|point| {
            let at: Point3<f64> = point.cast();
            let depth = (camera.camera_from_world * at).z;
            camera.project(&at).map_or_else(Corner::zeros, |pixel| {
                Corner::new(pixel.x as f32, pixel.y as f32, (1.0 / depth) as f32)
            })
        }));
        let size = of.backdrop.size;
        self.samples
            .begin(size.width * SUB, size.height * SUB, &of.backdrop.near);
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corners = triangle.map(|it| &self.corners[it as usize]);
            self.samples.draw(index as u32, corners);
        }
    }

    /// Writes the picture, after [`draw`](Self::draw): RGB, row major.
    pub(crate) fn paint(&mut self, of: &Subject<'_>, rgb: &mut [u8]) {
        rgb.copy_from_slice(&of.backdrop.bytes);
        let mesh = &of.figure.mesh;
        self.shadow
            .cast(of.light, &self.posed.points, &mesh.triangles);
        for (pixel, bytes) in of.backdrop.pixels.iter().zip(rgb.as_chunks_mut::<3>().0) {
            let dark = self.shadow.share(pixel.across, pixel.to_lamp, 4, 0.03);
            if dark > 0.0 {
                *bytes = self.curve.bytes(&(pixel.base + pixel.key * (1.0 - dark)));
            }
        }
        let width = of.backdrop.size.width;
        let [x1, y1, x2, y2] = self.samples.touched;
        for y in y1 / SUB..y2.div_ceil(SUB) {
            for x in x1 / SUB..x2.div_ceil(SUB) {
                if let Some(colour) = self.pixel(of, x, y) {
                    rgb[3 * (y * width + x)..][..3].copy_from_slice(&self.curve.bytes(&colour));
                }
            }
        }
    }

    /// Writes how much of every pixel the person covers, after [`draw`](Self::draw): 0 to 255.
    pub(crate) fn mask(&self, mask: &mut [u8]) {
        mask.fill(0);
        let [x1, y1, x2, y2] = self.samples.touched;
        let width = self.samples.width / SUB;
        for y in y1 / SUB..y2.div_ceil(SUB) {
            for x in x1 / SUB..x2.div_ceil(SUB) {
                let n = self
                    .of_pixel(x, y)
                    .filter(|it| self.samples.triangle[*it] != NOTHING)
                    .count();
                mask[y * width + x] = (n * 255 / (SUB * SUB)) as u8;
            }
        }
    }

    fn of_pixel(&self, x: usize, y: usize) -> impl Iterator<Item = usize> {
        let width = self.samples.width;
        (0..SUB * SUB).map(move |sub| (y * SUB + sub / SUB) * width + x * SUB + sub % SUB)
    }

    /// The mean of the samples of a pixel, where any of them sees the person.
    fn pixel(&self, of: &Subject<'_>, x: usize, y: usize) -> Option<Linear> {
        let n = self
            .of_pixel(x, y)
            .filter(|it| self.samples.triangle[*it] != NOTHING)
            .count();
        if n == 0 {
            return None;
        }
        let mut sum = Linear::zeros();
        for (sub, index) in self.of_pixel(x, y).enumerate() {
            let triangle = self.samples.triangle[index];
            if triangle != NOTHING {
                let place = Samples::place(x * SUB + sub % SUB, y * SUB + sub / SUB);
                sum += self.shade(of, triangle as usize, place);
            }
        }
        let behind = &of.backdrop.pixels[y * of.backdrop.size.width + x];
        let dark = self.shadow.share(behind.across, behind.to_lamp, 4, 0.03);
        let all = (SUB * SUB) as f32;
        let behind = behind.base + behind.key * (1.0 - dark);
        Some((sum + behind * (all - n as f32)) / all)
    }

    /// The light reflected to the camera by a place of the body.
    fn shade(&self, of: &Subject<'_>, triangle: usize, place: Point2<f32>) -> Linear {
        let Figure { mesh, wear } = of.figure;
        let corners = mesh.triangles[triangle].map(|it| it as usize);
        let shares = shares(corners.map(|it| &self.corners[it]), place);
        let at = point_between(corners.map(|it| &self.posed.points[it]), shares);
        let smooth = between(corners.map(|it| &self.posed.normals[it]), shares);
        let rest = point_between(corners.map(|it| &mesh.points[it]), shares);
        let bone = mesh.bone(corners[0]);
        let finish = wear.finish(&rest, bone);
        let turned = smooth + self.turns[bone] * finish.bump;
        let normal = turned.try_normalize(1e-6).unwrap_or(smooth);
        let (across, near) = of.light.beam(&at.coords);
        let direct = of.light.direct(&normal);
        let dark = if direct.sum() > 0.0 {
            self.shadow.share(across, near, 1, 0.028)
        } else {
            0.0
        };
        let key = direct * (1.0 - dark);
        let to_eye = self.eye - at.coords;
        let half = to_eye.try_normalize(1e-6).unwrap_or(Vector3::z()) + of.light.to_key;
        let mirrored = half
            .try_normalize(1e-6)
            .map_or(0.0, |it| it.dot(&normal).max(0.0));
        let shine = finish.gloss * mirrored.powi(24) * 4.0 * (1.0 - dark);
        // Places near the floor are darker.
        let low = 1.0 - 0.35 * (-(at.z.max(0.0)) / 0.25).exp();
        finish
            .colour
            .component_mul(&(of.light.around(&normal) * low + key))
            + of.light.key * shine
    }
}
