//! The readable reference rasteriser: intersects rays through the samples with every triangle.

use geometry::Camera;
use nalgebra::{Point2, Point3, Vector3};

use super::{Corner, NOTHING, Samples};

/// Returns the nearest triangle that a ray hits from its front, and the depth of the intersection.
pub(super) fn nearest_triangle(
    camera: &Camera,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    at: Point2<f64>,
) -> Option<(u32, f64)> {
    let ray = camera.ray(&at)?;
    let mut best: Option<(u32, f64)> = None;
    for (index, corners) in triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        let normal = (b - a).cross(&(c - a));
        let facing = normal.dot(&ray.direction);
        if facing >= 0.0 {
            continue;
        }
        let along = normal.dot(&(a - ray.origin)) / facing;
        let p = ray.origin + ray.direction.into_inner() * along;
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (to - from).cross(&(p - from)).dot(&normal) >= 0.0);
        let depth = (camera.camera_from_world * p).z;
        if inside && along > 0.0 && best.is_none_or(|best| depth < best.1) {
            best = Some((index as u32, depth));
        }
    }
    best
}

mod tests {
    use super::*;
    use crate::body::Bones;
    use crate::mesh;
    use crate::rigs;
    use crate::subject::Subject;

    /// Tests a whole person through a lens with distortion.
    #[test]
    fn the_depth_buffer_agrees_with_ray_casting() {
        let rig = rigs::humaneva().unwrap();
        let mut camera = rig.cameras()[0].clone();
        // The picture is much smaller, 64 x 48, so that every sample can be checked.
        let intrinsics = &mut camera.intrinsics;
        for value in [
            &mut intrinsics.fx,
            &mut intrinsics.fy,
            &mut intrinsics.cx,
            &mut intrinsics.cy,
        ] {
            *value /= 10.0;
        }
        let subject = Subject::new(2);
        let (_, mesh) = mesh::of(&subject, &Bones::new(&subject.proportions));
        let up = Vector3::new(0.0, 0.0, 0.95);
        let points: Vec<Point3<f64>> =
            mesh.points.iter().map(|point| point.cast::<f64>() + up).collect();
        let corner = |at: &Point3<f64>| {
            let pixel = camera.project(at).unwrap();
            let depth = (camera.camera_from_world * at).z;
            Corner::new(pixel.x as f32, pixel.y as f32, 1.0 / depth as f32)
        };
        let corners: Vec<Corner> = points.iter().map(corner).collect();
        let mut samples = Samples::default();
        samples.begin(128, 96, &vec![0.0; 128 * 96]);
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            samples.draw(
                index as u32,
                triangle.map(|triangle| &corners[triangle as usize]),
            );
        }
        let (mut n_seen, mut n_edge) = (0, 0);
        for row in (0..96).step_by(2) {
            for column in (0..128).step_by(2) {
                let place = Samples::place(column, row).cast::<f64>();
                let ray = nearest_triangle(&camera, &points, &mesh.triangles, place);
                let index = row * 128 + column;
                let found = (samples.triangle[index] != NOTHING)
                    .then(|| 1.0 / f64::from(samples.near[index]));
                match (ray, found) {
                    (Some((_, ray)), Some(found)) => {
                        n_seen += 1;
                        // A sample on the outline may get a different triangle.
                        n_edge += usize::from((ray - found).abs() > 2e-3);
                    }
                    (None, None) => {}
                    _ => n_edge += 1,
                }
            }
        }
        assert!(n_seen > 150, "{n_seen} samples of the person");
        assert!(n_edge <= n_seen / 100, "{n_edge} of {n_seen} differ");
    }
}
