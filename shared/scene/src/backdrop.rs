//! The background of one camera: everything but the people. It is rendered once, because it does not move.

use footage::Size;
use geometry::Camera;
use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::colour::{Curve, Linear};
use crate::photo::Photo;
use crate::raster::{SUB, Samples};
use crate::room::{Hit, Room};

/// The pixels of the background, with the data needed to add people and their shadows.
#[derive(Debug, Clone)]
pub(crate) struct Backdrop {
    pub(crate) size: Size,
    pub(crate) pixels: Vec<Pixel>,
    /// 1 / depth of every sample.
    pub(crate) near: Vec<f32>,
    /// The picture without the person, in RGB.
    pub(crate) bytes: Vec<u8>,
}

/// A pixel of the background.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixel {
    /// Light that reaches the camera without the key lamp, and the additional light that comes from the key lamp.
    pub(crate) base: Linear,
    pub(crate) key: Linear,
    /// Coordinates perpendicular to the rays of the key lamp, and along the rays towards the lamp, in metres.
    pub(crate) across: Vector2<f32>,
    pub(crate) to_lamp: f32,
}

impl Backdrop {
    /// Casts rays through every sample.
    ///
    /// * `camera`: the camera, in the frame of the stage.
    /// * `photo`: photograph shown instead of the room. The room still determines where shadows fall and what hides the person.
    pub(crate) fn new(camera: &Camera, room: &Room, photo: Option<&Photo>) -> Self {
        let [width, height] = camera.intrinsics.size.map(|size| size as usize);
        let eye: Point3<f32> = camera.centre_in_world().cast();
        let view = View { camera, room, eye };
        let normalised = view.directions(width, height);
        let mut backdrop = Self {
            size: Size::new(width, height),
            pixels: Vec::with_capacity(width * height),
            near: vec![0.0; width * height * SUB * SUB],
            bytes: vec![0; width * height * 3],
        };
        let curve = Curve::new();
        for y in 0..height {
            for x in 0..width {
                let at = |x: usize, y: usize| normalised[y * (width + 1) + x];
                let corners = [at(x, y), at(x + 1, y), at(x, y + 1)];
                let mut pixel = view.pixel(corners, |sub: usize, near: f32| {
                    let (column, row) = (x * SUB + sub % SUB, y * SUB + sub / SUB);
                    backdrop.near[row * width * SUB + column] = near;
                });
                if let Some(photo) = photo {
                    let share = Vector2::new(
                        (x as f32 + 0.5) / width as f32,
                        (y as f32 + 0.5) / height as f32,
                    );
                    let colour = photo.at(share);
                    pixel.base = colour * 0.5;
                    pixel.key = colour * 0.5;
                }
                let bytes = curve.bytes(&(pixel.base + pixel.key));
                backdrop.bytes[3 * (y * width + x)..][..3].copy_from_slice(&bytes);
                backdrop.pixels.push(pixel);
            }
        }
        backdrop
    }
}

struct View<'a> {
    camera: &'a Camera,
    room: &'a Room,
    eye: Point3<f32>,
}

impl View<'_> {
    /// Returns undistorted normalised points on a grid of pixel centres that has one more column and row than the picture; NaN outside the
    /// valid range of the lens.
    fn directions(&self, width: usize, height: usize) -> Vec<Point2<f32>> {
        let nothing = Point2::new(f32::NAN, f32::NAN);
        let at = |i: usize| {
            let pixel = Point2::new((i % (width + 1)) as f64, (i / (width + 1)) as f64);
            self.camera
                .undistort(&pixel)
                .map_or(nothing, |point| Point2::new(point.x as f32, point.y as f32))
        };
        (0..(width + 1) * (height + 1)).map(at).collect()
    }

    /// Returns the colour of a pixel as the mean of its samples.
    fn pixel(
        &self,
        [here, right, below]: [Point2<f32>; 3],
        mut set_near: impl FnMut(usize, f32),
    ) -> Pixel {
        let back = self.camera.camera_from_world.rotation.inverse().cast::<f32>();
        let light = &self.room.light;
        let (mut base, mut key, mut place) = (Linear::zeros(), Linear::zeros(), Vector3::zeros());
        for sub in 0..SUB * SUB {
            let off = Samples::place(sub % SUB, sub / SUB);
            let at = here + (right - here) * off.x + (below - here) * off.y;
            if !(at.x.is_finite() && at.y.is_finite()) {
                set_near(sub, 0.0);
                continue;
            }
            let hit = self.room.cast(&self.eye, &(back * at.coords.push(1.0)));
            set_near(sub, 1.0 / hit.along.max(1e-3));
            let (b, k) = lit(self.room, &hit, sub);
            base += b;
            key += k;
            place += hit.at;
        }
        let share = 1.0 / (SUB * SUB) as f32;
        let (across, to_lamp) = light.beam(&(place * share));
        Pixel {
            base: base * share,
            key: key * share,
            across,
            to_lamp,
        }
    }
}

/// Returns the ambient light and the light of the key lamp that a point reflects to the camera.
fn lit(room: &Room, hit: &Hit, sub: usize) -> (Linear, Linear) {
    if hit.shines {
        return (hit.colour, Linear::zeros());
    }
    let around = room.light.around(&hit.normal) * (1.0 - hit.dim);
    let direct = room.light.direct(&hit.normal);
    // Every sample uses a different part of the lamp, so that the edges of shadows are soft.
    let spread = 0.05;
    let [u, v] = [(sub % SUB) as f32 - 0.5, (sub / SUB) as f32 - 0.5];
    let towards = room.light.to_key + Vector3::new(u + v, u - v, 0.0) * spread;
    let key = if direct.sum() > 0.0 && !room.is_shaded(&(hit.at + hit.normal * 1e-3), &towards) {
        direct
    } else {
        Linear::zeros()
    };
    (
        hit.colour.component_mul(&around),
        hit.colour.component_mul(&key),
    )
}
