//! Draws overlays of a view: its single-view pose, the fused poses of all people, the extra keypoints, and the epipolar lines of one part.

use footage::{ACCENT, CENTRE, Canvas, FAINT, Limb, Side, Size, draw_limbs, line_width};
use geometry::epipolar::epipolar_curve;
use messages::{FusedView, MAX_PARTS, Status};
use nalgebra::{Point2, Point3};

use crate::{FrameRecord, Scene, own, pose3d};

/// Number of points on one epipolar line.
const N_POINTS: usize = 64;

/// Draws a view that has a picture.
///
/// * `part`: index of the part whose epipolar lines are drawn, counted from 0.
pub(crate) fn draw(
    scene: &Scene,
    record: &FrameRecord,
    view: usize,
    part: usize,
) -> Option<Canvas> {
    let picture = record.views.get(view)?.picture.as_ref()?;
    let size = Size::new(picture.size[0], picture.size[1]);
    if picture.rgb.len() != size.rgb_bytes() {
        return None;
    }
    let mut canvas = Canvas::from_rgb(size, &picture.rgb);
    draw_lines(&mut canvas, scene, record, view, part);
    draw_single(&mut canvas, scene, record, view);
    for fused in fused(record, view) {
        let parts = &fused.centres_px[..(fused.n_parts as usize).min(MAX_PARTS)];
        if let Some(joints) = scene.joints_of(parts) {
            draw_limbs(&mut canvas, &joints, &limbs(scene));
        }
        if let Some(at) = centre(fused, part) {
            let width = line_width(size);
            canvas.ring(at, 10.0 / 3.0 * width, width, ACCENT);
        }
    }
    draw_keypoints(&mut canvas, scene, record, view);
    let followed = record.fused(view).filter(|_| !scene.has_maps);
    let facing = match followed.map(|fused| fused.exchanged) {
        Some(1) => ", from behind",
        _ => "",
    };
    let text = format!("{} {}{facing}", scene.views[view].name, record.frame());
    canvas.label([2.0, 2.0], &text, CENTRE);
    Some(canvas)
}

/// Returns two thirds of the line width of fused poses: one pixel in a small picture.
fn thin(canvas: &Canvas) -> f64 {
    line_width(canvas.size()) / 1.5
}

/// Returns the poses of all people in a view.
fn fused(record: &FrameRecord, view: usize) -> impl Iterator<Item = &FusedView> {
    let people = record.skeletons.listed().iter();
    let poses = people.filter_map(move |person| person.listed_views().get(view));
    poses.filter(|fused| fused.status == Status::OK)
}

/// Returns the position of a part; `None` if it is unknown.
fn centre(fused: &FusedView, part: usize) -> Option<[f64; 2]> {
    let n_parts = (fused.n_parts as usize).min(MAX_PARTS);
    let centre = fused.centres_px[..n_parts].get(part).copied();
    centre.filter(|centre| centre.iter().all(|side| side.is_finite()))
}

fn draw_single(canvas: &mut Canvas, scene: &Scene, record: &FrameRecord, view: usize) {
    let Some(best) = own::followed(scene, record, view) else {
        return;
    };
    let width = thin(canvas);
    let centres = best.centres_px;
    if let Some(joints) = scene.joints_of(&centres) {
        for &(from, to) in scene.joints.limbs {
            let ends = [joints[from], joints[to]];
            if ends.as_flattened().iter().all(|side| side.is_finite()) {
                canvas.line(ends[0], ends[1], width, FAINT);
            }
        }
    }
    for centre in centres.into_iter().filter(|at| at[0].is_finite()) {
        canvas.disc(centre, 1.2 * width, FAINT);
    }
}

/// Draws the extra keypoints of all people.
fn draw_keypoints(canvas: &mut Canvas, scene: &Scene, record: &FrameRecord, view: usize) {
    let camera = scene.views[view].framing.camera();
    let width = line_width(canvas.size());
    let people = record.skeletons.listed().iter();
    for (name, it) in people.flat_map(|person| pose3d::keypoints(scene, person)) {
        let place = pose3d::is_placed(it).then(|| Point3::from(it.in_world));
        if let Some(at) = place.and_then(|place| camera.project(&place)) {
            canvas.disc(at.into(), 1.5 * width, side_of(name).colour());
        }
    }
}

fn side_of(name: &str) -> Side {
    if name.starts_with("right") {
        Side::Right
    } else if name.starts_with("left") {
        Side::Left
    } else {
        Side::Centre
    }
}

/// Draws the epipolar lines on which the part of the followed person must be, according to every other view. The lines of all people would
/// cover the picture.
fn draw_lines(canvas: &mut Canvas, scene: &Scene, record: &FrameRecord, view: usize, part: usize) {
    let to = scene.views[view].framing.camera();
    for other in (0..scene.views.len()).filter(|i| *i != view) {
        if let Some(at) = record.fused(other).and_then(|fused| centre(fused, part)) {
            let point = Point2::from(at);
            let curve = epipolar_curve(scene.views[other].framing.camera(), to, &point, N_POINTS);
            let curve: Vec<[f64; 2]> = curve.iter().map(|curve| [curve.x, curve.y]).collect();
            canvas.polyline(&curve, thin(canvas), ACCENT);
        }
    }
}

fn limbs(scene: &Scene) -> Vec<Limb> {
    let side = |joint: usize| match scene.joints.joints[joint].parts {
        [one] => side_of(skeleton::PART_NAMES[*one]),
        _ => Side::Centre,
    };
    let limbs = scene.joints.limbs.iter();
    limbs
        .map(|&(from, to)| Limb {
            from,
            to,
            side: if side(from) == Side::Centre {
                side(to)
            } else {
                side(from)
            },
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Picture;
    use crate::testing::{record, scene};

    fn with_picture() -> FrameRecord {
        let mut it = record(0);
        it.views[0].picture = Some(Picture {
            size: [80, 60],
            rgb: vec![0; 80 * 60 * 3],
        });
        it
    }

    #[test]
    fn a_view_without_a_picture_is_not_drawn() {
        assert!(draw(&scene(), &with_picture(), 1, 0).is_none());
    }

    #[test]
    fn a_picture_of_another_size_than_it_says_is_not_drawn() {
        let mut it = with_picture();
        if let Some(picture) = &mut it.views[0].picture {
            picture.rgb.pop();
        }
        assert!(draw(&scene(), &it, 0, 0).is_none());
    }

    #[test]
    fn an_overlay_is_not_empty() {
        let canvas = draw(&scene(), &with_picture(), 0, 0).unwrap();
        assert!(canvas.rgb().iter().any(|value| *value > 0));
    }

    #[test]
    fn extra_keypoints_are_drawn_at_their_pixels() {
        let mut scene = scene();
        let mut record = with_picture();
        let without = draw(&scene, &record, 0, 0).unwrap();
        scene.extra_keypoints = vec!["right heel".to_owned(), "nose".to_owned()];
        record.skeletons.people[0].n_keypoints = 2;
        record.skeletons.people[0].keypoints[0].in_world = [0.1, 0.1, 1.0];
        record.skeletons.people[0].keypoints[1].status = Status::TOO_FEW_VIEWS;
        let with = draw(&scene, &record, 0, 0).unwrap();
        let pixels = |canvas: &Canvas| -> Vec<[u8; 3]> { canvas.rgb().as_chunks().0.to_vec() };
        let (with, without) = (pixels(&with), pixels(&without));
        let changed: Vec<usize> = (0..with.len()).filter(|&i| with[i] != without[i]).collect();
        assert!(!changed.is_empty());
        // A pixel of the frame covers two by two pixels of the footage. The centre of the footage is at (79.5, 59.5). The point is 4 m
        // away.
        for it in changed {
            let (x, y) = ((it % 80) as f64, (it / 80) as f64);
            let off = (x - 41.5).hypot(y - 31.5);
            assert!(off < 4.0, "({x}, {y})");
        }
    }

    #[test]
    fn every_person_is_drawn() {
        let scene = scene();
        let mut record = with_picture();
        let one = draw(&scene, &record, 0, 0).unwrap();
        let frame = &mut record.skeletons;
        (frame.n_people, frame.people[1]) = (2, frame.people[0]);
        frame.people[1].views[0].centres_px[0] = [60.0, 45.0];
        let both = draw(&scene, &record, 0, 0).unwrap();
        let colour = |canvas: &Canvas| {
            let pixels = canvas.rgb().as_chunks::<3>().0;
            let near = (40..50).flat_map(|y| (55..66).map(move |x| pixels[80 * y + x]));
            near.filter(|rgb| *rgb != [0; 3]).count()
        };
        assert!(colour(&both) > colour(&one), "the ring of the second");
    }

    #[test]
    fn limbs_are_coloured_by_the_side_of_the_body() {
        let limbs = limbs(&scene());
        // These limbs go from right ankle to right knee, from left hip to neck, and from neck to head.
        assert_eq!(limbs[0].side, Side::Right);
        assert_eq!(limbs[5].side, Side::Left);
        assert_eq!(limbs[13].side, Side::Centre);
    }
}
