//! Renders a person in front of a background: shades samples, casts shadows, writes pixels.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector3};

use geometry::Camera;

use crate::backdrop::Backdrop;
use crate::body::N_BONES;
use crate::colour::{Curve, Linear};
use crate::light::Light;
use crate::mesh::{Mesh, Posed};
use crate::raster::{Corner, NOTHING, SUB, Samples, between, point_between, shares};
use crate::shadow::{Shadow, Surface};
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
    /// The bodies of the picture, the subject's first.
    bodies: Vec<Body>,
    corners: Vec<Corner>,
    pub(crate) samples: Samples,
    shadow: Shadow,
    curve: Curve,
    eye: Vector3<f32>,
}

/// A posed body. Triangles and corners are numbered consecutively over all bodies.
#[derive(Debug, Clone)]
struct Body {
    posed: Posed,
    /// For every bone, the rotation from the rest pose to this pose, for directions.
    turns: [Matrix3<f32>; N_BONES],
    first_triangle: usize,
    first_corner: usize,
}

impl Default for Body {
    fn default() -> Self {
        Self {
            posed: Posed::default(),
            turns: [Matrix3::identity(); N_BONES],
            first_triangle: 0,
            first_corner: 0,
        }
    }
}

/// A person in a picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Person<'a> {
    pub(crate) figure: &'a Figure,
    pub(crate) frames: &'a [Isometry3<f64>; N_BONES],
}

/// The input of a picture, all in the frame of the stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Input<'a> {
    /// The people, the subject first.
    pub(crate) people: &'a [Person<'a>],
    pub(crate) camera: &'a Camera,
    pub(crate) backdrop: &'a Backdrop,
    pub(crate) light: &'a Light,
}

impl Painter {
    pub(crate) fn new() -> Self {
        Self {
            bodies: Vec::new(),
            corners: Vec::new(),
            samples: Samples::default(),
            shadow: Shadow::default(),
            curve: Curve::new(),
            eye: Vector3::zeros(),
        }
    }

    /// Finds the person, if any, that is visible at every sample.
    pub(crate) fn draw(&mut self, of: &Input<'_>) {
        let camera = of.camera;
        self.eye = camera.centre_in_world().coords.cast();
        let size = of.backdrop.size;
        self.samples.begin(size.width * SUB, size.height * SUB, &of.backdrop.near);
        self.corners.clear();
        self.bodies.resize_with(of.people.len(), Body::default);
        let mut n_triangles = 0;
        for (body, person) in self.bodies.iter_mut().zip(of.people) {
            let mesh = &person.figure.mesh;
            mesh.pose(person.frames, &mut body.posed);
            body.turns = mesh.turns(person.frames);
            body.first_triangle = n_triangles;
            body.first_corner = self.corners.len();
            self.corners.extend(body.posed.points.iter().map(|point| {
                let at: Point3<f64> = point.cast();
                let depth = (camera.camera_from_world * at).z;
                camera.project(&at).map_or_else(Corner::zeros, |pixel| {
                    Corner::new(pixel.x as f32, pixel.y as f32, (1.0 / depth) as f32)
                })
            }));
            for triangle in &mesh.triangles {
                let corners =
                    triangle.map(|triangle| &self.corners[body.first_corner + triangle as usize]);
                self.samples.draw(n_triangles as u32, corners);
                n_triangles += 1;
            }
        }
    }

    /// Writes the picture, after [`draw`](Self::draw), in RGB, row major.
    pub(crate) fn paint(&mut self, of: &Input<'_>, rgb: &mut [u8]) {
        rgb.copy_from_slice(&of.backdrop.bytes);
        let bodies = self.bodies.iter().zip(of.people);
        let bodies = bodies.map(|(body, it)| Surface {
            points: &body.posed.points,
            triangles: &it.figure.mesh.triangles,
        });
        self.shadow.cast(of.light, &bodies.collect::<Vec<_>>());
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

    /// Returns true if the subject is visible at a sample.
    pub(crate) fn sees_subject(&self, sample: usize) -> bool {
        let end = self.bodies.get(1).map_or(usize::MAX, |body| body.first_triangle);
        let triangle = self.samples.triangle[sample];
        triangle != NOTHING && (triangle as usize) < end
    }

    /// Returns the number of samples at which each person is visible, the subject first, after [`draw`](Self::draw).
    pub(crate) fn seen(&self) -> Vec<usize> {
        let mut seen = vec![0; self.bodies.len()];
        for triangle in self.samples.triangle.iter().filter(|nearest| **nearest != NOTHING) {
            let body = |body: &Body| body.first_triangle <= *triangle as usize;
            seen[self.bodies.partition_point(body) - 1] += 1;
        }
        seen
    }

    /// Writes the coverage of every pixel by the subject, 0 to 255, after [`draw`](Self::draw).
    pub(crate) fn mask(&self, mask: &mut [u8]) {
        mask.fill(0);
        let [x1, y1, x2, y2] = self.samples.touched;
        let width = self.samples.width / SUB;
        for y in y1 / SUB..y2.div_ceil(SUB) {
            for x in x1 / SUB..x2.div_ceil(SUB) {
                let n = self.of_pixel(x, y).filter(|triangle| self.sees_subject(*triangle)).count();
                mask[y * width + x] = (n * 255 / (SUB * SUB)) as u8;
            }
        }
    }

    fn of_pixel(&self, x: usize, y: usize) -> impl Iterator<Item = usize> {
        let width = self.samples.width;
        (0..SUB * SUB).map(move |sub| (y * SUB + sub / SUB) * width + x * SUB + sub % SUB)
    }

    /// Returns the colour of a pixel as the mean of its samples; `None` if no person is visible in it.
    fn pixel(&self, of: &Input<'_>, x: usize, y: usize) -> Option<Linear> {
        let n = self.of_pixel(x, y).filter(|i| self.samples.triangle[*i] != NOTHING).count();
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

    /// Returns the light that a point of the body reflects to the camera.
    fn shade(&self, of: &Input<'_>, triangle: usize, place: Point2<f32>) -> Linear {
        let after = self.bodies.partition_point(|body| body.first_triangle <= triangle);
        let body = &self.bodies[after - 1];
        let Figure { mesh, wear } = of.people[after - 1].figure;
        let corners =
            mesh.triangles[triangle - body.first_triangle].map(|triangle| triangle as usize);
        let on_picture = corners.map(|corner| &self.corners[body.first_corner + corner]);
        let shares = shares(on_picture, place);
        let at = point_between(corners.map(|corner| &body.posed.points[corner]), shares);
        let smooth = between(corners.map(|corner| &body.posed.normals[corner]), shares);
        let rest = point_between(corners.map(|corner| &mesh.points[corner]), shares);
        let bone = mesh.bone(corners[0]);
        let finish = wear.finish(&rest, bone);
        let turned = smooth + body.turns[bone] * finish.bump;
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
        let mirrored = half.try_normalize(1e-6).map_or(0.0, |half| half.dot(&normal).max(0.0));
        let shine = finish.gloss * mirrored.powi(24) * 4.0 * (1.0 - dark);
        // Points near the floor are darker.
        let low = 1.0 - 0.35 * (-(at.z.max(0.0)) / 0.25).exp();
        finish.colour.component_mul(&(of.light.around(&normal) * low + key)) + of.light.key * shine
    }
}
