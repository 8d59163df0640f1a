//! Tests how drawing changes pixels.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use footage::{
    CENTRE, Canvas, LEFT, Limb, OverlayError, RIGHT, Side, Size, Tile, compose, draw_limbs,
    text_width,
};
use proptest::prelude::*;

const SIZE: Size = Size::new(40, 30);
const INK: [u8; 3] = [200, 100, 50];

fn black() -> Canvas {
    Canvas::new(SIZE, [0; 3])
}

fn pixel(canvas: &Canvas, x: usize, y: usize) -> [u8; 3] {
    let at = (y * canvas.size().width + x) * 3;
    canvas.rgb()[at..at + 3].try_into().unwrap()
}

/// Returns the amount of colour on a black picture, as a number of fully coloured pixels.
fn amount(canvas: &Canvas) -> f64 {
    let reds = canvas.rgb().iter().step_by(3);
    reds.map(|&red| f64::from(red)).sum::<f64>() / f64::from(INK[0])
}

#[test]
fn a_line_has_the_requested_width_and_ends() {
    const GROUND: [u8; 3] = [90, 120, 150];
    let mut canvas = Canvas::new(SIZE, GROUND);
    canvas.line([5.0, 10.0], [30.0, 10.0], 3.0, INK);
    for (x, y, expect) in [
        (5, 10, INK),
        (30, 10, INK),
        (17, 9, INK),
        (17, 11, INK),
        (17, 8, GROUND),
        (17, 12, GROUND),
        (17, 7, GROUND),
        (17, 13, GROUND),
        (3, 10, GROUND),
        (32, 10, GROUND),
    ] {
        assert_eq!(pixel(&canvas, x, y), expect, "{x}, {y}");
    }
}

#[test]
fn edges_between_pixels_are_smoothed() {
    let mut canvas = black();
    canvas.line([5.0, 10.5], [30.0, 10.5], 1.0, INK);
    assert_eq!(pixel(&canvas, 17, 10), [100, 50, 25]);
    assert_eq!(pixel(&canvas, 17, 11), [100, 50, 25]);
}

#[test]
fn a_disc_is_filled_and_a_ring_is_hollow() {
    let mut canvas = black();
    canvas.disc([20.0, 15.0], 8.0, INK);
    let area = std::f64::consts::PI * 64.0;
    assert!(
        (amount(&canvas) - area).abs() < 0.02 * area,
        "{}",
        amount(&canvas)
    );
    let mut canvas = black();
    canvas.ring([20.0, 15.0], 8.0, 2.0, INK);
    assert_eq!(pixel(&canvas, 20, 15), [0; 3]);
    assert_eq!(pixel(&canvas, 28, 15), INK);
    assert_eq!(pixel(&canvas, 31, 15), [0; 3]);
}

#[test]
fn the_outline_of_a_box_does_not_fill_it() {
    let mut canvas = black();
    canvas.frame([5.0, 5.0, 20.0, 15.0], 1.0, INK);
    for (x, y) in [(5, 5), (20, 5), (20, 15), (5, 15), (12, 5), (5, 10)] {
        assert_eq!(pixel(&canvas, x, y), INK, "{x}, {y}");
    }
    assert_eq!(pixel(&canvas, 12, 10), [0; 3]);
}

#[test]
fn text_has_its_computed_width_and_shows_its_characters() {
    let drawn = |text: &str| {
        let mut canvas = Canvas::new(Size::new(100, 20), [90; 3]);
        canvas.text([2.0, 2.0], text, [255; 3]);
        canvas
    };
    assert_ne!(drawn("ab"), drawn("ba"));
    assert_eq!(drawn("\u{fc}"), drawn("?"));
    let end = 2 + text_width("abc") + 1;
    let canvas = drawn("abc");
    assert!((0..20).all(|y| (end..100).all(|x| pixel(&canvas, x, y) == [90; 3])));
}

#[test]
fn limbs_have_the_colour_of_their_side_and_missing_points_are_left_out() {
    let points = [
        [5.0, 5.0],
        [5.0, 25.0],
        [15.0, 5.0],
        [15.0, 25.0],
        [25.0, 5.0],
        [25.0, 25.0],
        [f64::NAN, 3.0],
    ];
    let limb = |from, to, side| Limb { from, to, side };
    let mut canvas = black();
    draw_limbs(
        &mut canvas,
        &points,
        &[
            limb(0, 1, Side::Left),
            limb(2, 3, Side::Right),
            limb(4, 5, Side::Centre),
        ],
    );
    assert_eq!(pixel(&canvas, 5, 15), LEFT);
    assert_eq!(pixel(&canvas, 15, 15), RIGHT);
    assert_eq!(pixel(&canvas, 25, 15), CENTRE);
    let mut nothing = black();
    draw_limbs(
        &mut nothing,
        &points,
        &[limb(0, 6, Side::Left), limb(1, 7, Side::Left)],
    );
    assert_eq!(nothing, black());
}

#[test]
fn a_composed_sheet_contains_every_picture() {
    let colours = [[10, 0, 0], [0, 20, 0], [0, 0, 30]];
    let pictures = colours.map(|colour| Canvas::new(SIZE, colour));
    let small = Canvas::new(Size::new(7, 9), INK);
    let mut tiles: Vec<Tile<'_>> = pictures
        .iter()
        .map(|picture| Tile {
            picture,
            caption: "a caption that is far too long",
        })
        .collect();
    tiles.push(Tile {
        picture: &small,
        caption: "",
    });
    for n_columns in 1..6 {
        let sheet = compose(&tiles, n_columns);
        let count = |colour| {
            sheet.rgb().as_chunks::<3>().0.iter().filter(|pixel| **pixel == colour).count()
        };
        for colour in colours {
            assert_eq!(
                count(colour),
                SIZE.width * SIZE.height,
                "{n_columns} columns"
            );
        }
        assert_eq!(count(INK), 7 * 9, "{n_columns} columns");
    }
}

#[test]
fn a_saved_picture_is_read_back_and_no_other_file_remains() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.png");
    std::fs::write(&path, "an older file").unwrap();
    let mut canvas = black();
    canvas.disc([20.0, 15.0], 8.0, INK);
    canvas.save_png(&path).unwrap();
    assert_eq!(
        image::open(&path).unwrap().into_rgb8().as_raw(),
        canvas.rgb()
    );
    let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(files.len(), 1);
}

#[test]
fn errors_of_saving_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let error = black().save_png(&folder.path().join("absent/view.png")).unwrap_err();
    assert!(matches!(error, OverlayError::Io { .. }));
    assert!(error.to_string().contains("absent/view.png"), "{error}");
    let empty = Canvas::new(Size::new(0, 0), [0; 3]);
    let error = empty.save_png(&folder.path().join("empty.png")).unwrap_err();
    assert!(matches!(error, OverlayError::Encode { .. }), "{error}");
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        -50.0..90.0,
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(1e300),
        Just(-1e300)
    ]
}

/// Returns a coordinate to the right of the picture, so that the point is outside regardless of its other coordinate.
fn outside() -> impl Strategy<Value = f64> {
    prop_oneof![
        80.0..1000.0,
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(1e300)
    ]
}

proptest! {
    #[test]
    fn drawing_in_the_background_colour_does_not_change_pixels(
        a in [coordinate(), coordinate()], b in [coordinate(), coordinate()],
        width in prop_oneof![0.0..20.0, Just(f64::NAN), Just(1e300)],
    ) {
        let ground = Canvas::new(SIZE, INK);
        let mut canvas = ground.clone();
        canvas.line(a, b, width, INK);
        canvas.disc(a, width, INK);
        canvas.ring(a, width, width, INK);
        canvas.frame([a[0], a[1], b[0], b[1]], width, INK);
        prop_assert!(canvas == ground);
        // Text has a dark edge, so this only checks that nothing panics.
        canvas.text(a, "text", INK);
    }

    #[test]
    fn shapes_outside_of_the_picture_do_not_change_pixels(
        a in (outside(), coordinate()), b in (outside(), coordinate()), width in 0.0..20.0,
    ) {
        let (a, b) = (<[f64; 2]>::from(a), <[f64; 2]>::from(b));
        let mut canvas = black();
        canvas.line(a, b, width, INK);
        canvas.disc(a, width, INK);
        canvas.ring(a, width, width, INK);
        canvas.frame([a[0], a[1], b[0], b[1]], width, INK);
        canvas.text(a, "text", INK);
        prop_assert!(canvas == black());
    }

    #[test]
    fn a_line_moved_by_whole_pixels_looks_the_same(
        x1 in 2.0..20.0, y1 in 2.0..20.0, x2 in 2.0..20.0, y2 in 2.0..20.0, width in 0.5..4.0,
    ) {
        let (mut here, mut there) = (black(), black());
        here.line([x1, y1], [x2, y2], width, INK);
        there.line([x1 + 8.0, y1 + 5.0], [x2 + 8.0, y2 + 5.0], width, INK);
        for (x, y) in (0..24).flat_map(|x| (0..24).map(move |y| (x, y))) {
            let (one, other) = (pixel(&here, x, y), pixel(&there, x + 8, y + 5));
            let same = one.iter().zip(&other).all(|(a, b)| a.abs_diff(*b) <= 1);
            prop_assert!(same, "{one:?} {other:?} at {x}, {y}");
        }
    }
}
