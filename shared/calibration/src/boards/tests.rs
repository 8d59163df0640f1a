//! Tests that print boards, photograph them with a simulated pinhole camera, and find them.

use nalgebra::{Matrix3, Point2};

use super::*;

/// Returns the grey value of a drawing at a point of the page (millimetres).
fn grey(drawing: &Drawing, at: [f64; 2]) -> f64 {
    let mut value = 235.0;
    for shape in &drawing.shapes {
        if let Shape::Rectangle {
            at: corner,
            size,
            is_black,
        } = shape
            && (0..2).all(|axis| at[axis] >= corner[axis] && at[axis] < corner[axis] + size[axis])
        {
            value = if *is_black { 25.0 } else { 235.0 };
        }
    }
    value
}

/// Returns a picture of a page: `map` converts pixels to millimetres of the page; the surroundings are grey.
fn photographed(drawing: &Drawing, map: &Matrix3<f64>, [width, height]: [usize; 2]) -> Picture {
    let mut random = fastrand::Rng::with_seed(5);
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let mut sum = 0.0;
            // Sixteen samples cover a pixel and a little of its neighbours, because no lens is sharper than that.
            for v in 0..4 {
                for u in 0..4 {
                    let offset = [u, v].map(|value| (f64::from(value) - 1.5) * 0.375);
                    let ray = map
                        * nalgebra::Vector3::new(x as f64 + offset[0], y as f64 + offset[1], 1.0);
                    let at = [ray.x / ray.z, ray.y / ray.z];
                    let is_on_page = (0..2).all(|i| at[i] >= 0.0 && at[i] < drawing.page[i]);
                    sum += if is_on_page { grey(drawing, at) } else { 120.0 };
                }
            }
            let noise = 4.0 * (random.f64() + random.f64() - 1.0);
            pixels.push((sum / 16.0 + noise).clamp(0.0, 255.0) as u8);
        }
    }
    Picture::new(width, height, pixels).unwrap()
}

/// Returns the map of a view with `scale` pixels per millimetre, rotated and tilted.
fn view(drawing: &Drawing, size: [usize; 2], scale: f64, angle: f64) -> Matrix3<f64> {
    let (sin, cos) = angle.sin_cos();
    let page_middle = Matrix3::new(
        1.0,
        0.0,
        -0.5 * drawing.page[0],
        0.0,
        1.0,
        -0.5 * drawing.page[1],
        0.0,
        0.0,
        1.0,
    );
    let tilt = 0.25 / drawing.page[0];
    let turned = Matrix3::new(
        scale * cos,
        -scale * sin,
        0.0,
        scale * sin,
        scale * cos,
        0.0,
        tilt,
        0.5 * tilt,
        1.0,
    );
    let middle = Matrix3::new(
        1.0,
        0.0,
        0.5 * size[0] as f64,
        0.0,
        1.0,
        0.5 * size[1] as f64,
        0.0,
        0.0,
        1.0,
    );
    middle * turned * page_middle
}

struct Shot {
    picture: Picture,
    /// True positions of the corners of the layout.
    truth: Vec<Point2<f64>>,
}

fn shot(text: &str, size: [usize; 2], angle: f64) -> Shot {
    let board: Board = text.parse().unwrap();
    let drawing = Drawing::new(&board, Paper::Fitting).unwrap();
    let scale = 0.62 * size[1] as f64 / drawing.page[0].max(drawing.page[1]);
    let pixel_from_page = view(&drawing, size, scale, angle);
    let page_from_pixel = pixel_from_page.try_inverse().unwrap();
    let layout = Layout::of(&board);
    let truth = layout.points.iter().map(|point| {
        let at = [0, 1].map(|axis| drawing.board_at[axis] + 1e3 * point[axis]);
        let seen = pixel_from_page * nalgebra::Vector3::new(at[0], at[1], 1.0);
        Point2::new(seen.x / seen.z, seen.y / seen.z)
    });
    Shot {
        picture: photographed(&drawing, &page_from_pixel, size),
        truth: truth.collect(),
    }
}

/// Returns the fraction of corners that were found, and the largest error in pixels.
fn compared(found: &Found, truth: &[Point2<f64>]) -> (f64, f64) {
    let errors = found.corners.iter().map(|corner| (corner.at - truth[corner.id]).norm());
    let share = found.corners.len() as f64 / truth.len() as f64;
    (share, errors.fold(0.0, f64::max))
}

fn finder(text: &str) -> Finder {
    Finder::new(&text.parse().unwrap())
}

#[test]
fn printed_boards_are_found_at_the_right_place() {
    for (text, size, angle) in [
        ("charuco:7x5:40mm", [640, 480], 0.3),
        ("charuco:4x6:54mm:5x5_250:legacy", [480, 640], 2.2),
        ("charuco:5x8:20mm:6x6_1000:marker=0.7", [640, 480], 4.0),
        ("chessboard:9x6:25mm", [640, 480], 0.3),
        ("chessboard:6x9:25mm", [640, 480], -0.4),
        ("aprilgrid:4x3:40mm", [640, 480], 1.0),
    ] {
        let shot = shot(text, size, angle);
        let found = finder(text).find(&shot.picture, Hints::default());
        let found = found.unwrap_or_else(|error| panic!("{text}: {error:?}"));
        let (share, worst) = compared(&found, &shot.truth);
        // The corners of tags are not crossings of four squares, so they shift because bright areas spread over dark ones.
        let limit = if text.starts_with("aprilgrid") {
            0.4
        } else {
            0.25
        };
        assert!(share > 0.95 && worst < limit, "{text}: {share} {worst}");
        assert_eq!((found.variant, found.is_inverted), (0, false), "{text}");
    }
}

#[test]
fn boards_in_inverted_and_mirrored_pictures_are_found_and_reported() {
    let text = "charuco:5x7:30mm";
    let shot = shot(text, [400, 400], 0.2);
    let inverted = finder(text).find(&shot.picture.inverted(), Hints::default());
    let inverted = inverted.unwrap();
    assert!(inverted.is_inverted && !inverted.is_mirrored);
    assert!(compared(&inverted, &shot.truth).1 < 0.3);
    let mirrored = finder(text).find(&shot.picture.mirrored(), Hints::default());
    let mirrored = mirrored.unwrap();
    assert!(mirrored.is_mirrored && !mirrored.is_inverted);
    let truth: Vec<Point2<f64>> =
        shot.truth.iter().map(|truth| Point2::new(399.0 - truth.x, truth.y)).collect();
    assert!(compared(&mirrored, &truth).1 < 0.3);
}

#[test]
fn confused_counts_and_patterns_are_named_in_the_error() {
    for (told, printed, said) in [
        (
            "charuco:7x5:30mm",
            "charuco:5x7:30mm",
            "5x7 squares, corners or tags, not 7x5",
        ),
        ("charuco:5x6:30mm", "charuco:5x6:30mm:legacy", "before 4.6"),
    ] {
        let finder = finder(told);
        let found = finder.find(&shot(printed, [400, 400], 0.2).picture, Hints::default());
        let note = finder.variants()[found.unwrap().variant].note.clone();
        assert!(
            note.as_ref().is_some_and(|note| note.contains(said)),
            "{note:?}"
        );
    }
    let shot = shot("chessboard:8x5:25mm", [400, 300], 0.1);
    let nothing = finder("chessboard:9x6:25mm").find(&shot.picture, Hints::default());
    assert_eq!(
        nothing,
        Err(Nothing::OtherGrid {
            columns: 8,
            rows: 5
        })
    );
}

#[test]
fn no_board_is_found_in_a_picture_without_one() {
    let noise = |seed| {
        let mut random = fastrand::Rng::with_seed(seed);
        let pixels = (0..120 * 90).map(|_| random.u8(..)).collect();
        Picture::new(120, 90, pixels).unwrap()
    };
    for text in [
        "charuco:5x7:30mm",
        "chessboard:9x6:25mm",
        "aprilgrid:4x3:40mm",
    ] {
        let finder = finder(text);
        finder.find(&noise(1), Hints::default()).unwrap_err();
        for side in [1, 2, 3, 8] {
            let tiny = Picture::new(side, side, vec![9; side * side]).unwrap();
            finder.find(&tiny, Hints::default()).unwrap_err();
        }
    }
}
